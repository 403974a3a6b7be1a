"""`ulna design PLANT`: controller form and law, observer form and observer, compensator."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ulna.cli.asked_controller import as_file, designed
from ulna.cli.asked_plant import plant_of
from ulna.cli.layout import write_rows, write_texts
from ulna.cli.option_groups import with_groups
from ulna.cli.options import AsJson, DesignOptions, Exact, PlantOptions, Seconds, Substitute
from ulna.cli.patience import take_time
from ulna.cli.supervisor import kept
from ulna.cli.terminal import print_json, progress

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ulna.design import Controller, ExtendedLaw


@with_groups
def design(
    plant: PlantOptions,
    wanted: DesignOptions,
    symbolic: Annotated[bool, typer.Option(help="Keep parameters as symbols instead of their values.")] = False,
    out: Annotated[
        Path | None, typer.Option(help="Write the controller for --controller (TOML or JSON, like a plant file).")
    ] = None,
    plot: Annotated[Path | None, typer.Option(help="Draw the poles: a .png, .svg or .pdf file.")] = None,
    substitute: Substitute = False,
    exact: Exact = False,
    as_json: AsJson = False,
    seconds: Seconds = None,
) -> None:
    """Design a feedback law, an observer, or both and the compensator that joins them.

    Without poles and weights it is the best that the plant has, with poles at the plant's own speed: a law that
    is exact, else input-output, else local on the linearisation, and an observer. The law holds the operating point of
    the plant file unless it takes a set point or a reference.

    Examples:
        ulna design one_link_arm
        ulna design one_link_arm --controller-poles=-4,-5,-6 --observer-poles=-9,-10,-11 --out ctl.toml
        ulna design cart_pole --lqr 10,1,10,1:1 --local
        ulna design unicycle --extend --track --controller-poles=-1,-2,-3,-4
    """
    take_time(seconds)
    from ulna.system import substitute_input, write_system

    if not wanted.law and not wanted.observer:
        wanted = replace(wanted, best=True)

    system = plant_of(plant)
    with progress(f"designing for '{system.name}'"):
        system = system if symbolic else system.with_values()
        found = substitute_input(system) if substitute else None
        made = designed(system if found is None else found.system, wanted)
    if out is not None:
        written = as_file(made)
        comment = (
            f"Written by `ulna design {plant.name}`. Read it with: ulna simulate {plant.name} --controller {out.name}\n"
            "All numbers are exact: a fraction is written where no short decimal exists."
        )
        write_system(written if found is None else found.undo(written), out, comment=comment)
        kept(f"{out} is written")
    if plot is not None:
        _plot_poles(made, plot)
    if as_json:
        print_json(_data(made))
        return
    if found is not None:
        _print_section("inputs of the design", {v.name: phi for v, phi in found.meaning.items()}, exact)
    for title, rows in _sections(made):
        _print_section(title, rows, exact)
    if found is not None and made.law is not None:
        back = found.undo(made.law.system)
        _print_section("law for the inputs themselves", _named(back.outputs, back.inline(back.readouts)), exact)


def _sections(made: Controller | ExtendedLaw) -> Iterable[tuple[str, dict[str, Any]]]:
    """What is shown: title, then name and expression of each line."""
    if made.passed:
        yield "passed over", dict(made.passed)
    if made.law is not None:
        form = made.law.form
        if (extension := getattr(made, "extension", None)) is not None:
            yield "dynamic extension", _named(made.plant.inputs, extension.feedback)
        if form is not None:
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
        yield f"law, {made.law.method}", _named(made.law.system.outputs, made.law.expressions)
        if made.law.polynomials and not made.law.plant.parameters:
            yield "poles of the law in 1/s", {"s": _poles(made.law.poles)}
    if made.observer is not None:
        from ulna.design import gains_in_form

        if (form_o := made.observer.form) is not None:
            yield "observer form z = T(x)", {f"z{k + 1}": e for k, e in enumerate(form_o.map.forward)}
            yield "injection γ(y, u)", {f"γ{k + 1}": e for k, e in enumerate(form_o.injection)}
            yield "gains L on y − ŷ in z", {"L": gains_in_form(made.observer)}
        system = made.observer.system
        yield (
            f"observer, {system.text}" if made.observer.form is None else "observer",
            {f"{s.name}'": r for s, r in zip(system.states, system.inline(system.rates), strict=True)},
        )


def _poles(values: Iterable[complex]) -> str:
    """Poles as people write them, slowest first."""
    rows = sorted(values, key=lambda p: (-p.real, abs(p.imag), p.imag))
    return ", ".join(f"{p.real:.6g}{p.imag:+.6g}j" if abs(p.imag) > 1e-6 * abs(p) else f"{p.real:.6g}" for p in rows)


def _named(signals: Iterable[Any], expressions: Iterable[Any]) -> dict[str, Any]:
    return {s.name: e for s, e in zip(signals, expressions, strict=True)}


def _data(made: Controller | ExtendedLaw) -> dict[str, Any]:
    from ulna.design import gains_in_form
    from ulna.report.results import plain
    from ulna.system import system_to_mapping

    data: dict[str, Any] = {"plant": made.plant.name, "passed": dict(made.passed)}
    if made.law is not None:
        form = made.law.form
        if form is not None:
            data["controller_form"] = {
                "T": plain(list(form.chain)),
                "alpha": plain(list(form.alpha)),
                "beta": plain(form.beta),
                "indices": list(form.indices),
            }
        data["method"] = made.law.method
        data["law"] = {"gains": plain(made.law.gains), **plain(_named(made.law.system.outputs, made.law.expressions))}
    if made.observer is not None:
        if (form_o := made.observer.form) is not None:
            data["observer_form"] = {"T": plain(list(form_o.map.forward)), "injection": plain(list(form_o.injection))}
            data["observer_form"]["gains"] = plain(gains_in_form(made.observer))
        data["observer"] = {"gains": plain(made.observer.gains), "system": system_to_mapping(made.observer.system)}
    if made.compensator is not None:
        data["compensator"] = system_to_mapping(made.compensator.system)
    return data


def _print_section(title: str, rows: dict[str, Any], exact: bool) -> None:
    typer.secho(title, italic=True)
    if all(isinstance(value, str) for value in rows.values()):
        write_texts(rows)
    else:
        write_rows(rows, exact=exact, sign="")


def _plot_poles(made: Controller | ExtendedLaw, path: Path) -> None:
    from ulna.plot.poles import plot_poles
    from ulna.plot.save import save_figure

    save_figure(plot_poles(made, title=f"poles of the design for {made.plant.name}"), path)
