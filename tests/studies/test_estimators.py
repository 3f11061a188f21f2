"""Estimators over many seeds and logs: noise of which nothing is told, σ, manoeuvres, choice of a profile, searches."""

import math
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import steerway
from steerway.commands.testing import SCENARIO
from steerway.core import rms, wrap_array
from steerway.estimation import Profile, choose_profile
from steerway.estimation.testing import Track, infer
from steerway.sensors import low_cost
from steerway.simulation import load_scenario, numbers_of_seed, over_seeds, parse_scenario, sail_scenario
from tests.golden import missed, no_worse
from tests.scenes import Scene, angle_error, sailed, straight, turning
from tests.test_fixed_lag import MOST, REFUSED, beside_the_paper, errors

EXAMPLES = Path(__file__).parent.parent.parent / "examples"
SEEDS = 61, 62, 63


def of_example(name, rate, duration):
    """True motion of an example that is steered by it, (rate) rows a second."""
    scenario = load_scenario(EXAMPLES / f"{name}.toml", {"duration": duration})
    scenario = scenario.model_copy(update={"estimator": scenario.estimator.model_copy(update={"kind": "truth"})})
    run = sail_scenario(scenario, 5).run
    run = run.rows(slice(round(60.0 / scenario.step), None, round(1.0 / (rate * scenario.step))))
    return Scene(run.time, run["true_north"], run["true_east"], run.true_sog, run.true_cog)


SCENES = {
    "otter": lambda: of_example("otter-mission", 5.0, 400.0),
    "mariner-usv": lambda: turning(6.0, 0.4, 300.0),
    "ship": lambda: of_example("p1", 1.0, 2000.0),
}
"""By the preset of the vessel: the Otter's mission, a fast craft and P1's ship."""


@pytest.mark.parametrize("std", [0.05, 0.1, 0.25, 0.5, 1.0, 2.0, 0.07, 0.7])
@pytest.mark.parametrize("preset", SCENES)
def test_untold_noise_costs_nothing(preset, std):
    """The six noises that are asked for, and two between those that the prior has."""
    sog, cog, refused = beside_the_paper(SCENES[preset](), std, SEEDS, preset)
    assert sog < MOST and cog < MOST and refused < REFUSED and math.isfinite(sog + cog)


LAG_SEEDS = 91, 92, 93
WORTH = {0.5: 0.95, 1.0: 0.85, 2.0: 0.65}
"""Lag in s, and the most that is left of the course's error without one."""


@pytest.mark.parametrize("std", [0.1, 0.5])
@pytest.mark.parametrize("told", [True, False])
def test_a_delay_betters_course_and_speed(told, std):
    profile = Profile.named("otter").model_copy(update={"position_std": std}) if told else None
    scene = of_example("otter-mission", 5.0, 300.0)
    cog, sog, at_once = errors(scene, profile, std, 1e-3, LAG_SEEDS)
    for lag, most in WORTH.items():
        delayed_cog, delayed_sog, within = errors(scene, profile, std, lag, LAG_SEEDS)
        print(f"{lag:g} s: COG {delayed_cog / cog:.2f}, SOG {delayed_sog / sog:.2f}, {within:.3f} within 2 sigma")
        assert delayed_cog < most * cog and delayed_sog < sog and within > at_once - 0.02


@missed("without a profile 86 to 88 % are within 2σ, late or not")
@pytest.mark.parametrize("std", [0.1, 0.5])
def test_courses_without_a_profile_are_within_two_sigma(std):
    scene = of_example("otter-mission", 5.0, 300.0)
    within = errors(scene, None, std, 1e-3, LAG_SEEDS)[2]
    no_worse(within > 0.85, within)
    assert within > 0.9


MISSION = EXAMPLES / "otter-mission.toml"


@pytest.fixture(scope="module", params=["demo", "otter-mission"])
def coverage(request):
    scenario = parse_scenario(SCENARIO, "demo") if request.param == "demo" else load_scenario(MISSION)
    found = over_seeds(partial(numbers_of_seed, scenario), range(101, 111))
    return lambda name: np.mean([each[f"{name}_within_2sigma_pct"] for each in found])


@pytest.mark.parametrize("name", ["position", "cog", "course_rate"])
def test_two_sigma_hold_the_truth(coverage, name):
    assert 90.0 < coverage(name) < 99.0


@missed("99.3 and 99.1 %: σ of SOG counts on 5 % of unsteady speed, which a simulated Otter does not have")
def test_two_sigma_of_sog_are_no_wider_than_needed(coverage):
    found = coverage("sog")
    no_worse(found < 99.3, found)
    assert found < 99.0


def test_two_sigma_of_sog_hold_the_truth(coverage):
    assert coverage("sog") > 90.0


