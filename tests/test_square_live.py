"""Squares on a desk: on a virtual clock, by two processes at their true pace, and on the bench."""

import asyncio
import re
import signal
import time
from itertools import product

import numpy as np
import polars as pl
import pytest

from steerway.core import rms
from steerway.live.testing import Settings
from tests.bench import Case, Corner, Found, Limits, corners_of, route, sail, table
from tests.golden import missed, no_worse
from tests.ports import wait_until
from tests.square import GUIDED, MOST, OTTER, cross_track, sailed, two_processes

pytest.importorskip("pymavlink", reason="pymavlink is not installed")


@pytest.mark.parametrize("by", MOST)
def test_the_square_is_sailed_close_to_its_legs_after_the_turns(by, tmp_path):
    """Without a gyro of the vehicle's own, propellers hold a leg half as well. No turn is within the acceptance."""
    mission = tmp_path / "square.toml"
    mission.write_text(re.sub("acceptance = .*", "acceptance = 0.3", OTTER.mission.read_text()))
    run, log = sailed(OTTER._replace(mission=mission), lambda _: asyncio.sleep(112.0), by)
    assert "stopped" not in log
    assert re.search(r"turns by .* outside of its corner, its acceptance is 0.3 m: sail slower, or turn quicker", log)
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
        wait_until(lambda: words in log.read_text(), patience)
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


@pytest.mark.parametrize("case", [Case(0.5, 45.0, compass=True, seed=2), Case(1.0, 315.0, compass=False, seed=1)])
def test_a_square_is_sailed_along_its_legs_and_the_right_way_round_its_corners(case):
    found = sail(case)
    assert found.finished and not any(corner.is_wrong_way for corner in found.corners)
    assert len(found.legs) == len(found.corners) == 3 and max(found.legs) <= Limits().legs
    assert all(corner.closest <= case.acceptance and corner.outside <= case.acceptance for corner in found.corners)


WIDE = missed("two of 96 squares leave a corner by just above 1.0 m")
CEILING = Limits(1.5, 1.1, 0.35)


@pytest.mark.study
@pytest.mark.parametrize("current", [0.0, 0.5, 1.0, pytest.param(1.3, marks=WIDE)])
def test_all_squares(current):
    """16 directions, with and without a compass, three seeds."""
    directions = [22.5 * k for k in range(16)] if current else [0.0]
    found = [sail(Case(current, *each)) for each in product(directions, (True, False), (1, 2, 3))]

    def misses(limits):
        return [f"{each.case.words}: {'; '.join(each.misses(limits))}" for each in found if each.misses(limits)]

    no_worse(not misses(CEILING), "\n".join(misses(CEILING)))
    assert not misses(Limits()), "\n".join(misses(Limits()))


def test_a_corner_by_a_track_drawn_by_hand():
    """North, then past the corner by 3 m, then east: turned by the long way round."""
    points = route(90.0)
    north = [*range(40, 84), *[83] * 57]
    east = [*[0] * 44, *range(0, 57)]
    heading = [*[0.0] * 44, *[270.0, 180.0, 90.0], *[90.0] * 54]
    run = pl.DataFrame({"true_north_m": north, "true_east_m": east, "true_heading_deg": heading})
    run = run.with_columns(pl.all().cast(pl.Float64))
    (corner,) = corners_of(run, points, "turns by +91° into leg 2, 1.0 m from waypoint 1")
    assert corner.closest == pytest.approx(0.0, abs=0.1) and corner.outside == pytest.approx(3.0, abs=0.1)
    assert corner.turned == pytest.approx(-270.0) and corner.planned == 91.0 and corner.is_wrong_way


def test_every_limit_is_judged():
    good = Found(Case(), True, 200.0, [0.1, 0.1, 0.1], [Corner(90.0, 88.0, 1.0, 0.5)] * 3)
    assert good.misses(Limits()) == []
    bad = good._replace(legs=[0.1, 0.5], corners=[Corner(-270.0, 88.0, 2.0, 1.5)])
    assert len(bad.misses(Limits())) == 5
    assert good._replace(finished=False, why="stopped").misses(Limits()) == ["not finished: stopped"]
    slow = good._replace(case=Case(turn_rate=25.0), corners=[Corner(90.0, 88.0, 3.9, 3.9)])
    assert slow.misses(Limits()) == []
    assert table([good, bad]).splitlines()[1].split() == "0.5 90 yes 1/2 2 1 2.0 1.5 0.50".split()
