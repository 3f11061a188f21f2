"""A dozen fixes through what else runs over long records: each answers, and `make bounds` sees every kernel return."""

import itertools
import math

import numpy as np
import pytest

import steerway
from steerway.core import displacement, wrap
from steerway.estimation import InferredFilter, Profile, hindcast, predict
from steerway.estimation.speed import SurgeFilter
from steerway.estimation.steering import Response, SteeringFilter
from steerway.estimation.steering.testing import fold, moved_by_orders, predict_bank
from steerway.estimation.testing import HeadingTracker, model_of_profile, noise, taken_up
from steerway.estimation.testing import inference_forecast as forecast
from steerway.identification.testing import _under_way, positions_cost
from steerway_studies.testing import CELLS, TrueMotion, filtering_bound, smoothing_bound
from tests.scenes import sailed, straight, usual_profile

USUAL = usual_profile("base", "wander", "error")
TWO_MODES = Profile(
    speed_noise=2e-3, course_rate_noise=1e-5, position_std=0.3, turn_time=15.0, straight_time=60.0,
    turn_speed_noise=1e-2, turn_course_rate_noise=5e-3, error_std=0.5, error_time=30.0,
)  # fmt: skip


@pytest.fixture(scope="module")
def fixes():
    return straight(2.0, 1.0, 11.0, 1.0).fixes(0.1, 5)


def test_a_velocity_taken_by_name_counts(fixes):
    estimator = steerway.FiveStateFilter(TWO_MODES, ("sog", "cog"))
    for latitude, longitude in zip(fixes.latitude[:4], fixes.longitude[:4], strict=True):
        estimator.predict(1.0)
        estimator.update(latitude, longitude)
        estimator.aid_by(sog=2.0, cog=1.0)
    assert abs(estimator.sog - 2.0) < 0.1 and abs(wrap(estimator.cog - 1.0)) < 0.1


def test_a_long_step_is_predicted_and_a_step_back_is_none():
    estimator = steerway.FiveStateFilter("small-usv")
    for k in range(9):
        estimator.predict(1.0)
        estimator.update_north_east(2.0 * k, 0.0)
    before = estimator.state.copy()
    estimator.predict(-5.0)
    np.testing.assert_array_equal(estimator.state, before)
    estimator.predict(10.0)
    assert estimator.position_north_east[0] == pytest.approx(36.0, abs=3.0)


def test_a_boat_that_drifts_forth_and_back_has_no_negative_speed():
    """Smoothed from behind a mode runs backwards: that is forwards on the opposite course."""
    drift = sailed(np.linspace(0.1, -0.1, 10), 0.5, 0.1).fixes(0.5, 1)
    motion = steerway.estimate(drift, usual_profile("base", "wander", "error", "waves"), smooth=True)
    assert (motion.sog >= 0.0).all() and motion.sog.max() < 0.5


def test_an_obstruction_of_the_sky_is_no_motion():
    off = 5.0 * np.where(np.arange(12) < 6, 0.0, (-1.0) ** np.arange(12))
    fixes = straight(2.0, 1.0, 11.0, 1.0).fixes(0.1, 5, lambda _: (off, -off))
    motion = steerway.estimate(fixes, usual_profile("base", "wander", "obstructions"), causal=True)
    assert np.abs(motion.sog[6:] - 2.0).max() < 1.0


def test_an_inferred_profile_predicts(fixes):
    found = predict(fixes, (10.0, 60.0), USUAL)
    assert len(found) == 2 and (found.variance_north > 0.0).all()
    rows, earlier = hindcast(fixes, (10.0, 60.0), 0.0, USUAL)
    assert len(earlier) == 2 * len(rows)
    np.testing.assert_allclose(earlier.variance_north[-2:], found.variance_north, rtol=1e-9)


def test_the_positions_covariance_is_that_of_its_standard_deviation(fixes):
    estimator, position_std = InferredFilter(USUAL), math.nan
    for latitude, longitude in zip(fixes.latitude, fixes.longitude, strict=True):
        (*_, position_std), _, _ = estimator.row(1.0, latitude, longitude)
    np.testing.assert_allclose(0.5 * np.trace(estimator.position_covariance), position_std**2, rtol=1e-3)
    assert np.linalg.eigvalsh(estimator.position_covariance).min() > 0.0


