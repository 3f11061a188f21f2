"""The receiver model: the same numbers as a record and in the loop, and errors of the size that is asked for."""

import math

import numpy as np
import pytest

from steerway import InputError
from steerway.core import displacement
from steerway.core.testing import noise
from steerway.sensors import Gnss
from steerway.sensors.testing import Fault, gnss

ORIGIN = (math.radians(63.4), math.radians(10.4))


def truth(seconds=60.0, step=0.02, start=0.0):
    """A rolling, turning boat, as keyword arguments of `fixes` and rows of `step`."""
    time = start + np.arange(round(seconds / step) + 1) * step
    t = time - start
    heading = 0.3 + 0.05 * t
    return {
        "time": time,
        "north": 1.3 * t,
        "east": 5.0 * np.sin(0.2 * t),
        "roll": 0.2 * np.sin(2.0 * t),
        "pitch": 0.1 * np.cos(1.7 * t),
        "heading": heading,
        "north_velocity": np.full_like(t, 1.3),
        "east_velocity": np.cos(0.2 * t),
    }


def whole(receiver, seed, **motion):
    time, north, east = (motion.pop(name) for name in ("time", "north", "east"))
    return receiver.fixes(time, north, east, seed, **motion)


def stepwise(receiver, seed, **motion):
    stream = receiver.start(seed)
    rows = zip(*(column.tolist() for column in motion.values()), strict=True)
    names = list(motion)
    fixes = (stream.step(**dict(zip(names, row, strict=True))) for row in rows)
    return [fix for fix in fixes if fix is not None]


def plane(fixes):
    """North and east (m) of fixes about latitude and longitude 0."""
    pairs = [displacement(lat, lon, 0.0, 0.0) for lat, lon in zip(fixes.latitude, fixes.longitude, strict=True)]
    return np.array(pairs).T


ALL_FAULTS = (
    Fault("dropout", start=5.0, duration=2.0),
    Fault("dropout", per_hour=200.0, duration=1.0),
    Fault("jump", per_hour=400.0, size=20.0),
    Fault("burst", per_hour=100.0, duration=3.0, size=2.0),
    Fault("step", start=30.0, size=4.0, direction=1.0),
    Fault("frozen", per_hour=200.0, duration=1.5),
)


@pytest.mark.parametrize(
    "receiver",
    [
        gnss.white(0.5),
        gnss.low_cost(),
        gnss.navstar(10.0),
        Gnss(rate=7.0, white=0.1, markov=((1.0, 20.0),), lever_arm=(0.3, 0.2, -0.8), velocity_std=0.05),
        Gnss(rate=5.0, white=0.1, faults=ALL_FAULTS, lever_arm=(0.3, 0.2, -0.8)),
    ],
)
@pytest.mark.parametrize("start", [0.0, 1.7e9 + 0.013])
def test_a_record_and_the_loop_see_the_same_fixes(receiver, start):
    motion = truth(start=start)
    record, loop = whole(receiver, 7, **motion), stepwise(receiver, 7, **motion)
    assert len(record) == len(loop) > 200
    np.testing.assert_array_equal(record.time, [fix.time for fix in loop])
    np.testing.assert_allclose(plane(record), np.array([(fix.north, fix.east) for fix in loop]).T, atol=1e-8)
    np.testing.assert_allclose(record.sog, [fix.sog for fix in loop], rtol=1e-12)
    np.testing.assert_allclose(record.cog, [fix.cog for fix in loop], rtol=1e-12)


def test_the_same_seed_gives_the_same_fixes_and_another_seed_others():
    motion = truth()
    one, same, other = (whole(gnss.low_cost(), seed, **motion) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.latitude, same.latitude)
    assert not np.any(one.latitude == other.latitude)


def test_epochs_come_at_the_rate():
    fixes = whole(gnss.white(0.0, rate=5.0), 0, **truth(seconds=600.0))
    np.testing.assert_allclose(np.diff(fixes.time), 0.2, atol=1e-9)
    assert len(fixes) == 3001


def still(seconds, rate):
    time = np.arange(round(seconds * rate) + 1) / rate
    return {"time": time, "north": np.zeros_like(time), "east": np.zeros_like(time)}


def test_white_errors_have_their_spread_and_no_memory():
    error = plane(whole(gnss.white(0.5), 3, **still(8000.0, 5.0)))
    assert np.abs(error.std(axis=1) - 0.5).max() < 0.01
    for axis in error:
        assert abs(np.corrcoef(axis[1:], axis[:-1])[0, 1]) < 0.02
    assert abs(np.corrcoef(error)[0, 1]) < 0.02


