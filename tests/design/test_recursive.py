"""Parameters estimated while the plant moves."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import ulna
from ulna.base import DesignError
from ulna.design import recursive_estimator, with_unknowns
from ulna.loop import Loop
from ulna.sim import Held, simulate

NOISE = ulna.KalmanNoise(process={"theta": 1e-8, "omega": 1e-6, "i": 1e-6}, measurement={"y": 1e-9})
TIMES = np.linspace(0, 3, 61)


def test_the_load_is_found_while_the_arm_moves_and_followed_when_it_changes() -> None:
    arm = ulna.model("one_link_arm")
    observer = recursive_estimator(arm, ["m2"], noise=NOISE, spread={"m2": 2}, drift={"m2": 0.1})
    drive = {"u": Held(times=TIMES, values=np.repeat([8.0, -8, 8, -8, 8, 8.0], 12)[:61])}
    light = Loop(plant=arm.with_parameters({"m2": 3}), controller=observer)
    first = simulate(light, [1.0, 0.0, 0.0], TIMES, inputs=drive)
    assert first["m2_hat"][0] == 5.0
    assert first["m2_hat"][-1] == pytest.approx(3, abs=0.02)
    heavy = Loop(plant=arm.with_parameters({"m2": 4}), controller=observer)
    names = [s.name for s in heavy.system.states]
    then = simulate(heavy, dict(zip(names, first.states[-1].tolist(), strict=True)), TIMES, inputs=drive)
    assert then["m2_hat"][-1] == pytest.approx(4, abs=0.05)
    assert first["cov_m2_m2"][-1] < first["cov_m2_m2"][0] / 100


def test_the_start_is_as_unsure_as_the_plant_file_says() -> None:
    rows = {"a": {"value": 2, "std": 0.1}, "b": 4}
    plant = {
        "name": "lag",
        "parameters": rows,
        "states": {"x": "-a*x + b*u"},
        "inputs": {"u": {}},
        "outputs": {"y": "x"},
    }
    observer = recursive_estimator(ulna.system_from_mapping(plant), ["a", "b"])
    assert float(observer.initial["cov_a_a"]) == pytest.approx(0.01)
    assert float(observer.initial["cov_b_b"]) == pytest.approx(4.0)
    assert observer.initial["b_hat"] == 4
    assert [s.name for s in with_unknowns(ulna.system_from_mapping(plant), ["b"]).states] == ["x", "b"]


@pytest.mark.parametrize(
    ("free", "more", "said"),
    [
        (["m3"], {}, "there is no 'm3'"),
        ([], {}, "none is named"),
        (["m2"], {"drift": {"Ra": 1}}, "not estimated"),
        (["m2"], {"noise": ulna.KalmanNoise(process=[1, 1])}, "spread= and drift="),
    ],
)
def test_what_cannot_be_estimated_is_told(free: list[str], more: dict[str, Any], said: str) -> None:
    with pytest.raises(DesignError, match=said):
        recursive_estimator("one_link_arm", free, **more)
