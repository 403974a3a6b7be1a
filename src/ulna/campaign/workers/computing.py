"""What a worker does: a batch of runs, from text to bytes."""

from __future__ import annotations

from collections.abc import Mapping

from ulna.campaign.runs import columns, experiment_of, run_batch
from ulna.campaign.store import check_versions, packed


def computed_batch(settings: str, begun: Mapping[str, str], first: int, last: int, threads: int) -> bytes:
    """The file of the runs first ≤ k < last.

    Args:
        settings: text of the experiment. begun: versions that the campaign was begun with. threads: how many to use.

    Raises:
        CampaignError: other versions here.
    """
    check_versions(begun, "a batch of a campaign on this worker")
    experiment = experiment_of(settings)
    return packed(columns(experiment), run_batch(experiment, first, last, threads=threads))
