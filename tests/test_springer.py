"""Springer and her compass: the decoded matrices (P4's text has them scrambled), limits, steps."""

import numpy as np
import pytest

from steerway.core import InputError
from steerway.sensors import TCM2, TRUE_TCM2, DynamicCompass, random_compass, stability_limit
from steerway.sensors.testing import deviation
from steerway.vessels import RPM, Springer, conditions
from steerway.vessels.testing import PAPER_YAW, SPEED

CALM = conditions()


def turned(vessel, seconds, difference_rpm, step=1.0):
    """Headings (rad) each step with n_d there from the beginning."""
    state = vessel.start()
    state[4] = difference_rpm * RPM
    out = [vessel.heading(state)]
    for _ in range(round(seconds / step)):
        state = vessel.step(state, (difference_rpm * RPM,), CALM, step)
        out.append(vessel.heading(state))
    return np.array(out)


def test_decoded_gains():
    assert TCM2.gain == pytest.approx(0.99997, abs=1e-5)
    assert TCM2.scaled(1.005).gain == pytest.approx(1.2778, abs=5e-5)
    assert TRUE_TCM2.gain == pytest.approx(1.5780, abs=5e-5)


def test_decoded_stability_limits():
    assert stability_limit() == pytest.approx(1.02386, abs=1e-5)
    assert stability_limit(shift_too=True) == pytest.approx(1.01384, abs=1e-5)
    for shift_too in (False, True):
        limit = stability_limit(shift_too)
        assert TCM2.scaled(limit - 1e-9, shift_too).stable
        assert not TCM2.scaled(limit + 1e-9, shift_too).stable


def test_erratum_printed_ten_per_cent_holds_unstable_compasses():
    assert not TCM2.scaled(1.1).stable
    with pytest.raises(InputError, match="unstable"):
        DynamicCompass(TCM2.scaled(1.1))


def test_decoded_turn_rates():
    """°/s at 300 rpm; the reversed digits of P4 (4), C = [13.34 11.15], give less than a third of the first."""
    degrees = np.degrees(turned(Springer("paper"), 121, 300.0))
    for start, rate in ((0, 2.507), (30, 2.924), (120, 4.108)):
        assert degrees[start + 1] - degrees[start] == pytest.approx(rate, abs=0.002)
    reversed_digits = PAPER_YAW._replace(outputs=(13.34, 11.15))
    first = np.degrees(300.0 * np.dot(reversed_digits.outputs, reversed_digits.inputs))
    assert first < 0.6 * 2.507


@pytest.mark.parametrize("plant", ["paper", "physical"])
@pytest.mark.parametrize("step", [0.5, 0.1])
def test_any_step_meets_the_whole_seconds(plant, step):
    whole, parts = turned(Springer(plant), 40, 120.0), turned(Springer(plant), 40, 120.0, step)
    np.testing.assert_allclose(parts[:: round(1.0 / step)], whole, rtol=1e-12, atol=1e-14)


def test_paper_plant_needs_rpm_to_hold_a_heading_and_physical_does_not():
    a, b, c = PAPER_YAW.matrices()
    rest = np.linalg.solve(np.block([[a - np.eye(2), b[:, None]], [c[None], np.zeros((1, 1))]]), [0.0, 0.0, 1.0])
    assert rest[2] / RPM * np.radians(1.0) == pytest.approx(-0.1438, abs=1e-4)
    vessel = Springer("physical")
    state = vessel.start(heading=1.0)
    for _ in range(100):
        state = vessel.step(state, (0.0,), CALM, 1.0)
    assert vessel.heading(state) == pytest.approx(1.0, abs=1e-12)


def test_position_bias_and_limits():
    vessel = Springer("physical", bias=10.0 * RPM)
    state = vessel.step(vessel.start(heading=np.pi / 2), (1000.0,), conditions((0.1, 0.2)), 1.0)
    np.testing.assert_allclose(state[:2], [0.1, SPEED + 0.2], atol=1e-12)
    assert state[4] == pytest.approx(20.0 * RPM)
    biased = Springer("physical").step(vessel.start(heading=np.pi / 2), (30.0 * RPM,), CALM, 1.5)
    assert vessel.heading(vessel.step(vessel.start(heading=np.pi / 2), (20.0 * RPM,), CALM, 1.5)) == pytest.approx(
        vessel.heading(biased), abs=1e-12
    )
    for _ in range(40):
        state = vessel.step(state, (1000.0,), CALM, 1.0)
    assert state[4] == pytest.approx(300.0 * RPM)


def test_motion_tells_speed_and_course():
    vessel = Springer("physical")
    state = vessel.start(heading=0.3)
    for _ in range(20):
        state = vessel.step(state, (100.0 * RPM,), CALM, 1.0)
    motion = vessel.motion(state, conditions((0.0, 0.2)))
    assert motion.water_speed == pytest.approx(SPEED)
    before = vessel.heading(state)
    after = vessel.heading(vessel.step(state, (100.0 * RPM,), CALM, 1e-3))
    assert motion.yaw_rate == pytest.approx((after - before) / 1e-3, rel=0.02)
    assert vessel.motion(state, CALM).course_rate == pytest.approx(motion.yaw_rate)


@pytest.mark.parametrize("model", [TCM2, TRUE_TCM2, TCM2.scaled(0.995)])
def test_compass_settles_on_its_gain_and_lags(model):
    stream = DynamicCompass(model).start(0.5, 3)
    readings = np.concatenate([stream.second(0.5) for _ in range(400)])
    assert readings.mean() == pytest.approx(0.5 * model.gain, abs=0.02)
    state, heading, ramp = np.zeros(2), 0.0, []
    for k in range(4000):
        heading = 0.1 * k
        state = np.array([model.a1 * state[0] + model.a2 * state[1] + model.b * heading, model.shift * state[0]])
        ramp.append(model.k * state[0])
    assert model.gain * 0.1 * 3999 - ramp[-1] == pytest.approx(model.gain * model.lag / 0.025 * 0.1, rel=1e-6)


def test_compass_deviates_and_wraps():
    card = (0.01, 0.05, -0.03, 0.02, 0.0)
    stream = DynamicCompass(TCM2, card, wrapped=True).start(3.1, 5)
    readings = np.concatenate([stream.second(3.1) for _ in range(300)])
    assert np.all(np.abs(readings) <= np.pi)
    mean = np.angle(np.exp(1j * readings).mean())
    wanted = (3.1 + deviation(3.1, *card)) * TCM2.gain
    assert np.angle(np.exp(1j * (mean - wanted))) == pytest.approx(0.0, abs=0.02)


def test_same_seed_same_readings_and_box_of_compasses():
    one, two = (DynamicCompass().start(0.0, 7).second(0.4) for _ in range(2))
    np.testing.assert_array_equal(one, two)
    rng = np.random.default_rng(0)
    ratios = np.array([np.array(random_compass(rng)[:4]) / TCM2[:4] for _ in range(200)])
    assert 0.99 <= ratios.min() < 0.991 and 1.009 < ratios.max() <= 1.01


@pytest.mark.parametrize("wrong", [{"plant": "x"}, {"bias": np.nan}, {"speed": -1.0}])
def test_unusable_vessels_are_named(wrong):
    with pytest.raises(InputError, match="springer"):
        Springer(**wrong)
