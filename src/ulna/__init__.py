"""ulna: from a nonlinear plant written as equations to a proven output-feedback controller.

Public names live in packages of their own (`ulna.base`, `ulna.system`, ...) and are re-exported here. Nothing is
imported before it is used, so that `import ulna` costs next to nothing. To add a name: one line in `_HOME`, one import
in the block for type checkers; `tests/house/test_house_public_names.py` compares the two.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

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
    from ulna.campaign import quantiles as quantiles
    from ulna.campaign import replay as replay
    from ulna.campaign import sensitivity as sensitivity
    from ulna.campaign import settled_fraction as settled_fraction
    from ulna.campaign import worst_cases as worst_cases
    from ulna.design import AbstractGainRule as AbstractGainRule
    from ulna.design import Analysis as Analysis
    from ulna.design import Answer as Answer
    from ulna.design import Compensator as Compensator
    from ulna.design import Controller as Controller
    from ulna.design import HighGain as HighGain
    from ulna.design import KalmanNoise as KalmanNoise
    from ulna.design import Law as Law
    from ulna.design import LinearisingForm as LinearisingForm
    from ulna.design import LinearQuadratic as LinearQuadratic
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
    from ulna.design import flat_output as flat_output
    from ulna.design import high_gain_observer as high_gain_observer
    from ulna.design import injected_observer as injected_observer
    from ulna.design import input_output_form as input_output_form
    from ulna.design import normal_form as normal_form
    from ulna.design import observer_form as observer_form
    from ulna.design import state_feedback as state_feedback
    from ulna.design import state_linearisation as state_linearisation
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
    from ulna.loop import TIME as TIME
    from ulna.loop import Amplifier as Amplifier
    from ulna.loop import ConditionalIntegration as ConditionalIntegration
    from ulna.loop import EndStop as EndStop
    from ulna.loop import Euler as Euler
    from ulna.loop import ExactHold as ExactHold
    from ulna.loop import Guard as Guard
    from ulna.loop import Hardware as Hardware
    from ulna.loop import Jitter as Jitter
    from ulna.loop import Loop as Loop
    from ulna.loop import MeasurementNoise as MeasurementNoise
    from ulna.loop import MissedSamples as MissedSamples
    from ulna.loop import Pwm as Pwm
    from ulna.loop import Quantiser as Quantiser
    from ulna.loop import RungeKutta4 as RungeKutta4
    from ulna.loop import Saturation as Saturation
    from ulna.loop import SlewLimit as SlewLimit
    from ulna.plants import Model as Model
    from ulna.plants import model as model
    from ulna.plants import models as models
    from ulna.plot import plot_poles as plot_poles
    from ulna.plot import plot_trajectories as plot_trajectories
    from ulna.plot import plot_trajectory as plot_trajectory
    from ulna.plot import save_figure as save_figure
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
    from ulna.sim import Interpolated as Interpolated
    from ulna.sim import Metrics as Metrics
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
    from ulna.system import system_from_mapping as system_from_mapping
    from ulna.system import write_system as write_system

_HOME = {
    "AbstractGainRule": "ulna.design",
    "accessibility": "ulna.geometry",
    "accessible_decomposition": "ulna.geometry",
    "Amplifier": "ulna.loop",
    "analyse": "ulna.design",
    "Analysis": "ulna.design",
    "Answer": "ulna.design",
    "CampaignError": "ulna.campaign",
    "CampaignResult": "ulna.campaign",
    "Choice": "ulna.campaign",
    "close_loop": "ulna.design",
    "Compensator": "ulna.design",
    "compensator": "ulna.design",
    "ConditionalIntegration": "ulna.loop",
    "connect": "ulna.system",
    "control_affine": "ulna.system",
    "ControlAffine": "ulna.system",
    "Controller": "ulna.design",
    "controller_for": "ulna.design",
    "controller_form": "ulna.design",
    "Crossing": "ulna.sim",
    "Definition": "ulna.system",
    "DesignError": "ulna.base",
    "Diffeomorphism": "ulna.geometry",
    "Direction": "ulna.sim",
    "Distribution": "ulna.geometry",
    "distribution": "ulna.geometry",
    "dynamic_extension": "ulna.design",
    "Ends": "ulna.sim",
    "EndStop": "ulna.loop",
    "Ensemble": "ulna.sim",
    "equilibria": "ulna.system",
    "Equilibria": "ulna.system",
    "equilibrium": "ulna.system",
    "Equilibrium": "ulna.system",
    "Euler": "ulna.loop",
    "Event": "ulna.sim",
    "EventKind": "ulna.sim",
    "exact_observer": "ulna.design",
    "ExactHold": "ulna.loop",
    "extended_kalman_filter": "ulna.design",
    "Figures": "ulna.sim",
    "first_integrals": "ulna.geometry",
    "FixedSteps": "ulna.sim",
    "flat_output": "ulna.design",
    "FormulaError": "ulna.base",
    "from_control": "ulna.sim.python_control",
    "Fused": "ulna.program",
    "Gpu": "ulna.sim",
    "Grid": "ulna.campaign",
    "Guard": "ulna.loop",
    "Hardware": "ulna.loop",
    "Held": "ulna.sim",
    "high_gain_observer": "ulna.design",
    "HighGain": "ulna.design",
    "injected_observer": "ulna.design",
    "input_output_form": "ulna.design",
    "integrate": "ulna.geometry",
    "Interpolated": "ulna.sim",
    "involutive": "ulna.geometry",
    "Jitter": "ulna.loop",
    "KalmanNoise": "ulna.design",
    "LatinHypercube": "ulna.campaign",
    "Law": "ulna.design",
    "lie_bracket": "ulna.geometry",
    "lie_derivative": "ulna.geometry",
    "Linearisation": "ulna.system",
    "linearise": "ulna.system",
    "LinearisingForm": "ulna.design",
    "LinearQuadratic": "ulna.design",
    "LogUniform": "ulna.campaign",
    "Loop": "ulna.loop",
    "MeasurementNoise": "ulna.loop",
    "Measures": "ulna.campaign",
    "metrics": "ulna.sim",
    "Metrics": "ulna.sim",
    "MissedSamples": "ulna.loop",
    "Model": "ulna.plants",
    "model": "ulna.plants",
    "models": "ulna.plants",
    "NoFormError": "ulna.base",
    "Normal": "ulna.campaign",
    "normal_form": "ulna.design",
    "NotAffineError": "ulna.base",
    "observability": "ulna.geometry",
    "observable_decomposition": "ulna.geometry",
    "Observer": "ulna.design",
    "observer_form": "ulna.design",
    "ObserverForm": "ulna.design",
    "one_form": "ulna.geometry",
    "OneForm": "ulna.geometry",
    "open_campaign": "ulna.campaign",
    "OptionalDependencyError": "ulna.base",
    "Outcome": "ulna.sim",
    "Parameter": "ulna.system",
    "Paths": "ulna.sim",
    "Plain": "ulna.program",
    "PlantError": "ulna.base",
    "plot_poles": "ulna.plot",
    "plot_trajectories": "ulna.plot",
    "plot_trajectory": "ulna.plot",
    "Poles": "ulna.design",
    "Pwm": "ulna.loop",
    "quantiles": "ulna.campaign",
    "Quantiser": "ulna.loop",
    "Random": "ulna.campaign",
    "read_system": "ulna.system",
    "Regulate": "ulna.design",
    "relative_degree": "ulna.geometry",
    "replay": "ulna.campaign",
    "RungeKutta4": "ulna.loop",
    "Saltelli": "ulna.campaign",
    "Saturation": "ulna.loop",
    "save_figure": "ulna.plot",
    "sensitivity": "ulna.campaign",
    "SetPoint": "ulna.design",
    "settled_fraction": "ulna.campaign",
    "Settling": "ulna.sim",
    "Signal": "ulna.system",
    "simulate": "ulna.sim",
    "SimulationError": "ulna.base",
    "SlewLimit": "ulna.loop",
    "Sobol": "ulna.campaign",
    "state_feedback": "ulna.design",
    "state_linearisation": "ulna.design",
    "Status": "ulna.base",
    "System": "ulna.system",
    "system_from_mapping": "ulna.system",
    "Taylor": "ulna.sim",
    "TIME": "ulna.loop",
    "to_control": "ulna.sim.python_control",
    "Track": "ulna.design",
    "Trajectory": "ulna.sim",
    "transformed_observer_form": "ulna.design",
    "UlnaError": "ulna.base",
    "UlnaWarning": "ulna.base",
    "Uniform": "ulna.campaign",
    "UnitError": "ulna.base",
    "Verdict": "ulna.base",
    "worst_cases": "ulna.campaign",
    "write_system": "ulna.system",
    "zero_dynamics": "ulna.design",
}

__all__ = ["__version__", *_HOME]  # noqa: PLE0604 (the names are strings)  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    """Import the public name at its first use and keep it."""
    if name not in _HOME:
        raise AttributeError(f"module 'ulna' has no attribute {name!r}", name=name, obj=None)
    value = getattr(import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
