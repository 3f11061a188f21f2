"""Springer's missions: P4's table and errata, the shipped networks and their training, and the alarm."""

import math

import numpy as np
import pytest

pytest.importorskip("daqp")

from steerway.core import InputError
from steerway.estimation.heading import (
    SCALE_ONLY,
    AidedHeadingFilter,
    LearnedHeading,
    ModelBank,
    corners,
    outside,
)
from steerway.estimation.testing import gain_range
from steerway.sensors import TCM2, TRUE_TCM2, CompassModel, random_compass
from steerway.vessels import SPRINGER_PAPER_YAW
from steerway_studies.testing import (
    PAPER_CIRCUIT,
    RangeRatePassing,
    World,
    ideal,
    ideal_path,
    lesson,
    nominal,
    replayed,
    tautology,
)
from steerway_studies.testing import world_sail as sail


@pytest.fixture(scope="module")
def reached_all():
    return sail(World(), ideal(TRUE_TCM2), 3)


@pytest.mark.parametrize("passing, seconds", [(None, 892), (RangeRatePassing(), 971)])
def test_nominal_filter_misses_later_waypoints(passing, seconds):
    voyage = sail(World(), nominal(), 3, passing=passing)
    assert 3 <= voyage.reached <= 5 and voyage.log.reached == list(range(voyage.reached))
    assert voyage.heading_rms_deg > 15.0
    assert len(voyage.heading) == pytest.approx(seconds, abs=12)


def test_nominal_filter_overestimates_as_published(reached_all):
    """P4 §6: 'the KF tends to overestimate the heading, increasingly so during the latter part'."""
    error = np.degrees(replayed(reached_all, nominal()) - reached_all.heading)
    assert error[-1] > error[600] > error[300] > 0.0


def test_erratum_the_weighted_estimate_is_the_ideal_one(reached_all):
    found, voyage, _ = tautology(3)
    assert found["weighted_ideal_difference_deg"] <= 1e-6
    assert 0.0 <= found["weight_least"] and found["weight_largest"] <= 1.0
    np.testing.assert_allclose(voyage.position, reached_all.position, atol=1e-3)


def test_mission_is_the_same_seen_in_a_mirror():
    """Angles, current, circuit and steering change sign; the noise is what remains."""
    one = sail(World(waves=0.0), ideal(TRUE_TCM2), 0)
    other = sail(World(waves=0.0, current=(0.0, -0.15433)), ideal(TRUE_TCM2), 0, PAPER_CIRCUIT * (1.0, -1.0))
    n = min(len(one.heading), len(other.heading))
    np.testing.assert_allclose(one.position[:n, 0], other.position[:n, 0], atol=1.0)
    np.testing.assert_allclose(one.position[:n, 1], -other.position[:n, 1], atol=1.0)


def test_a_bank_and_lessons_of_another_compass():
    """A quicker one, known to ± 3 %, with a reading of 0.5 deg²: the bank's middle filter knows it."""
    own = CompassModel(0.2, 0.6, 0.9, 0.2 / 0.9)
    notes = lesson(2_000_010, 0.03, own)
    low, high, nominal_deg, truth = notes[:, 12:].T
    assert np.mean((low <= truth) & (truth <= high)) > 0.95
    assert np.std(truth - nominal_deg) > 0.0 and own.gain == pytest.approx(1.0)
    with pytest.raises(InputError, match="network is missing"):
        LearnedHeading(bank=ModelBank(corners(0.03, own), reading_variance=0.5))
    rng = np.random.default_rng(1)
    ratios = np.array([np.array(random_compass(rng, 0.03, own)[:4]) / own[:4] for _ in range(200)])
    assert 0.97 <= ratios.min() < 0.975 and 1.025 < ratios.max() <= 1.03


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


def test_deviation_as_printed(reached_all):
    """The sum of the errors along and across: P4 (23) by the law of cosines is the distance of two points."""
    path = ideal_path(PAPER_CIRCUIT, len(reached_all.position))
    assert np.hypot(*path[100]) == pytest.approx(154.33, abs=0.01)
    k = 50
    to_ideal, to_actual = PAPER_CIRCUIT[0] - path[k], PAPER_CIRCUIT[0] - reached_all.position[k]
    pb, pb_dash = np.hypot(*to_ideal), np.hypot(*to_actual)
    cosine = to_ideal @ to_actual / (pb * pb_dash)
    printed = math.sqrt(pb**2 + pb_dash**2 - 2.0 * pb * pb_dash * cosine)
    assert printed == pytest.approx(np.hypot(*(path[k] - reached_all.position[k])))
    assert reached_all.deviation_printed == pytest.approx(16.2, abs=0.2)
