"""Where vessels will be: the moments against simulation, the table, the command, and the Solent log."""

import json
import math

import numpy as np
import polars as pl
import pytest

import steerway
from steerway.core import Fixes, displacement
from steerway.estimation import FiveStateFilter, Prediction, Profile, choose_profile, hindcast, predict
from tests.command_line import run
from tests.scenes import EPOCH, sailed, straight, usual_profile

WANDERING = Profile(
    speed_noise=5e-3,
    course_rate_noise=2e-5,
    course_rate_decay=0.08,
    position_std=5.0,
)


@pytest.mark.parametrize("horizon", [30.0, 300.0])
def test_mean_and_covariance_are_those_of_many_voyages(horizon):
    """Drawn from the state of a filter that saw the same fixes."""
    fixes = sailed(np.full(200, 6.0), 0.7 + 0.01 * np.maximum(np.arange(200) - 190, 0), 1.0).fixes(5.0, 1)
    found = predict(fixes, horizon, WANDERING)
    estimator = FiveStateFilter(WANDERING)
    for k in range(len(fixes)):
        estimator.predict(1.0 if k else 0.0)
        estimator.update(fixes.latitude[k], fixes.longitude[k])
    rng, steps = np.random.default_rng(0), 300
    x = rng.multivariate_normal(estimator.state, estimator.covariance, 8000).T
    dt, begin = horizon / steps, estimator.state[:2, None]
    kicks = np.sqrt(dt * np.array([[WANDERING.speed_noise], [WANDERING.course_rate_noise]]))
    for _ in range(steps):
        middle = x[3] + 0.5 * dt * x[4]
        x[:2] += dt * x[2] * np.array([np.cos(middle), np.sin(middle)])
        x[3] += dt * x[4]
        x[4] *= math.exp(-WANDERING.course_rate_decay * dt)
        x[[2, 4]] += kicks * rng.normal(size=(2, 8000))
    sampled = np.cov(x[:2])
    spread = math.sqrt(np.trace(sampled))
    way = displacement(found.latitude[0], found.longitude[0], *estimator.position)
    assert math.dist(way, (x[:2] - begin).mean(axis=1)) < 0.05 * spread
    covariance = [found.variance_north[0], found.covariance[0], found.variance_east[0]]
    np.testing.assert_allclose(covariance, sampled[[0, 0, 1], [0, 1, 1]], rtol=0.05, atol=0.04 * spread**2)


def test_no_region_is_larger_than_the_speeds_of_the_record_allow():
    """A boat at 1 m/s that changes her speed often stays within reach, ten minutes ahead too."""
    profile = usual_profile("base", "wander", surge_size=0.8, surge_every=15.0)
    fixes = straight(1.0, 0.5, 1200.0, rate=0.5).fixes(0.5, 1)
    within = predict(fixes, (60.0, 600.0, 600.0), profile)
    assert (within.ellipse[0] < 2.45 * 2.0 * within.horizon).all()
    assert (within.ellipse[0] > 0.2 * within.horizon).all()
    assert within.latitude[1] == within.latitude[2]


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
    assert frame["ellipse95_direction_deg"].is_between(0.0, 180.0).all() and len(direction) == 4


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


def test_an_impossible_horizon_and_an_unknown_aid_are_refused():
    for use in (lambda aid: predict(fleet(), 60.0, aid=aid), lambda aid: hindcast(fleet(), (60.0,), aid=aid)):
        with pytest.raises(steerway.InputError, match="aid 'compass' is unknown, expected some of sog, cog, heading"):
            use(("compass",))
    for horizon in (0.0, 4000.0, math.nan):
        with pytest.raises(steerway.InputError, match="horizon is"):
            predict(fleet(), horizon)


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
    assert "mmsi" not in json.loads(run("predict", own, "--horizon", "30", "--profile", "otter", "--json")[1])[0]
    code, out, err = run("predict", log, "-o", "where.gpx")
    assert code == 2 and "expected one of .csv, .parquet" in err and out == ""


LOG = "solent_ais/SolentAIS_20160112_130211.csv"
SPACING, WIDEST_GAP = 30.0, 20.0
CHI_SQUARE = 5.991  # two degrees of freedom, 95 %


def judged_predictions(fixes, horizons):
    """Every half minute is made the present; predictions of each vessel against the reports that followed.

    Returns (n, 5): horizon, SOG transmitted at the time, error (m), error of dead reckoning (m; NaN where no course is
    transmitted), squared error in units of its covariance, to which the report's own of position and time is added.
    """
    aid = "sog", "cog"
    profile = choose_profile(fixes, None, aid)
    rows = []
    for _, track in fixes.rows(fixes.has_position).in_order().tracks():
        origins, found = hindcast(track, horizons, SPACING, profile, aid)
        for i, k in enumerate(np.repeat(origins, len(horizons))):
            moment, horizon, sog = found.time[i], found.horizon[i], track.sog[k]
            j = int(np.searchsorted(track.time, moment))
            if j == len(track) or track.time[j] - track.time[j - 1] > WIDEST_GAP:
                continue
            there = [float(np.interp(moment, track.time, each)) for each in (track.latitude, track.longitude)]
            place, here = (found.latitude[i], found.longitude[i]), (track.latitude[k], track.longitude[k])
            error, way = np.array(displacement(*there, *place)), np.array(displacement(*place, *here))
            ahead = np.array((math.cos(track.cog[k]), math.sin(track.cog[k])))
            reckoned = np.array(displacement(*there, *here)) - sog * horizon * ahead
            covariance = found.covariance[i]
            spread = np.array([[found.variance_north[i], covariance], [covariance, found.variance_east[i]]])
            spread += profile.position_std**2 * np.eye(2) + (profile.time_std / horizon) ** 2 * np.outer(way, way)
            square = error @ np.linalg.solve(spread, error)
            rows.append((horizon, sog, math.hypot(*error), math.hypot(*reckoned), square))
    return np.array(rows)


@pytest.mark.study
def test_the_solent(shared_data):
    """Better than dead reckoning on what is transmitted, and inside the ellipse as often as it says."""
    found = judged_predictions(steerway.read(shared_data / "data" / LOG), horizons=(30.0, 120.0, 300.0, 600.0))
    moving = found[(found[:, 1] >= 0.5) & np.isfinite(found[:, 3])]
    for horizon in (30.0, 120.0, 300.0, 600.0):
        rows = moving[moving[:, 0] == horizon]
        assert len(rows) > 1000
        assert np.median(rows[:, 2]) < np.median(rows[:, 3])
        assert 0.90 <= np.mean(rows[:, 4] < CHI_SQUARE) <= 0.98
