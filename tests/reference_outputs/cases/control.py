"""Control: course autopilot, handover and station."""

import math

from steerway.control import AnglePID, Autopilot, StationKeeper, place_poles
from steerway.control.testing import HandOver, Steerageway
from steerway.guidance import Reference, ReferenceModel, TrackingFilter
from steerway.vessels.testing import OTTER_BOAT as OTTER
from tests.reference_outputs.tables import case, columns


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


@case("control_station")
def station():
    """A boat that turns towards the asked heading and is pushed by drag in a stream."""
    keeper, rows = StationKeeper(OTTER.station), []
    north, east, heading, speed = -20.0, 8.0, 1.0, 0.3
    for k in range(600):
        velocity = speed * math.cos(heading) + 0.15, speed * math.sin(heading) - 0.1
        course = math.atan2(velocity[1], velocity[0]) if k % 50 else math.nan
        distance, bearing = math.hypot(north, east), math.atan2(-east, -north)
        desired, force = keeper.step(distance, bearing, course, math.hypot(*velocity), heading, 0.25)
        rows.append((north, east, heading, desired[0], force, *keeper.integral))
        heading += 0.05 * math.remainder(desired[0] - heading, 2.0 * math.pi) if math.isfinite(desired[0]) else 0.0
        speed += 0.25 * (force - 77.5 * speed) / 85.0
        north, east = north + 0.25 * velocity[0], east + 0.25 * velocity[1]
    return columns("north east heading desired force integral_north integral_east", rows, 6)
