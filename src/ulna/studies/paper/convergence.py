"""Does the exact loop converge, and how: the question of the paper's §6 and the claim of its §7, proved and checked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ulna.base import Verdict
from ulna.certify import GloballyStable, check, prove
from ulna.design import compensator
from ulna.loop import Loop
from ulna.report import Badge, Block, Table, Text, Tone
from ulna.studies.paper.exact import Exact
from ulna.studies.paper.runs import Loop as Ran


@dataclass(frozen=True, slots=True, kw_only=True)
class Convergence:
    """Of the exact law on the exact estimator.

    Attributes:
        proof: whether all runs converge. checked: the same by the second program, from the certificate.
        poles: at rest, in 1/s.
    """

    proof: Verdict
    checked: Verdict
    poles: tuple[complex, ...]

    @property
    def near(self) -> bool:
        """Whether it is exponential near the horizontal: all poles on the left."""
        return all(pole.real < 0 for pole in self.poles)


def convergence(exact: Exact, loops: Sequence[Ran]) -> Convergence:
    """The proof for the exact loop, checked."""
    proof = prove(Loop(plant=exact.plant, controller=compensator(exact.law, exact.observer)), GloballyStable())
    poles = next(loop.poles for loop in loops if loop.key == "compensator_exact")
    return Convergence(proof=proof, checked=check(proof.evidence["certificate"]), poles=poles)


def convergence_blocks(found: Convergence) -> tuple[Block, ...]:
    """What is proved of convergence and what is not, with the evidence."""
    evidence = found.proof.evidence
    slow, errors = evidence["decay_rates"]
    growth = "; ".join(f"{name} ≤ {bound}" for name, bound in evidence["growth"].items())
    everywhere = found.proof.holds and found.checked.holds
    slowest = max(pole.real for pole in found.poles)
    return (
        Text(
            text="Done exactly, law and estimator are a cascade: the errors of the estimate decay by themselves and "
            "disturb a linear chain. This is about the plant as written, without limits of the voltage."
        ),
        Table(
            head=("the exact compensator", "verdict", "evidence"),
            rows=(
                (
                    "every run converges, from any states and estimates",
                    _badge(everywhere, "proved"),
                    (
                        "Cascade theorem (Panteley and Loria 2001): without errors the chain decays at "
                        f"{slow:.3g} 1/s, the errors at {errors:.3g} 1/s, and they disturb at most in "
                        f"proportion to the chain: {growth}. A second program has checked the certificate."
                    ),
                ),
                (
                    "exponentially, near the horizontal",
                    _badge(found.near, "proved"),
                    f"Its poles; the slowest has the real part {slowest:.3g} 1/s.".replace("-", "−"),
                ),
                (
                    "exponentially from everywhere, with one factor and one rate",
                    Badge(text="not proved", tone=Tone.MILD),
                    (
                        "The slope by the third error grows with the state, so the factor of the proved bound grows "
                        "with the first error ε₀ of the estimate (v, ε: weighed sizes of chain and errors): "
                        f"{evidence['bound']}. "
                        "Whether a bound with one factor exists is open: “guarantees exponential convergence” says "
                        "more than is shown."
                    ),
                ),
            ),
        ),
    )


def _badge(holds: bool, word: str) -> Badge:
    return Badge(text=word if holds else f"not {word}", tone=Tone.GOOD if holds else Tone.BAD)
