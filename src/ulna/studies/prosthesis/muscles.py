"""Two muscles that a hand holds, as one system in discrete time: effort to electromyogram, activation, intent, angle.

The same chain as `synthetic_recording`, `activations`, `read_intent` and `followable`, sample by sample, for the page.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import sympy as sp

from ulna.page import SetPointSource
from ulna.studies.prosthesis.emg_pipeline import Pipeline, calibrated, filter_sections
from ulna.studies.prosthesis.emg_signal import SyntheticMuscles, shaping_sections, synthetic_recording
from ulna.studies.prosthesis.intent import CoContractionSwitch, following_matrices
from ulna.studies.prosthesis.plant import Bench
from ulna.symbolic.formulas import exact
from ulna.system import Definition, Signal, System

MUSCLES = ("flexor", "extensor")
_KEYS = ("f", "e")
_RATE = 1000.0
_POLE = 15.0


def held_muscles(bench: Bench) -> SetPointSource:
    """Flexor and extensor of a user of this bench, who drive the angle wanted by their difference."""
    made = muscle_system(bench, SyntheticMuscles(rate=_RATE), _pipeline())
    held: dict[str, str] = dict(zip(MUSCLES, _KEYS, strict=True))
    return SetPointSource(
        system=made,
        text="the muscles move the set point",
        held=held,
        noise=tuple(s.name for s in made.inputs if s.name not in held),
        starts={"position": "y_ref", "wanted_0": "y_ref"},
        muscles=(f"activation_{MUSCLES[0]}", f"activation_{MUSCLES[1]}"),
    )


def _pipeline() -> Pipeline:
    """Calibrated on the greatest contraction of both synthetic muscles."""
    return calibrated(synthetic_recording(SyntheticMuscles(seed=9), np.ones(4000), np.ones(4000)))


def muscle_system(bench: Bench, muscles: SyntheticMuscles, pipeline: Pipeline) -> System:
    """The chain at the muscles' rate: inputs effort of each and four white numbers of deviation one a sample.

    Outputs are the reference `y_ref` with its three derivatives, and by muscle `emg_…` (V) and `activation_…`; memory
    `position` is what the intent says, `wanted_0` … the reference.
    """
    chain = _Chain()
    efforts = [_symbol(name) for name in MUSCLES]
    raw = _electromyograms(chain, muscles, efforts)
    active = [
        _activation(chain, pipeline, name, each, k) for k, (name, each) in enumerate(zip(MUSCLES, raw, strict=True))
    ]
    selected = _switched(chain, CoContractionSwitch(), active, muscles.rate)
    position = chain.remember("position", unit="rad")
    step = exact(bench.motion.speed / muscles.rate)
    moved = position - step * (active[0] - active[1])
    low, high = exact(bench.motion.lower), exact(bench.motion.upper)
    moved = chain.name(sp.Piecewise((sp.Min(sp.Max(moved, low), high), sp.Eq(selected, 0)), (position, True)))
    chain.then(position, moved)
    reference = _followed(chain, moved, muscles.rate)
    outputs = {"y_ref" if k == 0 else f"y_ref_d{k}": each for k, each in enumerate(reference)}
    outputs |= {f"emg_{name}": each for name, each in zip(MUSCLES, raw, strict=True)}
    outputs |= {f"activation_{name}": each for name, each in zip(MUSCLES, active, strict=True)}
    signals = [
        Signal(name=name, lower=sp.Integer(0), upper=sp.Integer(1), text=f"effort of the {name}") for name in MUSCLES
    ]
    return System(
        name="muscles",
        states=tuple(chain.states),
        rates=tuple(chain.after[s.name] for s in chain.states),
        inputs=(*signals, *(Signal(name=f"white_{k}") for k in range(4))),
        outputs=tuple(Signal(name=name, unit=_unit(name), text=_text(name)) for name in outputs),
        readouts=tuple(outputs.values()),
        definitions=tuple(chain.named),
        period=exact(1 / muscles.rate),
    )


def _unit(name: str) -> str:
    return _UNITS.get(name, "V" if name.startswith("emg") else "")


def _text(name: str) -> str:
    kind, _, muscle = name.partition("_")
    told = {"emg": "muscle signal of the ", "activation": "activation of the "}
    return told[kind] + muscle if kind in told else ""


_UNITS = {"y_ref": "rad", "y_ref_d1": "rad/s", "y_ref_d2": "rad/s^2", "y_ref_d3": "rad/s^3"}


@dataclass(kw_only=True)
class _Chain:
    """States with what they become, and abbreviations in order."""

    states: list[Signal] = field(default_factory=list)
    after: dict[str, sp.Expr] = field(default_factory=dict)
    named: list[Definition] = field(default_factory=list)

    def remember(self, name: str, unit: str = "") -> sp.Symbol:
        self.states.append(Signal(name=name, unit=unit))
        return self.states[-1].symbol

    def then(self, state: sp.Symbol, value: sp.Expr) -> None:
        self.after[state.name] = value

    def name(self, value: sp.Expr) -> sp.Symbol:
        self.named.append(Definition(name=f"s{len(self.named)}", expression=value))
        return self.named[-1].symbol

    def filtered(self, sections: np.ndarray, value: sp.Expr, stem: str) -> sp.Expr:
        """Second-order sections one after the other, in the transposed direct form II of `scipy.signal.sosfilt`."""
        for k, (b0, b1, b2, _, a1, a2) in enumerate([[exact(float(c)) for c in row] for row in sections]):
            here = self.name(value)
            one, two = (self.remember(f"{stem}_{k}_{j}") for j in (0, 1))
            out = self.name(b0 * here + one)
            self.then(one, b1 * here - a1 * out + two)
            self.then(two, b2 * here - a2 * out)
            value = out
        return value


def _electromyograms(chain: _Chain, muscles: SyntheticMuscles, efforts: Sequence[sp.Symbol]) -> list[sp.Symbol]:
    sections, gain = shaping_sections(muscles.rate)
    noise = [chain.filtered(sections, _symbol(f"white_{k}"), f"shape_{k}") / exact(gain) for k in range(4)]
    pure = [chain.name(exact(muscles.amplitude) * e * n) for e, n in zip(efforts, noise, strict=False)]
    angle = 2 * np.pi * muscles.hum_frequency / muscles.rate
    turn, swing = (exact(float(f(angle))) for f in (np.cos, np.sin))
    # A pointer that turns; it stands one sample behind, so that memory may begin at zero.
    ahead, across = chain.remember("hum_cosine"), chain.remember("hum_sine")
    chain.then(ahead, turn * (1 + ahead) - swing * across - 1)
    chain.then(across, swing * (1 + ahead) + turn * across)
    return [
        chain.name(
            pure[k]
            + exact(muscles.crosstalk) * pure[1 - k]
            + exact(muscles.floor) * noise[2 + k]
            + exact(muscles.hum) * across
        )
        for k in (0, 1)
    ]


def _activation(chain: _Chain, pipeline: Pipeline, name: str, raw: sp.Expr, muscle: int) -> sp.Symbol:
    clean, smooth = filter_sections(pipeline.rate, pipeline.mains, pipeline.envelope)
    size = chain.name(sp.Abs(chain.filtered(clean, raw, f"clean_{name}")))
    slow = sp.Max(chain.filtered(smooth, size, f"smooth_{name}"), 0)
    rest, full = exact(pipeline.rest[muscle]), exact(pipeline.contraction[muscle])
    share = chain.name(sp.Min(sp.Max((slow - rest) / (full - rest), 0), 1))
    dead = exact(pipeline.dead_band)
    return chain.name(sp.Max(share - dead, 0) / (1 - dead))


def _switched(chain: _Chain, switch: CoContractionSwitch, active: Sequence[sp.Symbol], rate: float) -> sp.Symbol:
    """0 while the joint is selected, 1 while the other function is. `spent` is 0 while the switch is armed."""
    needed = max(1, int(np.ceil(switch.hold * rate)))
    level = exact(switch.level)
    together, spent, chosen = (chain.remember(name) for name in ("together", "spent", "selected"))
    both = sp.And(*(each >= level for each in active))
    neither = sp.And(*(each < level for each in active))
    count = chain.name(sp.Piecewise((together + 1, both), (0, True)))
    used = chain.name(sp.Piecewise((0, neither), (spent, True)))
    turns = sp.And(sp.Eq(used, 0), count >= needed)
    selected = chain.name(sp.Piecewise((1 - chosen, turns), (chosen, True)))
    chain.then(together, sp.Min(count, needed))
    chain.then(spent, sp.Piecewise((1, turns), (used, True)))
    chain.then(chosen, selected)
    return selected


def _followed(chain: _Chain, wanted: sp.Expr, rate: float) -> list[sp.Expr]:
    """The reference and three derivatives, as `followable` makes them."""
    grow, feed = following_matrices(rate, _POLE)
    lags = [chain.remember(f"wanted_{k}") for k in range(3)]
    for k, lag in enumerate(lags):
        chain.then(
            lag, sum((exact(float(grow[k, j])) * each for j, each in enumerate(lags)), exact(float(feed[k])) * wanted)
        )
    last = wanted - lags[0] - 3 * lags[1] - 3 * lags[2]
    return [each * exact(_POLE) ** k for k, each in enumerate((*lags, last))]


def _symbol(name: str) -> sp.Symbol:
    return sp.Symbol(name, real=True)
