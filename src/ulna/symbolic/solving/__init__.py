"""Equations solved: roots, inverse maps and their branches, level sets, where eigenvalues lie, Taylor series."""

from ulna.symbolic.solving.affine import solve_affine
from ulna.symbolic.solving.box_search import BoxZeros, nowhere_zero, zeros_in_box
from ulna.symbolic.solving.branch import defined_near, on_branch
from ulna.symbolic.solving.invert import Inversion, invert_map
from ulna.symbolic.solving.level_set import graph_near
from ulna.symbolic.solving.removable import limit_at, without_holes
from ulna.symbolic.solving.root_location import RootLocation, eigenvalue_location
from ulna.symbolic.solving.roots import eliminate, solutions, solutions_in_time
from ulna.symbolic.solving.taylor import taylor_coefficients

__all__ = [
    "BoxZeros",
    "Inversion",
    "RootLocation",
    "defined_near",
    "eigenvalue_location",
    "eliminate",
    "graph_near",
    "invert_map",
    "limit_at",
    "nowhere_zero",
    "on_branch",
    "solutions",
    "solutions_in_time",
    "solve_affine",
    "taylor_coefficients",
    "without_holes",
    "zeros_in_box",
]
