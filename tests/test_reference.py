"""Reference filters: true rates, limits that hold, and the toolbox's filters with their faults."""

import math

import numpy as np
import pytest

from steerway.guidance import LowPass, Reference, ReferenceModel, TrackingFilter
from steerway_studies.testing import course_autopilot as printed
from tests.golden import golden

H = 0.05


def angle_change(one, other):
    return math.remainder(other - one, 2.0 * math.pi)


def run(shaper, command, seconds, dt=H):
    """(n, 3) references for a command given as a function of time."""
    steps = round(seconds / dt)
    return np.array([shaper.step(Reference(*command(k * dt)), dt) for k in range(steps)])


def step_to(angle):
    return lambda t: (angle, 0.0, 0.0)


def test_printed_filters_give_the_reference_numbers(shared_data):
    """LOS observer K_f = 0.3 and reference model ω = 1, ζ = 1, 10 °/s; the command is 170°, 230°, then a ramp."""
    rows = golden(shared_data, "los_observer_refmodel")

    def command(t):
        if t > 40.0:
            return math.radians(230.0) + 0.02 * (t - 40.0)
        return math.radians(230.0 if t > 25.0 - 1e-9 else 170.0 if t > 5.0 - 1e-9 else 0.0)

    observer, model, out = (0.0, 0.0), (0.0, 0.0, 0.0), []
    for step in range(1201):
        now = command(step * H)
        if step % 5 == 0:
            out.append((now, *observer, *model))
        observer = printed.los_observer(*observer, now, 0.3, H)
        model = printed.reference_model(*model, now, 1.0, 1.0, math.radians(10.0), H)
    for name, column in zip(("cmd", "los_angle", "los_rate", "ref_x", "ref_v", "ref_a"), np.array(out).T, strict=True):
        np.testing.assert_allclose(column, rows[name], rtol=1e-9, atol=1e-10)


def test_the_model_is_the_printed_one_while_no_limit_is_met():
    dt, own, model = 1e-3, ReferenceModel(0.5), (0.0, 0.0, 0.0)
    own.start(0.0)
    for _ in range(8000):
        model = printed.reference_model(*model, 1.0, 0.5, 1.0, math.inf, dt)
        reference = own.step((1.0, 0.0, 0.0), dt)
    np.testing.assert_allclose(reference, model, atol=1e-3)


@pytest.mark.parametrize("shaper", [ReferenceModel(0.5, max_rate=0.1, max_acceleration=0.05), TrackingFilter(0.5)])
def test_rate_and_acceleration_are_what_happens(shaper):
    shaper.start(3.0)
    out = run(shaper, step_to(-2.0), 60.0)
    turned = np.array([angle_change(*pair) for pair in zip([3.0, *out[:-1, 0]], out[:, 0], strict=True)])
    np.testing.assert_allclose(turned / H, out[:, 1], atol=1e-12)
    np.testing.assert_allclose(np.diff(np.r_[0.0, out[:, 1]]) / H, out[:, 2], atol=1e-12)
    assert np.all(out[:, 1] >= -1e-4)  # the short way: 3 rad to −2 rad is to starboard across ±180°
    assert out[-1, 0] == pytest.approx(-2.0, abs=1e-6)


@pytest.mark.parametrize("turn", [0.01, 0.5, 3.0, -3.0])
@pytest.mark.parametrize("dt", [0.01, 0.1, 1.0, 4.0])
def test_the_model_keeps_its_limits_and_does_not_overshoot(turn, dt):
    bandwidth, max_rate = 0.5, 0.1
    model = ReferenceModel(bandwidth, 1.0, max_rate, 0.28 * bandwidth * max_rate)
    model.start(1.0)
    out = run(model, step_to(1.0 + turn), 120.0, dt)
    progress = np.array([angle_change(1.0, angle) for angle in out[:, 0]]) / turn
    assert np.max(np.abs(out[:, 1])) <= max_rate and np.max(np.abs(out[:, 2])) <= 0.28 * bandwidth * max_rate + 1e-12
    assert np.max(progress) < 1.0 + 1e-3 and progress[-1] == pytest.approx(1.0, abs=1e-3)
    if abs(turn) == 3.0 and dt < 1.0:
        assert np.max(np.abs(out[:, 1])) == pytest.approx(max_rate)


def test_low_pass_is_exact_and_rate_free():
    for dt in (0.1, 0.5, 2.0):
        shaper = LowPass(20.0)
        shaper.start(-3.0)
        out = run(shaper, lambda t: (3.0, 0.01, 0.0), 40.0, dt)
        away = 2.0 * math.pi - 6.0
        assert angle_change(-3.0, out[-1, 0]) == pytest.approx(-away * (1.0 - math.exp(-2.0)), rel=1e-9)
        assert out[-1, 1] == pytest.approx(0.01 * (1.0 - math.exp(-2.0)), rel=1e-9)


@pytest.mark.parametrize("new", [lambda: LowPass(5.0), lambda: TrackingFilter(0.5), lambda: ReferenceModel(0.5)])
def test_starting_and_what_is_unknown(new):
    assert new().step(Reference(2.0, 0.0, 0.0), H) == pytest.approx((2.0, 0.0, 0.0))
    assert math.isnan(new().step(Reference(math.nan, 0.0, 0.0), H).angle)
    shaper = new()
    shaper.start(2.0 + 2.0 * math.pi, 0.3)
    held = shaper.step(Reference(math.nan, 0.0, 0.0), H)
    assert held == pytest.approx((2.0, 0.0, 0.0))
    shaper.start(1.0, 0.3)
    assert abs(shaper.step(Reference(1.0, 0.0, 0.0), 1e-6).angle - 1.0) < 1e-5


@pytest.mark.parametrize("shaper", [LowPass(2.0), TrackingFilter(0.5, 1.2), ReferenceModel(0.5, 1.2)])
def test_the_lag_is_that_behind_a_steady_turn(shaper):
    turn = 0.01
    angles = run(shaper, lambda t: (turn * t, 0.0, 0.0), 120.0)[:, 0]
    assert (turn * (120.0 - H) - angles[-1]) / turn == pytest.approx(shaper.lag, abs=1.1 * H)
    if isinstance(shaper, TrackingFilter):  # told the rate it does not lag
        assert run(shaper, lambda t: (turn * t, turn, 0.0), 120.0)[-1, 1] == pytest.approx(turn, rel=1e-6)
