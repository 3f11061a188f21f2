"""Live: the navigator, autopilot, watch and outputs on generated fixes; decoders; the simulated boat."""

import json
import math
from functools import cache
from pathlib import Path

import numpy as np

from steerway.core import OK, displacement
from steerway.core.testing import displaced
from steerway.estimation import Profile
from steerway.guidance import Reference
from steerway.live.testing import (
    BoatTable,
    Deltas,
    GeodeticRoute,
    Guide,
    InnerLoops,
    InputRow,
    JsonLines,
    Limits,
    MissionTable,
    Navigator,
    Place,
    PropellerCommands,
    Row,
    SentenceOutput,
    SimulatedBoat,
    State,
    Supervisor,
    Watch,
    Waypoint,
    pilot_of,
)
from steerway.simulation import load_scenario
from tests.recording_sink import RecordingSink
from tests.reference_outputs.generated import columns
from tests.reference_outputs.tables import case

NOON = 1_719_835_200.0
HOME = (math.radians(54.0), math.radians(10.0))
TICK = 0.1
ROW = " ".join(Row._fields)


def place(north, east):
    return displaced(*HOME, north, east)


def corner(north, east, kind=Place, **more):
    latitude, longitude = place(north, east)
    return kind(lat_deg=math.degrees(latitude), lon_deg=math.degrees(longitude), **more)


def square(safe="stop"):
    corners = ((0.0, 0.0), (40.0, 0.0), (40.0, 30.0), (0.0, 30.0))
    fence = ((-60.0, -30.0), (70.0, -30.0), (70.0, 60.0), (-60.0, 60.0))
    boat = BoatTable(full_yaw_rate_dps=60.0, max_yaw_rate_dps=15.0, yaw_time=1.5, surge_time=1.1, reverse=True)
    settings = MissionTable(
        lookahead=8.0,
        acceptance=4.0,
        speed_mps=1.2,
        safe=safe,
        limits=Limits(cross_track=30.0, max_sog_mps=3.0),
        boat=boat,
    )
    return GeodeticRoute.of([corner(*each, Waypoint) for each in corners], [corner(*each) for each in fence], settings)


def received(rows=300, source="gps"):
    """A weaving boat's fixes at 5 Hz with SOG, COG and heading: one is late, one far off, some are missing."""
    chance, fixes = np.random.default_rng(24), []
    north, east = 0.0, 0.0
    for k in range(rows):
        course = 0.8 * math.sin(k / 40.0)
        north, east = north + 0.3 * math.cos(course), east + 0.3 * math.sin(course)
        noise = chance.standard_normal(5) * (0.3, 0.3, 0.05, 0.03, 0.01)
        far = 60.0 if k == 150 else 0.0
        if 200 <= k < 215:
            continue
        fixes.append(
            InputRow(
                source,
                NOON + 0.2 * k,
                *place(north + noise[0] + far, east + noise[1]),
                0.4 if k % 2 else math.nan,
                1.5 + noise[2],
                course + noise[3],
                course + 0.1 + noise[4],
            )
        )
    fixes[20], fixes[22] = fixes[22], fixes[20]
    return fixes


def navigated(fixes, **settings):
    navigator, rows = Navigator("small-usv", **settings), []
    for k, each in enumerate(fixes):
        rows += navigator.add(each)
        if k % 10 == 0:
            rows.append(navigator.at(each.time + 0.13))
    rows += navigator.finish()
    return columns(ROW, rows, 3)


@case("live_navigator")
def navigator():
    return navigated(received())


@case("live_navigator_aided")
def navigator_aided():
    return navigated(received(), aid=("sog", "cog", "heading"), rate=4.0)


@case("live_navigator_two_sources")
def navigator_two_sources():
    other = [each._replace(time=each.time + 0.05, position_std=math.nan) for each in received(source="spare")]
    both = sorted(received()[:120] + other, key=lambda each: each.time)
    return navigated(both, accuracy=False)


