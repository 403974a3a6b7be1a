"""Campaigns: many runs of one loop by a plan, resumable and repeatable bit for bit, and the answers they give."""

from ulna.campaign.campaign import Progress, campaign
from ulna.campaign.crew import Cluster, Crew, Local
from ulna.campaign.distributions import Choice, Distribution, FromScipy, LogUniform, Normal, Uniform, distribution
from ulna.campaign.errors import CampaignError
from ulna.campaign.experiment import Experiment
from ulna.campaign.grid import Grid, grid
from ulna.campaign.measures import Column, Measures
from ulna.campaign.plan import Plan
from ulna.campaign.result import CampaignResult, open_campaign
from ulna.campaign.sampling import LatinHypercube, Random, Saltelli, Sobol

__all__ = [
    "CampaignError",
    "CampaignResult",
    "Choice",
    "Cluster",
    "Column",
    "Crew",
    "Distribution",
    "Experiment",
    "FromScipy",
    "Grid",
    "LatinHypercube",
    "Local",
    "LogUniform",
    "Measures",
    "Normal",
    "Plan",
    "Progress",
    "Random",
    "Saltelli",
    "Sobol",
    "Uniform",
    "campaign",
    "distribution",
    "grid",
    "open_campaign",
]
