"""Speed and course of the last minutes as small SVG plots, with the band that holds 95 %."""

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from steerway.live.helm.chart import nice

_TURNS = (1, 2, 5, 10, 15, 30, 45, 90, 180)  # degrees between two lines
_APART = 18.0  # pixels between two lines, at the least
_LEFT, _TOP, _BOTTOM = 38.0, 6.0, 18.0  # pixels around the plot


class Point(NamedTuple):
    """A value, a float or None, and how far the truth may be from it; None where there is none."""

    time: float
    value: Any
    within: float | None


def unwound(points: Sequence[Point]) -> list[Point]:
    """Courses in degrees without jumps at north."""
    unwound_points, last = [], None
    for point in points:
        value = point.value
        if value is not None:
            value += 0.0 if last is None else 360.0 * round((last - value) / 360.0)
            last = value
        unwound_points.append(point._replace(value=value))
    return unwound_points


def strip(points: Sequence[Point], width: float, height: float, span: float, least: float, turns: bool = False) -> str:
    """One quantity over the last `span` s; the axis covers `least` at the least, and with `turns` it is in degrees."""
    known = [point for point in points if point.value is not None]
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" aria-hidden="true">'
    if not known:
        return head + "</svg>"
    low, high = _reach(known, least, turns)
    end = points[-1].time
    right, tall = width - 6.0, height - _TOP - _BOTTOM

    def at(time: float, value: float) -> str:
        share = (min(max(value, low), high) - low) / (high - low)
        return f"{right - (end - time) / span * (right - _LEFT):.1f},{_TOP + (1.0 - share) * tall:.1f}"

    drawn = _axis(low, high, right, tall, turns) + _minutes(span, right, height)
    for run in _runs(points):
        upper = [at(each.time, each.value + (each.within or 0.0)) for each in run]
        lower = [at(each.time, each.value - (each.within or 0.0)) for each in reversed(run)]
        drawn += f'<polygon class="band" points="{" ".join(upper + lower)}"/>'
        drawn += f'<polyline class="curve" points="{" ".join(at(each.time, each.value) for each in run)}"/>'
    return head + drawn + "</svg>"


def _reach(known: Sequence[Point], least: float, turns: bool) -> tuple[float, float]:
    """The ends of the axis: all values, and of their bands what does not dwarf them."""
    low, high = min(each.value for each in known), max(each.value for each in known)
    room = max(high - low, least)
    low = min(low, *(each.value - min(each.within or 0.0, room) for each in known))
    high = max(high, *(each.value + min(each.within or 0.0, room) for each in known))
    if high - low < least:
        low, high = (low + high - least) / 2.0, (low + high + least) / 2.0
    return (low, high) if turns or low > 0.0 else (0.0, max(high, least))


def _runs(points: Sequence[Point]) -> Iterator[list[Point]]:
    """Pieces without a gap."""
    run: list[Point] = []
    for point in points:
        if point.value is None or (run and not 0.0 < point.time - run[-1].time < 5.0):
            if run:
                yield run
            run = []
        if point.value is not None:
            run.append(point)
    if run:
        yield run


def _axis(low: float, high: float, right: float, tall: float, turns: bool) -> str:
    least = (high - low) * _APART / tall
    step = next((each for each in _TURNS if each >= least), 360) if turns else nice(least)
    drawn = ""
    for k in range(math.ceil(low / step), math.floor(high / step) + 1):
        y = _TOP + (high - k * step) / (high - low) * tall
        text = f"{k * step % 360:03.0f}°" if turns else f"{k * step:g}"
        drawn += f'<path class="grid" d="M{_LEFT} {y:.1f}H{right:.1f}"/>'
        drawn += f'<text class="small" x="{_LEFT - 5}" y="{y + 4:.1f}" text-anchor="end">{text}</text>'
    return drawn


def _minutes(span: float, right: float, height: float) -> str:
    drawn = ""
    for k in range(round(span / 60.0) + 1):
        x = right - k * 60.0 / span * (right - _LEFT)
        text, anchor = ("now", "end") if k == 0 else (f"−{k} min", "middle")
        if k != round(span / 60.0) or span < 120.0:
            drawn += f'<text class="small" x="{x:.1f}" y="{height - 4:.1f}" text-anchor="{anchor}">{text}</text>'
    return drawn
