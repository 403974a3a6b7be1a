"""Plants: forearms, drives and their presets, and the textbook catalogue, each a data file with its sources."""

from ulna.plants.anthropometry import (
    BodySegments,
    RangeOfMotion,
    anthropometric_forearm,
    body_segments,
    range_of_motion,
)
from ulna.plants.arm import Brake, Forearm, SelfLocking, measured_forearm, rod
from ulna.plants.arm_and_drive import DrivenArm, arm_with_drive, driven_arm, with_meters
from ulna.plants.battery import Battery, battery_system, voltage_range
from ulna.plants.catalogue import Model, PlantLike, as_plant, model, models, plant_text
from ulna.plants.drive import BackDriven
from ulna.plants.drive_preset import Limits, Preset, preset, preset_from_mapping, presets
from ulna.plants.flexible_arm import flexible_joint_arm
from ulna.plants.friction import Friction, LuGre
from ulna.plants.load import LoadEstimate, load_estimate
from ulna.plants.oscillation import SmallOscillation, SmallOscillations, small_oscillation, small_oscillations
from ulna.plants.statics import Hold, TorqueMargin, hold, no_load_speed, require_liftable, torque_margin
from ulna.plants.thermal import Heating, steady_rise, thermal_current

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
    "LuGre",
    "Model",
    "PlantLike",
    "Preset",
    "RangeOfMotion",
    "SelfLocking",
    "SmallOscillation",
    "SmallOscillations",
    "TorqueMargin",
    "anthropometric_forearm",
    "arm_with_drive",
    "as_plant",
    "battery_system",
    "body_segments",
    "driven_arm",
    "flexible_joint_arm",
    "hold",
    "load_estimate",
    "measured_forearm",
    "model",
    "models",
    "no_load_speed",
    "plant_text",
    "preset",
    "preset_from_mapping",
    "presets",
    "range_of_motion",
    "require_liftable",
    "rod",
    "small_oscillation",
    "small_oscillations",
    "steady_rise",
    "thermal_current",
    "torque_margin",
    "voltage_range",
    "with_meters",
]
