"""`Fit`: parameters from records, how surely, and what is left over."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ulna.base import html_table
from ulna.identification.errors import IdentificationError
from ulna.identification.fitting.residual_tests import ResidualTest
from ulna.identification.records import Experiment
from ulna.system import System


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """A parameter of a fit, SI.

    Attributes:
        name: of it. unit: SI. value: the estimate; of one that is not known a value that fits as well as others.
        std: standard error, infinite where nothing tells it. low, high: 95 % interval, infinite where it does not end.
        start: where the search began. reason: why it is not known, "" where it is; notes else.
    """

    name: str
    unit: str
    value: float
    std: float
    low: float
    high: float
    start: float
    known: bool = True
    reason: str = ""

    def __repr__(self) -> str:
        unit = f" {self.unit}" if self.unit else ""
        if not self.known:
            return f"{self.name}: unknown ({self.reason})"
        note = f" ({self.reason})" if self.reason else ""
        return (
            f"{self.name} = {self.value:.6g}{unit} ± {self.std:.2g}, 95 % from {self.low:.6g} to {self.high:.6g}{note}"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class HeldOut:
    """How well a fit predicts a record that it was not made from; its initial states alone were fitted.

    Attributes:
        record: its name. errors: root mean square by output, SI. ratios: over the noise of the channel.
        explained: by output the share of the variance that is foretold, 1 for all.
    """

    record: str
    errors: Mapping[str, float]
    ratios: Mapping[str, float]
    explained: Mapping[str, float]


@dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """The result of `identify`, accepted wherever a plant is: its `system` is the plant with the estimates as values.

    Attributes:
        system: the plant with estimates, standard errors and their correlation.
        estimates: of the free parameters, in order. covariance: (q, q) of them, SI.
        initial: by record the states that each experiment began at, SI.
        experiments: what it was made from. residuals: by experiment (N, p), model − measured, SI, NaN where lost.
        tests: of the residuals, by output. held_out: of records that it was not made from.
        condition: of the slopes in units of the noise, columns in their sizes; 1 is best, infinite where some
            combination of unknowns changes nothing. aic: Akaike's criterion; differences between models count.
        converged: whether the search ended because nothing improves; else `stopped` says what ended it.
        notes: what else a reader should know. evaluations: of the model. source: where the values come from.

    Examples:
        >>> spring = ulna.model("mass_spring_damper")
        >>> run = ulna.simulate(spring.with_values(), [1, 0], np.linspace(0, 9, 91))
        >>> record = ulna.Record(times=run.t, columns={"y": run.y, "u": np.zeros(91)})
        >>> fit = ulna.identify(spring, record, free=["k"], initial={"p": 1.0, "s": 0.0})
        >>> ulna.controller_for(fit).law.method
        'exact, on the whole state'
    """

    system: System
    estimates: tuple[Estimate, ...]
    covariance: np.ndarray
    initial: tuple[Mapping[str, float], ...]
    experiments: tuple[Experiment, ...]
    outputs: tuple[str, ...]
    residuals: tuple[np.ndarray, ...]
    tests: tuple[ResidualTest, ...]
    held_out: tuple[HeldOut, ...] = ()
    condition: float = 1.0
    aic: float = 0.0
    converged: bool = True
    stopped: str = ""
    evaluations: int = 0
    notes: tuple[str, ...] = ()
    source: str = ""
    combinations: tuple[Mapping[str, float], ...] = field(default=())

    def __getitem__(self, name: str) -> Estimate:
        for each in self.estimates:
            if each.name == name:
                return each
        known = ", ".join(each.name for each in self.estimates) or "none"
        raise IdentificationError(f"estimate of '{name}'", "it was not free.", f"Free were: {known}.")

    @property
    def names(self) -> tuple[str, ...]:
        """Of the free parameters."""
        return tuple(each.name for each in self.estimates)

    @property
    def correlation(self) -> np.ndarray:
        """(q, q) of the estimates; NaN beside parameters that nothing tells."""
        with np.errstate(all="ignore"):
            std = np.sqrt(np.diag(self.covariance))
            return self.covariance / np.outer(std, std)

    @property
    def unknown(self) -> tuple[str, ...]:
        """Names of the parameters that the records do not tell."""
        return tuple(each.name for each in self.estimates if not each.known)

    @property
    def adequate(self) -> bool:
        """Whether noise explains what is left over of every output."""
        return all(test.explained for test in self.tests)

    def box(self, sigmas: float = 2.0) -> dict[str, tuple[float, float]]:
        """(lower, upper) of every known parameter, so many standard errors either side: for proofs and corner cases.

        Raises:
            IdentificationError: where one is not known.
        """
        if self.unknown:
            found = f"{', '.join(self.unknown)} cannot be determined from the records."
            raise IdentificationError("box of a fit", found, "Fix them, add priors, or measure more.")
        return {e.name: (e.value - sigmas * e.std, e.value + sigmas * e.std) for e in self.estimates}

    def predicted(self, experiment: int = 0) -> np.ndarray:
        """(N, p) outputs of the model along an experiment, SI; NaN where the sample was lost."""
        return self.experiments[experiment].measured + self.residuals[experiment]

    def __repr__(self) -> str:
        rows = [f"Fit of '{self.system.name}' to {', '.join(e.record.name for e in self.experiments)}:"]
        rows += [f"  {each!r}" for each in self.estimates]
        rows += [f"  {test.output}: {test.text}" for test in self.tests]
        rows += [f"  held out {h.record}: {_shares(h)}" for h in self.held_out]
        rows += [] if self.converged else [f"  not converged: {self.stopped}"]
        rows += [f"  {note}" for note in self.notes]
        return "\n".join(rows)

    def _repr_html_(self) -> str:
        rows = [
            (e.name, e.value, e.std, e.low, e.high, e.unit, e.reason or "known")
            if e.known
            else (e.name, e.value, "", "", "", e.unit, f"not determined: {e.reason}")
            for e in self.estimates
        ]
        headings = ("parameter", "estimate", "standard error", "from", "to", "unit", "verdict")
        below = [f"{test.output}: {test.text}" for test in self.tests]
        below += [f"held out {h.record}: {_shares(h)}" for h in self.held_out]
        below += [*([] if self.converged else [f"not converged: {self.stopped}"]), *self.notes]
        return html_table(rows, title=f"Fit of '{self.system.name}'", headings=headings, below=below)


def _shares(held: HeldOut) -> str:
    return ", ".join(f"{name} {100 * share:.4g} % of the variance" for name, share in held.explained.items())


@dataclass(frozen=True, slots=True, kw_only=True)
class Ranked:
    """A model among others.

    Attributes:
        name: of it. parameters: how many were free. aic: less that of the best. weight: Akaike's, the share of
            evidence among these models. held_out: error over noise on held-out records, root mean square; None without.
    """

    name: str
    parameters: int
    aic: float
    weight: float
    held_out: float | None
    fit: Fit


def compared(fits: Mapping[str, Fit]) -> tuple[Ranked, ...]:
    """Models of the same records, the best first: by held-out error where there is one, else by Akaike's criterion.

    Args:
        fits: by name; all of them made from the same samples.

    Raises:
        IdentificationError: none, or fits of other records.

    Reference:
        K. Burnham, D. Anderson, Model Selection and Multimodel Inference, 2nd ed., chapter 2.
    """
    if not fits:
        raise IdentificationError("a comparison of fits", "there are none.", "Give {'with friction': fit, …}.")
    sizes = {name: [(e.record.name, len(e.times)) for e in fit.experiments] for name, fit in fits.items()}
    first = next(iter(sizes))
    other = next((name for name in sizes if sizes[name] != sizes[first]), None)
    if other is not None or len({fit.outputs for fit in fits.values()}) > 1:
        found = f"'{first}' and '{other}' were made from other samples." if other else "their outputs differ."
        raise IdentificationError("a comparison of fits", found, "Fit all of them to the same records.")
    best = min(fit.aic for fit in fits.values())
    likely = {name: math.exp(-0.5 * (fit.aic - best)) for name, fit in fits.items()}
    rows = [
        Ranked(
            name=name,
            parameters=len(fit.estimates),
            aic=fit.aic - best,
            weight=likely[name] / sum(likely.values()),
            held_out=_held_error(fit),
            fit=fit,
        )
        for name, fit in fits.items()
    ]
    return tuple(sorted(rows, key=lambda row: (row.held_out is None, row.held_out or 0.0, row.aic)))


def _held_error(fit: Fit) -> float | None:
    ratios = [ratio for held in fit.held_out for ratio in held.ratios.values()]
    return math.sqrt(sum(r * r for r in ratios) / len(ratios)) if ratios else None
