"""Processor, sensors and drive from the command line: the same run as through Python, and refusals."""

from __future__ import annotations

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import ulna
from ulna.cli.main import app

POLES = ["--controller-poles", "-2+3.46j,-2-3.46j,-8", "--observer-poles", "-9,-10,-11"]


def command(*arguments: str):
    return CliRunner().invoke(app, list(arguments))


def test_a_sampled_run_is_that_of_the_library():
    hardware = ["--period", "1e-3", "--limit", "24", "--encoder", "12", "--delay", "5e-4", "--seed", "7"]
    hardware += ["--noise", "1e-4", "--slew", "2e4", "--jitter", "1e-4", "--missed", "0.01", "--pwm", "20e3:24"]
    done = command("simulate", "one_link_arm", *POLES, "--initial", "1,0,0", "--time", "1", *hardware, "--json")
    assert done.exit_code == 0, done.output
    arm = ulna.model("one_link_arm").with_values()
    law = ulna.state_feedback(ulna.controller_form(arm), ulna.Poles("-2+3.46j", "-2-3.46j", -8))
    observer = ulna.exact_observer(ulna.observer_form(arm), ulna.Poles(-9, -10, -11))
    from ulna.sim import Jitter, MeasurementNoise, MissedSamples, Pwm, SlewLimit

    clock = ulna.Sampled(
        controller=law.system,
        estimator=observer.system,
        period=1e-3,
        delay=5e-4,
        saturation=ulna.Saturation(lower=-24.0, upper=24.0),
        slew=SlewLimit(rate=2e4),
        sensors=ulna.Quantiser.encoder(bits=12),
        noise=MeasurementNoise(std=1e-4),
        jitter=Jitter(width=1e-4),
        missed=MissedSamples(probability=0.01),
        drive=Pwm(frequency=20e3, supply=24.0),
        seed=7,
    )
    run = ulna.simulate(arm, [1, 0, 0], 1.0, time=clock)
    assert np.array_equal(json.loads(done.stdout)["signals"]["theta"], run["theta"])


def test_a_set_point_is_held_on_a_processor_with_integral_action():
    asked = ["--controller-poles", "-5,-6,-7,-8", "--integral", "--set-point", "--input", "y_ref=0.3"]
    done = command(
        "simulate", "one_link_arm", *asked, "--initial", "0,0,0", "--period", "1e-3", "--limit", "60", "--json"
    )
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["signals"]["theta"][-1] == pytest.approx(0.3, abs=1e-6)


def test_estimates_start_where_the_plants_file_gives_its_operating_point():
    asked = ["--lqr", "1000,10,1:1", "--kalman", "1,1,1:0.01", "--initial", "0.01,0,1"]
    signals = json.loads(command("simulate", "magnetic_levitation", *asked, "--json").stdout)["signals"]
    assert (signals["x_hat"][0], signals["i_hat"][0], signals["cov_x_x"][0]) == (0.01, 1.0, 1.0)
    assert signals["x"][-1] == pytest.approx(0.01, abs=1e-9)


def test_a_sweep_counts_as_settled_what_ends_at_the_operating_point(tmp_path):
    asked = ["--controller-poles", "-10,-12,-15", "--vary", "x=uniform(0.0099,0.0101)", "--runs", "16"]
    for hardware in ([], ["--period", "1e-3"]):
        # Its target is 0.01 m; against 0 none would settle.
        out = tmp_path / f"runs{len(hardware)}"
        done = command("sweep", "magnetic_levitation", *asked, *hardware, "--out", str(out), "--json")
        assert done.exit_code == 0, done.output
        assert json.loads(done.stdout)["settled"]["count"] == 16


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--delay", "1e-3"], "it is for a sampled loop"),
        (["--period", "1e-3"], "there is no controller to be sampled"),
        ([*POLES, "--period", "1e-12"], "5e+12 samples, at most 1e+08"),
        ([*POLES, "--period", "1e-3", "--delay", "1e9"], "it is 1e+12 periods"),
        ([*POLES, "--limit", "abc"], "--limit 'abc': unknown symbol"),
        ([*POLES, "--period", "-1"], "the period must be a positive time"),
        ([*POLES, "--period", "1e-3", "--encoder", "12", "--resolution", "0.1"], "both set the step"),
        ([*POLES, "--period", "1e-3", "--pwm", "20e3"], "carrier and supply are due"),
        ([*POLES, "--period", "1e-3", "--event", "omega"], "they are for a continuous loop"),
        ([*POLES, "--period", "1e-3", "--limit", "2:1"], "not below"),
        ([*POLES, "--observer-initial", "1"], "1 numbers, 3 estimates (theta_hat, omega_hat, i_hat)"),
        ([*POLES, "--period", "1e-3", "--input", "u=1"], "inputs are: none"),
    ],
)
def test_options_that_do_not_go_together_are_one_clear_error(arguments, reason):
    done = command("simulate", "one_link_arm", "--initial", "1,0,0", *arguments)
    assert done.exit_code == 2, done.output
    assert reason in done.stderr
    assert done.stderr.startswith("error: ")
    assert "Traceback" not in done.output
