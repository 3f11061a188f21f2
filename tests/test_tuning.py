"""The tuner: known motion and receivers are found, with intervals that hold them."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import steerway
from steerway.core.earth import displacement
from steerway.estimation import Profile, choose_profile, tune
from steerway.estimation.prediction import predict
from steerway.estimation.selection import stages
from steerway.estimation.selection.excerpts import informative, moving
from steerway.estimation.selection.intervals import _curvature, intervals
from steerway.estimation.selection.likelihood import cost
from steerway.estimation.selection.parameters import MOTION, TURNS
from steerway.estimation.selection.rounding import rounding_std
from steerway.estimation.selection.search import Search, minimise
from steerway.sensors.gnss import Gnss
from steerway_studies.estimator_limits.scenarios import FAST, SLOW, sail
from steerway_studies.estimator_limits.troubles import BEGIN, standstill
from tests.command_line import run
from tests.scenes import angle_error, sailed, turning

SHIP = replace(FAST, rate=1.0)
ONE = Profile(speed_noise=1e-3, course_rate_noise=1e-3, course_rate_decay=0.3, position_std=0.3)


def logged(scenario, seed, **receiver):
    """Fixes of one voyage at the scenario's rate."""
    return sail(scenario, seed).fixes(Gnss(rate=scenario.rate, **receiver), seed)


def one_mode(seed, duration=600.0):
    """A sortie whose speed and course rate wander as ONE has it, with its receiver."""
    never = {"turn_time": 1.0, "straight_time": 1e9, "turn_speed_noise": 1.0, "turn_course_rate_noise": 1.0}
    scenario = replace(FAST, profile=ONE.model_copy(update=never), duration=duration, rate=2.0, speed=4.0)
    return logged(scenario, seed, white=0.3)


@pytest.fixture(scope="module")
def ship():
    return tune(logged(SHIP, 4, white=0.5), name="ship")


def test_two_modes_are_found_with_their_numbers(ship):
    known = SHIP.known(0.5)
    assert set(ship.profile.intervals) == {*MOTION, *TURNS}
    missed = [name for name, (low, high) in ship.profile.intervals.items() if not low <= getattr(known, name) <= high]
    assert len(missed) <= 1
    assert ship.profile.is_determined("position_std") and ship.profile.is_determined("course_rate_noise")
    assert ship.nis_band[0] - 0.1 < ship.nis_mean < ship.nis_band[1] + 0.1
    assert ship.rejected < 15


def test_one_mode_stays_one():
    assert tune(one_mode(3)).profile.turn_time == 0.0


def test_a_slow_error_of_the_receiver_is_found_and_not_taken_for_motion():
    fixes = logged(replace(FAST, duration=900.0), 2, white=0.1, markov=((0.5, 10.0),))
    p = tune(fixes).profile
    assert 0.08 < p.position_std < 0.12
    assert 0.3 < math.hypot(p.error_std, p.drift_std) < 1.0
    assert p.course_rate_noise < 1e-5


def test_intervals_hold_the_truth_and_shrink_with_the_log():
    held, widths = [], {}
    for duration in (200.0, 800.0):
        for seed in range(6):
            found = tune(one_mode(seed, duration)).profile.intervals
            held += [found[name][0] <= getattr(ONE, name) <= found[name][1] for name in MOTION]
            width = [math.log(found[name][1] / found[name][0]) for name in MOTION]
            widths.setdefault(duration, []).append(width)
    assert 0.85 <= np.mean(held) <= 1.0
    shorter, longer = (np.median(each, axis=0) for each in widths.values())
    assert np.all(longer < 0.75 * shorter)
    assert shorter[0] < 0.5, "white noise is told well by any log"


