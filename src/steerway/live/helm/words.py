"""What the page says of a view: every quantity as its text. A dash is unknown."""

import datetime
import math

from steerway.live.helm.view import View

UNKNOWN = "–"
_STATUS = {
    "ok": "good",
    "predicted": "predicted",
    "rejected": "fix rejected",
    "no_course": "no steerageway",
    "starting": "starting",
    "lost": "no position",
}


def words(view: View) -> dict[str, str]:
    """The texts by their place on the page."""
    return {
        "sog": _number(view.sog_kn, 2 if (view.sog_kn or 0.0) < 10.0 else 1),
        "sog_within": _within(view.sog_within_kn, 2),
        "cog": UNKNOWN if view.cog_deg is None else f"{round(view.cog_deg) % 360:03d}°",
        "cog_within": _within(view.cog_within_deg, 1, "°"),
        "rate": _side(view.rate_dps, "{:.1f}"),
        "rate_within": _within(view.rate_within_dps, 1),
        "cross_track": UNKNOWN if view.cross_track is None else _metres(abs(view.cross_track)),
        "cross_track_side": _off(view.cross_track),
        "leg": view.destination or UNKNOWN,
        "distance": _metres(view.distance),
        "left": _metres(view.left),
        "arrival": _duration(view),
        "steer": UNKNOWN if view.steer_deg is None else f"{round(view.steer_deg) % 360:03d}°",
        "position": _position(view.lat_deg, "NS", 2) + "  " + _position(view.lon_deg, "EW", 3),
        "position_within": "" if view.ellipse is None else f"± {_metres(view.ellipse[0])}",
        "time": "–"
        if view.time is None
        else f"{datetime.datetime.fromtimestamp(view.time, datetime.UTC):%H:%M:%S} UTC",
        "status": _STATUS.get(view.status, view.status),
        "age": UNKNOWN if view.age is None else f"{view.age:.1f} s",
        "nis": _number(view.nis, 1),
        "source": view.source or UNKNOWN,
        "counts": ", ".join(f"{count} {what}" for what, count in view.counts.items()) or UNKNOWN,
        "state": view.state or "",
        "reason": view.reason,
        "asked_rate": _side(view.asked_rate_dps, "{:.1f} °/s") if view.is_engaged else UNKNOWN,
        "asked_speed": _number(view.asked_speed_kn, 1, " kn"),
        "thrust": _percent(view.thrust) if view.is_engaged else UNKNOWN,
        "propellers": f"{_percent(view.port)} · {_percent(view.starboard)}" if view.is_engaged else UNKNOWN,
    }


def tone(view: View) -> str:
    """How much the estimate is to be trusted: "good", "fair" or "bad"."""
    if view.status == "ok" or (view.status == "predicted" and (view.age or 0.0) < 2.0):
        return "good"
    return "bad" if view.status == "lost" else "fair"


def _number(value, digits, unit=""):
    return UNKNOWN if value is None else f"{value:.{digits}f}{unit}"


def _within(value, digits, unit=""):
    return "" if value is None else f"± {value:.{digits}f}{unit}"


def _side(value, form):
    """With the side it turns to."""
    if value is None:
        return UNKNOWN
    text = form.format(abs(value))
    is_zero = float("".join(c for c in text if c in "0123456789.")) == 0.0
    return text if is_zero else f"{text} {'S' if value > 0.0 else 'P'}"


def _clock(time):
    return UNKNOWN if time is None else f"{datetime.datetime.fromtimestamp(time, datetime.UTC):%H:%M:%S} UTC"


def _off(cross_track):
    if cross_track is None or abs(cross_track) < 0.05:
        return "" if cross_track is None else "on track"
    return "to starboard of track" if cross_track > 0.0 else "to port of track"


def _metres(value):
    if value is None:
        return UNKNOWN
    if value < 99.95:
        return f"{value:.1f} m"
    return f"{value:.0f} m" if value < 9999.5 else f"{value / 1000.0:.1f} km"


def _percent(value):
    return UNKNOWN if value is None else f"{100.0 * value:.0f} %"


def _duration(view):
    """Time to the end of the route at the present speed."""
    if view.left is None or view.sog_kn is None or view.sog_kn < 0.1:
        return UNKNOWN
    minutes = view.left / (view.sog_kn * 1852.0) * 60.0
    if minutes >= 5999.5:
        return UNKNOWN
    hours, rest = divmod(round(minutes), 60)
    return f"{hours} h {rest:02d} min" if hours else f"{minutes:.0f} min" if minutes >= 1.0 else "< 1 min"


def _position(degrees, letters, width):
    """Degrees and decimal minutes, as on a chart."""
    if degrees is None:
        return UNKNOWN
    whole, rest = divmod(round(abs(degrees) * 60_000), 60_000)
    return f"{int(whole):0{width}d}° {rest / 1000.0:06.3f}′ {letters[math.copysign(1.0, degrees) < 0.0]}"