def test_gauss_markov_errors_have_their_spread_and_their_memory():
    std, time_constant, rate = 2.0, 10.0, 5.0
    error = plane(whole(Gnss(rate=rate, markov=((std, time_constant),)), 4, **still(40000.0, rate)))
    assert np.abs(error.std(axis=1) / std - 1.0).max() < 0.05
    for axis in error:
        lag = round(time_constant * rate)
        assert abs(np.corrcoef(axis[lag:], axis[:-lag])[0, 1] - math.exp(-1.0)) < 0.05
        assert abs(np.std(np.diff(axis)) / (std * math.sqrt(2.0 * -math.expm1(-1.0 / 50.0))) - 1.0) < 0.02


def test_a_settled_receiver_starts_wrong_by_its_spread_and_an_unsettled_one_at_zero():
    def first_errors(settled):
        receiver = Gnss(rate=1.0, markov=((3.0, 1000.0),), settled=settled)
        return np.array([plane(whole(receiver, seed, **still(1.0, 1.0)))[:, 0] for seed in range(400)])

    assert abs(first_errors(True).std() / 3.0 - 1.0) < 0.1
    np.testing.assert_array_equal(first_errors(False), 0.0)


def test_the_papers_driving_noise_fits_steps_of_one_second_not_a_tenth():
    """P1 (42)–(43): 0.21 m and T = 1100 s are said to give 4.7 m."""
    assert noise.markov_std(0.21, 1100.0, 0.1) == pytest.approx(15.6, abs=0.05)
    assert noise.markov_std(0.21, 1100.0, 1.0) == pytest.approx(4.9, abs=0.05)
    assert noise.markov_std(0.0634, 1100.0, 0.1) == pytest.approx(4.7, abs=0.01)


def test_the_antenna_swings_with_roll_and_pitch():
    def antenna(roll, pitch, heading):
        receiver = Gnss(rate=1.0, lever_arm=(0.5, 0.2, -2.0))
        motion = still(0.0, 1.0) | {"roll": roll, "pitch": pitch, "heading": heading}
        return plane(whole(receiver, 0, **motion))[:, 0]

    np.testing.assert_allclose(antenna(0.0, 0.0, 0.0), [0.5, 0.2], atol=1e-9)
    np.testing.assert_allclose(antenna(0.0, 0.0, math.pi / 2), [-0.2, 0.5], atol=1e-9)
    # Rolled to starboard the mast leans to starboard; bow up it leans aft.
    np.testing.assert_allclose(antenna(0.1, 0.0, 0.0), [0.5, 0.2 * math.cos(0.1) + 2.0 * math.sin(0.1)], atol=1e-9)
    np.testing.assert_allclose(antenna(0.0, 0.1, 0.0), [0.5 * math.cos(0.1) - 2.0 * math.sin(0.1), 0.2], atol=1e-9)


def test_a_rotated_scene_gives_rotated_true_fixes():
    motion, angle = truth(), 2.1
    receiver = Gnss(rate=5.0, lever_arm=(0.5, 0.2, -2.0))
    turned = motion | {
        "north": motion["north"] * math.cos(angle) - motion["east"] * math.sin(angle),
        "east": motion["north"] * math.sin(angle) + motion["east"] * math.cos(angle),
        "heading": motion["heading"] + angle,
    }
    north, east = plane(whole(receiver, 0, **motion))
    expected = [north * math.cos(angle) - east * math.sin(angle), north * math.sin(angle) + east * math.cos(angle)]
    np.testing.assert_allclose(plane(whole(receiver, 0, **turned)), expected, atol=1e-6)


def test_a_dropout_leaves_a_gap():
    fixes = whole(Gnss(rate=5.0, faults=(Fault("dropout", start=2.0, duration=3.0),)), 0, **truth(seconds=10.0))
    gap = np.argmax(np.diff(fixes.time))
    assert fixes.time[gap] == pytest.approx(1.8) and fixes.time[gap + 1] == pytest.approx(5.0)
    assert len(fixes) == 51 - 15


