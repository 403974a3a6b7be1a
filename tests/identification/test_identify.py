"""Parameters from records: estimates, intervals, what cannot be told, wrong models, bad records."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ulna.base import UnitError
from ulna.identification import Fit, IdentificationError, Record, identify, read_record
from ulna.sim import Held, simulate
from ulna.system import System, read_system, system_from_mapping, write_system


def _motor(drag: str = "") -> System:
    return system_from_mapping(
        {
            "name": "motor",
            "parameters": {"a": {"value": 2.0, "range": [0, 20]}, "b": 5.0, "c": 1.0},
            "states": {
                "theta": {"unit": "rad", "equation": "omega"},
                "omega": {"unit": "rad/s", "equation": f"b*c*u - a*omega{drag}"},
            },
            "inputs": {"u": {"unit": "V"}},
            "outputs": {"theta": {"unit": "rad", "equation": "theta"}},
            "dimensions": "unchecked",
        }
    )


def _log(plant: System, seed: int, count: int = 400, noise: float = 2e-3, step: float = 2e-3) -> Record:
    random = np.random.default_rng(seed)
    times = np.arange(count) * 0.01
    u = np.repeat(random.uniform(-1, 1, count // 20 + 1), 20)[:count]
    theta = simulate(plant, [0.1, 0.0], times, inputs={"u": Held(times=times, values=u)})["theta"]
    theta = np.round((theta + noise * random.normal(size=count)) / step) * step
    return Record(times=times, columns={"theta": theta, "u": u}, name=f"log {seed}")


def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    truth, begun = _motor(), _motor().with_parameters({"a": 3, "b": 4})
    errors = []
    for seed in range(200):
        fit = identify(begun, _log(truth, seed, count=200), free="a, b")
        errors.append([(fit[n].value - v) / fit[n].std for n, v in (("a", 2.0), ("b", 5.0))])
    inside = (np.abs(errors) < 1.96).mean()
    assert 0.9 <= inside <= 0.99
    assert np.abs(np.mean(errors, axis=0)).max() < 2.0 / np.sqrt(200) * 1.5


def test_a_product_is_told_and_its_factors_are_not() -> None:
    fit = identify(_motor(), _log(_motor(), 1), free="a, b, c")
    assert fit.unknown == ("b", "c")
    assert fit["b"].reason == "the model determines only b*c"
    assert fit["a"].known
    helped = identify(_motor(), _log(_motor(), 1), free="a, b, c", priors={"c": "1 ± 5%"})
    assert not helped.unknown
    assert np.isinf(fit["b"].std)
    with pytest.raises(IdentificationError, match="cannot be determined"):
        fit.box()


def test_a_wrong_model_is_rejected_by_its_residual_and_the_true_one_is_not() -> None:
    record = _log(_motor(" - 8*tanh(5*omega)"), 2)
    assert not identify(_motor(), record, free="a, b").adequate
    assert identify(_motor(), _log(_motor(), 2), free="a, b", held_out=_log(_motor(), 3)).adequate


def test_the_fitted_plant_is_a_file_with_standard_deviations(tmp_path: Path) -> None:
    fit = identify(_motor(), _log(_motor(), 4), free="a, b")
    assert isinstance(fit, Fit)
    write_system(fit.system, tmp_path / "fitted.toml")
    read = read_system(tmp_path / "fitted.toml")
    assert read == fit.system
    assert [p.std is not None for p in read.parameters] == [True, True, False]
    assert read.correlations


def test_records_from_text_bear_units(tmp_path: Path) -> None:
    place = tmp_path / "log.csv"
    place.write_text("time [ms],theta [deg],u [V]\n0,90,1\n10,180,1\n20,270,1\n", encoding="utf-8")
    record = read_record(place)
    assert record.times == pytest.approx([0, 0.01, 0.02])
    assert record.columns["theta"] == pytest.approx([np.pi / 2, np.pi, 1.5 * np.pi])


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("t,thetta,u\n0,1,1\n1,2,1\n2,3,1\n3,3,2\n", "Did you mean thetta"),
        ("t,theta,u\n0,1,1\n1,2,1\n0.5,3,1\n", "time goes back"),
        ("t,theta,u\n0,1,1\n1,nan,1\n2,3,1\n", "holds no number at line 3"),
        ("t,theta,u\n0,1,1\n1,2,1\n", "for 4 unknowns"),
    ],
)
def test_a_record_that_cannot_be_used_is_refused(tmp_path: Path, text: str, found: str) -> None:
    place = tmp_path / "log.csv"
    place.write_text(text, encoding="utf-8")
    with pytest.raises(IdentificationError, match=found):
        identify(_motor(), place, free="a, b")


def test_questions_that_cannot_be_asked_are_refused(tmp_path: Path) -> None:
    record = _log(_motor(), 5)
    with pytest.raises(IdentificationError, match="no parameter"):
        identify(_motor(), record, free="d")
    with pytest.raises(IdentificationError, match="does not contain"):
        identify(_motor(), record, free="b", bounds={"b": (6, 9)})
    place = tmp_path / "log.csv"
    place.write_text("t,theta [V],u\n0,1,1\n1,2,1\n2,3,1\n3,3,2\n4,4,1\n", encoding="utf-8")
    with pytest.raises(UnitError, match="measures"):
        identify(_motor(), place, free="a")
