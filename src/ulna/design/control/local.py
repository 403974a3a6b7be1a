"""Local laws: linear feedback of the whole state, designed on the linearisation where the plant rests."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import sympy as sp

from ulna.base import DesignError
from ulna.design.control.law import Law
from ulna.design.control.reference import AbstractReference, Regulate, SetPoint
from ulna.design.gains import Gains, characteristic, gain_rule
from ulna.design.linear import LinearPlant, as_numbers, as_rational, holdable, linear_plant, require_stabilisable, split
from ulna.plants import PlantLike, as_plant
from ulna.symbolic.formulas import put_in
from ulna.system import PointLike, Signal, System


def local_law(
    plant: PlantLike,
    gains: Gains,
    *,
    at: PointLike | None = None,
    reference: AbstractReference | None = None,
    integral: bool = False,
) -> Law:
    """The law u = u* − K (x − x*) of the linearisation dx' = A dx + B du at a point where the plant rests.

    It serves every plant, underactuated ones too, but what it promises is local: from near enough the loop converges
    exponentially (Lyapunov's indirect method). `ulna.certify.prove(loop, Region())` tells how near, where it can.

    With a set point r, an input `<output>_ref`, it holds u* + N (r − y*) − K (x − x*), N from the linearisation;
    with integral action an output is held exactly. What is held are the first outputs, at most one for each input,
    that constant inputs can set one by one.

    Args:
        plant: its parameters are put at their values; it need not be affine in its inputs.
        gains: poles, one for each mode that an input moves, `LinearQuadratic(...)` with weights of the states in order
            (integrals in front), or `Bandwidth(omega)`.
        at: the point; left out, the operating point.
        reference: `Regulate()` (default) or `SetPoint()`.
        integral: add ∫(y − y_ref) dt of what is held, y the output itself, not its linearisation.

    Raises:
        DesignError: where the plant does not rest, a mode grows or stays that no input moves, gains do not fit, or
            there is no output to hold.

    Examples:
        >>> ulna.local_law("mass_spring_damper", [-1, -2]).poles
        ((-2+0j), (-1+0j))
    """
    linear = linear_plant(as_plant(plant), at)
    asked = f"a local law for '{linear.system.name}'"
    if not linear.B.cols:
        raise DesignError(asked, "the plant has no inputs.")
    if not isinstance(reference or Regulate(), Regulate | SetPoint):
        hint = "Use SetPoint(); Track() needs the chains of an exact or input-output law."
        raise DesignError(asked, f"it cannot follow {type(reference).__name__}().", hint)
    require_stabilisable(split(as_numbers(linear.A), as_numbers(linear.B), linear.names), asked)
    held = _held(linear, asked) if integral or isinstance(reference, SetPoint) else ()
    signals = tuple(reference_of(linear.system.outputs[k]) for k in (held if isinstance(reference, SetPoint) else ()))
    memories = tuple(Signal(name=f"e{i + 1}_int", text="integral of the error") for i in range(len(held) * integral))
    A, B = with_integrals(linear, held if integral else ())
    K = gain_rule(gains).feedback(A, B, [*(s.name for s in memories), *linear.names], asked)
    return _law(linear, (A, B, K), held, signals, memories)


def _law(
    linear: LinearPlant,
    closed: tuple[sp.ImmutableDenseMatrix, sp.ImmutableDenseMatrix, sp.ImmutableDenseMatrix],
    held: Sequence[int],
    signals: tuple[Signal, ...],
    memories: tuple[Signal, ...],
) -> Law:
    """The law as a system. closed: A, B and K, integrals in front."""
    system, (A, B, K), q = linear.system, closed, len(memories)
    inner, outer = sp.ImmutableDenseMatrix(K[:, :q]), sp.ImmutableDenseMatrix(K[:, q:])
    x, u = system.state_symbols, system.input_symbols
    dx = sp.Matrix([s - linear.point[s] for s in x])
    command = (
        sp.Matrix([linear.point[s] for s in u]) - outer * dx - inner * sp.Matrix(q, 1, [m.symbol for m in memories])
    )
    readouts = system.inline(system.readouts)
    at_rest = [put_in(readouts[k], linear.point) for k in held]
    if signals:
        command += _feed_forward(linear, held, outer) * sp.Matrix(
            [s.symbol - y for s, y in zip(signals, at_rest, strict=True)]
        )
    expressions = sp.ImmutableDenseMatrix(command)
    meaning = dict(zip(u, expressions, strict=True))
    wanted = [s.symbol for s in signals] or at_rest
    errors = [readouts[k].xreplace(meaning) - w for k, w in zip(held, wanted, strict=True)]
    return Law(
        plant=system,
        method=f"local, on the linearisation at {linear.where}",
        expressions=expressions,
        polynomials=(characteristic(A - B * K),),
        gains=outer,
        integral_gains=tuple(inner),
        system=System(
            name=f"law of {system.name}",
            text="linear state feedback",
            states=memories,
            rates=tuple(errors[: len(memories)]),
            inputs=(*system.states, *signals),
            outputs=system.inputs,
            readouts=tuple(expressions),
        ),
    )


def _held(linear: LinearPlant, asked: str) -> tuple[int, ...]:
    held = holdable(linear)
    if not held:
        names = ", ".join(o.name for o in linear.system.outputs)
        found = f"constant inputs set none of the outputs {names}." if names else "the plant has no output to hold."
        raise DesignError(f"{asked} with a set point or integral action", found, "Add an output that they can set.")
    return held


def reference_of(output: Signal) -> Signal:
    """The input of a law that is the set point of an output."""
    return Signal(name=f"{output.name}_ref", unit=output.unit, text=f"reference of {output.text or output.name}")


def with_integrals(linear: LinearPlant, held: Sequence[int]) -> tuple[sp.ImmutableDenseMatrix, sp.ImmutableDenseMatrix]:
    """A and B with the integrals of held outputs in front."""
    q, rows = len(held), list(held)
    n, m = linear.B.shape
    A = sp.zeros(q + n, q + n)
    A[:q, q:], A[q:, q:] = linear.C.extract(rows, list(range(n))), linear.A
    B = sp.Matrix.vstack(linear.D.extract(rows, list(range(m))), linear.B)
    return sp.ImmutableDenseMatrix(A), sp.ImmutableDenseMatrix(B)


def _feed_forward(linear: LinearPlant, held: Sequence[int], K: sp.ImmutableDenseMatrix) -> sp.ImmutableDenseMatrix:
    """(m, q) N = du + K dx for which the linear plant rests with the held outputs one higher each."""
    rows = list(held)
    C, D = as_numbers(linear.C)[rows], as_numbers(linear.D)[rows]
    n = linear.A.rows
    whole = np.block([[as_numbers(linear.A), as_numbers(linear.B)], [C, D]])
    right = np.vstack([np.zeros((n, len(rows))), np.eye(len(rows))])
    rest = np.linalg.lstsq(whole, right, rcond=None)[0]
    return as_rational(np.round(rest[n:] + as_numbers(K) @ rest[:n], 12))
