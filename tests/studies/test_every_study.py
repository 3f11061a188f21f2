"""Every study whole, with few seeds, in this process; and the papers' scenarios whole, as `steerway simulate`."""

import json
import math
import time
from pathlib import Path

import pytest

import steerway_studies
from tests.command_line import run

SEEDS = {"cybership-observers": 8, "estimator-limits": None}
"""For targets that are for means over runs of a minute, or for RMS values over many; else one."""
MISSED = {
    # The bound knows where turns begin and end, and no filter does. Its own value is that of other seeds.
    "estimator-limits": {
        "o25_cog_straight_bound_deg": 1.5,
        "o25_sog_straight_ratio": 1.11,
        "o25_sog_turn_ratio": 1.28,
        "o25_rate_straight_ratio": 2.67,
        "smoothed_o05_sog_turn_ratio": 1.51,
        "smoothed_o05_cog_straight_ratio": 1.31,
        "smoothed_o05_cog_turn_ratio": 1.14,
        "smoothed_o05_rate_straight_ratio": 1.57,
        "smoothed_o25_sog_straight_ratio": 1.22,
        "smoothed_o25_sog_turn_ratio": 1.96,
        "smoothed_o25_cog_straight_ratio": 1.8,
        "smoothed_o25_cog_turn_ratio": 1.25,
        "smoothed_o25_rate_straight_ratio": 2.73,
        "smoothed_o25_rate_turn_ratio": 1.16,
        "smoothed_m25_sog_straight_ratio": 1.11,
        "smoothed_m25_rate_straight_ratio": 1.16,
    },
    # P4's Table 1: the paper leaves out the circuit and the units of (25), and its kind of deviation is not known.
    "springer-mission": {
        "deviation_printed_ideal_m": 16.1,
        "deviation_printed_nominal_m": 24.8,
        "deviation_printed_nominal_printed_test_m": 28.6,
        "energy_published_ideal_rps2": 2.88,
        "energy_published_nominal_rps2": 3.04,
        "time_published_nominal_s": 892.0,
    },
}
"""Targets that are missed, as measured; each change of them, and each further one, fails the test."""


@pytest.mark.timeout(3000)
@pytest.mark.parametrize("name", sorted(set(steerway_studies.STUDIES) - {"unseen-logs"}))  # needs logs
def test_a_study_meets_its_targets_and_writes_its_page(name, tmp_path):
    shares = []
    results = steerway_studies.named(name).run(SEEDS.get(name, 1), 1, lambda share, what: shares.append(share))
    page = results.write(tmp_path)
    written = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    missed = {each.key: results.numbers[each.key] for each in results.comparisons if each.met is False}
    assert missed == pytest.approx(MISSED.get(name, {}), rel=0.05)
    known = {each.key: value for each in results.comparisons if math.isfinite(value := results.numbers[each.key])}
    assert all(each.key in known for each in results.comparisons if each.target)
    assert {key: written[key] for key in known} == pytest.approx(known)
    assert shares == sorted(shares) and shares[-1] == 1.0
    assert page.stat().st_size > 10_000
    assert {path.stem for path in tmp_path.glob("*.png")} == set(results.figures)


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
