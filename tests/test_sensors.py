"""Receiver, compass, log and gyro: equal readings from a record and from the loop, with the errors of their models."""

import math

import numpy as np
import pytest

from steerway import InputError
from steerway.control import PositioningGains
from steerway.core import displacement
from steerway.estimation.heading import AidedHeadingFilter, IntervalFilter
from steerway.estimation.positioning import TimeVaryingNoise
from steerway.sensors import (
    TCM2,
    TRUE_TCM2,
    Compass,
    DopplerLog,
    DynamicCompass,
    Gnss,
    Instrument,
    accelerometer,
    gyro,
    random_compass,
    stability_limit,
)
from steerway.sensors.testing import Fault, deviation, gnss
from steerway.simulation import parse_scenario
from steerway.vessels import Otter, Propeller


def truth(seconds=60.0, step=0.02, start=0.0):
    """A boat that rolls and turns, as keyword arguments of `fixes` and rows of `step`."""
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
    Fault(kind="dropout", start=5.0, duration=2.0),
    Fault(kind="dropout", per_hour=200.0, duration=1.0),
    Fault(kind="jump", per_hour=400.0, size=20.0),
    Fault(kind="burst", per_hour=100.0, duration=3.0, size=2.0),
    Fault(kind="step", start=30.0, size=4.0, direction_deg=57.0),
    Fault(kind="frozen", per_hour=200.0, duration=1.5),
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
def test_a_record_and_the_loop_see_the_same_fixes(receiver):
    motion = truth(start=1.7e9 + 0.013)
    record, loop = whole(receiver, 7, **motion), stepwise(receiver, 7, **motion)
    assert len(record) == len(loop) > 200
    np.testing.assert_array_equal(record.time, [fix.time for fix in loop])
    np.testing.assert_allclose(plane(record), np.array([(fix.north, fix.east) for fix in loop]).T, atol=1e-8)
    np.testing.assert_allclose(record.sog, [fix.sog for fix in loop], rtol=1e-12)
    np.testing.assert_allclose(record.cog, [fix.cog for fix in loop], rtol=1e-12)


def still(seconds, rate):
    time = np.arange(round(seconds * rate) + 1) / rate
    return {"time": time, "north": np.zeros_like(time), "east": np.zeros_like(time)}


def test_gauss_markov_errors_have_their_spread_and_their_memory():
    std, time_constant, rate = 2.0, 10.0, 5.0
    error = plane(whole(Gnss(rate=rate, markov=((std, time_constant),)), 4, **still(40000.0, rate)))
    assert np.abs(error.std(axis=1) / std - 1.0).max() < 0.05
    for axis in error:
        lag = round(time_constant * rate)
        assert abs(np.corrcoef(axis[lag:], axis[:-lag])[0, 1] - math.exp(-1.0)) < 0.05
        assert abs(np.std(np.diff(axis)) / (std * math.sqrt(2.0 * -math.expm1(-1.0 / 50.0))) - 1.0) < 0.02


def test_faults_do_what_their_kinds_say():
    jump, step = (Fault(kind=each, start=3.0, size=9.0, direction_deg=30.0) for each in ("jump", "step"))
    for fault, expected in ((jump, [0, 0, 0, 9, 0, 0, 0]), (step, [0, 0, 0, 9, 9, 9, 9])):
        error = plane(whole(Gnss(rate=1.0, faults=(fault,)), 0, **still(6, 1)))
        np.testing.assert_allclose(error, np.outer([math.sqrt(0.75), 0.5], expected), atol=1e-9)
    jumps = plane(whole(Gnss(rate=1.0, faults=(Fault(kind="jump", per_hour=360.0, size=9.0),)), 1, **still(36_000, 1)))
    sizes = np.hypot(*jumps)
    assert sizes[0] < 1.0 and (sizes > 1.0).sum() == pytest.approx(3600, rel=0.1)
    np.testing.assert_allclose(sizes[sizes > 1.0], 9.0)
    assert np.abs(jumps[:, sizes > 1.0].mean(axis=1)).max() < 0.6  # in every direction
    twice = 2 * (Fault(kind="burst", start=0.0, duration=400.0, size=3.0),)
    burst = plane(whole(Gnss(faults=twice), 5, **still(800, 5)))
    assert abs(burst[:, :2000].std() / math.sqrt(18.0) - 1.0) < 0.05 and not burst[:, 2000:].any()
    assert abs(np.corrcoef(burst[:, :2000])[0, 1]) < 0.1
    dropout = whole(Gnss(faults=(Fault(kind="dropout", start=2.0, duration=3.0),)), 0, **still(10, 5))
    assert len(dropout) == 51 - 15 and np.diff(dropout.time).max() == pytest.approx(3.2)
    frozen = whole(Gnss(white=0.3, faults=(Fault(kind="frozen", start=2.0, duration=1.0),)), 0, **truth(seconds=6.0))
    np.testing.assert_array_equal(np.flatnonzero(np.diff(frozen.latitude) == 0.0), np.arange(9, 14))


