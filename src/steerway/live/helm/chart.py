"""The chart and the strips under it as SVG. The route and track are in one drawing, the moving boat in another.

Sizes are in pixels of the screen, so that lines and letters have the same size on a phone and on a laptop. Colours are
classes of page.css.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from steerway.live.helm.view import Place, Places, Track, View

_GRID = 70.0  # smallest distance of grid lines, pixels
_VECTOR = 30.0  # the course vector ends at the position predicted for this time ahead, s
_FEWEST = 0.7  # smallest distance of drawn points of the track, pixels


class Window(NamedTuple):
    """The area on the chart: its middle (north, east; m), its scale (m per pixel), and its size in pixels."""

    north: float
    east: float
    scale: float
    width: float
    height: float

    def at(self, north: float, east: float) -> tuple[float, float]:
        """Pixels of a place (m) from the left and from the top."""
        x = self.width / 2.0 + (east - self.east) / self.scale
        return x, self.height / 2.0 - (north - self.north) / self.scale

    def holds(self, north: float, east: float, margin: float = 0.2) -> bool:
        """Whether a place (m) is inside; `margin`: a fraction of the size that has to lie between place and edge."""
        x, y = self.at(north, east)
        aside, above = margin * self.width, margin * self.height
        return aside <= x <= self.width - aside and above <= y <= self.height - above


def around(places: Any, width: float, height: float, least: float = 40.0) -> Window:
    """The window that shows all places (north, east; m), at least `least` m wide and high."""
    north, east = zip(*places, strict=True) if places else ((0.0,), (0.0,))
    tall, wide = max(max(north) - min(north), least), max(max(east) - min(east), least)
    scale = 1.3 * max(tall / height, wide / width)
    return Window((max(north) + min(north)) / 2.0, (max(east) + min(east)) / 2.0, scale, width, height)


def still(window: Window, route: Places, track: Track, target: int | None, fence: Places = ()) -> str:
    """SVG of grid, fence, route, track and scale bar."""
    drawn = _grid(window) + _fence(window, fence) + _route(window, route, target) + _track(window, track)
    return _svg(window, drawn + _scale_bar(window))


def moving(window: Window, view: View, route: Places = ()) -> str:
    """SVG of the boat with its ellipse, course vector and offset from the leg, and of the MOB mark."""
    mark = _mark(window, view)
    if view.place is None:
        return _svg(window, mark)
    x, y = window.at(*view.place)
    drawn, ellipse = mark + _offset(window, view, route), _ellipse(window, view, x, y)
    if view.cog_deg is None:
        return _svg(window, f'{drawn}<circle class="boat" cx="{x:.1f}" cy="{y:.1f}" r="8"/>{ellipse}')
    course = math.radians(view.cog_deg)
    run = max((view.sog_kn or 0.0) * 0.514444 * _VECTOR / window.scale, 22.0)
    ahead = f"{x + run * math.sin(course):.1f} {y - run * math.cos(course):.1f}"
    turn = f"translate({x:.1f} {y:.1f}) rotate({view.cog_deg:.1f})"
    drawn += _fan(view, x, y, run) + f'<path class="vector" d="M{x:.1f} {y:.1f}L{ahead}"/>'
    return _svg(window, f'{drawn}<path class="boat" transform="{turn}" d="M0 -15L8.5 11Q0 6 -8.5 11Z"/>{ellipse}')


def _mark(window: Window, view: View) -> str:
    """A cross where a man went overboard."""
    if view.mark is None:
        return ""
    x, y = window.at(*view.mark)
    return f'<path class="mob" d="M{x - 9:.1f} {y - 9:.1f}l18 18m0 -18l-18 18"/>'


def _svg(window: Window, drawn: str) -> str:
    size = f'width="{window.width:.0f}" height="{window.height:.0f}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size} aria-hidden="true">{drawn}</svg>'


def nice(least: float) -> float:
    """The smallest of …, 1, 2, 5, 10, 20, … that is at least `least`."""
    power = 10.0 ** math.floor(math.log10(least))
    return next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= least * (1.0 - 1e-9))


def _grid(window: Window) -> str:
    step = nice(_GRID * window.scale)
    wide, tall = window.width * window.scale / 2.0, window.height * window.scale / 2.0
    path = ""
    for k in range(math.ceil((window.east - wide) / step), math.floor((window.east + wide) / step) + 1):
        path += f"M{window.at(0.0, k * step)[0]:.1f} 0V{window.height:.0f}"
    for k in range(math.ceil((window.north - tall) / step), math.floor((window.north + tall) / step) + 1):
        path += f"M0 {window.at(k * step, 0.0)[1]:.1f}H{window.width:.0f}"
    return f'<path class="grid" d="{path}"/>'


def _scale_bar(window: Window) -> str:
    length = nice(_GRID * window.scale)
    text = f"{length:g} m" if length < 1000.0 else f"{length / 1000.0:g} km"
    x, y, run = 16.0, window.height - 16.0, length / window.scale
    bar = f'<path class="scale" d="M{x} {y - 6:.1f}v6h{run:.1f}v-6"/>'
    north = f'<path class="north" transform="translate({window.width - 24:.0f} 34)" d="M0 -18L7 6L0 1L-7 6Z"/>'
    letter = f'<text class="small" x="{window.width - 24:.0f}" y="54" text-anchor="middle">N</text>'
    return f'{bar}<text class="small" x="{x + 6:.1f}" y="{y - 5:.1f}">{text}</text>{north}{letter}'


def _fence(window: Window, fence: Places) -> str:
    return f'<polygon class="fence" points="{_points([window.at(*place) for place in fence])}"/>' if fence else ""


def _route(window: Window, route: Places, target: int | None) -> str:
    if not route:
        return ""
    pixels = [window.at(*place) for place in route]
    drawn = f'<polyline class="route" points="{_points(pixels)}"/>'
    if target is not None and 0 < target < len(pixels):
        drawn += f'<polyline class="leg" points="{_points(pixels[target - 1 : target + 1])}"/>'
    for k, (x, y) in enumerate(pixels):
        name = "waypoint next" if k == target else "waypoint"
        drawn += f'<circle class="{name}" cx="{x:.1f}" cy="{y:.1f}" r="{7 if k == target else 5}"/>'
    for (x, y), name in _named(pixels):
        drawn += f'<text class="small" x="{x + 10:.1f}" y="{y - 8:.1f}">{name}</text>'
    return drawn


def _named(pixels: Places) -> list[Any]:
    """Place (pixels) and text of each name; waypoints at one place share a name."""
    places: list[Any] = []
    for k, pixel in enumerate(pixels):
        near = next((each for each in places if math.dist(each[0], pixel) < 12.0), None)
        if near is None:
            places.append([pixel, f"WP{k}"])
        else:
            near[1] += f", {k}"
    return places


def _track(window: Window, track: Track) -> str:
    lines: list[list[Place]] = []
    line, last = list[Place](), None
    for place in track:
        if place is None:
            lines, line, last = [*lines, line], [], None
            continue
        pixel = window.at(*place)
        if last is None or abs(pixel[0] - last[0]) + abs(pixel[1] - last[1]) > _FEWEST:
            line.append(pixel)
            last = pixel
    return "".join(f'<polyline class="track" points="{_points(each)}"/>' for each in [*lines, line] if len(each) > 1)


def _points(pixels: Places) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in pixels)


def _offset(window: Window, view: View, route: Places) -> str:
    """A line from the boat perpendicular to the leg."""
    if view.place is None or view.cross_track is None or not view.target or view.target >= len(route):
        return ""
    (north_0, east_0), (north_1, east_1) = route[view.target - 1], route[view.target]
    direction = math.atan2(east_1 - east_0, north_1 - north_0)
    north = view.place[0] + view.cross_track * math.sin(direction)
    east = view.place[1] - view.cross_track * math.cos(direction)
    return f'<polyline class="offset" points="{_points([window.at(*view.place), window.at(north, east)])}"/>'


def _ellipse(window: Window, view: View, x: float, y: float) -> str:
    if view.ellipse is None:
        return ""
    major, minor, direction = view.ellipse
    axes = f'rx="{minor / window.scale:.1f}" ry="{major / window.scale:.1f}"'
    return f'<ellipse class="ellipse" transform="translate({x:.1f} {y:.1f}) rotate({direction:.1f})" {axes}/>'


def _fan(view: View, x: float, y: float, run: float) -> str:
    """The sector of the course within its 95 % bounds."""
    half = min(view.cog_within_deg or 0.0, 179.9)
    first, last = (math.radians((view.cog_deg or 0.0) + side * half) for side in (-1.0, 1.0))
    start = f"{x + run * math.sin(first):.1f} {y - run * math.cos(first):.1f}"
    stop = f"{x + run * math.sin(last):.1f} {y - run * math.cos(last):.1f}"
    arc = f"A{run:.1f} {run:.1f} 0 {int(half > 90.0)} 1 {stop}"
    return f'<path class="fan" d="M{x:.1f} {y:.1f}L{start}{arc}Z"/>'


_TURNS = (1, 2, 5, 10, 15, 30, 45, 90, 180)  # possible steps of a course axis, degrees
_APART = 18.0  # smallest distance of two lines, pixels
_LEFT, _TOP, _BOTTOM = 38.0, 6.0, 18.0  # margins around the plot, pixels


class Point(NamedTuple):
    """A value at a time and the half-width of its band; None where it is unknown."""

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
    """SVG of a quantity over the last `span` s; its axis covers at least `least`. turns: for a course in degrees."""
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
    """The ends of the axis. It contains all values, and their bands unless these exceed the range of the values."""
    low, high = min(each.value for each in known), max(each.value for each in known)
    room = max(high - low, least)
    low = min(low, *(each.value - min(each.within or 0.0, room) for each in known))
    high = max(high, *(each.value + min(each.within or 0.0, room) for each in known))
    if high - low < least:
        low, high = (low + high - least) / 2.0, (low + high + least) / 2.0
    return (low, high) if turns or low > 0.0 else (0.0, max(high, least))


def _runs(points: Sequence[Point]) -> Iterator[list[Point]]:
    """Runs of points without a gap."""
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
