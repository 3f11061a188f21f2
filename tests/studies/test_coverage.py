"""Coverage of the stated σ aboard: seeds that chose nothing of the filter."""

from functools import partial
from pathlib import Path

import numpy as np
import pytest

from steerway.commands.testing import SCENARIO
from steerway.simulation import load_scenario, numbers_of_seed, over_seeds, parse_scenario
from tests.golden import missed, no_worse

MISSION = Path(__file__).parents[2] / "examples" / "otter-mission.toml"


@pytest.fixture(scope="module", params=["demo", "otter-mission"])
def coverage(request):
    scenario = parse_scenario(SCENARIO, "demo") if request.param == "demo" else load_scenario(MISSION)
    found = over_seeds(partial(numbers_of_seed, scenario), range(101, 111))
    return lambda name: np.mean([each[f"{name}_within_2sigma_pct"] for each in found])


@pytest.mark.parametrize("name", ["position", "cog", "course_rate"])
def test_two_sigma_hold_the_truth(coverage, name):
    assert 90.0 < coverage(name) < 99.0


@missed("99.2 and 99.1 %: σ of SOG counts on 5 % of unsteady speed, which a simulated Otter does not have")
def test_two_sigma_of_sog_are_no_wider_than_needed(coverage):
    found = coverage("sog")
    no_worse(found < 99.2, found)
    assert found < 99.0


def test_two_sigma_of_sog_hold_the_truth(coverage):
    assert coverage("sog") > 90.0
