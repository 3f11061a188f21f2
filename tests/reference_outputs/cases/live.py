"""Live: the navigator, autopilot and outputs on generated fixes."""

import json
import math
from functools import cache

import numpy as np

from steerway.core.testing import displaced
from steerway.live.testing import (
    Deltas,
    InputRow,
    JsonLines,
    Limits,
    Navigator,
    PropellerCommands,
    Row,
    SentenceOutput,
    State,
    Supervisor,
)
from tests.desk import HOME, NOON, OTTER, square
from tests.kept_outputs import RecordingSink
from tests.reference_outputs.tables import case, columns

TICK = 0.1
CORNERS = ((0.0, 0.0), (40.0, 0.0), (40.0, 30.0), (0.0, 30.0))
FENCE = ((-60.0, -30.0), (70.0, -30.0), (70.0, 60.0), (-60.0, 60.0))


def received(rows=300):
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
                "gps",
                NOON + 0.2 * k,
                *displaced(*HOME, north + noise[0] + far, east + noise[1]),
                0.4 if k % 2 else math.nan,
                1.5 + noise[2],
                course + noise[3],
                course + 0.1 + noise[4],
            )
        )
    fixes[20], fixes[22] = fixes[22], fixes[20]
    return fixes


@case("live_navigator_aided")
def navigator_aided():
    navigator, rows = Navigator("small-usv", aid=("sog", "cog", "heading"), rate=4.0), []
    for k, each in enumerate(received()):
        rows += navigator.add(each)
        if k % 10 == 0:
            rows.append(navigator.at(each.time + 0.13))
    rows += navigator.finish()
    return columns(" ".join(Row._fields), rows, 3)


@cache
def sortie():
    """(rows of numbers, {output: messages}) of the autopilot on the square, in a loop with a boat that obeys it.

    She is engaged as soon as possible, has no fixes for 4 s, and is pushed over the fence at the end.
    """
    route = square(CORNERS, FENCE, Limits(cross_track=30.0, max_sog_mps=3.0), boat=OTTER)
    chance = np.random.default_rng(25)
    navigator, autopilot = Navigator("otter"), Supervisor(route, "otter", engage=True)
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
            for row in navigator.add(
                InputRow("gps", time, *displaced(*HOME, *(north, east) + 0.3 * chance.standard_normal(2)))
            ):
                autopilot.fix(row)
                for output in outputs:
                    output.fix(row)
        row = navigator.at(time)
        order = autopilot.step(row, TICK if k else 0.0)
        leg = autopilot.leg
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


for name, each, every in (("deltas", "deltas", 4), ("json_lines", "json", 20), ("propellers", "propellers", 10)):
    case(f"live_{name}", text=True)(
        lambda each=each, every=every: "".join(
            json.dumps(rounded(json.loads(line))) + "\n" for line in sortie()[1][each][::every]
        )
    )
