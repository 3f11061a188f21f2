"""Position under known forces: observer, filters, smoother and PID, golden rows, symmetries, printed errors."""

import math
import warnings

import numpy as np
import pytest

from steerway import InputError
from steerway.control import PositioningGains, PositionPID
from steerway.core import wrap
from steerway.estimation.positioning import (
    DEMO_GAINS,
    PassiveObserver,
    VariationalNoise,
    VesselFilter,
    smooth,
)
from steerway.estimation.testing import low_speed
from steerway.vessels import CALM, CyberShip2, conditions
from steerway.vessels.testing import DAMPING, INERTIA
from steerway_studies.testing import TUNED_GAINS, observers, scenario
from tests.golden import assert_golden, columns, cybership_forces, golden


def demo(correction="held", **more):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return PassiveObserver(INERTIA, DAMPING, DEMO_GAINS, correction, **more)


def test_the_observer_goes_the_golden_way(shared_data):
    table, h = golden(shared_data, "cs2_passive_observer"), 0.02
    waves = lambda t: np.array([0.3, 0.2, 0.02]) * np.sin(0.8 * t + np.array([0.0, 1.0, 2.0]))  # noqa: E731
    truth, measured = columns(table, "x", "y", "psi"), columns(table, "y1", "y2", "y3")
    vessel, state = CyberShip2(), np.zeros(6)
    observer = demo(fix_interval=h, heading_interval=h)
    rows = [observer.state.copy()]
    for k in range(5 * (len(table) - 1)):
        # White noise is held over a tenth of a second; vessel and waves move on.
        noise = measured[k // 5] - truth[k // 5] - waves(table["t"][k // 5])
        seen = state[:3] + waves(h * k) + noise
        observer.update(*seen[:2])
        observer.update_heading(seen[2])
        observer.predict(cybership_forces(h * k), h)
        state = vessel.step(state, cybership_forces(h * k), CALM, h)
        if k % 5 == 4:
            rows.append(observer.state.copy())
    rows, expected = np.array(rows), columns(
        table, *"xi1 xi2 xi3 ew1 ew2 ew3 xh yh psih b1 b2 b3 uh vh rh".split()
    )  # fmt: skip
    expected[:, 8] = [wrap(each) for each in expected[:, 8]]
    assert_golden(rows, expected)


def test_gains_out_of_order_are_warned_of_and_divergence_is_detected_before_it_runs():
    with pytest.warns(UserWarning, match="K3/K4 = 1 1/s, expected below 0.8"):
        PassiveObserver(INERTIA, DAMPING, DEMO_GAINS, "held")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        PassiveObserver(INERTIA, DAMPING, TUNED_GAINS)
    with pytest.raises(InputError, match=r"diverge with held innovation corrections every 1 s.*1\.74"):
        demo("held innovation")
    assert demo("held innovation", check=False).spectral_radius == pytest.approx(1.74, abs=0.01)
    assert demo("held").spectral_radius < 1.0


FORCE = np.array([0.8, -0.4, 0.1])


def test_the_mean_goes_as_the_vessel_herself_does():
    estimator = observers.product()
    estimator.start(1.0, 2.0, 2.9)
    estimator.state[3:9] = 0.2, 0.1, 0.3, 0.25, -0.1, 0.02
    sea = conditions(force=(0.25, -0.1), moment=0.02)
    state = np.array([1.0, 2.0, 2.9, 0.2, 0.1, 0.3])
    estimator.model[low_speed.FORCE_DECAY] = 0.0
    for _ in range(40):
        state = CyberShip2().step(state, FORCE, sea, 0.1)
        estimator.predict(FORCE, 0.1)
    np.testing.assert_allclose(np.delete(estimator.state[:6], 2), np.delete(state, 2), rtol=1e-12)
    assert estimator.motion.heading == pytest.approx(wrap(state[2]))
    assert estimator.motion.force == pytest.approx((0.25, -0.1, 0.02))


def test_a_turned_scene_gives_the_turned_estimate():
    angle = 2.0
    c, s = math.cos(angle), math.sin(angle)
    one, other = observers.product(), observers.product()
    other.start(0.0, 0.0, angle)
    for k in range(200):
        one.predict(FORCE, 0.1)
        other.predict(FORCE, 0.1)
        one.update_heading(0.02 * k)
        other.update_heading(0.02 * k + angle)
        if k % 10 == 0:
            north, east = 0.02 * k, 0.3 * math.sin(0.05 * k)
            nis = one.update(north, east)
            assert other.update(c * north - s * east, s * north + c * east) == pytest.approx(nis, rel=1e-9)
    turn = np.array([[c, -s], [s, c]])
    for part in (slice(0, 2), slice(6, 8)):
        np.testing.assert_allclose(other.state[part], turn @ one.state[part], atol=1e-10)
    np.testing.assert_allclose(other.state[3:6], one.state[3:6], atol=1e-10)


def test_the_nine_state_filter_stands_at_the_bound_and_is_consistent():
    runs = [scenario.sail(scenario.drawn(seed)) for seed in range(8)]
    watched = [scenario.watch(observers.product(), record) for record in runs]
    least = np.mean([observers.bound(record)[0] for record in runs])
    assert np.mean([each.mae for each in watched]) == pytest.approx(least, rel=0.07)
    assert 1.75 < np.mean([each.nis for each in watched]) < 2.25


def test_the_smoother_knows_the_whole_record_and_how_well():
    record = scenario.sail(scenario.drawn(3))
    passes = smooth(observers.product(), record.forces, record.fixes, record.headings, scenario.STEP)
    np.testing.assert_array_equal(passes.smoothed[-1], passes.filtered[-1])
    errors = [np.abs(each[:, :2] - record.states[:, :2]).mean() for each in (passes.filtered, passes.smoothed)]
    assert errors[1] < 0.65 * errors[0]
    assert (np.diagonal(passes.smoothed_covariance, axis1=1, axis2=2)[:, :2].mean()) < 1.05 * np.diagonal(
        passes.filtered_covariance, axis1=1, axis2=2
    )[:, :2].mean()
    off = passes.smoothed[10:, :6] - record.states[10:]
    off[:, 2] = [wrap(each) for each in off[:, 2]]
    solved = np.linalg.solve(passes.smoothed_covariance[10:, :6, :6], off[:, :, None])[:, :, 0]
    assert 3.0 < (off * solved).sum(axis=1).mean() < 10.0


def test_noise_that_is_learned_goes_to_that_of_the_fixes():
    """Fixes about a boat at rest, three times as noisy as the filter was told."""
    told = observers.PRODUCT.position_std
    estimator = VesselFilter(INERTIA, DAMPING, observers.PRODUCT, 13.8, VariationalNoise())
    rng = np.random.default_rng(1)
    for _ in range(60):
        estimator.predict((0.0, 0.0, 0.0), 1.0)
        estimator.update_heading(0.0)
        estimator.update(*(3.0 * told * rng.standard_normal(2)))
    assert abs(estimator.motion.north) < 3.0 * told


def test_a_smoothed_record_of_few_rows_is_known_better():
    fixes = 0.1 * np.random.default_rng(1).standard_normal((6, 2))
    passes = smooth(observers.product(), np.zeros((5, 3)), fixes, np.zeros(6), 0.5)
    smoothed, filtered = (
        np.diagonal(each, axis1=1, axis2=2)[:-1, :2]
        for each in (passes.smoothed_covariance, passes.filtered_covariance)
    )
    assert np.all(smoothed < filtered)


def test_after_unbroken_rejections_the_position_is_taken_anew():
    estimator, north = observers.product(), []
    for k in range(16):
        estimator.predict((0.0, 0.0, 0.0), 1.0)
        estimator.update(30.0 if k >= 4 else 0.0, 0.0)
        north.append(estimator.motion.north)
    assert 2 <= np.argmax(np.array(north[4:]) > 15.0) < 10 and north[-1] == pytest.approx(30.0, abs=0.5)


def unlimited():
    printed = scenario.PRINTED_GAINS
    return PositioningGains(printed.proportional, printed.integral, printed.derivative)


def test_the_published_gains_sail_the_known_way():
    numbers = observers.control_numbers()
    assert numbers["pid_rise_north"] == pytest.approx(21.9, abs=0.3)
    assert numbers["pid_overshoot_north_pct"] == pytest.approx(6.6, abs=0.3)
    assert numbers["pid_overshoot_east_pct"] == pytest.approx(9.7, abs=0.3)
    assert numbers["pid_end_north"] == pytest.approx(10.54, abs=0.02)
    assert numbers["pid_end_east"] == pytest.approx(10.68, abs=0.02)
    assert numbers["pid_anti_windup_overshoot_east_pct"] < 0.5 * numbers["pid_overshoot_east_pct"]


def test_the_law_term_by_term():
    gains = unlimited()
    pid = PositionPID(gains)
    heading, velocity = 2.0, np.array([0.1, -0.2, 0.05])
    to_go = np.array([3.0 - 1.0, -4.0 - 2.0])
    c, s = math.cos(heading), math.sin(heading)
    error = np.array([c * to_go[0] + s * to_go[1], -s * to_go[0] + c * to_go[1], -3.0 - heading + 2.0 * math.pi])
    first = pid.step((3.0, -4.0, -3.0), 1.0, 2.0, heading, velocity, 0.1)
    np.testing.assert_allclose(first, gains.proportional @ error - gains.derivative @ velocity, rtol=1e-12)
    second = pid.step((3.0, -4.0, -3.0), 1.0, 2.0, heading, velocity, 0.1)
    np.testing.assert_allclose(second - first, 0.1 * gains.integral @ error, rtol=1e-9)
