"""Dynamic extension: integrators in front of inputs until the decoupling matrix is invertible (Isidori, sec. 5.4)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import sympy as sp

from ulna.base import Status, Verdict
from ulna.geometry import RelativeDegree, relative_degree_of
from ulna.plants import PlantLike, as_plant
from ulna.symbolic.exact import SampledZero, generic_rank, in_span, is_zero, rank_at, solve_linear, tidy, time_budget
from ulna.symbolic.formulas import formula
from ulna.system import Signal, System, control_affine, equilibrium_in_numbers

_QUICK = SampledZero(seconds=0.3)
_CLAIM = "dynamic extension makes the decoupling matrix invertible"


@dataclass(frozen=True, slots=True, kw_only=True)
class DynamicExtension:
    """A plant with integrators in front of some inputs, so that its outputs can be decoupled.

    Attributes:
        plant: the plant; outputs: (m,) the functions of its state to be decoupled.
        system: the extended plant, None unless the verdict holds. Its outputs are the plant's.
        added: symbols of the states added.
        feedback: (m,) the plant's inputs as functions of the extended state and the new inputs.
        indices: (m,) relative degrees of the extended plant.
        decoupling: its decoupling matrix (m, m).
        singular: its determinant: where it vanishes, the extended plant has a singularity, often a new one.
        at_point: whether it is invertible at the operating point.
        complete: whether Σ r is the dimension of the extended plant: then it has no zero dynamics and is linearised
            as a whole.
        verdict: on "dynamic extension makes the decoupling matrix invertible".
    """

    plant: System
    outputs: tuple[sp.Expr, ...]
    verdict: Verdict
    at_point: Verdict
    complete: Verdict
    system: System | None = None
    added: tuple[sp.Symbol, ...] = ()
    feedback: tuple[sp.Expr, ...] = ()
    indices: tuple[int, ...] = ()
    decoupling: sp.ImmutableDenseMatrix | None = None
    singular: sp.Expr | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Stage:
    """The plant extended so far, its own inputs in terms of the stage's states and inputs, names of new inputs."""

    system: System
    feedback: tuple[sp.Expr, ...]
    added: tuple[sp.Symbol, ...]
    renamed: frozenset[str]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Compression:
    """u_J = w + shift − mixing · u_rest makes the dependent rows depend on w alone.

    Attributes:
        columns: J; mixing: (|J|, m), zero in the columns J; shift: (|J|, 1).
    """

    columns: tuple[int, ...]
    mixing: sp.MatrixBase
    shift: sp.MatrixBase


def dynamic_extension(
    system: PlantLike, *, outputs: Sequence[sp.Expr] | None = None, seconds: float = 8.0
) -> DynamicExtension:
    """The dynamic extension algorithm for a square plant with two or more inputs.

    While the decoupling matrix is singular: among the outputs whose rows are dependent, the inputs they share are
    found (after a static feedback that removes the other inputs from these rows) and get an integrator.

    Args:
        system: as many outputs as inputs.
        outputs: (m,) functions of the state instead of the system's own outputs.
        seconds: s, for everything together.

    Returns:
        With a verdict refuted for a single input (dynamic feedback linearises such a plant only if static feedback
        does: Charlet, Lévine and Marino, Systems & Control Letters 13 (1989)) and for plants whose outputs cannot be
        steered independently.

    Examples:
        >>> ulna.dynamic_extension("unicycle").verdict.holds
        True
    """
    system = as_plant(system)
    functions = tuple(control_affine(system).h) if outputs is None else tuple(outputs)
    m = len(system.inputs)
    refusal = _refusal(system, len(functions))
    if refusal is not None:
        return _none(system, functions, refusal)
    start = _Stage(system=system, feedback=tuple(system.input_symbols), added=(), renamed=frozenset())
    limit = m * len(system.states)
    with time_budget(seconds):
        return _extended(start, functions, limit)
    return _none(system, functions, Verdict.undecided(_CLAIM, reason=f"out of time after {seconds:g} s"))


def _refusal(system: System, outputs: int) -> Verdict | None:
    m = len(system.inputs)
    if m == 1:
        reason = "with a single input dynamic feedback linearises only what static feedback does"
        return Verdict.refuted(_CLAIM, reason=reason, source="Charlet, Lévine and Marino 1989")
    if not m or not outputs:
        return Verdict.undecided(_CLAIM, reason=f"the plant has no {'output' if m else 'input'}")
    if outputs != m:
        reason = f"{outputs} outputs and {m} inputs: as many outputs as inputs are needed"
        return Verdict.refuted(_CLAIM, reason=reason) if outputs > m else Verdict.undecided(_CLAIM, reason=reason)
    return None


