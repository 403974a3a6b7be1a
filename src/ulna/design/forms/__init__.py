"""Controller form, input-output form and what decides whether they exist: linearisability, extension, flatness."""

from ulna.design.forms.approximate import approximate_form
from ulna.design.forms.extension import DynamicExtension, dynamic_extension
from ulna.design.forms.flatness import flat_output
from ulna.design.forms.full_linearisation import controller_form
from ulna.design.forms.input_output import input_output_form
from ulna.design.forms.law_kernel import compiled_law
from ulna.design.forms.linear_coordinates import StateLinearisation, state_linearisation
from ulna.design.forms.linearisability_conditions import Linearisability, linearisability
from ulna.design.forms.linearising_form import LinearisingForm
from ulna.design.forms.normal_coordinates import NormalForm, normal_form
from ulna.design.forms.output_search import LinearisingOutputs, last_row, linearising_outputs
