"""What `ulna sweep` says and draws when all runs are done."""

from __future__ import annotations

import math
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ulna.cli.terminal import console

if TYPE_CHECKING:
    from ulna.campaign import CampaignResult, Column

SHOWN = {"least": 0.0, "5 %": 0.05, "median": 0.5, "95 %": 0.95, "most": 1.0}
"""Levels of the quantiles that people see."""


def leading_figure(result: CampaignResult) -> str:
    """The figure by which runs are called worst: how far the first output is off at the end."""
    names = _judged(result)
    return f"steady_error_{names[0]}" if names else "end_time"


def draw_answers(result: CampaignResult, folder: Path, *, worst_by: str, axes: tuple[str, ...]) -> list[Path]:
    """Draw a map of the settled runs over two axes, a fan chart of each output, and the worst case.

    Raises:
        UlnaError: a folder that cannot be made.
    """
    from ulna.base import UlnaError
    from ulna.campaign import fan, replay, settled_map, worst_cases
    from ulna.plot import plot_fan, plot_settled_map, plot_trajectory, save_figure

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UlnaError(f"the folder '{folder}'", f"it cannot be made ({error.strerror}).") from None
    drawn = []
    if len(axes) > 1:
        found = settled_map(result, *axes[:2])
        drawn.append(save_figure(plot_settled_map(found), folder / "settled_map.svg"))
    for signal in _judged(result):
        spread = fan(result, signal)
        title = f"{signal} in {spread.runs} of {result.runs} runs"
        drawn.append(save_figure(plot_fan(spread, title=title), folder / f"fan_{signal}.svg"))
    worst = worst_cases(result, worst_by, count=1)[0]
    shown = plot_trajectory(replay(result, worst.number).trajectory, title=f"run {worst.number}: worst {worst_by}")
    drawn.append(save_figure(shown, folder / "worst.svg"))
    return drawn


def answers(result: CampaignResult, out: Path, drawn: list[Path], *, worst_by: str) -> dict[str, Any]:
    """Everything that is printed, as data."""
    from ulna.campaign import Saltelli, outcome_counts, quantiles, settled_fraction, worst_cases

    settled = settled_fraction(result)
    table = quantiles(result)
    data = {
        "system": result.experiment.system.name,
        "folder": str(out),
        "runs": result.runs,
        "varied": list(result.varied),
        "settled": {
            "value": settled.value,
            "count": settled.count,
            **({"low": settled.low, "high": settled.high} if settled.drawn else {}),
            **({"confidence": settled.confidence, "interval": settled.method} if settled.drawn else {}),
        },
        "outcomes": outcome_counts(result),
        "quantiles": {
            "levels": table["level"].values.tolist(),
            **{str(name): values.values.tolist() for name, values in table.data_vars.items()},
        },
        "worst": [
            {"run": case.number, "figure": worst_by, "value": case.value, "outcome": case.outcome}
            | {"varied": dict(case.varied), "replay": _replay(out, case.number)}
            for case in worst_cases(result, worst_by, count=5)
        ],
        "figures": [str(path) for path in drawn],
    }
    if isinstance(result.experiment.plan, Saltelli):
        stems = ("steady_error", "peak_error")
        figures = dict.fromkeys((worst_by, *(f"{stem}_{name}" for name in _judged(result) for stem in stems)))
        data["indices"] = {figure: _indices(result, figure) for figure in figures}
    return data


