"""Tracks of an archive: filters in few steps and in many, smoothing and least squares, rests, trips and encounters."""

import math

import numpy as np
import polars as pl
import pytest

import steerway.archive
from steerway.archive.testing import association, digest, encounters, filters, levels, page, smoothing, tracks
from steerway.core import NORMAL_95, REJECTED, Fixes, InputError
from steerway.core.testing import PREDICTED, displaced_all, displacement
from steerway.estimation import FiveStateFilter, Profile
from steerway.estimation.testing import Structure, medians_of
from tests.fleet import _motion, ships

CLASS_A = 1
MIDNIGHT = 1_709_251_200.0
NO_AIDS = np.empty((0, 5))


@pytest.fixture(autouse=True)
def without_a_page(monkeypatch):
    """Do not draw the page, which takes longer than a small archive."""
    monkeypatch.setattr(page, "write", lambda store, manifest: None)


def rows_of(directory, table="estimate"):
    return steerway.archive.scan(directory, table).collect()


@pytest.fixture(scope="module")
def by_class():
    """The filters of the built-in classes."""
    return levels.filters([[each.model_dump() for each in some] for some in levels.levels(None)], ())


def found(by, time, latitude, longitude, aids=NO_AIDS, asked=0):
    """The results, with stored states, of reports under one MMSI of class A."""
    n = len(time)
    nothing = np.zeros(n, np.int64)
    reports = association.Reports(
        time, latitude, longitude, np.zeros(n), aids, nothing, nothing + CLASS_A, nothing + asked
    )
    into, fleet = association.empty_found(n, n, by), association.empty_fleet(1, by)
    association.associate(np.array([0, n]), reports, by, fleet, into, filters.empty_states((2,), by))
    return into


def smoothed(by, time, each):
    """The smoothed estimates of one track."""
    n = len(time)
    return smoothing.smoothed(np.arange(n), np.array([0, n]), each.which, time, by, (each.kept,), each.estimate)


def sailing(seed, hours):
    """Reports of a generated ship under way, 2 to 180 s apart, with errors of 3 m."""
    rng = np.random.default_rng(seed)
    ship = next(each for each in ships(40, rng) if each.activity == "under way" and each.mobile == "Class A")
    time, latitude, longitude, _, _ = _motion(ship, 3600.0 * hours, rng)
    at = np.cumsum(np.round(rng.choice([6.0, 10.0, 30.0, 60.0, 180.0], 120 * hours)))
    at = at[at < 3600.0 * hours]
    latitude, longitude = np.interp(at, time, latitude), np.interp(at, time, longitude)
    return at, latitude + rng.normal(0.0, 5e-7, len(at)), longitude + rng.normal(0.0, 8e-7, len(at))


def test_an_interval_in_few_steps_gives_what_steps_of_a_second_give(by_class):
    """From every state of a ship to its next report: 99.99 % of the differences are below 0.01 σ."""
    time, *places = sailing(3, 30)
    kept, calm = found(by_class, time, *places), by_class._replace(change=0.0 * by_class.change)
    once, often = (filters.state_at(filters.empty_states((1,), by_class), 0) for _ in range(2))
    away, narrower = [], []
    for k in range(2, len(time) - 1):
        dt, which = time[k + 1] - time[k], kept.which[k + 1]
        for state in (once, often):
            filters.copy_state(filters.state_at(kept.kept.states, k), state)
        filters.predict(by_class, which, once, dt)
        filters.add_variance(often.p, 2, by_class.change[which])
        for _ in range(int(dt)):
            filters.predict(calm, which, often, 1.0)
        fix = displacement(places[0][k + 1], places[1][k + 1], *kept.kept.plane[k])
        for state in (once, often):
            filters.take(by_class, which, state, *fix)
        x, y, std = once.x[0], often.x[0], np.sqrt(often.p[0].diagonal())
        if std[3] < 0.3 * y[2]:  # where the course is defined
            turned = math.remainder(x[3] - y[3], 2.0 * math.pi) * y[2]
            away.append(np.abs([x[0] - y[0], x[1] - y[1], x[2] - y[2], turned, x[4] - y[4]]) / std)
            narrower.append(np.sqrt(once.p[0].diagonal()) / std)
    assert len(away) > 1500 and np.ptp(away) > 0.0
    assert np.quantile(away, 0.9999) < 0.01
    assert np.quantile(np.abs(np.log(narrower)), 0.9999) < 0.01


