"""Where vessels will be: the moments against simulation, the table, the command, and the Solent log."""

import json
import math

import numpy as np
import polars as pl
import pytest

import steerway
from steerway.core.earth import displacement
from steerway.core.records import Fixes
from steerway.estimation import InferredProfile, Profile, load_profile
from steerway.estimation.course.forecast import forecast
from steerway.estimation.course.motion.layout import LOW_SPEED, PHASE, UNDER_WAY, empty_bank
from steerway.estimation.inference.forecast import Past, draw_voyages, stages_of
from steerway.estimation.inference.model import empty_bank as empty_modes
from steerway.estimation.inference.place import MOMENTS
from steerway.estimation.inference.structures import CALM, model_of, parameters_of
from steerway.estimation.prediction import Prediction, predict
from steerway.estimation.profiles.inferred import WeighedStructure
from tests.command_line import run
from tests.scenes import EPOCH, sailed, straight, turning

WANDERING = Profile(
    speed_noise=5e-3,
    course_rate_noise=2e-5,
    course_rate_decay=0.08,
    position_std=5.0,
    acceleration_std=0.04,
    acceleration_time=15.0,
)


def filter_state(profile, states, covariance, phase=UNDER_WAY):
    """State of a filter, and its parameters."""
    parameters = profile.parameters()
    block = empty_bank(parameters)[0]
    n = block.shape[1]
    block[:n], block[n], block[n + 1, PHASE] = covariance, states, phase
    return block, parameters[0]


@pytest.mark.parametrize("acceleration", [0.0, 0.04])
@pytest.mark.parametrize("horizon", [30.0, 300.0])
def test_mean_and_covariance_are_those_of_many_voyages(horizon, acceleration):
    profile = WANDERING.model_copy(update={"acceleration_std": acceleration})
    n = 6 if acceleration else 5
    mean = np.array([0.0, 0.0, 6.0, 0.7, 0.01, 0.02])[:n]
    covariance = np.diag([25.0, 25.0, 0.04, 1e-3, 1e-5, 1e-3])[:n, :n]
    covariance[0, 2] = covariance[2, 0] = 0.4
    covariance[1, 3] = covariance[3, 1] = 0.07
    covariance[0, 3] = covariance[3, 0] = -0.07
    covariance[3, 4] = covariance[4, 3] = 5e-5
    north, east, nn, ne, ee = forecast(*filter_state(profile, mean, covariance), horizon)

    rng = np.random.default_rng(0)
    x = np.zeros((8000, 6))
    x[:, :n] = rng.multivariate_normal(mean, covariance, len(x))
    steps = 300
    dt = horizon / steps
    kicks = np.array([profile.speed_noise, profile.course_rate_noise, 2.0 * acceleration**2 / 15.0]) * dt
    for _ in range(steps):
        w = rng.normal(size=(3, len(x))) * np.sqrt(kicks)[:, None]
        middle = x[:, 3] + 0.5 * dt * x[:, 4]
        x[:, 0] += dt * (x[:, 2] + 0.5 * dt * x[:, 5]) * np.cos(middle)
        x[:, 1] += dt * (x[:, 2] + 0.5 * dt * x[:, 5]) * np.sin(middle)
        x[:, 2] += dt * x[:, 5] + w[0]
        x[:, 3] += dt * x[:, 4]
        x[:, 4] = x[:, 4] * math.exp(-0.08 * dt) + w[1]
        x[:, 5] = x[:, 5] * math.exp(-dt / 15.0) + w[2]
    sampled = np.cov(x[:, 0], x[:, 1])
    spread = math.sqrt(np.trace(sampled))
    assert math.hypot(north - x[:, 0].mean(), east - x[:, 1].mean()) < 0.05 * spread
    np.testing.assert_allclose([[nn, ne], [ne, ee]], sampled, rtol=0.05, atol=0.04 * spread**2)


