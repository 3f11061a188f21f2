"""Speed controllers and autopilots aboard, by the keys of the settings."""

import math

import numpy as np
import pytest

from steerway.core.errors import InputError
from steerway.live.launch import launch
from steerway.live.settings import Settings
from tests.desk import OTTER, Desk, square

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


def settings_of(tmp_path, text):
    path = tmp_path / "boat.toml"
    path.write_text(text, encoding="utf-8")
    return Settings.load(path)


def test_the_keys_of_the_settings(tmp_path):
    settings = settings_of(tmp_path, '[speed]\ncontroller = "adaptive"\n[autopilot]\nkind = "lqg"\n')
    assert (settings.speed.controller, settings.autopilot.kind) == ("adaptive", "lqg")
    assert Settings().speed.controller == "pi" and Settings().autopilot.kind == "pole-placement"
    with pytest.raises(InputError, match=r"speed\.controller is 'mrac'"):
        settings_of(tmp_path, '[speed]\ncontroller = "mrac"\n')
    with pytest.raises(InputError, match="expected mission with them"):
        launch(settings)
