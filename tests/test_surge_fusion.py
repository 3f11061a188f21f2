"""What the fusion does when its instruments contradict each other: who is named, how soon, and who comes back."""

import math

import numpy as np
import pytest

from steerway.estimation.speed import FaultEvent, FaultVote, SurgeFusion
from steerway_studies.testing import FAULTS, Job, run

STEP = 0.02


def sail(fault, seed=0, seconds=60.0, fusion=None, third=3.1, log="bottom_speed", stream=None):
    """3 m/s for a while at 50 Hz, GPS and log at 10 Hz. `fault(t)` adds to (acceleration, GPS, log)."""
    fusion = fusion or SurgeFusion()
    draws = np.random.default_rng(seed)
    n = round(seconds / STEP)
    noise = draws.standard_normal((n, 3)) * (60e-6 * 9.80665 / math.sqrt(STEP), 0.03, 0.002)
    errors = []
    for k in range(n):
        time = (k + 1) * STEP
        felt, gps, doppler = noise[k] + fault(time)
        output = {}
        if k % 5 == 0:
            output["sog"] = 3.0 + gps
        if k % 5 == 2:
            output[log] = 3.0 + doppler - (stream(time) if stream else 0.0)
        fusion.step(0.02 + felt, STEP, reference=third(time) if callable(third) else third, **output)
        errors.append(fusion.speed - 3.0)
    return fusion, STEP * np.arange(1, n + 1), np.array(errors)


def after(begin, *what):
    return lambda time: np.array(what) if time > begin else np.zeros(3)


def ramp(begin, rate):
    return lambda time: np.array([0.0, 0.0, rate * max(0.0, time - begin)])


def names(fusion):
    return [(event.instrument, event.what) for event in fusion.events]


def test_a_sound_boat_accuses_nobody():
    for seed in range(5):
        assert sail(after(1e9, 0, 0, 0), seed)[0].events == []


@pytest.mark.parametrize(
    ("fault", "guilty", "within", "most"),
    [
        (after(30.0, 0.0, 0.0, 0.1), "bottom_speed", 3.0, 0.03),
        (after(30.0, 0.0, 0.0, -0.1), "bottom_speed", 3.0, 0.03),
        (ramp(30.0, 0.005), "bottom_speed", 12.0, 0.06),
        (after(30.0, 0.0, 0.3, 0.0), "sog", 2.0, 0.009),
        (after(30.0, 0.0, -0.3, 0.0), "sog", 2.0, 0.009),
    ],
)
@pytest.mark.parametrize("seed", range(3))
def test_the_guilty_one_is_named_soon(fault, guilty, within, most, seed):
    fusion, time, errors = sail(fault, seed)
    assert names(fusion) == [(guilty, "excluded")]
    assert 30.0 < fusion.events[0].time < 30.0 + within
    assert fusion.excluded == guilty
    assert np.abs(errors[time > 30.0]).max() <= most


def test_what_a_creeping_log_taught_is_forgotten_when_it_is_named():
    for seed in range(3):
        fusion, time, errors = sail(ramp(30.0, 0.005), seed)
        named = fusion.events[0].time
        assert np.abs(errors[time < named]).max() > 0.02
        assert abs(errors[(time > named + 0.3) & (time < named + 1.5)].mean()) < 0.025


def test_the_accelerometer_is_doubted_when_the_others_agree():
    fusion, time, errors = sail(after(30.0, 0.1, 0.0, 0.0))
    assert ("acceleration", "doubted") in names(fusion)
    assert fusion.excluded is None
    assert np.abs(errors[time > 40.0]).max() < 0.03


def test_one_that_is_sound_again_is_taken_back():
    def fault(time):
        return np.array([0.0, 0.3 if 30.0 < time < 36.0 else 0.0, 0.0])

    fusion, _, _ = sail(fault)
    assert names(fusion) == [("sog", "excluded"), ("sog", "readmitted")]
    assert fusion.excluded is None and fusion.events[1].time - fusion.events[0].time >= 5.0


def test_without_a_third_instrument_the_accelerometer_tells_sudden_faults():
    fusion, _, errors = sail(after(30.0, 0.0, 0.0, 0.1), third=math.nan)
    assert names(fusion) == [("bottom_speed", "excluded")] and np.abs(errors).max() < 0.25
    fusion, _, _ = sail(ramp(30.0, 0.005), third=math.nan)
    assert fusion.excluded is None and fusion.events == []


def test_a_third_that_drifts_in_a_transient_accuses_nobody_wrongly():
    """A propeller model that is wrong by tenths while the speed changes, and the log ramps away."""

    def third(time):
        return 3.1 - 0.5 * math.exp(-abs(time - 35.0) / 6.0)

    for seed in range(3):
        fusion, _, _ = sail(ramp(30.0, 0.005), seed, third=third, seconds=90.0)
        assert all(name != "sog" for name, _ in names(fusion))


def test_a_scale_error_of_the_log_is_no_fault():
    for seed in range(3):
        fusion, time, errors = sail(lambda time: np.array([0.0, 0.0, 0.002 * 3.0]), seed, seconds=120.0)
        assert fusion.events == [] and np.abs(errors[time > 100.0]).max() < 0.006


def test_a_current_that_begins_is_found_and_not_taken_for_a_fault():
    fusion, time, errors = sail(after(1e9, 0, 0, 0), log="water_speed", stream=lambda time: 0.5 if time > 30.0 else 0.0)
    assert fusion.current == pytest.approx(0.5, abs=0.05)
    assert names(fusion) == [] and np.abs(errors[time > 10.0]).max() < 0.03


def test_reset_forgets_and_two_share_nothing():
    fusion, _, _ = sail(after(30.0, 0.0, 0.3, 0.0))
    fresh = SurgeFusion()
    assert fusion.events and not fresh.events
    fusion.reset()
    again, _, errors = sail(after(1e9, 0, 0, 0), fusion=fusion)
    np.testing.assert_array_equal(errors, sail(after(1e9, 0, 0, 0), fusion=fresh)[2])
    assert again.events == []


def test_events_say_when_who_and_what():
    assert FaultEvent(1.0, "sog", "excluded").instrument == "sog"


def test_a_vote_takes_the_one_whose_offset_to_the_third_has_moved():
    for wrong in (0, 1):
        vote = FaultVote((0.01, 0.01))
        for k in range(300):
            time = 0.1 * k
            for which in (0, 1):
                off = 0.2 if which == wrong and time > 20.0 else 0.0
                vote.take(which, time, 3.0 + off, 3.0, 2.6)
            vote.judge(time)
        assert vote.excluded == wrong and not vote.conflict


def test_a_vote_waits_for_its_windows():
    vote = FaultVote((0.01, 0.01))
    for k in range(15):
        vote.take(0, 0.1 * k, 4.0, 3.0, 3.0)
        vote.take(1, 0.1 * k, 3.0, 3.0, 3.0)
        vote.judge(0.1 * k)
    assert vote.excluded is None and not vote.conflict


@pytest.mark.parametrize(("name", "most"), [("dvl", 1.0), ("dvl_ramp", 2.0), ("gps", 0.3)])
def test_faults_in_the_closed_loop(name, most):
    assert name in FAULTS
    found = run(Job("fault", 3, 3, name))
    assert found["max_pct"] <= most and found["named_s"] <= 12.0


def test_current_and_wind_are_no_faults():
    assert run(Job("faultless", 1, 6))["doubts"] == 0
