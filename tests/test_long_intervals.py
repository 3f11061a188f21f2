"""Intervals of seconds to minutes in few steps: the same estimate as by steps of a second."""

import numpy as np
import pytest

from steerway.core import OK, Fixes
from steerway.estimation import FiveStateFilter
from steerway.estimation.testing import LONGEST_GAP
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


def test_few_steps_give_what_steps_of_a_second_give(reports):
    """But where a fix lies at the very gate."""
    at_once, sog, course = FiveStateFilter("ais").filter(reports), [], []
    for _, track in reports.tracks():
        estimator = FiveStateFilter("ais")
        for k in range(len(track)):
            elapsed = track.time[k] - track.time[k - 1] if k else 0.0
            steps = int(elapsed) if elapsed <= LONGEST_GAP else 1
            for _ in range(steps):
                estimator.predict(elapsed / steps)
            estimator.update(track.latitude[k], track.longitude[k])
            sog.append(estimator.sog)
            course.append(estimator.cog)
    assert (np.isfinite(course) == np.isfinite(at_once.cog)).mean() > 0.9999
    under_way = at_once.status == OK
    away = (np.abs(at_once.sog - sog) / at_once.sog_std)[under_way]
    turned = np.abs(np.angle(np.exp(1j * (at_once.cog - course)))) / at_once.cog_std
    assert np.nanquantile(away, 0.9995) < 0.01
    assert np.nanquantile(turned[under_way], 0.9995) < 0.01


def test_at_low_speed_one_step_is_many():
    at_once, in_steps = FiveStateFilter("ais"), FiveStateFilter("ais")
    for estimator, step in ((at_once, 180.0), (in_steps, 1.0)):
        for k in range(4):
            for _ in range(int(180.0 / step)):
                estimator.predict(step)
            estimator.update_north_east(5.0 * (k % 2), 3.0 * (k % 3))
        for _ in range(int(180.0 / step)):
            estimator.predict(step)
        assert not estimator.underway
    np.testing.assert_allclose(at_once.state, in_steps.state, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(at_once.covariance, in_steps.covariance, rtol=1e-9, atol=1e-9)
