"""Lie derivatives, distributions, one-forms and their integration, changes of coordinates, structure of plants."""

from ulna.geometry.accessibility import Accessibility, accessibility
from ulna.geometry.decomposition import Decomposition, accessible_decomposition, observable_decomposition
from ulna.geometry.diffeomorphism import Diffeomorphism, diffeomorphism
from ulna.geometry.distribution import Distribution, annihilator, distribution, involutive, involutive_closure
from ulna.geometry.frobenius import FirstIntegrals, first_integrals
from ulna.geometry.integrate_form import Potential, integrate
from ulna.geometry.lie import iterated_brackets, lie_bracket, lie_derivative, lie_derivative_of_covector
from ulna.geometry.observability import Observability, observability
from ulna.geometry.oneform import OneForm, closed, exterior_derivative, frobenius, one_form
from ulna.geometry.relative_degree import RelativeDegree, relative_degree

__all__ = [
    "Accessibility",
    "Decomposition",
    "Diffeomorphism",
    "Distribution",
    "FirstIntegrals",
    "Observability",
    "OneForm",
    "Potential",
    "RelativeDegree",
    "accessibility",
    "accessible_decomposition",
    "annihilator",
    "closed",
    "diffeomorphism",
    "distribution",
    "exterior_derivative",
    "first_integrals",
    "frobenius",
    "integrate",
    "involutive",
    "involutive_closure",
    "iterated_brackets",
    "lie_bracket",
    "lie_derivative",
    "lie_derivative_of_covector",
    "observability",
    "observable_decomposition",
    "one_form",
    "relative_degree",
]
