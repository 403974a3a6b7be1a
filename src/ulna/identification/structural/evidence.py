"""What rank, symmetries and input-output equations say together of each parameter, and how surely."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import sympy as sp

from ulna.base import Status, Verdict
from ulna.identification.structural.combinations import Combination, claim, rank_of_directions
from ulna.identification.structural.extent import Extent, ParameterAnswer
from ulna.identification.structural.input_output import InputOutput
from ulna.identification.structural.observed import Observed
from ulna.identification.structural.recovery import recovered
from ulna.symbolic.exact import generic_rank
from ulna.system import System


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """All that was found, and what it proves."""

    plant: System
    free: tuple[str, ...]
    seen: Observed
    scales: tuple[Mapping[str, int], ...]
    equations: InputOutput | None

    @property
    def symbols(self) -> list[sp.Symbol]:
        """(q,) the unknown parameters."""
        return [sp.Symbol(name, real=True) for name in self.free]

    @property
    def functions_known(self) -> int:
        """How many independent functions of the parameters the outputs tell."""
        return len(self.free) - rank_of_directions(self.seen.hidden)

    def symmetries(self) -> tuple[int, str]:
        """How many independent hidden directions are known exactly, and how."""
        sides = 1 if self.seen.smooth else (self.seen.unknowns - len(self.free)) // max(len(self.plant.states), 1)
        parts = sp.Matrix([[scale.get(name, 0) for name in self.free] for scale in self.scales] or [[0]])
        moving = parts.rank()
        by_scaling = moving + sides * (len(self.scales) - moving)
        by_equation = 0
        if self.equations is not None and self.equations.complete:
            slopes = sp.Matrix([[f.diff(s) for s in self.symbols] for f in self.equations.functions] or [[0]])
            rank = generic_rank(slopes)
            by_equation = len(self.free) - rank.value if rank.verdict.status is Status.PROVED else 0
        if by_equation > by_scaling:
            return by_equation, "input-output equations"
        return by_scaling, "scalings"

    def answers(self) -> dict[str, ParameterAnswer]:
        """The answer for each parameter; the motions come later."""
        count, method = self.symmetries()
        seen = self.seen
        proved = seen.rank + count == seen.unknowns
        evidence = {"rank": seen.rank, "unknowns": seen.unknowns} | ({"symmetries": method} if count and proved else {})
        globally = self._globally()
        found = {}
        for j, name in enumerate(self.free):
            moving = [dict(scale) for scale in self.scales if scale.get(name)]
            if moving or seen.moved(j):
                said = f"{name} cannot be known from the outputs"
                by = evidence | ({"scaling": moving[0]} if moving else {})
                sure = moving or (proved and method != "scalings")
                verdict = Verdict.proved(said, **by) if sure else self._supported(said, by)
                extent = Extent.NOT if verdict.holds else Extent.UNDECIDED
            elif name in globally:
                extent, verdict = Extent.GLOBALLY, globally[name]
            else:
                said = f"near its value no other {name} gives the same outputs"
                exact = proved and (method == "scalings" or not count)
                verdict = Verdict.proved(said, **evidence) if exact else self._supported(said, evidence)
                extent = Extent.LOCALLY if verdict.holds else Extent.UNDECIDED
            found[name] = ParameterAnswer(extent=extent, verdict=verdict, without_input=False, needs=None)
        return found

    def _supported(self, said: str, evidence: Mapping[str, object]) -> Verdict:
        if self.seen.verdict.holds:
            return Verdict.supported(said, **evidence, points=1)
        return Verdict.undecided(said, **evidence, tried=self.seen.verdict.evidence.get("tried"))

    def _globally(self) -> dict[str, Verdict]:
        if self.equations is None or not self.equations.one_record.holds:
            return {}
        positive = frozenset(p.name for p in self.plant.parameters if p.lower is not None and p.lower >= 0)
        return recovered(self.equations.functions, self.symbols, positive)

    def offered(self) -> list[Combination]:
        """Functions from the input-output equations, without their numbers in front."""
        if self.equations is None or not self.equations.one_record.holds:
            return []
        return [
            self.judged(Combination(expression=_bare(f), verdict=self.equations.one_record))
            for f in self.equations.functions
        ]

    def judged(self, one: Combination) -> Combination:
        """The combination with the surest verdict that it has."""
        said = claim(one.expression)
        shown = self.equations.functions if self.equations is not None and self.equations.one_record.holds else ()
        if any(_bare(f) == _bare(one.expression) for f in shown):
            return replace(one, verdict=Verdict.proved(said, method="input-output equations"))
        count, method = self.symmetries()
        if method == "scalings" and count + self.seen.rank == self.seen.unknowns and self._unscaled(one.expression):
            return replace(one, verdict=Verdict.proved(said, method="all that is hidden are scalings"))
        return replace(one, verdict=one.verdict.restated(said)) if one.verdict.claim != said else one

    def _unscaled(self, monomial: sp.Expr) -> bool:
        """Whether no scaling changes a monomial."""
        powers = monomial.as_powers_dict()
        if any(base not in self.symbols for base in powers):
            return False
        return all(sum(scale.get(base.name, 0) * e for base, e in powers.items()) == 0 for scale in self.scales)


def _bare(function: sp.Expr) -> sp.Expr:
    return function.as_coeff_Mul()[1]