def test_a_jump_lasts_one_fix_and_a_step_stays():
    jump = plane(whole(Gnss(rate=1.0, faults=(Fault("jump", start=3.0, size=9.0, direction=0.0),)), 0, **still(6, 1)))
    np.testing.assert_allclose(jump, [[0, 0, 0, 9, 0, 0, 0], np.zeros(7)], atol=1e-9)
    step = Fault("step", start=3.0, size=9.0, direction=math.pi / 2)
    np.testing.assert_allclose(
        plane(whole(Gnss(rate=1.0, faults=(step,)), 0, **still(6, 1))), [np.zeros(7), [0, 0, 0, 9, 9, 9, 9]], atol=1e-9
    )


def test_random_jumps_come_as_often_and_as_far_as_asked_in_every_direction():
    error = plane(whole(Gnss(rate=5.0, faults=(Fault("jump", per_hour=360.0, size=9.0),)), 5, **still(20000.0, 5.0)))
    jumped = error[:, np.hypot(*error) > 0.0]
    np.testing.assert_allclose(np.hypot(*jumped), 9.0, atol=1e-6)
    assert abs(jumped.shape[1] / 2000.0 - 1.0) < 0.07
    assert np.abs(jumped.mean(axis=1)).max() < 0.5


def test_a_burst_is_noisy_while_it_lasts():
    error = plane(
        whole(Gnss(rate=5.0, faults=(Fault("burst", start=0.0, duration=400.0, size=3.0),)), 5, **still(800, 5))
    )
    assert abs(error[:, :2000].std() / 3.0 - 1.0) < 0.05
    np.testing.assert_array_equal(error[:, 2000:], 0.0)


def test_a_frozen_receiver_repeats_its_last_fix():
    fixes = whole(
        Gnss(rate=5.0, white=0.3, faults=(Fault("frozen", start=2.0, duration=1.0),)), 0, **truth(seconds=6.0)
    )
    same = np.flatnonzero(np.diff(fixes.latitude) == 0.0)
    np.testing.assert_array_equal(same, np.arange(9, 14))
    np.testing.assert_allclose(np.diff(fixes.time), 0.2, atol=1e-9)


def test_a_late_fix_keeps_its_epoch_unless_stamped_on_arrival():
    motion = truth(seconds=5.0)
    stream = Gnss(rate=5.0, latency=0.3).start(0)
    late = {}
    for t, north in zip(motion["time"].tolist(), motion["north"].tolist(), strict=True):
        fix = stream.step(t, north, 0.0)
        if fix is not None:
            late[t] = fix
    assert min(late) == pytest.approx(0.3) and late[min(late)].time == 0.0
    for t, fix in late.items():
        assert t - fix.time == pytest.approx(0.3) and fix.north == pytest.approx(1.3 * fix.time)
    stamped = whole(Gnss(rate=5.0, latency=0.3, stamped_on_arrival=True), 0, **motion)
    assert stamped.time[0] == pytest.approx(0.3)


def test_sog_and_cog_are_said_only_by_a_receiver_that_says_them():
    motion = truth(seconds=400.0)
    assert np.isnan(whole(gnss.white(0.1), 0, **motion).sog).all()
    output = whole(Gnss(rate=5.0, velocity_std=0.1), 0, **motion)
    along = output.sog * np.cos(output.cog)
    assert abs(along.mean() - 1.3) < 0.01 and abs(along.std() - 0.1) < 0.01


def test_north_and_east_are_true_distances_on_the_origin():
    time = np.array([0.0, 0.2])
    fixes = gnss.white(0.0).fixes(time, [0.0, 3.0], [0.0, 4.0], 0, origin=ORIGIN)
    moved = displacement(fixes.latitude[1], fixes.longitude[1], fixes.latitude[0], fixes.longitude[0])
    np.testing.assert_allclose(moved, (3.0, 4.0), atol=1e-6)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Gnss(rate=0.0), "rate is 0.0"),
        (lambda: Gnss(white=-1.0), "white is -1.0"),
        (lambda: Gnss(markov=((1.0, 0.0),)), "time constant"),
        (lambda: Fault("loss", start=0.0), "'loss' is unknown"),
        (lambda: Fault("jump"), "either start or per_hour"),
        (lambda: Fault("jump", start=1.0, size=-3.0), "size = -3.0"),
        (lambda: gnss.white(0.1, rate=10.0).fixes([0.0, 1.0], [0.0, 0.0], [0.0, 0.0], 0), "comes every 1 s"),
        (lambda: gnss.white(0.1).fixes([0.0, 0.0], [0.0, 0.0], [0.0, 0.0], 0), "does not rise"),
    ],
)
def test_bad_input_is_named(make, message):
    with pytest.raises(InputError, match=message):
        make()
