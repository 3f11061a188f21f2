"""Speed controllers, autopilots and estimators aboard, chosen by keys of the settings."""

import math

import numpy as np
import pytest

from steerway.core import InputError
from steerway.estimation.testing import HeadingEstimatorTable
from steerway.live.testing import EstimatorSettings, InputRow, MeasuredHeading, MeasuredSpeed, Settings, measured_speed
from steerway.live.testing import launch_launch as launch
from tests.desk import OTTER, Desk, square

pytest.importorskip("daqp")


@pytest.mark.parametrize(
    ("autopilot", "speed", "heading", "by"),
    [
        ("pole-placement", "disturbance-observer", "composite", "yaw-rate"),
        ("mpc", "adaptive", "composite", "propellers"),
        ("lqg", "disturbance-observer", "interval", "yaw-rate"),
    ],
)
def test_every_controller_sails_two_legs_in_a_current_of_half_the_speed(autopilot, speed, heading, by):
    """Without a compass a heading filter has no input, so that the steering filter has to give the heading."""
    table = HeadingEstimatorTable(kind=heading)
    desk = Desk(
        square(boat=OTTER),
        by=by,
        current=0.6,
        noise=0.3,
        kinds=(autopilot, speed),
        estimators=EstimatorSettings(heading=table),
    ).start()
    desk.until(lambda: desk.leg.destination == "WP2", 180.0)
    desk.sail(15.0)
    first, off = len(desk.rows), []
    while desk.leg.destination == "WP2":
        off.append(desk.state[6] - 60.0)  # the second leg leads east
        desk.sail(0.2)
    assert np.sqrt(np.mean(np.square(off))) < 3.0
    assert np.mean([row.sog for row in desk.rows[first:]]) == pytest.approx(1.2, abs=0.2)


def test_speed_from_whatever_the_links_report():
    """GNSS at 1 Hz, a log with an error of 0.5 %, a biased accelerometer at 20 Hz; their times are not in order."""
    measured, draws = MeasuredSpeed(), np.random.default_rng(1)
    assert math.isnan(measured.speed(0.0))
    for k in range(2400):
        time, speed = 0.05 * k, 2.0 + 0.5 * math.sin(0.02 * k)
        row = InputRow("imu", time, acceleration=0.2 * math.cos(0.02 * k) + 0.05 + 0.02 * draws.standard_normal())
        measured.take(row)
        if k % 20 == 0:
            measured.take(InputRow("gps", time, sog=speed + 0.1 * draws.standard_normal()))
        if k % 4 == 0:
            measured.take(InputRow("log", time - 0.01, bottom_speed=1.005 * speed, shaft=7.0))
    assert measured.speed(time) == pytest.approx(speed, abs=0.03) and measured.shaft == 7.0
    assert math.isnan(measured.speed(time + 10.0))


def test_a_silent_compass_leaves_the_heading_unknown_and_another_takes_over():
    measured = MeasuredHeading(HeadingEstimatorTable(kind="composite"), 1.5, 0.3, 1.2, 1.0)
    assert math.isnan(measured.at(0.0))
    for k in range(100):
        measured.take(InputRow("one", 0.1 * k, heading=1.0))
        measured.take(InputRow("two", 0.1 * k, heading=2.0))
    assert measured.at(10.0) == pytest.approx(1.0, abs=0.05) and measured.filter.heading_std < 0.2
    assert math.isnan(measured.at(13.0))
    for k in range(100):
        measured.take(InputRow("two", 16.0 + 0.1 * k, heading=2.0))
    assert measured.at(26.0) == pytest.approx(2.0, abs=0.05)
    for k in range(100):  # the clock was set back
        measured.take(InputRow("two", -500.0 + 0.1 * k, heading=-2.0))
    assert measured.at(-490.0) == pytest.approx(-2.0, abs=0.05)


@pytest.fixture
def settings_of(tmp_path):
    def settings(text):
        (tmp_path / "boat.toml").write_text(text)
        return Settings.load(tmp_path / "boat.toml")

    return settings


def test_the_keys_of_the_settings(settings_of):
    chosen = settings_of('[speed]\ncontroller = "adaptive"\n[autopilot]\nkind = "lqg"\n')
    assert (chosen.speed.controller, chosen.autopilot.kind) == ("adaptive", "lqg")
    estimator = settings_of(
        '[estimator.speed]\nkind = "fusion"\nsog_std = 0.2\n[estimator.heading]\nkind = "aided"\n'
    ).estimator
    assert (estimator.speed.kind, estimator.heading.kind) == ("fusion", "aided")
    tuning = measured_speed(estimator.speed).fusion.tuning
    assert (tuning.sog_std, tuning.bottom_std) == (0.2, 0.02) and measured_speed(Settings().estimator.speed) is None
    with pytest.raises(InputError, match="expected mission too"):
        launch(chosen)
    for text, why in (
        ('[estimator.heading]\nkind = "composite"\nweight = 0.2\n', r"estimator\.heading: weight has no effect"),
        ('[speed]\ncontroller = "mrac"\n', r"speed\.controller is 'mrac'"),
    ):
        with pytest.raises(InputError, match=why):
            settings_of(text)