RATE, LASTS, STD = 2.0, 400.0, 0.3  # Hz, s, m
_SETTLED, _UNDER_WAY = 20, 0.5  # rows until the estimate has settled, and m/s
_DEG = math.pi / 180.0
TIME = np.arange(round(LASTS * RATE) + 1) / RATE
ONE = np.ones(len(TIME))


def _mean(values, seconds):
    """Means over so many s: what a boat makes of steps."""
    n = int(seconds * RATE) | 1
    return np.convolve(np.pad(values, n // 2, mode="edge"), np.ones(n) / n, "valid")


def _course(rate):
    return np.cumsum(rate) / RATE


MANOEUVRES = {  # speed, m/s, and course, rad, at every fix
    "slalom": (4.0 * ONE, 25.0 * _DEG * np.sin(math.tau * TIME / 40.0)),
    "zigzag": (4.0 * ONE, 40.0 / math.pi * _DEG * np.arcsin(np.sin(math.tau * TIME / 60.0))),
    "circles": (3.0 * ONE, math.tau * TIME / 60.0),
    "spiral": (3.0 * ONE, _course(math.tau / (30.0 + 0.2 * TIME))),
    "stop": (_mean(np.where((TIME > 150.0) & (TIME < 230.0), 0.0, 5.0), 20.0), 0.7 * ONE),
    "crash stop": (np.maximum(6.0 * np.exp(-np.maximum(TIME - 200.0, 0.0) / 8.0), 0.05),
                   0.7 + 0.4 * -np.expm1(-np.maximum(TIME - 200.0, 0.0) / 10.0)),
    "figure of eight": (3.0 * ONE, _course(np.where(TIME // 60.0 % 2.0 == 0.0, 6.0, -6.0) * _DEG)),
    "start": (_mean(np.where(TIME < 100.0, 0.0, 4.0), 30.0), 1.2 * ONE),
    "Williamson turn": (4.0 * ONE, _course(_mean(
        4.0 * _DEG * (((TIME > 150.0) & (TIME <= 165.0)) - 1.0 * ((TIME > 165.0) & (TIME <= 225.0))), 6.0))),
    "straight": (5.0 * ONE, 0.5 * ONE),
}  # fmt: skip
MISSES = {
    "figure of eight": "SOG 0.038 against 0.013 m/s, COG 4.9° against 2.8°: where the turn changes sides",
}
CEILINGS = {"figure of eight": (0.040, 5.0 * _DEG)}
"""m/s and rad RMS of the smoothed estimate, above which a miss has grown."""
CASES = [pytest.param(name, marks=missed(MISSES[name])) if name in MISSES else name for name in MANOEUVRES]


def errors_of(name, seed=2):
    """RMS errors of SOG (m/s) and COG (rad), causal and smoothed."""
    sog, cog = MANOEUVRES[name]
    fixes = sailed(sog, cog, RATE).fixes(STD, seed)
    profile = choose_profile(fixes)
    motions = [steerway.estimate(fixes, profile, causal=causal) for causal in (True, False)]
    known = np.isfinite([motion.cog for motion in motions]).all(axis=0) & (sog > _UNDER_WAY)
    known[:_SETTLED] = False
    return [
        (rms(motion.sog[known] - sog[known]), rms(wrap_array(motion.cog[known] - cog[known]))) for motion in motions
    ]


@pytest.mark.parametrize("name", CASES)
def test_smoothed_is_not_worse_than_causal(name):
    causal, smoothed = errors_of(name)
    most = CEILINGS.get(name, (math.inf, math.inf))
    no_worse(smoothed[0] <= most[0] and smoothed[1] <= most[1], smoothed)
    assert smoothed[0] <= causal[0] and smoothed[1] <= causal[1], (causal, smoothed)


def with_a_course(speed):
    """Share of rows with a course after a minute, and the RMS error of those (°), by a low-cost receiver."""
    scene = turning(speed, 1.0, 300.0, decay=0.2, density=3e-5)
    home = math.radians(1.0), math.radians(10.0)
    motion = steerway.estimate(low_cost().fixes(scene.time, scene.north, scene.east, 1, origin=home), causal=True)
    error = angle_error(motion.cog, scene.cog)[motion.time >= scene.time[0] + 60.0]
    return np.mean(np.isfinite(error)), math.degrees(np.sqrt(np.nanmean(error**2)))


@pytest.mark.filterwarnings("ignore:Mean of empty slice")
def test_at_rest_there_is_no_course_and_its_error_falls_with_speed():
    (rest, _), (slow, slow_error), (fast, fast_error) = (with_a_course(each) for each in (0.0, 0.7, 3.0))
    assert rest < 0.05 and slow > 0.9 and fast == 1.0
    assert fast_error < 4.0 and fast_error < slow_error < 20.0


def expected(profile, *names):
    """Root of the sum of squares of these numbers, weighted mean over structures; 0 where a structure has none."""
    return sum(each.weight * math.hypot(*(each.values.get(n, 0.0) for n in names)) for each in profile.structures)


@pytest.mark.parametrize(("std", "rate"), [(0.02, 5.0), (0.5, 5.0), (0.5, 1.0), (3.0, 1.0)])
def test_the_receiver_is_found(std, rate):
    scene = turning(4.0, 1.0, 600.0, rate=rate, density=1e-3, decay=0.2)
    found = choose_profile(scene.fixes(std, 3))
    total = expected(found, "fix_std", "error_std")
    assert 0.6 * std < total < 1.7 * std


def test_the_choice_comes_near_the_truth_about_the_boat():
    """Estimated by the profile found, COG errs little more than by the very numbers that made the sortie."""
    made = steerway.Profile(speed_noise=1e-5, course_rate_noise=2e-3, course_rate_decay=0.3, position_std=0.5)
    errors = []
    for seed in range(4):
        scene = turning(1.3, 0.4 * seed, 300.0, seed=seed)
        fixes = scene.fixes(0.5, seed)
        errors.append(
            [
                np.nanmean(angle_error(steerway.estimate(fixes, p, causal=True).cog, scene.cog)[100:] ** 2)
                for p in (None, made)
            ]
        )
    found, known = np.sqrt(np.mean(errors, axis=0))
    assert found < 1.15 * known


def test_stretches_from_all_over_a_long_record_are_looked_at():
    """An hour moored, then a sortie: the profile is that of the sortie."""
    rest, sortie = straight(0.0, 0.0, 5000.0, rate=1.0).fixes(0.5, 1), turning(4.0, 1.0, 4000.0, rate=1.0).fixes(0.5, 2)
    columns = {name: np.r_[getattr(rest, name), getattr(sortie, name)] for name in ("latitude", "longitude")}
    both = steerway.Fixes(np.r_[rest.time, sortie.time + 5001.0], **columns)
    found, alone = choose_profile(both), choose_profile(sortie)
    assert 0.5 < expected(found, "fix_std") / expected(alone, "fix_std") < 2.0
    assert 0.2 < expected(found, "yaw_size") / expected(alone, "yaw_size") < 5.0


MOVED, SEARCHES = 1e-6, 4
"""m, far below any digit; searches of each log."""
LOGS = (
    ("furuno_scx20_n2k/furuno-130842-figure8-fast.raw", "src 52"),
    ("furuno_scx20_n2k/furuno-130842-wide-turn.raw", "src 52"),
)
HARD = (
    "rob_atlantic_1hz/nukuhiva_multitalker.nmea",
    "signalk_samples/plaka.log",
    "rob_atlantic_1hz/gx_to_gavres.nmea",
    "rob_atlantic_1hz/tomales_kayak.nmea",
    "anemomind_corrupt/psaros33_20140627_gaps_dups.nmea",
)
"""Logs of which searches differ; by how much depends on the last bits of the machine's arithmetic."""
APART = 5.0
"""Log evidence by which the best of several searches may differ: more is called strong (`selection.BETTER` is 3)."""
FURTHEST = 26.0
"""The most that was measured where it is missed: tomales, 22 and 25.5 on two machines."""


def searches(fixes):
    """(parts, log evidence) of the best structure of every search."""
    record = Track(fixes, ()).record
    found = []
    for seed in range(SEARCHES):
        moved = (MOVED if seed else 0.0) * np.random.default_rng(seed).standard_normal((2, len(record.time)))
        fits = infer(record._replace(north=record.north + moved[0], east=record.east + moved[1])).fits
        best = max(fits, key=lambda fit: fit.evidence)
        found.append((best.parts, best.evidence))
    return found


def assert_alike(*logs):
    """All searches of each log, as `searches` returns them."""
    apart = [np.ptp([evidence for _, evidence in found]) for found in logs]
    no_worse(max(apart) <= FURTHEST, logs)
    assert max(apart) < APART, logs


@pytest.mark.parametrize(("log", "source"), LOGS)
def test_a_search_of_a_recorded_log_finds_the_same_again(log, source, shared_data):
    fixes = steerway.read(shared_data / "data" / log, source=source)
    assert_alike(searches(fixes.rows(fixes.has_position)))


@missed("of five logs, after four rounds 5 to 26 apart: more rounds meet, and cost a quarter")
def test_a_search_of_hard_logs_finds_the_same_again(shared_data):
    logs = (steerway.read(shared_data / "data" / log) for log in HARD)
    assert_alike(*(searches(fixes.rows(fixes.has_position)) for fixes in logs))


@pytest.mark.parametrize("noise", [0.02, 0.5])
def test_a_search_of_a_scene_finds_the_same_again(noise):
    assert_alike(searches(turning(1.5, 0.3, 600.0, seed=9).fixes(noise, 9)))
