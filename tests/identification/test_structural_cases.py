"""Published answers to which parameters outputs tell; where only the claim was published, worked out by hand."""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest
import sympy as sp

from ulna.identification import Extent, Identifiability, identifiability
from ulna.symbolic.formulas import parse_formula
from ulna.system import System, system_from_mapping


@dataclass(frozen=True, kw_only=True)
class Case:
    """A plant and what is known of its parameters.

    `together` are functions of the parameters that are known; every combination found must be a function of these.
    """

    name: str
    source: str
    rates: dict[str, str]
    outputs: dict[str, str]
    inputs: tuple[str, ...] = ()
    globally: str = ""
    locally: str = ""
    hidden: str = ""
    together: tuple[str, ...] = ()
    known_start: tuple[str, ...] = field(default=())

    @property
    def free(self) -> list[str]:
        return [*self.globally.split(), *self.locally.split(), *self.hidden.split()]

    def system(self) -> System:
        return system_from_mapping(
            {
                "format": 1,
                "name": self.name,
                "parameters": {name: {} for name in self.free},
                "states": {x: {"equation": e} for x, e in self.rates.items()},
                "inputs": {u: {} for u in self.inputs},
                "outputs": self.outputs,
            }
        )


CASES = (
    Case(
        name="two compartments, both leaking",
        source="Bellman and Astrom, Math. Biosci. 7 (1970)",
        rates={"x1": "-(k01 + k21)*x1 + k12*x2 + u", "x2": "k21*x1 - (k02 + k12)*x2"},
        outputs={"y": "x1/V"},
        inputs=("u",),
        globally="V",
        hidden="k01 k21 k12 k02",
        together=("k01 + k21", "k02 + k12", "k12*k21"),
    ),
    Case(
        name="two compartments, one leaking",
        source="Bellman and Astrom, Math. Biosci. 7 (1970)",
        rates={"x1": "-(k01 + k21)*x1 + k12*x2 + u", "x2": "k21*x1 - k12*x2"},
        outputs={"y": "x1/V"},
        inputs=("u",),
        globally="V k01 k21 k12",
    ),
    Case(
        name="three compartments about one",
        source="Godfrey, Compartmental Models and Their Application (1983): the outer two exchange their names",
        rates={"x1": "-(k21 + k31)*x1 + k12*x2 + k13*x3 + u", "x2": "k21*x1 - k12*x2", "x3": "k31*x1 - k13*x3"},
        outputs={"y": "x1"},
        inputs=("u",),
        locally="k21 k31 k12 k13",
    ),
    Case(
        name="sum of rates",
        source="Chis, Banga and Balsa-Canto, PLoS ONE 6 (2011)",
        rates={"x": "-(a + b)*x"},
        outputs={"y": "x"},
        hidden="a b",
        together=("a + b",),
    ),
    Case(
        name="Michaelis and Menten, dose known",
        source="Chappell, Godfrey and Vajda, Math. Biosci. 102 (1990)",
        rates={"x": "-Vm*x/(Km + x) + u"},
        outputs={"y": "c*x"},
        inputs=("u",),
        globally="c Vm Km",
    ),
    Case(
        name="Michaelis and Menten, no dose",
        source="Chappell, Godfrey and Vajda, Math. Biosci. 102 (1990)",
        rates={"x": "-Vm*x/(Km + x)"},
        outputs={"y": "c*x"},
        hidden="c Vm Km",
        together=("c*Vm", "c*Km"),
    ),
    Case(
        name="SIR, a share of the infected seen",
        source="Evans et al., Math. Biosci. 194 (2005), SIR with a scaled output",
        rates={"S": "-b*S*I_", "I_": "b*S*I_ - g*I_"},
        outputs={"y": "K*I_"},
        globally="g",
        hidden="b K",
        together=("b/K",),
    ),
    Case(
        name="SEIR, the infected seen",
        source="Massonis, Banga and Villaverde, Annual Reviews in Control 51 (2021): incubation and recovery exchange",
        rates={"S": "-b*S*I_", "E": "b*S*I_ - e*E", "I_": "e*E - g*I_"},
        outputs={"y": "I_"},
        globally="b",
        locally="e g",
    ),
    Case(
        name="HIV, free virus and healthy cells seen",
        source="Xia and Moog, IEEE TAC 48 (2003)",
        rates={"T": "s - d*T - b*T*V", "I_": "b*T*V - m*I_", "V": "k*I_ - c*V"},
        outputs={"y1": "V", "y2": "T"},
        globally="s d b k",
        locally="m c",
    ),
    Case(
        name="Goodwin oscillator",
        source="Hong, Ovchinnikov, Pogudin and Yap, Bioinformatics 35 (2019), SIAN",
        rates={
            "x1": "-b*x1 + 1/(c + x4)",
            "x2": "a*x1 - B*x2",
            "x3": "g*x2 - d*x3",
            "x4": "s*x4*(g*x2 - d*x3)/x3",
        },
        outputs={"y": "x1"},
        locally="b c s B d",
        hidden="a g",
    ),
    Case(
        name="DC motor, speed seen",
        source="by hand: three coefficients of the transfer function",
        rates={"i": "(u - R*i - K*w)/L", "w": "(K*i - B*w)/J"},
        outputs={"y": "w"},
        inputs=("u",),
        hidden="R K L B J",
        together=("L*J/K", "(L*B + R*J)/K", "(R*B + K**2)/K"),
    ),
    Case(
        name="DC motor, speed and current seen",
        source="by hand",
        rates={"i": "(u - R*i - K*w)/L", "w": "(K*i - B*w)/J"},
        outputs={"y1": "w", "y2": "i"},
        inputs=("u",),
        globally="R K L B J",
    ),
    Case(
        name="Bolie, glucose and insulin",
        source="Villaverde, Barreiro and Papachristodoulou, PLoS Comput. Biol. 12 (2016), STRIKE-GOLDD",
        rates={"q1": "p1*q1 - p2*q2 + u", "q2": "p3*q2 + p4*q1"},
        outputs={"y": "q1/Vp"},
        inputs=("u",),
        globally="Vp p1 p3",
        hidden="p2 p4",
        together=("p2*p4",),
    ),
    Case(
        name="JAK-STAT",
        source="Raue et al., Bioinformatics 25 (2009)",
        rates={"x1": "-p1*u*x1", "x2": "p1*u*x1 - p2*x2**2", "x3": "p2*x2**2/2 - p3*x3", "x4": "p3*x3"},
        outputs={"y1": "s1*(x2 + 2*x3)", "y2": "s2*(x1 + x2 + 2*x3)"},
        inputs=("u",),
        globally="p1 p3",
        hidden="p2 s1 s2",
        together=("p2/s1", "s1/s2"),
    ),
    Case(
        name="two reactants",
        source="Vajda, Godfrey and Rabitz, Math. Biosci. 93 (1989)",
        rates={"x1": "-t1*x1**2 - t2*x1*x2 + u", "x2": "t3*x1**2 - t4*x1*x2"},
        outputs={"y": "x1"},
        inputs=("u",),
        globally="t1 t4",
        hidden="t2 t3",
        together=("t2*t3",),
    ),
    Case(
        name="Monod growth, biomass seen",
        source="Holmberg, Math. Biosci. 62 (1982)",
        rates={"X": "mu*S*X/(Ks + S) - kd*X", "S": "-mu*S*X/((Ks + S)*Y)"},
        outputs={"y": "X"},
        globally="mu kd",
        hidden="Ks Y",
        together=("Ks*Y",),
    ),
    Case(
        name="Monod growth, biomass seen, first substrate known",
        source="Holmberg, Math. Biosci. 62 (1982)",
        rates={"X": "mu*S*X/(Ks + S) - kd*X", "S": "-mu*S*X/((Ks + S)*Y)"},
        outputs={"y": "X"},
        locally="mu kd Ks Y",
        known_start=("S",),
    ),
    Case(
        name="minimal model of glucose",
        source="Cobelli and DiStefano, Am. J. Physiol. 239 (1980)",
        rates={"G": "-(p1 + X)*G + p1*Gb", "X": "-p2*X + p3*u"},
        outputs={"y": "G"},
        inputs=("u",),
        globally="p1 p2 p3 Gb",
    ),
    Case(
        name="pendulum with a motor",
        source="by hand",
        rates={"th": "w", "w": "-9.81/l*sin(th) - d*w + u/(m*l**2)"},
        outputs={"y": "th"},
        inputs=("u",),
        globally="l d m",
    ),
    Case(
        name="Arrhenius",
        source="by hand: a scale of the concentration and the rate constant",
        rates={"c": "-k*exp(-E/T)*c", "T": "u - h*k*exp(-E/T)*c"},
        outputs={"y": "T"},
        inputs=("u",),
        locally="k E",
        hidden="h",
    ),
    Case(
        name="dry friction beside a constant load",
        source="by hand: apart only because the record holds both directions",
        rates={"w": "(u - B*w - F*sign(w) - D)/J"},
        outputs={"y": "w"},
        inputs=("u",),
        locally="B F D J",
    ),
)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_known_answers(case: Case) -> None:
    found = identifiability(case.system(), case.free, known_start=case.known_start)
    extents = {name: answer.extent for name, answer in found.parameters.items()}
    due = dict.fromkeys(case.globally.split(), Extent.GLOBALLY)
    due |= dict.fromkeys(case.locally.split(), Extent.LOCALLY) | dict.fromkeys(case.hidden.split(), Extent.NOT)
    assert extents == due
    assert _same_functions(case, found)
    _check_scalings(found)


