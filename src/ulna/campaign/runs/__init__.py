"""The runs of a campaign: what decides them, as a value and as text, and their figures."""

from ulna.campaign.runs.experiment import Experiment, Role
from ulna.campaign.runs.figures import OUTCOMES, columns, run_batch
from ulna.campaign.runs.measures import Column, Measures, Window, completed
from ulna.campaign.runs.run_path import path
from ulna.campaign.runs.settings import experiment_of, to_text

__all__ = [
    "OUTCOMES",
    "Column",
    "Experiment",
    "Measures",
    "Role",
    "Window",
    "columns",
    "completed",
    "experiment_of",
    "path",
    "run_batch",
    "to_text",
]
