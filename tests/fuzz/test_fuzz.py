"""Fuzzers: whatever comes in, the answer is a value or one clear line, never an exception of somebody else.

The seed is fixed and the counts fit into two minutes of continuous integration. `make fuzz` is the long run:
`ULNA_FUZZ=100` times as many, `ULNA_FUZZ_SEED=7` others.
"""

from __future__ import annotations

import json
import os
import random
import resource
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from emg_layouts import LAYOUTS
from fuzz_texts import formula, mutated, plant
from terminal import ulna

from ulna.base import UlnaError
from ulna.campaign import Random, Uniform, open_campaign, replay, sweep, worst_cases
from ulna.design import analyse
from ulna.sim import simulate
from ulna.studies.prosthesis.emg_pipeline import activations, calibrated_on_itself, fresh_memory
from ulna.studies.prosthesis.emg_recording import read_recording
from ulna.symbolic.formulas import parse_formula
from ulna.system import read_system, system_from_mapping, write_system

SEED = int(os.environ.get("ULNA_FUZZ_SEED", "1"))
TIMES = float(os.environ.get("ULNA_FUZZ", "1"))
SHARE = 20.0
"""s of CPU time for each test in continuous integration, whatever the machine; what is left is not tried."""


def tried(count: int, once: Callable[[random.Random], object], *, name: str) -> int:
    """Call it with numbers drawn anew, and count; a `UlnaError` is an answer, everything else ends the test.

    Raises:
        AssertionError: naming the seed by which the case is found again.
    """
    begun, done = time.process_time(), 0
    for k in range(round(count * TIMES)):
        if time.process_time() - begun > SHARE * max(TIMES, 1.0):
            break
        chance = random.Random(f"{name} {SEED} {k}")
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                once(chance)
        except UlnaError as error:
            said = str(error)
            if len(said) > 20_000 or not all(c.isprintable() or c in "\n\t" for c in said):
                pytest.fail(f"{name} {SEED} {k}: {said[:200]!r}, {len(said)} letters")
        except Exception as error:
            error.add_note(f"case: {name} {SEED} {k}")
            raise
        done += 1
    return done


def test_a_foreign_exception_is_noticed_and_its_case_named() -> None:
    with pytest.raises(ZeroDivisionError) as caught:
        tried(1, lambda _: 1 / 0, name="wrong")
    assert caught.value.__notes__ == [f"case: wrong {SEED} 0"]


def test_an_answer_that_steers_the_terminal_is_noticed() -> None:
    class LoudError(UlnaError):
        def __str__(self) -> str:
            return "\x1b[2J"

    def once(_: random.Random) -> None:
        raise LoudError("a", "b")

    with pytest.raises(pytest.fail.Exception, match="wrong"):
        tried(1, once, name="wrong")


def seeds_of_plants() -> list[bytes]:
    folder = files("ulna.plants") / "textbook"
    return [entry.read_bytes() for entry in sorted(folder.iterdir(), key=lambda e: e.name) if entry.name < "h"]


def test_files_with_changed_bytes_are_plants_or_refused(tmp_path: Path) -> None:
    good = seeds_of_plants()
    place, back = tmp_path / "plant.toml", tmp_path / "back.toml"

    def once(chance: random.Random) -> None:
        place.write_bytes(mutated(chance.choice(good), chance))
        system = read_system(place)
        write_system(system, back)
        again = read_system(back)
        assert again.rates == system.rates
        assert again.parameters == system.parameters

    assert tried(400, once, name="files") > 50


def test_mappings_with_wrong_types_are_refused() -> None:
    odd = (None, True, 3, -1.5, float("nan"), "x", "", "\x1b", [], [1], {}, {"value": []}, {"unit": 3}, 10**5000, 1j)
    good = {
        "parameters": {"p": {"value": 1, "unit": "kg", "range": [0, 2]}},
        "states": {"x": {"equation": "-p*x + u", "unit": ""}},
        "inputs": {"u": {}},
        "outputs": {"y": "x"},
        "operating_point": {"x": 0},
        "definitions": {"d": "x"},
    }

    def once(chance: random.Random) -> None:
        data = json.loads(json.dumps(good))
        inside, key = data, ""
        for _ in range(chance.randint(1, 4)):
            key = chance.choice(list(inside))
            if not isinstance(inside[key], dict) or not inside[key] or chance.random() < 0.3:
                break
            inside = inside[key]
        inside[key if key in inside else chance.choice(["z", "time", "θ", "a" * 300])] = chance.choice(odd)
        system_from_mapping(data)

    assert tried(1500, once, name="mappings") > 300


def test_formulas_with_changed_bytes_are_read_or_refused() -> None:
    import sympy as sp

    names = {name: sp.Symbol(name, real=True) for name in ("x1", "x2", "p")}

    def once(chance: random.Random) -> None:
        text = formula(chance, tuple(names), depth=4)
        changed = mutated(text.encode(), chance).decode(errors="replace") if chance.random() < 0.8 else text
        parse_formula(changed, names)

    assert tried(2500, once, name="formulas") > 500


def test_plants_of_everyday_devices_are_analysed_within_their_time(tmp_path: Path) -> None:
    seconds = 2.0
    patience = float(os.environ.get("ULNA_PATIENCE", "1"))

    def once(chance: random.Random) -> None:
        (tmp_path / "plant.toml").write_text(plant(chance))
        system = read_system(tmp_path / "plant.toml")
        begun = time.process_time()
        analyse(system, seconds=seconds)
        # A budget is for a group of questions, of which there are a handful.
        assert time.process_time() - begun < 10 * patience * seconds + 5

    assert tried(8, once, name="analyses") >= 1


