"""What a receiver says of the accuracy of its fixes: how far it counts, and that it counts alike however fixes come."""

import math
from dataclasses import replace

import numpy as np
import pytest

from steerway import FiveStateFilter, Fixes, Profile
from steerway.estimation.testing import variance_scales_of
from steerway.live.testing import Navigator, rows_of
from tests.scenes import angle_error, turning

ONE = Profile(speed_noise=1e-3, course_rate_noise=2e-3, course_rate_decay=0.3, position_std=0.5)
TWO = Profile(
    speed_noise=1e-4, course_rate_noise=1e-5, course_rate_decay=1.0, position_std=0.5,
    turn_time=20.0, straight_time=60.0, turn_speed_noise=1e-3, turn_course_rate_noise=3e-3, turn_course_rate_decay=0.1,
)  # fmt: skip
GOOD, BAD = 0.5, 5.0


def doubted(given):
    return variance_scales_of(np.zeros(2), np.asarray(given, float))


def troubled(seed, duration=300.0, exaggerated=2.0):
    """A scene, fixes of it whose noise is tenfold for a third of the time, as the receiver says, and when it is.

    It says thrice what it should as a rule, and in trouble exaggerates that further, as real ones do.
    """
    scene = turning(1.5, 0.5, duration, seed=seed)
    bad = (scene.time - scene.time[0]) % 120.0 > 80.0
    std = np.where(bad, BAD, GOOD)
    noise = np.random.default_rng([seed, 7]).standard_normal((2, len(std))) * std
    fixes = replace(scene, north=scene.north + noise[0], east=scene.east + noise[1]).fixes(0.0, 0)
    return scene, replace(fixes, position_std=3.0 * std * np.where(bad, exaggerated, 1.0)), bad


def test_what_is_usual_or_better_or_wavers_is_believed_alike():
    wavering = 2.5 * np.exp(np.random.default_rng(0).uniform(-0.3, 0.3, 5000))
    assert np.all(doubted(wavering) == 1.0)
    assert np.all(doubted([2.5] * 100 + [0.1] * 100) == 1.0)


def test_what_is_beyond_twice_the_rule_counts_by_its_square():
    for unit in (0.01, 1.0, 300.0):
        found = doubted(unit * np.array([1.0] * 50 + [1.9, 3.0, 20.0, 1.0]))
        np.testing.assert_allclose(found[-4:], [1.0, 2.25, 100.0, 1.0], rtol=5e-3)


def test_what_was_not_said_counts_for_nothing():
    given = np.array([1.0, 5.0] * 30)
    with_gaps = np.insert(given, [3, 20, 40, 59], [np.nan, 0.0, -1.0, np.inf])
    known = np.isfinite(with_gaps) & (with_gaps > 0.0)
    found = doubted(with_gaps)
    assert np.all(found[~known] == 1.0)
    np.testing.assert_array_equal(found[known], doubted(given))


def test_trouble_makes_no_rule_and_a_start_in_trouble_is_forgotten():
    found = doubted(([0.3] * 1000 + [30.0] * 300) * 4)
    assert np.all(found[-300:] > 0.5 * 50.0**2)
    assert doubted([6.0] * 100 + [0.5] * 4000 + [5.0])[-1] > 12.0


@pytest.mark.parametrize("profile", [ONE, TWO], ids=["one mode", "two modes"])
def test_a_receiver_that_says_when_it_is_bad_is_followed_through(profile):
    """Over four runs with σ 0.5 and 5 m, tuned for 0.5 m: without it SOG in trouble is twice as far off."""
    errors, nis = {True: [], False: []}, []
    for seed in range(4):
        scene, fixes, bad = troubled(seed)
        for heeded in errors:
            motion = FiveStateFilter(profile).filter(fixes if heeded else replace(fixes, position_std=None))
            errors[heeded].append((motion.sog - scene.sog)[bad])
            if heeded:
                nis.append(motion.nis[bad])
                assert np.median(angle_error(motion.cog, scene.cog)[bad]) < math.radians(15.0)
    rms = {heeded: math.sqrt(np.nanmean(np.square(each))) for heeded, each in errors.items()}
    assert rms[True] < 0.12 and 2.0 * rms[True] < rms[False]
    assert np.mean(nis) == pytest.approx(2.0, abs=0.25)


def received(fixes, source="GP"):
    return list(rows_of({source: fixes}))


def sailed_by(navigator, rows):
    return [given for row in rows for given in navigator.add(row)]


def test_live_without_it_and_of_another_receiver():
    _, fixes, _ = troubled(6)
    silent = replace(fixes, position_std=None)
    deaf = sailed_by(Navigator(ONE, accuracy=False), received(fixes))
    without = sailed_by(Navigator(ONE), received(silent))
    np.testing.assert_array_equal([row.sog for row in deaf], [row.sog for row in without])
    proud = replace(fixes.rows(slice(0, 300)), position_std=np.full(300, 0.1))
    humble = replace(fixes.rows(slice(300, 400)), position_std=np.full(100, 10.0))
    rows = received(proud) + [row._replace(time=row.time + 10.0) for row in received(humble, source="UBX")]
    weighted, unweighted = (sailed_by(Navigator(ONE, accuracy=heed), rows) for heed in (True, False))
    assert len(weighted) == 400
    np.testing.assert_array_equal([row.sog for row in weighted], [row.sog for row in unweighted])


def test_rows_without_a_position_make_no_rule():
    _, fixes, _ = troubled(9)
    nowhere = np.full(len(fixes), np.nan)
    extra = Fixes(fixes.time + 0.05, nowhere, nowhere, heading=np.zeros(len(fixes)))
    found = []
    for said in (np.full(len(fixes), 1e-3), None):
        rows = replace(extra, position_std=said)
        columns = {name: np.concatenate([fixes.columns()[name], rows.columns()[name]]) for name in fixes.columns()}
        found.append(FiveStateFilter(ONE, ("heading",)).filter(replace(fixes, **columns).in_order()))
    np.testing.assert_array_equal(found[0].sog, found[1].sog)
