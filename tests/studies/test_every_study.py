"""Every study whole, with few seeds, in this process; and the papers' scenarios whole, as `steerway simulate`."""

import json
import math
import time
from pathlib import Path

import pytest

import steerway_studies
from tests.command_line import run


@pytest.mark.timeout(3000)
@pytest.mark.parametrize("name", sorted(set(steerway_studies.STUDIES) - {"unseen-logs"}))  # needs logs
def test_a_study_meets_its_targets_and_writes_its_page(name, tmp_path):
    """With one seed; targets of CyberShip's observers are for means over runs of a minute."""
    shares, seeds = [], 8 if name == "cybership-observers" else 1
    results = steerway_studies.named(name).run(seeds, 1, lambda share, what: shares.append(share))
    page = results.write(tmp_path)
    written = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert [each.key for each in results.comparisons if each.met is False] == []
    assert all(math.isfinite(results.numbers[each.key]) for each in results.comparisons)
    assert all(written[each.key] == pytest.approx(results.numbers[each.key]) for each in results.comparisons)
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
