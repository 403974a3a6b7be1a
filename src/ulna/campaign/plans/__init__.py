"""Plans: which values the runs of a campaign take."""

from ulna.campaign.plans.grid import Grid
from ulna.campaign.plans.known_parameters import Posterior, posterior
from ulna.campaign.plans.plan import Plan, seeds
from ulna.campaign.plans.probability import (
    Choice,
    FromScipy,
    LogUniform,
    Normal,
    ProbabilityDistribution,
    Uniform,
    as_probability_distribution,
)
from ulna.campaign.plans.sampling import LatinHypercube, Random, Saltelli, Sobol

__all__ = [
    "Choice",
    "FromScipy",
    "Grid",
    "LatinHypercube",
    "LogUniform",
    "Normal",
    "Plan",
    "Posterior",
    "ProbabilityDistribution",
    "Random",
    "Saltelli",
    "Sobol",
    "Uniform",
    "as_probability_distribution",
    "posterior",
    "seeds",
]
