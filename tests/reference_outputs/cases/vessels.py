"""Vessels: derivatives and steps of every one, environment, actuators; sensors with a seed."""

import math

import numpy as np

from steerway.core.testing import drift_angle, in_body, over_ground, turning_rate
from steerway.sensors import (
    TCM2,
    TRUE_TCM2,
    Compass,
    DopplerLog,
    DynamicCompass,
    Gnss,
    Instrument,
    Suite,
    accelerometer,
    gyro,
    low_cost,
    random_compass,
    stability_limit,
    white,
)
from steerway.sensors.testing import Fault, navstar
from steerway.vessels import (
    CALM,
    Actuator,
    Caldas,
    Current,
    CyberShip2,
    Environment,
    Mariner,
    Nomoto,
    Otter,
    Propeller,
    Springer,
    Surge,
    conditions,
    published_surrogate,
)
from steerway.vessels.testing import (
    PAPER_YAW,
    PHYSICAL_YAW,
    WaveMotion,
    Waves,
    Wind,
    cybership2,
    follow,
    mariner,
    mass_matrix,
    nomoto,
    otter,
)
from tests.reference_outputs.generated import columns
from tests.reference_outputs.tables import case

SEA = conditions((0.2, -0.15), (20.0, -10.0), 2.0)


def derived(states, scales, commands, function):
    """Derivatives at twenty states drawn with 1σ of `scales`."""
    chance, rows = np.random.default_rng(11), []
    for _ in range(20):
        state = np.array(scales) * chance.standard_normal(states)
        rows.append(function(state, np.array(commands) * chance.standard_normal(len(commands))))
    return {"derivative": np.array(rows)}


def sailed(vessel, command, sea=SEA, step=0.1, steps=300, speed=0.5, every=6):
    """State and motion under `command(time)`."""
    state, rows = vessel.start(1.0, -2.0, 0.4, speed), []
    for k in range(steps):
        state = vessel.step(state, command(step * k), sea, step)
        motion = vessel.motion(state, sea)
        rows.append(np.concatenate([state, motion, [motion.sog, motion.cog, motion.crab_angle, motion.sideslip]]))
    return {"row": np.array(rows)[every - 1 :: every]}


def swung(size, middle=0.0, period=7.0):
    return lambda time: (middle + size * math.sin(time / period),)


def twin(time):
    return 40.0 + 30.0 * math.sin(time / 5.0), 50.0 - 70.0 * math.sin(time / 8.0)


OTTER_SCALES = (1.0, 0.3, 0.1, 0.1, 0.1, 0.2, 5.0, 5.0, 0.1, 0.1, 0.1, 1.0)


@case("vessel_otter_derivatives")
def otter_derivatives():
    found = {}
    for edition in ("today", "2021"):

        def rates(state, speeds, edition=edition):
            return otter.derivatives(state, speeds, 25.0, (0.05, 0.0, -0.35), 0.4, 0.9, edition)

        found[edition] = derived(12, OTTER_SCALES, (80.0, 80.0), rates)["derivative"]
    return found


@case("vessel_otter")
def otter_sails():
    return sailed(Otter(25.0, (0.05, 0.0, -0.35)), twin)


@case("vessel_otter_2021_euler")
def otter_2021():
    return sailed(Otter(10.0, (0.1, 0.0, -0.35), "2021", 1.0, "euler"), twin, step=0.02, steps=600, every=12)


@case("vessel_otter_hull")
def otter_hull():
    masses = [mass_matrix(mass, (0.05, 0.0, -0.35), edition) for mass in (0.0, 45.0) for edition in ("today", "2021")]
    return {"mass": np.array(masses).reshape(4, -1)}


@case("vessel_mariner_derivatives")
def mariner_derivatives():
    scales = (0.5, 0.3, 0.01, 100.0, 100.0, 1.0, 0.2)[:7]
    return derived(7, scales, (0.4,), lambda state, rudder: mariner.derivatives(state, rudder[0]))


@case("vessel_mariner")
def mariner_sails():
    return sailed(Mariner(), swung(0.5, 0.1, 60.0), step=1.0, speed=7.7175)


@case("vessel_nomoto_derivatives")
def nomoto_derivatives():
    size = len(Nomoto(0.2, 20.0, 2.0).start())
    return derived(
        size, (1.0,) * size, (0.4,), lambda x, rudder: nomoto.derivatives(x, rudder[0], 0.2, 20.0, 2.0, 0.01)
    )


@case("vessel_nomoto")
def nomoto_sails():
    rudder = Actuator("rudder", -0.5, 0.5, 0.1, 0.8)
    return sailed(Nomoto(0.2, 20.0, 2.0, 0.01, rudder), swung(0.8, 0.1), speed=2.0)


@case("vessel_cybership2_derivatives")
def cybership2_derivatives():
    return {
        form: derived(
            6,
            (1.0, 1.0, 1.0, 0.4, 0.2, 0.2),
            (2.0, 1.5, 1.5),
            lambda state, force, form=form: cybership2.derivatives(state, force, form, SEA / 30.0),
        )["derivative"]
        for form in cybership2.IDENTIFICATIONS
    }


