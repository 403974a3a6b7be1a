"""ulna: from a nonlinear plant written as equations to a proven output-feedback controller.

Public names live in packages of their own (`ulna.base`, `ulna.system`, ...) and are re-exported here. Nothing is
imported before it is used, so that `import ulna` costs next to nothing. To add a name: one word in `_HOME`, one import
in the block for type checkers; `tests/house/test_house_public_names.py` compares the two.
"""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

__version__ = "0.2.0"

if TYPE_CHECKING:
    from ulna.base import DesignError as DesignError
    from ulna.base import FormulaError as FormulaError
    from ulna.base import NoFormError as NoFormError
    from ulna.base import NotAffineError as NotAffineError
    from ulna.base import OptionalDependencyError as OptionalDependencyError
    from ulna.base import PlantError as PlantError
    from ulna.base import SimulationError as SimulationError
    from ulna.base import Status as Status
    from ulna.base import UlnaError as UlnaError
    from ulna.base import UlnaWarning as UlnaWarning
    from ulna.base import UnitError as UnitError
    from ulna.base import Verdict as Verdict
    from ulna.campaign import CampaignError as CampaignError
    from ulna.campaign import CampaignResult as CampaignResult
    from ulna.campaign import Choice as Choice
    from ulna.campaign import Grid as Grid
    from ulna.campaign import LatinHypercube as LatinHypercube
    from ulna.campaign import LogUniform as LogUniform
    from ulna.campaign import Measures as Measures
    from ulna.campaign import Normal as Normal
    from ulna.campaign import Random as Random
    from ulna.campaign import Saltelli as Saltelli
    from ulna.campaign import Sobol as Sobol
    from ulna.campaign import Uniform as Uniform
    from ulna.campaign import open_campaign as open_campaign
    from ulna.campaign import posterior as posterior
    from ulna.campaign import quantiles as quantiles
    from ulna.campaign import replay as replay
    from ulna.campaign import sensitivity as sensitivity
    from ulna.campaign import settled_fraction as settled_fraction
    from ulna.campaign import sweep as sweep
    from ulna.campaign import worst_cases as worst_cases
    from ulna.certify import GloballyStable as GloballyStable
    from ulna.certify import Over as Over
    from ulna.certify import Region as Region
    from ulna.certify import StableWithin as StableWithin
    from ulna.certify import UltimateBound as UltimateBound
    from ulna.certify import prove as prove
    from ulna.design import AbstractGainRule as AbstractGainRule
    from ulna.design import Analysis as Analysis
    from ulna.design import Answer as Answer
    from ulna.design import Bandwidth as Bandwidth
    from ulna.design import Compensator as Compensator
    from ulna.design import Controller as Controller
    from ulna.design import HighGain as HighGain
    from ulna.design import KalmanNoise as KalmanNoise
    from ulna.design import Law as Law
    from ulna.design import LinearisingForm as LinearisingForm
    from ulna.design import LinearQuadratic as LinearQuadratic
    from ulna.design import Method as Method
    from ulna.design import Observer as Observer
    from ulna.design import ObserverForm as ObserverForm
    from ulna.design import Poles as Poles
    from ulna.design import Regulate as Regulate
    from ulna.design import SetPoint as SetPoint
    from ulna.design import Track as Track
    from ulna.design import analyse as analyse
    from ulna.design import close_loop as close_loop
    from ulna.design import compensator as compensator
    from ulna.design import controller_for as controller_for
    from ulna.design import controller_form as controller_form
    from ulna.design import dynamic_extension as dynamic_extension
    from ulna.design import exact_observer as exact_observer
    from ulna.design import extended_kalman_filter as extended_kalman_filter
    from ulna.design import extended_law as extended_law
    from ulna.design import flat_output as flat_output
    from ulna.design import gain_schedule as gain_schedule
    from ulna.design import high_gain_observer as high_gain_observer
    from ulna.design import injected_observer as injected_observer
    from ulna.design import input_output_form as input_output_form
    from ulna.design import local_law as local_law
    from ulna.design import local_observer as local_observer
    from ulna.design import normal_form as normal_form
    from ulna.design import observer_form as observer_form
    from ulna.design import recursive_estimator as recursive_estimator
    from ulna.design import state_feedback as state_feedback
    from ulna.design import state_linearisation as state_linearisation
    from ulna.design import swing_up as swing_up
    from ulna.design import transformed_observer_form as transformed_observer_form
    from ulna.design import zero_dynamics as zero_dynamics
    from ulna.geometry import Diffeomorphism as Diffeomorphism
    from ulna.geometry import Distribution as Distribution
    from ulna.geometry import OneForm as OneForm
    from ulna.geometry import accessibility as accessibility
    from ulna.geometry import accessible_decomposition as accessible_decomposition
    from ulna.geometry import distribution as distribution
    from ulna.geometry import first_integrals as first_integrals
    from ulna.geometry import integrate as integrate
    from ulna.geometry import involutive as involutive
    from ulna.geometry import lie_bracket as lie_bracket
    from ulna.geometry import lie_derivative as lie_derivative
    from ulna.geometry import observability as observability
    from ulna.geometry import observable_decomposition as observable_decomposition
    from ulna.geometry import one_form as one_form
    from ulna.geometry import relative_degree as relative_degree
    from ulna.identification import Excitation as Excitation
    from ulna.identification import Fit as Fit
    from ulna.identification import GlobalStart as GlobalStart
    from ulna.identification import Identifiability as Identifiability
    from ulna.identification import IdentificationError as IdentificationError
    from ulna.identification import MultipleShooting as MultipleShooting
    from ulna.identification import Record as Record
    from ulna.identification import Robust as Robust
    from ulna.identification import excite as excite
    from ulna.identification import identifiability as identifiability
    from ulna.identification import identify as identify
    from ulna.identification import read_record as read_record
    from ulna.identification import sensitivities as sensitivities
    from ulna.loop import TIME as TIME
    from ulna.loop import Amplifier as Amplifier
    from ulna.loop import ConditionalIntegration as ConditionalIntegration
    from ulna.loop import Deadline as Deadline
    from ulna.loop import EndStop as EndStop
    from ulna.loop import Euler as Euler
    from ulna.loop import ExactHold as ExactHold
    from ulna.loop import Fault as Fault
    from ulna.loop import Guard as Guard
    from ulna.loop import Hardware as Hardware
    from ulna.loop import Hold as Hold
    from ulna.loop import InnovationLimit as InnovationLimit
    from ulna.loop import Jitter as Jitter
    from ulna.loop import Loop as Loop
    from ulna.loop import MeasurementNoise as MeasurementNoise
    from ulna.loop import MissedSamples as MissedSamples
    from ulna.loop import Pwm as Pwm
    from ulna.loop import Quantiser as Quantiser
    from ulna.loop import ReferenceRange as ReferenceRange
    from ulna.loop import Report as Report
    from ulna.loop import RungeKutta4 as RungeKutta4
    from ulna.loop import SafeOutput as SafeOutput
    from ulna.loop import Saturation as Saturation
    from ulna.loop import SlewLimit as SlewLimit
    from ulna.page import fit_page as fit_page
    from ulna.page import report_page as report_page
    from ulna.page import studio as studio
    from ulna.plants import Model as Model
    from ulna.plants import model as model
    from ulna.plants import models as models
    from ulna.plot import bode as bode
    from ulna.plot import plot_phase as plot_phase
    from ulna.plot import plot_poles as plot_poles
    from ulna.plot import plot_region as plot_region
    from ulna.plot import plot_trajectories as plot_trajectories
    from ulna.plot import plot_trajectory as plot_trajectory
    from ulna.plot import save_figure as save_figure
    from ulna.plot import step_response as step_response
    from ulna.program import Fused as Fused
    from ulna.program import Plain as Plain
    from ulna.sim import Crossing as Crossing
    from ulna.sim import Direction as Direction
    from ulna.sim import Ends as Ends
    from ulna.sim import Ensemble as Ensemble
    from ulna.sim import Event as Event
    from ulna.sim import EventKind as EventKind
    from ulna.sim import Figures as Figures
    from ulna.sim import FixedSteps as FixedSteps
    from ulna.sim import Gpu as Gpu
    from ulna.sim import Held as Held
    from ulna.sim import Implicit as Implicit
    from ulna.sim import Interpolated as Interpolated
    from ulna.sim import Metrics as Metrics
    from ulna.sim import Mode as Mode
    from ulna.sim import Outcome as Outcome
    from ulna.sim import Paths as Paths
    from ulna.sim import Settling as Settling
    from ulna.sim import Taylor as Taylor
    from ulna.sim import Trajectory as Trajectory
    from ulna.sim import metrics as metrics
    from ulna.sim import simulate as simulate
    from ulna.sim.python_control import from_control as from_control
    from ulna.sim.python_control import to_control as to_control
    from ulna.system import ControlAffine as ControlAffine
    from ulna.system import Definition as Definition
    from ulna.system import Equilibria as Equilibria
    from ulna.system import Equilibrium as Equilibrium
    from ulna.system import InputSubstitution as InputSubstitution
    from ulna.system import Linearisation as Linearisation
    from ulna.system import Parameter as Parameter
    from ulna.system import Signal as Signal
    from ulna.system import System as System
    from ulna.system import connect as connect
    from ulna.system import control_affine as control_affine
    from ulna.system import equilibria as equilibria
    from ulna.system import equilibrium as equilibrium
    from ulna.system import linearise as linearise
    from ulna.system import read_system as read_system
    from ulna.system import substitute_input as substitute_input
    from ulna.system import system_from_mapping as system_from_mapping
    from ulna.system import with_uses as with_uses
    from ulna.system import write_system as write_system

