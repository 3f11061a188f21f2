"""Control: course autopilot, handover, station, allocation, positioning, and the bandwidth an estimate carries."""

import math

import numpy as np

from steerway.control import (
    OTTER_PROPELLERS,
    AnglePID,
    Autopilot,
    PositionPID,
    Rudder,
    StationGains,
    StationKeeper,
    TwoPropellers,
    carried_bandwidth,
    place_poles,
)
from steerway.control.testing import (
    HandOver,
    Steerageway,
    advice,
    by_bandwidth,
    comfortable_bandwidth,
    loop_damping,
    shaft_speed,
    thrust,
)
from steerway.estimation import Profile
from steerway.guidance import Reference, ReferenceModel, TrackingFilter
from steerway.vessels import CyberShip2, conditions
from steerway.vessels.testing import BOAT_FOR_SMALL_MOMENTS as OTTER_GENTLY
from steerway.vessels.testing import INERTIA
from steerway.vessels.testing import MARINER_BOAT as MARINER
from steerway.vessels.testing import OTTER_BOAT as OTTER
from tests.reference_outputs.generated import columns
from tests.reference_outputs.tables import case


@case("control_pole_placement")
def placed():
    rows = []
    for gain, time in ((0.0242, 1.0), (0.05, 2.5), (0.185, 107.3)):
        for bandwidth in (0.5, 1.5, 3.0):
            for damping in (0.7, 1.0):
                gains = place_poles(gain, time, max(bandwidth, 0.51 / (damping * time)), damping, 20.0)
                rows.append(
                    (
                        gains.proportional,
                        gains.integral_time,
                        gains.derivative_time,
                        gains.rate_feedforward,
                        gains.acceleration_feedforward,
                        gains.limit,
                    )
                )
    return columns("proportional integral_time derivative_time rate acceleration limit", rows)


def turning(control, seconds=60.0, gain=0.0242, time=1.0):
    """A Nomoto boat with a bias under `control(reference, angle, rate, dt)`, 0.1 s a step; gives (angle, rate, u)."""
    angle, rate, rows = 0.1, 0.0, []
    for k in range(round(seconds / 0.1)):
        desired = Reference(0.5 if k < 300 else -2.9, 0.01 if k < 100 else 0.0, 0.0)
        known = math.nan if 150 <= k < 155 else angle
        moment, others = control(desired, known, rate, 0.1)
        angle = math.remainder(angle + 0.1 * rate, 2.0 * math.pi)
        rate += 0.1 * (gain * (moment + 3.0) - rate) / time
        rows.append((angle, rate, moment, *others))
    return rows


@case("control_angle_pid")
def angle_pid():
    pilot = AnglePID(place_poles(0.0242, 1.0, 1.0, limit=40.0))
    pilot.start(5.0, Reference(0.5, 0.0, 0.0), 0.1, 0.0)

    def control(desired, angle, rate, dt):
        moment = pilot.step(desired, angle, rate, dt)
        pilot.limited_to(max(-25.0, min(25.0, moment)))
        return max(-25.0, min(25.0, moment)), (pilot.integral,)

    return columns("angle rate moment integral", turning(control), 5)


def helmed(shaper, hand_over=None):
    helm = Autopilot(AnglePID(place_poles(0.0242, 1.0, 1.0, limit=40.0)), shaper, hand_over)
    count = 0

    def control(desired, angle, rate, dt):
        nonlocal count
        count += 1
        speed = 0.2 if count < 80 else 1.0 if count < 400 else 0.25
        heading = math.remainder(angle - 0.15, 2.0 * math.pi)
        moment = helm.step(desired, angle, rate, heading, rate, speed, dt, not 500 < count < 520)
        if count == 450:
            helm.release()
        helm.limited_to(0.9 * moment)
        return 0.9 * moment, (helm.by_course, helm.controller.integral)

    return columns("angle rate moment by_course integral", turning(control), 5)


@case("control_helm_tracking")
def helm_tracking():
    return helmed(TrackingFilter(1.0))


@case("control_helm_reference_model")
def helm_reference_model():
    return helmed(ReferenceModel(0.8, 1.0, 0.3), HandOver(Steerageway(0.6, 0.2, 0.8, 2.0)))


@case("control_hand_over")
def hand_over():
    change, rows = HandOver(), []
    for k in range(150):
        speed, crab = 0.9 * math.sin(0.1 * k) ** 2, 1.5 * math.sin(0.04 * k)
        course = math.nan if 60 < k < 65 else 0.3
        rows.append((speed, crab, change.step(speed, course, 0.3 - crab, 0.25, k % 50 != 30)))
    return columns("speed crab by_course", rows)