def test_filters_refuse_what_is_no_time_step():
    """In silence a NaN would be taken for no time at all, and infinity would forget everything."""
    calls = (
        lambda dt: steerway.FiveStateFilter().predict(dt),
        lambda dt: steerway.FiveStateFilter().row(dt),
        lambda dt: InferredFilter(USUAL).predict(dt),
        lambda dt: InferredFilter(USUAL).row(dt, 0.9, 0.2),
        lambda dt: SurgeFilter().predict(0.0, dt),
        lambda dt: HeadingTracker().step(0.0, 0.0, dt),
    )
    for dt, call in itertools.product((math.nan, math.inf), calls):
        with pytest.raises(steerway.InputError, match="dt is"):
            call(dt)


def _departure(towards, tells, watched=3.0, way=0.0, leeway=0.0):
    """m/s by which the current (1 m/s) is missed 5 s after a boat departs from a drift, without a compass, and its 1σ.

    She was watched for some s, at the beginning with way. Her own speed loop goes ahead by the order at once, and makes
    up for the current later.
    """
    chance, current = np.random.default_rng(1), np.array([math.cos(towards), math.sin(towards)])
    response = Response(1.3, math.radians(20.0), 2.0, 3.0, time_std=0.5, damping_std=0.0, slip=0.2, integral=0.1)
    filter = SteeringFilter(response._replace(over_ground=True, speed_time=1.5), 0.3)
    place, heading, rate, added, dt = np.zeros(2), 0.0, 0.0, 0.0, 0.05
    for k in range(round((watched + 5.0) / dt)):
        time, since = k * dt, k * dt - watched
        filter.idle_since = 0.0 if tells and since < 0.0 else math.inf
        if since < 0.0:
            way -= dt / 1.5 * way
        else:
            ordered, speed = math.radians(16.0) * (since < 4.0), min(2.0, 0.8 + 0.5 * since)
            filter.order(time, ordered, speed)
            added += dt * 0.3 * (speed - way - current @ (math.cos(heading), math.sin(heading)))
            way = max(0.0, way + dt / 0.7 * (speed + added - way))
            rate += dt / 0.3 * (ordered - rate)
        heading += dt * rate
        velocity = (1.0 + leeway * (since < 0.0)) * current + way * np.array((math.cos(heading), math.sin(heading)))
        place += dt * velocity
        if k % 4 == 0:
            seen = *place + 0.02 * chance.standard_normal(2), *velocity + 0.02 * chance.standard_normal(2)
            filter.fix(time, *seen, yaw_rate=rate)
    found = filter.at(watched + 5.0)
    return math.dist((found.current_north, found.current_east), current), found.current_std


def test_a_boat_whose_motor_idles_drifts_with_the_current_and_a_little_with_the_wind():
    """Also where that is not said, by the gyro. Way that is left does no harm."""
    directions = 0.1 + np.arange(8) * math.pi / 4.0
    for tells in (False, True):
        assert max(_departure(each, tells)[0] for each in directions) < 0.3
    assert max(_departure(each, True, 5.0, way=2.0)[0] for each in directions) < 0.35
    for each in directions:
        error, std = _departure(each, True, leeway=0.15)
        assert error < 3.0 * std


def _heading_missed(deviation):
    """(error, 1σ) of the heading (k, 2), rad, of a boat that slips in 0.5 s, after two turns of 90°."""
    chance, current = np.random.default_rng(1), np.array([0.6, -0.3])
    response = Response(1.3, math.radians(60.0), 2.0, 2.0, time_std=0.5, damping_std=0.0, slip_time=0.2, slip_std=0.25)
    filter = SteeringFilter(response, 0.1)
    place, bow, sway, rate, dt, missed = np.zeros(2), 0.3, 0.0, 0.0, 0.05, []
    for k in range(1600):
        ordered = math.radians(45.0) if k > 300 and k % 400 < 40 else 0.0
        filter.order(k * dt, ordered, 2.0)
        rate += dt / 0.3 * (ordered - rate)
        bow += dt * rate
        sway += dt * (-sway / 0.5 - 2.0 * rate)
        c, s = math.cos(bow), math.sin(bow)
        velocity = current + np.array([2.0 * c - sway * s, 2.0 * s + sway * c])
        place += dt * velocity
        if k % 4 == 0:
            seen = *place + 0.1 * chance.standard_normal(2), *velocity + 0.1 * chance.standard_normal(2)
            filter.fix(k * dt, *seen, wrap(bow + deviation), rate)
            found = filter.at(k * dt)
            missed += [(wrap(found.heading - bow), found.heading_std)] if k > 800 else []
    return np.array(missed)


