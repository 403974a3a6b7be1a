"""Formulas as text: parsing without running anything, printing for people, LaTeX."""

from ulna.symbolic.formulas.decimals import DIGITS, decimal_text, exact_text
from ulna.symbolic.formulas.latex import (
    display_html,
    equation_latex,
    equations_latex,
    expression_latex,
    formula_html,
    name_latex,
    value_html,
)
from ulna.symbolic.formulas.parse import RESERVED, check_power, is_elementary, parse_formula, without_value
from ulna.symbolic.formulas.text import exact, excerpt, formula, is_longer, listing
from ulna.symbolic.formulas.values import put_in

__all__ = [
    "DIGITS",
    "RESERVED",
    "check_power",
    "decimal_text",
    "display_html",
    "equation_latex",
    "equations_latex",
    "exact",
    "exact_text",
    "excerpt",
    "expression_latex",
    "formula",
    "formula_html",
    "is_elementary",
    "is_longer",
    "listing",
    "name_latex",
    "parse_formula",
    "put_in",
    "value_html",
    "without_value",
]
