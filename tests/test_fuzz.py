"""What fuzzing found, each as the smallest input that shows it; and mutations of everything that is fuzzed."""

import os
import random
import re
import time
from pathlib import Path

import pytest

from steerway.core import InputError
from steerway.estimation import Profile
from steerway.live.testing import GeodeticRoute, GpsdDecoder, Settings, SignalKDecoder
from steerway.simulation import load_scenario
from tests.fuzz.mutation import mutated
from tests.fuzz.targets import TARGETS, controls

DEEP = "[" * 5000
NO_RING = '{"type": "Feature", "geometry": {"type": "Polygon", "coordinates": []}}'
FOUND = Path.home() / ".cache" / "steerway" / "fuzz"
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
