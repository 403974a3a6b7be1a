"""Which controller to build on an arm, from the comparison alone; and what can be said before any run."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ulna.base import Verdict
from ulna.design import Poles, controller_form, sampling_advice, state_feedback
from ulna.plants import Preset, arm_with_drive
from ulna.studies.prosthesis.comparison import EQUAL, Comparison
from ulna.studies.prosthesis.contender import Contender
from ulna.studies.prosthesis.tasks import PERIOD, Task

SHARE = 0.95
"""Share of the plants that must stay below a value for it to count."""
PAPER_POLES = ("-2+2*sqrt(3)*j", "-2-2*sqrt(3)*j", -8)


@dataclass(frozen=True, slots=True, kw_only=True)
class Standing:
    """A contender over all tasks of an arm.

    Attributes:
        score: geometric mean over the tasks of its RMS error over the least of that task; 1 is best everywhere. Errors
            below one code of the encoder count as one code.
        lost: tasks that it does not do.
    """

    contender: Contender
    score: float
    lost: tuple[Task, ...]


def standings(found: Comparison) -> tuple[Standing, ...]:
    """All contenders, those that do every task first, by score."""
    errors = {c.key: [_error(found, c, task) for task in found.tasks] for c in found.contenders}
    least = np.min(list(errors.values()), axis=0)
    made = [
        Standing(
            contender=c,
            score=float(np.exp(np.mean(np.log(np.array(errors[c.key]) / least)))),
            lost=tuple(task for task in found.tasks if found.entries[c.key, task.key].lost(SHARE)),
        )
        for c in found.contenders
    ]
    return tuple(sorted(made, key=lambda each: (bool(each.lost), each.score)))


def recommendation(found: Comparison) -> str:
    """Which controller to build and why, in sentences."""
    whole = [each for each in standings(found) if not each.lost]
    lost = [each for each in standings(found) if each.lost]
    if not whole:
        return "No controller does every task on this arm."
    best = whole[0]
    text = f"Build {_the(best.contender)}: {best.contender.note}. "
    text += (
        f"Taking the tasks together its RMS error is {best.score:.2f} times the least of each task (geometric mean, "
        "95 of 100 plants, one code of the encoder at least)"
    )
    if len(whole) > 1:
        second = whole[1]
        task = max(found.tasks, key=lambda t: _error(found, second.contender, t) / _error(found, best.contender, t))
        mine, other = (_error(found, each.contender, task) for each in (best, second))
        text += f"; next is {_the(second.contender)} with {second.score:.2f}"
        text += ", as good" if second.score <= (1 + EQUAL) * best.score else ""
        if other > (1 + EQUAL) * mine:
            text += f", farthest behind where the task is to {task.title} ({other:.2g}° against {mine:.2g}°)"
    text += ". "
    if best.contender.measures_all:
        plain = next((each for each in whole if not each.contender.measures_all), None)
        text += "It needs sensors of speed and current; "
        text += "from the angle alone no controller does every task. " if plain is None else _with_angle(plain)
    if lost:
        text += "Not to be built on this arm: " + "; ".join(
            f"{each.contender.title} (lost at {', '.join(task.key.replace('_', ' ') for task in each.lost)})"
            for each in lost
        )
        text += "."
    return text.strip()


def full_law_advice(preset: Preset) -> Verdict:
    """Whether the paper's third-order law with the paper's poles can work at `PERIOD` on this drive, before any run."""
    plant = arm_with_drive(preset)
    law = state_feedback(controller_form(plant), Poles(*PAPER_POLES))
    volts = preset.limits.voltage
    limits = {} if volts is None else {"u": float(volts)}
    return sampling_advice(plant, law, period=PERIOD, limits=limits, start={"theta": math.radians(50.0)})


def advice_text(preset: Preset) -> str:
    """The advice in sentences, with the numbers behind it."""
    verdict = full_law_advice(preset)
    evidence = verdict.evidence
    ratio = float(preset.value("La") / preset.value("Ra")) / PERIOD
    settling, designed = float(evidence["settling_time"]), math.log(50) / float(evidence["decay_without_sampling"])
    late = f"it would settle in {settling:.3g} s" if math.isfinite(settling) else "it would not settle"
    text = (
        "Said before any run, from La/Ra, the period and the limits: the paper's third-order law with the paper's "
        f"poles {'can' if verdict.holds else 'cannot'} work here. La/Ra is {ratio:.3g} periods; sampled at 1 kHz and "
        f"one sample late {late} instead of {designed:.3g} s"
    )
    share = evidence.get("command_over_limit_of_u")
    if share is not None:
        text += f"; its first command is {100 * float(share):.2g} % of the voltage limit"
        text += ", which is not the reason" if float(share) < 1 and verdict.fails else ""
    return text + "."


def _error(found: Comparison, contender: Contender, task: Task) -> float:
    """The RMS error that 95 of 100 plants stay below, degrees, one code at least; 180 where it is not a number."""
    value = found.entries[contender.key, task.key].quantile("rms_error", SHARE)
    return max(math.degrees(found.bench.step), value) if math.isfinite(value) else 180.0


def _with_angle(plain: Standing) -> str:
    return f"from the angle alone {_the(plain.contender)} is best, {plain.score:.2f}. "


def _the(contender: Contender) -> str:
    return f"the {contender.title.removeprefix('the ')}"