def test_a_step_of_another_length_is_not_taken_for_one_that_is_kept(by_class):
    """Nearly equal lengths are different too: else results would depend on what was filtered before."""
    one = filters.slot_for(by_class, 4, 10.0)
    by_class.steps[4, one, 0].dt = 10.0
    assert filters.slot_for(by_class, 4, 10.0 + 1e-9) == one
    assert by_class.steps[4, one, 0].dt == 0.0


def test_reports_of_a_ship_at_rest_are_smoothed_as_by_least_squares(by_class):
    """At rest the model is linear: the velocity is a random walk in any direction, with an initial σ of 10 m/s."""
    rng, n = np.random.default_rng(5), 12
    time = np.cumsum(rng.uniform(5.0, 15.0, n))
    level = CLASS_A * tracks.LEVELS + tracks.STEADY
    receiver = by_class.models.receiver.copy()
    receiver["outlier_rate"] = 1e-15
    one = by_class._replace(models=by_class.models._replace(receiver=receiver))
    north, east = rng.normal(0.0, 0.2, (2, n))
    into = association.empty_found(n, n, one)
    state, plane = filters.state_at(filters.empty_states((1,), one), 0), (0.9, 0.2)
    for k in range(n):
        if k:
            filters.predict(one, level, state, time[k] - time[k - 1])
        filters.take(one, level, state, north[k], east[k])
        filters.copy_state(state, filters.state_at(into.kept.states, k))
    into.kept.plane[:], into.kept.link[:], into.which[:], into.estimate[:] = plane, association.CONTINUED, level, 0.0
    back = smoothed(one, time, into)

    model = filters.model_of(one, level)
    density, variance = model.modes[0].speed_noise, model.receiver[0].fix_variance
    # Unknowns: position and velocity at every report, along either axis; rows: fixes, the first velocity, motion.
    a, b = np.zeros((3 * n - 1, 2 * n)), np.zeros((3 * n - 1, 2))
    a[:n, ::2], b[:n] = np.eye(n) / math.sqrt(variance), np.column_stack([north, east]) / math.sqrt(variance)
    a[n, 1] = 0.1
    for k, h in enumerate(np.diff(time)):
        noise = density * np.array([[h**3 / 3.0, h * h / 2.0], [h * h / 2.0, h]])
        move = np.array([[-1.0, -h, 1.0, 0.0], [0.0, -1.0, 0.0, 1.0]])
        a[n + 1 + 2 * k :][:2, 2 * k : 2 * k + 4] = np.linalg.solve(np.linalg.cholesky(noise), move)
    best, covariance = np.linalg.lstsq(a, b, rcond=None)[0], np.linalg.inv(a.T @ a)
    latitude, longitude = displaced_all(*plane, best[::2, 0], best[::2, 1])
    std = np.sqrt(covariance.diagonal())
    metres = np.array([6.37e6, 6.37e6 * math.cos(plane[0])])
    off = np.column_stack([back[:, 0] - latitude, back[:, 1] - longitude]) * metres
    assert np.abs(off / std[::2, None]).max() < 1e-3
    np.testing.assert_allclose(back[:, 8], std[::2], rtol=1e-3)
    np.testing.assert_allclose(back[:, 2], np.hypot(*best[1::2].T), atol=1e-3 * std[1::2].min())


def test_a_ship_whose_reports_go_on_elsewhere_is_there_after_two_of_them_at_its_speed(by_class):
    """Both reports are rejected; the second sets the position and keeps the velocity; smoothing stops at the move."""
    time = np.arange(0.0, 240.0, 10.0)
    north, elsewhere = 5.0 * time, np.where(time < 120.0, 0.0, 400.0)
    into = found(by_class, time, *displaced_all(0.9, 0.2, north, elsewhere))
    assert np.flatnonzero(into.status == REJECTED).tolist() == [12, 13]
    assert np.flatnonzero(into.kept.link).tolist() == [13] and into.kept.link[13] == association.REPOSITIONED
    for estimate in (into.estimate, smoothed(by_class, time, into)):
        places = np.array([displacement(*each[:2], 0.9, 0.2) for each in estimate])
        assert np.abs(places[:12, 1]).max() < 15.0 and np.abs(places[13:, 1] - 400.0).max() < 15.0
        np.testing.assert_allclose(estimate[2:, 2], 5.0, atol=0.3)
        np.testing.assert_allclose(np.delete(estimate[2:, 3], 10), 0.0, atol=0.06)


