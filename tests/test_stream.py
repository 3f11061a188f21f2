"""Structures fix by fix: the rows of `estimate`, and what is learned while sailing."""

import math
import time
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import steerway
from steerway.estimation import FiveStateFilter, InferredFilter, LearningFilter, Profile
from steerway.estimation.testing import prior_profile
from tests import scenes
from tests.reference_outputs.sorties import ONE, TWO
from tests.scenes import angle_error, straight, turning

NAMES = ("sog", "cog", "course_rate", "sog_std", "cog_std", "course_rate_std", "position_relative_std")


@cache
def sortie(seed=1, duration=200.0):
    scene = turning(1.5, 0.7, duration, seed=seed)
    return scene, scene.fixes(0.4, seed)


def profile():
    return scenes.small_craft()[2].profile


def streamed(estimator, fixes):
    """(n, 9) values, NIS and status of every row."""
    steps = np.diff(fixes.time, prepend=fixes.time[0])
    aids = np.column_stack([fixes.sog, fixes.cog, *np.full((3, len(fixes)), math.nan)])
    columns = steps, fixes.latitude, fixes.longitude, aids, fixes.position_std
    values, nis, status = zip(*(estimator.row(*row) for row in zip(*columns, strict=True)), strict=True)
    return np.array(values), np.array(nis), np.array(status)


def with_trouble(fixes):
    """A gap of a minute, behind which the receiver slides in from 100 m, a jump, and accuracy told of most fixes."""
    k = np.arange(len(fixes))
    late, slides = np.where(k < 400, 0.0, 60.0), np.where(k < 400, 0.0, 2e-5 * np.exp((400 - k) / 22.0))
    latitude = fixes.latitude + np.where(k == 700, 3e-6, 0.0) + slides
    std = np.where(k % 7 == 3, math.nan, np.where(k % 50 < 45, 0.4, 4.0))
    return replace(fixes, time=fixes.time + late, latitude=latitude, position_std=std)


PROFILES = {
    "one mode": ONE,
    "one mode at rest": ONE.model_copy(update={"position_std": 0.01, "course_rate_noise": 1e-5}),
    "two modes": TWO,
    "receiver errs": ONE.model_copy(update={"error_std": 0.7, "error_time": 20.0, "speed_decay": 0.05}),
    "swell": "swell",
    "inferred": None,
    "inferred, aided": None,
}


def with_velocity(scene, fixes, chosen):
    """The fixes with SOG and COG, and the profile with the numbers of their errors."""
    chance = np.random.default_rng(3)
    sog, cog = scene.sog + chance.normal(0.0, 0.1, len(fixes)), scene.cog + chance.normal(0.0, 0.05, len(fixes))
    extra = {"sog_std": 0.1, "sog_error_std": 0.05, "sog_error_time": 3.0}
    extra |= {"velocity_std": 0.1, "cog_error_std": 0.05, "cog_error_time": 3.0}
    aided = [{"parts": (*s.parts, "sog", "cog"), "values": s.values | extra} for s in chosen.structures]
    structures = (s.model_copy(update=more) for s, more in zip(chosen.structures, aided, strict=True))
    return replace(fixes, sog=sog, cog=cog), Profile.of(structures), ("sog", "cog")


@pytest.mark.parametrize("name", PROFILES)
def test_a_stream_is_the_record_whatever_the_profile(name):
    """By rows, and by predictions and updates."""
    fixes, chosen, aid = with_trouble(sortie()[1]), PROFILES[name] or profile(), ()
    if "aided" in name:
        fixes, chosen, aid = with_velocity(sortie()[0], fixes, chosen)
    if "at rest" in name:
        slow = straight(0.1, 0.4, 60.0).fixes(0.0, 1)
        fixes = with_trouble(slow.rows(slice(380)))
    motion = steerway.estimate(fixes, chosen, aid=aid, causal=True)
    values, nis, status = streamed(FiveStateFilter(chosen, aid), fixes)
    for column, found in zip(("latitude", "longitude", *NAMES), values.T, strict=True):
        np.testing.assert_allclose(found, getattr(motion, column), rtol=1e-9, atol=1e-12, err_msg=column)
    np.testing.assert_allclose(nis, motion.nis, rtol=1e-9)
    np.testing.assert_array_equal(status, motion.status)
    if aid:
        return
    estimator = FiveStateFilter(chosen)
    for k in range(300):
        estimator.predict(fixes.time[k] - fixes.time[k - 1] if k else 0.0)
        said = () if math.isnan(fixes.position_std[k]) else (fixes.position_std[k],)
        estimator.update(fixes.latitude[k], fixes.longitude[k], *said)
    np.testing.assert_allclose(estimator.output()[:8], values[k, :8], rtol=1e-9)


