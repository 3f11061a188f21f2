"""The whole-record estimate: its rows and columns, its rate, its smoother, its aids, its tuner."""

import math
from dataclasses import replace

import numpy as np
import pytest

import steerway
from steerway.core import OK, Fixes
from steerway.core.testing import PREDICTED
from steerway.estimation import FiveStateFilter, Profile
from tests.scenes import angle_error, straight, turning

SMALL = Profile(speed_noise=1e-3, course_rate_noise=2e-3, course_rate_decay=0.3, position_std=0.5)
COLUMNS = (
    "time_s lat_deg lon_deg sog_mps cog_deg course_rate_dps sog_std_mps cog_std_deg course_rate_std_dps "
    "position_std_m position_relative_std_m nis status"
).split()


def output(fixes: Fixes, **columns) -> Fixes:
    """The fixes with further columns."""
    return Fixes(fixes.time, fixes.latitude, fixes.longitude, **columns)


def test_columns_and_ranges():
    frame = steerway.estimate(turning(1.3, 3.0, 120.0).fixes(0.5, 1), SMALL, causal=True).to_frame()
    assert frame.columns == COLUMNS
    assert frame["cog_deg"].drop_nulls().is_between(0.0, 360.0, closed="left").all()
    undefined = frame.filter(frame["cog_deg"].is_null())
    assert set(undefined["status"]) <= {"starting", "no_course", "rejected"}
    assert undefined["course_rate_dps"].null_count() == len(undefined)


def test_a_rate_adds_rows_between_fixes_and_changes_nothing_at_them():
    fixes = turning(1.3, 0.5, 60.0).fixes(0.5, 1)
    plain = steerway.estimate(fixes, SMALL, causal=True)
    fine = steerway.estimate(fixes, SMALL, rate=50.0, causal=True)
    assert len(fine) == 3001
    np.testing.assert_allclose(np.diff(fine.time), 0.02, atol=1e-4)
    at_fixes = fine.rows(slice(None, None, 10))
    np.testing.assert_allclose(at_fixes.sog, plain.sog, atol=1e-5)
    assert (at_fixes.status[10:] == OK).all()
    assert (np.delete(fine.status, np.s_[::10])[100:] == PREDICTED).all()
    between = fine.sog_std[105:110]
    assert (np.diff(between) > 0.0).all(), "uncertainty grows until the next fix"


def _both(profile):
    estimator = FiveStateFilter(profile)
    return estimator.filter, estimator.smooth


def test_the_last_smoothed_row_is_the_filtered_one():
    fixes = turning(1.3, 0.5, 60.0).fixes(0.5, 2)
    filtered, smoothed = (f(fixes) for f in _both(SMALL))
    for name in ("sog", "cog", "course_rate", "sog_std", "cog_std", "latitude"):
        np.testing.assert_allclose(getattr(smoothed, name)[-1], getattr(filtered, name)[-1], rtol=1e-12)


def test_vessels_are_estimated_each_for_itself():
    one, two = turning(5.0, 0.3, 300.0, rate=0.2).fixes(5.0, 1), turning(8.0, 2.0, 300.0, rate=0.1).fixes(5.0, 2)
    mmsi = np.r_[np.full(len(one), 257000001), np.full(len(two), 219000002)]
    columns = {name: np.r_[getattr(one, name), getattr(two, name)] for name in ("time", "latitude", "longitude")}
    fleet = steerway.estimate(Fixes(**columns, mmsi=mmsi), "ais", causal=True)
    assert fleet.to_frame().columns == ["mmsi", *COLUMNS]
    alone = steerway.estimate(replace(one, mmsi=mmsi[: len(one)]), "ais", causal=True)
    np.testing.assert_array_equal(fleet.rows(fleet.mmsi == 257000001).sog, alone.sog)


@pytest.mark.parametrize(
    ("aid", "better_than"),
    [(("sog", "cog"), 0.45), (("yaw_rate",), 0.5), (("heading", "yaw_rate"), 0.5), (("water_speed",), 1.02)],
)
def test_aids_help(aid, better_than):
    """Velocity of 0.05 m/s, a gyro of 0.1 °/s with a bias of 0.3 °/s, a compass 8° off, a log in 0.4 m/s of stream."""
    profile = SMALL.model_copy(
        update={"sog_std": 0.05, "velocity_std": 0.05, "yaw_rate_std": math.radians(0.1), "crab_time": 1e4}
    )
    alone, aided = [], []
    for seed in range(8):
        scene = turning(1.3, 0.3 * seed, 120.0, seed=seed)
        rng = np.random.default_rng([seed, 2])
        n = len(scene.time)
        true_rate = np.gradient(np.unwrap(scene.cog), scene.time)
        velocity = scene.sog * np.exp(1j * scene.cog) + rng.normal(0, 0.05, n) + 1j * rng.normal(0, 0.05, n)
        fixes = output(
            scene.fixes(0.5, seed),
            sog=np.abs(velocity),
            cog=np.angle(velocity),
            heading=scene.cog + math.radians(8.0) + rng.normal(0.0, math.radians(1.0), n),
            water_speed=scene.sog - 0.4 + rng.normal(0.0, 0.1, n),
            yaw_rate=true_rate + math.radians(0.3) + rng.normal(0.0, math.radians(0.1), n),
        )
        for found, aids in ((alone, ()), (aided, aid)):
            motion = steerway.estimate(fixes, profile, aid=aids, causal=True)
            found.append(np.mean(angle_error(motion.cog, scene.cog)[300:] ** 2))
    assert np.sqrt(np.mean(aided)) < better_than * np.sqrt(np.mean(alone))


def test_tune_refuses_a_log_that_tells_nothing():
    with pytest.raises(steerway.InputError, match="of 101 fixes are under way"):
        steerway.tune(straight(0.0, 0.0, 20.0).fixes(0.1, 1))


def test_profiles_survive_a_file(tmp_path):
    path = tmp_path / "mine.toml"
    profile = SMALL.model_copy(update={"name": 'the "Ægir"', "position_std": 0.1 + 0.2})
    profile.save(path)
    assert Profile.load(path) == profile


def test_a_path_is_no_record():
    with pytest.raises(steerway.InputError, match=r"given as str, expected Fixes, as steerway.read\(path\)"):
        steerway.estimate("sortie.nmea")


def test_unknown_names_are_answered_with_the_known_ones():
    with pytest.raises(
        steerway.InputError, match="otter, mariner-usv, simulated-otter, small-usv, sailing-yacht, swell, ship"
    ):
        FiveStateFilter("otterr")
    with pytest.raises(steerway.InputError, match="sog, cog, heading, water_speed, yaw_rate"):
        FiveStateFilter("otter", aid=("compass",))
