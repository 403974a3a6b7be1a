"""Plants: forearms, drives and their presets, and the textbook catalogue, each a data file with its sources."""

from ulna.models.anthropometry import (
    BodySegments,
    RangeOfMotion,
    anthropometric_forearm,
    body_segments,
    range_of_motion,
    require_within,
)
from ulna.models.arm import Brake, Forearm, Friction, SelfLocking, measured_forearm, rod
from ulna.models.battery import Battery, voltage_range
from ulna.models.catalogue import Model, PlantLike, as_plant, model, models
from ulna.models.drive import BackDriven
from ulna.models.driven_arm import DrivenArm, arm_with_drive, driven_arm, with_meters
from ulna.models.load_estimate import LoadEstimate, load_estimate
from ulna.models.presets import Limits, Preset, preset, preset_from_mapping, presets
from ulna.models.statics import Hold, TorqueMargin, hold, no_load_speed, require_liftable, torque_margin
from ulna.models.thermal import Heating, steady_rise, thermal_current

__all__ = [
    "BackDriven",
    "Battery",
    "BodySegments",
    "Brake",
    "DrivenArm",
    "Forearm",
    "Friction",
    "Heating",
    "Hold",
    "Limits",
    "LoadEstimate",
    "Model",
    "PlantLike",
    "Preset",
    "RangeOfMotion",
    "SelfLocking",
    "TorqueMargin",
    "anthropometric_forearm",
    "arm_with_drive",
    "as_plant",
    "body_segments",
    "driven_arm",
    "hold",
    "load_estimate",
    "measured_forearm",
    "model",
    "models",
    "no_load_speed",
    "preset",
    "preset_from_mapping",
    "presets",
    "range_of_motion",
    "require_liftable",
    "require_within",
    "rod",
    "steady_rise",
    "thermal_current",
    "torque_margin",
    "voltage_range",
    "with_meters",
]