@pytest.mark.parametrize("horizon", [10.0, 300.0])
def test_voyages_of_one_mode_have_the_moments_of_its_model(horizon):
    """Drawn voyages on a held course against moments in closed form; nothing else happens, and no speed is usual."""
    parts = ("base",)
    names, medians, _ = parameters_of(parts)
    never = {"yaw_every": 1e12, "surge_every": 1e12, "emergency_every": 1e12, "drift_speed": 1e-3}
    values = dict(zip(names, np.exp(medians), strict=True)) | never
    values |= {"speed_walk": 0.03, "rate_time": 4.0}
    model = model_of(parts, values)
    model.modes["rate_noise"][CALM] = 2.0 * 0.02**2 / 4.0
    speed, course, square = 5.0, 0.7, np.diag([4.0, 4.0, 0.04, 1e-3, 1e-4])
    square[3, 4] = square[4, 3] = 1e-4
    profile = Profile(
        speed_noise=0.03**2, course_rate_noise=2.0 * 0.02**2 / 4.0, course_rate_decay=1.0 / 4.0, position_std=1.0
    )
    state = np.array([0.0, 0.0, speed, course, 0.02])
    north, east, nn, ne, ee = forecast(*filter_state(profile, state, square), horizon)
    bank = empty_modes(model)
    bank.probability[0], bank.x[0] = 1.0, state
    bank.p[0] = square * np.outer(*2 * [[1.0, 1.0, 1.0, speed, 1.0]])  # velocity across, not course
    stages = stages_of(model, [horizon], np.array([int(horizon)]))
    found, past = np.empty((1, MOMENTS)), Past(np.array([speed]), np.array([1e9]), 0.0)
    draw_voyages(bank, stages, past, 8000, np.random.default_rng(0), found)
    spread = math.sqrt(nn + ee)
    assert math.hypot(north - found[0, 0], east - found[0, 1]) < 0.03 * spread
    np.testing.assert_allclose(found[0, 2:], [nn, ne, ee], rtol=0.05, atol=0.03 * spread**2)


def test_no_region_is_larger_than_the_speeds_of_the_record_allow():
    """A boat at 1 m/s that changes her speed often stays within reach, ten minutes ahead too."""
    parts = "base", "wander"
    names, medians, _ = parameters_of(parts)
    values = dict(zip(names, np.exp(medians).tolist(), strict=True)) | {"surge_size": 0.8, "surge_every": 15.0}
    profile = InferredProfile(structures=(WeighedStructure(weight=1.0, parts=parts, values=values),))
    fixes = straight(1.0, 0.5, 1200.0, rate=0.5).fixes(0.5, 1)
    within = predict(fixes, (60.0, 600.0, 600.0), profile)
    assert (within.ellipse[0] < 2.45 * 2.0 * within.horizon).all()
    assert (within.ellipse[0] > 0.2 * within.horizon).all()
    assert within.latitude[1] == within.latitude[2]


def test_predictions_turn_with_the_scene():
    """Rotate the course by 90°: the ellipse turns along, and nothing else changes."""
    covariance = np.diag([9.0, 9.0, 0.04, 1e-3, 1e-5, 1e-3])
    ways = []
    for course in (0.3, 0.3 + math.pi / 2.0):
        mean = np.array([0.0, 0.0, 6.0, course, 0.01, 0.02])
        ways.append(forecast(*filter_state(WANDERING, mean, covariance), 200.0))
    (n1, e1, nn1, ne1, ee1), (n2, e2, nn2, ne2, ee2) = ways
    np.testing.assert_allclose([n2, e2, nn2, ne2, ee2], [-e1, n1, ee1, -ne1, nn1], rtol=1e-9)


def test_a_vessel_without_way_stays_about():
    mean, covariance = np.zeros(6), np.diag([9.0, 9.0, 0.01, 0.01, 1e-5, 1e-3])
    north, east, nn, ne, ee = forecast(*filter_state(WANDERING, mean, covariance, LOW_SPEED), 600.0)
    assert (north, east, ne) == (0.0, 0.0, 0.0)
    assert 20.0 < math.sqrt(nn) < 150.0 and nn == ee


