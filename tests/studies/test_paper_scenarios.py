"""The papers' scenarios whole, as a user sails them: `steerway simulate examples/pN.toml -o DIR`."""

import json
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from steerway.guidance.testing import OrderTable
from steerway.simulation import load_scenario, numbers_of_seed, over_seeds, parse_scenario, sail_scenario
from tests.command_line import run

EXAMPLES = Path(__file__).parent.parent.parent / "examples"
LONGEST = 60.0
"""s of one run on two cores, kernels compiled."""


def settles(found, *keys):
    return max(found[key] for key in keys) < 40.0 and found["overshoot_pct"] <= 2.0


def reaches(found, waypoints):
    return (found["waypoints_reached"], found["waypoints_missed"]) == (waypoints, 0.0)


EXPECTED = {
    "p0": lambda found: 9.2 <= found["settling_s"] <= 10.2 and found["overshoot_pct"] < 5.0,
    "p1": lambda found: reaches(found, 5.0) and found["rudder_rate_max_dps"] < 5.0 and found["rudder_max_deg"] < 39.9,
    "p2": lambda found: 0.068 < found["position_mae_m"] < 0.088,  # 5 % to 95 % of seeds
    "p3": lambda found: settles(found, "settling_s_3", "settling_s_6", "settling_s_9"),
    "p4": lambda found: reaches(found, 7.0),
}


@pytest.mark.parametrize("name", EXPECTED)
def test_a_paper_s_scenario_by_the_command_line_in_no_more_than_a_minute(name, tmp_path):
    began = time.perf_counter()
    code, _, errors = run("simulate", EXAMPLES / f"{name}.toml", "-o", tmp_path)
    assert not code, errors
    assert time.perf_counter() - began < LONGEST
    assert (tmp_path / "index.html").stat().st_size > 50_000
    found = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert EXPECTED[name](found), found


@pytest.mark.parametrize("speed", [3.0, 6.0, 9.0])
@pytest.mark.parametrize("controller", ["adaptive", "disturbance-observer", "pi"])
def test_p3_settles_from_rest_with_every_controller(controller, speed):
    scenario = load_scenario(EXAMPLES / "p3.toml")
    changed = scenario.speed.model_copy(update={"controller": controller})
    orders = (OrderTable(speed=speed),)
    found = sail_scenario(scenario.model_copy(update={"speed": changed, "orders": orders, "duration": 80.0})).numbers
    assert settles(found, f"settling_s_{speed:g}"), found


@pytest.mark.parametrize(
    "kind, noise, low, high",
    [
        ("tekf", "process_noise = 1.5e-3", 0.075, 0.079),
        ("vessel-filter", "force_std = [0.29, 0.29, 0.029]", 0.046, 0.052),
    ],
)
def test_p2_has_the_mean_errors_of_the_study(kind, noise, low, high):
    """Table III's by recipe B, and the nine-state filter's beside its bound of 0.0490 m."""
    text = (EXAMPLES / "p2.toml").read_text(encoding="utf-8")
    text = text.replace('"tekf"', f'"{kind}"').replace("process_noise = 1.5e-3", noise)
    numbers = over_seeds(partial(numbers_of_seed, parse_scenario(text)), range(1, 81))
    assert low < np.mean([each["position_mae_m"] for each in numbers]) < high
