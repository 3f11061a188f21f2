"""The study of observers on CyberShip II, on few seeds and with noise tuned beforehand."""

from steerway_studies.testing import tuning


def test_tuning_finds_a_better_noise_than_it_starts_from():
    from steerway_studies.testing import scenario

    found = tuning.tune(1, tuning.CASES.index(("S*", "one factor")))
    record = scenario.sail(scenario.drawn(tuning.FIRST_TUNING_SEED))
    errors = [scenario.watch(tuning.made("one factor", logs), record).mae for logs in (found, [-2.0], [-6.0])]
    assert errors[0] < min(errors[1:])
