"""The steering blocks on the vessels: P1's ship on her route with true states, and the Otter's own propellers."""

import math

import pytest

from steerway.control import OTTER_PROPELLERS, AnglePID, place_poles
from steerway.guidance import LineOfSight, LowPass, Mission, Phase, Route
from steerway.vessels import CALM, Mariner
from steerway.vessels.testing import RUDDER, otter
from steerway_studies.testing import MARINER_NOMOTO


def test_a_mariner_ship_on_p1s_route():
    """P1 §4 with true course and course rate, T_lp = 40 s: switches, rudder and cross-track error as known for it."""
    step, ship = 0.1, Mariner()
    state = ship.start()
    route = Route([0.0, 2000.0, 5000.0, 3000.0, 6000.0, 10000.0], [0.0, 0.0, 5000.0, 8000.0, 12000.0, 12000.0], 50.0)
    mission, law, shaper = Mission(route), LineOfSight(800.0), LowPass(40.0)
    pilot = AnglePID(place_poles(*MARINER_NOMOTO, bandwidth=0.05, limit=RUDDER.high))
    shaper.start(0.0)
    rudder, rate = 0.0, 0.0
    while mission.phase is Phase.UNDER_WAY and mission.log.time < 3600.0:
        sight = ship.motion(state, CALM)
        course, speed = math.atan2(sight[4], sight[3]), math.hypot(sight[3], sight[4])
        leg = mission.step(sight[0], sight[1], step)
        command = pilot.step(shaper.step(law.step(leg, course, speed, step), step), course, sight[6], step)
        # What the machine is asked for, (command − rudder)/lag; the state carries the opposite sign.
        rate = max(rate, abs(command + state[6]) / RUDDER.lag)
        state = ship.step(state, (command,), CALM, step)
        rudder = max(rudder, abs(state[6]))
    times = [passage.time for passage in mission.log.passages]
    assert times[:4] == pytest.approx([252.7, 1063.3, 1596.6, 2329.3], abs=2.0)
    assert mission.log.reached == [1, 2, 3, 4, 5]
    assert math.degrees(rudder) == pytest.approx(31.3, abs=1.0)
    assert math.degrees(rate) == pytest.approx(3.76, abs=0.2)
    assert mission.log.cross_track_max == pytest.approx(427.0, abs=10.0)


def test_the_allocation_knows_the_otters_propellers():
    assert otter.PROPELLER_GAIN_AHEAD == pytest.approx(OTTER_PROPELLERS.gain_ahead, rel=1e-12)
    assert otter.PROPELLER_GAIN_ASTERN == pytest.approx(OTTER_PROPELLERS.gain_astern, rel=1e-12)
    assert otter.PROPELLER_MAX == pytest.approx(OTTER_PROPELLERS.max_speed, rel=1e-12)
    assert otter.PROPELLER_MIN == pytest.approx(OTTER_PROPELLERS.min_speed, rel=1e-12)
    for force, moment in ((30.0, 10.0), (-60.0, -5.0), (0.0, 25.0)):
        out = OTTER_PROPELLERS.step(force, moment)
        ends = otter.thrust(out.port), otter.thrust(out.starboard)
        assert ends[0] + ends[1] == pytest.approx(force) and 0.395 * (ends[0] - ends[1]) == pytest.approx(moment)
