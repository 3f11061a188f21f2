"""The study of P1 section 4: its known numbers, from which the filters differ, and what it writes."""

import math
from functools import cache

import numpy as np
import pytest

from steerway.vessels.testing import CRUISE_SPEED
from steerway_studies.testing import PRINTED_NOISE, STATED_NOISE, ShipCase, ship

LOOKAHEAD = ship.LOOKAHEAD
measured = cache(ship.measured)
"""Each voyage once."""


@pytest.fixture(scope="module")
def truth():
    return measured(ShipCase("truth"))


def test_a_slow_low_pass_tracks_badly_and_a_quick_one_saturates():
    quick, slow = (measured(ShipCase("truth", low_pass=low_pass)) for low_pass in (20.0, 100.0))
    assert quick["rudder_max_deg"] == pytest.approx(40.0, abs=0.1) and quick["saturated_pct"] > 1.0
    assert slow["rudder_max_deg"] < 14.0 and slow["cross_track_max_m"] == pytest.approx(614.0, abs=10.0)


def test_the_printed_start_finishes_north_but_not_south():
    assert measured(ShipCase("printed"))["finished"] == 1.0
    assert measured(ShipCase("printed", turned=math.radians(180.0)))["finished"] == 0.0


def test_turning_the_scene_turns_the_truth_only(truth):
    turned = measured(ShipCase("truth", turned=math.radians(105.0)))
    for key in ("switch_s_4", "rudder_max_deg", "cross_track_max_m", "duration_s"):
        assert turned[key] == pytest.approx(truth[key], rel=1e-3)


@pytest.mark.parametrize(("noise", "std"), [(PRINTED_NOISE, 15.6), (STATED_NOISE, 4.7)])
def test_erratum_p1_42_what_the_printed_noise_amounts_to(noise, std):
    ((stationary, _),) = ship.receiver(noise).markov
    assert stationary == pytest.approx(std, abs=0.05)


def test_the_lyapunov_function_falls_as_promised():
    ideal, steered = ship.approaches()
    assert ideal.falling_pct == 100.0 and ideal.relative_error < 1e-5
    assert steered.falling_pct > 90.0
    closed = np.arcsinh(LOOKAHEAD / ideal.cross_track[0])  # d/dt arcsinh(Δ/y) − … : (37) integrated once
    later = 3000
    way = np.hypot(LOOKAHEAD, ideal.cross_track[[0, later]]) - LOOKAHEAD * np.arcsinh(
        LOOKAHEAD / ideal.cross_track[[0, later]]
    )
    assert way[0] - way[1] == pytest.approx(CRUISE_SPEED * ideal.time[later], rel=1e-5)
    assert closed > 0.0 and ship.promised(0.0, CRUISE_SPEED) == 0.0


@pytest.mark.parametrize("angle", [0.0, 135.0, 180.0, 285.0])
def test_the_product_finishes_however_the_scene_is_turned(angle, truth):
    turned = measured(ShipCase("product", turned=math.radians(angle)))
    assert turned["finished"] == 1.0
    assert turned["duration_s"] == pytest.approx(truth["duration_s"], rel=0.05)
    assert turned["cog_rms_deg"] < 4.0 and turned["sog_rms_mps"] < 0.25
