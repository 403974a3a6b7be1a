"""One-forms integrated: the candidates that a search tries, each to be differentiated back by whoever takes it."""

from ulna.symbolic.integration.circular_substitution import antiderivative_by_substitution
from ulna.symbolic.integration.form_search import FormSearch
from ulna.symbolic.integration.integrating_factor import exponential, pivot_of
from ulna.symbolic.integration.leaf_search import LeafSearch, along, independent
from ulna.symbolic.integration.potential import antiderivative, antiderivative_by_rules, potential_in_span, potentials

__all__ = [
    "FormSearch",
    "LeafSearch",
    "along",
    "antiderivative",
    "antiderivative_by_rules",
    "antiderivative_by_substitution",
    "exponential",
    "independent",
    "pivot_of",
    "potential_in_span",
    "potentials",
]
