"""What is inferred and tuned from a log: on scenes of known motion, with intervals, as a file and by the commands."""

import itertools
import json
import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import steerway
from steerway import Fixes, estimation
from steerway.core import OK, REJECTED
from steerway.core.testing import NO_COURSE, PREDICTED, STARTING
from steerway.estimation import InferredProfile, Profile, load_profile, tune
from steerway.estimation.testing import LogEstimator, laid_out, motion_of, whole_log
from steerway.sensors import Gnss
from steerway_studies.testing import FAST
from steerway_studies.testing import scenarios_sail as sail
from tests import scenes
from tests.command_line import run
from tests.scenes import EPOCH, HOME, STD, angle_error, sailed, straight, turning

SETTLED = 100


def small_craft(seed):
    return turning(1.5, 0.7, 200.0, seed=seed), STD


@cache
def ship(seed):
    """A ship that holds its course between steady turns, 1 Hz."""
    rate = np.zeros(1200)
    for begin in (200, 550, 900):
        rate[begin : begin + 90] = math.radians(0.8 if (begin + seed) % 100 else -0.8)
    return sailed(np.full(1200, 6.0), 2.0 + np.cumsum(rate), 1.0), 1.5


@cache
def planing_craft(seed):
    """A craft of 8 m/s that stops at 3 m/s² and accelerates again, 10 Hz, a good receiver."""
    pull = np.zeros(1500)
    pull[600:626] = -3.0
    pull[900:978] = 1.0
    return sailed(8.0 + 0.1 * np.cumsum(pull), 0.3 + 0.02 * np.sin(np.arange(1500) / 40.0 + seed), 10.0), 0.05


SCENES = {each.__name__: each for each in (small_craft, ship, planing_craft)}
EVERY_SCENE = ["small_craft", *(pytest.param(name, marks=pytest.mark.study) for name in ("ship", "planing_craft"))]


@cache
def estimator_of(name):
    """With what is inferred from the scene's first voyage."""
    scene, std = SCENES[name](1)
    return scenes.small_craft()[2] if name == "small_craft" else LogEstimator(scene.fixes(std, 1))


@cache
def estimated(name, seed, smooth=False):
    scene, std = SCENES[name](seed)
    return scene, estimator_of(name).motion(scene.fixes(std, seed), smooth=smooth)


def rms(errors):
    return math.sqrt(np.nanmean(errors[SETTLED:] ** 2))


def turned(scene, angle, home=HOME):
    """The scene turned by an angle, elsewhere."""
    c, s = math.cos(angle), math.sin(angle)
    north, east = c * scene.north - s * scene.east, s * scene.north + c * scene.east
    return replace(scene, north=north, east=east, cog=scene.cog + angle, home=home)


def noisy():
    """A scene whose noise turns with it."""
    scene, std = small_craft(1)
    noise = np.random.default_rng(1).normal(0.0, std, (2, len(scene.time)))
    return replace(scene, north=scene.north + noise[0], east=scene.east + noise[1])


@pytest.mark.parametrize(
    ("angle", "home"),
    [(2.0, HOME), (0.0, (math.radians(-20.0), math.radians(40.0))), (1.0, (math.radians(50.0), math.pi - 2e-6))],
    ids=["turned", "elsewhere", "over the antimeridian"],
)
def test_place_and_direction_change_nothing(angle, home):
    fixes, elsewhere = noisy().fixes(0.0, 0), turned(noisy(), angle, home).fixes(0.0, 0)
    place = laid_out(elsewhere.latitude, elsewhere.longitude)
    assert np.hypot(np.diff(place.first), np.diff(place.second)).max() < 3.0
    for smooth in (False, True):
        usual, other = (estimator_of("small_craft").motion(each, smooth=smooth) for each in (fixes, elsewhere))
        np.testing.assert_array_equal(usual.status, other.status)
        known = np.isfinite(usual.cog)
        assert np.abs(usual.sog - other.sog)[known].max() < 1e-3
        assert angle_error(usual.cog + angle, other.cog)[known].max() < math.radians(0.1)


