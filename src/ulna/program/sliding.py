"""Motion along the surfaces at which a right-hand side jumps: the field of Filippov that keeps guards at zero.

On each side of the surface g = 0 the field has a value, f⁺ and f⁻. Where both push towards it, the motion stays on it
with the mixture α f⁺ + (1 − α) f⁻ for which g keeps its value. Of several surfaces at once every jump has a share of
its own; with jumps that add up, as forces of friction do, the shares solve linear equations.

Reference:
    A. F. Filippov, Differential Equations with Discontinuous Righthand Sides, Kluwer 1988, sections 4 and 19.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import combinations

from ulna.program.assembly import Assembly
from ulna.program.bound import bound
from ulna.program.instructions import Operation
from ulna.program.kernel import Kernel, restricted
from ulna.program.modes import GUARD, MODE
from ulna.program.scalar import Scalar
from ulna.program.tangent import slopes_along

CONTACT = "contact_"
SLOPE = "slope_"
_SPEED = "speed of "


@dataclass(frozen=True, slots=True, kw_only=True)
class Moving:
    """What moves in a kernel whose first outputs are the rates of its states.

    Attributes:
        states: names. ramps: inputs that grow at the rates `slope_0`, `slope_1`, … time: the name of the time, or None.
        walls: for each end stop the places of the states that stand still while `contact_0`, `contact_1`, … is not 0.
    """

    states: tuple[str, ...]
    ramps: tuple[str, ...] = ()
    time: str | None = None
    walls: tuple[tuple[int, ...], ...] = ()

    @property
    def further(self) -> tuple[str, ...]:
        """The inputs that a kernel of sliding has beside those of the original."""
        contacts = (f"{CONTACT}{k}" for k in range(len(self.walls)))
        return (*contacts, *(f"{SLOPE}{k}" for k in range(len(self.ramps))))


def sliding(kernel: Kernel, held: Sequence[int], moving: Moving) -> Kernel:
    """The kernel of the motion that keeps some guards at zero.

    Its inputs are those of the original and `moving.further`; its outputs are those of the original, where 1 − λ²
    stands in place of each guard that is held, then λ as `mode_k` for each of these, in their order. The jump takes the
    value between those of its two sides that λ between −1 and 1 names; beyond them the motion does not stay.

    Args:
        kernel: of `with_modes`, its first outputs the rates. held: numbers of guards whose jumps add up in the rates,
            see `add_up`. moving: what moves.
    """
    whole = Assembly(kernel.name)
    inputs = (*kernel.inputs, *moving.further)
    for name in inputs:
        whole.input(name)
    below = {f"{MODE}{k}": -1.0 for k in held}
    base = _side(whole, kernel, below, moving)
    jumps = [_differences(base, _side(whole, kernel, below | {f"{MODE}{k}": 1.0}, moving)) for k in held]
    names = [*moving.states, *moving.ramps, *([] if moving.time is None else [moving.time])]
    rates = dict(zip(moving.states, (base[name] for name in kernel.outputs), strict=False))
    rates |= {name: whole.input(f"{SLOPE}{k}") for k, name in enumerate(moving.ramps)}
    rates |= {} if moving.time is None else {moving.time: whole.constant(1.0)}
    guards = [bound(restricted(kernel, [f"{GUARD}{k}"]), dict.fromkeys(below, 1.0)) for k in held]
    drift = [_along(whole, guard, {name: rates[name] for name in names}) for guard in guards]
    outputs = dict(zip(moving.states, kernel.outputs, strict=False))
    by_jump = [{name: jump[output] for name, output in outputs.items() if output in jump} for jump in jumps]
    matrix = [[_along(whole, guard, speeds) for speeds in by_jump] for guard in guards]
    shares = _solved(matrix, [-each for each in drift])
    found: dict[str, Scalar] = {}
    for name in kernel.outputs:
        value = base[name]
        for share, jump in zip(shares, jumps, strict=True):
            value = value + share * jump[name] if name in jump else value
        found[name] = value
    levels = {f"{MODE}{k}": 2.0 * share - 1.0 for k, share in zip(held, shares, strict=True)}
    for k in held:
        level = levels[f"{MODE}{k}"]
        found[f"{GUARD}{k}"] = 1.0 - level * level
        still = _still(kernel, kernel.results[kernel.outputs.index(f"{GUARD}{k}")], set(names))
        if still in outputs:
            # No rounding shall move a state that is held itself.
            found[outputs[still]] = whole.constant(0.0)
    return whole.finished(found | levels, inputs)


def add_up(kernel: Kernel, guards: Collection[int], outputs: Sequence[str]) -> bool:
    """Whether the jumps at some guards contribute to the outputs one by one, none changing what another one does."""
    watched = {f"{MODE}{k}": k for k in guards}
    empty: frozenset[int] = frozenset()
    # Of each value: the jumps in it, and whether two of them meet in more than a sum.
    jumps = [frozenset({watched[name]}) if name in watched else empty for name in kernel.inputs]
    mixed = [False] * len(jumps)
    for instruction in kernel.instructions:
        parts = [jumps[k] for k in instruction.operands]
        together = empty.union(*parts)
        crossed = any(len(a | b) > 1 for a, b in combinations(parts, 2) if a and b)
        match instruction.operation:
            case Operation.ADD | Operation.SUB | Operation.NEG:
                crossed = False
            case Operation.MUL:
                pass
            case Operation.SELECT:
                crossed = len(parts[0]) > 1 or any(len(parts[0] | part) > 1 for part in parts[1:] if parts[0] and part)
            case Operation.DIV if not parts[1]:
                crossed = False
            case _:
                crossed = len(together) > 1
        jumps.append(together)
        mixed.append(crossed or any(mixed[k] for k in instruction.operands))
    return not any(
        mixed[result] for name, result in zip(kernel.outputs, kernel.results, strict=True) if name in outputs
    )


def _still(kernel: Kernel, value: int, moving: Collection[str]) -> str:
    """The one input that moves in a value which is that input, or its distance from something that does not move."""
    count, parts = len(kernel.inputs), [value]
    if value >= count and kernel.instructions[value - count].operation in (Operation.ADD, Operation.SUB):
        parts = list(kernel.instructions[value - count].operands)
    known = [kernel.inputs[k] if k < count else None for k in parts]
    constants = [k for k in parts if k >= count and kernel.instructions[k - count].operation is Operation.CONSTANT]
    found = [name for name in known if name in moving and name is not None]
    fixed = len(constants) + sum(name is not None and name not in moving for name in known)
    return found[0] if len(found) == 1 and fixed == len(parts) - 1 else ""


def _side(whole: Assembly, kernel: Kernel, modes: dict[str, float], moving: Moving) -> dict[str, Scalar]:
    """The outputs with the jumps decided, as they are with the walls."""
    found = whole.call(bound(kernel, modes))
    for k, places in enumerate(moving.walls):
        for place in places:
            name = kernel.outputs[place]
            found[name] = whole.input(f"{CONTACT}{k}").where(0.0, found[name])
    return found


def _differences(base: dict[str, Scalar], other: dict[str, Scalar]) -> dict[str, Scalar]:
    return {name: value - base[name] for name, value in other.items() if value.index != base[name].index}


def _along(whole: Assembly, guard: Kernel, speeds: dict[str, Scalar]) -> Scalar:
    """The rate of a guard where inputs move with some speeds."""
    speeds = {name: speed for name, speed in speeds.items() if name in guard.inputs}
    rate = slopes_along(guard, {name: f"{_SPEED}{name}" for name in speeds}, piecewise=True)
    (found,) = whole.call(rate, {f"{_SPEED}{name}": speed for name, speed in speeds.items()}).values()
    return found


def _solved(matrix: list[list[Scalar]], right: list[Scalar]) -> list[Scalar]:
    """Elimination in the order given: where the motion stays on the surfaces, no pivot is zero."""
    matrix, right = [list(row) for row in matrix], list(right)
    count = len(right)
    for k in range(count):
        for row in range(k + 1, count):
            factor = matrix[row][k] / matrix[k][k]
            for column in range(k + 1, count):
                matrix[row][column] = matrix[row][column] - factor * matrix[k][column]
            right[row] = right[row] - factor * right[k]
    for k in reversed(range(count)):
        for column in range(k + 1, count):
            right[k] = right[k] - matrix[k][column] * right[column]
        right[k] = right[k] / matrix[k][k]
    return right
