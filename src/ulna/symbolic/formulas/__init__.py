"""Formulas as text: parsing without running anything, printing for people, LaTeX."""

from ulna.symbolic.formulas.decimals import DIGITS, decimal_text
from ulna.symbolic.formulas.latex import equation_latex, expression_latex, system_latex
from ulna.symbolic.formulas.parse import RESERVED, check_power, is_elementary, parse_formula, without_value
from ulna.symbolic.formulas.text import exact, excerpt, formula, is_longer, listing
from ulna.symbolic.formulas.values import put_in

__all__ = [
    "DIGITS",
    "RESERVED",
    "check_power",
    "decimal_text",
    "equation_latex",
    "exact",
    "excerpt",
    "expression_latex",
    "formula",
    "is_elementary",
    "is_longer",
    "listing",
    "parse_formula",
    "put_in",
    "system_latex",
    "without_value",
]
