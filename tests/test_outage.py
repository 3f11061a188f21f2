"""After an outage the receiver slides in: σ holds the vessel's velocity, and the summary names who says otherwise."""

import math
from dataclasses import replace

import numpy as np
import pytest

import steerway
from steerway.core import Fixes, wrap_array
from steerway.core.testing import displaced_all
from steerway.estimation import InferredProfile, Profile
from steerway.estimation.testing import infer_log
from steerway.report.testing import CONTRADICTED, episodes_of
from tests.command_line import run

SPEED, COURSE = 1.5, 0.35
PLAIN = Profile(speed_noise=5e-3, course_rate_noise=1e-3, course_rate_decay=0.2, position_std=0.3)


def sailed(slide=110.0, turned=0.0, seed=1) -> Fixes:
    """A straight voyage at 1 Hz with an outage of 20 s, behind which the fixes are off by `slide` m at first (east)."""
    time = np.r_[0.0:180.0, 200.0:380.0]
    course = COURSE + turned * (time >= 200.0)
    step = SPEED * np.diff(time, prepend=0.0)
    noise = np.random.default_rng(seed).standard_normal((4, len(time)))
    north = np.cumsum(step * np.cos(course)) + 0.3 * noise[0]
    east = np.cumsum(step * np.sin(course)) + 0.3 * noise[1]
    east += np.where(time >= 200.0, slide * np.exp(-(time - 200.0) / 4.4), 0.0)
    sog, cog = SPEED + 0.1 * noise[2], wrap_array(course + 0.05 * noise[3])
    return replace(Fixes(1.7e9 + time, *displaced_all(1.0, 0.3, north, east)), sog=sog, cog=cog)


@pytest.fixture(scope="module")
def fixes():
    return sailed()


@pytest.fixture(scope="module")
def inferred(fixes):
    return InferredProfile.of(infer_log(fixes).structures)


@pytest.mark.parametrize("smooth", [False, True])
def test_deviations_hold_the_velocity_while_the_receiver_slides_in(fixes, inferred, smooth):
    motion = steerway.estimate(fixes, inferred, smooth=smooth)
    since = motion.time - 1.7e9 - 200.0
    slides = (since >= 0.0) & (since < 19.0)
    error = np.abs(motion.sog - SPEED)
    assert error[slides].max() > 3.0, "the positions do go so fast"
    assert np.mean(error[slides] < 1.96 * motion.sog_std[slides]) >= 0.9
    assert np.nanmax(np.abs(wrap_array(motion.cog - COURSE))[slides] / motion.cog_std[slides]) < 2.5
    usual = motion.sog_std[(since > 40.0) | (since < -40.0)]
    assert np.nanmedian(usual) < 0.2 and np.max(usual[20:]) < 0.5


def test_who_only_turned_meanwhile_keeps_the_course():
    motion = steerway.estimate(sailed(slide=0.0, turned=1.5), PLAIN, causal=True)
    since = motion.time - 1.7e9 - 200.0
    assert np.isfinite(motion.cog[(since > 6.0) & (since < 20.0)]).all()


def test_the_summary_names_the_receivers_own_speed_where_it_contradicts(fixes, inferred, tmp_path):
    contradicted = [
        each for each in episodes_of(fixes, steerway.estimate(fixes, inferred)) if each.kind == CONTRADICTED
    ]
    assert len(contradicted) == 1 and 199.0 <= contradicted[0].start - 1.7e9 <= 205.0
    still = sailed(slide=0.0)
    assert not any(each.kind == CONTRADICTED for each in episodes_of(still, steerway.estimate(still, inferred)))
    log, profile = tmp_path / "log.csv", tmp_path / "mine.toml"
    steerway.write(fixes, log)
    inferred.save(profile)
    code, out, _ = run("estimate", log, "--profile", profile)
    assert code == 0 and "its own SOG contradicts the estimate in" in out and "(use --aid auto)" in out


def test_its_own_speed_is_taken_where_asked_for(fixes, inferred):
    """What fixes of a receiver that slides in say against its velocity does not count."""
    slides = (fixes.time >= 1.7e9 + 200.0) & (fixes.time < 1.7e9 + 215.0)
    alone, aided = steerway.estimate(fixes, inferred), steerway.estimate(fixes, aid=("auto",))
    error = [math.sqrt(np.mean((each.sog[slides] - SPEED) ** 2)) for each in (alone, aided)]
    assert error[1] < 0.3 * error[0]