def kept(gains, drift=(0.15, -0.1)):
    """A boat that turns towards the asked heading and is pushed by drag in a stream."""
    keeper, rows = StationKeeper(gains), []
    north, east, heading, speed = -20.0, 8.0, 1.0, 0.3
    for k in range(600):
        velocity = speed * math.cos(heading) + drift[0], speed * math.sin(heading) + drift[1]
        course = math.atan2(velocity[1], velocity[0]) if k % 50 else math.nan
        distance, bearing = math.hypot(north, east), math.atan2(-east, -north)
        desired, force = keeper.step(distance, bearing, course, math.hypot(*velocity), heading, 0.25)
        rows.append((north, east, heading, desired[0], force, *keeper.integral))
        heading += 0.05 * math.remainder(desired[0] - heading, 2.0 * math.pi) if math.isfinite(desired[0]) else 0.0
        speed += 0.25 * (force - 77.5 * speed) / 85.0
        north, east = north + 0.25 * velocity[0], east + 0.25 * velocity[1]
    return columns("north east heading desired force integral_north integral_east", rows, 6)


@case("control_station")
def station():
    return kept(OTTER.station)


@case("control_station_free")
def station_free():
    return kept(StationGains(85.0, 0.3, 2.0, 1.0), (-0.2, 0.3))


@case("control_allocation")
def allocation():
    mine, rows = TwoPropellers(0.5, 0.02, 0.01, 60.0, -50.0), []
    for force in np.linspace(-150.0, 260.0, 9):
        for moment in np.linspace(-70.0, 90.0, 7):
            rows.append((force, moment, OTTER_PROPELLERS.step(force, moment), mine.step(force, moment)))
    parts = [f"{who}_{what}" for who in ("otter", "mine") for what in ("port", "starboard", "force", "moment")]
    found = columns("force moment " + " ".join(parts), rows)
    return found | {"max_moment": np.full(len(rows), OTTER_PROPELLERS.max_moment)}


@case("control_propeller_curve")
def propeller_curve():
    values = np.linspace(-150.0, 150.0, 31)
    rows = [(shaft_speed(each, 0.011, 0.0064), thrust(each, 0.011, 0.0064)) for each in values]
    return columns("shaft thrust", rows) | {"rudder": [Rudder(0.6).step(50.0, each / 100.0).rudder for each in values]}


@case("control_bandwidth")
def bandwidth():
    rows = []
    for speed in (0.3, 1.0, 3.0):
        for density in (1e-4, 4e-3):
            for std in (0.02, 0.5, 3.0):
                carried = carried_bandwidth(speed, density, std, 0.2)
                fits = [advice(each, speed, density, std, 0.2, time)[0] for each in (0.3, 1.0) for time in (None, 2.0)]
                rows.append((carried, loop_damping(0.5, carried, 2.0), comfortable_bandwidth(carried, None), *fits))
    return columns("carried damping gain slow slow_with_time fast fast_with_time", rows)


@case("control_advice", text=True)
def advised():
    """The sentences, for every profile and three autopilots."""
    lines = []
    for name in ("small-usv", "otter", "ship"):
        profile = Profile.named(name)
        for bandwidth, time in ((0.05, None), (0.5, 2.0), (2.0, 1.0)):
            for speed in (0.5, 3.0):
                numbers = profile.on_average.course_rate_noise, profile.position_std, 0.2
                lines.append(f"{name} {bandwidth} {speed} {time}: {advice(bandwidth, speed, *numbers, time)}")
    return "\n".join(lines) + "\n"


@case("control_position_pid")
def position_pid():
    """CyberShip II held at two places against a steady push."""
    boat, pid, rows = CyberShip2(), PositionPID(by_bandwidth(INERTIA, 0.3, limit=(2.0, 1.5, 1.5))), []
    state, push = boat.start(), conditions((0.0, 0.0), (0.5, -0.4), 0.05)
    for k in range(1200):
        goal = (2.0, -1.0, 0.8) if k < 500 else (-1.0, 3.0, -2.5)
        if k == 900:
            pid.restart()
        force = pid.step(goal, *state[:3], state[3:], 0.1)
        state = boat.step(state, force, push, 0.1)
        rows.append((state, force, pid.integral))
    names = "north east heading surge sway yaw_rate force_x force_y moment integral_x integral_y integral_moment"
    return columns(names, rows, 15)


@case("control_position_pid_free")
def position_pid_free():
    careful, careless = (PositionPID(by_bandwidth(INERTIA, 0.2, 0.8, 0.2, (3.0, 2.0, 1.0)), each) for each in (1, 0))
    rows = []
    for k in range(60):
        place = 0.1 * k, 3.0 * math.sin(0.1 * k), 0.1 * k, (0.1, -0.02 * k, 0.05)
        rows.append((careful.step((4.0, 1.0, 2.0), *place, 0.5), careless.step((4.0, 1.0, 2.0), *place, 0.5)))
    return columns("x y moment careless_x careless_y careless_moment", rows)


@case("control_boats")
def boats():
    """What is taken for known of the boats that come along."""
    rows = []
    for boat in (OTTER, OTTER_GENTLY, MARINER):
        pilot = boat.autopilot(TrackingFilter(1.0)).controller.gains
        rows.append(
            (
                boat.nomoto_gain,
                boat.nomoto_time,
                boat.yaw_limit,
                boat.bandwidth,
                boat.lookahead,
                boat.acceptance,
                boat.cruise,
                boat.top_speed,
                boat.damping,
                pilot.proportional,
                pilot.integral_time,
                pilot.limit,
            )
        )
    return columns("K T limit bandwidth lookahead acceptance cruise top damping proportional integral_time of", rows)
