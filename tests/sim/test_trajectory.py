"""A trajectory carries the names, units and numbers of its run into xarray, pandas and files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
import xarray as xr

from ulna.base import SimulationError
from ulna.loop import Loop
from ulna.sim import Outcome, Trajectory, simulate
from ulna.system import Parameter, Signal, System

theta, omega, u, m = sp.symbols("theta omega u m", real=True)
ARM = System(
    name="arm",
    states=(Signal(name="theta", unit="rad", text="joint angle"), Signal(name="omega", unit="rad/s")),
    rates=(omega, u / m - sp.sin(theta)),
    inputs=(Signal(name="u", unit="V"),),
    outputs=(Signal(name="theta", unit="rad"), Signal(name="power", unit="W"), Signal(name="u", unit="mV")),
    readouts=(theta, m * omega * u, 1000 * u),
    parameters=(Parameter(name="m", value=sp.Integer(2), unit="kg"),),
)
GRID = np.linspace(0.0, 2.0, 21)


@pytest.fixture(name="run")
def run_of_the_arm() -> Trajectory:
    return simulate(ARM, (0.5, 0.0), GRID, inputs={"u": 0.25})


def test_signals_are_found_by_name(run: Trajectory) -> None:
    assert run.states.shape == (21, 2)
    assert run.outputs.shape == (21, 3)
    assert run.inputs.shape == (21, 1)
    assert np.array_equal(run["omega"], run.states[:, 1])
    np.testing.assert_allclose(run["power"], 2 * 0.25 * run["omega"], rtol=1e-15)
    with pytest.raises(SimulationError, match="Known: theta, omega, power, u"):
        run["voltage"]


def test_outputs_use_the_parameters_of_the_run() -> None:
    run = simulate(ARM, (0.5, 0.1), GRID, inputs={"u": 0.25}, parameters={"m": 3.0})
    np.testing.assert_allclose(run["power"], 3 * 0.25 * run["omega"], rtol=1e-15)


def test_labelled_form_has_names_units_and_roles(run: Trajectory) -> None:
    data = run.to_xarray()
    # The output `theta` is the state; the output `u` is not the input and keeps a label of its own.
    assert list(data.data_vars) == ["theta", "omega", "power", "u", "input_u"]
    assert data["power"].attrs == {"units": "W", "long_name": "power", "role": "output"}
    assert data["theta"].attrs["long_name"] == "joint angle"
    assert data["time"].attrs["units"] == "s"
    assert data.attrs == {
        "system": "arm",
        "outcome": "finished",
        "outcome_text": Outcome.FINISHED.text,
        "parameter_m": 2.0,
    }
    assert float(data["theta"].sel(time=1.0)) == run["theta"][10]


def test_table_has_one_column_a_signal(run: Trajectory) -> None:
    frame = run.to_pandas()
    assert list(frame.columns) == ["theta", "omega", "power", "u", "input_u"]
    assert frame.index.name == "time"
    assert frame.attrs["units"]["omega"] == "rad/s"
    assert frame["theta"].iloc[-1] == run.final_state[0]


def test_file_reads_back_to_the_same_numbers(run: Trajectory, tmp_path: Path) -> None:
    path = run.to_netcdf(tmp_path / "run.nc")
    with xr.open_dataset(path, engine="scipy") as data:
        assert data.load().identical(run.to_xarray())
    assert [each.name for each in tmp_path.iterdir()] == ["run.nc"]


def test_a_place_that_cannot_be_written_is_one_clear_error(run: Trajectory, tmp_path: Path) -> None:
    with pytest.raises(SimulationError, match="No such file"):
        run.to_netcdf(tmp_path / "absent" / "run.nc")
    (tmp_path / "taken.nc").mkdir()
    with pytest.raises(SimulationError, match="taken"):
        run.to_netcdf(tmp_path / "taken.nc")
    assert [each.name for each in tmp_path.iterdir()] == ["taken.nc"]


def test_a_run_that_ended_early_says_so() -> None:
    x = sp.Symbol("x", real=True)
    system = System(name="burst", states=(Signal(name="x"),), rates=(x**2,))
    run = simulate(system, [1.0], GRID, throw=False)
    assert "the norm of the state passed the bound" in repr(run)
    assert run.outputs.shape == (len(run.times), 0)
    assert run.to_xarray().attrs["outcome"] == "blew_up"


def test_a_run_unpacks_and_has_signals_in_rows_as_in_python_control(run: Trajectory) -> None:
    t, y = run
    assert np.array_equal(t, run.t)
    assert (run.x.shape, y.shape, run.u.shape) == ((2, 21), (3, 21), (21,))
    assert np.array_equal(run.x[1], run["omega"])
    assert np.array_equal(run.u, np.full(21, 0.25))


def test_x_y_and_u_of_a_closed_loop_are_those_of_its_plant() -> None:
    plant = replace(ARM, outputs=ARM.outputs[:1], readouts=ARM.readouts[:1])
    spring = System(
        name="spring",
        states=(),
        rates=(),
        inputs=(Signal(name="theta", unit="rad"), Signal(name="goal", unit="rad")),
        outputs=(Signal(name="u", unit="V"),),
        readouts=(sp.Symbol("goal", real=True) - theta,),
    )
    run = simulate(Loop(plant=plant, controller=spring), (0.5, 0.0), GRID, inputs={"goal": 0.1})
    assert (run.x.shape, run.y.shape, run.u.shape) == ((2, 21), (21,), (21,))
    np.testing.assert_allclose(run.u, 0.1 - run.y, rtol=1e-12)


def test_text_has_units_above_its_columns_and_every_bit_of_the_numbers(run: Trajectory, tmp_path: Path) -> None:
    lines = run.to_csv(tmp_path / "run.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0] == "time [s],theta [rad],omega [rad/s],power [W],u [mV],input_u [V]"
    rows = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    assert np.array_equal(rows[:, 1:3], run.states)
    with pytest.raises(SimulationError, match="cannot be written"):
        run.to_csv(tmp_path / "nowhere" / "run.csv")


def test_a_notebook_shows_a_table_and_text_of_others_stays_text(run: Trajectory) -> None:
    assert "theta [rad]" in run._repr_html_()
    evil = replace(run, note="<script>", system=replace(ARM, name="<b>"))
    assert "<script>" not in evil._repr_html_()
    assert "<b>&lt;b&gt;" not in evil._repr_html_().replace("Trajectory of", "")


def test_a_run_draws_itself_and_the_figure_shows_itself_in_a_notebook(run: Trajectory) -> None:
    figure = run.plot("omega", "u")
    assert [axes.get_ylabel() for axes in figure.axes] == ["omega (rad/s)", "u (mV)"]
    picture, size = figure._repr_png_()
    assert picture.startswith(b"\x89PNG")
    assert abs(int.from_bytes(picture[16:20]) - 2 * size["width"]) <= 1
