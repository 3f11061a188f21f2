"""The filter without a profile on white noise, whole: the simulated Otter and MARINER, and drawn courses."""

import math
from pathlib import Path

import pytest

from steerway.simulation import load_scenario, sail_scenario
from tests.scenes import Scene, turning
from tests.test_unknown_noise import MOST, REFUSED, beside_the_paper

EXAMPLES = Path(__file__).parent.parent.parent / "examples"
SEEDS = 61, 62, 63


def sailed(name, rate, duration):
    """True motion of an example that is steered by it, (rate) rows a second."""
    scenario = load_scenario(EXAMPLES / f"{name}.toml", {"duration": duration})
    scenario = scenario.model_copy(update={"estimator": scenario.estimator.model_copy(update={"kind": "truth"})})
    run = sail_scenario(scenario, 5).run
    run = run.rows(slice(round(60.0 / scenario.step), None, round(1.0 / (rate * scenario.step))))
    return Scene(run.time, run["true_north"], run["true_east"], run.true_sog, run.true_cog)


SCENES = {
    "otter": lambda: sailed("otter-mission", 5.0, 400.0),
    "mariner-usv": lambda: turning(6.0, 0.4, 300.0),
    "ship": lambda: sailed("p1", 1.0, 2000.0),
}
"""By the preset of the vessel: the Otter's mission, a fast craft and P1's ship."""


@pytest.mark.parametrize("std", [0.05, 0.1, 0.25, 0.5, 1.0, 2.0, 0.07, 0.7])
@pytest.mark.parametrize("preset", SCENES)
def test_untold_noise_costs_nothing(preset, std):
    """The six noises that are asked for, and two between those that the prior has."""
    sog, cog, refused = beside_the_paper(SCENES[preset](), std, SEEDS, preset)
    assert sog < MOST and cog < MOST and refused < REFUSED and math.isfinite(sog + cog)