@case("vessel_cybership2")
def cybership2_sails():
    found = {}
    for form in cybership2.IDENTIFICATIONS:
        swing = lambda time: (1.5 + math.sin(time), 2.0 * math.sin(time / 3.0), math.cos(time / 5.0))  # noqa: E731
        found[form] = sailed(CyberShip2(form), swing, SEA / 30.0, every=10)["row"]
    return found


@case("vessel_springer")
def springer_sails():
    found = {}
    for plant in ("paper", "physical"):
        boat = Springer(plant, 0.9, 0.3)
        found[plant] = sailed(boat, swung(25.0), step=1.0, steps=120, speed=None, every=4)["row"]
        found[f"{plant}_halves"] = sailed(boat, swung(25.0), step=0.5, steps=120, speed=None, every=4)["row"]
    return found


@case("vessel_springer_models")
def springer_models():
    return {
        "paper": np.concatenate([np.ravel(each) for each in PAPER_YAW.matrices()])[None],
        "physical": np.concatenate([np.ravel(each) for each in PHYSICAL_YAW.scaled(1.1).matrices()])[None],
    }


@case("vessel_surge")
def surge_sails():
    found = {}
    for name, boat in (("caldas", Surge()), ("surrogate", published_surrogate())):
        found[name] = sailed(boat, swung(9.0, 8.0, 20.0), conditions((0.5, 0.0), (900.0, 0.0)), speed=1.0)["row"]
    return found | {"acceleration": [Surge().acceleration(0.2 * k, 0.4 * k - 3.0) for k in range(50)]}


@case("vessel_caldas")
def caldas_sails():
    boat = Caldas(moment_limit=8000.0)
    found = sailed(boat, lambda time: (10.0 + 5.0 * math.sin(time / 9.0), 9000.0 * math.sin(time / 4.0)), SEA * 20.0)
    rates = boat.rates(boat.start(1.0, 2.0, 0.3, 2.0), 500.0, SEA)
    return found | {"rates": np.tile(rates, (len(found["row"]), 1))}


@case("vessel_propeller")
def propeller():
    curves = Propeller(), Propeller(0.5, 1, 0.7, 0.1, 1000.0)
    return {"curve": np.array([np.r_[each.gain, np.ravel(each.curve())] for each in curves])}


@case("vessel_kinematics")
def kinematics():
    chance, rows = np.random.default_rng(12), []
    for _ in range(30):
        a, b, c, d = chance.standard_normal(4)
        rows.append((over_ground(a, b, c), in_body(a, b, c), drift_angle(a, b), turning_rate(a, b, c, d)))
    return columns("north east surge sway drift turning", rows)


@case("vessel_actuators")
def actuators():
    rows, free, limited, lagging = [], 0.0, 0.0, 0.0
    for k in range(60):
        command = 2.0 * math.sin(0.2 * k)
        free = follow(free, command, -math.inf, math.inf, math.inf, 0.0, 0.1)
        limited = follow(limited, command, -1.0, 1.5, 2.0, 0.0, 0.1)
        lagging = follow(lagging, command, -1.0, 1.5, 2.0, 0.5, 0.1)
        rows.append((free, limited, lagging))
    return columns("free limited lagging", rows)


ROUGH = Environment(
    Current(0.4, 0.7, 0.1, 60.0),
    Wind(8.0, -2.0, 0.4, 1.5, 10.0, 0.3),
    Waves(1.0, 1.2, 0.1, 0.2, 0.05, 0.03, 10.0, 3.0, 60.0),
    (1.0, -2.0),
    0.5,
)


@case("environment")
def environment():
    boat, sea, rows = Otter(), ROUGH.start(5, 0.1), []
    state = boat.start(speed=1.0)
    for _ in range(600):
        sea.advance(boat.motion(state, sea.conditions))
        state = boat.step(state, (60.0, 55.0), sea.conditions, 0.1)
        rows.append((sea.conditions, sea.waves))
    names = "current_north current_east force_north force_east moment wave_north wave_east roll pitch"
    return columns(names, rows, 8)


@case("environment_calm")
def calm():
    sea, rows = Environment().start(1, 0.1), []
    for _ in range(3):
        sea.advance()
        rows.append((sea.conditions, sea.waves, CALM))
    return {"numbers": np.array([np.hstack(row) for row in rows])}


TIME = np.arange(0.0, 60.0, 0.02)
COURSE = 0.4 + 0.5 * np.sin(TIME / 9.0)
NORTH, EAST = np.cumsum(0.03 * np.cos(COURSE)), np.cumsum(0.03 * np.sin(COURSE))