def test_the_antenna_swings_with_roll_and_pitch():
    def antenna(roll, pitch, heading, arm=(0.5, 0.2, -2.0)):
        receiver = Gnss(rate=1.0, lever_arm=arm)
        motion = still(0.0, 1.0) | {"roll": roll, "pitch": pitch, "heading": heading}
        return plane(whole(receiver, 0, **motion))[:, 0]

    assert Gnss().lever_arm == (0.0, 0.0, 0.0)  # at the boat's origin
    np.testing.assert_allclose(antenna(0.0, 0.0, 0.0), [0.5, 0.2], atol=1e-9)
    np.testing.assert_allclose(antenna(0.0, 0.0, math.pi / 2), [-0.2, 0.5], atol=1e-9)
    # With positive roll the mast leans to starboard; with the bow up it leans aft.
    np.testing.assert_allclose(antenna(0.1, 0.0, 0.0), [0.5, 0.2 * math.cos(0.1) + 2.0 * math.sin(0.1)], atol=1e-9)
    np.testing.assert_allclose(antenna(0.0, 0.1, 0.0), [0.5 * math.cos(0.1) - 2.0 * math.sin(0.1), 0.2], atol=1e-9)
    parts = sum(antenna(0.1, 0.2, 0.3, arm) for arm in ((0.5, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, -2.0)))
    np.testing.assert_allclose(parts, antenna(0.1, 0.2, 0.3), atol=1e-9)


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
    true = 1.3, np.cos(0.2 * output.time)
    errors = np.array([np.cos(output.cog), np.sin(output.cog)]) * output.sog - np.array(np.broadcast_arrays(*true))
    assert np.abs(errors.mean(axis=1)).max() < 0.01 and np.abs(errors.std(axis=1) - 0.1).max() < 0.01
    assert abs(np.corrcoef(errors)[0, 1]) < 0.1


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Gnss(rate=0.0), "Gnss: rate is 0.0, expected more than 0.0 Hz"),
        (lambda: Gnss(markov=((1.0, 0.0),)), r"Gnss: markov\[0\]\[1\] is 0.0, expected more than 0"),
        (lambda: Instrument(white=-1.0), "instrument.white is -1, expected a number of at least 0"),
        (lambda: Fault(kind="jump"), "both or neither of start and per_hour"),
        (lambda: gnss.white(0.1, rate=10.0).fixes([0.0, 1.0], [0.0, 0.0], [0.0, 0.0], 0), "has steps of 1 s"),
        (lambda: gnss.white(0.1).fixes([0.0, 0.0], [0.0, 0.0], [0.0, 0.0], 0), "does not rise"),
        (lambda: Otter(payload_mass=46.0), "payload_mass is 46.0"),
        (lambda: Propeller(advance=(0.0, 0.0), coefficient=(0.3, 0.1)), "expected rising ratios"),
        (lambda: TimeVaryingNoise(low=0.5, high=0.25), "time_varying.high is 0.25"),
        (lambda: PositioningGains(np.ones(3), np.eye(3), np.eye(3)), r"proportional has shape \(3,\), expected"),
        (lambda: IntervalFilter(np.full((14, 2), math.nan)), r"interval\.box\[0\] is nan to nan, expected numbers"),
        (lambda: AidedHeadingFilter().step(0.0, velocity=(1.0,)), "expected"),
    ],
)
def test_what_cannot_be_is_refused(make, message):
    """Of receivers, vessels, observers and heading filters, where they are made."""
    with pytest.raises(InputError, match=message):
        make()


TIME = 1.7e9 + 0.02 * np.arange(20_001)
WOBBLY = Instrument(rate=7.0, white=0.1, bias=0.3, turn_on_std=0.2, wander=(0.1, 20.0), scale=1.1)


def streamed(stream, *truth):
    """(times, readings) of an instrument stepped at every row."""
    rows = zip(TIME.tolist(), *(column.tolist() for column in truth), strict=True)
    readings = [(row[0], stream.step(*row)) for row in rows]
    return tuple(zip(*[(time, reading) for time, reading in readings if reading is not None], strict=True))


def test_a_compass_and_a_log_are_the_same_in_a_record_and_in_the_loop():
    compass = Compass(WOBBLY, deviation=(0.1, 0.2, 0.3, 0.04, 0.05))
    heading = np.linspace(-6.0, 6.0, len(TIME))
    time, reading = compass.measured(TIME, heading, 3)
    np.testing.assert_array_equal((time, reading), streamed(compass.start(3), heading))
    assert reading.min() >= -math.pi and reading.max() < math.pi
    log = DopplerLog(WOBBLY)
    time, surge, sway = log.measured(TIME, np.cos(TIME), np.sin(TIME), 3)
    times, readings = streamed(log.start(3), np.cos(TIME), np.sin(TIME))
    np.testing.assert_array_equal((time, surge, sway), (times, *zip(*readings, strict=True)))
    assert abs(np.corrcoef(surge - np.cos(time), sway - np.sin(time))[0, 1]) < 0.9


