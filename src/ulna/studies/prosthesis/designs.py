"""The designs of the paper and of this package as contenders; gains stay symbolic, one system serves every preset."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import sympy as sp

from ulna.base import DesignError
from ulna.design import (
    AbstractGainRule,
    Compensator,
    Law,
    Observer,
    Track,
    compensator,
    controller_form,
    exact_observer,
    extended_state_observer,
    input_output_form,
    observer_form,
    reduced_order,
    state_feedback,
    with_disturbance,
)
from ulna.studies.prosthesis.contender import Contender, Tuned
from ulna.system import Parameter, Signal, System

LAW_PAIR = (-2 + 2j * np.sqrt(3), -2 - 2j * np.sqrt(3))
"""The paper's pair of poles of the loop, 1/s; tuning scales it, and chooses the third pole, −8 in the paper, by itself:
one far to the left asks the current for nothing that the winding does not do anyway."""
OBSERVER_POLES = (-9.0, -10.0, -11.0)
"""The paper's poles of the estimate, 1/s; tuning scales them together."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedGains(AbstractGainRule):
    """Coefficients a₀ … a_{r−1} of each chain left as the symbols `<stem>0`, `<stem>1` and so on."""

    stem: str

    def polynomials(self, orders: Sequence[int]) -> tuple[tuple[sp.Expr, ...], ...]:
        """One symbol for each coefficient, counted through the chains."""
        names = iter(range(sum(orders)))
        return tuple(tuple(sp.Symbol(f"{self.stem}{next(names)}", real=True) for _ in range(r)) for r in orders)

    def feedback(
        self, A: sp.ImmutableDenseMatrix, B: sp.ImmutableDenseMatrix, names: Sequence[str], asked: str
    ) -> sp.ImmutableDenseMatrix:
        """Nothing: symbols place no poles of a linearisation."""
        del A, B, names
        raise DesignError(asked, f"the gains {self.stem}0 … are symbols of chains.", "Give poles.")


@cache
def design_plant() -> System:
    """ω' = c1 cos θ − c2 ω + c3 i, i' = −c4 ω − c5 i + c6 u with the gains k0 …, l0 … among its parameters."""
    theta, omega, i, u = (sp.Symbol(name, real=True) for name in ("theta", "omega", "i", "u"))
    c1, c2, c3, c4, c5, c6 = lumps = [sp.Symbol(f"c{k}", real=True) for k in range(1, 7)]
    gains = [f"k{k}" for k in range(3)] + [f"l{k}" for k in range(4)]
    return System(
        name="design arm",
        states=(Signal(name="theta"), Signal(name="omega"), Signal(name="i")),
        rates=(omega, c1 * sp.cos(theta) - c2 * omega + c3 * i, -c4 * omega - c5 * i + c6 * u),
        inputs=(Signal(name="u"),),
        outputs=(Signal(name="y"),),
        readouts=(theta,),
        parameters=tuple(Parameter(name=str(n)) for n in (*lumps, *gains)),
        operating_point=(("theta", sp.Integer(0)),),
    )


@cache
def slow_plant() -> System:
    """The design plant with the current at its quasi-steady value."""
    return reduced_order(design_plant(), ["i"]).slow


def state_law() -> Contender:
    """The paper's law on measured angle, speed and current."""
    law = state_feedback(controller_form(design_plant()), NamedGains(stem="k"), reference=Track())
    measured = {sp.Symbol("theta", real=True): sp.Symbol("y", real=True)}
    system = replace(
        law.system,
        name="state feedback",
        inputs=tuple(Signal(name="y") if s.name == "theta" else s for s in law.system.inputs),
        readouts=tuple(e.xreplace(measured) for e in law.system.readouts),
    )
    return Contender(
        key="state_feedback",
        title="the paper's state feedback",
        note="the exactly linearising third-order law on measured angle, speed and current",
        controller=_without_idle_parameters(system),
        tuned=_law_numbers(),
        proposed=True,
        measures_all=True,
    )