def test_two_ships_under_one_number_have_a_track_each_that_is_aided_by_its_own_reports(by_class):
    """Their reports alternate; the last row requests output of the second track between its reports."""
    time = np.append(np.arange(0.0, 200.0, 5.0), 198.0)
    second = np.arange(41) % 2 == 1
    latitude, longitude = displaced_all(0.9, 0.2, np.where(second, 90e3 - 3.0 * time, 6.0 * time), 0.0 * time)
    latitude[-1] = longitude[-1] = np.nan
    speeds = np.where(second, 3.0, 6.0)
    nothing = np.full(41, np.nan)
    aids = np.column_stack([speeds, np.where(second, -np.pi, 0.0), nothing, nothing, nothing])
    aids[-1] = np.nan
    filtered = levels.filters([[each.model_dump() for each in some] for some in levels.levels(None)], ("sog", "cog"))
    for by in (by_class, filtered):
        into = found(by, time, latitude, longitude, aids if by is filtered else NO_AIDS, 1)
        assert into.track[8:40].tolist() == second[8:40].astype(int).tolist() and into.track[40] == 1
        assert into.status[40] == PREDICTED
        np.testing.assert_allclose(into.estimate[10:40, 2], speeds[10:40], atol=0.2)
        place = displacement(*into.estimate[40, :2], 0.9, 0.2)
        np.testing.assert_allclose(place, (90e3 - 3.0 * 198.0, 0.0), atol=8.0)


def test_a_profile_of_more_states_is_filtered_and_smoothed_too():
    """With persistent acceleration the general filter is used, in one mode."""
    ais = FiveStateFilter("ais").profile
    by = levels.filters([[each.model_dump() for each in some] for some in levels.levels(ais)], ())
    assert by.models.states == 6 and not by.plain
    time = np.arange(0.0, 80.0, 10.0)
    into = found(by, time, *displaced_all(0.9, 0.2, 5.0 * time, 0.0 * time))
    np.testing.assert_allclose(into.estimate[3:, 2], 5.0, atol=0.5)
    causal = into.estimate.copy()
    back = smoothed(by, time, into)
    np.testing.assert_allclose(back[2:, 2], 5.0, atol=0.3)
    assert (back[2:-1, 5] < causal[2:-1, 5]).all() and back[-1, 5] == pytest.approx(causal[-1, 5])


def test_a_profile_of_structures_gives_what_its_filter_gives():
    """The structures have parts of their own, and weights that the average needs."""
    some = ((0.7, ("base", "wander"), 3.0), (0.3, ("base", "wander", "error"), 5.0))
    profile = Profile.of(Structure(weight=w, parts=p, values=medians_of(p) | {"fix_std": std}) for w, p, std in some)
    by = levels.filters([[profile.model_dump()]], ())
    time, latitude, longitude = (each[:30] for each in sailing(3, 1))
    into = found(by, time, latitude, longitude)
    motion = FiveStateFilter(profile).filter(Fixes(time, latitude, longitude))
    expected = np.column_stack([motion.sog, motion.cog, motion.course_rate, motion.cog_std, motion.nis])
    mine = np.column_stack([into.estimate[:, [2, 3, 4, 6]], into.nis])
    np.testing.assert_allclose(mine[3:], expected[3:], atol=5e-4)  # each of the two planes bends a little


def rounded_ships(seed, count, decimals):
    """Reports (every 10 s over midnight, errors 0.5 m, rounded to `decimals`) and the truth of generated ships."""
    rng = np.random.default_rng(seed)
    at, frames = np.arange(10.0, 7200.0, 10.0), []
    for ship in ships(count, rng):
        time, *motion = _motion(ship, 7200.0, rng)
        latitude, longitude, sog, cog = (np.interp(at, time, each) for each in motion)
        latitude = latitude + rng.normal(0.0, 0.5 / 6.37e6, len(at))
        longitude = longitude + rng.normal(0.0, 0.5 / 6.37e6, len(at)) / np.cos(latitude)
        places = {"lat": np.degrees(latitude).round(decimals), "lon": np.degrees(longitude).round(decimals)}
        columns = {"time": MIDNIGHT - 3600.0 + at, **places, "true_sog": sog, "true_cog": cog}
        vessel = {"mmsi": pl.lit(ship.mmsi), "class": pl.lit(ship.mobile[-1])}
        frames.append(pl.DataFrame(columns).with_columns(**vessel))
    return pl.concat(frames)