_HOME = {
    name: package
    for package, names in {
        "ulna.base": """
            DesignError FormulaError NoFormError NotAffineError OptionalDependencyError PlantError SimulationError
            Status UlnaError UlnaWarning UnitError Verdict""",
        "ulna.campaign": """
            CampaignError CampaignResult Choice Grid LatinHypercube LogUniform Measures Normal open_campaign
            posterior quantiles Random replay Saltelli sensitivity settled_fraction Sobol sweep Uniform worst_cases""",
        "ulna.certify": "GloballyStable Over prove Region StableWithin UltimateBound",
        "ulna.design": """
            AbstractGainRule analyse Analysis Answer Bandwidth close_loop Compensator compensator Controller
            controller_for controller_form dynamic_extension exact_observer extended_kalman_filter extended_law
            flat_output gain_schedule high_gain_observer HighGain injected_observer input_output_form KalmanNoise Law
            LinearisingForm LinearQuadratic local_law local_observer Method normal_form Observer observer_form
            ObserverForm Poles recursive_estimator Regulate SetPoint state_feedback state_linearisation swing_up Track
            transformed_observer_form zero_dynamics""",
        "ulna.geometry": """
            accessibility accessible_decomposition Diffeomorphism Distribution distribution first_integrals
            integrate involutive lie_bracket lie_derivative observability observable_decomposition one_form
            OneForm relative_degree""",
        "ulna.identification": """
            Excitation excite Fit GlobalStart Identifiability identifiability IdentificationError identify
            MultipleShooting read_record Record Robust sensitivities""",
        "ulna.loop": """
            Amplifier ConditionalIntegration Deadline EndStop Euler ExactHold Fault Guard Hardware Hold
            InnovationLimit Jitter Loop MeasurementNoise MissedSamples Pwm Quantiser ReferenceRange Report RungeKutta4
            SafeOutput Saturation SlewLimit TIME""",
        "ulna.page": "fit_page report_page studio",
        "ulna.plants": "Model model models",
        "ulna.plot": """
            bode plot_phase plot_poles plot_region plot_trajectories plot_trajectory save_figure step_response
        """,
        "ulna.program": "Fused Plain",
        "ulna.sim": """
            Crossing Direction Ends Ensemble Event EventKind Figures FixedSteps Gpu Held Implicit Interpolated
            metrics Metrics Mode Outcome Paths Settling simulate Taylor Trajectory""",
        "ulna.sim.python_control": "from_control to_control",
        "ulna.system": """
            connect control_affine ControlAffine Definition equilibria Equilibria equilibrium Equilibrium
            InputSubstitution Linearisation linearise Parameter read_system Signal substitute_input System
            system_from_mapping with_uses write_system""",
    }.items()
    for name in names.split()
}
"""The package of each name."""

__all__ = ["__version__", *_HOME]  # noqa: PLE0604 (the names are strings)  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    """Import the public name, or the package of ulna, at its first use and keep it."""
    if name not in _HOME and not name.startswith("_") and find_spec(f"ulna.{name}") is not None:
        return import_module(f"ulna.{name}")
    if name not in _HOME:
        raise AttributeError(f"module 'ulna' has no attribute {name!r}", name=name, obj=None)
    value = getattr(import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
