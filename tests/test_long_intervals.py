"""Intervals of seconds to minutes in few steps: the same estimate as by steps of a second."""

import numpy as np
import pytest

from steerway.core import OK, Fixes
from steerway.core.testing import displaced_all
from steerway.estimation import FiveStateFilter
from tests.fleet import generate


@pytest.fixture(scope="module")
def reports(tmp_path_factory):
    """Reports of a few generated ships with the true SOG in `water_speed`, which no filter here uses."""
    import polars as pl

    directory = tmp_path_factory.mktemp("fleet")
    generate(directory, count=2, days=1, seed=5)
    truth = pl.read_parquet(directory / "truth.parquet").filter(pl.col("ship") >= 0, pl.col("lat_deg") < 91.0)
    truth = truth.sort("ship", "time_s").unique(["ship", "time_s"], keep="first", maintain_order=True)
    latitude, longitude = np.radians(truth["lat_deg"].to_numpy()), np.radians(truth["lon_deg"].to_numpy())
    ship = truth["ship"].to_numpy().astype(np.int64)
    return Fixes(truth["time_s"].to_numpy(), latitude, longitude, water_speed=truth["sog_mps"].to_numpy(), mmsi=ship)


def in_steps_of_a_second(track):
    """The motion at the reports of a vessel, predicted from second to second."""
    motion = FiveStateFilter("ais").filter(track, 1.0)
    return motion.rows(np.isin(motion.time, track.time))


def test_few_steps_give_what_steps_of_a_second_give(reports):
    """But where a fix lies at the very gate."""
    at_once = FiveStateFilter("ais").filter(reports)
    tracks = [in_steps_of_a_second(track) for _, track in reports.tracks()]
    sog, course = (np.concatenate([getattr(each, name) for each in tracks]) for name in ("sog", "cog"))
    assert (np.isfinite(course) == np.isfinite(at_once.cog)).mean() > 0.9999
    under_way = at_once.status == OK
    away = (np.abs(at_once.sog - sog) / at_once.sog_std)[under_way]
    turned = np.abs(np.angle(np.exp(1j * (at_once.cog - course)))) / at_once.cog_std
    assert np.nanquantile(away, 0.9995) < 0.01
    assert np.nanquantile(turned[under_way], 0.9995) < 0.01


def test_at_rest_few_steps_are_many():
    """A hundredth of a deviation here too, though at rest the model is least linear."""
    k = np.arange(5)
    places = displaced_all(0.9, 0.2, 5.0 * (k % 2), 3.0 * (k % 3))
    rest = Fixes(180.0 * k, *places, mmsi=np.full(5, 257000001))
    at_once, in_steps = FiveStateFilter("ais").filter(rest), in_steps_of_a_second(rest)
    assert np.isnan(at_once.cog).all(), "she may go either way"
    assert np.nanmax(np.abs(at_once.sog - in_steps.sog) / at_once.sog_std) < 0.01
    assert np.nanmax(at_once.sog) < 0.1
    for name in ("sog_std", "position_std"):
        np.testing.assert_allclose(getattr(at_once, name), getattr(in_steps, name), rtol=0.01, err_msg=name)


def test_reports_minutes_apart_are_smoothed():
    time = 180.0 * np.arange(8)
    noise = np.random.default_rng(3).normal(0.0, 5.0, (2, 8))
    track = Fixes(time, *displaced_all(0.9, 0.2, 5.0 * time + noise[0], noise[1]), mmsi=np.full(8, 257000001))
    causal, smoothed = (getattr(FiveStateFilter("ais"), name)(track) for name in ("filter", "smooth"))
    assert np.abs(smoothed.sog[2:] - 5.0).max() < 0.2  # it starts by the first two
    assert (smoothed.sog_std[2:] <= causal.sog_std[2:] + 1e-9).all()