def test_a_log_without_turns_cannot_tell_them(tmp_path):
    tuned = tune(sail(replace(SLOW, duration=150.0), 2).fixes(Gnss(white=0.5), 2))
    assert tuned.cannot_tell
    lines = tuned.profile.toml().splitlines()
    for name in tuned.profile.intervals:
        line = next(each for each in lines if each.startswith(f"{name} = "))
        assert ("not determined" in line) == (name in tuned.cannot_tell)
    told = dict(tuned.sentences())
    assert "not determined" in told
    assert set(tuned.as_dict()["cannot_tell"]) == set(tuned.cannot_tell)
    tuned.profile.save(tmp_path / "mine.toml")
    assert Profile.load(tmp_path / "mine.toml") == tuned.profile


def test_the_command_line_shows_intervals(tmp_path):
    log, made = tmp_path / "sortie.csv", tmp_path / "made.toml"
    steerway.write(one_mode(5, 300.0), log)
    code, out, _ = run("profile", "make", log, "-o", made)
    assert code == 0 and " to " in out
    assert "[intervals]" in run("profile", "show", made)[1]
    shown = json.loads(run("profile", "show", made, "--json")[1])
    assert shown["intervals"]["position_std"][0] < 0.3 < shown["intervals"]["position_std"][1]
    assert Profile.named("small-usv").toml().count("#") == 0


def search_for(target, rows=400, weight=1.0):
    """Rows of least −log likelihood where log position_std and log speed_noise are at `target` (rows, 2)."""

    def row_nll(profile):
        logs = np.log([profile.position_std, profile.speed_noise])
        return 0.5 * weight * ((logs - target) ** 2).sum(axis=1)

    wide = {"position_std": (1.0, 100.0), "speed_noise": (1.0, 100.0)}
    limits = {"position_std": (1e-3, 1e3), "speed_noise": (1e-3, 1e3)}
    return Search(row_nll, ONE, ("position_std", "speed_noise"), wide, limits)


def test_the_search_finds_the_least_and_the_interval_its_width():
    target = np.random.default_rng(1).normal([1.0, -2.0], 1.0, (400, 2))
    fit = minimise(search_for(target), ONE)
    assert fit.logs == pytest.approx(target.mean(axis=0), abs=0.02)
    found = intervals(fit)
    assert math.log(found["position_std"][1] / found["position_std"][0]) == pytest.approx(2 * 2.09 / 20.0, rel=0.5)


def test_the_curvature_is_that_of_a_parabola_with_a_ridge():
    slant = np.array([[1.0, 0.9], [0.0, 0.4]])

    def row_nll(profile):
        logs = slant @ np.log([profile.position_std, profile.speed_noise])
        return np.full(100, 0.5 * logs @ logs)

    search = replace(search_for(np.zeros((1, 2))), row_nll=row_nll)
    fit = minimise(search, ONE)
    assert _curvature(fit) == pytest.approx(100.0 * slant.T @ slant + np.diag(1.0 / search.prior[1]), rel=1e-6)


def test_rows_that_go_together_count_as_fewer():
    """Twenty-five rows in a stretch say the same: the interval is five times wider than the curvature has it."""
    alone = np.random.default_rng(2).normal(0.0, 1.0, (400, 2))
    together = np.repeat(alone[:40], 25, axis=0)
    widths = []
    for target in (alone, together[:1000]):
        found = intervals(minimise(search_for(target), ONE))["position_std"]
        widths.append(math.log(found[1] / found[0]))
    assert 1.8 < widths[1] / widths[0] < 5.0  # 40 independent rows against 400: √10


def test_a_search_keeps_within_its_bounds():
    """The truth lies beyond: the search ends at the bound, and the other parameter is found all the same."""
    target = np.random.default_rng(3).normal([math.log(2e3), -2.0], 1.0, (400, 2))
    fit = minimise(search_for(target), ONE.model_copy(update={"position_std": 300.0}))
    assert fit.logs[0] == pytest.approx(math.log(1e3))
    assert fit.logs[1] == pytest.approx(target[:, 1].mean(), abs=0.02)


