"""`Kernel`: a function as one list of instructions, its transforms, and its lowerings; no computer algebra."""

from ulna.program.affine_inputs import solved_for_inputs
from ulna.program.arithmetic import AbstractArithmetic, Fused, Plain, Unwritten, in_arithmetic
from ulna.program.assembly import Assembly, chained
from ulna.program.bound import bound
from ulna.program.branches import REST, Branch, Branched, branches_of, with_branches
from ulna.program.condensed import condensed
from ulna.program.costly import COSTLY, costly_first
from ulna.program.edges import Edges, edges_of
from ulna.program.factored import factored
from ulna.program.fixed import Doubt, Format, IntegerProgram, UnboundedError, format_of, to_fixed
from ulna.program.flow_series import FlowSeries
from ulna.program.hoist import HOISTED, Hoisted, hoist
from ulna.program.identifiers import is_plain_name
from ulna.program.implicit import ImplicitKernel
from ulna.program.instructions import InstructionList, Operation, pruned
from ulna.program.instructions_from_casadi import kernel_from_casadi
from ulna.program.jet import explicit, lie_derivatives, open_derivatives
from ulna.program.kernel import Kernel, check_names, restricted, without_inputs
from ulna.program.linear_kernel import joined, solved
from ulna.program.lowering.ball_series import lowest, to_ball_series
from ulna.program.lowering.balls import BITS, balls_by_name, to_balls
from ulna.program.lowering.c import (
    C_FLAGS,
    c_header,
    c_literal,
    c_statements,
    integer_header,
    integer_literal,
    integer_statements,
    to_c,
)
from ulna.program.lowering.javascript import to_javascript, to_javascript_in_place
from ulna.program.lowering.numba import GPU_HEADER, HEADER, PYTHON, TEMPLATES, cache_folder, compiled, literal
from ulna.program.lowering.numpy import to_numpy
from ulna.program.lowering.python_source import to_python, to_python_source
from ulna.program.modes import GUARD, MODE, Moded, surfaces_of, with_modes
from ulna.program.precision import Precision
from ulna.program.scalar import Scalar
from ulna.program.sliding import CONTACT, SLOPE, Moving, add_up, sliding
from ulna.program.tangent import at_zero, slopes_along, tangents
from ulna.program.terms import Terms

__all__ = [
    "BITS",
    "CONTACT",
    "COSTLY",
    "C_FLAGS",
    "GPU_HEADER",
    "GUARD",
    "HEADER",
    "HOISTED",
    "MODE",
    "PYTHON",
    "REST",
    "SLOPE",
    "TEMPLATES",
    "AbstractArithmetic",
    "Assembly",
    "Branch",
    "Branched",
    "Doubt",
    "Edges",
    "FlowSeries",
    "Format",
    "Fused",
    "Hoisted",
    "ImplicitKernel",
    "InstructionList",
    "IntegerProgram",
    "Kernel",
    "Moded",
    "Moving",
    "Operation",
    "Plain",
    "Precision",
    "Scalar",
    "Terms",
    "UnboundedError",
    "Unwritten",
    "add_up",
    "at_zero",
    "balls_by_name",
    "bound",
    "branches_of",
    "c_header",
    "c_literal",
    "c_statements",
    "cache_folder",
    "chained",
    "check_names",
    "compiled",
    "condensed",
    "costly_first",
    "edges_of",
    "explicit",
    "factored",
    "format_of",
    "hoist",
    "in_arithmetic",
    "integer_header",
    "integer_literal",
    "integer_statements",
    "is_plain_name",
    "joined",
    "kernel_from_casadi",
    "lie_derivatives",
    "literal",
    "lowest",
    "open_derivatives",
    "pruned",
    "restricted",
    "sliding",
    "slopes_along",
    "solved",
    "solved_for_inputs",
    "surfaces_of",
    "tangents",
    "to_ball_series",
    "to_balls",
    "to_c",
    "to_fixed",
    "to_javascript",
    "to_javascript_in_place",
    "to_numpy",
    "to_python",
    "to_python_source",
    "with_branches",
    "with_modes",
    "without_inputs",
]