def test_noise_bias_and_scale_have_their_size():
    errors = Instrument(rate=50.0, white=0.2, bias=0.5).measured(TIME, 0.0, 1)[1]
    assert errors.mean() == pytest.approx(0.5, abs=0.01) and errors.std() == pytest.approx(0.2, rel=0.03)
    np.testing.assert_allclose(Instrument(rate=50.0, scale=1.1).measured(TIME, 2.0, 1)[1], 2.2)
    turn_on = [Instrument(turn_on_std=0.3).measured(TIME[:1], 0.0, seed)[1][0] for seed in range(500)]
    assert np.std(turn_on) == pytest.approx(0.3, rel=0.1) and abs(np.mean(turn_on)) < 0.05
    wander = Instrument(rate=50.0, wander=(0.3, 1.0)).measured(TIME, 0.0, 1)[1]
    assert wander.std() == pytest.approx(0.3, rel=0.1)
    assert np.corrcoef(wander[50:], wander[:-50])[0, 1] == pytest.approx(math.exp(-1.0), abs=0.1)


def test_a_compass_deviates_by_its_card():
    exact = Instrument(rate=50.0)
    heading = math.radians(30.0)
    for k, expected in enumerate((1.0, 0.5, math.sqrt(0.75), math.sqrt(0.75), 0.5)):
        card = tuple(0.1 * (i == k) for i in range(5))
        reading = Compass(exact, card).measured(TIME[:1], [heading], 0)[1][0]
        assert reading - heading == pytest.approx(0.1 * expected)


def test_data_sheets_are_read_in_their_units():
    assert gyro(rate=100.0, noise_density_deg=0.01).white == pytest.approx(math.radians(0.1))
    assert gyro(in_run_deg_hour=36.0).wander[0] == pytest.approx(math.radians(0.01))
    assert accelerometer(rate=100.0, noise_density_micro_g=60.0).white == pytest.approx(600e-6 * 9.80665)
    assert accelerometer(turn_on_milli_g=5.0).turn_on_std == pytest.approx(0.0490, abs=1e-4)


def test_springers_compass_has_its_decoded_gain_and_stability():
    np.testing.assert_allclose(
        [TCM2.gain, TCM2.scaled(1.005).gain, TRUE_TCM2.gain], [0.99997, 1.2778, 1.578], atol=5e-5
    )
    for shift_too, expected in ((False, 1.02386), (True, 1.01384)):
        limit = stability_limit(shift_too)
        assert limit == pytest.approx(expected, abs=1e-5)
        assert TCM2.scaled(limit - 1e-9, shift_too).stable and not TCM2.scaled(limit + 1e-9, shift_too).stable
    with pytest.raises(InputError, match="unstable"):  # erratum: ten per cent holds unstable compasses
        DynamicCompass(TCM2.scaled(1.1))
    ratios = np.array([np.array(random_compass(np.random.default_rng(k))[:4]) / TCM2[:4] for k in range(200)])
    assert 0.99 <= ratios.min() < 0.991 and 1.009 < ratios.max() <= 1.01


def test_springers_compass_settles_on_its_gain_and_deviates_and_wraps_in_a_scenario_too():
    """Across ±180°; the compass's slow pole delays the reading of a turning vessel by the model's lag."""
    stream = DynamicCompass(TRUE_TCM2).start(0.5, 3)
    assert np.mean([stream.second(0.5) for _ in range(400)]) == pytest.approx(0.5 * TRUE_TCM2.gain, abs=0.02)
    card = (0.01, 0.05, -0.03, 0.02, 0.0)
    stream = DynamicCompass(TCM2, card, wrapped=True).start(3.1, 5)
    readings = np.concatenate([stream.second(3.1) for _ in range(300)])
    assert np.all(np.abs(readings) <= np.pi)
    wanted = (3.1 + deviation(3.1, *card)) * TCM2.gain
    assert np.angle(np.exp(1j * (readings - wanted)).mean()) == pytest.approx(0.0, abs=0.02)
    text = f'[compass]\nrate = 10.0\ndynamics = {list(TCM2[:4])}\n[vessel]\nkind = "springer"\n'
    text += "[route]\nwaypoints = [{ north = 0, east = 0 }, { north = 50, east = 0 }]\n"
    stream, rate = parse_scenario(text).compass.build().start(5), 0.02
    read = [(0.05 * k, stream.step(0.05 * k, 3.0 + rate * 0.05 * k)) for k in range(40_000)]
    time, reading = np.array([each for each in read if each[1] is not None]).T
    assert len(time) == 20_000 and np.all(np.abs(reading) <= np.pi)
    late = np.angle(np.exp(1j * (3.0 + rate * time - reading))[200:].mean())
    assert late == pytest.approx(rate * TCM2.lag, abs=2e-3)