@pytest.mark.parametrize("smooth", [False, True])
def test_positions_of_four_decimals_are_intervals_of_them_however_the_rows_are_divided(tmp_path, smooth):
    """Treated as points, they give moored ships a course, and 95 % intervals contain 60 to 80 % of the courses."""
    table = rounded_ships(7, 12, 4)
    table.drop("true_sog", "true_cog").write_csv(tmp_path / "all.csv")
    days = [tmp_path / "second.csv", tmp_path / "first.csv"]
    for day, is_in in zip(days, (pl.col("time") >= MIDNIGHT, pl.col("time") < MIDNIGHT), strict=True):
        table.filter(is_in).drop("true_sog", "true_cog").write_csv(day)
    steerway.archive.run([tmp_path / "all.csv"], tmp_path / "one", buckets=1, workers=1, smooth=smooth)
    steerway.archive.run(days, tmp_path / "many", buckets=3, workers=1, smooth=smooth)
    assert digest(tmp_path / "one") == digest(tmp_path / "many")
    rows = rows_of(tmp_path / "one")
    rows = rows.join(table, left_on=["mmsi", "time_s"], right_on=["mmsi", "time"], validate="1:1")
    under_way, at_rest = rows.filter(pl.col("true_sog") > 0.5), rows.filter(pl.col("true_sog") == 0.0)
    off = np.remainder(np.radians(under_way["cog_deg"]) - under_way["true_cog"] + np.pi, 2.0 * np.pi) - np.pi
    within = np.abs(np.degrees(off)) <= NORMAL_95 * under_way["cog_std_deg"].to_numpy()
    assert len(within) > 2000 and within.mean() > 0.9
    assert len(at_rest) > 1000 and at_rest["cog_deg"].is_null().mean() > 0.99
    assert (at_rest["sog_mps"] ** 2).mean() ** 0.5 < 0.1


def test_a_moored_vessel_is_known_to_be_at_rest_and_its_departure_at_once(tmp_path):
    """A class A ship that is moored for two hours and then sails at 5 m/s."""
    leaves = MIDNIGHT + 7200.0
    at = np.r_[np.arange(0.0, 7201.0, 180.0), np.arange(7260.0, 9001.0, 60.0)]
    north = 5.0 * np.maximum(at - 7200.0, 0.0) + np.random.default_rng(3).normal(0.0, 1.0, len(at))
    ship = pl.DataFrame({"time": MIDNIGHT + at, "lat": 55.0 + np.degrees(north / 6.38e6)})
    ship.with_columns(pl.lit("A").alias("class"), mmsi=219_000_001, lon=11.0).write_csv(tmp_path / "ship.csv")
    for name in ("causal", "smoothed"):
        steerway.archive.run([tmp_path / "ship.csv"], tmp_path / name, workers=1, smooth=name == "smoothed")
        rows = rows_of(tmp_path / name)
        moored = rows.filter(pl.col("time_s").is_between(MIDNIGHT + 1800.0, leaves))
        assert moored["sog_mps"].max() < 0.05 and moored["sog_std_mps"].max() < 0.1
        sailing = rows.filter(pl.col("time_s") > leaves)
        wrong = (sailing["sog_mps"] - 5.0).abs()
        assert set(sailing["status"]) == {"ok"} and wrong[0] < 2.0 * sailing["sog_std_mps"][0] and wrong[1:].max() < 0.1


def test_rows_at_a_rate_are_of_the_track_whose_reports_enclose_them(tmp_path):
    """Two ships under one number, of which one ends earlier: reports at 3 and at 8 s, rows at 0 s."""
    names = ("mmsi", "time_s", "latitude", "longitude")
    first = [(100_000_001, MIDNIGHT + t, 55.0 + 5.0 * t / 111_300.0, 10.0) for t in np.arange(3.0, 600.0, 10.0)]
    second = [(100_000_001, MIDNIGHT + t, 57.0 - 5.0 * t / 111_400.0, 10.0) for t in np.arange(8.0, 400.0, 10.0)]
    pl.DataFrame(first + second, schema=names, orient="row").write_csv(tmp_path / "shared.csv")
    steerway.archive.run([tmp_path / "shared.csv"], tmp_path / "out", workers=1, rate=0.1)
    rows = rows_of(tmp_path / "out").with_columns(t=pl.col("time_s") - MIDNIGHT)
    one, other = (rows.filter(pl.col("track") == track) for track in (0, 1))
    assert one["t"].to_list() == [10.0 * k for k in range(1, 60)]
    assert other["t"].to_list() == [10.0 * k for k in range(3, 40)]  # its third report confirms the ship
    one = one[1:]  # only one report precedes the first row, which has no velocity
    np.testing.assert_allclose(one["lat_deg"], 55.0 + 5.0 * one["t"] / 111_300.0, atol=3e-4)
    np.testing.assert_allclose(other["lat_deg"], 57.0 - 5.0 * other["t"] / 111_400.0, atol=3e-4)


