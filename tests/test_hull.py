"""Under an antenna that rolls the stated motion is the hull's: commands say so, and compare like with like."""

import json
from dataclasses import replace

import numpy as np
import pytest

import steerway
from steerway.core import Fixes
from steerway.core.testing import displaced_all
from steerway.estimation import InferredProfile
from steerway.estimation.testing import WeighedStructure, compare, parameters_of
from tests.command_line import run

SPEED = 1.5
SWING = 0.1
PERIOD = 2.5


@pytest.fixture(scope="module")
def fixes():
    """North at 1.5 m/s, the antenna 0.1 m athwart; the receiver's velocity is that of its antenna, to 0.02 m/s."""
    time, rng = np.arange(0.0, 200.0, 0.2), np.random.default_rng(2)
    phase = 2.0 * np.pi * time / PERIOD
    east, across = SWING * np.sin(phase), SWING * 2.0 * np.pi / PERIOD * np.cos(phase)
    north, east = SPEED * time + rng.normal(0.0, 0.01, len(time)), east + rng.normal(0.0, 0.01, len(time))
    velocity = rng.normal(0.0, 0.02, (2, len(time))) + np.array([np.full(len(time), SPEED), across])
    placed = Fixes(1.7e9 + time, *displaced_all(0.9, 0.2, north, east))
    return replace(placed, sog=np.hypot(*velocity), cog=np.arctan2(*velocity[::-1]))


def profile(parts, **numbers):
    names, medians, _ = parameters_of(parts)
    values = dict(zip(names, np.exp(medians).tolist(), strict=True)) | numbers
    return InferredProfile(structures=(WeighedStructure(weight=1.0, parts=parts, values=values),))


ROLLS = profile(("base", "wander", "antenna"), fix_std=0.01, antenna_std=0.07, antenna_period=PERIOD, wander_std=1e-3)
STIFF = profile(("base", "wander"), fix_std=0.01)


def test_the_motion_is_the_hulls(fixes):
    motion = steerway.estimate(fixes, ROLLS).rows(slice(100, -100))
    assert np.degrees(np.sqrt(np.mean(motion.cog**2))) < 1.0, "the antenna's course swings by 9.5°"
    assert np.sqrt(np.mean((motion.sog - SPEED) ** 2)) < 0.01


def test_like_is_compared_with_like(fixes):
    """Means over the swing: what is left is noise, where the antenna's course itself is 7° (RMS) from the hull's."""
    motion = steerway.estimate(fixes, ROLLS)
    apart, alike = compare(fixes, motion), compare(fixes, motion, swing=4.0)
    assert np.degrees(apart.cog_rms) > 6.0 and np.degrees(alike.cog_rms) < 0.35 * np.degrees(apart.cog_rms)
    assert alike.compared == apart.compared
    vessels = replace(fixes, mmsi=np.repeat([211000001, 211000002], 500))
    two = compare(vessels, steerway.estimate(vessels, ROLLS), swing=4.0)
    assert np.degrees(two.cog_rms) < 0.5 * np.degrees(apart.cog_rms)


@pytest.mark.parametrize(("given", "is_of_hull"), [(ROLLS, True), (STIFF, False)])
def test_commands_say_whose_motion_it_is(fixes, given, is_of_hull, tmp_path):
    log, path = tmp_path / "log.csv", tmp_path / "mine.toml"
    steerway.write(fixes, log)
    given.save(path)
    _, out, _ = run("estimate", log, "--profile", path)
    assert ("of the hull, under an antenna that rolls" in out) == is_of_hull
    _, out, _ = run("compare", log, "--profile", path)
    assert ("means over 4 s are compared" in out) == is_of_hull
    _, out, _ = run("compare", log, "--profile", path, "--json")
    found = json.loads(out)
    assert found["of_hull"] == is_of_hull and found["smoothed"]
    assert (found["cog_rms_deg"] < 3.0) == is_of_hull
