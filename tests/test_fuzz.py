"""What fuzzing found, each as the smallest input that shows it; impossible rows; mutations of all that is fuzzed."""

import json
import math
import os
import random
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

from steerway.core import InputError
from steerway.core.testing import KNOT
from steerway.estimation import Profile
from steerway.live.testing import (
    GeodeticRoute,
    GpsdDecoder,
    InputRow,
    Settings,
    SignalKDecoder,
    State,
    believable,
)
from steerway.simulation import load_scenario
from tests.desk import HOME, NOON, Desk, square
from tests.fuzz import aboard, seeds
from tests.fuzz.mutation import mutated
from tests.fuzz.targets import TARGETS, controls

DEEP = "[" * 5000
NO_RING = '{"type": "Feature", "geometry": {"type": "Polygon", "coordinates": []}}'
FOUND = Path.home() / ".cache" / "steerway" / "fuzz"
CALLED = 200
"""Least number of public functions, classes and methods."""
SLOW = 5.0
"""s of processor time for one input; none has more than 20 kB here, the limit is that of a megabyte."""
TPV = b'{"class":"TPV","mode":3,"time":"2024-07-01T12:00:00Z","lat":%s,"lon":10}\n'


def outcome(target, data) -> str:
    """What a target says of an input, without numbers."""
    try:
        return re.sub(r"\d+", "0", target.read(data))[:200]
    except InputError as error:
        assert "\n" not in str(error)
        return re.sub(r"\d+", "0", str(error))[:100]


@pytest.mark.parametrize("load", [load_scenario, Profile.load, Settings.load, GeodeticRoute.load])
@pytest.mark.parametrize("text", [f"a = {DEEP}", "a = 2024-13-45T99:00:00Z", "a = " + "{a=" * 3000])
def test_toml_beyond_what_its_parser_takes_is_refused(load, text, tmp_path):
    path = tmp_path / "file.toml"
    path.write_text(text)
    with pytest.raises(InputError) as refused:
        load(path)
    assert "file.toml" in str(refused.value) and "\n" not in str(refused.value)


@pytest.mark.parametrize("text", [DEEP, '{"type": "LineString", "coordinates": [[1, 2], []]}', NO_RING])
def test_routes_beyond_what_a_parser_takes_are_refused(text, tmp_path):
    path = tmp_path / "route.geojson"
    path.write_text(text)
    with pytest.raises(InputError, match=r"route.geojson is malformed"):
        GeodeticRoute.load(path)


@pytest.mark.parametrize("length", ["1.7e308", "1e300", "3e6"])
def test_a_survey_that_leaves_the_chart_is_refused(length, tmp_path):
    path = tmp_path / "route.toml"
    survey = f"survey]\nlat_deg = 63.4\nlon_deg = 10.4\nlength = {length}\nspacing = 25\nlines = 2\n"
    for load, table in ((GeodeticRoute.load, "["), (load_scenario, "[route.")):
        path.write_text(table + survey)
        with pytest.raises(InputError, match=r"route.toml: a waypoint of the survey is at latitude .* at most 89°"):
            load(path)


@pytest.mark.parametrize("message", [DEEP.encode() + b"\n", TPV % (b"9" * 400), TPV % b'54, "speed": null'])
def test_messages_of_other_computers_are_counted_as_malformed(message):
    for decoder in (GpsdDecoder(), SignalKDecoder()):
        decoder.feed(message)
        if decoder.skipped:
            assert decoder.skipped == {"malformed": 1}
    decoder = GpsdDecoder()
    decoder.feed(message + TPV % b"54" + TPV.replace(b":00Z", b":01Z") % b"54")
    assert decoder.skipped == {"malformed": 1} and len(decoder.complete_on_silence()) == 1


@pytest.mark.parametrize("what, value", [("adjust", 10**400), ([], 1.0)])
def test_requests_beyond_numbers_are_refused(what, value):
    with pytest.raises(InputError, match=r"expected"):
        controls().do(what, value, "a test")


def test_no_number_of_any_link_ends_the_service_or_stays():
    """On one boat, which goes on, and gives orders and estimates that are numbers."""
    pytest.importorskip("pymavlink")
    dropped = 0
    for name, messages in seeds.beyond().items():
        for message in messages:
            TARGETS[name].read(message)
        boat = aboard.afloat()
        row, before, dropped = boat.service.latest.row, dropped, boat.navigator.counts["beyond all limits"]
        assert math.isfinite(row.latitude + row.longitude + row.sog) and dropped > before + 1, name


