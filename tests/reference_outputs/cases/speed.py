"""Speed along the hull (P3): surge filter, fusion, adaptive speed control, the speed PI."""

import math
from functools import partial

import numpy as np

from steerway.control import AdaptiveSpeed, AdaptiveSpeedGains, SpeedPI, SpeedPIGains
from steerway.estimation.speed import SurgeFilter, SurgeFusion, SurgeTuning
from steerway.estimation.testing import SPEED_AIDS as AIDS
from steerway.vessels import CALM, Actuator, Surge, conditions, published_surrogate
from tests.reference_outputs.tables import case, columns

STEP = 0.02


def received(seconds, log="bottom_speed", fault=None, outage=(math.inf, math.inf)):
    """(acceleration, {aid: reading}) at 50 Hz of a boat whose speed swings; GPS and log at 10 Hz, propeller at 5 Hz.

    `fault` gives what is added to (acceleration, sog, log) at a time.
    """
    chance = np.random.default_rng(4)
    for k in range(round(seconds / STEP)):
        time = STEP * (k + 1)
        noise = chance.standard_normal(4) * (0.004, 0.03, 0.002, 0.05)
        off = fault(time) if fault else (0.0, 0.0, 0.0)
        speed = 3.0 + math.sin(0.2 * time)
        aids = {}
        if not outage[0] < time < outage[1]:
            if k % 5 == 0:
                aids["sog"] = speed + noise[1] + off[1]
            if k % 5 == 2:
                aids[log] = speed - (0.4 if log == "water_speed" else 0.0) + noise[2] + off[2]
        yield 0.2 * math.cos(0.2 * time) + 0.02 + noise[0] + off[0], aids, speed + 0.1 + noise[3]


@case("speed_surge_filter")
def surge_filter():
    """Every kind of aid in turn, a minute of silence, and a state opened."""
    filter, rows, nis = SurgeFilter(SurgeTuning(unmeasured=0.2)), [], (math.nan,) * 4
    for k, (acceleration, aids, propeller) in enumerate(received(60.0, "water_speed", outage=(30.0, 40.0))):
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


def fused(**how):
    fusion, rows = SurgeFusion(), []
    for acceleration, aids, propeller in received(60.0, **how):
        fusion.step(acceleration, STEP, reference=propeller, **aids)
        out = -1.0 if fusion.excluded is None else AIDS.index(fusion.excluded)
        rows.append((fusion.speed, fusion.speed_std, fusion.current, out, len(fusion.events)))
    return columns("speed speed_std current excluded events", rows, 20)


case("speed_fusion_sound")(fused)
case("speed_fusion_water_track_outage")(partial(fused, log="water_speed", outage=(30.0, 36.0)))
for name, fault in {
    "log": lambda time: (0.0, 0.0, 0.1 if time > 30.0 else 0.0),
    "gps": lambda time: (0.0, 0.3 if 30.0 < time < 45.0 else 0.0, 0.0),
    "accelerometer": lambda time: (0.1 if time > 30.0 else 0.0, 0.0, 0.0),
}.items():
    case(f"speed_fusion_{name}_step")(partial(fused, fault=fault))


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
