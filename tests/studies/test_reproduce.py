"""`ulna reproduce`: what must come out of the paper, and the folder it is written to.

The golden file is renewed by `ulna reproduce --out NEW && cp NEW/results.json tests/studies/golden/`.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
import xarray as xr

GOLDEN = Path(__file__).parent / "golden" / "results.json"
ULNA = Path(sys.executable).with_name("ulna")


@pytest.fixture(scope="module")
def results(reproduction: Path) -> dict[str, Any]:
    return json.loads((reproduction / "results.json").read_text())


def _equation(results: dict[str, Any], number: int) -> dict[str, Any]:
    return next(entry for entry in results["equations"] if entry["number"] == number)


def _loop(results: dict[str, Any], key: str) -> dict[str, Any]:
    return next(loop for loop in results["loops"] if loop["key"] == key)


def _formula(text: str) -> sp.Expr:
    names = {name: sp.Symbol(name) for name in ("x1", "x2", "x3")}
    return sp.sympify(text, locals=names)


def _same(left: Any, right: Any, place: str = "results") -> None:
    """Equal structure and text; floats to six digits."""
    assert type(left) is type(right) or {type(left), type(right)} <= {int, float}, place
    if isinstance(left, dict):
        assert list(left) == list(right), place
        for key in left:
            _same(left[key], right[key], f"{place}.{key}")
    elif isinstance(left, list):
        assert len(left) == len(right), place
        for index, (one, other) in enumerate(zip(left, right, strict=True)):
            _same(one, other, f"{place}[{index}]")
    elif isinstance(left, float):
        assert left == pytest.approx(right, rel=3e-6, abs=2e-8), place
    else:
        assert left == right, place


def test_the_results_are_the_golden_ones(results):
    _same(results, json.loads(GOLDEN.read_text()))


def test_every_numbered_equation_has_a_verdict(results):
    numbers = [entry["number"] for entry in results["equations"] if entry["number"]]
    assert numbers == list(range(1, 55))
    known = {"statement", "agrees to the printed digits", "rounding carried through", "misprint"}
    for entry in results["equations"]:
        assert entry["verdict"] in known
        assert entry["comparisons"], entry["label"]


def test_the_exact_law_is_the_one_that_must_come_out(results):
    wanted = "-6528*x1/1000 - 1448*x2/1000 - x3/5 - 21168*cos(x1)/1000 + 1764*x2*sin(x1)/1000"
    assert sp.expand(_formula(results["design"]["law"]) - _formula(wanted)) == 0


def test_the_observer_gains_and_the_poles_of_the_error_are_exact(results):
    gains = [sp.Rational(text) for text in results["design"]["observer_gains_in_x"]]
    assert gains[0] == 20
    assert gains[2] == -100
    assert abs(gains[1] - sp.Rational("79.392")) < sp.Rational(1, 1000)
    assert [int(text) for text in results["design"]["error_poles"]] == [-9, -10, -11]


def test_the_exact_loops_end_at_zero_and_the_printed_ones_do_not(results):
    for key in ("state_feedback", "compensator"):
        exact, printed = _loop(results, f"{key}_exact"), _loop(results, f"{key}_printed")
        assert exact["steady_error_degrees"] == 0.0
        assert abs(printed["steady_error_degrees"]) > 0.5
        for run in (*exact["runs"], *printed["runs"]):
            assert run["comes_to_rest"]
        assert [run["initial_angle"] for run in exact["runs"]] == [1.0, -1.0, -2.0]
        assert max(abs(run["final_error_degrees"]) for run in exact["runs"]) < 1e-6
        for run in printed["runs"]:
            assert run["final_error_degrees"] == pytest.approx(printed["steady_error_degrees"], abs=1e-5)


def test_the_printed_laws_steady_error_solves_its_balance_of_torques(results):
    # At rest i = u = -17.64 cos x and u = -6.528 x - 0.2 i - 21.24 cos x, hence 6.528 x + 0.072 cos x = 0.
    error = np.radians(_loop(results, "state_feedback_printed")["steady_error_degrees"])
    assert 6.528 * error + 0.072 * np.cos(error) == pytest.approx(0.0, abs=1e-6)


def test_holding_the_arm_costs_the_power_of_its_weight_on_the_motor(results):
    exact = _loop(results, "compensator_exact")
    assert exact["holding_voltage"] == pytest.approx(-17.64)
    assert exact["holding_power"] == pytest.approx(17.64**2, rel=1e-5)


def test_the_exact_compensator_has_exactly_the_chosen_poles(results):
    poles = [complex(p["re"], p["im"]) for p in _loop(results, "compensator_exact")["poles"]]
    wanted = [-2 - 3.464102j, -2 + 3.464102j, -8, -9, -10, -11]
    for pole in wanted:
        assert min(abs(pole - other) for other in poles) < 1e-4


def test_the_known_misprints_are_among_those_found(results):
    def own(number: int) -> set[str]:
        found = _equation(results, number)["comparisons"]
        return {c["printed"] for c in found if c["verdict"] == "misprint" and not c["copied"]}

    assert own(32) == {"-1.428", "-1.81"}
    assert own(26) == {"1.77", "T1, Lf(T1), Lf(Lf(T))"}
    assert own(53) == {"-9.1"}
    assert _equation(results, 20)["verdict"] == "misprint"
    assert _equation(results, 21)["verdict"] == "misprint"
    assert _equation(results, 44)["verdict"] == "misprint"
    assert _equation(results, 46)["verdict"] == "rounding carried through"
    assert _equation(results, 25)["verdict"] == "agrees to the printed digits"
    assert _equation(results, 19)["verdict"] == "statement"


def test_the_rounded_minus_9_8_is_the_largest_cause_and_velocity_terms_cause_nothing(results):
    causes = {cause["place"]: cause for cause in results["causes"]}
    largest = max(results["causes"], key=lambda cause: abs(cause["steady_error_alone_degrees"]))
    assert largest["place"] == "(53), A, row 3, column 3"
    assert causes["(32), cos(x1)"]["steady_error_alone_degrees"] == pytest.approx(
        _loop(results, "state_feedback_printed")["steady_error_degrees"]
    )
    for place in ("(32), x2", "(32), x2*sin(x1)", "(53), A, row 3, column 2", "(53), L, row 3"):
        assert causes[place]["steady_error_alone_degrees"] == 0.0


def test_the_uncontrolled_arm_rests_at_every_odd_quarter_turn(results):
    found = results["uncontrolled_equilibria"]
    assert found["complete"] == "proved"
    angles = [point["states"]["theta"] / (np.pi / 2) for point in found["points"]]
    assert angles == pytest.approx([-3, -1, 1, 3], rel=1e-5)
    assert [point["stable"] for point in found["points"]] == [True, False, True, False]


def test_the_folder_holds_page_figures_and_trajectories(reproduction):
    figures = {path.name for path in (reproduction / "figures").iterdir()}
    assert {f"figure-{k}.{kind}" for k in range(1, 8) for kind in ("svg", "png")} <= figures
    run = xr.load_dataset(reproduction / "trajectories" / "compensator_printed_from_-2_rad.nc", engine="scipy")
    assert float(run["theta"][0]) == -2.0
    assert run["u"].attrs["units"] == "V"


def test_the_page_needs_no_network_and_holds_every_equation(reproduction, results):
    page = (reproduction / "index.html").read_text()
    outside = set(re.findall(r'(?:src|href|url)\s*[=(]\s*"?(https?://[^"\s)]+)', page))
    assert outside <= {"http://www.w3.org/1999/xlink"}
    assert page.count("<iframe") == 2  # Figure 4 and Figures 5 to 7 in motion, each under a policy of its own
    assert page.count('"paused":true') == 2
    assert len(page) < 1.5e6
    assert "<script" not in re.sub(r"srcdoc='[^']*'", "", page)
    for entry in results["equations"]:
        assert f'id="passage-{entry["key"].replace("_", "-")}"' in page


def _run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([ULNA, *map(str, arguments)], capture_output=True, text=True, check=False)


def test_an_unwritable_folder_is_one_clear_error(tmp_path):
    (tmp_path / "file").write_text("not a folder")
    done = _run("reproduce", "--out", tmp_path / "file" / "out")
    assert done.returncode == 2
    assert done.stderr.startswith("error:")
    assert "Traceback" not in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_folder_with_other_things_in_it_is_left_alone(tmp_path):
    (tmp_path / "thesis.txt").write_text("precious")
    done = _run("reproduce", "--out", tmp_path)
    assert done.returncode == 2
    assert (tmp_path / "thesis.txt").read_text() == "precious"
    assert len(list(tmp_path.iterdir())) == 1


def test_an_earlier_output_with_something_added_is_left_alone(tmp_path):
    (tmp_path / "results.json").write_text("{}")
    (tmp_path / "thesis.txt").write_text("precious")
    done = _run("reproduce", "--out", tmp_path)
    assert done.returncode == 2
    assert (tmp_path / "thesis.txt").read_text() == "precious"


def test_the_exact_loop_is_proved_and_the_claim_of_one_rate_is_not(results, reproduction):
    found = results["convergence"]
    assert (found["every_run_converges"], found["checked_by_the_second_program"]) == ("proved", "proved")
    assert found["exponential_near_the_horizontal"] is True
    # The errors' weight grows with the state: that is why no factor serves all starts.
    assert "|z2|" in found["growth"]["∂(z3')/∂e3"]
    assert found["exponential_from_everywhere"] == "not proved"
    page = (reproduction / "index.html").read_text()
    section = page[page.index('id="convergence"') :]
    assert "not proved" in section[: section.index("</section>")]
