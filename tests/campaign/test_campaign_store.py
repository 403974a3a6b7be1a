"""The result folder: resumed, guarded, and whole whatever happens."""

from __future__ import annotations

import errno
import json
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from campaign_loops import SPRING

from ulna.campaign import (
    CampaignError,
    CampaignResult,
    LocalWorkers,
    Measures,
    Random,
    Uniform,
    open_campaign,
    sweep,
)
from ulna.campaign.store.folder import BATCHES, MANIFEST, locked
from ulna.sim import Taylor

PLAN = Random(vary={"x": Uniform(low=-1, high=1), "k": Uniform(low=1, high=9)}, runs=100, seed=5)
MEASURES = Measures(outputs=("y",), effort=("u",), samples=50)


def run(store: Path | None, *, plan: Random = PLAN, **how) -> CampaignResult:
    return sweep(SPRING, plan, MEASURES, horizon=3.0, store=store, batch_size=how.pop("batch_size", 10), **how)


def same(one: CampaignResult, other: CampaignResult) -> bool:
    return all(one[c.name].tobytes() == other[c.name].tobytes() for c in one.columns)


def files(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


@dataclass(frozen=True)
class Leaving:
    """Leaves after some batches, in another order than asked; counts what it was asked for."""

    batches_before: int
    asked: list

    def batch_size(self, runs: int) -> int:
        return runs

    def compute(self, settings, versions, batches: Iterable) -> Iterator:
        batches = list(batches)
        self.asked.append(len(batches))
        for count, found in enumerate(LocalWorkers(threads=1).compute(settings, versions, reversed(batches))):
            if count == self.batches_before:
                raise KeyboardInterrupt
            yield found


def test_a_campaign_that_was_left_goes_on_with_what_is_missing(tmp_path) -> None:
    folder, workers = tmp_path / "a", Leaving(4, [])
    with pytest.raises(KeyboardInterrupt):
        run(folder, workers=workers)
    with pytest.raises(CampaignError, match="60 of 100 runs are missing"):
        open_campaign(folder)
    with pytest.raises(KeyboardInterrupt):
        run(folder, workers=workers)
    seen = []
    result = run(folder, progress=seen.append, batch_size=33)  # the folder's own size of batches counts
    assert workers.asked == [10, 6]
    assert [now.done for now in seen] == [80, 90, 100]
    assert seen[-1].fresh == 20
    assert seen[-1].rate > 0
    assert same(result, run(None))
    assert files(folder) == files(tmp_path / "b") if run(tmp_path / "b") else False


def test_a_finished_campaign_computes_nothing(tmp_path) -> None:
    run(tmp_path / "a")
    before, workers = files(tmp_path / "a"), Leaving(0, [])
    assert same(run(tmp_path / "a", workers=workers), open_campaign(tmp_path / "a"))
    assert workers.asked == []
    assert files(tmp_path / "a") == before


@pytest.mark.parametrize(
    ("other", "what"),
    [
        ({"plan": Random(vary=PLAN.vary, runs=101, seed=5)}, r"plan\.runs \(100, not 101\)"),
        ({"plan": Random(vary=PLAN.vary, runs=100, seed=6)}, r"plan\.seed \(5, not 6\)"),
        ({"plan": Random(vary={**PLAN.vary, "k": Uniform(low=1, high=8)}, runs=100, seed=5)}, r"plan\.vary"),
        ({"parameters": {"d": 1.0}}, "parameters"),
        ({"engine": Taylor(tolerance=1e-6)}, r"engine\.tolerance"),
    ],
)
def test_a_folder_with_another_campaign_is_refused_and_stays(tmp_path, other: dict, what: str) -> None:
    run(tmp_path / "a")
    before = files(tmp_path / "a")
    with pytest.raises(CampaignError, match=rf"holds another campaign; other there: {what}"):
        run(tmp_path / "a", **other)
    assert files(tmp_path / "a") == before


def test_a_campaign_of_which_no_batch_is_done_gives_way_to_another(tmp_path) -> None:
    """A first try that failed for its scheduler or for room must not block the folder."""
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path / "a", workers=Leaving(0, []))
    other = Random(vary=PLAN.vary, runs=30, seed=6)
    assert same(run(tmp_path / "a", plan=other), run(None, plan=other))
    assert open_campaign(tmp_path / "a").runs == 30


def test_a_folder_that_is_no_campaign_is_refused_and_stays(tmp_path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "thesis.tex").write_text("years of work")
    (tmp_path / "b").write_text("a file")
    for name, reason in (("a", "thesis.tex"), ("b", "a file of this name")):
        with pytest.raises(CampaignError, match=reason):
            run(tmp_path / name)
    assert files(tmp_path / "a") == {"thesis.tex": b"years of work"}


def test_a_folder_begun_with_other_libraries_is_refused(tmp_path) -> None:
    run(tmp_path / "a")
    manifest = tmp_path / "a" / MANIFEST
    data = json.loads(manifest.read_text())
    data["versions"]["heyoka"] = "1.2.3"
    manifest.write_text(json.dumps(data))
    with pytest.raises(CampaignError, match=r"begun with heyoka 1\.2\.3"):
        run(tmp_path / "a")


