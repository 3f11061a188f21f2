"""Currents, wind and waves: of the size and the memory that were asked for, and pointing where they should."""

import math

import numpy as np
import pytest

from steerway.vessels import Current, Environment, Nomoto, Otter
from steerway.vessels.testing import AIR_DENSITY, Waves, Wind


def run(environment, n, step=0.1, seed=0, motion=None):
    """Conditions (n, 5) and wave motions (n, 4)."""
    sea = environment.start(seed, step)
    conditions, waves = np.empty((n, 5)), np.empty((n, 4))
    for k in range(n):
        conditions[k], waves[k] = sea.conditions, sea.waves
        sea.advance(motion)
    return conditions, waves


def test_constant_parts_are_constant_and_point_where_they_go():
    environment = Environment(current=Current(speed=0.5, direction_deg=90.0), force=(3.0, -4.0), moment=2.0)
    conditions, _ = run(environment, 5)
    np.testing.assert_allclose(conditions, np.tile([0.0, 0.5, 3.0, -4.0, 2.0], (5, 1)), atol=1e-15)


def test_a_wandering_current_and_a_varying_force_have_their_spread_and_memory():
    current = Current(speed=0.5, std=0.1, time_constant=20.0)
    environment = Environment(current=current, force=(0.3, 0.0), force_std=(2.0, 1.0), moment_std=0.5, force_time=5.0)
    conditions, _ = run(environment, 60_000)
    assert (np.abs(conditions.mean(axis=0) - [0.5, 0.0, 0.3, 0.0, 0.0]) < [0.02, 0.02, 0.2, 0.1, 0.05]).all()
    np.testing.assert_allclose(conditions.std(axis=0), [0.1, 0.1, 2.0, 1.0, 0.5], rtol=0.1)
    for part, lag in zip(conditions.T, (200, 200, 50, 50, 50), strict=True):
        assert np.corrcoef(part[lag:], part[:-lag])[0, 1] == pytest.approx(math.exp(-1.0), abs=0.1)


@pytest.mark.parametrize("before_the_wind", [True, False])
def test_a_vessel_before_the_wind_feels_less_of_it(before_the_wind):
    blows_from, sailing = 2.5, Nomoto(1.0, 1.0, speed=4.0)
    motion = sailing.motion(sailing.start(heading=blows_from + math.pi * before_the_wind), np.zeros(5))
    wind = Wind(speed=10.0, direction_deg=math.degrees(blows_from), drag_area=0.5)
    conditions, _ = run(Environment(wind=wind), 2, motion=motion)
    over_deck = np.array([10.0, 6.0 if before_the_wind else 14.0])  # before the first step the vessel lies still
    push = 0.5 * AIR_DENSITY * 0.5 * over_deck**2
    expected = np.outer(push, [-math.cos(blows_from), -math.sin(blows_from)])
    np.testing.assert_allclose(conditions[:, 2:4], expected, atol=1e-12)


def test_wind_on_a_forward_arm_turns_the_bow_away():
    boat = Otter()
    motion = boat.motion(boat.start(heading=0.0), np.zeros(5))
    wind = Wind(speed=10.0, direction_deg=90.0, drag_area=0.5, arm=0.3)
    conditions, _ = run(Environment(wind=wind), 2, motion=motion)
    assert conditions[1, 4] == pytest.approx(0.3 * conditions[1, 3])
    assert conditions[1, 4] < 0.0  # wind from the east, heading north: the bow falls off to port


def test_waves_have_their_spread_and_period_and_go_one_way():
    frequency = 1.5
    waves = Waves(
        direction_deg=math.degrees(0.7), frequency=frequency, displacement_std=0.3, roll_std_deg=6.0, pitch_std_deg=3.0
    )
    _, motion = run(Environment(waves=waves), 60_000)
    away = motion[:, 0] * math.cos(0.7) + motion[:, 1] * math.sin(0.7)
    across = motion[:, 1] * math.cos(0.7) - motion[:, 0] * math.sin(0.7)
    np.testing.assert_allclose([away.std(), *np.degrees(motion[:, 2:].std(axis=0))], [0.3, 6.0, 3.0], rtol=0.08)
    np.testing.assert_allclose(across, 0.0, atol=1e-15)
    spectrum = np.abs(np.fft.rfft(away)) ** 2
    omega = 2.0 * math.pi * np.fft.rfftfreq(len(away), 0.1)
    near = (omega > frequency - 0.5) & (omega < frequency + 0.5)
    assert spectrum[near].sum() > 0.75 * spectrum.sum()
    assert omega[near] @ spectrum[near] / spectrum[near].sum() == pytest.approx(frequency, abs=0.05)