@cache
def sortie(safe="stop"):
    """(rows of numbers, {output: messages}) of the autopilot on the square, in a loop with a boat that obeys it.

    She is engaged as soon as possible, has no fixes for 4 s, and is pushed over the fence at the end.
    """
    route, chance = square(safe), np.random.default_rng(25)
    navigator, autopilot = Navigator("otter"), Supervisor(route, "otter", engage=True)
    guide = Guide(route, autopilot.pilot)
    sinks = {name: RecordingSink() for name in ("propellers", "sentences", "deltas", "json")}
    outputs = [
        PropellerCommands(sinks["propellers"]),
        SentenceOutput(sinks["sentences"]),
        Deltas(sinks["deltas"]),
        JsonLines(sinks["json"], every_tick=True),
    ]
    north, east, heading, rate, speed, rows = -15.0, 6.0, 0.2, 0.0, 1.0, []
    for k in range(1300):
        time = NOON + TICK * k
        if k % 2 == 0 and not 500 <= k < 540:
            for row in navigator.add(InputRow("gps", time, *place(*(north, east) + 0.3 * chance.standard_normal(2)))):
                autopilot.fix(row)
                for output in outputs:
                    output.fix(row)
        row = navigator.at(time)
        if autopilot.begins:
            guide.restart()
        leg = guide.step(row)
        order = autopilot.step(row, leg, TICK if k else 0.0)
        for output in outputs:
            output.tick(row, leg, order)
        guided = (math.nan,) * 3 if leg is None else (leg.cross_track, leg.course_to_steer, leg.distance)
        state = list(State).index(order.state)
        rows.append((north, east, row.sog, row.cog, *guided, state, order.engaged, *order[3:]))
        rate += TICK * (order.yaw_rate - rate) / 1.5
        speed += TICK * ((3.0 * order.thrust if order.engaged else 1.0) - speed) / 1.1
        heading += TICK * rate
        north += TICK * (speed * math.cos(heading) + 0.1)
        east += TICK * (speed * math.sin(heading) + (0.05 if k < 1000 else 2.0))
    return rows, {name: [bytes(each).decode() for each in sink.messages] for name, sink in sinks.items()}


ORDER = "yaw_rate thrust port starboard asked_course asked_speed"


@case("live_autopilot")
def autopilot():
    return columns(f"north east sog cog cross_track course_to_steer distance state engaged {ORDER}", sortie()[0], 13)


@case("live_sentences", text=True)
def sentences():
    return "".join("".join(sortie()[1]["sentences"]).replace("\r\n", "\n").splitlines(keepends=True)[:400])


def rounded(value):
    """JSON with seven decimals a number."""
    if isinstance(value, dict):
        return {key: rounded(each) for key, each in value.items()}
    if isinstance(value, list):
        return [rounded(each) for each in value]
    return round(value, 7) + 0.0 if isinstance(value, float) else value


def lines(name, every):
    return "".join(json.dumps(rounded(json.loads(each))) + "\n" for each in sortie()[1][name][::every])


@case("live_deltas", text=True)
def deltas():
    return lines("deltas", 4)


@case("live_json_lines", text=True)
def json_lines():
    return lines("json", 20)


@case("live_propellers", text=True)
def propellers():
    return lines("propellers", 10)


def row(time, north=0.0, east=0.0, sog=1.2, cog=0.0, rate=0.0, cog_std=0.05, status=OK):
    return Row(time, *place(north, east), sog, cog, rate, 0.1, cog_std, 0.05, 0.4, 1.0, status)


@case("live_steering")
def steering():
    """The law alone: a boat beside the line, slow fixes and fast, the course unknown for a while."""
    route = square()
    pilot, rows = pilot_of(route, Profile.named("otter")), []
    guide, schedule = Guide(route, pilot), pilot.autopilot.schedule
    for k in range(240):
        here = row(
            NOON + 0.1 * k, 0.1 * k, 8.0 * math.cos(k / 30.0), 1.0 + 0.5 * math.sin(k / 20.0),
            math.nan if 100 <= k < 110 else 0.6 * math.sin(k / 12.0), 0.05 * math.cos(k / 12.0),
        )  # fmt: skip
        interval = 0.2 if k < 120 else 1.0
        schedule.fix_interval = interval
        desired, speed = guide.step(here).course_to_steer, 1.2
        steered = pilot.steer(Reference(desired, 0.0, 0.0), speed, pilot.estimator.step(here, 0.1), 0.1)
        rows.append((*steered.command, desired, speed, pilot.autopilot.controller.gains.proportional))
    return columns(f"{ORDER} gain", rows, 3)


@case("live_watch", text=True)
def watch():
    """What the watch says as fixes stop, doubts grow, the time jumps and a link is lost."""
    guard, given = Watch(3.0), []
    for k in range(400):
        time = NOON + 0.1 * k
        here = row(time, cog_std=0.05 if k < 150 else 1.2 if k < 180 else 0.1)
        if k % 2 == 0 and not 60 <= k < 110:
            guard.fix(here)
        if k in (200, 201, 202):
            guard.untimely()
        if k in (250, 270):
            guard.link("rover", k == 270)
        words = guard.step(here, 0.1), guard.degradation(here), guard.obstacle(here), f"{guard.interval:.6g}"
        if k == 0 or words != given[-1][1:]:
            given.append((k, *words))
    return "".join(f"{' | '.join(map(str, each))}\n" for each in given)


@case("live_simulated_boat")
def simulated_boat():
    boat = SimulatedBoat(load_scenario(Path(__file__).parents[3] / "examples" / "station-keeping.toml"), seed=26)
    loops, rows = InnerLoops(boat.known), []
    for k in range(2000):
        command = loops.step(0.1 * math.sin(k / 300.0), 1.0, boat.motion, boat.step_length)
        if seen := boat.step(command):
            rows.append((*seen[:2], *displacement(*seen[2:4], *boat.origin), *seen[4:], boat.heading, *command))
    return columns("epoch delivered north east sog cog heading port starboard", rows, 2)
