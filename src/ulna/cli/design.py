"""`ulna design PLANT`: controller form and law, observer form and observer, compensator."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ulna.cli.session import console, plant, pole_list, print_json, progress

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ulna.design.control.compensator import Compensator
    from ulna.design.control.law import Law
    from ulna.design.observers.observer import Observer
    from ulna.system.system import System

ControllerPoles = Annotated[str, typer.Option("--controller-poles", help="Comma-separated: '-2+3.46j,-2-3.46j,-8'.")]
ObserverPoles = Annotated[str, typer.Option("--observer-poles", help="Comma-separated: '-9,-10,-11'.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Design:
    """What the options asked for: a law, an observer, or both as a compensator."""

    plant: System
    law: Law | None
    observer: Observer | None
    compensator: Compensator | None


def design(
    name: Annotated[str, typer.Argument(metavar="PLANT", help="A plant file (TOML or JSON) or a catalogue name.")],
    controller_poles: ControllerPoles = "",
    observer_poles: ObserverPoles = "",
    symbolic: Annotated[bool, typer.Option(help="Keep parameters as symbols instead of their values.")] = False,
    out: Annotated[Path | None, typer.Option(help="Write the controller as a plant file (TOML or JSON).")] = None,
    plot: Annotated[Path | None, typer.Option(help="Draw the poles: a .png, .svg or .pdf file.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON for machines.")] = False,
) -> None:
    """Design a feedback law, an observer, or with both sets of poles the compensator that joins them."""
    from ulna.system.file import write_system

    system = plant(name)
    with progress(f"designing for '{system.name}'"):
        made = make_design(system if symbolic else system.with_values(), controller_poles, observer_poles)
    controller = made.compensator or made.law or made.observer
    if out is not None and controller is not None:
        write_system(controller.system, out)
    if plot is not None:
        _plot_poles(made, plot)
    if as_json:
        print_json(_data(made))
        return
    for title, rows in _sections(made):
        _print_section(title, rows)


def make_design(system: System, controller_poles: str, observer_poles: str) -> Design:
    """The design that the two options ask for.

    Raises:
        UlnaError: if neither is given, or the plant lacks the form that one of them needs.
    """
    from ulna.base import DesignError
    from ulna.design.control.compensator import compensator
    from ulna.design.control.gains import Poles
    from ulna.design.control.law import state_feedback
    from ulna.design.forms.controller_form import controller_form
    from ulna.design.observers.observer import exact_observer
    from ulna.design.observers.observer_form import observer_form

    if not controller_poles and not observer_poles:
        raise DesignError("a design", "no poles were given.", "Add --controller-poles, --observer-poles or both.")
    law = observer = None
    if controller_poles:
        gains = Poles(*pole_list(controller_poles))
        law = state_feedback(controller_form(system), gains)
    if observer_poles:
        gains = Poles(*pole_list(observer_poles))
        observer = exact_observer(observer_form(system), gains)
    both = compensator(law, observer) if law is not None and observer is not None else None
    return Design(plant=system, law=law, observer=observer, compensator=both)


def _sections(made: Design) -> Iterable[tuple[str, dict[str, Any]]]:
    """What is shown: title, then name and expression of each line."""
    if made.law is not None:
        form = made.law.form
        rows = {f"z{k + 1}": e for k, e in enumerate(form.chain)}
        yield "controller form z = T(x)", rows
        yield (
            "ends of the chains, α + β u",
            {
                **{f"α{k + 1}": e for k, e in enumerate(form.alpha)},
                "β": form.beta[0, 0] if form.beta.shape == (1, 1) else form.beta,
            },
        )
        yield "gains K on z", {"K": made.law.gains}
        yield "law", _named(made.law.system.outputs, made.law.expressions)
    if made.observer is not None and (form_o := made.observer.form) is not None:
        yield "observer form z = T(x)", {f"z{k + 1}": e for k, e in enumerate(form_o.map.forward)}
        yield "injection γ(y, u)", {f"γ{k + 1}": e for k, e in enumerate(form_o.injection)}
        yield "gains L on y − ŷ in z", {"L": made.observer.gains}
        system = made.observer.system
        yield "observer", {f"{s.name}'": r for s, r in zip(system.states, system.inline(system.rates), strict=True)}


def _named(signals: Iterable[Any], expressions: Iterable[Any]) -> dict[str, Any]:
    return {s.name: e for s, e in zip(signals, expressions, strict=True)}


def _data(made: Design) -> dict[str, Any]:
    from ulna.report.results import plain
    from ulna.system.schema import system_to_mapping

    data: dict[str, Any] = {"plant": made.plant.name}
    if made.law is not None:
        form = made.law.form
        data["controller_form"] = {
            "T": plain(list(form.chain)),
            "alpha": plain(list(form.alpha)),
            "beta": plain(form.beta),
            "indices": list(form.indices),
        }
        data["law"] = {"gains": plain(made.law.gains), **plain(_named(made.law.system.outputs, made.law.expressions))}
    if made.observer is not None and (form_o := made.observer.form) is not None:
        data["observer_form"] = {"T": plain(list(form_o.map.forward)), "injection": plain(list(form_o.injection))}
        data["observer"] = {"gains": plain(made.observer.gains), "system": system_to_mapping(made.observer.system)}
    if made.compensator is not None:
        data["compensator"] = system_to_mapping(made.compensator.system)
    return data


def _print_section(title: str, rows: dict[str, Any]) -> None:
    from rich.markup import escape
    from rich.table import Table

    from ulna.report.results import plain

    table = Table(title=escape(title), title_justify="left", show_header=False, box=None, padding=(0, 2))
    table.add_column(no_wrap=True, style="bold")
    table.add_column(overflow="fold")
    for key, value in rows.items():
        table.add_row(escape(key), escape(str(plain(value))))
    console().print(table)


def _plot_poles(made: Design, path: Path) -> None:
    from ulna.design.control.gains import roots_of
    from ulna.plot.poles import plot_poles
    from ulna.plot.save import save_figure

    groups = {}
    if made.law is not None:
        groups["controller"] = roots_of(made.law.polynomials)
    if made.observer is not None:
        groups["observer"] = roots_of(made.observer.polynomials)
    save_figure(plot_poles(groups, title=f"poles of the design for {made.plant.name}"), path)