def _same_functions(case: Case, found: Identifiability) -> bool:
    """Whether the combinations found, with what is known alone, have the same level sets as those that are due."""
    names = {name: sp.Symbol(name, real=True) for name in case.free}
    alone = [names[n] for n in (*case.globally.split(), *case.locally.split())]
    due = [parse_formula(text, names) for text in case.together]
    both = [*alone, *due, *(c.expression for c in found.combinations)]
    at = {s: sp.Rational(7 + 4 * k, 5 + k) for k, s in enumerate(names.values())}
    rank = [sp.Matrix([[f.diff(s).subs(at) for s in at] for f in fs]).rank() for fs in (both, [*alone, *due])]
    return not due or (rank[0] == rank[1] and len(found.combinations) == len(due) and found.combinations_complete)


def _check_scalings(found: Identifiability) -> None:
    """Every scaling leaves the outputs' formulas and carries rates along, at a factor of 3."""
    system = found.system
    for scaling in found.scalings:
        change = {sp.Symbol(n, real=True): sp.Integer(3) ** e * sp.Symbol(n, real=True) for n, e in scaling.items()}
        for state, rate in zip(system.states, system.rates, strict=True):
            assert sp.simplify(rate.subs(change, simultaneous=True) - 3 ** scaling.get(state.name, 0) * rate) == 0
        for readout in system.readouts:
            assert sp.simplify(readout.subs(change, simultaneous=True) - readout) == 0