@pytest.mark.parametrize("deviation", [0.0, 8.0, -8.0])
def test_turns_tell_the_heading_of_the_bow_from_the_motion_and_from_the_compass(deviation):
    """In turns too, where the motion is 25° off the bow."""
    error, std = _heading_missed(math.radians(deviation)).T
    assert math.degrees(np.sqrt(np.mean(error**2))) < 2.0
    assert np.mean(np.abs(error) < 2.0 * std) > 0.9


@pytest.mark.parametrize("over_ground", [False, True])
@pytest.mark.parametrize("water", [1.5, 0.02, -0.1])
def test_the_covariance_follows_the_motion(over_ground, water):
    """Also of a boat that seems to move astern: its sway made the covariance of a step a million times too large."""
    response = Response(1.3, 0.35, 2.0, 2.0, over_ground=over_ground, integral=0.1, slip_time=0.2).packed
    orders, dt, n = np.array([[-math.inf, 0.2, 1.0]]), 0.05, 21
    state = np.array(
        [1.0, 2.0, 0.5, -0.3, water, 0.4, 0.3, 1.1, *[0.02] * 3, 0.1, 0.8, 0.9, *[0.1] * 3, 0.3, 0.01, 0, 0.8]
    )
    for j, nudge in enumerate(1e-5 * np.eye(n)):
        covariances = np.zeros((2, n, n))
        covariances[0, j, j] = 1.0
        predict_bank(np.tile(state, (2, 1)), covariances, orders, response, 0.0, 0.0, dt)
        ahead, behind = (moved_by_orders(state + sign * nudge, orders, response, 0.0, dt) for sign in (1.0, -1.0))
        moved = np.outer(ahead - behind, ahead - behind) / (2.0 * nudge[j]) ** 2
        deviation = n - 2  # of a compass: it decays with the heading's changes, not with time
        np.testing.assert_allclose(np.delete(covariances[0] - covariances[1] - moved, deviation, 0), 0.0, atol=0.01)


def test_a_boat_that_loses_its_way_keeps_its_heading():
    """The motor stops after two turns. Its drift then changes by 1.5 m/s, and the gyro carries the heading."""
    chance, place, heading, rate, way, dt = np.random.default_rng(1), np.zeros(2), 0.3, 0.0, 1.5, 0.05
    filter = SteeringFilter(Response(1.3, math.radians(20.0), 1.5, 2.0, speed_time=1.5), 0.1)
    for k in range(800):
        ordered = math.radians(15.0) * (k % 200 < 60) if k < 640 else math.nan
        filter.idle_since = 32.0 if k >= 640 else math.inf
        filter.order(k * dt, ordered, 1.5 if k < 640 else 0.0, 1.5 if k < 640 else 0.0)
        rate += dt / 0.3 * ((ordered if k < 640 else math.radians(4.0)) - rate)
        heading, way = heading + dt * rate, way * (1.0 if k < 640 else math.exp(-dt / 1.5))
        velocity = np.array((0.5, -0.2)) + way * np.array((math.cos(heading), math.sin(heading)))
        place += dt * velocity
        if k % 4 == 0:
            seen = *place + 0.1 * chance.standard_normal(2), *velocity + 0.1 * chance.standard_normal(2)
            filter.fix(k * dt, *seen, yaw_rate=rate)
    found = filter.at(k * dt)
    assert abs(wrap(found.heading - heading)) < 0.2 and found.heading_std < 0.3