def test_half_the_predictions_of_a_straight_course_are_no_further_off_than_expected():
    inside, along = [], []
    for seed in range(40):
        scene = turning(5.0, 0.15 * seed, 400.0, rate=1.0, seed=seed, decay=0.08, density=2e-5)
        fixes = scene.fixes(5.0, seed).rows(slice(0, 281))
        profile = WANDERING.model_copy(update={"acceleration_std": 0.0, "speed_noise": 1e-5})
        found = predict(fixes, 120.0, profile)
        north, east = displacement(*scene.place(400), found.latitude[0], found.longitude[0])
        s = np.array([[found.variance_north[0], found.covariance[0]], [found.covariance[0], found.variance_east[0]]])
        inside.append(np.array([north, east]) @ np.linalg.solve(s, [north, east]) < 5.99)
        along.append(found.horizon[0])
    assert set(along) == {120.0}
    assert 0.85 <= np.mean(inside) <= 1.0


def fleet():
    """One under way and one at anchor until EPOCH + 300, and one that fell silent an hour before."""
    one = straight(6.0, 0.5, 300.0, rate=0.1).fixes(3.0, 1)
    two = straight(0.0, 0.0, 300.0, rate=0.1).fixes(3.0, 2)
    old = straight(6.0, 0.5, 100.0, rate=0.1).fixes(3.0, 3)
    tables = [(one.time, one), (two.time, two), (old.time - 3600.0, old)]
    rows = {name: np.concatenate([getattr(t, name) for _, t in tables]) for name in ("latitude", "longitude")}
    counts = [len(t) for _, t in tables]
    output = {"sog": np.repeat([6.0, 0.0, 6.0], counts), "cog": np.repeat([0.5, np.nan, 0.5], counts)}
    mmsi = np.repeat([257000001, 257000002, 257000003], counts)
    return Fixes(np.concatenate([time for time, _ in tables]), **rows, **output, mmsi=mmsi)


def test_every_vessel_at_every_horizon():
    found = predict(fleet(), (60.0, 600.0))
    assert isinstance(found, Prediction)
    assert found.mmsi.tolist() == [257000001, 257000001, 257000002, 257000002], "the silent one is left out"
    np.testing.assert_allclose(found.time, EPOCH + 300.0 + np.array([60.0, 600.0] * 2))
    longer, shorter, direction = found.ellipse
    assert (longer >= shorter).all() and longer[1] > 5.0 * longer[0]
    assert longer[3] < 0.1 * longer[1], "at anchor she stays"
    frame = found.to_frame()
    assert frame.columns[:5] == ["mmsi", "time_s", "horizon_s", "lat_deg", "lon_deg"]
    assert frame["ellipse95_direction_deg"].is_between(0.0, 180.0).all()
    assert frame["north_east_correlation"].abs().max() <= 1.0 and len(direction) == 4


def test_the_ellipse_lies_as_the_covariance_says():
    """1σ of 10 m along 30° and 2 m across."""
    direction = math.radians(30.0)
    turn = np.array([[math.cos(direction), -math.sin(direction)], [math.sin(direction), math.cos(direction)]])
    s = turn @ np.diag([100.0, 4.0]) @ turn.T
    found = Prediction(*([np.zeros(1)] * 4), *(np.array([each]) for each in (s[0, 0], s[1, 1], s[0, 1])))
    np.testing.assert_allclose(np.ravel(found.ellipse), [24.477, 4.895, direction], rtol=1e-3)


def test_silence_lengthens_the_horizon():
    """One vessel's last report came a hundred seconds before the other's."""
    scenes = [straight(6.0, 0.5, duration, rate=0.1).fixes(3.0, 1) for duration in (200.0, 300.0)]
    columns = {name: np.concatenate([getattr(t, name) for t in scenes]) for name in ("time", "latitude", "longitude")}
    found = predict(Fixes(**columns, mmsi=np.repeat([1, 2], [len(t) for t in scenes])), 60.0)
    assert found.time.tolist() == [EPOCH + 360.0] * 2
    assert found.horizon.tolist() == [160.0, 60.0]
    assert found.ellipse[0][0] > 2.0 * found.ellipse[0][1]
    apart = displacement(found.latitude[0], found.longitude[0], found.latitude[1], found.longitude[1])
    assert math.hypot(*apart) < 150.0, "both lie where the course leads by then"


