"""Chains of integrators with any smooth nonlinearity: ranks, degrees and involutivity are known at every length."""

from __future__ import annotations

import pytest
from flint import arb, ctx

from ulna.base import Status, UlnaError
from ulna.geometry import numeric_structure
from ulna.plants.flexible_arm import flexible_joint_arm
from ulna.symbolic.exact import rank_of_balls
from ulna.system import System, system_from_mapping, system_kernel


def chain(n: int, term: str) -> System:
    """x_i' = x_{i+1} + φ(x_i), x_n' = u, y = x_1."""
    states = {f"x{k}": f"x{k + 1} + {term.format(x=f'x{k}')}" for k in range(1, n)} | {f"x{n}": "u"}
    return system_from_mapping({"states": states, "inputs": {"u": {}}, "outputs": {"y": "x1"}})


def toda(masses: int) -> System:
    """A Toda lattice pushed at its last mass, its first measured; springs alone carry the force."""
    states: dict[str, str] = {}
    for k in range(1, masses + 1):
        pull = f"exp(q{k} - q{k + 1})" if k < masses else "-u"
        push = f"exp(q{k - 1} - q{k})" if k > 1 else "0"
        states |= {f"q{k}": f"p{k}", f"p{k}": f"{push} - ({pull})"}
    return system_from_mapping({"states": states, "inputs": {"u": {}}, "outputs": {"y": "q1"}})


@pytest.mark.parametrize("term", ["{x}**2", "tanh({x})", "exp({x}) - 1", "sin({x})", "{x}**3/7", "{x}/(2 + cos({x}))"])
@pytest.mark.parametrize("n", [9, 13, 16])
def test_chains_have_full_ranks_and_degree_n(term: str, n: int) -> None:
    found = numeric_structure(system_kernel(chain(n, term)))
    assert found.degrees == (n,)
    assert found.degrees_known.holds
    assert found.degrees_at_point.holds
    assert found.dimensions == tuple(range(1, n + 1))
    for rank in (found.rank, found.rank_at_point, found.observability_rank, found.observability_rank_at_point):
        assert rank is not None
        assert rank.value == n
        assert rank.verdict.status is Status.PROVED
    assert found.involutive.holds


def test_a_toda_lattice_of_eight_masses() -> None:
    found = numeric_structure(system_kernel(toda(8)))
    assert found.degrees == (16,)
    assert found.rank.value == 16
    assert found.observability_rank is not None
    assert found.observability_rank.value == 16


@pytest.mark.parametrize("scale", ["1e-9", "1e9", "1.602e-19"])
def test_the_scale_of_a_state_decides_nothing(scale: str) -> None:
    plant = system_from_mapping(
        {
            "states": {"a": f"{scale}*b + a**2", "b": f"{scale}*c + sin(b)", "c": f"{scale}*u"},
            "inputs": {"u": {}},
            "outputs": {"y": f"{scale}*a"},
        }
    )
    found = numeric_structure(system_kernel(plant))
    assert found.degrees == (3,)
    assert found.rank.value == 3
    assert found.involutive.holds


def test_what_is_not_reached_not_seen_or_not_involutive_is_found() -> None:
    idle = system_from_mapping(
        {
            "states": {"a": "-a + u", "b": "-2*b + 0.1*b**2", "c": "-3*c"},
            "inputs": {"u": {}},
            "outputs": {"y": "a", "z": "b"},
        }
    )
    found = numeric_structure(system_kernel(idle))
    assert found.rank.value == 1
    assert found.rank.verdict.status is Status.SUPPORTED
    assert found.degrees == (1, None)
    assert found.observability_rank is not None
    assert found.observability_rank.value == 2
    cart = {"p": "q", "q": "u", "t": "w", "w": "sin(t) - u*cos(t)"}
    pole = system_from_mapping({"states": cart, "inputs": {"u": {}}, "outputs": {"y": "p"}})
    refused = numeric_structure(system_kernel(pole)).involutive
    assert refused.status is Status.REFUTED
    assert refused.evidence["rank_with_brackets"] == refused.evidence["rank"] + 1
    assert set(refused.evidence["point"]) == set(pole.state_symbols)


def test_a_point_where_the_plant_is_not_finite_is_undecided() -> None:
    plant = system_from_mapping(
        {
            "states": {"a": "1/b", "b": "u"},
            "inputs": {"u": {}},
            "outputs": {"y": "a"},
            "operating_point": {"a": 0, "b": 0},
        }
    )
    found = numeric_structure(system_kernel(plant))
    assert found.degrees == (2,)
    assert found.rank_at_point.value is None
    assert found.rank_at_point.verdict.status is Status.UNDECIDED


def test_a_plant_with_jumps_is_refused() -> None:
    plant = system_from_mapping({"states": {"a": "abs(a) + u"}, "inputs": {"u": {}}, "outputs": {"y": "a"}})
    with pytest.raises(UlnaError, match="derivative"):
        numeric_structure(system_kernel(plant))


def test_flexible_arms_agree_with_their_known_structure() -> None:
    found = numeric_structure(system_kernel(flexible_joint_arm(3)))
    assert found.degrees == (4, 4, 4)
    assert found.dimensions[:4] == (3, 6, 9, 12)
    assert found.decoupling_rank is not None
    assert found.decoupling_rank.value == 3


def test_balls_too_wide_to_tell_are_undecided() -> None:
    with ctx.workprec(128):
        wide = arb(0, 0.001)
        rank = rank_of_balls([[arb(1), arb(0)], [arb(0), wide]], point={})
        assert rank.value == 1
        assert rank.verdict.status is Status.UNDECIDED
        narrow = arb(0, arb(2) ** -90)
        assert rank_of_balls([[arb(1), arb(0)], [arb(1), narrow]], point={}).verdict.status is Status.SUPPORTED
        tiny = arb(2) ** -300
        assert rank_of_balls([[arb(1), arb(0)], [arb(0), tiny]], point={}).value == 2
