"""Impossible numbers from every link: the service goes on, and the autopilot steers or stops."""

import json
import math

import pytest

from steerway.core.testing import KNOT, iso
from steerway.formats.testing import MESSAGES as N2K
from steerway.formats.testing import Decoder
from steerway.live.testing import GpsdDecoder, InputRow, MavlinkDecoder, SignalKDecoder, State, believable, dialect
from tests.desk import HOME, NOON, Desk, square

ABSURD = (1e300, -1e300, 1e38, -1e38, math.inf, -math.inf, math.nan, 10**400)


def gpsd(name, value, time):
    report = {"class": "TPV", "mode": 3, "time": iso(time), "lat": 54.0, "lon": 10.0, "speed": 1.0, "track": 20.0}
    decoder = GpsdDecoder()
    return decoder.message(json.dumps(report | {name: value})) + decoder.complete_on_silence()


def signalk(path, value, time):
    place = {"latitude": value, "longitude": value} if path == "navigation.position" else value
    update = {"$source": "gps.GP", "timestamp": iso(time), "values": [{"path": path, "value": place}]}
    decoder = SignalKDecoder()
    return decoder.message(json.dumps({"updates": [update]})) + decoder.complete_on_silence()


def mavlink(name, value, time):
    m = dialect("a test")
    milliseconds = 1_000_000
    numbers = {"roll": 0.0, "pitch": 0.0, "yaw": 0.0, "rollspeed": 0.0, "pitchspeed": 0.0, "yawspeed": 0.0}
    if name in numbers:
        value = float(max(-3.4e38, min(3.4e38, value))) if math.isfinite(value) else float(value)
        message = m.MAVLink_attitude_message(milliseconds, **(numbers | {name: value}))
    else:
        message = m.MAVLink_gps_raw_int_message(
            (1 << 64) - 1, 3, -(1 << 31), (1 << 31) - 1, 0, 0, 0, 0xFFFE, 0xFFFE, 9, h_acc=(1 << 32) - 1
        )
    decoder = MavlinkDecoder()
    clock = m.MAVLink_system_time_message(round(time * 1e6), milliseconds)
    return [row for each in (clock, message) for row in decoder.message(each, 5.0)]


def n2k(number, fill, time):
    values = Decoder().values(number, 1, N2K[number].raw(bytes([fill]) * 43), time)
    return [InputRow("n2k 1", values.pop("time", time), **values)] if values else []


MESSAGES = [
    *((gpsd, name, value) for name in ("lat", "lon", "speed", "track", "eph") for value in ABSURD),
    *(
        (signalk, f"navigation.{name}", value)
        for name in ("position", "speedOverGround", "courseOverGroundTrue", "headingTrue", "rateOfTurn")
        for value in ABSURD
    ),
    *((signalk, "navigation.gnss.horizontalDilution", value) for value in ABSURD),
    *((mavlink, name, value) for name in ("yawspeed", "yaw") for value in ABSURD[:-1]),
    (mavlink, "GPS_RAW_INT", math.nan),
    *((n2k, number, fill) for number in N2K for fill in (0x00, 0x7F, 0x80, 0xFE, 0xFF)),
]


def test_no_number_of_any_link_ends_the_service_or_stays():
    """All messages one after another, as from the receiver in use, while the autopilot steers."""
    desk = Desk(square())
    desk.start()
    desk.sail(2.0)
    honest, absurd = desk.fixes, []
    messages = iter(MESSAGES)

    def fixes(time, north, east):
        sound, given = honest(time, north, east), next(messages, None)
        rows = [] if given is None else given[0](*given[1:], NOON + time)
        placeless = {"latitude": math.nan, "longitude": math.nan}
        rows = [row._replace(source="gps", **(placeless if 0.9 < row.latitude < 1.0 else {})) for row in rows]
        absurd.extend(row for row in rows if any(abs(each) > 1e30 for each in row[1:]))
        return sound + rows

    desk.fixes = fixes
    desk.sail(len(MESSAGES) / 5.0 + 2.0)
    assert not desk.running.done()
    assert desk.navigator.counts["beyond all limits"] >= len(absurd) > 30
    assert desk.navigator.counts["failed"] == 0
    for row, order in zip(desk.rows[500:], desk.output[500:], strict=True):
        assert math.isfinite(order.yaw_rate + order.thrust + row.latitude + row.longitude + row.sog)
    assert desk.order.state in (State.RUNNING, State.DEGRADED), desk.order


LIMITS = {"latitude": math.pi / 2.0, "longitude": math.pi, "position_std": 1e4, "sog": 1000.0 * KNOT, "shaft": 1000.0}
LIMITS |= {"cog": 2.0 * math.pi, "yaw_rate": 10.0, "acceleration": 20.0 * 9.80665, "throttle": 1.0}


@pytest.mark.parametrize(("name", "most"), LIMITS.items())
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
