"""Settings as text: every kind of controller and hardware reads back as what it was, and nothing else is read."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from campaign_loops import SAMPLED

import ulna
from ulna.campaign import CampaignError, Experiment, Random, Uniform
from ulna.campaign.runs import experiment_of
from ulna.campaign.runs.settings import from_text, to_text
from ulna.design import load_robust_compensator
from ulna.loop import (
    Amplifier,
    ConditionalIntegration,
    EndStop,
    Euler,
    Guard,
    Hardware,
    Jitter,
    Loop,
    MeasurementNoise,
    MissedSamples,
    Pwm,
    Quantiser,
    RungeKutta4,
    SafeOutput,
    Saturation,
    SlewLimit,
)
from ulna.program import Fused, Plain, Precision
from ulna.sim import TIME, FixedSteps, Held, Interpolated, Taylor
from ulna.system import System

ARM = ulna.model("one_link_arm").with_values()
FORM = ulna.controller_form(ARM)
LAW = ulna.state_feedback(FORM, ulna.Poles(-2, -3, -4))
CONTROLLERS = {
    "a law": LAW,
    "a law with an integral": ulna.state_feedback(FORM, ulna.Poles(-2, -3, -4, -5), integral=True),
    "exact": ulna.compensator(LAW, ulna.exact_observer(ulna.observer_form(ARM), ulna.Poles(-9, -10, -11))),
    "high gain": ulna.compensator(
        LAW, ulna.high_gain_observer(ARM, ulna.Poles(-1, -2, -3), time_scale=sp.Rational(1, 9))
    ),
    "Kalman": ulna.compensator(LAW, ulna.extended_kalman_filter(ARM)),
    "load-robust": load_robust_compensator(
        ulna.model("one_link_arm"), {"omega": 1}, law=ulna.Poles(-2, -3, -4), observer=ulna.Poles(-6, -7, -8, -9)
    ),
}


def _values_at_random(system: System, seed: int) -> list[float]:
    """All rates and readouts at one random point."""
    random = np.random.default_rng(seed)
    symbols = (*system.state_symbols, *system.input_symbols, *system.parameter_symbols)
    point = {
        symbol: float(value) for symbol, value in zip(symbols, random.uniform(0.2, 0.9, len(symbols)), strict=True)
    }
    return [float(e.subs(point)) for e in system.inline((*system.rates, *system.readouts))]


@pytest.mark.parametrize("kind", CONTROLLERS)
def test_a_loop_with_any_controller_reads_back_with_the_same_formulas(kind: str) -> None:
    loop = Loop(plant=ARM, controller=CONTROLLERS[kind])
    read = from_text(to_text(loop))
    one, other = loop.parts, read.parts
    assert one is not None
    assert one.law is not None
    assert other.law is not None
    for a, b in ((one.system, other.system), (one.law, other.law)):
        assert _values_at_random(b, 1) == pytest.approx(_values_at_random(a, 1), rel=1e-12)
    assert type(other.observer) is type(one.observer)
    assert read.wiring.observed == loop.wiring.observed
    assert [s.name for s in read.references] == [s.name for s in loop.references]


@pytest.mark.parametrize(
    "hardware",
    [
        None,
        Hardware(saturation=Saturation(lower=-3, upper=3)),
        Hardware(
            period=0.01,
            delay=0.005,
            sensors={"x": Quantiser.encoder(bits=12)},
            noise=MeasurementNoise(std=0.1),
            drive=Pwm(frequency=1e4, supply=24.0, sag=0.1),
            saturation={"u": Saturation(lower=-3, upper=3)},
            slew=SlewLimit(rate=100.0),
            anti_windup=ConditionalIntegration(states=()),
            discretisation=Euler(substeps=2),
            clock=(Jitter(width=1e-4), MissedSamples(probability=0.1)),
            end_stops=(EndStop(position="x", velocity="v", upper=1.0),),
            guard=Guard(reaction=SafeOutput(0.0)),
            arithmetic=Plain(precision=Precision.SINGLE),
        ),
        Hardware(
            period=0.01,
            drive=Amplifier(
                lower="-V", upper=sp.Symbol("V", real=True) - sp.Symbol("v", real=True), numbers={"V": 24.0}
            ),
            discretisation=RungeKutta4(),
            clock=Jitter(width=1e-4),
            guard=None,
            arithmetic=Fused(),
        ),
    ],
)
def test_hardware_reads_back_as_it_was_written(hardware: Hardware | None) -> None:
    loop = Loop(plant=SAMPLED.plant, controller=SAMPLED.controller, hardware=hardware)
    text = to_text(loop)
    read = from_text(text)
    assert to_text(read) == text
    if hardware is not None:
        for name in (
            "period",
            "sensors",
            "noise",
            "saturation",
            "slew",
            "discretisation",
            "clock",
            "end_stops",
            "guard",
        ):
            assert getattr(read.hardware, name) == getattr(hardware, name), name
        assert read.hardware.arithmetic == hardware.arithmetic
        assert read.hardware.arithmetic.precision is hardware.arithmetic.precision


def test_inputs_and_engines_read_back() -> None:
    times = np.array([0.0, 0.5, 1.0])
    given = {
        "held": Held(times=times, values=times),
        "lines": Interpolated(times=times, values=np.stack([times, -times])),
    }
    for name, each in given.items():
        read = from_text(to_text(each))
        assert type(read) is type(each), name
        assert np.array_equal(read.values, each.values)
    for engine in (Taylor(tolerance=1e-9), FixedSteps(number=3, order=2, bound=5.0)):
        assert from_text(to_text(engine)) == engine


@pytest.mark.parametrize("inputs", [{"goal": 0.5}, {"goal": sp.sin(TIME)}, {"goal": lambda t: 2 * t}])
def test_settings_of_an_experiment_read_back_as_they_were_written(inputs: dict) -> None:
    plan = Random(vary={"m": Uniform(low=1, high=2)}, runs=3)
    text = to_text(Experiment(loop=SAMPLED, horizon=1.0, plan=plan, inputs=inputs))
    assert to_text(experiment_of(text)) == text


def test_a_formula_that_is_read_in_another_order_keeps_its_meaning() -> None:
    x, k = sp.symbols("x k", real=True)
    given = sp.Mul(-1, 5 * x + 6 * sp.Abs(k), evaluate=False)
    assert sp.expand(from_text(to_text(given)) - given) == 0


def test_what_the_formula_language_does_not_know_is_refused() -> None:
    for given in (sp.gamma(sp.Symbol("x", real=True)), object()):
        with pytest.raises(CampaignError, match="cannot be stored"):
            to_text(given)


@pytest.mark.parametrize(
    "text",
    ["", "[1", '{"type":"os.system"}', '{"type":"Experiment"}', '{"type":"formula","text":"__import__(1)"}', "3"],
)
def test_settings_that_are_none_are_refused(text: str) -> None:
    with pytest.raises(CampaignError, match="settings of a campaign"):
        experiment_of(text)