@pytest.mark.parametrize(("water", "turns"), [(-0.4, False), (-0.6, True), (0.6, False)])
def test_only_motion_astern_turns_a_boat_round(water, turns):
    """Of two of its 1σ and of more than a boat at rest seems to make: noise turned drifting boats round."""
    state, covariance = np.zeros((1, 21)), 0.04**2 * np.eye(21)[None]
    state[0, 4:6] = water, 0.3
    fold(state, covariance, 1.0, 0.5)
    assert state[0, 4] == (-water if turns else water)
    assert state[0, 5] == pytest.approx(wrap(0.3 + math.pi) if turns else 0.3)


def _drift_on_a_leg(seed):
    """rad by which the error of the heading changes in 50 s on a straight leg across a strong current."""
    chance, current = np.random.default_rng(seed), 1.3 * np.array((math.sqrt(0.5), math.sqrt(0.5)))
    response = Response(1.3, math.radians(20.0), 2.0, 2.0, time_std=0.5, slip=0.2, damping_std=0.0, speed_time=1.5)
    filter = SteeringFilter(response._replace(over_ground=True), 0.15)
    place, heading, rate, way, dt, errors = np.zeros(2), 0.0, 0.0, 0.0, 0.05, []
    for k in range(1400):
        time = k * dt
        filter.idle_since = 0.0 if time < 4.0 else math.inf
        if time >= 4.0:
            turns = 16.0 * (5.0 < time < 11.0) - 16.0 * (11.0 <= time < 14.0)
            ordered = math.radians(turns if turns else 2.0 * math.sin(time))
            filter.order(time, ordered, 2.0, 2.0)
            rate, way = rate + dt / 0.3 * (ordered - rate), way + dt * (1.96 - way)
        heading += dt * rate
        velocity = current + way * np.array((math.cos(heading), math.sin(heading)))
        place += dt * velocity
        if k % 4 == 0:
            seen = *place + 0.1 * chance.standard_normal(2), *velocity + 0.1 * chance.standard_normal(2)
            filter.fix(time, *seen, yaw_rate=rate)
        if k in (400, 1396):
            errors.append(wrap(filter.at(time).heading - heading))
    return errors[1] - errors[0]


def test_noise_tells_nothing_of_the_heading():
    """The mean of its changes over eight seeds was -3°, with the current in place of the velocity over ground."""
    assert abs(math.degrees(np.mean([_drift_on_a_leg(seed) for seed in range(8)]))) < 1.0


def test_a_boat_that_stems_a_current_at_full_throttle_makes_way_through_the_water():
    """Over ground it hardly moves. Without the throttle it is taken to drift."""
    found = []
    for driven in (2.0, math.nan):
        chance, filter = np.random.default_rng(1), SteeringFilter(Response(1.3, math.radians(20.0), 2.0, 2.0), 0.1)
        for k in range(60):
            filter.order(0.2 * k, math.nan, math.nan, driven)
            filter.fix(0.2 * k, 0.1 * k, *(0.05 * chance.standard_normal(3)), yaw_rate=0.0)
        found.append(filter.at(12.0).water_speed)
    assert found[0] == pytest.approx(2.0, abs=0.5) and found[1] < 1.0


def _turn_by_own_loop(share, integral):
    """rad by which the estimate misses the heading 5 s after a turn, of a vehicle whose own loop gives a share of an
    ordered rate at once and adds the rest by an integral (1/s).
    """
    response = Response(1.3, math.radians(20.0), 2.0, 2.0, gain_std=0.3, time_std=0.5, damping_std=0.0)
    filter = SteeringFilter(response._replace(integral=integral, over_ground=True), 0.1)
    place, heading, added, rate, dt = np.zeros(2), 0.0, 0.0, 0.0, 0.05
    for k in range(600):
        ordered = math.radians(16.0) if k % 200 >= 100 and k < 500 else 0.0
        filter.order(k * dt, ordered, 2.0)
        rate = share * ordered + added
        added += dt * 0.2 * (ordered - rate)
        heading += dt * rate
        place += dt * 2.0 * np.array([math.cos(heading), math.sin(heading)])
        if k % 4 == 0 and k <= 500:
            filter.fix(k * dt, *place, yaw_rate=rate)
    return abs(wrap(filter.at(600 * dt).heading - heading))