def test_a_straight_course_leads_over_the_pole():
    from_pole = (np.arange(300) - 150.0) * 1e-6 + 3e-7  # rad, some 6.4 m a step
    noise = np.random.default_rng(3).normal(0.0, 1e-8, 300)
    latitude = 0.5 * math.pi - np.abs(from_pole) - noise
    longitude = np.where(from_pole < 0.0, 0.4, 0.4 - math.pi)
    for smooth in (False, True):
        motion = estimator_of("small_craft").motion(Fixes(EPOCH + np.arange(300.0), latitude, longitude), smooth=smooth)
        assert abs(np.mean(motion.sog[20:]) - 6.3996) < 0.02
        assert (np.abs(motion.sog - 6.3996) < 4.0 * motion.sog_std)[20:].all()
        before, after = motion.cog[20:148], motion.cog[152:]
        assert np.abs(before).max() < 0.05
        assert angle_error(after, math.pi).max() < 0.05
        assert (motion.status[20:] == OK).all()
        np.testing.assert_allclose(motion.latitude, latitude, atol=1e-7)


@pytest.mark.parametrize("name", EVERY_SCENE)
def test_outliers_are_refused_and_good_fixes_kept(name):
    scene, std = SCENES[name](2)
    rng = np.random.default_rng(7)
    wrong = np.zeros(len(scene.time), bool)
    wrong[rng.choice(np.arange(50, len(wrong)), len(wrong) // 100, replace=False)] = True
    direction, way = rng.uniform(-math.pi, math.pi, len(wrong)), rng.uniform(40.0, 100.0, len(wrong))
    offset = np.where(wrong, way * std, 0.0) * np.array([np.cos(direction), np.sin(direction)])
    motion = estimator_of(name).motion(scene.fixes(std, 2, lambda _: offset))
    refused = motion.status == REJECTED
    assert refused[wrong].mean() >= 0.9
    assert (refused & ~wrong).sum() <= max(3, 0.001 * len(wrong))


@pytest.mark.study
def test_noise_that_grows_a_hundredfold_is_no_motion():
    """From 0.1 m to 5 m and back, by and by. By a noise of one size SOG is off by 2.2 m/s, and 15 fixes are refused."""
    scene = straight(1.5, 0.4, 600.0)
    since = np.abs((scene.time - scene.time[0]) % 200.0 - 100.0)
    noise = 5.0 * 0.01 ** (since / 100.0) * np.random.default_rng(3).normal(size=(2, len(since)))
    motion = steerway.estimate(scene.fixes(0.1, 3, lambda _: noise), causal=True)
    assert np.abs(motion.sog - 1.5)[SETTLED:].max() < 0.3
    assert (motion.status == REJECTED).sum() <= 3


@pytest.mark.study
def test_a_crash_stop_is_followed():
    scene, motion = estimated("planing_craft", 1)
    assert (motion.status == REJECTED).sum() <= 3
    errors = motion.sog - scene.sog
    assert rms(errors) < 0.25
    assert np.abs(errors[660:890]).max() < 0.5


@pytest.mark.parametrize("name", EVERY_SCENE)
def test_deviations_hold_the_errors(name):
    for smooth, what in itertools.product((False, True), ("sog", "cog")):
        inside = []
        for seed in (1, 2):
            scene, motion = estimated(name, seed, smooth)
            error = motion.sog - scene.sog if what == "sog" else angle_error(motion.cog, scene.cog)
            known = np.isfinite(error) & (scene.sog > 0.5)
            known[:SETTLED] = False
            inside.append((np.abs(error) < 1.96 * getattr(motion, f"{what}_std"))[known].mean())
        assert np.mean(inside) >= (0.85 if smooth else 0.88)
        assert min(inside) >= 0.78


def test_copies_are_predicted_and_cost_nothing():
    scene, std = small_craft(1)
    fixes = scene.fixes(std, 1)
    held = fixes.rows(np.repeat(np.arange(len(fixes)), 2))
    held = replace(held, time=EPOCH + 0.1 * np.arange(len(held)))
    motion = estimator_of("small_craft").motion(held)
    assert (motion.status[21::2] == PREDICTED).mean() > 0.95  # one of a fix that hardly differs is no evident copy
    assert (motion.status[20::2] == OK).all()
    usual = rms(angle_error(estimated("small_craft", 1)[1].cog, scene.cog))
    assert rms(angle_error(motion.cog[::2], scene.cog)) < 1.1 * usual


def test_blocks_of_a_long_record_join(monkeypatch):
    _, fixes, estimator = scenes.small_craft()
    whole = [estimator.motion(fixes, smooth=smooth) for smooth in (False, True)]
    monkeypatch.setattr(whole_log, "_BLOCK", 300)
    monkeypatch.setattr(whole_log, "_OVERLAP", 200)
    parts = [estimator.motion(fixes, smooth=smooth) for smooth in (False, True)]
    np.testing.assert_allclose(parts[0].sog, whole[0].sog, rtol=1e-9)
    np.testing.assert_array_equal(parts[0].status, whole[0].status)
    np.testing.assert_allclose(parts[1].sog, whole[1].sog, atol=0.2 * whole[1].sog_std.min())


@pytest.mark.parametrize("n", [2, pytest.param(5, marks=pytest.mark.study), 20])
def test_little_evidence_is_enough_for_an_estimate(n):
    fixes = straight(2.0, 1.0, 60.0, 1.0).fixes(0.3, 5).rows(slice(n))
    estimator = LogEstimator(fixes)
    for smooth in (False, True):
        motion = estimator.motion(fixes, smooth=smooth)
        assert len(motion) == len(fixes)
        assert np.isfinite(motion.position_std).all()
        for name in ("sog", "cog", "course_rate"):
            known = np.isfinite(getattr(motion, name))
            np.testing.assert_array_equal(known, np.isfinite(getattr(motion, f"{name}_std")))
        assert np.isfinite(motion.sog[motion.status != STARTING]).all()


def test_a_vessel_at_one_place_is_at_rest():
    fixes = Fixes(EPOCH + np.arange(200.0), np.full(200, HOME[0]), np.full(200, HOME[1]))
    motion = estimator_of("small_craft").motion(fixes)
    assert (motion.status[10:] == NO_COURSE).all()
    assert motion.sog[-1] < 3.0 * motion.sog_std[-1] < 0.3


def test_rows_at_a_rate_and_gaps():
    fixes = straight(2.0, 1.0, 120.0, 1.0).fixes(0.3, 5)
    late = replace(fixes, time=np.where(np.arange(121) < 60, fixes.time, fixes.time + 4000.0))
    for smooth in (False, True):
        dense = estimator_of("small_craft").motion(late, rate=4.0, smooth=smooth)
        usual = estimator_of("small_craft").motion(late, smooth=smooth)
        steps = np.diff(dense.time)
        assert (steps < 4000.0).sum() == len(dense) - 2
        np.testing.assert_allclose(steps[steps < 4000.0], 0.25, atol=1e-4)
        at_fixes = np.isin(dense.time, late.time)
        assert (dense.status[~at_fixes] != OK).all() and (dense.status[~at_fixes] == PREDICTED).mean() > 0.9
        settled = (usual.time - usual.time[0] > 15.0) & (np.abs(usual.time - late.time[60]) > 15.0)
        difference = np.abs(dense.sog[at_fixes] - usual.sog) / usual.sog_std
        assert difference[settled].max() < 0.3
        if not smooth:
            assert (np.diff(dense.position_std[201:204]) > 0.0).all(), "uncertainty grows until the next fix"
    assert usual.status[60] != REJECTED


def test_estimate_and_info_name_what_was_inferred(tmp_path):
    path = tmp_path / "track.csv"
    steerway.write(straight(2.0, 1.0, 90.0, 1.0).fixes(0.3, 5), path)
    summary = json.loads(run("estimate", path, "--json")[1])
    assert summary["profile"] == "inferred"
    assert math.isclose(sum(each["weight"] for each in summary["structures"]), 1.0, rel_tol=1e-9)
    assert {"parts", "weight", "log_evidence", "values", "words"} == set(summary["structures"][0])
    named = json.loads(run("estimate", path, "--json", "--profile", "small-usv")[1])
    assert named["profile"] == "small-usv" and named["structures"] == []
    code, printed, _ = run("info", path, "--models")
    assert code == 0 and "log evidence" in printed
    (found,) = json.loads(run("info", path, "--models", "--json")[1])
    models = found["inferred"]["models"]
    assert found["inferred"]["fixes"] == 91 and len(models) >= 3
    assert math.isclose(sum(each["weight"] for each in models), 1.0, rel_tol=1e-6)


@pytest.mark.study
def test_a_ship_that_slows_down_between_fixes_far_apart_is_followed():
    """Two changes of speed between fixes 30 s apart: from three starts they are fitted as outliers, SOG 0.49 m/s off
    and a fix refused."""
    time = np.arange(0.0, 5401.0, 30.0)
    slowed, hurried = (np.exp(-np.maximum(time - begin, 0.0) / 60.0) for begin in (1800.0, 3600.0))
    rate = np.radians(np.where(time % 1100.0 > 900.0, 0.5, 0.0))
    scene = sailed(10.0 - 5.0 * (hurried - slowed), 30.0 * np.cumsum(rate), 1.0 / 30.0)
    motion = steerway.estimate(scene.fixes(2.0, 2), causal=True)
    assert (motion.status != REJECTED).all()
    assert np.sqrt(np.mean((motion.sog - scene.sog)[10:] ** 2)) < 0.15


ONE = Profile(speed_noise=1e-3, course_rate_noise=1e-3, course_rate_decay=0.3, position_std=0.3)


def one_mode(seed, duration=600.0):
    """A sortie whose speed and course rate wander as ONE has it, with its receiver."""
    never = {"turn_time": 1.0, "straight_time": 1e9, "turn_speed_noise": 1.0, "turn_course_rate_noise": 1.0}
    scenario = replace(FAST, profile=ONE.model_copy(update=never), duration=duration, rate=2.0, speed=4.0)
    return sail(scenario, seed).fixes(Gnss(rate=scenario.rate, white=0.3), seed)


@pytest.fixture(scope="module")
def sortie():
    """A log and what `tune` finds in it."""
    fixes = one_mode(3, 180.0)
    return fixes, tune(fixes, name="made")


def test_what_is_found_predicts_no_worse_than_the_default(sortie):
    fixes, tuned = sortie
    assert tuned.held_back_log_likelihood >= tuned.default_held_back_log_likelihood
    assert tuned.held_back == pytest.approx(0.2 * len(fixes), abs=1)
    assert steerway.estimate(fixes, tuned.profile, causal=True).time.shape == fixes.time.shape


@pytest.mark.study
def test_the_noise_of_the_receiver_lies_in_its_intervals(sortie):
    """A receiver of 0.3 m, in every structure of five logs."""
    found = [sortie[1], *(tune(one_mode(seed, 300.0)) for seed in (5, 7, 9, 12))]
    structures = [each for tuned in found for each in tuned.profile.structures]
    assert all(each.is_determined("fix_std") for each in structures)
    low, high = np.array([each.intervals["fix_std"] for each in structures]).T
    assert np.mean((low < 0.3) & (high > 0.3)) >= 0.85


def test_what_a_log_determines_is_found_and_what_it_does_not_is_named(sortie):
    _, tuned = sortie
    assert all(each.values["fix_std"] == pytest.approx(0.3, rel=0.13) for each in tuned.profile.structures)
    assert "emergency_every" in tuned.cannot_tell, "no craft stops for her life here"


def test_a_profile_of_structures_survives_a_file_and_serves_another_log(sortie, tmp_path):
    _, tuned = sortie
    path = tmp_path / "boat.toml"
    tuned.profile.save(path)
    assert load_profile(path) == Profile.load(path) == InferredProfile.load(path) == tuned.profile
    other = one_mode(11, 200.0)
    by_file, by_object = steerway.estimate(other, path, causal=True), motion_of(other, tuned.profile)
    np.testing.assert_array_equal(by_file.sog, by_object.sog)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"wander"', '"wonder"', "part 'wonder' is unknown"),
        ("weight = ", "weight = 1", "the weights of the structures add up to"),
    ],
)
def test_a_wrong_profile_of_structures_is_named(sortie, tmp_path, old, new, message):
    path = tmp_path / "boat.toml"
    path.write_text(sortie[1].profile.toml().replace(old, new, 1), encoding="utf-8")
    with pytest.raises(steerway.InputError, match=r"profile .*boat\.toml: ") as error:
        load_profile(path)
    assert message in str(error.value)


def test_the_command_line_shows_intervals(sortie, tmp_path, monkeypatch):
    log, made = tmp_path / "sortie.csv", tmp_path / "made.toml"
    steerway.write(sortie[0], log)
    monkeypatch.setattr(estimation, "tune", lambda fixes, **_: sortie[1])
    code, out, _ = run("profile", "make", log, "-o", made)
    assert code == 0 and "result" in out and "2 expected" in out and load_profile(made) == sortie[1].profile
    assert "[structures.intervals]" in run("profile", "show", made)[1]
    shown = json.loads(run("profile", "show", made, "--json")[1])["structures"][0]
    assert shown["intervals"]["fix_std"][0] < shown["values"]["fix_std"] < shown["intervals"]["fix_std"][1]
    assert Profile.named("small-usv").toml().count("#") == 0
