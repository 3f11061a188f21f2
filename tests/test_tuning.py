"""The tuner: vessels and receivers are found, with intervals; no fit predicts worse than the default."""

import json
from dataclasses import replace

import numpy as np
import pytest

import steerway
from steerway import estimation
from steerway.estimation import InferredProfile, Profile, choose_profile, load_profile, log_likelihood, tune
from steerway.estimation.testing import motion_of
from steerway.sensors import Gnss
from steerway_studies.testing import FAST
from steerway_studies.testing import scenarios_sail as sail
from tests.command_line import run

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
def test_the_default_is_what_a_log_without_the_fixes_held_back_shows(sortie):
    fixes, tuned = sortie
    cut = len(fixes) - tuned.held_back
    default = choose_profile(fixes.rows(np.arange(cut)))
    likelihood = log_likelihood(fixes, default, fixes.time[cut])
    assert likelihood == pytest.approx(tuned.default_held_back_log_likelihood, rel=1e-9)


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