MOST = {"latitude": math.pi / 2.0, "longitude": math.pi, "position_std": 1e4, "sog": 1000.0 * KNOT, "shaft": 1000.0}
MOST |= {"cog": 2.0 * math.pi, "yaw_rate": 10.0, "acceleration": 20.0 * 9.80665, "throttle": 1.0}


@pytest.mark.parametrize(("name", "most"), MOST.items())
def test_a_value_beyond_its_limit_is_none(name, most):
    """And so is the place, if its latitude, longitude or deviation is beyond."""
    row = InputRow("gps", NOON, *HOME, heading=-2.0 * math.pi)._replace(**{name: most})
    assert believable(row) is row
    for value in (math.nextafter(most, math.inf), -1e38, math.inf, -math.inf):
        kept = believable(row._replace(**{name: value}))
        assert math.isnan(getattr(kept, name)) and kept.heading == row.heading
        assert kept.has_position == (name not in ("latitude", "longitude", "position_std"))
    assert believable(InputRow("gps", NOON, *HOME)._replace(latitude=math.inf)) is None
    assert all(believable(row._replace(time=time)) is None for time in (math.nan, math.inf, -1e10, 1e10))


def test_a_row_that_raises_is_dropped_and_counted():
    desk = Desk(square())
    desk.start()
    honest = desk.fixes
    wrong = InputRow("gps", NOON, *HOME, sog="fast", formatters="none")
    desk.fixes = lambda time, north, east: [wrong, *honest(time, north, east)]
    desk.sail(3.0)
    assert not desk.running.done() and desk.order.state is State.RUNNING
    assert desk.navigator.counts["failed"] == 15


def test_an_estimate_that_is_no_number_stops_and_begins_anew():
    desk = Desk(square())
    desk.start()
    desk.sail(1.0)
    desk.autopilot.pilot.estimator.filter._mixture.states[:] = math.nan
    orders = desk.sail(0.5)
    assert all(math.isfinite(each.yaw_rate + each.thrust) for each in orders)
    assert desk.order.state is State.STOPPED and desk.order.reason == "the estimate is no number"
    desk.sail(10.0)
    desk.autopilot.start()
    desk.sail(1.0)
    assert desk.order.state is State.RUNNING


def test_public_names_with_hostile_arguments():
    """No index of a kernel is unchecked: NumPy checks every one. `make bounds` does more of it."""
    command = [sys.executable, "-m", "tests.hostile_arguments", "--rounds", "5"]
    done = subprocess.run(command, env=os.environ | {"NUMBA_DISABLE_JIT": "1"}, capture_output=True, text=True)
    found = json.loads(done.stdout)
    assert found["findings"] == {}
    assert found["names"] > CALLED and done.returncode == 0


@pytest.mark.parametrize("name", TARGETS)
def test_mutations_are_read_or_refused(name, tmp_path):
    """Forty of each target, or as many as make STEERWAY_FUZZ minutes of all (`make fuzz`): what leads to an outcome
    not seen before is mutated on. A process that is ended leaves the last input in ~/.cache/steerway/fuzz.
    """
    for package, names in (("pymavlink", ("MAVLink",)), ("nicegui", ("helm request", "helm lines"))):
        if name in names:
            pytest.importorskip(package)
    processes = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
    seconds = 60.0 * float(os.environ.get("STEERWAY_FUZZ", "0")) * processes / len(TARGETS)
    target, rng = TARGETS[name], random.Random(time.time() if seconds else 0)
    corpus, until, tried = target.seeds(), time.monotonic() + seconds, 0
    outcomes = {outcome(target, data) for data in corpus if seconds}
    present = (FOUND if seconds else tmp_path) / re.sub(r"\W+", "-", name)
    present.parent.mkdir(parents=True, exist_ok=True)
    while tried < 40 or time.monotonic() < until:
        data = mutated(rng.choice(corpus), corpus, rng)
        present.write_bytes(data)
        began = time.process_time()
        found = outcome(target, data)
        assert time.process_time() - began < SLOW, f"{present} took too long"
        if found not in outcomes and len(corpus) < 400:
            outcomes.add(found)
            corpus.append(data)
        tried += 1
    present.unlink()
    if seconds:
        print(f"{name}: {tried} inputs, {len(outcomes)} outcomes")