def _extended(stage: _Stage, outputs: tuple[sp.Expr, ...], limit: int) -> DynamicExtension:
    plant = stage.system
    n = len(plant.states)
    for _ in range(limit + 1):
        degree = _degree(stage.system, outputs)
        if None in degree.per_output:
            names = [formula(h) for h, r in zip(outputs, degree.per_output, strict=True) if r is None]
            reason = f"no input ever reaches {', '.join(names)}"
            return _none(plant, outputs, Verdict.refuted(_CLAIM, reason=reason))
        if degree.invertible.holds:
            return _found(plant, outputs, stage, degree)
        if not degree.invertible.fails:
            return _none(plant, outputs, Verdict.undecided(_CLAIM, reason="the rank of the decoupling matrix"))
        if sum(r for r in degree.per_output if r is not None) > len(stage.system.states) + n:
            break
        compression = _compression(degree)
        if compression is None:
            return _none(plant, outputs, Verdict.undecided(_CLAIM, reason="no feedback that compresses the inputs"))
        stage = _with_integrators(stage, compression)
        if len(stage.added) > limit:
            break
    reason = f"still singular after {len(stage.added)} integrators: the outputs cannot be steered independently"
    return _none(plant, outputs, Verdict.refuted(_CLAIM, reason=reason, integrators=len(stage.added)))


def _degree(system: System, outputs: tuple[sp.Expr, ...]) -> RelativeDegree:
    return relative_degree_of(outputs, control_affine(system), point=equilibrium_in_numbers(system).states)


def _compression(degree: RelativeDegree) -> _Compression | None:
    """The simplest choice of inputs that the dependent rows share."""
    A = sp.Matrix(degree.decoupling)
    rows = _dependent_rows(A)
    part = A.extract(rows, list(range(A.cols)))
    rank = generic_rank(part, seconds=0.3).value
    best: tuple[tuple[int, int], _Compression] | None = None
    for columns in combinations(range(A.cols), rank):
        chosen = part.extract(list(range(part.rows)), list(columns))
        own = generic_rank(chosen, seconds=0.0)
        if own.value < rank:
            continue
        mixing = _mixing(part, chosen, columns, own.rows)
        if mixing is None:
            continue
        simplicity = (sum(int(sp.count_ops(e)) + (e != 0) for e in mixing), sum(columns))
        if best is None or simplicity < best[0]:
            alpha = sp.Matrix([degree.lie_chain[i][-1] for i in rows])
            best = simplicity, _Compression(columns=columns, mixing=mixing, shift=_shift(chosen, alpha))
    return None if best is None else best[1]


def _dependent_rows(A: sp.MatrixBase) -> list[int]:
    """Rows that take part in a linear relation: leaving one out does not lower the rank."""
    rank = generic_rank(A, seconds=0.3).value
    others = [[k for k in range(A.rows) if k != i] for i in range(A.rows)]
    return [
        i for i in range(A.rows) if generic_rank(A.extract(others[i], list(range(A.cols))), seconds=0.0).value == rank
    ]


def _mixing(
    part: sp.MatrixBase, chosen: sp.MatrixBase, columns: Sequence[int], rows: Sequence[int]
) -> sp.MatrixBase | None:
    """C with part[:, rest] = chosen · C."""
    mixing = sp.zeros(len(columns), part.cols)
    for j in range(part.cols):
        if j in columns or all(e == 0 for e in part[:, j]):
            continue
        found = solve_linear(
            chosen.extract(list(rows), list(range(chosen.cols))), part.extract(list(rows), [j]), seconds=1.0
        )
        if found.solution is None or in_span(part[:, j], chosen, seconds=0.2).fails:
            return None
        for i in range(len(columns)):
            mixing[i, j] = tidy(found.solution[i, 0], seconds=0.2)
    return mixing


def _shift(chosen: sp.MatrixBase, alpha: sp.MatrixBase) -> sp.MatrixBase:
    """What the chosen inputs can take off the drifts: the terms that all rows have in common, for a shorter result."""
    shift = sp.zeros(chosen.cols, 1)
    for j in range(chosen.cols):
        touched = [i for i in range(chosen.rows) if chosen[i, j] != 0]
        if any(chosen[i, k] != 0 for i in touched for k in range(chosen.cols) if k != j):
            continue
        quotients = [set(sp.Add.make_args(sp.expand(tidy(alpha[i] / chosen[i, j], seconds=0.2)))) for i in touched]
        common = set.intersection(*quotients) if quotients else set()
        shift[j] = -sp.Add(*common)
    return shift


