"""Lie derivatives, distributions, one-forms and their integration, changes of coordinates, structure of plants."""

from ulna.geometry.brackets import Accessibility, accessibility
from ulna.geometry.coordinates import Diffeomorphism, diffeomorphism, new_symbols
from ulna.geometry.decomposition import (
    Decomposition,
    accessible,
    accessible_decomposition,
    observable_decomposition,
)
from ulna.geometry.decoupling import RelativeDegree, relative_degree, relative_degree_of
from ulna.geometry.distributions import (
    Distribution,
    annihilator,
    distribution,
    filtration,
    involutive,
    involutive_closure,
)
from ulna.geometry.flow_series import FlowAtPoint
from ulna.geometry.integrate_form import Potential, exact_potential, integrate
from ulna.geometry.leaves import FirstIntegrals, first_integrals
from ulna.geometry.lie import (
    bracket_name,
    iterated_bracket,
    iterated_brackets,
    lie_bracket,
    lie_derivative,
    lie_derivative_of_covector,
)
from ulna.geometry.numeric import NumericRank, NumericStructure, degrees_in_numbers, numeric_structure
from ulna.geometry.observables import ObservationSpace, observation_space
from ulna.geometry.observation import Observability, differentials, observability
from ulna.geometry.oneform import OneForm, closed, exterior_derivative, frobenius, one_form
from ulna.geometry.plant_in_numbers import structure_in_numbers

__all__ = [
    "Accessibility",
    "Decomposition",
    "Diffeomorphism",
    "Distribution",
    "FirstIntegrals",
    "FlowAtPoint",
    "NumericRank",
    "NumericStructure",
    "Observability",
    "ObservationSpace",
    "OneForm",
    "Potential",
    "RelativeDegree",
    "accessibility",
    "accessible",
    "accessible_decomposition",
    "annihilator",
    "bracket_name",
    "closed",
    "degrees_in_numbers",
    "diffeomorphism",
    "differentials",
    "distribution",
    "exact_potential",
    "exterior_derivative",
    "filtration",
    "first_integrals",
    "frobenius",
    "integrate",
    "involutive",
    "involutive_closure",
    "iterated_bracket",
    "iterated_brackets",
    "lie_bracket",
    "lie_derivative",
    "lie_derivative_of_covector",
    "new_symbols",
    "numeric_structure",
    "observability",
    "observable_decomposition",
    "observation_space",
    "one_form",
    "relative_degree",
    "relative_degree_of",
    "structure_in_numbers",
]