def test_a_snapshot_is_the_whole_filter():
    _, fixes = sortie()
    estimator, other = InferredFilter(profile()), InferredFilter(prior_profile())
    streamed(estimator, fixes.rows(slice(300)))
    kept = estimator.snapshot()
    other.restore(kept)
    rest = fixes.rows(slice(300, 400))
    expected = streamed(estimator, rest)[0]
    np.testing.assert_array_equal(streamed(other, rest)[0], expected)
    estimator.restore(kept)
    np.testing.assert_array_equal(streamed(estimator, rest)[0], expected)


@pytest.mark.study
def test_what_is_learned_is_nearly_what_estimate_infers():
    scene, fixes = sortie(2, 300.0)
    values, *_ = streamed(LearningFilter(background=False), fixes)
    motion = steerway.estimate(fixes, causal=True)
    rows = slice(500, None)
    errors = [angle_error(each, scene.cog)[rows] for each in (values[:, 3], motion.cog)]
    assert np.sqrt(np.nanmean(errors[0] ** 2)) < 1.15 * np.sqrt(np.nanmean(errors[1] ** 2))
    assert np.sqrt(np.mean((values[rows, 2] - scene.sog[rows]) ** 2)) < 0.02


def test_before_anything_is_learned_the_prior_serves():
    scene, fixes = sortie()
    values, *_ = streamed(InferredFilter(prior_profile(), learns=True), fixes)
    settled = slice(100, None)
    assert np.isfinite(values[settled, 3]).all()
    error = np.abs(values[settled, 2] - scene.sog[settled])
    assert np.mean(error < 1.96 * values[settled, 5]) > 0.9
    assert np.sqrt(np.mean(error**2)) < 0.05


@pytest.mark.parametrize("start", [None, ONE])
def test_the_estimate_makes_no_jump_when_something_is_learned(start):
    """From fix to fix the estimate changes no more in the seconds of the change than a fix changes it at most."""
    _, fixes = sortie(4, 90.0)
    found = []
    estimator, changed, sog = LearningFilter(start, background=False, keep=found.append), [], []
    for k in range(len(fixes)):
        before = len(estimator.snapshot()[0].structures)
        values, _, _ = estimator.row(0.2 if k else 0.0, fixes.latitude[k], fixes.longitude[k])
        changed.append(len(estimator.snapshot()[0].structures) != before)
        sog.append(values[2])
    steps = np.abs(np.diff(sog, prepend=sog[0]))
    changes = np.flatnonzero(changed)
    assert len(changes) >= 2
    assert steps[changes].max() <= np.nanquantile(steps[100:], 0.999)
    assert found == [estimator.learned] and found[0].name == "learned"
    assert all(0.3 < each.values["fix_std"] < 0.5 for each in found[0].structures)


@pytest.mark.study
def test_inferences_in_the_background_hold_nobody_up():
    _, fixes = sortie(2, 300.0)
    estimator, longest = LearningFilter(), 0.0
    for k in range(len(fixes)):
        begun = time.perf_counter()
        estimator.row(0.2 if k else 0.0, fixes.latitude[k], fixes.longitude[k])
        longest = max(longest, time.perf_counter() - begun)
        if k >= 310 and estimator.learned is None:
            time.sleep(0.01)
    assert estimator.learned is not None
    assert longest < 0.5
