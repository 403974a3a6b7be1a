"""`identify`: the parameters of a plant from records, by prediction error with exact slopes."""

from __future__ import annotations

import datetime as dt
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ulna.identification.errors import IdentificationError
from ulna.identification.fitting.conclusion import conclusion
from ulna.identification.fitting.fit import Fit
from ulna.identification.fitting.free import free_parameters
from ulna.identification.fitting.held_out import held_out_errors
from ulna.identification.fitting.hidden import hidden_parameters
from ulna.identification.fitting.noise import Noise, noise_of
from ulna.identification.fitting.prior import Prior, prior_of, quantity
from ulna.identification.fitting.problem import Free, Problem
from ulna.identification.fitting.smooth import COARSE, FINE, signs_of, smoothed, told, widths_of
from ulna.identification.fitting.solve import MultipleShooting, Robust, Solution, begun, no_value, solved
from ulna.identification.fitting.start import GlobalStart
from ulna.identification.records import Experiment, as_records, experiments, measured_system
from ulna.loop import Loop
from ulna.system import System, as_system

ROUNDS = 4
"""Fits at most while the noise of the channels is estimated."""


def identify(
    system: Any,
    records: Any,
    *,
    free: Sequence[str] | str,
    outputs: Sequence[str] | None = None,
    priors: Mapping[str, Any] | None = None,
    bounds: Mapping[str, Any] | None = None,
    noise: Mapping[str, Any] | None = None,
    loss: Robust | None = None,
    initial: Mapping[str, float] | None = None,
    inputs: Mapping[str, Any] | None = None,
    held_out: Any = None,
    start: GlobalStart | None = None,
    shooting: MultipleShooting | None = None,
    most: int = 100,
) -> Fit:
    """The parameters for which the plant's outputs come nearest to the records, their uncertainty, and the residuals.

    The plant is run with the recorded inputs, held between samples; residuals are weighed by the noise of their
    channel, slopes are exact (`sensitivities`). Initial states of each record are free but for those in `initial`. A
    record of a closed loop is as good as any: the recorded input is what acted. The plant may be a `Loop` without
    hardware, too, whose references were recorded.

    Args:
        system: a plant, or what holds one. records: one record or several, each a `Record`, a file, a `Trajectory`, a
            table of pandas or xarray; each is an experiment.
        free: names of parameters, in a list or a text with commas; "kb = km" for two that are equal; a word of their
            descriptions for all that have it ("friction").
        outputs: which columns are compared; left out, the plant's measured outputs, else the states, that are there.
        priors: what is known besides, by parameter or state: "5 ± 12%", "4.8 kg ± 0.2 kg", (5, 0.6); ± is one
            standard deviation. The search begins there.
        bounds: (lower, upper) by name, None where there is none; left out, the range that the plant declares.
        noise: standard deviation by output where it is known, 0.01 or "0.05 deg"; else it is estimated, not below that
            of the quantiser that is found.
        loss: `Robust()` counts outliers less. initial: states that are known at the beginning, SI.
        inputs: values of inputs that were not recorded. held_out: records that the result is tried on.
        start: `GlobalStart()` where the parameters' starts are no more than guesses. shooting: `MultipleShooting()` for
            unstable plants; it is taken by itself where the run from the start has no value. most: evaluations.

    Raises:
        IdentificationError: records that cannot be used, unknown names, bounds that leave the start out, fewer
            samples than unknowns, a plant without value at the start.
        UnitError: a column in a unit that does not measure its signal.

    Reference:
        L. Ljung, System Identification: Theory for the User, 2nd ed., chapters 7, 9 and 16.

    Examples:
        >>> spring = ulna.model("mass_spring_damper")
        >>> run = ulna.simulate(spring.with_values(), [1, 0], np.linspace(0, 9, 91))
        >>> record = ulna.Record(times=run.t, columns={"y": run.y, "u": np.zeros(91)})
        >>> fit = ulna.identify(spring, record, free=["k"], initial={"p": 1.0, "s": 0.0})
        >>> round(fit.estimates[0].value, 6)
        4.0
    """
    plant = _plant(system)
    taken = as_records(records)
    shown = measured_system(plant, taken, outputs)
    runs = experiments(shown, taken, inputs or {})
    wanted = free_parameters(plant, free, priors or {}, bounds or {})
    known = _known_states(plant, initial or {})
    beliefs = _state_priors(plant, priors or {}, wanted)
    _check_enough(shown, runs, wanted, known)
    own = levels = _noise(shown, runs, noise or {})
    settings = {"initial": known, "state_priors": beliefs}
    problem, solution, levels, note, hidden = _without_signs(
        shown, runs, wanted, levels, settings, loss, start, shooting, most
    )
    fit = conclusion(plant, problem, solution, levels, own, loss=loss, source=_source(taken), hidden=hidden)
    if note:
        fit = replace(fit, notes=(note, *fit.notes))
    if held_out is None:
        return fit
    others = as_records(held_out)
    return replace(fit, held_out=held_out_errors(problem, solution, experiments(shown, others, inputs or {}), own))


