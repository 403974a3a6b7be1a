"""Plants made from Brunovský's form by a random change of coordinates and feedback: the form must be recovered."""

from __future__ import annotations

from dataclasses import dataclass

import pytest
import sympy as sp
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from ulna.base import NoFormError
from ulna.design.forms.full_linearisation import controller_form
from ulna.design.forms.linear_coordinates import state_linearisation
from ulna.design.forms.linearisability_conditions import linearisability
from ulna.design.forms.linearising_form import substituted_back
from ulna.symbolic.exact import generic_rank
from ulna.system import Signal, System

X = sp.symbols("x1:5", real=True)
# Every example is a whole analysis: shrinking a failure would take minutes.
WITHOUT_SHRINKING = (Phase.explicit, Phase.generate)


@dataclass(frozen=True, kw_only=True)
class Made:
    """A plant with its answer: the heads of the chains as functions of x."""

    system: System
    heads: tuple[sp.Expr, ...]


def made(lengths: tuple[int, ...], shears: list[tuple[int, sp.Expr]], ends: list[sp.Expr], gain: sp.Matrix) -> Made:
    """z = Φ(x) by shears x_i ↦ x_i + p(others); then the chains z' = (z₂, …, α(x) + β(x) u) written in x."""
    x, n = X[: sum(lengths)], sum(lengths)
    phi = list(x)
    for i, term in shears:
        bent = x[i] + term.subs(x[i], 0)
        phi = [sp.expand(e.subs(x[i], bent)) for e in phi]
    back = sp.Matrix(phi).jacobian(x).inv(method="ADJ").applyfunc(sp.expand)
    drift, fields, heads, first = [], sp.zeros(n, len(lengths)), [], 0
    for k, length in enumerate(lengths):
        heads.append(phi[first])
        drift += [*phi[first + 1 : first + length], ends[k]]
        first += length
        fields[first - 1, :] = gain[k, :]
    u = sp.symbols(f"u1:{len(lengths) + 1}", real=True)
    rates = (back * (sp.Matrix(drift) + fields * sp.Matrix(u))).applyfunc(sp.expand)
    system = System(
        name="made",
        states=tuple(Signal(name=s.name) for s in x),
        rates=tuple(rates),
        inputs=tuple(Signal(name=s.name) for s in u),
        operating_point=tuple((s.name, sp.Integer(0)) for s in x),
    )
    return Made(system=system, heads=tuple(heads))


def terms(count: int) -> st.SearchStrategy[sp.Expr]:
    """Polynomial, exponential and trigonometric terms that vanish at 0."""
    symbol = st.sampled_from(X[:count])

    def of(a: sp.Expr, b: sp.Expr, kind: int, factor: int) -> sp.Expr:
        return factor * (a * b, a**2, a**3, sp.exp(a) - 1, b * sp.cos(a), sp.sin(a))[kind]

    return st.builds(of, symbol, symbol, st.integers(0, 5), st.sampled_from([1, -1, 2]))


def gains(count: int) -> st.SearchStrategy[sp.Expr]:
    """Input gains without real zeros."""
    symbol = st.sampled_from(X[:count])
    return st.builds(
        lambda a, kind: (sp.Integer(1), 1 + a**2, sp.exp(a), 2 + sp.sin(a))[kind], symbol, st.integers(0, 3)
    )


def assert_recovered(plant: Made) -> None:
    form = controller_form(plant.system)
    x = form.view.x
    assert substituted_back(form).holds
    assert form.at_point.holds
    assert sum(form.indices) == len(x)
    if len(set(form.indices)) == 1:
        rows = [[h.diff(s) for s in x] for h in (*form.outputs, *plant.heads)]
        assert generic_rank(sp.Matrix(rows)).value == len(form.indices)


@pytest.mark.slow
@settings(max_examples=6, phases=WITHOUT_SHRINKING)
@given(st.data())
def test_one_input_is_recovered(data: st.DataObject) -> None:
    n = data.draw(st.integers(2, 3))
    shears = data.draw(st.lists(st.tuples(st.integers(0, n - 1), terms(n)), min_size=1, max_size=2))
    end, gain = data.draw(terms(n)), data.draw(gains(n))
    assert_recovered(made((n,), shears, [end], sp.Matrix([[gain]])))


@pytest.mark.slow
@settings(max_examples=5, phases=WITHOUT_SHRINKING)
@given(st.data())
def test_two_inputs_are_recovered(data: st.DataObject) -> None:
    lengths = data.draw(st.sampled_from([(1, 1), (2, 1), (2, 2), (3, 1)]))
    n = sum(lengths)
    shears = data.draw(st.lists(st.tuples(st.integers(0, n - 1), terms(n)), min_size=1, max_size=2))
    ends = [data.draw(terms(n)) for _ in lengths]
    gain = sp.Matrix([[data.draw(gains(n)), data.draw(terms(n))], [0, data.draw(gains(n))]])
    plant = made(lengths, shears, ends, gain)
    assert linearisability(plant.system).indices == lengths
    assert_recovered(plant)


@settings(max_examples=5, phases=WITHOUT_SHRINKING)
@given(st.data())
def test_a_bracket_that_leaves_the_span_is_never_overlooked(data: st.DataObject) -> None:
    """x2' = x3 + c x4², x3' = x4, x4' = u behind x1' = x2: [ad_f g, ad_f² g] leaves G_2 exactly if c ≠ 0."""
    c, shift = data.draw(st.sampled_from([0, 1, -2])), data.draw(terms(4))
    rates = (X[1], X[2] + c * X[3] ** 2, X[3], shift + sp.Symbol("u", real=True))
    system = System(
        name="chain",
        states=tuple(Signal(name=s.name) for s in X),
        rates=rates,
        inputs=(Signal(name="u"),),
    )
    found = linearisability(system)
    assert found.verdict.holds is (c == 0)
    assert found.verdict.fails is (c != 0)
    if c:
        with pytest.raises(NoFormError, match="leaves span"):
            controller_form(system)
        assert state_linearisation(system).verdict.fails
