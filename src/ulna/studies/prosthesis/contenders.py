"""The seven contenders for a bench, and the numbers that tuning chose for them."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib.resources import files
from typing import Any

from ulna.base import DesignError
from ulna.design.control import SETTLED
from ulna.studies.prosthesis.baselines import pid, proportional_voltage, velocity_servo
from ulna.studies.prosthesis.contender import Contender
from ulna.studies.prosthesis.designs import load_robust, paper_compensator, reduced_compensator, state_law
from ulna.studies.prosthesis.plant import Bench
from ulna.studies.prosthesis.tasks import PERIOD

TUNED_FILE = "tuned_gains.toml"


def contenders(bench: Bench) -> tuple[Contender, ...]:
    """The seven contenders, common practice first.

    The load-robust one leaves the current out where it settles within a sample (three times La/Ra below the period).
    """
    return (*_common(), _robust(SETTLED * bench.electrical_time > PERIOD))


def tuned_numbers(bench: Bench, contender: Contender) -> dict[str, float]:
    """What tuning chose for the contender on this bench.

    Raises:
        DesignError: where the file has no numbers for it.
    """
    try:
        table = _tuned()[bench.preset.name][contender.key]
        return {entry.name: float(table[entry.name]) for entry in contender.tuned}
    except KeyError:
        raise DesignError(
            f"tuned numbers of '{contender.title}' on '{bench.preset.name}'",
            f"{TUNED_FILE} has none.",
            "Run: python -m ulna.studies.prosthesis.tuning",
        ) from None


@cache
def _common() -> tuple[Contender, ...]:
    return (
        proportional_voltage(),
        velocity_servo(),
        pid(),
        state_law(),
        paper_compensator(),
        reduced_compensator(),
    )


@cache
def _robust(full: bool) -> Contender:
    return load_robust(full=full)


@cache
def _tuned() -> dict[str, Any]:
    text = (files("ulna.studies.prosthesis") / "data" / TUNED_FILE).read_text(encoding="utf-8")
    return tomllib.loads(text)
