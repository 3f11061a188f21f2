"""The texts of a view: every quantity as the page prints it. A dash means unknown."""

import datetime
import math

from steerway.live.helm.view import View

UNKNOWN = "–"
_GOOD_M, _GOOD_DEG = 10.0, 20.0
"""Largest 95 % bounds of position (m) and course (degrees) with which the estimate is called good."""
_STATUS = {
    "ok": "good",
    "predicted": "predicted",
    "rejected": "fix rejected",
    "no_course": "no steerageway",
    "starting": "starting",
    "lost": "no position",
}


def words(view: View) -> dict[str, str]:
    """The texts, by name of their place on the page."""
    digits = 2 if (view.sog_within_kn or 1.0) < 0.1 else 1  # no digit below the uncertainty
    return {
        "sog": _number(view.sog_kn, digits),
        "sog_within": _within(view.sog_within_kn, 2),
        "cog": _course(view.cog_deg),
        "cog_within": _within(view.cog_within_deg, 1, "°"),
        "rate": UNKNOWN if view.rate_dps is None else f"{abs(view.rate_dps):.1f}",
        "rate_within": f"{_turning(view.rate_dps)} {_within(view.rate_within_dps, 1)}".strip(),
        "cross_track": UNKNOWN if view.cross_track is None else _metres(abs(view.cross_track)),
        "cross_track_side": _off(view.cross_track),
        "leg": view.destination or UNKNOWN,
        "distance": _metres(view.distance),
        "left": _metres(view.left),
        "arrival": _duration(view),
        "steer": _course(view.steer_deg),
        "bearing": _course(view.bearing_deg),
        "position": _position(view.lat_deg, "NS", 2) + "  " + _position(view.lon_deg, "EW", 3),
        "position_within": "" if view.ellipse is None else f"± {_metres(view.ellipse[0])}",
        "time": _clock(view.time),
        "status": _status(view),
        "age": UNKNOWN if view.age is None else f"{view.age:.1f} s",
        "fresh": "" if view.age is None else f"fix {view.age:.1f} s old",
        "nis": _number(view.nis, 1),
        "source": view.source or UNKNOWN,
        "counts": ", ".join(f"{count} {what}" for what, count in view.counts.items()) or UNKNOWN,
        "state": view.state or "",
        "unreachable": f"STOP does not reach the boat: {view.unreachable}" if view.unreachable else "",
        "mode": _mode(view),
        "overboard": _overboard(view),
        "reason": view.reason,
        "asked_course": _course(view.asked_course_deg),
        "asked_rate": _asked(view.asked_rate_dps) if view.is_engaged else UNKNOWN,
        "asked_speed": _number(view.asked_speed_kn, 1, " kn"),
        "thrust": _percent(view.thrust) if view.is_engaged else UNKNOWN,
        "port": _percent(view.port) if view.is_engaged else UNKNOWN,
        "starboard": _percent(view.starboard) if view.is_engaged else UNKNOWN,
    }


def tone(view: View) -> str:
    """The quality of the estimate: "good", "fair" or "bad"; good only if its uncertainty is small."""
    found = {"ok": "good", "lost": "bad"}.get(view.status, "fair")
    return "fair" if found == "good" and not _is_sure(view) else found


def _is_sure(view: View) -> bool:
    if view.ellipse is None or view.cog_within_deg is None:
        return False
    return view.ellipse[0] <= _GOOD_M and view.cog_within_deg <= _GOOD_DEG


def _status(view: View) -> str:
    if view.status == "ok" and not _is_sure(view):
        return "uncertain"
    return _STATUS.get(view.status, view.status)


def _mode(view: View) -> str:
    held = f"course {_course(view.held_deg)} is held"
    if view.dodges:
        held = f"dodging off the route, course {_course(view.held_deg)}; press Route to return"
    said = [{"course": held, "position": "the position is held"}.get(view.mode or "", "")]
    if view.offset and view.mode == "route":
        side = "starboard" if view.offset > 0.0 else "port"
        said.append(f"{abs(view.offset):g} m to {side} of the route")
    if round(abs(view.faster_kn), 1):
        said.append(f"{abs(view.faster_kn):.1f} kn {'above' if view.faster_kn > 0.0 else 'below'} the route's speed")
    return ", ".join(filter(None, said))


def _overboard(view: View) -> str:
    if view.mark is None:
        return ""
    if view.place is None:
        return "man overboard: marked"
    north, east = view.mark[0] - view.place[0], view.mark[1] - view.place[1]
    bearing = math.degrees(math.atan2(east, north)) % 360.0
    return f"man overboard: {_metres(math.hypot(north, east))}, bearing {_course(bearing)}"


def _number(value: float | None, digits: int, unit: str = "") -> str:
    return UNKNOWN if value is None else f"{value:.{digits}f}{unit}"


def _within(value: float | None, digits: int, unit: str = "") -> str:
    return "" if value is None else f"± {value:.{digits}f}{unit}"


def _course(value: float | None) -> str:
    return UNKNOWN if value is None else f"{round(value) % 360:03d}°"


def _asked(rate: float | None) -> str:
    return UNKNOWN if rate is None else f"{abs(rate):.1f} °/s {_turning(rate)}".strip()


def _turning(rate: float | None) -> str:
    """The side of a turn; "" if its rate is printed as 0."""
    return "" if rate is None or abs(rate) < 0.05 else "stbd" if rate > 0.0 else "port"


def _clock(time: float | None) -> str:
    return UNKNOWN if time is None else f"{datetime.datetime.fromtimestamp(time, datetime.UTC):%H:%M:%S} UTC"


def _off(cross_track: float | None) -> str:
    if cross_track is None or abs(cross_track) < 0.05:
        return "" if cross_track is None else "on track"
    return "to starboard of track" if cross_track > 0.0 else "to port of track"


def _metres(value: float | None) -> str:
    if value is None:
        return UNKNOWN
    if value < 99.95:
        return f"{value:.1f} m"
    return f"{value:.0f} m" if value < 9999.5 else f"{value / 1000.0:.1f} km"


def _percent(value: float | None) -> str:
    return UNKNOWN if value is None else f"{100.0 * value:.0f} %"


def _duration(view: View) -> str:
    """Time to the end of the route at the present speed; unknown at the end."""
    if not view.left or view.sog_kn is None or view.sog_kn < 0.1:
        return UNKNOWN
    minutes = view.left / (view.sog_kn * 1852.0) * 60.0
    if minutes >= 5999.5:
        return UNKNOWN
    hours, rest = divmod(round(minutes), 60)
    return f"{hours} h {rest:02d} min" if hours else f"{minutes:.0f} min" if minutes >= 1.0 else "< 1 min"


def _position(degrees: float | None, letters: str, width: int) -> str:
    """Degrees and decimal minutes, as on a chart."""
    if degrees is None:
        return UNKNOWN
    whole, rest = divmod(round(abs(degrees) * 60_000), 60_000)
    return f"{int(whole):0{width}d}° {rest / 1000.0:06.3f}′ {letters[math.copysign(1.0, degrees) < 0.0]}"