@pytest.mark.parametrize("damage", ["truncated", "altered", "emptied"])
def test_a_damaged_batch_is_noticed_when_read_and_computed_anew_when_resumed(tmp_path, damage: str) -> None:
    whole = run(tmp_path / "a")
    file = sorted((tmp_path / "a" / BATCHES).iterdir())[3]
    data = file.read_bytes()
    file.write_bytes({"truncated": data[:-9], "altered": data[:-9] + b"x" + data[-8:], "emptied": b""}[damage])
    with pytest.raises(CampaignError, match="truncated or altered"):
        _ = open_campaign(tmp_path / "a")["final_v"]
    assert same(run(tmp_path / "a"), run(None))
    assert file.read_bytes() == data
    assert whole.runs == 100


@pytest.mark.parametrize("text", ["", '{"format": 1', '{"format": 2}', '{"format": 1}', "[]"])
def test_a_damaged_manifest_is_one_clear_error(tmp_path, text: str) -> None:
    run(tmp_path / "a")
    (tmp_path / "a" / MANIFEST).write_text(text)
    for call in (lambda: open_campaign(tmp_path / "a"), lambda: run(tmp_path / "a")):
        with pytest.raises(CampaignError, match=MANIFEST):
            call()


def test_a_full_disk_is_one_clear_error_and_what_is_there_stays(tmp_path, monkeypatch) -> None:
    written = []

    def full(handle: int) -> None:
        written.append(handle)
        if len(written) > 7:  # twice for the manifest, then once for each batch
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr("ulna.campaign.store.folder.os.fsync", full)
        with pytest.raises(CampaignError, match="no space left on device; 50 of 100 runs are safe"):
            run(tmp_path / "a")
    assert not list((tmp_path / "a" / BATCHES).glob(".*"))
    assert same(run(tmp_path / "a"), run(None))


def test_more_than_the_disk_can_hold_is_refused_before_the_first_run(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("shutil.disk_usage", lambda _: type("Usage", (), {"free": 1000}))
    with pytest.raises(CampaignError, match="Make room"):
        run(tmp_path / "a")


def test_a_folder_that_cannot_be_made_is_one_clear_error(tmp_path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(CampaignError, match="cannot be written"):
        run(tmp_path / "file" / "inside")


def test_a_second_process_on_the_same_folder_is_refused(tmp_path) -> None:
    run(tmp_path / "a")
    with locked(tmp_path / "a"), pytest.raises(CampaignError, match="another process is using"):
        run(tmp_path / "a")


def test_leftovers_of_a_killed_process_are_swept_away(tmp_path) -> None:
    run(tmp_path / "a")
    leftover = tmp_path / "a" / BATCHES / f".{'0' * 32}.part"
    leftover.write_bytes(b"half")
    run(tmp_path / "a")
    assert not leftover.exists()


KILLED = """
import sys
sys.path.insert(0, sys.argv[2])
from pathlib import Path
from campaign_loops import SPRING
from ulna.campaign import *
plan = Random(vary={"x": Uniform(low=-1, high=1), "k": Uniform(low=1, high=9)}, runs=400, seed=5)
print("begun", flush=True)
measures = Measures(outputs=("y",), effort=("u",), samples=50)
sweep(SPRING, plan, measures, horizon=3.0, store=sys.argv[1], batch_size=1)
print("done", flush=True)
"""


def started(folder: Path, **how) -> subprocess.Popen[str]:
    support = Path(__file__).parents[1] / "support"
    command = [sys.executable, "-c", KILLED, str(folder), str(support)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **how)


@pytest.mark.slow
def test_killed_again_and_again_it_ends_with_what_an_undisturbed_one_has(tmp_path) -> None:
    random = np.random.default_rng(1)
    undisturbed = run(None, plan=Random(vary=PLAN.vary, runs=400, seed=5), batch_size=50)
    kills, grown = 0, [0]
    while True:
        process = started(tmp_path / "a")
        assert process.stdout is not None
        assert process.stdout.readline() == "begun\n"
        # It writes one run after the other: killed while it computes, while it writes, or between.
        before = grown[-1]
        until = time.monotonic() + 60
        while len(list((tmp_path / "a").glob(f"{BATCHES}/[0-9]*"))) < min(400, before + 110) and process.poll() is None:
            assert time.monotonic() < until
            time.sleep(0.002)
        time.sleep(random.uniform(0, 0.05))
        process.send_signal(signal.SIGKILL)
        said = process.communicate()[0]
        grown.append(len(list((tmp_path / "a" / BATCHES).glob("[0-9]*"))))
        if said == "done\n":
            break
        kills += 1
        assert grown[-1] > before
    assert kills >= 3
    result = open_campaign(tmp_path / "a")
    assert grown[-1] == 400
    assert same(result, undisturbed)


@pytest.mark.slow
def test_a_disk_that_fills_up_under_it_is_one_clear_error(tmp_path) -> None:
    """A limit on the size of files stands for the full disk: the kernel refuses to write."""
    process = started(tmp_path / "a", preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (500, 500)))
    errors = process.communicate()[1]
    assert process.returncode == 1
    assert "CampaignError: the result folder" in errors.strip().splitlines()[-1]
    assert not list((tmp_path / "a").rglob("*.part"))
