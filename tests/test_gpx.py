"""GPX: both versions, extensions, damage, and vessels named by MMSI."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from steerway.core import InputError
from steerway.formats.testing import gpx
from tests.messages import HEAD, POINT, POINTS, WHOLE, document
from tests.sentences import only

T = 1672531200.0


def test_speed_and_course_of_version_1_0():
    fixes = only(gpx.read(document(POINT.format(1, "<course>90</course><speed>2.5</speed>"), POINT.format(2, ""))))
    assert list(fixes.time - T) == [1, 2]
    assert_allclose(np.degrees(fixes.latitude), [1.5, 2.5])
    assert_allclose(np.degrees(fixes.longitude), 2.25)
    assert_allclose(fixes.sog, [2.5, np.nan])
    assert_allclose(np.degrees(fixes.cog), [90.0, np.nan])


def test_version_1_1_with_extensions():
    head = '<gpx version="1.1" xmlns="http://www.topografix.com/GPX/1/1" xmlns:gpxtpx="http://www.garmin.com/x">'
    inner = (
        "<extensions><gpxtpx:E><gpxtpx:speed>1.5</gpxtpx:speed><gpxtpx:course>5</gpxtpx:course></gpxtpx:E></extensions>"
    )
    fixes = only(gpx.read(document(POINT.format(3, inner), head=head)))
    assert_allclose((fixes.sog[0], np.degrees(fixes.cog[0])), (1.5, 5.0))


def test_points_without_time_or_place_are_counted():
    recording = gpx.read(
        document('<trkpt lat="1" lon="2"/>', POINT.format(1, ""), POINT.format(2, "").replace("2.5", "95"))
    )
    assert len(only(recording)) == 1
    assert recording.counts == {"track points": 3}
    assert recording.skipped == {"no time": 1, "no position": 1}


def test_tracks_named_by_mmsi_are_vessels():
    tracks = [f"<trk><name>MMSI {m}</name><trkseg>{POINT.format(1, '')}</trkseg></trk>" for m in (235000002, 235000001)]
    fixes = only(gpx.read(f"{HEAD}{''.join(tracks)}</gpx>".encode()))
    assert list(fixes.mmsi) == [235000001, 235000002]
    assert only(gpx.read(document(POINT.format(1, ""), name="<name>Sunday</name>"))).mmsi is None


AT = WHOLE.index(POINTS[3].encode()) + 20


@pytest.mark.parametrize(
    ("damaged", "lost"),
    [
        (WHOLE[: AT + 5], {4, 5, 6, 7}),
        (WHOLE[:AT] + b"\x00<<&" + WHOLE[AT + 9 :], {4}),
        (WHOLE[:AT] + WHOLE[AT + 55 :], {4}),
        (WHOLE[:AT] + b'"' + WHOLE[AT:], {4}),
        (WHOLE[:AT] + b">\n<!-- " + WHOLE[AT:], {4}),
        (WHOLE[: AT - 8] + WHOLE[WHOLE.index(POINTS[4].encode()) :], {4}),
        (WHOLE.replace(b"</trkpt>", b"", 1), {1}),
        (b"junk " + WHOLE, set()),
        (WHOLE.replace(b"<gpx ", b"<gpx <", 1), set()),
        (WHOLE[WHOLE.index(b"<trkseg>") :], set()),
    ],
)
def test_nothing_valid_is_lost_around_damage(damaged, lost):
    recording = gpx.read(damaged)
    assert set((only(recording).time - T).astype(int)) == {1, 2, 3, 4, 5, 6, 7} - lost
    assert recording.skipped["damaged place"] >= 1


def test_entities_are_refused():
    with pytest.raises(InputError, match="XML entities"):
        gpx.read(b'<!DOCTYPE x [<!ENTITY a "b">]><gpx>&a;</gpx>')