def test_the_likelihood_has_no_steps():
    """Fixes on the verge of the gate: the cost follows the noise without jumps."""
    scene = turning(4.0, 0.5, 300.0, seed=1)
    fixes = scene.fixes(0.5, 1)
    costs = [cost(ONE.model_copy(update={"position_std": 0.45 * math.exp(1e-3 * k)}), fixes) for k in range(60)]
    bends = np.abs(np.diff(costs, 2))
    assert bends.max() < 4.0
    assert costs[-1] < costs[0]


def test_stretches_are_those_under_way():
    rest, way = sailed(np.zeros(1000), np.zeros(1000)), sailed(np.full(1000, 3.0), np.zeros(1000))
    parts = [rest, way, rest, way, rest]
    columns = {
        name: np.concatenate([getattr(p.fixes(0.1, 1), name) for p in parts]) for name in ("latitude", "longitude")
    }
    fixes = steerway.Fixes(np.arange(5000) / 5.0, **columns)
    log = stages.Evidence(fixes, moving(fixes)).excerpt(2, 1000)
    assert log.counted.mean() > 0.95
    assert [len(track) for _, track in log.fixes.tracks()] == [1000, 1000]


def test_a_vessel_that_stops_is_known_to_stop():
    """One who hardly changes her speed, but for once: the filter takes it from the log that she does."""
    for seed in (0, 6, 8):
        voyage = sail(SLOW, seed)
        fixes = voyage.fixes(Gnss(rate=SLOW.rate, white=0.5), seed)
        voyage, fixes = standstill(voyage, fixes, np.random.default_rng(seed))
        motion = steerway.estimate(fixes)
        resting = (motion.time > BEGIN + 10.0) & (motion.time < BEGIN + 100.0)
        assert np.isnan(motion.cog[resting]).mean() > 0.95


def test_what_tells_of_motion_is_ten_seconds_beyond_it():
    fixes = sailed(np.r_[np.zeros(60), np.full(60, 2.0), np.zeros(60)], np.zeros(180), 1.0).fixes(0.01, 1)
    under_way, tells = np.flatnonzero(moving(fixes)), np.flatnonzero(informative(fixes))
    assert tells[0] == under_way[0] - 10 and tells[-1] == under_way[-1] + 10
    assert (np.diff(tells) == 1).all()


def test_the_choice_finds_turns_and_is_consistent():
    """By the profile found in the log itself the course errs hardly more than by the truth about the vessel."""
    errors, scores = [], []
    for seed in range(3):
        voyage = sail(replace(FAST, rate=2.0), seed)
        fixes = voyage.fixes(Gnss(rate=2.0, white=0.5), seed)
        found = choose_profile(fixes)
        assert found.turn_time > 0.0
        motions = [steerway.estimate(fixes, each) for each in (found, FAST.known(0.5))]
        scores.append(np.nanmean(motions[0].nis))
        errors.append([np.nanmean(angle_error(each.cog, voyage.cog)[200:] ** 2) for each in motions])
    assert np.sqrt(np.divide(*np.mean(errors, axis=0))) < 1.15
    assert 1.9 < np.mean(scores) < 2.1


def test_a_vessel_of_two_modes_is_forecast_by_her_average():
    known = SLOW.known(0.5)
    average = known.on_average
    assert average.turn_time == 0.0 and average.position_std == 0.5
    assert 0.1 < average.course_rate_noise / known.turn_course_rate_noise < 0.3, "she turns a fifth of the time"
    assert ONE.on_average is ONE and ONE.agility == ONE.course_rate_noise
    assert known.agility == known.turn_course_rate_noise
    scores = []
    for seed in range(20):
        voyage = sail(SLOW, seed)
        fixes = voyage.fixes(Gnss(white=0.5), seed)
        said = predict(fixes.rows(np.arange(1201)), 30.0, known)
        there = voyage.fixes(Gnss(), seed)
        miss = displacement(there.latitude[1350], there.longitude[1350], said.latitude[0], said.longitude[0])
        spread = [[said.variance_north[0], said.covariance[0]], [said.covariance[0], said.variance_east[0]]]
        scores.append(miss @ np.linalg.solve(spread, miss))
    assert np.median(scores) < 3.0 and np.quantile(scores, 0.9) < 8.0


