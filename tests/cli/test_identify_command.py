"""`ulna identify`, as typed: a simulated log is read back, mistakes are one line."""

from __future__ import annotations

from pathlib import Path

import pytest
from terminal import answered, entry_point, refused, ulna, written

from ulna.system import read_system

PLANT = """
name = "swing"
[parameters]
l = { value = 0.7, unit = "m", range = [0.1, 3] }
c = { value = 0.3, unit = "1/s" }
[states]
theta = { unit = "rad", equation = "omega" }
omega = { unit = "rad/s", equation = "-9.81/l*sin(theta) - c*omega + u" }
[inputs]
u = { unit = "rad/s^2" }
[outputs]
theta = { unit = "rad", equation = "theta" }
"""
PLANT = PLANT.replace("-9.81/l", "-g/l").replace("[states]", 'g = { value = 9.81, unit = "m/s^2" }\n[states]')


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("identify")
    plant = written(PLANT, place / "swing.toml")
    done = ulna("simulate", plant, "--initial", "1,0", "--horizon", "4", "--out", str(place / "run.csv"))
    assert done.exit_code == 0, done.output
    return place


def test_a_simulated_log_gives_its_parameters_back_in_a_plant_file(folder: Path) -> None:
    plant, log, out = str(folder / "swing.toml"), str(folder / "run.csv"), folder / "fitted.toml"
    typed = [
        "--free",
        "l, c",
        "--set",
        "l=0.9",
        "--held-out",
        log,
        "--out",
        str(out),
        "--page",
        str(folder / "fit.html"),
    ]
    done = entry_point("identify", plant, log, *typed)
    assert done.returncode == 0, done.stderr
    assert "known" in done.stdout
    assert "residual of theta" in done.stdout
    page = (folder / "fit.html").read_text(encoding="utf-8")
    assert all(word in page for word in ("Parameters of swing", "95 % interval", "Correlation", "held out", "<svg"))
    assert "http://" not in page.replace("http://www.w3.org", "")
    found = {p.name: p for p in read_system(out).parameters}
    assert float(found["l"].si_value or 0) == pytest.approx(0.7, rel=1e-4)
    assert found["l"].std is not None
    assert "sha256" in found["l"].source


def test_what_the_log_does_not_tell_is_said(folder: Path) -> None:
    data = answered(
        "identify", str(folder / "swing.toml"), str(folder / "run.csv"), "--free", "l, g", "--initial", "theta=1"
    )
    assert not data["parameters"]["l"]["known"]
    assert "l" in data["parameters"]["g"]["reason"]


@pytest.mark.parametrize(
    ("change", "typed", "said"),
    [
        (("theta [rad]", "thetha [rad]"), [], "--column theta=thetha"),
        (("theta [rad]", "theta [V]"), [], "measures"),
        (("\n0.008,", "\n-0.008,"), [], "time goes back"),
        (("", ""), ["--free", "length"], "no parameter of this name"),
        (("", ""), ["--prior", "l=heavy"], "is not a prior"),
        (("", ""), ["--bounds", "l=2:3"], "where the search starts"),
        (("", ""), ["--initial", "thta=1"], "theta"),
        (("", ""), ["--out", "no/such/folder.toml"], "its folder does not exist"),
    ],
)
def test_a_mistake_is_one_line(
    change: tuple[str, str], typed: list[str], said: str, folder: Path, tmp_path: Path
) -> None:
    text = (folder / "run.csv").read_text()
    assert change[0] in text
    log = written(text.replace(*change) if change[0] else text, tmp_path / "log.csv")
    free = [] if "--free" in typed else ["--free", "l"]
    assert said in refused("identify", str(folder / "swing.toml"), log, *free, *typed)


def test_fewer_samples_than_unknowns(folder: Path, tmp_path: Path) -> None:
    log = written("\n".join((folder / "run.csv").read_text().splitlines()[:3]), tmp_path / "log.csv")
    said = refused("identify", str(folder / "swing.toml"), log, "--free", "l, c")
    assert "2 samples for 4 unknowns" in said
    assert "--initial" in said
