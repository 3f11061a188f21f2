"""The square on a desk: sailed on a virtual clock, and by two processes at their true pace as a user starts them."""

import asyncio
import re
import signal
import time

import numpy as np
import polars as pl
import pytest

from steerway.core import rms
from steerway.live.testing import Settings
from tests.square import GUIDED, MOST, OTTER, cross_track, sailed, two_processes

pytest.importorskip("pymavlink", reason="pymavlink is not installed")


@pytest.mark.parametrize("by", MOST)
def test_the_square_is_sailed_close_to_its_legs_after_the_turns(by):
    """Without a gyro of the vehicle's own, propellers hold a leg half as well."""
    run, log = sailed(OTTER, lambda _: asyncio.sleep(112.0), by)
    assert "stopped" not in log
    legs = cross_track(run)
    assert len(legs[0]) > 100 and rms(legs[0]) <= MOST[by]
    assert np.median(run["true_sog_mps"].to_numpy()[-300:]) == pytest.approx(1.2, abs=0.1)
    if by == "mavlink":
        assert GUIDED in run["mode"] and run["mode"][-1] == GUIDED


@pytest.mark.parametrize(("by", "kind"), [("mavlink", "aided"), ("propellers", "interval")])
def test_the_heading_is_that_of_the_filter_in_the_settings(by, kind, tmp_path):
    """A compass that is 6° off, by HDT or as the vehicle's heading, with her gyro."""
    compass = "velocity_std = 0.1\n[compass]\ndeviation_deg = [0.0, 6.0, -6.0, 0.0, 0.0]\n"
    boat, settings = tmp_path / "otter.toml", tmp_path / "live.toml"
    boat.write_text(OTTER.scenario.read_text().replace("markov = []\n", f"markov = []\n{compass}"))
    settings.write_text(f'profile = "otter"\n[estimator.heading]\nkind = "{kind}"\ndeviation_std_deg = 5.0\n')
    course = OTTER._replace(scenario=boat, settings=Settings.load(settings))
    run, log = sailed(course, lambda _: asyncio.sleep(60.0), by)
    assert re.search(rf"heading \({kind}\) known to ± \d+°", log) and "stopped" not in log and "unknown" not in log
    assert np.median(run["true_sog_mps"].to_numpy()[-50:]) == pytest.approx(1.2, abs=0.2)


def test_a_vehicle_that_falls_silent_stops_the_autopilot_before_she_drops_the_order(tmp_path):
    """At their true pace the boat is frozen, goes on, and is put into HOLD."""

    def until(log, words, patience):
        begun = time.monotonic()
        while words not in log.read_text():
            assert time.monotonic() - begun < patience, f"{words!r} was never said in:\n{log.read_text()}"
            time.sleep(0.005)
        return time.monotonic()

    with two_processes(OTTER, tmp_path) as (boat, log):
        until(log, "autopilot running", 150.0)
        time.sleep(2.0)
        boat.send_signal(signal.SIGSTOP)
        cut = time.monotonic()
        stopped = until(log, "stopped: link mavlink:udpin:127.0.0.1:", 10.0)
        assert 2.0 < stopped - cut < 3.0 and " is lost" in log.read_text()
        boat.send_signal(signal.SIGCONT)
        time.sleep(5.0)
    run = pl.read_parquet(tmp_path / "run.parquet")
    assert run["mode"][-1] == 4.0 and run["asked_speed_mps"][-1] is None
