"""Settings of the whole test run."""

from __future__ import annotations

import os

import pytest
from beartype import BeartypeConf
from beartype.claw import beartype_packages
from hypothesis import HealthCheck, settings

# While tests run, every call into ulna is checked against its annotations, at no cost to users; `float` accepts
# `int`, as static type checkers have it. Left out are local variables, for speed, and the command line, which Typer
# inspects. jaxtyping's hook was tried: nothing here uses its shapes, and symbolic work took eight times as long, with
# this one a tenth longer.
_CHECKS = BeartypeConf(is_pep484_tower=True, claw_is_pep526=False, claw_skip_package_names=("ulna.cli",))
beartype_packages(("ulna",), conf=_CHECKS)

# Room for the type checks and for slower machines: time budgets count seconds. Questions that no time answers take all
# of it, a good part of the whole run, so it is no more than that; the catalogue's answers come with 1, too.
os.environ.setdefault("ULNA_PATIENCE", "2")

# No windows, also in processes that tests start.
os.environ["MPLBACKEND"] = "Agg"

# The same examples on every run and no deadline: a loaded machine must not turn a law red.
settings.register_profile(
    "ci", derandomize=True, deadline=None, database=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile("explore", deadline=None, max_examples=1000)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "ci"))


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--update", action="store_true", help="write golden files anew where texts differ from them")