def _plant(given: Any) -> System:
    if isinstance(given, Loop):
        if given.sampled:
            raise IdentificationError(
                f"identification of a loop around '{given.plant.name}' with hardware",
                "no derivatives are computed through a processor.",
                "Give the plant itself: the recorded input is what acted on it.",
            )
        return given.system
    return as_system(given)


def _known_states(plant: System, initial: Mapping[str, float]) -> dict[str, float]:
    names = [s.name for s in plant.states]
    for name in initial:
        if name not in names:
            found = f"'{plant.name}' has no such state."
            raise IdentificationError(f"initial '{name}'", found, f"Known: {', '.join(names)}.")
    return {name: float(value) for name, value in initial.items()}


def _state_priors(plant: System, priors: Mapping[str, Any], free: Sequence[Free]) -> dict[str, Prior]:
    taken = {each.name for each in free}
    units = {s.name: s.unit for s in plant.states}
    return {
        name: prior_of(given, f"prior of '{name}'", value=None, unit_text=units[name])
        for name, given in priors.items()
        if name in units and name not in taken
    }


def _check_enough(system: System, runs: Sequence[Experiment], free: Sequence[Free], known: Mapping[str, float]) -> None:
    samples = sum(int(np.isfinite(run.measured).sum()) for run in runs)
    states = len(runs) * (len(system.states) - len(known))
    unknowns = len(free) + states
    if samples < unknowns:
        raise IdentificationError(
            f"identification of '{system.name}'",
            f"{samples} samples for {unknowns} unknowns: {len(free)} parameters and {states} initial states.",
            "Record more, fix parameters, or say what is known at the beginning: initial={…}.",
        )


def _noise(system: System, runs: Sequence[Experiment], told: Mapping[str, Any]) -> tuple[Noise, ...]:
    names = [s.name for s in system.outputs]
    for name in told:
        if name not in names:
            raise IdentificationError(f"noise of '{name}'", "it is not compared.", f"Outputs: {', '.join(names)}.")
    found = []
    for k, signal in enumerate(system.outputs):
        level = noise_of([run.measured[:, k][np.isfinite(run.measured[:, k])] for run in runs])
        if signal.name in told:
            std = quantity(told[signal.name], f"noise of '{signal.name}'", unit_text=signal.unit)
            if not (std > 0.0 and math.isfinite(std)):
                raise IdentificationError(f"noise of '{signal.name}'", f"{std:g} is not positive.", "Give its std.")
            level = replace(level, std=std, told=True)
        found.append(level)
    return tuple(found)


