"""The study of observers on CyberShip II, on few seeds and with noise tuned beforehand."""

import pytest

from steerway_studies.testing import named, tuning

TUNED = {
    (world, form): [{"constant": -3.1, "inverse square": -4.6}.get(form, -4.1), -2.0] for world, form in tuning.CASES
}


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


def test_tuning_finds_a_better_noise_than_it_starts_from():
    from steerway_studies.testing import scenario

    found = tuning.tune(1, tuning.CASES.index(("S*", "one factor")))
    record = scenario.sail(scenario.drawn(tuning.FIRST_TUNING_SEED))
    errors = [scenario.watch(tuning.made("one factor", logs), record).mae for logs in (found, [-2.0], [-6.0])]
    assert errors[0] < min(errors[1:])