def test_what_a_vehicles_own_loop_adds_to_a_turn_is_foreseen():
    """After a turn its integral turns the boat on, or back."""
    for share in (0.6, 1.2):
        assert _turn_by_own_loop(share, 0.2) < 0.5 * _turn_by_own_loop(share, 0.0)


def test_a_smoother_can_be_better_than_a_filter():
    n, cell = 4, CELLS["o05"]
    line = np.arange(float(n)), *np.zeros((5, n))
    voyage = TrueMotion(*line, turning=np.array([False, True, True, False]))
    filtered, smoothed = (bound(voyage, cell.profile) for bound in (filtering_bound, smoothing_bound))
    assert (np.trace(smoothed, axis1=1, axis2=2)[:-1] < np.trace(filtered, axis1=1, axis2=2)[:-1]).all()


def test_an_earlier_moment_is_predicted_from(fixes, monkeypatch):
    monkeypatch.setattr(forecast, "VOYAGES", 4)
    rows, found = hindcast(fixes.rows(slice(4)), (1.0,), 2.0, USUAL)
    assert len(found) == len(rows) == 2 and (found.variance_north > 0.0).all()


@pytest.mark.parametrize(
    "numbers",
    [
        {},
        {"acceleration_std": 0.1},
        {"yawing_period": 9.0},
        {"turn_time": 10.0, "straight_time": 20.0, "turn_speed_noise": 1e-3, "turn_course_rate_noise": 1e-3},
    ],
)
def test_a_forecast_by_given_numbers(fixes, numbers):
    """Two metres a second on course 1: ten seconds on she is twenty metres farther."""
    profile = Profile(speed_noise=1e-3, course_rate_noise=1e-4, position_std=0.1, **numbers)
    few = fixes.rows(slice(8))
    found = predict(few, 10.0, profile)
    way = displacement(found.latitude[0], found.longitude[0], few.latitude[-1], few.longitude[-1])
    assert math.hypot(*way) == pytest.approx(20.0, abs=5.0)
    assert math.atan2(way[1], way[0]) == pytest.approx(1.0, abs=0.3)
    assert found.variance_north[0] > 0.01 and found.variance_east[0] > 0.01


@pytest.mark.parametrize("pole", [-1.0, -0.05, -0.4 + 2.0j, -0.02 + 0.8j])
@pytest.mark.parametrize("t", [0.02, 0.5, 3.0, 10.0])
@pytest.mark.parametrize("integrates", [True, False])
def test_noise_of_a_process_over_a_step_of_any_length_against_fine_sums(pole, t, integrates):
    lag = t * (np.arange(20_000) + 0.5) / 20_000
    state = np.exp(pole * lag)
    once = (state - 1.0) / pole
    gain, way = (once, (once - lag) / pole) if integrates else (state, once)
    pairs = (way, way), (way, gain), (gain, gain), (state, way), (state, gain), (state, state)
    expected = np.array([t * np.mean(a * b.conj()) for a, b in pairs])
    expected[:3] = expected[:3].real
    np.testing.assert_allclose(taken_up(complex(pole), integrates, t), expected, rtol=1e-5)
    if not np.iscomplexobj(pole) and integrates:
        of_five_states = noise(-pole, t)
        found = [of_five_states[k] for k in (5, 4, 2, 3, 1, 0)]
        np.testing.assert_allclose(found, expected.real, rtol=1e-5)


def test_the_cost_of_a_rudders_effect_is_least_near_the_truth(fixes):
    """A straight run with the rudder amidships: an effect that is not there costs."""
    profile = Profile(speed_noise=1e-3, course_rate_noise=1e-4, position_std=0.1)
    motion, tuning = steerway.estimate(fixes, profile, causal=True), model_of_profile(profile)
    motion = motion.rows(np.isfinite(motion.cog))
    time, rudder = np.arange(12.0), np.ones(12)
    north, east = 2.0 * math.cos(1.0) * time, 2.0 * math.sin(1.0) * time
    cost = [
        positions_cost(time, rudder, north, east, gain, 0.0, tuning, _under_way(tuning, north, east, motion))
        for gain in (0.0, 0.3)
    ]
    assert cost[0] < cost[1]
