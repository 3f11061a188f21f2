"""Speed along the hull (P3): surge filter, adaptive speed control, the speed PI."""

import math

import numpy as np

from steerway.control import AdaptiveSpeed, AdaptiveSpeedGains, SpeedPI, SpeedPIGains
from steerway.estimation.speed import SurgeFilter, SurgeTuning
from steerway.vessels import CALM, Actuator, Surge, conditions, published_surrogate
from tests.reference_outputs.tables import case, columns

STEP = 0.02


def received(seconds, outage):
    """(acceleration, {aid: reading}, propeller speed) at 50 Hz of a boat whose speed swings in a stream; GPS and log at
    10 Hz, but for the outage."""
    chance = np.random.default_rng(4)
    for k in range(round(seconds / STEP)):
        time = STEP * (k + 1)
        noise = chance.standard_normal(4) * (0.004, 0.03, 0.002, 0.05)
        speed = 3.0 + math.sin(0.2 * time)
        aids = {}
        if not outage[0] < time < outage[1]:
            if k % 5 == 0:
                aids["sog"] = speed + noise[1]
            if k % 5 == 2:
                aids["water_speed"] = speed - 0.4 + noise[2]
        yield 0.2 * math.cos(0.2 * time) + 0.02 + noise[0], aids, speed + 0.1 + noise[3]


@case("speed_surge_filter")
def surge_filter():
    """Every kind of aid in turn, ten seconds of silence, and a state opened."""
    filter, rows, nis = SurgeFilter(SurgeTuning(unmeasured=0.2)), [], (math.nan,) * 4
    for k, (acceleration, aids, propeller) in enumerate(received(60.0, (30.0, 40.0))):
        filter.predict(acceleration, STEP)
        if aids:
            if k % 25 == 0:
                aids |= {"propeller_speed": propeller, "bottom_speed": propeller - 0.1}
            news = filter.aid_by(**aids)
            nis = [new if math.isfinite(new) else old for new, old in zip(news, nis, strict=True)]
        if k == 2500:
            filter.open(0, 4.0)
        deviations = np.sqrt(np.diag(filter.covariance))
        rows.append((*filter.state, *deviations, filter.speed, filter.current, filter.speed_std, *nis))
    names = "x0 x1 x2 x3 x4 std0 std1 std2 std3 std4 speed current speed_std nis_sog nis_bottom nis_water nis_propeller"
    return columns(names, rows, 25)


def controlled(boat, control, sea=CALM):
    state, command, rows = boat.start(), 0.0, []
    for k in range(2400):
        setpoint = 3.0 if k < 1200 else 6.0
        if k % 2 == 0:
            speed = math.nan if 600 <= k < 640 else state[3]
            command = control.step(setpoint, speed, 0.05, state[4])
        state = boat.step(state, (command,), sea, 0.025)
        rows.append((state[3], state[4], command, control.model, *control.parameters))
    return columns("speed shaft command model a_s a_u a_uu", rows, 24)


@case("speed_adaptive")
def adaptive():
    return controlled(Surge(shaft=Actuator("shaft", 0.0, 17.5, math.inf, 0.5)), AdaptiveSpeed())


@case("speed_adaptive_inner_loop")
def adaptive_inner_loop():
    sea = conditions((0.4, 0.0), (800.0, 0.0))
    return controlled(published_surrogate(), AdaptiveSpeed(AdaptiveSpeedGains(shaft_lag=10.683)), sea)


@case("speed_pi")
def speed_pi():
    """A boat of 85 kg with linear drag; the force is limited, and half of it is lost for a while."""
    gains = SpeedPIGains(85.0, 77.5, 5.0, 0.4, 200.0, 50.0, 0.15)
    control, speed, rows = SpeedPI(gains), 0.2, []
    for k in range(600):
        desired = (1.0, 2.5, 0.0, 1.2)[k // 150]
        known = math.nan if 200 <= k < 210 else speed
        force = control.step(desired, known, 0.1)
        achieved = 0.5 * force if 320 <= k < 360 else force
        control.limited_to(achieved)
        if k == 450:
            control.restart()
        speed += 0.1 * (achieved - 80.0 * speed - 6.0 * speed * abs(speed) - 10.0) / 85.0
        rows.append((speed, force, control.integral))
    return columns("speed force integral", rows, 5)
