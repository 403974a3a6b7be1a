"""What the runs of a campaign say: how many settle, which are worst, what they depend on."""

from ulna.campaign.answers.fan_chart import Fan, fan
from ulna.campaign.answers.outcomes import outcome_counts
from ulna.campaign.answers.proportion import Proportion, clopper_pearson, settled_fraction, wilson
from ulna.campaign.answers.quantile_table import quantiles
from ulna.campaign.answers.repeated_run import Replay, replay
from ulna.campaign.answers.settled_cells import SettledMap, settled_map
from ulna.campaign.answers.sobol_indices import Sensitivity, sensitivity
from ulna.campaign.answers.worst import Case, worst_cases

__all__ = [
    "Case",
    "Fan",
    "Proportion",
    "Replay",
    "Sensitivity",
    "SettledMap",
    "clopper_pearson",
    "fan",
    "outcome_counts",
    "quantiles",
    "replay",
    "sensitivity",
    "settled_fraction",
    "settled_map",
    "wilson",
    "worst_cases",
]
