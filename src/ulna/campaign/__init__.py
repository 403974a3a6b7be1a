"""Campaigns: many runs of one loop by a plan, resumable and repeatable bit for bit, and the answers they give."""

from ulna.campaign.campaign import Progress, campaign
from ulna.campaign.errors import CampaignError
from ulna.campaign.experiment import Experiment
from ulna.campaign.fan import Fan, fan
from ulna.campaign.fraction import Fraction, clopper_pearson, settled_fraction, wilson
from ulna.campaign.grid import Grid, grid
from ulna.campaign.measures import Column, Measures
from ulna.campaign.plan import Plan
from ulna.campaign.probability import Choice, Distribution, FromScipy, LogUniform, Normal, Uniform, distribution
from ulna.campaign.quantiles import quantiles
from ulna.campaign.replay import Replay, replay
from ulna.campaign.result import CampaignResult, open_campaign
from ulna.campaign.sampling import LatinHypercube, Random, Saltelli, Sobol
from ulna.campaign.sensitivity import Sensitivity, sensitivity
from ulna.campaign.settled_map import SettledMap, settled_map
from ulna.campaign.workers import DaskWorkers, LocalWorkers, Workers
from ulna.campaign.worst import Case, worst_cases

__all__ = [
    "CampaignError",
    "CampaignResult",
    "Case",
    "Choice",
    "Column",
    "DaskWorkers",
    "Distribution",
    "Experiment",
    "Fan",
    "Fraction",
    "FromScipy",
    "Grid",
    "LatinHypercube",
    "LocalWorkers",
    "LogUniform",
    "Measures",
    "Normal",
    "Plan",
    "Progress",
    "Random",
    "Replay",
    "Saltelli",
    "Sensitivity",
    "SettledMap",
    "Sobol",
    "Uniform",
    "Workers",
    "campaign",
    "clopper_pearson",
    "distribution",
    "fan",
    "grid",
    "open_campaign",
    "quantiles",
    "replay",
    "sensitivity",
    "settled_fraction",
    "settled_map",
    "wilson",
    "worst_cases",
]
