"""What the helm page shows: values in the skipper's units, words, and drawings."""

import json
import math
import xml.etree.ElementTree as ElementTree
from types import SimpleNamespace

import numpy as np
import pytest

from steerway.core import OK, REJECTED
from steerway.core.testing import KNOT, LOST, PREDICTED, Leg
from steerway.live import testing as live

NOON = 1_719_835_200.0
PLACE = (math.radians(54.0), math.radians(10.0))
ROW = live.Row(NOON, *PLACE, 2.0, -math.pi / 2.0, math.radians(-1.0), 0.1, 0.02, 0.01, 0.3, 0.3, math.nan, PREDICTED)
FIX = ROW._replace(time=NOON - 0.2, nis=1.2, status=OK)
LEG = Leg(-3.0, 0.0, 0.1, 40.0, 0.2, 1.5, *PLACE, "WP0", "WP1")
ORDER = live.Order(live.State.RUNNING, "", True, 0.1, 0.5, 0.6, 0.4, 0.2, 2.0)
ROUTE = live.GeodeticRoute(np.radians([54.0, 54.001, 54.001]), np.radians([10.0, 10.0, 10.002]))


def known(row=ROW, leg=LEG, fix=FIX):
    """A service in this state."""
    navigator = SimpleNamespace(last_fix=fix, position_covariance=(4.0, 0.0, 1.0), counts={"taken": 7, "late": 1})
    navigator.choice = SimpleNamespace(present="GP")
    latest, controls = SimpleNamespace(row=row, leg=leg, order=ORDER), live.Controls()
    return SimpleNamespace(navigator=navigator, latest=latest, controls=controls, unreachable=lambda: "")


def test_a_view_is_in_the_skippers_units():
    shown = live.view(known(), live.ChartPlane.of(ROUTE))
    assert shown.sog_kn == pytest.approx(2.0 / KNOT) and shown.sog_within_kn == pytest.approx(0.196 / KNOT, rel=1e-3)
    assert shown.cog_deg == pytest.approx(270.0) and shown.cog_within_deg == pytest.approx(2.246, rel=1e-3)
    assert shown.rate_dps == pytest.approx(-1.0) and shown.age == pytest.approx(0.2) and shown.nis == 1.2
    assert (shown.north, shown.east) == pytest.approx((0.0, 0.0))
    assert shown.cross_track == -3.0 and shown.target == 1 and shown.steer_deg == pytest.approx(math.degrees(0.2))
    assert shown.left == pytest.approx(40.0 + math.dist(*live.ChartPlane.of(ROUTE).route[1:]), rel=1e-9)
    assert (shown.state, shown.is_engaged, shown.thrust) == ("running", True, 0.5)
    shown = live.view(known(leg=None), live.ChartPlane.of(ROUTE))
    assert (shown.done, shown.left, shown.target) == (1.0, 0.0, None), "a finished route"


def test_what_is_unknown_is_a_dash_and_a_status_that_of_the_last_fix_until_it_is_old():
    shown = live.view(live.Service(live.Navigator(), []), live.ChartPlane())
    assert {name: value for name, value in shown._asdict().items() if value} == {"status": "lost"}
    output = live.words(shown)
    assert {output[name] for name in ("sog", "cog", "rate", "age", "nis", "cross_track", "distance")} == {live.UNKNOWN}
    assert live.tone(shown) == "bad" and "nan" not in json.dumps([shown._asdict(), output]).lower()
    for status, gap, expected in ((OK, 0.2, "ok"), (REJECTED, 0.2, "rejected"), (OK, 5.0, "predicted")):
        shown = live.view(known(fix=FIX._replace(time=NOON - gap, status=status)), live.ChartPlane())
        assert shown.status == expected
    assert live.view(known(row=live.lost(NOON)), live.ChartPlane()).status == "lost" and LOST == live.lost(NOON).status


def test_words_name_the_side_and_the_ellipse_lies_as_the_covariance_does():
    output = live.words(live.view(known(), live.ChartPlane.of(ROUTE)))
    assert (output["cog"], output["rate"], output["cross_track"]) == ("270°", "1.0", "3.0 m")
    assert output["rate_within"].startswith("port ±") and output["cross_track_side"] == "to port of track"
    assert live.words(live.View(sog_kn=3.456, sog_within_kn=0.3))["sog"] == "3.5"
    assert live.words(live.View(sog_kn=3.456, sog_within_kn=0.05))["sog"] == "3.46"
    assert (
        live.words(live.View(rate_dps=2.0))["rate_within"] == "stbd"
        and live.words(live.View(cog_deg=359.7))["cog"] == "000°"
    )
    assert live.words(live.View(cross_track=2.0))["cross_track_side"] == "to starboard of track"
    assert live.words(live.View(lat_deg=-54.25, lon_deg=9.999))["position"] == "54° 15.000′ S  009° 59.940′ E"
    assert live.words(live.View(is_engaged=False, thrust=0.0))["thrust"] == live.UNKNOWN
    angle = math.radians(135.0)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    (north, both), (_, east) = turn @ np.diag([4.0, 1.0]) @ turn.T
    assert live.ellipse((north, both, east)) == pytest.approx((2.0 * 2.447747, 2.447747, 135.0), rel=1e-6)


