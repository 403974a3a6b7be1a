"""Processor, sensors and drive from the command line: the same run as through Python, and refusals."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from terminal import answered, refused

import ulna
from ulna.loop import (
    ConditionalIntegration,
    Euler,
    ExactHold,
    Hardware,
    Jitter,
    Loop,
    MeasurementNoise,
    MissedSamples,
    Pwm,
    Quantiser,
    Saturation,
    SlewLimit,
)
from ulna.program import Plain
from ulna.sim import TIME, simulate
from ulna.system import read_system

POLES = ["--controller-poles", "-2+3.46j,-2-3.46j,-8", "--observer-poles", "-9,-10,-11"]
ARM = ["simulate", "one_link_arm", "--initial", "1,0,0"]
PROCESSOR = [*ARM, *POLES, "--period", "1e-3", "--horizon", "0.5"]


def theta(*arguments: str) -> np.ndarray:
    """The angle at every sample."""
    return np.array(answered(*arguments)["signals"]["theta"])


@pytest.fixture(scope="module")
def arm():
    return ulna.model("one_link_arm").with_values()


@pytest.fixture(scope="module")
def law(arm):
    return ulna.state_feedback(ulna.controller_form(arm), ulna.Poles("-2+3.46j", "-2-3.46j", -8))


HOLDING = -17.64
"""A, the current at the operating point: what is not typed starts there, plant and estimates alike."""


def test_a_sampled_run_is_that_of_the_library(arm, law):
    asked = ["--limit", "24", "--encoder", "12", "--delay", "5e-4", "--seed", "7", "--noise", "1e-4"]
    asked += ["--slew", "2e4", "--jitter", "1e-4", "--missed", "0.01", "--pwm", "20e3:24"]
    observer = ulna.exact_observer(ulna.observer_form(arm), ulna.Poles(-9, -10, -11))
    hardware = Hardware(
        period=1e-3,
        delay=5e-4,
        saturation=Saturation(lower=-24.0, upper=24.0),
        slew=SlewLimit(rate=2e4),
        sensors=Quantiser.encoder(bits=12),
        noise=MeasurementNoise(std=1e-4),
        clock=(Jitter(width=1e-4), MissedSamples(probability=0.01)),
        drive=Pwm(frequency=20e3, supply=24.0),
    )
    loop = Loop(plant=arm, controller=ulna.compensator(law, observer), hardware=hardware)
    run = simulate(loop, {"theta": 1, "omega": 0, "i": 0, "i_hat": HOLDING}, 0.5, seed=7)
    assert np.array_equal(theta(*PROCESSOR, *asked), run["theta"])
    # The seed is what noise and clock follow.
    assert not np.array_equal(theta(*PROCESSOR, *asked, "--seed", "8"), run["theta"])


def test_an_observer_is_held_exactly(arm, law):
    observer = ulna.injected_observer(ulna.observer_form(arm), ulna.Poles(-9, -10, -11))
    hardware = Hardware(period=1e-3, discretisation=ExactHold())
    loop = Loop(plant=arm, controller=ulna.compensator(law, observer), hardware=hardware)
    run = simulate(loop, {"theta": 1, "omega": 0, "i": HOLDING, "theta_hat": 0.8, "i_hat": HOLDING}, 0.5)
    found = theta(*PROCESSOR, "--discretise", "exact", "--initial", "theta=1, theta_hat=0.8")
    assert np.array_equal(found, run["theta"])


MASS = 'name = "mass"\n[parameters]\nm = { value = 1 }\n[states]\nx = "v"\nv = "u/m"\n[inputs]\nu = {}\n'
MASS += '[outputs]\nx = "x"\n'
PI = 'name = "PI"\n[states]\nsum = "x_ref - x"\n[inputs]\nx = {}\nv = {}\nx_ref = {}\n'
PI += '[outputs]\nu = "20*(x_ref - x) + 8*sum - 9*v"\n'


@pytest.mark.parametrize(("anti_windup", "state"), [("sum", ("sum",)), ("none", ())])
def test_a_users_integral_waits_while_the_input_is_limited(anti_windup, state, tmp_path):
    (tmp_path / "mass.toml").write_text(MASS)
    (tmp_path / "pi.toml").write_text(PI)
    asked = ["--controller", str(tmp_path / "pi.toml"), "--reference", "x=sin(t)", "--set", "m=2", "--limit", "u=1"]
    asked += ["--period", "0.01", "--discretise", "euler", "--arithmetic", "plain", "--anti-windup", anti_windup]
    found = answered("simulate", str(tmp_path / "mass.toml"), *asked)["signals"]["x"]
    hardware = Hardware(
        period=0.01,
        saturation={"u": Saturation(lower=-1.0, upper=1.0)},
        anti_windup=ConditionalIntegration(states=state) if state else None,
        discretisation=Euler(),
        arithmetic=Plain(),
    )
    plant, controller = (read_system(tmp_path / name) for name in ("mass.toml", "pi.toml"))
    loop = Loop(plant=plant, controller=controller, hardware=hardware)
    run = simulate(loop, [0, 0], 5.0, inputs={"x_ref": sp.sin(TIME)}, parameters={"m": 2})
    assert np.array_equal(found, run["x"])


def test_a_set_point_is_held_on_a_processor_with_integral_action():
    asked = ["--controller-poles", "-5,-6,-7,-8", "--integral", "--set-point", "--reference", "y=0.3"]
    found = theta("simulate", "one_link_arm", *asked, "--initial", "0,0,0", "--period", "1e-3", "--limit", "60")
    assert found[-1] == pytest.approx(0.3, abs=1e-6)


def test_estimates_start_where_the_plants_file_gives_its_operating_point():
    asked = ["--lqr", "1000,10,1:1", "--kalman", "1,1,1:0.01", "--initial", "0.01,0,1"]
    signals = answered("simulate", "magnetic_levitation", *asked)["signals"]
    assert (signals["x_hat"][0], signals["i_hat"][0], signals["cov_x_x"][0]) == (0.01, 1.0, 1.0)
    assert signals["x"][-1] == pytest.approx(0.01, abs=1e-9)


SAMPLED = [*POLES, "--period", "1e-3"]


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--delay", "1e-3"], "--delay: it is for a sampled loop"),
        (["--discretise", "euler"], "--discretise: it is for a sampled loop"),
        (["--arithmetic", "plain"], "--arithmetic: it is for a sampled loop"),
        (["--anti-windup", "none"], "--anti-windup: it is for a sampled loop"),
        (["--period", "1e-3"], "there is no controller to be sampled"),
        ([*POLES, "--period", "1e-12"], "--period 1e-12: a run of 5 s has 5e+12 samples, at most 1e+08"),
        ([*POLES, "--period", "1e-320"], "a run of 5 s has inf samples, at most 1e+08"),
        ([*POLES, "--period", "9"], "--period 9: the period is longer than the run of 5 s"),
        ([*SAMPLED, "--delay", "1e9"], "--delay 1000000000.0: it is 1e+12 periods"),
        ([*POLES, "--limit", "abc"], "--limit 'abc': unknown symbol"),
        ([*POLES, "--period", "-1"], "--period -1.0: the period must be a positive time"),
        ([*POLES, "--period", "0"], "--period 0.0: the period must be a positive time"),
        ([*SAMPLED, "--encoder", "12", "--resolution", "0.1"], "both set the step"),
        ([*SAMPLED, "--encoder", "0"], "--encoder 0: expected 1 to 52 bits"),
        ([*SAMPLED, "--encoder", "99"], "--encoder 99: expected 1 to 52 bits"),
        ([*SAMPLED, "--resolution", "-1"], "--resolution -1.0: the step must be a positive number"),
        ([*SAMPLED, "--noise", "-1"], "--noise -1.0: expected 0 or a positive number"),
        ([*SAMPLED, "--slew", "-1"], "--slew -1.0: the rate must be positive"),
        ([*SAMPLED, "--jitter", "1"], "--jitter 1.0: it is not shorter than the period"),
        ([*SAMPLED, "--missed", "1"], "--missed 1.0: expected a number in [0, 1)"),
        ([*SAMPLED, "--pwm", "20e3"], "expected carrier and supply"),
        ([*SAMPLED, "--pwm", "20e3:-1"], "--pwm, the value -1.0: it must be a positive number"),
        ([*SAMPLED, "--event", "omega"], "they are for a continuous loop"),
        ([*SAMPLED, "--limit", "2:1"], "--limit 2.0:1.0: the lower limit 2.0 is not below"),
        ([*SAMPLED, "--input", "u=1"], "there is no input 'u'. Known: none."),
        ([*SAMPLED, "--discretise", "exact", "--high-gain", "0.1"], "there is no observer whose error is linear"),
        ([*SAMPLED[:2], "--period", "1e-3", "--discretise", "exact"], "there is no observer to be held"),
        ([*SAMPLED, "--anti-windup", "none,e1_int", "--limit", "9"], "there is no state of the controller 'none'"),
        ([*SAMPLED, "--anti-windup", "theta_hatt", "--limit", "9"], "Did you mean theta_hat"),
        ([*SAMPLED, "--anti-windup", "theta_hat"], "no input is limited. Add --limit 24"),
    ],
)
def test_options_that_do_not_go_together_are_one_clear_error(arguments, reason):
    assert reason in refused(*ARM, *arguments)


def test_a_controller_in_a_file_is_not_held_exactly(tmp_path):
    (tmp_path / "pi.toml").write_text(PI)
    asked = ["--controller", str(tmp_path / "pi.toml"), "--period", "0.01", "--discretise", "exact"]
    assert "no part of a controller in a file is known to be linear" in refused(*ARM, *asked)


def test_a_sweep_counts_as_settled_what_ends_at_the_operating_point(tmp_path):
    asked = ["--controller-poles", "-10,-12,-15", "--vary", "x=uniform(0.0099,0.0101)", "--runs", "16"]
    for hardware in ([], ["--period", "1e-3"]):
        # Its target is 0.01 m; against 0 none would settle.
        out = tmp_path / f"runs{len(hardware)}"
        assert answered("sweep", "magnetic_levitation", *asked, *hardware, "--out", str(out))["settled"]["count"] == 16