def _without_signs(
    system: System, runs: tuple[Experiment, ...], free: tuple[Free, ...], *others: Any
) -> tuple[Problem, Solution, tuple[Noise, ...], str, dict[str, str]]:
    """As `_searched`; a plant with signs in its smooth form, a wide one first, from where that ends a narrow one."""
    signs = () if system.discrete else signs_of(system)
    if not signs:
        return _searched(system, runs, free, *others)
    widths = widths_of(system, signs, runs)
    problem, solution, *_ = _searched(smoothed(system, widths, COARSE), runs, free, *others)
    begun = problem.parameters(solution.unknowns)
    nearer = tuple(replace(each, start=begun[each.name]) for each in free)
    problem, solution, levels, note, hidden = _searched(smoothed(system, widths, FINE), runs, nearer, *others)
    return problem, solution, levels, "; ".join(filter(None, (note, told(widths)))), hidden


def _searched(
    system: System,
    runs: tuple[Experiment, ...],
    free: tuple[Free, ...],
    levels: tuple[Noise, ...],
    settings: dict[str, Any],
    loss: Robust | None,
    start: GlobalStart | None,
    shooting: MultipleShooting | None,
    most: int,
) -> tuple[Problem, Solution, tuple[Noise, ...], str, dict[str, str]]:
    """(problem, solution, noise as estimated, a note, what cannot be known): again while estimates of noise change."""
    segments, note = (1 if shooting is None else shooting.segments), ""

    def posed(noise: Sequence[Noise], response: Any = None) -> Problem:
        stds = [each.std for each in noise]
        return Problem(system, runs, free, noise=stds, segments=segments, response=response, **settings)

    problem = posed(levels)
    point = begun(problem, start, loss)
    if shooting is None and not problem.rows(point).finite and system.states:
        segments = MultipleShooting().segments
        note = f"the run from the start has no value: by multiple shooting in {segments} segments"
        problem = posed(levels)
        point = begun(problem, start, loss)
    if not problem.rows(point).finite:
        raise no_value(problem)
    hidden = hidden_parameters(problem, point)
    solution = solved(problem, point, loss=loss, most=most)
    evaluations = solution.evaluations
    for _ in range(ROUNDS - 1):
        better = _estimated(solution, levels)
        change = max(abs(math.log(b.std / a.std)) for a, b in zip(levels, better, strict=True))
        levels = better
        if change < 0.02:
            break
        problem = posed(levels, problem.response)
        if len(levels) == 1 and loss is None and not _believed(free, settings["state_priors"]):
            # One channel's noise weighs all rows alike: nothing moves.
            rows = problem.rows(solution.unknowns)
            solution = replace(solution, rows=rows, cost=0.5 * float(rows.residual @ rows.residual))
            continue
        solution = solved(problem, solution.unknowns, loss=loss, most=most)
        evaluations += solution.evaluations
    return problem, replace(solution, evaluations=evaluations), levels, note, hidden


def _believed(free: Sequence[Free], states: Mapping[str, Prior]) -> bool:
    return bool(states) or any(each.prior is not None for each in free)


def _estimated(solution: Solution, levels: Sequence[Noise]) -> tuple[Noise, ...]:
    """The noise of each channel from its residual, not below what its quantiser makes."""
    found = []
    for k, level in enumerate(levels):
        if level.told:
            found.append(level)
            continue
        whole = np.concatenate([each[:, k][np.isfinite(each[:, k])] for each in solution.rows.plain])
        robust = float(np.median(np.abs(whole))) / 0.6745
        rms = float(np.sqrt(np.mean(whole**2)))
        # Outliers that a robust loss leaves aside are not noise of the channel.
        std = min(rms, 1.5 * robust) if (solution.weights < 1.0).any() and robust > 0.0 else rms
        found.append(replace(level, std=max(std, level.floor)))
    return tuple(found)


def _source(records: Sequence[Any]) -> str:
    shown = dict.fromkeys(
        f"{r.name.partition(', part ')[0]} (sha256 {r.digest[:16]})" if r.digest else r.name for r in records
    )
    return f"identified from {', '.join(shown)} by prediction error, {dt.datetime.now(tz=dt.UTC).date().isoformat()}"
