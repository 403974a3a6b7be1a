"""Comparators for outputs, laws and changes of coordinates: what is wrong with a value, None if nothing is."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import mpmath
import sympy as sp
from answer_facts import Facts, number, rank, vanishes

Answers = Mapping[str, Any]
Check = Callable[[str, Facts, Mapping[str, Any], Answers], str | None]


def _parsed(plant: Facts, texts: Any) -> list[sp.Expr]:
    """Formulas of a list, blocks one after the other."""
    flat = [t for part in texts for t in (part if isinstance(part, list | tuple) else [part])]
    return [plant.parse(t) for t in flat]


def _matrix(key: str, plant: Facts, found: Mapping[str, Any], known: Answers) -> str | None:
    expected = sp.Matrix([[plant.parse(e) for e in row] for row in known[key]])
    value = sp.Matrix(found[key])
    if value.shape != expected.shape:
        return f"shape {value.shape} instead of {expected.shape}"
    return None if vanishes(list(value - expected), plant.samples()) else f"{value.tolist()} is another matrix"


def _determinant(key: str, plant: Facts, found: Mapping[str, Any], known: Answers) -> str | None:
    difference = sp.Matrix(found["decoupling_matrix"]).det() - plant.parse(known[key])
    return None if vanishes([difference], plant.samples()) else "another determinant"


def chains(plant: Facts, outputs: Sequence[sp.Expr]) -> list[list[sp.Expr]] | None:
    """h, L_f h, … of each output up to the first on which an input acts; None if that takes more than n."""
    points, found = plant.samples(), []
    for h in outputs:
        chain = [h]
        while vanishes(plant.by_inputs(chain[-1]), points):
            if len(chain) == len(plant.states):
                return None
            chain.append(plant.drift(chain[-1]))
        found.append(chain)
    return found


def _linearising(plant: Facts, outputs: Sequence[sp.Expr]) -> str | None:
    found = chains(plant, outputs)
    if found is None or sum(map(len, found)) != len(plant.states):
        return f"the relative degrees of {outputs} do not add up to the number of states"
    decoupling = sp.Matrix([plant.by_inputs(c[-1]) for c in found])
    return None if rank(decoupling, plant.samples()) == len(outputs) else f"{outputs} are not decoupled"


def _linearizing_outputs(key: str, plant: Facts, found: Mapping[str, Any], known: Answers) -> str | None:
    value, expected = list(found[key]), _parsed(plant, known[key])
    wrong = _linearising(plant, value) or _linearising(plant, expected)
    if wrong:
        return wrong
    if len({len(c) for c in chains(plant, value) or []}) > 1:
        return None  # only the outputs of the longest chains are unique up to a function
    stacked = plant.gradients([*value, *expected])
    return None if rank(stacked, plant.samples()) == len(value) else f"{value} is no function of {expected}"


def _split(plant: Facts, coordinates: Sequence[sp.Expr]) -> list[list[sp.Expr]]:
    """Chains of coordinates: each ends where an input acts."""
    split: list[list[sp.Expr]] = [[]]
    for z in coordinates:
        split[-1].append(z)
        if not vanishes(plant.by_inputs(z), plant.samples()):
            split.append([])
    return [c for c in split if c]


def _transforms(plant: Facts, coordinates: Sequence[sp.Expr]) -> str | None:
    points = plant.samples()
    steps = [plant.drift(a) - b for c in _split(plant, coordinates) for a, b in pairwise(c)]
    if not vanishes(steps, points):
        return f"{list(coordinates)} are no chains of integrators"
    if len(coordinates) != len(plant.states) or rank(plant.gradients(coordinates), points) < len(plant.states):
        return f"{list(coordinates)} are no coordinates"
    return None


def _T(key: str, plant: Facts, found: Mapping[str, Any], known: Answers) -> str | None:
    expected = _parsed(plant, known[key])
    wrong = _transforms(plant, found[key]) or _transforms(plant, expected)
    if wrong or len(plant.inputs) > 1:
        return wrong
    stacked = plant.gradients([found[key][0], expected[0]])
    return None if rank(stacked, plant.samples()) == 1 else "another first coordinate"


def _closed(plant: Facts, coordinates: Sequence[sp.Expr], law: Sequence[sp.Expr]) -> str | None:
    """Whether the law makes the last of each chain follow v."""
    ends = [c[-1] for c in _split(plant, coordinates)]
    m = len(plant.inputs)
    new = sp.symbols(f"v1:{m + 1}", real=True) if m > 1 else [sp.Symbol("v", real=True)]
    u = dict(zip(plant.inputs, law, strict=True))
    rates = [plant.drift(z) + sum(b * u[s] for b, s in zip(plant.by_inputs(z), u, strict=True)) for z in ends]
    residuals = [r - v for r, v in zip(rates, new, strict=True)] if len(rates) == m else [sp.Integer(1)]
    return None if vanishes(residuals, plant.samples(new)) else f"the law {list(law)} does not give z' = v"


def _control(key: str, plant: Facts, found: Mapping[str, Any], known: Answers) -> str | None:
    outputs = found["T"] if found.get("T") is not None else [z for c in chains(plant, plant.h) or [] for z in c]
    wrong = _closed(plant, outputs, found[key])
    if wrong is None and "T" in known:
        wrong = _closed(plant, _parsed(plant, known["T"]), _parsed(plant, known[key]))
    return wrong


def _inverts(plant: Facts, coordinates: Sequence[sp.Expr], inverse: Mapping[str, sp.Expr]) -> str | None:
    z = {sp.Symbol(f"z{k + 1}", real=True): e for k, e in enumerate(coordinates)}
    back = [
        inverse[x.name].subs(z, simultaneous=True) - x if x.name in inverse else sp.Integer(1) for x in plant.states
    ]
    return None if vanishes(back, plant.samples()) else f"{dict(inverse)} is not the inverse near the point"


def _inverse(key: str, plant: Facts, found: Mapping[str, Any], known: Answers) -> str | None:
    expected = {x: plant.parse(e) for x, e in known[key].items()}
    if {str(s) for e in found[key].values() for s in e.free_symbols} & {x.name for x in plant.states} - _new(plant):
        return "an inverse in the old states"
    if "T" in known and not {x.name for x in plant.states} & _new(plant):
        wrong = _inverts(plant, _parsed(plant, known["T"]), expected)
        if wrong:
            return f"known answer: {wrong}"
    return None if {x.name for x in plant.states} & _new(plant) else _inverts(plant, found["T"], found[key])


def _new(plant: Facts) -> set[str]:
    return {f"z{k + 1}" for k in range(len(plant.states))}


def _factor(key: str, plant: Facts, found: Mapping[str, Any], known: Answers) -> str | None:
    """μ q = dT₁ means μ = dT₁ ad_f^(n−1) g = L_g L_f^(n−1) T₁ with the bracket of the paper.

    Factors differ by the sign that another bracket gives and by functions of T₁.
    """
    points = plant.samples()

    def slope(function: sp.Expr) -> sp.Expr:
        return plant.by_inputs(plant.drift(function, len(plant.states) - 1))[0]

    if not vanishes([found[key] - slope(found["linearizing_outputs"][0])], points):
        return f"{found[key]} does not integrate q"
    first, given = plant.parse(known["linearizing_outputs"][0]), plant.parse(known[key])
    ratio = given / slope(first)
    closed = rank(plant.gradients([first, ratio]), points) == 1 and not vanishes([given], points)
    return None if closed else "known answer: it does not integrate q"


def _zero_set(key: str, plant: Facts, found: Mapping[str, Any], known: Answers) -> str | None:
    value, expected = sp.sympify(found[key]), plant.parse(known[key])
    for one, other in ((value, expected), (expected, value)):
        for place in _zeros(plant, one):
            if abs(number(other, place)) > 1e-9:
                return f"{one} vanishes where {other} does not"
    return None if _zeros(plant, expected) else f"no zero of {expected} was found"


def _zeros(plant: Facts, function: sp.Expr) -> list[dict[sp.Symbol, sp.Expr]]:
    """Points where a function vanishes, each on a line through a random point, one state moving."""
    places = []
    for base in plant.samples()[:2]:
        for x in (s for s in plant.states if s in function.free_symbols):
            line = sp.lambdify(x, function.subs({s: v for s, v in base.items() if s != x}), modules="mpmath")
            for start in (-1.7, -0.6, 0.4, 1.3):
                try:
                    root = mpmath.findroot(line, float(base[x]) + start)
                except (ValueError, ZeroDivisionError):
                    continue
                if abs(mpmath.im(root)) < 1e-12 and abs(root) < 50:
                    places.append(base | {x: sp.Float(str(mpmath.re(root)), 20)})
    return places


def _agrees(key: str, plant: Facts, found: Mapping[str, Any], known: Answers) -> str | None:
    """An output transformation is unique up to scale and a constant."""
    value, expected = sp.sympify(found[key]), plant.parse(known[key])
    slopes = [(sp.diff(value, x), sp.diff(expected, x)) for x in plant.states]
    i = next(k for k, (_, b) in enumerate(slopes) if b != 0)
    ratio = slopes[i][0] / slopes[i][1]
    points = plant.samples()
    parallel = vanishes([a - ratio * b for a, b in slopes], points) and not vanishes([ratio], points)
    constant = vanishes([sp.diff(ratio, x) for x in plant.states], points)
    return None if parallel and constant else f"{value} is not a multiple of {expected}"


STATIC: dict[str, Check] = {
    "decoupling_matrix": _matrix,
    "decoupling_det": _determinant,
    "linearizing_outputs": _linearizing_outputs,
    "T": _T,
    "control": _control,
    "inverse": _inverse,
    "integrating_factor": _factor,
    "singular_set": _zero_set,
    "output_transform": _agrees,
}
"""Comparator by key."""
