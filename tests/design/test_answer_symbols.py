"""The symbols that answers are written in: those of docs/analysis.md, whatever the plant calls its signals."""

import sympy as sp

from ulna.design.analysis.analysis import analyse
from ulna.system import System, system_from_mapping


def plant(states: dict[str, str], inputs: list[str], outputs: dict[str, str], **more: object) -> System:
    data = {"name": "plant", "states": states, "inputs": {u: {} for u in inputs}, "outputs": outputs}
    return system_from_mapping(data | more)


def names(expressions: list[sp.Expr]) -> set[str]:
    return {s.name for e in expressions for s in e.free_symbols}


def test_an_injection_is_written_in_y_whatever_the_output_is_called():
    found = analyse(plant({"q": "w", "w": "-sin(q) + u"}, ["u"], {"angle": "q"}))
    assert names(found["observer_injection"].value) == {"y", "u"}


def test_injections_of_several_outputs_are_written_in_y1_and_y2():
    rates = {"q": "w", "w": "-sin(q) + p", "p": "-p + q*u"}
    found = analyse(plant(rates, ["u"], {"angle": "q", "torque": "p"}))
    assert names(found["observer_injection"].value) == {"y1", "y2", "u"}


def test_new_inputs_are_v1_and_v2_although_a_state_is_called_v():
    found = analyse(plant({"x": "v", "v": "F - v**2", "q": "M"}, ["F", "M"], {"place": "x", "angle": "q"}))
    assert names(found["control"].value) == {"v", "v1", "v2"}
    assert set(found["inverse"].value) == {"x", "v", "q"}


def test_a_new_symbol_gives_way_to_one_of_the_plant():
    found = analyse(plant({"v1": "v2", "v2": "F", "q": "M"}, ["F", "M"], {"place": "v1", "angle": "q"}))
    assert names(found["control"].value) == {"v_1", "v_2"}