def print_answers(result: CampaignResult, data: dict[str, Any]) -> None:
    """Print the answers for people."""
    from rich.markup import escape

    from ulna.campaign import settled_fraction

    show = console()
    columns = {column.name: column for column in result.columns}
    over = ", ".join(columns[name].heading for name in result.varied)
    show.print(escape(f"{result.runs} runs of '{data['system']}' over {over}"), soft_wrap=True)
    settled = data["settled"]["count"]
    show.print(
        f"settled (2 % band): {settled} of {result.runs} = [bold]{settled_fraction(result)}[/bold]", soft_wrap=True
    )
    show.print("outcomes: " + ", ".join(f"{n} {name.replace('_', ' ')}" for name, n in data["outcomes"].items()))
    show.print()
    show.print(_quantiles(data["quantiles"], columns))
    show.print(_worst(data["worst"], columns))
    for figure, found in data.get("indices", {}).items():
        if "reason" in found:
            show.print(escape(f"no Sobol indices of {figure}: {found['reason']}"), soft_wrap=True)
        else:
            show.print(_shares(figure, found))
    for path in data["figures"]:
        show.print(escape(f"drawn: {path}"), soft_wrap=True)
    show.print(escape(f"the worst run again: {data['worst'][0]['replay']}"), soft_wrap=True)


def _quantiles(data: dict[str, Any], columns: dict[str, Column]) -> Any:
    from rich.markup import escape

    table = _table("figure", *SHOWN)
    for name, values in data.items():
        # The final state is there for those who ask; all runs end alike unless one ended early.
        same = name == "end_time" and min(values) == max(values)
        if name == "levels" or name.startswith("final_") or same:
            continue
        shown = [values[data["levels"].index(level)] for level in SHOWN.values()]
        table.add_row(escape(columns[name].heading), *(_number(value, name) for value in shown))
    return table


def _worst(cases: list[dict[str, Any]], columns: dict[str, Column]) -> Any:
    figure = cases[0]["figure"]
    table = _table(f"worst {figure}", "run", "how it ended", *(columns[name].heading for name in cases[0]["varied"]))
    for case in cases:
        unit = columns[figure].unit
        value = f"{_number(case['value'], figure)} {unit}".strip()
        varied = (f"{value:.6g}" for value in case["varied"].values())
        table.add_row(value, str(case["run"]), case["outcome"].replace("_", " "), *varied)
    return table


def _shares(figure: str, found: dict[str, Any]) -> Any:
    limits = f"({found['confidence']:.0%} limits)"
    table = _table(f"{figure} depends on", "alone", limits, "in all", limits)
    for k, name in enumerate(found["names"]):
        cells = []
        for kind in ("first_order", "total"):
            low, high = found[f"{kind}_low"][k], found[f"{kind}_high"][k]
            cells += [f"{found[kind][k]:.3f}", f"{low:.3f} to {high:.3f}"]
        table.add_row(name, *cells)
    return table


def _table(first: str, *others: str) -> Any:
    from rich.box import SIMPLE_HEAD
    from rich.markup import escape
    from rich.table import Table

    # Five numbers such as -3.053e-10 beside the longest name fit into 80 columns.
    table = Table(box=SIMPLE_HEAD, pad_edge=False, padding=(0, 0, 0, 1))
    table.add_column(escape(first), no_wrap=True)
    for heading in others:
        table.add_column(escape(heading), justify="right", no_wrap=True)
    return table


def _number(value: float, name: str) -> str:
    if math.isnan(value):
        return "–"
    if value == math.inf and name.startswith("settling_time_"):
        return "never"
    return f"{value:.4g}"


def _replay(out: Path, run: int) -> str:
    return f"ulna replay {shlex.quote(str(out))} --run {run}"


def _judged(result: CampaignResult) -> list[str]:
    return [c.name.removeprefix("peak_error_") for c in result.columns if c.name.startswith("peak_error_")]


def _indices(result: CampaignResult, figure: str) -> dict[str, Any]:
    """Sobol indices with their limits, or the reason why there are none."""
    from ulna.campaign import CampaignError, sensitivity

    try:
        found = sensitivity(result, figure)
    except CampaignError as error:
        return {"reason": f"{error.found} {error.hint}".strip()}
    kinds = [f"{kind}{end}" for kind in ("first_order", "total") for end in ("", "_low", "_high")]
    return {
        "names": list(found.names),
        "confidence": found.confidence,
        **{kind: getattr(found, kind).tolist() for kind in kinds},
    }
