from dataclasses import replace

import numpy as np
import pytest

from ulna.models import preset
from ulna.studies.prosthesis.load_campaign import load_campaign


@pytest.mark.slow
@pytest.mark.parametrize("name", ["paper", "transhumeral_elbow"])
def test_one_controller_holds_every_load_as_on_hardware(name):
    campaign = load_campaign(preset(name), 2000, seed=1)
    assert bool(np.all(campaign.runs.finished))
    assert campaign.worst_error <= 0.2
    again = load_campaign(preset(name), 2000, seed=1, threads=1)
    assert np.array_equal(again.runs.final_state, campaign.runs.final_state)


@pytest.mark.slow
def test_a_run_that_is_lost_makes_the_worst_error_infinite():
    campaign = load_campaign(preset("paper"), 64, seed=1)
    code = np.array(campaign.runs.code)
    code[3] = 1
    assert replace(campaign, runs=replace(campaign.runs, code=code)).worst_error == float("inf")
