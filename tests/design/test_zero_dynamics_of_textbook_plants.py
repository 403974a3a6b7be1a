"""Zero dynamics, minimum phase, law, normal form, extension: every fact known of the textbook plants."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
import sympy as sp

from ulna.base import Status, Verdict
from ulna.design.forms.extension import dynamic_extension
from ulna.design.forms.flatness import flat_output
from ulna.design.forms.input_output import input_output_form
from ulna.design.forms.normal_coordinates import normal_form
from ulna.design.internal.output_zeroing import ZeroDynamics, zero_dynamics
from ulna.design.internal.phase import minimum_phase
from ulna.geometry import lie_derivative
from ulna.symbolic.exact import generic_rank, is_zero
from ulna.system import System, control_affine, system_from_mapping

_FUNCTIONS = {"sin", "cos", "tan", "exp", "atan", "sqrt", "log", "pi"}


def _plain(text: str) -> str:
    return re.sub(r"Rational\((-?\d+),\s*(\d+)\)", r"(\1/\2)", text)


def _plant(row: Mapping[str, Any]) -> System:
    rates = {}
    for i, x in enumerate(row["states"]):
        terms = [_plain(row["f"][i])]
        terms += [f"({_plain(column[i])})*{u}" for u, column in zip(row["inputs"], row["g"], strict=True)]
        rates[x] = " + ".join(terms)
    text = " ".join([*rates.values(), *map(_plain, row["h"])])
    names = set(re.findall(r"[A-Za-z_]\w*", text)) - {*row["states"], *row["inputs"]} - _FUNCTIONS
    values = row.get("params", {})
    return system_from_mapping(
        {
            "name": row["name"],
            "states": rates,
            "inputs": {u: {} for u in row["inputs"]},
            "outputs": {f"y_{k + 1}": _plain(h) for k, h in enumerate(row["h"])},
            "parameters": {p: ({"value": values[p]} if p in values else {}) for p in sorted(names)},
            "operating_point": row.get("x0", {}),
        }
    )


def _rows() -> dict[str, dict[str, Any]]:
    file = Path(__file__).parent.parent / "data" / "systems.json"
    data = json.loads(file.read_text(encoding="utf-8"))
    rows = data if isinstance(data, list) else data["systems"]
    return {row["name"]: row for row in rows if row["kind"] == "system"}


_ROWS = _rows()


def _with(key: str) -> list[str]:
    return [name for name, row in _ROWS.items() if key in row["expect"]]


def _read(text: str, plant: System, extra: tuple[str, ...] = ()) -> sp.Expr:
    symbols = {s.name: s for s in (*plant.state_symbols, *plant.input_symbols, *plant.parameter_symbols)}
    symbols |= {name: sp.Symbol(name, real=True) for name in extra}
    return sp.parse_expr(text, local_dict={**symbols, "Rational": sp.Rational})


def _agrees(found: ZeroDynamics, fact: Mapping[str, Any]) -> bool:
    """Whether the known zero dynamics are the ones found, up to coordinates of the manifold."""
    plant, system = found.plant, found.system
    if system is None or len(system.states) != len(fact["coords"]):
        return False
    on_manifold = dict(found.manifold)
    for state, text in fact["manifold"].items():
        difference = sp.Symbol(state, real=True) - _read(text, plant)
        if not is_zero(difference.xreplace(on_manifold)).holds:
            return False
    for symbol, text in zip(plant.input_symbols, fact["u"], strict=True):
        if not is_zero(found.inputs[symbol] - _read(text, plant).xreplace(on_manifold)).holds:
            return False
    names = tuple(fact["coords"])
    eta = {sp.Symbol(e, real=True): _read(t, plant).xreplace(on_manifold) for e, t in fact["coords"].items()}
    field, zeta = sp.Matrix(len(system.rates), 1, system.rates), system.state_symbols
    if generic_rank(sp.Matrix([[e.diff(z) for z in zeta] for e in eta.values()])).value < len(zeta):
        return False
    return all(
        is_zero(
            lie_derivative(expression, field, zeta) - _read(fact["rhs"][symbol.name], plant, names).xreplace(eta)
        ).holds
        for symbol, expression in eta.items()
    )


@pytest.mark.parametrize("name", _with("zero_dynamics"))
def test_zero_dynamics_are_the_known_ones_up_to_coordinates(name: str) -> None:
    found = zero_dynamics(_plant(_ROWS[name]))
    assert found.verdict.status is Status.PROVED
    assert _agrees(found, _ROWS[name]["expect"]["zero_dynamics"])


@pytest.mark.parametrize("name", _with("zero_dynamics"))
def test_wrong_zero_dynamics_are_refused(name: str) -> None:
    fact = _ROWS[name]["expect"]["zero_dynamics"]
    found = zero_dynamics(_plant(_ROWS[name]))
    first = next(iter(fact["rhs"]))
    assert not _agrees(found, {**fact, "rhs": {**fact["rhs"], first: f"-({fact['rhs'][first]}) + 1"}})
    assert not _agrees(found, {**fact, "u": [f"({fact['u'][0]}) + 1", *fact["u"][1:]]})
    state = next(iter(fact["manifold"]))
    assert not _agrees(found, {**fact, "manifold": {**fact["manifold"], state: f"({fact['manifold'][state]}) + 1"}})


@pytest.mark.parametrize("name", _with("minimum_phase"))
def test_minimum_phase_class_is_the_known_one(name: str) -> None:
    row = _ROWS[name]
    found = minimum_phase(zero_dynamics(_plant(row)))
    assert found.stability == row["expect"]["minimum_phase"]
    assert found.verdict.status is Status.PROVED
    expected = row["expect"].get("zero_dynamics_equilibrium", {}).values()
    if expected:
        assert list(found.equilibrium.values()) == [sp.parse_expr(value) for value in expected]


@pytest.mark.parametrize("name", _with("io_control") or _with("zero_dynamics"))
def test_law_gives_the_chains_of_integrators(name: str) -> None:
    plant = _plant(_ROWS[name])
    form = input_output_form(plant)
    view = form.view
    closed = view.f + view.g * sp.Matrix(form.control)
    for k, (output, order) in enumerate(zip(form.outputs, form.indices, strict=True)):
        derivative = output
        for _ in range(order):
            derivative = lie_derivative(derivative, closed, view.x)
        assert is_zero(derivative - form.new_inputs[k]).holds
        assert is_zero(derivative + form.new_inputs[k]).fails


@pytest.mark.parametrize("name", _with("normal_coordinates"))
def test_normal_coordinates_span_the_known_ones(name: str) -> None:
    row = _ROWS[name]
    plant = _plant(row)
    found = normal_form(plant)
    view = control_affine(plant)
    assert found.input_free.status is Status.PROVED
    assert all(entry == 0 for entry in found.slopes)
    ours, known = list(found.internal), [_read(t, plant) for t in row["expect"]["normal_coordinates"]]
    internal = known[-len(ours) :]
    assert all(is_zero(lie_derivative(h, view.g[:, 0], view.x)).holds for h in internal)

    def rank(functions: list[sp.Expr]) -> int:
        return generic_rank(sp.Matrix([[h.diff(x) for x in view.x] for h in functions])).value

    assert rank(list(found.coordinates)) == len(view.x)
    invariants = [x for k, x in enumerate(view.x) if view.g[k, 0] == 0]
    assert rank([*ours, *invariants]) == rank([*internal, *invariants]) == rank([*ours, *internal, *invariants])


@pytest.mark.parametrize("name", _with("dynamic_extension"))
def test_dynamic_extension_is_the_known_one(name: str) -> None:
    row = _ROWS[name]
    plant, fact = _plant(row), row["expect"]["dynamic_extension"]
    found = dynamic_extension(plant, outputs=[_read(t, plant) for t in fact["h"]])
    assert found.system is not None
    assert found.verdict.status is Status.PROVED
    assert found.complete.status is Status.PROVED
    assert list(found.indices) == fact["relative_degree"]
    states = [s.name for s in found.system.states]
    assert states == fact["states"]
    inputs = [s.symbol for s in found.system.inputs]
    extra = (*states, *(s.name for s in inputs))
    for k, rate in enumerate(found.system.rates):
        known = _read(fact["f"][k], plant, extra)
        known += sum(_read(column[k], plant, extra) * u for column, u in zip(fact["g"], inputs, strict=True))
        assert is_zero(rate - known).holds
    det = _read(fact["det"], plant, extra)
    assert is_zero(found.singular - det).holds or is_zero(found.singular + det).holds


@pytest.mark.parametrize("name", _with("flat_output"))
def test_flat_output_is_confirmed_and_others_refused(name: str) -> None:
    row = _ROWS[name]
    plant = _plant(row)
    functions = [_read(t, plant) for t in row["expect"]["flat_output"]]
    verdict = flat_output(plant, functions)
    assert verdict.status is Status.PROVED
    assert isinstance(verdict, Verdict)
    wrong = [functions[0] + plant.state_symbols[-1], *functions[1:]]
    assert flat_output(plant, wrong).fails
    assert flat_output(plant, list(control_affine(plant).h)).fails
    assert flat_output(plant, functions[:1]).fails
