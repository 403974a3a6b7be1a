"""Splitting a kernel and making its jumps explicit change no value."""

from __future__ import annotations

import numpy as np
import sympy as sp

from ulna.program import Operation, hoist, to_python, with_modes
from ulna.symbolic.compiling import kernel

x, y, a, b = sp.symbols("x y a b", real=True)
OUTPUTS = {
    "mixed": sp.sin(a * b) * x + y / (a + b**2) - a,
    "constant_part_alone": sp.sqrt(a) * b,
    "number": sp.Rational(1, 3),
    "free": x * y / 3,
    "limited": sp.Min(sp.Max(x, -a), a) + sp.Abs(x - y) * sp.sign(y),
    "pieces": sp.Piecewise((x, (x > y) | (x < 0)), (y * sp.Heaviside(-x), True)),
}
POINTS = np.random.default_rng(1).uniform(-2.0, 2.0, (50, 2))


def test_the_two_parts_compute_what_the_whole_computes() -> None:
    whole = kernel("k", (x, a, y, b), OUTPUTS)
    split = hoist(whole, ("a", "b"))
    assert split.before.inputs == ("a", "b")
    assert split.main.inputs[:2] == ("x", "y")
    evaluate, before, main = to_python(whole), to_python(split.before), to_python(split.main)
    for first, second in POINTS:
        known = before(0.7, 1.3)
        assert main(first, second, *known) == evaluate(first, 0.7, second, 1.3)


def test_no_product_of_constants_is_left_in_the_main_part() -> None:
    rate = 2 * sp.sin(a) * b * x / (3 * (a + b)) + x + a - b - 1
    split = hoist(kernel("k", (x, a, b), {"rate": rate}, held=(a, b)), ("a", "b"))
    assert split.main.operations == {Operation.MUL: 1, Operation.ADD: 2}


def test_hoisting_nothing_changes_nothing() -> None:
    whole = kernel("k", (x, y), {"rate": x * y + 1})
    split = hoist(whole, ())
    assert split.before.outputs == ()
    assert split.main == whole


def test_modes_that_are_the_signs_of_the_guards_give_the_same_values() -> None:
    whole = kernel("k", (x, y, a, b), OUTPUTS)
    moded = with_modes(whole)
    evaluate, decided = to_python(whole), to_python(moded.kernel)
    # x against −a, its maximum against a, x − y, y, x against y, x against 0 (once for < and Heaviside)
    assert moded.guards == 6
    for first, second in POINTS:
        modes = [0.0] * moded.guards
        for _ in range(moded.guards):  # a guard may depend on another mode: settle them
            guards = decided(first, second, 0.7, 1.3, *modes)[len(OUTPUTS) :]
            modes = [float(np.sign(guard)) for guard in guards]
        assert decided(first, second, 0.7, 1.3, *modes)[: len(OUTPUTS)] == evaluate(first, second, 0.7, 1.3)


def test_a_smooth_kernel_has_no_guards() -> None:
    smooth = kernel("k", (x, y), {"rate": sp.sin(x) / (1 + y**2)})
    assert with_modes(smooth).guards == 0
    assert with_modes(smooth).kernel == smooth
