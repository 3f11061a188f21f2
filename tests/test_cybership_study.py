"""The study of observers on CyberShip II, on few seeds and with noise tuned beforehand."""

import json
import math

import pytest

from steerway_studies.testing import named, trials, tuning

TUNED = {
    (world, form): [{"constant": -3.1, "inverse square": -4.6}.get(form, -4.1), -2.0] for world, form in tuning.CASES
}
KEYS = """tekf_mae_all tekf_mae_fix tekf_recipe_b_mae observer_stock_mae observer_tuned_mae ekf9_mae ekf9_bound_ratio
ekf9_nis rts_mae hold_mae pid_overshoot_north_pct pid_overshoot_east_pct""".split()


@pytest.fixture(scope="module")
def results():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tuning, "tuned_cases", lambda seeds, progress: TUNED)
        patch.setattr(
            "steerway_studies.cybership_observers.over_cases",
            lambda run, seeds, progress: [run(seed) for seed in seeds],
        )
        return named("cybership-observers").run(8, 0, None)


def test_the_numbers_stand_where_they_did(results):
    numbers = results.numbers
    assert numbers["tekf_mae_all"] == pytest.approx(0.124, abs=0.006)
    assert numbers["tekf_recipe_b_mae"] == pytest.approx(0.0785, abs=0.005)
    assert numbers["observer_stock_mae"] > 1.4 * numbers["tekf_recipe_b_mae"]
    assert numbers["observer_stock_calm_mae"] == pytest.approx(numbers["tekf_recipe_b_calm_mae"], rel=0.1)
    assert numbers["observer_tuned_mae"] == pytest.approx(0.051, abs=0.005)
    assert numbers["rts_mae"] < 0.026 < 0.043 < numbers["ekf9_mae"] < 0.055
    assert 5.0 < numbers["ekf9_nees"] < 7.0
    assert numbers["heading_compass_deg"] < 0.5 < 30.0 < numbers["heading_gnss_only_deg"]
    assert numbers["closed_loop_ekf9_p95"] < 2.5 < numbers["closed_loop_tekf_gnss_only_p95"]


def test_every_comparison_has_its_number_and_every_mean_its_interval(results):
    assert all(math.isfinite(results.numbers[each.key]) for each in results.comparisons)
    assert all(f"{key}_ci" in results.numbers for key in ("ekf9_mae", "tekf_mae_all", "observer_stock_mae"))


def test_the_page_is_written(results, tmp_path):
    page = results.write(tmp_path)
    written = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert all(isinstance(written[key], float) for key in KEYS)
    assert {"figure3.png", "figure4.png", "figure5.png"} <= {each.name for each in tmp_path.iterdir()}
    assert "inferred" in page.read_text(encoding="utf-8")


def test_one_seed_is_one_truth():
    assert trials.trial(TUNED, 4) == trials.trial(TUNED, 4)


def test_tuning_finds_a_better_noise_than_it_starts_from():
    from steerway_studies.testing import scenario

    found = tuning.tune(1, tuning.CASES.index(("S*", "one factor")))
    record = scenario.sail(scenario.drawn(tuning.FIRST_TUNING_SEED))
    errors = [scenario.watch(tuning.made("one factor", logs), record).mae for logs in (found, [-2.0], [-6.0])]
    assert errors[0] < min(errors[1:])