def crossing(tmp_path):
    """The archive of two vessels that cross, with reports at different times, of a third that stops, and of three at
    anchor: after the last report of the first, the second begins on the far side of the third."""
    rows = []
    for mmsi, first, step in ((1_000_000_01, 0.0, 20.0), (1_000_000_02, 7.0, 30.0)):
        for t in np.arange(first, 3600.0, step):
            along = 5.0 * (t - 1800.0) / 111_320.0
            place = (55.0 + along, 10.0) if mmsi % 10 == 1 else (55.0 + 100.0 / 111_320.0, 10.0 + along / 0.5736)
            rows.append((mmsi, MIDNIGHT + t, *place, 5.0 / 0.514444, 0.0 if mmsi % 10 == 1 else 90.0))
    for t in np.arange(0.0, 9000.0, 15.0):
        moving = t < 2400.0
        place = 56.0 + 6.0 * min(t, 2400.0) / 111_320.0
        rows.append((1_000_000_03, MIDNIGHT + t, place, 11.0, 12.0 / 0.514444 if moving else 0.0, 0.0))
    for mmsi, first, last, north in ((4, 0.0, 3000.0, 0.0), (5, 3200.0, 6000.0, 0.1), (6, 0.0, 6000.0, 0.05)):
        times = np.arange(first, last, 15.0)
        rows += [(1_000_000_00 + mmsi, MIDNIGHT + t, 57.0 + north, 12.0, 0.0, 0.0) for t in times]
    names = ("mmsi", "time_s", "latitude", "longitude", "sog", "cog")
    pl.DataFrame(rows, schema=names, orient="row").write_csv(tmp_path / "crossing.csv")
    steerway.archive.run([tmp_path / "crossing.csv"], tmp_path / "out", workers=1)
    return tmp_path / "out"


def test_encounters_trips_and_wrong_values(tmp_path):
    directory = crossing(tmp_path)
    found = encounters(directory, 1000.0)
    assert len(found) == 1
    row = found.row(0, named=True)
    # each passes the crossing of the tracks when the other is 100 m from there: closest at 100 / √2
    assert row["cpa_m"] == pytest.approx(100.0 / np.sqrt(2.0), abs=0.3)
    assert row["cpa_time_s"] == pytest.approx(MIDNIGHT + 1810.0, abs=0.3)
    assert row["tcpa_s"] == row["cpa_time_s"] - row["start_s"] and row["end_s"] - row["cpa_time_s"] > 100.0
    assert (row["lat_deg"], row["lon_deg"]) == pytest.approx((55.0 + 50.0 / 111_320.0, 10.0), abs=2e-6)
    assert 1.0 < row["cpa_std_m"] < 10.0
    assert row["relative_speed_mps"] == pytest.approx(5.0 * np.sqrt(2.0), abs=0.02)
    assert [len(encounters(directory, most)) for most in (70.0, 72.0)] == [0, 1]
    with pytest.raises(InputError, match="distance is -1 m"):
        encounters(directory, -1.0)
    trips = rows_of(directory, "trips").filter(pl.col("mmsi") == 1_000_000_03).sort("start_s")
    assert trips["what"].to_list() == ["trip", "stop"]
    assert trips["distance_m"].to_list() == pytest.approx([14_400.0, 0.0], rel=0.01, abs=1e-3)
    assert trips["mean_speed_mps"].to_list() == pytest.approx([6.0, 0.0], abs=0.01)
    assert trips["duration_s"].to_list() == pytest.approx([2400.0, 6585.0], abs=16.0)
    wrong = rows_of(directory, "events").filter(pl.col("event") == "speed")
    assert wrong["mmsi"].to_list() == [1_000_000_03]  # it transmits twice its speed, in each of 160 reports
    assert (wrong["value"][0], wrong["reports"][0]) == (pytest.approx(6.0, abs=0.01), 160)
