"""The study of adaptive speed: how it judges, and the paper's arguments."""

import math

import numpy as np
import pytest

from steerway_studies.testing import printed, sailing

TIME = np.arange(0.0, 200.05, 0.1)


def test_settling_is_the_last_exit():
    speed = np.where(TIME < 30.0, 0.0, 3.0)
    assert sailing.settling(TIME, speed, 3.0) == pytest.approx(30.0)
    speed[700:705] = 3.1
    assert sailing.settling(TIME, speed, 3.0) == pytest.approx(70.5)
    assert sailing.settling(TIME, np.full_like(TIME, 3.0), 3.0) == 0.0
    assert sailing.settling(TIME, np.full_like(TIME, 2.9), 3.0) == math.inf
    assert sailing.settling(TIME, np.full_like(TIME, np.nan), 3.0) == math.inf


def test_overshoot_and_tail():
    speed = np.where((TIME > 50.0) & (TIME < 60.0), 3.15, 3.0)
    assert sailing.overshoot_pct(speed, 3.0) == pytest.approx(5.0)
    assert sailing.overshoot_pct(np.full(9, 2.0), 3.0) == 0.0
    speed[-50] = 2.97
    assert sailing.tail_pct(TIME, speed, 3.0) == pytest.approx(1.0)


def test_lyapunov_holds_for_constant_g_and_not_for_a_propeller():
    inner = slice(2, -2)
    held = printed.descent(3.0, constant=True, duration=20.0)
    np.testing.assert_allclose(held.derivative[inner], held.claimed[inner], atol=1e-5 * np.abs(held.claimed).max())
    free = printed.descent(3.0, constant=False, duration=20.0)
    assert free.derivative[inner].max() > np.abs(free.claimed).max()