def _with_integrators(stage: _Stage, compression: _Compression) -> _Stage:
    """The next stage: u_J = ξ + shift − mixing · u_rest with ξ' = w."""
    system = stage.system
    taken = {s.name for s in (*system.states, *system.inputs, *system.parameters, *system.definitions)}
    places = list(compression.columns)
    states = _state_names(system, len(places), taken)
    names = [name if (name := system.inputs[j].name) in stage.renamed else _input_name(name, taken) for j in places]
    u = list(system.input_symbols)
    values: dict[sp.Symbol, sp.Expr] = {}
    for k, j in enumerate(places):
        mixed = sum((compression.mixing[k, i] * u[i] for i in range(len(u)) if i not in places), sp.Integer(0))
        values[u[j]] = states[k].symbol + compression.shift[k] - mixed
    inputs = list(system.inputs)
    for k, j in enumerate(places):
        inputs[j] = Signal(name=names[k], text=f"rate of {states[k].name}")
    rates = [r.xreplace(values) for r in system.inline(system.rates)]
    extended = replace(
        system,
        name=system.name if stage.added else f"{system.name}, extended",
        states=(*system.states, *states),
        rates=(*(_clean(r) for r in rates), *(inputs[j].symbol for j in places)),
        inputs=tuple(inputs),
        readouts=system.inline(system.readouts),
        definitions=(),
        operating_point=_moved_point(system, compression, states, places),
    )
    return _Stage(
        system=extended,
        feedback=tuple(e.xreplace(values) for e in stage.feedback),
        added=(*stage.added, *(s.symbol for s in states)),
        renamed=stage.renamed | set(names),
    )


def _clean(rate: sp.Expr) -> sp.Expr:
    return sp.Integer(0) if is_zero(rate, test=_QUICK).holds else tidy(rate, seconds=0.15)


def _moved_point(
    system: System, compression: _Compression, states: Sequence[Signal], places: Sequence[int]
) -> tuple[tuple[str, sp.Expr], ...]:
    """The operating point with the value of each new state: what the input was there."""
    base = equilibrium_in_numbers(system)
    point = {**base.where, **base.inputs}
    u = list(system.input_symbols)
    given = [(s.name, base.states[s.symbol]) for s in system.states]
    for k, j in enumerate(places):
        mixed = sum((compression.mixing[k, i] * u[i] for i in range(len(u)) if i not in places), sp.Integer(0))
        value = (u[j] - compression.shift[k] + mixed).xreplace(point)
        if value.is_number and not value.has(sp.nan, sp.zoo, sp.oo):
            given.append((states[k].name, value))
    return tuple(given)


def _state_names(system: System, count: int, taken: set[str]) -> tuple[Signal, ...]:
    """Signals x7, x8, … after x1 … x6, else xi1, xi2 and so on."""
    n = len(system.states)
    names = [s.name for s in system.states]
    stem = names[0].rstrip("0123456789")
    first = n + 1 if names == [f"{stem}{k + 1}" for k in range(n)] else 1
    if first == 1:
        stem = "xi"
        while any(name.startswith(stem) and name[len(stem) :].isdigit() for name in taken - set(names)):
            stem += "_"
        first = 1 + sum(name.startswith(stem) and name[len(stem) :].isdigit() for name in names)
    found = []
    for k in range(count):
        name = f"{stem}{first + k}"
        while name in taken:
            name += "_"
        taken.add(name)
        found.append(Signal(name=name, text="state of the extension"))
    return tuple(found)


def _input_name(old: str, taken: set[str]) -> str:
    """w1 in place of u1, w_F in place of F."""
    name = "w" + old[1:] if old.rstrip("0123456789") == "u" else f"w_{old}"
    while name in taken:
        name += "_"
    taken.add(name)
    return name


def _found(plant: System, outputs: tuple[sp.Expr, ...], stage: _Stage, degree: RelativeDegree) -> DynamicExtension:
    indices = tuple(r for r in degree.per_output if r is not None)
    total, n = sum(indices), len(stage.system.states)
    claim = "the extended plant is linearised as a whole"
    make = Verdict.proved if total == n else Verdict.refuted
    complete = make(claim, relative_degrees=indices, states=n)
    if degree.certainty.status is not Status.PROVED and total == n:
        complete = Verdict.supported(claim, relative_degrees=indices, states=n)
    local = rank_at(degree.decoupling, equilibrium_in_numbers(stage.system).where, seconds=0.3)
    said = "the extended plant's decoupling matrix is invertible at the operating point"
    singular = None if degree.singular is None else tidy(degree.singular)
    if not local.verdict.holds:
        at_point = Verdict.undecided(said, **local.verdict.evidence)
    else:
        make = Verdict.proved if local.value == len(outputs) else Verdict.refuted
        at_point = make(said, singular=singular, point=equilibrium_in_numbers(stage.system).states)
    verdict = Verdict.proved(
        _CLAIM, states_added=tuple(str(s) for s in stage.added), relative_degrees=indices, singular=singular
    )
    if not stage.added:
        verdict = Verdict.proved(_CLAIM, reason="it is invertible without extension", relative_degrees=indices)
    return DynamicExtension(
        plant=plant,
        outputs=outputs,
        system=stage.system,
        added=stage.added,
        feedback=tuple(tidy(e, seconds=0.2) for e in stage.feedback),
        indices=indices,
        decoupling=degree.decoupling,
        singular=singular,
        at_point=at_point,
        complete=complete,
        verdict=verdict,
    )


def _none(plant: System, outputs: tuple[sp.Expr, ...], verdict: Verdict) -> DynamicExtension:
    open_ = Verdict.undecided("the extended plant is known", because=verdict.claim)
    return DynamicExtension(plant=plant, outputs=outputs, verdict=verdict, at_point=open_, complete=open_)
