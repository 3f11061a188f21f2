"""Speed controllers and autopilots aboard, by the keys of the settings."""

import math

import numpy as np
import pytest

from steerway.core.errors import InputError
from steerway.live.autopilot.speeds import MeasuredSpeed
from steerway.live.base.rows import InputRow
from steerway.live.launch import launch
from steerway.live.settings import Settings
from tests.desk import NOON, OTTER, Desk, square

pytest.importorskip("daqp")


@pytest.mark.parametrize("by", ["yaw-rate", "propellers"])
@pytest.mark.parametrize("kinds", [("mpc", "adaptive"), ("lqg", "disturbance-observer")])
def test_the_boat_sails_the_square_by_other_controllers(kinds, by):
    desk = Desk(square(boat=OTTER), by=by, kinds=kinds).start()
    desk.until(lambda: desk.leg.destination == "WP2", 180.0)
    first = len(desk.rows)
    desk.until(lambda: desk.leg.destination == "WP3", 180.0)
    sogs = np.array([row.sog for row in desk.rows[first:]])
    assert math.isfinite(sogs.mean()) and sogs.mean() == pytest.approx(1.2, abs=0.2)


def test_speed_from_whatever_the_links_report():
    """GNSS at 1 Hz, a log that is 0.5 % off, a biased accelerometer at 20 Hz; a time that goes back does no harm."""
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


def test_the_boat_holds_her_measured_speed():
    measured = MeasuredSpeed()
    desk = Desk(square(boat=OTTER), by="propellers", kinds=("pole-placement", "adaptive"), measured=measured)
    fixes = desk.fixes
    log = lambda: InputRow("log", NOON + desk.time, bottom_speed=float(desk.state[0]))  # noqa: E731
    desk.fixes = lambda time, north, east: [*fixes(time, north, east), log()]
    desk.start().sail(20.0)
    asked, speeds = [], []
    for _ in range(20):
        desk.sail(1.0)
        asked.append(desk.order.speed)
        speeds.append(float(desk.state[0]))
        assert measured.speed(NOON + desk.time) == pytest.approx(speeds[-1], abs=0.1)
    # On the first leg; in the turns the autopilot asks for less.
    assert min(asked) > 1.19 and np.mean(speeds) == pytest.approx(1.2, abs=0.06)


def settings_of(tmp_path, text):
    path = tmp_path / "boat.toml"
    path.write_text(text, encoding="utf-8")
    return Settings.load(path)


def test_the_keys_of_the_settings(tmp_path):
    settings = settings_of(tmp_path, '[speed]\ncontroller = "adaptive"\n[autopilot]\nkind = "lqg"\n')
    assert (settings.speed.controller, settings.autopilot.kind) == ("adaptive", "lqg")
    fused = settings_of(tmp_path, '[estimator.speed]\nkind = "fusion"\n')
    assert fused.estimator.speed.kind == "fusion" and Settings().estimator.speed.kind == "course"
    assert Settings().speed.controller == "pi" and Settings().autopilot.kind == "pole-placement"
    with pytest.raises(InputError, match=r"speed\.controller is 'mrac'"):
        settings_of(tmp_path, '[speed]\ncontroller = "mrac"\n')
    with pytest.raises(InputError, match="expected mission too"):
        launch(settings)