def test_smoothing_begins_at_rest_with_a_slow_error():
    """The filter from the future starts adrift; what grows backwards must not drown the velocity there."""
    speed = np.r_[np.full(400, 2.0), np.linspace(2.0, 0.0, 20), np.zeros(600)]
    scene = sailed(speed, np.full(len(speed), 0.4), rate=1.0)
    fixes = scene.fixes(0.05, 1)
    profile = SLOW.known(0.05).model_copy(update={"error_std": 0.5, "error_time": 20.0, "speed_noise": 5e-3})
    causal, smoothed = (steerway.estimate(fixes, profile, smooth=smooth) for smooth in (False, True))
    there = slice(100, 380)
    assert np.all(causal.cog[there] != smoothed.cog[there])
    assert np.nanstd(angle_error(smoothed.cog, scene.cog)[there]) < np.nanstd(angle_error(causal.cog, scene.cog)[there])


def test_motion_needs_to_earn_its_second_manner():
    fixes = one_mode(7)
    log = stages.Evidence(fixes, np.ones(len(fixes), bool))
    one = stages.fitted(log, ONE, MOTION)
    two = stages.fitted(log, stages.two_mode_starts(one.profile)[0], MOTION + TURNS)
    assert stages.best_model([one, two], log) is one


def test_what_does_not_last_is_a_sea_and_no_turn():
    """Two manners that explain a log better are left out where the course rate is gone within a second."""
    fixes = logged(replace(SLOW, duration=200.0), 3, white=0.1)
    log = stages.Evidence(fixes, np.ones(len(fixes), bool))
    one, two = (stages.fitted(log, SLOW.known(0.1), MOTION, steps=0) for _ in range(2))
    one = replace(one, profile=one.profile.model_copy(update={"turn_time": 0.0}))
    assert stages.best_model([one, two], log) is two
    sea = replace(two, profile=two.profile.model_copy(update={"turn_course_rate_decay": 0.95}))
    assert stages.best_model([one, sea], log) is one


def test_white_noise_is_not_less_than_what_positions_are_rounded_to():
    """Positions written to 1e-4 of a minute, 0.185 m, leave 0.053 m open whatever a receiver is worth."""
    fixes = logged(SLOW, 1, white=0.01)
    assert rounding_std(fixes) == 0.0
    minute = math.radians(1e-4 / 60.0)
    written = {name: np.round(getattr(fixes, name) / minute) * minute for name in ("latitude", "longitude")}
    rounded = replace(fixes, **written)
    across = math.hypot(1.0, math.cos(fixes.latitude[0])) / math.sqrt(2.0)
    assert rounding_std(rounded) == pytest.approx(0.1853 * across / math.sqrt(12.0), rel=0.01)
    assert stages.Evidence(rounded, moving(rounded)).bounds["position_std"][0] == rounding_std(rounded)


def test_way_is_made_where_ten_seconds_displace():
    scene = sailed(np.r_[np.zeros(100), np.full(100, 2.0), np.zeros(100)], np.zeros(300), rate=1.0)
    fixes = scene.fixes(0.01, 1)
    under_way = moving(fixes)
    assert under_way[105:195].all() and not under_way[:95].any() and not under_way[206:].any()
    silent = replace(fixes, latitude=np.where(np.arange(300) % 3 == 0, fixes.latitude, np.nan))
    assert np.mean(moving(silent) == under_way) > 0.97


def test_a_filter_that_refuses_too_many_fixes_is_made_less_sure():
    fixes = one_mode(5)
    log = stages.Evidence(fixes, np.ones(len(fixes), bool))
    assert stages.inflate_noise(log, ONE) is ONE, "no outliers, no inflation"
    sure = stages.inflate_noise(log, ONE.model_copy(update={"position_std": 0.2, "speed_noise": 5e-4}))
    assert sure.position_std > 0.22 and sure.speed_noise / 5e-4 == pytest.approx((sure.position_std / 0.2) ** 2)