def test_runs_of_everyday_devices_end_with_an_outcome(tmp_path: Path) -> None:
    def once(chance: random.Random) -> None:
        (tmp_path / "plant.toml").write_text(plant(chance))
        system = read_system(tmp_path / "plant.toml")
        start = [chance.choice((0.0, 0.5, -1.0, 1e-9, 3.0)) for _ in system.states]
        run = simulate(system, start, np.linspace(0.0, 1.0, 11), throw=False)
        assert not run.outcome.finished or np.isfinite(run.states).all()

    assert tried(40, once, name="runs") > 3


def test_command_lines_are_obeyed_or_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "plant.toml").write_text('[parameters]\np = 2\n[states]\nx = "-p*x + u"\n[inputs]\nu = {}\n')
    values = (
        "",
        "0",
        "-1",
        "nan",
        "inf",
        "1e400",
        "1e-320",
        "abc",
        "1,2",
        "x=1",
        "u=1",
        "p=3 kg",
        "y=",
        "=",
        "x=log(0)",
    )
    values += ("1/0", "sqrt(-1)", "exp(exp(exp(9)))", "θ=1", "\x1b[2J", "a" * 3000, "u=-1:1", "2:1", "t", "u=sin(t)")
    options = ("--initial", "--set", "--horizon", "--samples", "--seed", "--input", "--reference", "--event", "--until")
    options += ("--settle", "--controller-poles", "--lqr", "--observer-poles", "--kalman", "--high-gain", "--period")
    options += (
        "--limit",
        "--delay",
        "--encoder",
        "--noise",
        "--slew",
        "--stop",
        "--pwm",
        "--vary",
        "--runs",
        "--seconds",
    )
    options += ("--set-point", "--track", "--integral", "--symbolic", "--nonsense", "--jitter", "--missed")
    commands = ("analyse", "design", "design", "simulate", "simulate", "simulate", "models", "replay", "swep")
    flags = {"--set-point", "--track", "--integral", "--symbolic"}

    def once(chance: random.Random) -> None:
        line = [chance.choice(commands), chance.choice(("plant.toml", "plant.toml", "duffing", "nothing", ""))]
        line += ["--horizon", "0.5"] if line[0] == "simulate" else []
        for _ in range(chance.randint(0, 3)):
            option = chance.choice(options)
            line += [option] if option in flags else [option, chance.choice(values)]
        done = ulna(*line)
        if done.exception is not None and not isinstance(done.exception, SystemExit):
            done.exception.add_note(f"line: {line}")
            raise done.exception
        assert done.exit_code in (0, 1, 2), line
        assert "\x1b[2J" not in done.output, line
        assert "Traceback" not in done.output, line

    assert tried(150, once, name="lines") > 20


def test_manifests_with_changed_bytes_are_campaigns_or_refused(tmp_path: Path) -> None:
    loop = system_from_mapping({"parameters": {"p": 1}, "states": {"x": "-p*x"}, "outputs": {"y": "x"}})
    sweep(loop, Random(vary={"x": Uniform(low=0, high=1)}, runs=6), horizon=1.0, store=tmp_path / "kept", batch_size=3)
    manifest = tmp_path / "kept" / "campaign.json"
    good = manifest.read_bytes()

    def once(chance: random.Random) -> None:
        manifest.write_bytes(mutated(good, chance))
        result = open_campaign(tmp_path / "kept")
        worst_cases(result, "final_x")
        replay(result, 1)

    assert tried(120, once, name="manifests") > 20


def test_recordings_with_changed_bytes_are_read_or_refused(tmp_path: Path) -> None:
    samples = 1e-4 * np.stack([np.sin(np.arange(320)), np.cos(np.arange(320))], axis=1)
    written = [each.write(samples) for each in LAYOUTS]
    good = [each if isinstance(each, bytes) else each.encode() for each in written]
    good += [b"0       " + bytes(range(256)) * 4, b"\xffBIOSEMI" + bytes(600), b"XDF:" + bytes(range(256))]
    place = tmp_path / "emg.csv"

    def once(chance: random.Random) -> None:
        place.write_bytes(mutated(chance.choice(good), chance, most=2))
        found = read_recording(
            place,
            rate=chance.choice((None, 1000.0)),
            muscles=chance.choice(((), ("1",), ("2", "3"), ("\x1b",))),
            envelope=chance.choice((None, None, True, False)),
        )
        assert np.isfinite(found.samples).all()
        assert found.said.isprintable()
        activations(calibrated_on_itself(found)[0], found.samples, fresh_memory())

    assert tried(1200, once, name="recordings") > 300


@pytest.mark.parametrize("kind", ["analyse", "simulate"])
def test_a_process_of_its_own_stays_below_two_gigabytes_and_leaves_no_traceback(kind: str, tmp_path: Path) -> None:
    def bounded() -> None:
        resource.setrlimit(resource.RLIMIT_DATA, (2_000_000_000, 2_000_000_000))

    def once(chance: random.Random) -> None:
        place = tmp_path / "plant.toml"
        place.write_text(plant(chance))
        line = [
            kind,
            str(place),
            *(["--seconds", "1"] if kind == "analyse" else ["--initial", "0.5", "--horizon", "1"]),
        ]
        done = subprocess.run(
            [Path(sys.executable).with_name("ulna"), *line],
            capture_output=True,
            text=True,
            check=False,
            timeout=120,
            preexec_fn=bounded,
        )
        assert done.returncode in (0, 1, 2), (place.read_text(), done.stderr)
        assert "Traceback" not in done.stderr, (place.read_text(), done.stderr)

    assert tried(2, once, name=kind) == round(2 * TIMES)