def test_what_is_transmitted_is_used():
    """Positions of 10 m and a SOG and COG without error: with them the way is known far better."""
    errors = {True: [], False: []}
    there = straight(6.0, 0.5, 420.0, rate=0.1)
    for seed in range(10):
        fixes = straight(6.0, 0.5, 300.0, rate=0.1).fixes(10.0, seed)
        for transmitted in errors:
            sog, cog = (np.full(len(fixes), each if transmitted else np.nan) for each in (6.0, 0.5))
            given = Fixes(fixes.time, fixes.latitude, fixes.longitude, sog=sog, cog=cog, mmsi=np.full(len(fixes), 1))
            found = predict(given, 120.0)
            errors[transmitted].append(
                math.hypot(*displacement(*there.place(42), found.latitude[0], found.longitude[0]))
            )
    assert np.median(errors[True]) < 0.6 * np.median(errors[False])


@pytest.mark.parametrize("horizon", [0.0, -5.0, 4000.0, math.nan])
def test_an_impossible_horizon_is_refused(horizon):
    with pytest.raises(steerway.InputError, match="horizon is"):
        predict(fleet(), horizon)


def test_positions_without_a_time_are_refused():
    with pytest.raises(steerway.InputError, match="no position with a time"):
        predict(Fixes(np.full(3, np.nan), np.full(3, 0.9), np.full(3, 0.2)), profile="otter")


def test_the_command(tmp_path):
    log, table = tmp_path / "ais.csv", tmp_path / "where.csv"
    fleet().to_frame().write_csv(log)
    code, out, err = run("predict", log, "--horizon", "60", "--horizon", "300")
    assert (code, err) == (0, "") and out.count("257000001") == 2 and "×" in out
    code, out, _ = run("predict", log, "-o", table)
    assert code == 0 and f"wrote {table}" in out
    assert pl.read_csv(table)["horizon_s"].min() == 600.0
    assert json.loads(run("predict", log, "--json")[1])[0]["mmsi"] == 257000001
    own = tmp_path / "own.csv"
    steerway.write(sailed(np.full(200, 2.0), np.full(200, 0.5)).fixes(0.3, 1), own)
    assert "mmsi" not in json.loads(run("predict", own, "--horizon", "30", "--json")[1])[0]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["predict", "LOG", "--horizon", "-1"], "horizon is -1"),
        (["predict", "LOG", "-o", "where.gpx"], "expected one of .csv, .parquet"),
        (["profile", "show", "otterr"], "expected one of otter"),
        (["profile", "make", "LOG", "-o", "mine.yaml"], "expected .toml"),
    ],
)
def test_mistakes_end_in_one_sentence_and_2(tmp_path, arguments, words):
    log = tmp_path / "ais.csv"
    fleet().to_frame().write_csv(log)
    code, out, err = run(*(log if each == "LOG" else each for each in arguments))
    assert code == 2 and words in err and err.count("\n") == 1 and out == ""


def test_profiles_are_listed_shown_and_made(tmp_path):
    assert "small-usv" in run("profile", "list")[1]
    shown, made = tmp_path / "shown.toml", tmp_path / "made.toml"
    shown.write_text(run("profile", "show", "swell")[1])
    assert Profile.load(shown) == Profile.named("swell")
    log = tmp_path / "sortie.csv"
    steerway.write(turning(2.0, 0.5, 80.0).fixes(0.3, 1), log)
    for options in ((), ("--tune",)):
        code, out, _ = run("profile", "make", log, "-o", made, *options)
        assert code == 0 and f"wrote {made}" in out
        profile = load_profile(made)
        assert profile.name == "made"
        assert all(0.1 < each.values["fix_std"] < 0.9 for each in profile.structures)


def test_the_solent(shared_data):
    """Better than dead reckoning on what is transmitted, and inside the ellipse as often as it says."""
    from steerway_studies.ais_prediction import CHI_SQUARE, LOG, judged_predictions

    found = judged_predictions(steerway.read(shared_data / "data" / LOG), horizons=(30.0, 120.0, 300.0, 600.0))
    moving = found[(found[:, 1] >= 0.5) & np.isfinite(found[:, 3])]
    for horizon in (30.0, 120.0, 300.0, 600.0):
        rows = moving[moving[:, 0] == horizon]
        assert len(rows) > 1000
        assert np.median(rows[:, 2]) < np.median(rows[:, 3])
        assert 0.90 <= np.mean(rows[:, 4] < CHI_SQUARE) <= 0.98
