"""Springer's missions: P4's table and errata, the shipped networks and their training, and the alarm."""

import numpy as np
import pytest

pytest.importorskip("daqp")

from steerway.estimation.heading import (
    SCALE_ONLY,
    AidedHeadingFilter,
    outside,
)
from steerway.estimation.testing import gain_range
from steerway.sensors import TCM2, random_compass
from steerway.vessels import SPRINGER_PAPER_YAW
from steerway_studies.testing import (
    RangeRatePassing,
    World,
    ideal,
    lesson,
    nominal,
)
from steerway_studies.testing import world_sail as sail


@pytest.mark.parametrize("passing, seconds", [(None, 892), (RangeRatePassing(), 971)])
def test_nominal_filter_misses_later_waypoints(passing, seconds):
    voyage = sail(World(), nominal(), 3, passing=passing)
    assert 3 <= voyage.reached <= 5 and voyage.log.reached == list(range(voyage.reached))
    assert voyage.heading_rms_deg > 15.0
    assert len(voyage.heading) == pytest.approx(seconds, abs=12)


@pytest.mark.filterwarnings("ignore:Stochastic Optimizer")
def test_training_learns_a_weight_from_little():
    pytest.importorskip("sklearn")
    from steerway_studies.testing import train

    notes = np.concatenate([lesson(2_000_000 + k) for k in range(6)])[::10]
    network = train(notes, "weight", iterations=200)
    low, high, nominal_deg, truth = notes[:, 12:].T
    estimate = np.array([low[k] + network(notes[k]) * (high[k] - low[k]) for k in range(len(notes))])
    assert np.sqrt(np.mean((estimate - truth) ** 2)) < 0.5 * np.sqrt(np.mean((nominal_deg - truth) ** 2))


def alarmed(compass) -> bool:
    """Whether the filter says for a minute that the compass is outside the box of ± 1 %."""
    voyage = sail(World(compass=compass), ideal(compass), 0)
    estimator, raised = AidedHeadingFilter(SCALE_ONLY, TCM2, SPRINGER_PAPER_YAW), []
    for difference, readings in zip(voyage.difference, voyage.readings, strict=True):
        estimator.step(difference, readings)
        raised.append(outside(estimator, 0.01))
    return bool(np.convolve(raised, np.ones(60), "valid").max() >= 60)


def test_alarm_tells_compasses_outside_the_box():
    compasses = random_compass(np.random.default_rng(8)), TCM2.scaled(0.98), TCM2.scaled(1.012)
    assert [alarmed(each) for each in compasses] == [False, True, True]
    low, high = gain_range(0.01)
    rng = np.random.default_rng(0)
    gains = [random_compass(rng).gain / TCM2.gain for _ in range(500)]
    assert low <= min(gains) and max(gains) <= high
    assert TCM2.scaled(0.98).gain / TCM2.gain < low and TCM2.scaled(1.012).gain / TCM2.gain > high
