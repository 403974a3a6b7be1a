"""`identifiability`: whether parameters can be known from outputs at all, before any number is measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches

import sympy as sp

from ulna.base import UlnaError, Verdict, all_of
from ulna.identification.errors import IdentificationError
from ulna.identification.structural.combinations import Combination, combinations_of
from ulna.identification.structural.evidence import Evidence
from ulna.identification.structural.experiment import Motion
from ulna.identification.structural.extent import Extent, ParameterAnswer
from ulna.identification.structural.input_output import input_output
from ulna.identification.structural.observed import Observed, observed
from ulna.identification.structural.scalings import scalings
from ulna.system import System, SystemLike, as_system, given_point, measured_part, stand_ins, with_uses

_SECONDS = 3.0


_KNOWN = (Extent.GLOBALLY, Extent.LOCALLY)


@dataclass(frozen=True, slots=True, kw_only=True)
class Identifiability:
    """Which parameters of a plant perfect records of its outputs determine.

    Attributes:
        system: the plant; outputs: names of those that are recorded.
        parameters: the answer for each unknown parameter, by name.
        combinations: functions of the parameters that can be known although these cannot; they are independent, and
            as many as there are, where `combinations_complete`.
        scalings: factors that change no output: exponents of one factor by state and parameter.
        lost: starts at which parameters that can be known otherwise show in no derivative of the outputs, whatever
            the inputs do: names by start, as text.
        verdict: on "all of them can be known".

    Examples:
        >>> found = ulna.identifiability(ulna.model("duffing"), ["a", "b"])
        >>> found.verdict.holds
        True
    """

    system: System
    outputs: tuple[str, ...]
    parameters: Mapping[str, ParameterAnswer]
    combinations: tuple[Combination, ...]
    combinations_complete: bool
    scalings: tuple[Mapping[str, int], ...]
    lost: Mapping[str, tuple[str, ...]]
    verdict: Verdict

    def __repr__(self) -> str:
        rows = [f"{name}: {answer.extent} ({answer.verdict.status})" for name, answer in self.parameters.items()]
        rows += [f"together: {c.expression} ({c.verdict.status})" for c in self.combinations]
        rows += [f"lost at {where}: {', '.join(names)}" for where, names in self.lost.items()]
        title = f"Identifiability of '{self.system.name}' from {', '.join(self.outputs)}"
        return "\n".join([title, *(f"  {row}" for row in rows)])


def identifiability(
    system: SystemLike,
    parameters: Sequence[str],
    *,
    outputs: Sequence[str] | None = None,
    known_start: Sequence[str] = (),
    seconds: float = _SECONDS,
) -> Identifiability:
    """Which of these parameters perfect records of outputs and inputs determine, alone or together.

    The start is unknown and generic, the inputs are known functions of time. `locally` and `not` come from a rank of
    Lie derivatives at random points (certain from below) and symmetries (exact); `globally` from input-output
    equations, where states can be eliminated one by one: their coefficients, solved for the parameters. Where that
    does not come to an end the answer stays `locally`. A plant with signs, magnitudes or cases is seen on several of
    its smooth pieces, as one record shows them.

    Args:
        system: the plant, in continuous time. Parameters not named are known: at their values, or arbitrary.
        parameters: names of those that are unknown.
        outputs: names of the outputs that are recorded; left out, all measured ones.
        known_start: states whose value at the start is known.
        seconds: s of CPU time for the input-output equations.

    Raises:
        IdentificationError: for an unknown name (it says which is near), one that is given twice, no output, and in
            discrete time.

    Source: A. Sedoglavic, J. Symbolic Computation 33 (2002); L. Ljung and T. Glad, Automatica 30 (1994).

    Examples:
        >>> print(ulna.identifiability(ulna.model("duffing"), ["a", "b"]))
        Identifiability of 'Duffing oscillator with force' from y
          a: globally (proved)
          b: globally (proved)
          lost at the operating point: b
          lost at x1 = 0: b
    """
    plant = _recorded(as_system(system), outputs)
    free = _checked(plant, parameters, known_start)
    numbers = stand_ins(plant)
    plain = plant.with_values({p.name: numbers[p.symbol] for p in plant.parameters if p.name not in free})
    full = Motion.CHANGING if plant.inputs else Motion.NONE
    seen = _sure(plant, free, full, known_start)
    scales = scalings(plain, free, known_start)
    equations = None if known_start else input_output(plain, free, seconds=seconds)
    known = Evidence(plant=plant, free=free, seen=seen, scales=scales, equations=equations)
    answers = known.answers()
    answers = _with_motions(plant, answers, known_start)

    def further(number: int) -> Observed:
        return observed(plant, free, full, known=known_start, number=number)

    symbols = [sp.Symbol(name, real=True) for name in free]
    together = combinations_of(symbols, seen, further, known.offered()) if seen.hidden else ()
    can = [name for name in free if answers[name].extent in _KNOWN]
    return Identifiability(
        system=plant,
        outputs=tuple(s.name for s in plant.outputs),
        parameters=answers,
        combinations=tuple(map(known.judged, together)),
        combinations_complete=len(together) == known.functions_known - len(can),
        scalings=scales,
        lost=_lost(plant, free, can, full, known_start) if seen.smooth else {},
        verdict=_overall(answers),
    )


def _recorded(system: System, outputs: Sequence[str] | None) -> System:
    asked = f"identifiability of '{system.name}'"
    if system.discrete:
        raise IdentificationError(
            asked,
            "it is in discrete time; the derivatives of its outputs do not exist.",
            "Ask for the plant in continuous time.",
        )
    known = [s.name for s in system.outputs]
    for name in outputs or ():
        if name not in known:
            raise IdentificationError(asked, f"there is no output '{name}'.", _near(name, known))
    plant = measured_part(system if outputs is None else with_uses(system, measured=list(outputs)))
    if not plant.outputs:
        raise IdentificationError(asked, "no output is measured.", "Name an output that is recorded.")
    return plant


def _checked(system: System, parameters: Sequence[str], known_start: Sequence[str]) -> tuple[str, ...]:
    asked = f"identifiability of '{system.name}'"
    rows = (
        ("parameter", parameters, [p.name for p in system.parameters]),
        ("state", known_start, [s.name for s in system.states]),
    )
    for kind, names, known in rows:
        for name in names:
            if name not in known:
                raise IdentificationError(asked, f"there is no {kind} '{name}'.", _near(name, known))
            if list(names).count(name) > 1:
                raise IdentificationError(asked, f"{kind} '{name}' is given twice.", "Name it once.")
    if not parameters:
        raise IdentificationError(asked, "no parameter is named.", _near("", [p.name for p in system.parameters]))
    return tuple(parameters)


def _near(name: str, known: Sequence[str]) -> str:
    close = get_close_matches(name, known, n=1)
    return f"Did you mean '{close[0]}'?" if close else f"Known: {', '.join(known) or 'none'}."


def _sure(plant: System, free: Sequence[str], motion: Motion, known_start: Sequence[str]) -> Observed:
    """The greatest rank of two random points; one where it is full, or nothing was left open."""
    first = observed(plant, free, motion, known=known_start)
    if first.rank == first.unknowns:
        return first
    second = observed(plant, free, motion, known=known_start, number=1)
    return second if second.rank > first.rank or not first.verdict.holds else first


def _with_motions(
    plant: System, answers: Mapping[str, ParameterAnswer], known_start: Sequence[str]
) -> dict[str, ParameterAnswer]:
    """The answers with the least motion of the inputs that each parameter needs."""
    free = tuple(answers)
    can = {name for name in free if answers[name].extent in _KNOWN}
    least: dict[str, Motion] = {}
    for motion in Motion if plant.inputs and can else [Motion.NONE]:
        waiting = [name for name in can if name not in least]
        if not waiting:
            break
        if motion is Motion.CHANGING or not plant.inputs:
            least |= dict.fromkeys(waiting, motion)
            break
        seen = observed(plant, free, motion, known=known_start)
        least |= {name: motion for name in waiting if not seen.moved(free.index(name)) and seen.verdict.holds}
    return {
        name: replace(answer, needs=least.get(name), without_input=least.get(name) is Motion.NONE)
        for name, answer in answers.items()
    }


def _lost(
    plant: System, free: Sequence[str], can: Sequence[str], motion: Motion, known_start: Sequence[str]
) -> dict[str, tuple[str, ...]]:
    """Starts at which parameters do not show: the given operating point, and one state at zero, the rest generic."""
    numbers = stand_ins(plant)
    rest = {s.name: value.xreplace(numbers) for s, value in given_point(plant).states.items()}
    starts = {"the operating point": rest} | {f"{name} = 0": {name: sp.S.Zero} for name in rest}
    found = {}
    for where, start in starts.items() if can else ():
        try:
            seen = observed(plant, free, motion, start=start, known=known_start)
        except UlnaError:
            continue  # the plant is not finite there
        if names := tuple(name for name in can if seen.moved(list(free).index(name))):
            found[where] = names
    return found


def _overall(answers: Mapping[str, ParameterAnswer]) -> Verdict:
    names = ", ".join(answers)
    verdicts = []
    for name, answer in answers.items():
        said = f"{name} can be known"
        if answer.extent is Extent.NOT:
            evidence = {**answer.verdict.evidence, "parameter": name}
            verdicts.append(Verdict.refuted(said, **evidence))
        else:
            verdicts.append(answer.verdict.restated(said))
    return all_of(f"{names} can be known from the outputs", verdicts)