def received(gnss, seed=3, every=4):
    """A record and the stream of it: two seeds, because each draws by itself."""
    fixes = gnss.fixes(
        TIME, NORTH, EAST, seed, roll=0.1 * np.sin(TIME), heading=COURSE, north_velocity=1.5 * np.cos(COURSE),
        east_velocity=1.5 * np.sin(COURSE), origin=(1.1, 0.2),
    )  # fmt: skip
    stream, rows = gnss.start(seed + 1), []
    for k in range(len(TIME)):
        velocity = 1.5 * math.cos(COURSE[k]), 1.5 * math.sin(COURSE[k])
        if fix := stream.step(TIME[k], NORTH[k], EAST[k], 0.1, -0.05, COURSE[k], *velocity):
            rows.append(fix)
    found = {"time": fixes.time, "latitude": fixes.latitude, "longitude": fixes.longitude}
    found |= {name: getattr(fixes, name) for name in ("sog", "cog") if getattr(fixes, name) is not None}
    streamed = columns("s_time s_north s_east s_sog s_cog", rows)
    rows = min(len(fixes.time), len(streamed["s_time"]))
    return {name: values[:rows][::every] for name, values in (found | streamed).items()}


@case("sensor_gnss_white")
def gnss_white():
    return received(white(0.5))


@case("sensor_gnss_low_cost")
def gnss_low_cost():
    return received(low_cost())


@case("sensor_gnss_navstar")
def gnss_navstar():
    return received(navstar(), every=8)


@case("sensor_gnss_faults")
def gnss_faults():
    faults = (
        Fault("dropout", start=10.0, duration=3.0),
        Fault("jump", start=20.0, size=30.0, direction=0.5),
        Fault("burst", per_hour=120.0, duration=2.0, size=5.0),
        Fault("step", start=40.0, duration=4.0, size=8.0),
        Fault("frozen", per_hour=90.0, duration=1.5),
    )
    more = {"latency": 0.3, "lever_arm": (0.5, -0.2, -1.0), "velocity_std": 0.05, "settled": False}
    return received(Gnss(rate=5.0, white=0.1, markov=((1.0, 20.0),), faults=faults, **more))


def read(instrument, values, seed=6, every=1):
    """A record and a stream, thinned."""
    time, readings = instrument.measured(TIME, values, seed)
    stream = instrument.start(seed + 1)
    steps = [stream.step(at, value) for at, value in zip(TIME, values, strict=True)]
    streamed = np.array([each for each in steps if each is not None])
    n = min(len(time), len(streamed))
    every = max(1, n // 100)
    return {"time": time[:n:every], "record": readings[:n:every], "stream": streamed[:n:every]}


@case("sensor_instruments")
def instruments():
    found = {}
    for name, sensor in (
        ("gyro", gyro()),
        ("accelerometer", accelerometer()),
        ("biased", Instrument(10.0, 0.1, 0.3, 0.2, (0.05, 5.0), 1.02)),
        ("compass", Compass()),
        ("deviating", Compass(Instrument(rate=10.0, white=0.02), (0.01, 0.02, -0.03, 0.01, 0.02))),
    ):
        found |= {f"{name}_{what}": values[:100] for what, values in read(sensor, COURSE).items()}
    return found


@case("sensor_doppler")
def doppler():
    log = DopplerLog(Instrument(rate=5.0, white=0.05, bias=0.02))
    time, surge, sway = log.measured(TIME, 1.5 + 0.1 * np.sin(TIME), 0.1 * np.cos(TIME), 7)
    stream = log.start(8)
    streamed = [each for each in (stream.step(at, 1.5, 0.1) for at in TIME) if each is not None]
    return {"time": time[::3], "surge": surge[::3], "sway": sway[::3], "stream": np.array(streamed)[::3]}


@case("sensor_suite")
def suite():
    sensors = Suite(low_cost(), Compass(), gyro(), DopplerLog())
    boat, sea, stream, rows = Otter(), ROUGH.start(9, 0.02), sensors.start(10), []
    state = boat.start(speed=1.0)
    for k in range(1001):
        motion = boat.motion(state, CALM)
        sea.advance(motion)
        rows.append(stream.step(0.02 * k, motion, WaveMotion(*sea.waves)))
        state = boat.step(state, (70.0, 60.0), CALM, 0.02)
    return columns(" ".join(rows[0]._fields), rows, 10)


@case("sensor_tcm2")
def tcm2():
    card = tuple(np.radians([1.0, 3.0, -2.0, 1.0, 0.5]))
    streams = [DynamicCompass(model, card).start(0.3, 14) for model in (TCM2, TRUE_TCM2)]
    readings = [np.concatenate([stream.second(0.3 + 0.05 * k)[::8] for k in range(20)]) for stream in streams]
    wrapped = DynamicCompass(wrapped=True).start(3.0, 15)
    turned = np.concatenate([wrapped.second(3.0 + 0.05 * k)[::8] for k in range(20)])
    return {"compass": np.stack(readings, axis=1), "wrapped": turned}


@case("sensor_tcm2_models")
def tcm2_models():
    chance = np.random.default_rng(13)
    models = [TCM2, TRUE_TCM2, random_compass(chance), random_compass(chance, 0.005)]
    limits = {"limit": np.full(4, stability_limit()), "limit_shift": np.full(4, stability_limit(True))}
    return {"model": np.array([np.r_[model, model.gain, model.lag] for model in models])} | limits
