"""What is wrong with a plant file is one clear line; what is right comes back from a file as it was."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from ulna.base import PlantError, UlnaError
from ulna.system import System, read_system, system_from_mapping, write_system

BODY = '[states]\nx = "-x + u"\n[inputs]\nu = {}\n'


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("states = 1 2\n", "newline.*Line 1: states = 1 2"),
        ('[states]\nx = { equation = "x"\n', "Unclosed inline table.*Line 2"),
        ('[states]\nθ = "-θ"\n', "stand in quotes"),
        (f"[parameters]\na = {'9' * 5000}\n{BODY}", "4300 digits"),
        (f"[parameters]\na = {'[' * 5000}\n", "nested too deeply"),
        ('[states]\nx = "-x + u"\n[inputs]\nu = 3\n', "inputs 'u' .* expected a table, found 3"),
        ('[states]\nx = "-x + u"\n[inputs]\nu = "N*m"\n', "expected a table, found 'N\\*m'.*unit ="),
        ('[states]\nx = { unit = 3, equation = "x" }\n', "unit = 3 is not a text"),
        ('[states]\nx = { unit = "mile", equation = "x" }\n', "unit 'mile' of states 'x'"),
        ("[states]\nx = { equation = { a = 1 } }\n", "{'a': 1} is not a finite number"),
        ("[states]\nx = true\n", "True is not a finite number"),
        ("[states]\nx = 1979-05-27\n", "datetime"),
        ('[parameters]\na = 1e-999999999\n[states]\nx = "a"\n', "1E-999999999 is not a finite number"),
        ('[states]\nx = { range = ["sqrt(-1)", 1], equation = "x" }\n', "not real"),
        (f"name = 3\n{BODY}", "name = 3 is not a text"),
        (f'name = "\\u001b[31mred"\n{BODY}', r"control character: '\\x1b\[31mred'"),
        (f'text = "\\u0007"\n{BODY}', "control character"),
        (f'"\\u001b[2J" = 1\n{BODY}', r"unknown key '\\x1b\[2J'"),
        ('[states]\ntime = "-time"\n', "axis of this name"),
        (f'[states]\n{"a" * 5000} = "1"\n', "its name has 5000 characters"),
        ('[parameters]\np = -1\n[states]\nx = "sqrt(p)*x"\n', "not real"),
        ('[parameters]\np = -8\n[states]\nx = "p**(1/3)*x"\n', "not real"),
        ('[parameters]\na = 9\nb = 99999999999\n[states]\nx = "a**b*x"\n', "exponent 99999999999 is too large"),
        ('[parameters]\na = 1e9\n[states]\nx = "x*exp(exp(a))"\n', "digits"),
    ],
)
def test_a_mistake_in_a_file_is_one_clear_line(tmp_path: Path, text: str, found: str) -> None:
    (tmp_path / "plant.toml").write_text(text, encoding="utf-8")
    with pytest.raises(UlnaError, match=found) as caught:
        read_system(tmp_path / "plant.toml")
    assert "\x1b" not in str(caught.value)
    assert len(str(caught.value)) < 600


def test_a_byte_order_mark_is_no_part_of_the_plant(tmp_path: Path) -> None:
    (tmp_path / "plant.toml").write_text(BODY, encoding="utf-8-sig")
    assert read_system(tmp_path / "plant.toml").states[0].name == "x"


def test_numbers_may_stand_for_formulas(tmp_path: Path) -> None:
    (tmp_path / "plant.toml").write_text("[states]\nx = 0.5\n", encoding="utf-8")
    assert read_system(tmp_path / "plant.toml").rates == (sp.Rational(1, 2),)


def test_what_is_no_file_is_refused_without_reading_it(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.toml")
    for place in (tmp_path / "pipe.toml", tmp_path, Path(os.devnull)):
        with pytest.raises(UlnaError, match="not a file but"):
            read_system(place)


def odd_names() -> System:
    return system_from_mapping(
        {
            "name": "../../evil",
            "text": 'a "quoted" \\ text\nin two lines',
            "parameters": {"Ω": {"value": "1/3", "unit": "rad/s"}, "µ": {"value": 2, "unit": "1/s"}},
            "states": {"θ": {"equation": "μ_0 - Ω*sin(θ)", "unit": "rad", "text": "Winkel"}, "lambda": "-µ*lambda"},
            "inputs": {"μ_0": {"unit": "rad/s"}},
            "outputs": {"ŷ": {"equation": "θ", "unit": "rad"}},
            "operating_point": {"θ": "1/3"},
        }
    )


@pytest.mark.parametrize("ending", ["toml", "json"])
def test_names_in_every_alphabet_come_back_from_a_file(tmp_path: Path, ending: str) -> None:
    system = odd_names()
    write_system(system, tmp_path / f"plant.{ending}")
    assert read_system(tmp_path / f"plant.{ending}") == system
    assert sorted(p.name for p in tmp_path.iterdir()) == [f"plant.{ending}"]


def test_runs_with_such_names_are_written_and_read(tmp_path: Path) -> None:
    import xarray as xr

    from ulna.sim import simulate

    run = simulate(odd_names(), [1.0, 0.0], np.linspace(0.0, 1.0, 5))
    with xr.open_dataset(run.to_netcdf(tmp_path / "run.nc"), engine="scipy") as stored:
        named = {each.attrs.get("name", label): each.values for label, each in stored.data_vars.items()}
    assert np.array_equal(named["θ"], run["θ"])
    assert np.array_equal(named["lambda"], run["lambda"])


def test_a_device_is_written_to_and_stays_one(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.json"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        write_system(odd_names(), pipe)
        assert b"evil" in os.read(reader, 100_000)
    finally:
        os.close(reader)
    assert pipe.is_fifo()


@pytest.mark.parametrize("rate", ["Piecewise((1, m > x), (2, True))", "max(m, x)", "x*min(m, 1)"])
def test_what_becomes_infinite_once_definitions_are_put_in_is_one_clear_line(rate: str) -> None:
    plant = {"states": {"x": rate}, "definitions": {"i": "x", "m": "cot(x - i)"}}
    with pytest.raises(PlantError, match="meets a term that is infinite or not real"):
        system_from_mapping(plant).with_values()