def paper_compensator() -> Contender:
    """The paper's law on the estimates of its exact observer, which reads the angle only."""
    law = state_feedback(controller_form(design_plant()), NamedGains(stem="k"), reference=Track())
    observer = exact_observer(observer_form(design_plant()), NamedGains(stem="l"))
    return Contender(
        key="compensator",
        title="the paper's compensator",
        note="the third-order law with the exact observer, from the angle alone",
        controller=_compensator(law, observer),
        tuned=(*_law_numbers(), Tuned(name="observer_scale", start=5.0, lower=0.3, upper=60.0)),
        proposed=True,
    )


def reduced_compensator() -> Contender:
    """The law and the observer of the arm whose current settles at once, from the angle only."""
    law = state_feedback(controller_form(slow_plant()), NamedGains(stem="k"), reference=Track())
    observer = exact_observer(observer_form(slow_plant()), NamedGains(stem="l"))
    return Contender(
        key="reduced",
        title="reduced-order compensator",
        note="law and exact observer of the second-order arm, the current taken as settled",
        controller=_compensator(law, observer),
        tuned=_scales(),
        proposed=True,
    )


def load_robust(*, full: bool) -> Contender:
    """The law that cancels the disturbance its observer estimates; `full` keeps the current as a state."""
    extended = with_disturbance(design_plant() if full else slow_plant(), {"omega": 1})
    law = state_feedback(input_output_form(extended), NamedGains(stem="k"), reference=Track())
    observer = extended_state_observer(extended, NamedGains(stem="l"))
    order = "third-order" if full else "second-order"
    return Contender(
        key="load_robust",
        title="load-robust compensator",
        note=f"the {order} law with an observer that estimates an unknown torque as a further state",
        controller=_compensator(law, observer),
        tuned=_scales(),
        proposed=True,
    )


def coefficients(poles: Sequence[complex] | np.ndarray) -> list[float]:
    """a₀ … a_{r−1} of the monic polynomial with these roots."""
    return [float(value) for value in np.poly(np.asarray(poles)).real[:0:-1]]


def gain_numbers(contender: Contender, chosen: dict[str, float]) -> dict[str, float]:
    """k0 … and l0 … of the chosen scales, as many as the contender has.

    `law_scale` stretches the paper's pair of poles and `observer_scale` its observer's poles, −`law_third` is the law's
    third pole; `law_pole` and `observer_pole` put all there: the law's
    with damping 0.9, the observer's spread by ±10 %.
    """
    order, size = (len({n for n in contender.parameters if n.startswith(stem)}) for stem in "kl")
    numbers: dict[str, float] = {}
    law = np.array([*(chosen.get("law_scale", 0.0) * np.array(LAW_PAIR)), -chosen.get("law_third", 0.0)])
    observer = chosen.get("observer_scale", 0.0) * np.array(OBSERVER_POLES)
    if "law_pole" in chosen:
        pair = -chosen["law_pole"] * np.array([0.9 + 0.435889894354j, 0.9 - 0.435889894354j, 1.0])
        law, observer = pair[:order], -chosen["observer_pole"] * np.linspace(0.9, 1.1, size)
    numbers |= {f"k{k}": value for k, value in enumerate(coefficients(law[:order]))} if order else {}
    numbers |= {f"l{k}": value for k, value in enumerate(coefficients(observer))} if size else {}
    return numbers


def _law_numbers() -> tuple[Tuned, ...]:
    return (
        Tuned(name="law_scale", start=3.0, lower=0.3, upper=60.0),
        Tuned(name="law_third", start=24.0, lower=1.0, upper=30000.0),
    )


def _scales() -> tuple[Tuned, ...]:
    return (
        Tuned(name="law_pole", start=10.0, lower=1.0, upper=400.0),
        Tuned(name="observer_pole", start=80.0, lower=3.0, upper=600.0),
    )


def _compensator(law: Law, observer: Observer) -> Compensator:
    return compensator(
        replace(law, system=_without_idle_parameters(law.system)),
        replace(observer, system=_without_idle_parameters(observer.system)),
    )


def _without_idle_parameters(system: System) -> System:
    """The system with the parameters that occur in it."""
    symbols = set().union(*(e.free_symbols for e in (*system.inline(system.rates), *system.inline(system.readouts))))
    return replace(system, parameters=tuple(p for p in system.parameters if p.symbol in symbols))