def test_why_no_order_reaches_the_boat():
    deaf, heard = SimpleNamespace(has_peer=False), SimpleNamespace(has_peer=True)
    for outputs, why in (
        ((), "no output carries orders"),
        ((live.PropellerCommands(deaf), live.SentenceOutput(heard)), "no motor driver is connected"),
        ((live.PropellerCommands(deaf), live.PropellerCommands(heard)), ""),
        ((live.SentenceOutput(deaf),), "no receiver of the sentences is connected"),
        ((live.SentenceOutput(heard),), ""),
    ):
        assert live.Service(live.Navigator(), outputs, supervisor=live.Supervisor(ROUTE)).unreachable() == why
    assert live.Service(live.Navigator(), ()).unreachable() == ""


def drawn(text, kind):
    return [each for each in ElementTree.fromstring(text) if each.attrib.get("class") == kind]


def test_the_chart_is_true_and_its_scale_bar_as_long_as_it_says():
    """North is up, east is right; the offset ends on the leg: of a leg to the north, east is to starboard."""
    window = live.chart.Window(0.0, 0.0, 1.0, 400.0, 300.0)
    assert window.at(0.0, 0.0) == (200.0, 150.0) and window.at(10.0, 20.0) == (220.0, 140.0)
    (vector,) = drawn(live.chart.moving(window, live.View(north=10.0, east=20.0, cog_deg=90.0, sog_kn=4.0)), "vector")
    start, end = ([float(x) for x in each.split()] for each in vector.attrib["d"][1:].split("L"))
    assert start == [220.0, 140.0] and end[1] == 140.0 and end[0] == pytest.approx(220.0 + 4.0 * KNOT * 30.0, abs=0.1)
    for end, boat, points in (
        ((100.0, 0.0), (10.0, 7.0), "207.0,140.0 200.0,140.0"),
        ((0.0, 100.0), (-7.0, 10.0), "210.0,157.0 210.0,150.0"),
    ):
        shown = live.View(north=boat[0], east=boat[1], cross_track=7.0, target=1)
        moving = live.chart.moving(window, shown, [(0.0, 0.0), end])
        assert [each.attrib["points"] for each in drawn(moving, "offset")] == [points]
    still = live.chart.still(live.chart.Window(0.0, 0.0, 0.4, 400.0, 300.0), [], [], None)
    assert "50 m" in still and "h125.0" in drawn(still, "scale")[0].attrib["d"]
    places = [(0.0, 0.0), (300.0, 0.0), (300.0, 900.0)]
    assert all(live.chart.around(places, 390.0, 340.0).holds(*place, 0.05) for place in places)


def test_what_was_sailed_breaks_where_she_was_lost_and_stays_short():
    """The track on the chart, and the course over time, which does not jump at north."""
    history = live.History()
    for k in range(20000):
        history.add(live.View(time=NOON + 0.2 * k, north=2.0 * k, east=0.0, status="ok"))
    assert len(history.track) <= 4001 and history.track[-1] == (2.0 * 19999, 0.0) and len(history.moments) <= 302
    history.add(live.View(status="lost"))
    history.add(live.View(status="lost"))
    assert history.track[-1] is None and history.track[-2] is not None
    window = live.chart.Window(0.0, 0.0, 1.0, 400.0, 300.0)
    track = [(0.0, 0.0), (1.0, 50.0), None, (2.0, 60.0), (3.0, 70.0)]
    assert len(drawn(live.chart.still(window, [], track, None), "track")) == 2
    points = [live.chart.Point(float(k), value, 1.0) for k, value in enumerate((350.0, 355.0, 2.0, None, 10.0, 355.0))]
    assert [each.value for each in live.chart.unwound(points)] == [350.0, 355.0, 362.0, None, 370.0, 355.0]
    strip = live.chart.strip(live.chart.unwound(points), 300.0, 96.0, 60.0, 20.0, turns=True)
    assert len(drawn(strip, "curve")) == 2 and ">000°<" in strip
