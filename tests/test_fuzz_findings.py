"""What fuzzing found, each as the smallest input that shows it; and a few mutations of everything that is fuzzed."""

import random
from types import SimpleNamespace

import pytest

from steerway.core import InputError
from steerway.estimation import Profile
from steerway.live.testing import GeodeticRoute, GpsdDecoder, Settings, SignalKDecoder
from steerway.simulation import load_scenario
from tests.fuzz.mutation import mutated
from tests.fuzz.targets import TARGETS, controls, read_from_page

DEEP = "[" * 5000
NO_RING = '{"type": "Feature", "geometry": {"type": "Polygon", "coordinates": []}}'
TPV = b'{"class":"TPV","mode":3,"time":"2024-07-01T12:00:00Z","lat":%s,"lon":10}\n'


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
    path.write_text(f"[survey]\nlat_deg = 63.4\nlon_deg = 10.4\nlength = {length}\nspacing = 25\nlines = 2\n")
    with pytest.raises(InputError, match=r"route.toml: a waypoint of the survey: l(at|on)_deg is"):
        GeodeticRoute.load(path)


@pytest.mark.parametrize("message", [DEEP.encode() + b"\n", TPV % (b"9" * 400)])
def test_messages_of_other_computers_are_counted_as_malformed(message):
    for decoder in (GpsdDecoder(), SignalKDecoder()):
        decoder.feed(message)
        if decoder.skipped:
            assert decoder.skipped == {"malformed": 1}
    decoder = GpsdDecoder()
    decoder.feed(message + TPV % b"54" + TPV.replace(b":00Z", b":01Z") % b"54")
    assert decoder.skipped == {"malformed": 1} and len(decoder.settle()) == 1


@pytest.mark.parametrize("what, value", [("adjust", 10**400), ([], 1.0)])
def test_requests_beyond_numbers_are_refused(what, value):
    with pytest.raises(InputError, match=r"expected"):
        controls().do(what, value, "a test")


def test_what_a_library_prints_in_the_page_does_not_end_it():
    pytest.importorskip("nicegui")
    lines, asked = (b"a warning", b"[1]", b"3", DEEP.encode(), b'{"do": "stop"}'), []
    read_from_page(b"\n".join(lines), SimpleNamespace(do=lambda what, *_: asked.append(what)))
    assert asked == ["stop"]


@pytest.mark.parametrize("name", TARGETS)
def test_a_few_mutations_of_every_target(name):
    for package, names in (("pymavlink", ("MAVLink",)), ("nicegui", ("helm request", "helm lines"))):
        if name in names:
            pytest.importorskip(package)
    target, rng = TARGETS[name], random.Random(0)
    seeds = target.seeds()
    for _ in range(40):
        target.read(mutated(rng.choice(seeds), seeds, rng))
