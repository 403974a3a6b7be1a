"""The linearising law of a large plant as a compiled program: Lie derivatives by jets, no formula ever written."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp

from ulna.base import NoFormError, Verdict
from ulna.geometry import degrees_in_numbers
from ulna.program import (
    Kernel,
    at_zero,
    joined,
    lie_derivatives,
    open_derivatives,
    restricted,
    solved,
    solved_for_inputs,
    tangents,
    to_numpy,
    without_inputs,
)
from ulna.system import System, SystemKernel, system_kernel

SEED = 20140
POINTS = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class CompiledLaw:
    """u = β⁻¹ (v − α) as a kernel.

    Attributes:
        system: the plant; indices: (m,) relative degrees of the outputs.
        law: kernel with inputs the states and v1, v2, … (v_1, v_2, … where the plant has such names), outputs the
            plant's inputs.
        lie: kernel of α (outputs `h1:r`, …) and β (outputs `h1:r/u1`, …) in the states.
        verdict: on the relative degrees and β, from random points.
    """

    system: System
    indices: tuple[int, ...]
    law: Kernel
    lie: Kernel
    verdict: Verdict


def compiled_law(system: System, outputs: Sequence[sp.Expr] | None = None) -> CompiledLaw:
    """The input-output linearising law of a square plant, compiled.

    The k-th Lie derivative is k! times a Taylor coefficient of the output along the flow; the decoupling matrix is its
    slope in the inputs. Relative degrees and its rank are judged at random points in balls, pivots in doubles.

    Args:
        system: as many outputs as inputs; parameters need values.
        outputs: (m,) functions of the state instead of the plant's outputs.

    Raises:
        NoFormError: if the plant is not square, an input never reaches an output, or β is singular.
        UlnaError: for a plant with non-smooth functions.
    """
    field = system_kernel(system, outputs)
    m = len(field.inputs)
    asked = f"a compiled law for '{system.name}'"
    if len(field.functions) != m or not m:
        raise NoFormError(asked, f"{len(field.functions)} outputs, {m} inputs.", "Give as many outputs as inputs.")
    indices, degree, decoupling = degrees_in_numbers(field)
    if not degree.holds:
        found = f"its relative degrees are undecided: {degree.evidence.get('tried', '')}."
        raise NoFormError(asked, found, "Scale the states, or choose other outputs.", value=degree)
    if any(r is None for r in indices):
        which = ", ".join(f"number {k + 1}" for k, r in enumerate(indices) if r is None)
        raise NoFormError(asked, f"no input reaches output {which}.", "Choose other outputs.", value=degree)
    if decoupling is None or decoupling.value != m:
        value = Verdict.refuted(
            "the decoupling matrix is invertible", **(decoupling.verdict.evidence if decoupling else {})
        )
        found = f"its decoupling matrix has rank {decoupling and decoupling.value} instead of {m} at random points."
        raise NoFormError(asked, found, "Try `dynamic_extension`." if m > 1 else "", value=value)
    degrees = tuple(r for r in indices if r is not None)
    tops = [f"{h}:{r}" for h, r in zip(field.functions, degrees, strict=True)]
    derivatives = lie_derivatives(field.source, field.states, field.rates, max(degrees))
    top = restricted(derivatives, tops)
    slopes = at_zero(tangents(top, field.inputs), field.inputs)
    new = _new_inputs(field)
    lie = joined("Lie derivatives", [at_zero(top, field.inputs), slopes], new)
    matrix = [[f"{label}/{u}" for u in field.inputs] for label in tops]
    samples = _sampled(restricted(lie, [e for row in matrix for e in row]), field, POINTS).reshape(POINTS, m, m)
    name, wanted = f"law of {system.name}", list(zip(new, tops, strict=True))
    law = _prescribed(name, field, degrees, wanted)
    if law is None:
        law = without_inputs(solved(name, lie, matrix, wanted, field.inputs, samples), field.inputs)
    lie = without_inputs(lie, (*field.inputs, *new))
    return CompiledLaw(system=system, indices=degrees, law=law, lie=lie, verdict=degree)


def _new_inputs(field: SystemKernel) -> tuple[str, ...]:
    stem = "v"
    while {f"{stem}{k + 1}" for k in range(len(field.inputs))} & set(field.kernel.inputs):
        stem += "_"
    return tuple(f"{stem}{k + 1}" for k in range(len(field.inputs)))


def _prescribed(
    name: str, field: SystemKernel, degrees: Sequence[int], wanted: Sequence[tuple[str, str]]
) -> Kernel | None:
    """The inputs that give the derivatives wanted; None if what lies between is not written affinely in them.

    Accelerations that the inputs move follow from these derivatives: no equation is solved for them.
    """
    tops = list(zip(field.functions, degrees, strict=True))
    program = open_derivatives(field.source, field.states, field.rates, tops, field.inputs)
    inputs = program.kernel.inputs
    generic = dict(zip(inputs, np.random.default_rng(SEED).uniform(0.2, 1.2, len(inputs)).tolist(), strict=True))
    here = generic | {name: float(value) for name, value in field.point}
    equations = [*wanted, *((None, label) for label in program.residuals)]
    samples = [[point[label] for label in inputs] for point in (generic, here)]
    law = solved_for_inputs(name, program.kernel, (*field.inputs, *program.coefficients), equations, samples)
    return None if law is None else restricted(law, field.inputs)


def _sampled(program: Kernel, field: SystemKernel, points: int) -> np.ndarray:
    """(points, outputs) values at random states with the inputs at random values too; v at zero."""
    generator = np.random.default_rng(SEED)
    known = {*field.states, *field.inputs}
    columns = [generator.uniform(0.2, 1.2, points) if name in known else np.zeros(points) for name in program.inputs]
    return np.stack(to_numpy(program)(*columns), axis=1)
