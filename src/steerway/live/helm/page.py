"""The page: its layout, and its update from a view. Texts come from `words`, drawings from `chart`."""

import json
import math
from collections.abc import Sequence
from importlib.resources import files
from typing import Any

from nicegui import ui

from steerway.live.helm.chart import Point, Window, around, moving, still, strip, unwound
from steerway.live.helm.view import Board, Place
from steerway.live.helm.view_text import tone, words

_LOOK = 0.1  # time between two checks for a new view, s
_FRESH = 10  # largest lag of a page (views) at which its requests are accepted
_LEGS = 20  # largest number of buttons for legs
_SPAN = 300.0  # time span of the strips, s
_ZOOM = 1.5
_PADDING = 14.0  # padding of a card, pixels; the same as in page.css
_NEAR = 0.25  # scale of the chart when it follows the boat, m per pixel
_DODGE, _BESIDE, _FASTER = math.radians(20.0), 5.0, 0.2 * 0.514444  # changes per press of a key: rad, m, m/s
_KEYS: Sequence[Sequence[Any]] = (
    ("", ("Hold course", "hold-course"), ("Hold position", "hold-position"), ("Route", "route")),
    ("Course", *((f"{each:+d}°".replace("-", "−"), "adjust", math.radians(each)) for each in (-10, -1, 1, 10))),
    ("Dodge", ("20° port", "dodge", -_DODGE), ("20° stbd", "dodge", _DODGE)),
    ("Offset", ("5 m port", "offset", -_BESIDE), ("On route", "offset"), ("5 m stbd", "offset", _BESIDE)),
    ("Speed", ("Slower", "faster", -_FASTER), ("Planned", "faster"), ("Faster", "faster", _FASTER)),
)
"""Rows of keys: a title, then for each key its text, its request and the value; see `live.controls.Controls`."""
_ICON = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="-16 -16 32 32">'
    '<path d="M0 -15L9 12Q0 6 -9 12Z" fill="#0a5c8f"/></svg>'
)


def serve_with(app: Any, board: Board) -> None:
    """Make the page part of an application."""

    @ui.page("/")
    def helm() -> None:
        Page(board)

    ui.run_with(
        app,
        title="Steerway helm",
        favicon=_ICON,
        dark=None,
        tailwind=False,
        binding_refresh_interval=None,
        show_welcome_message=False,
        gzip_middleware_factory=None,
    )


def _text(name: str) -> Any:
    return files("steerway.live.helm").joinpath(name).read_text(encoding="utf-8")


class Page:
    """One open page."""

    def __init__(self, board: Board):
        self._board, self._client = board, ui.context.client
        self._texts: dict[str, ui.label] = {}
        self._seq = self._second = -1
        self._size, self._strip_width = (0.0, 0.0), 0.0
        self._window: Window | None = None
        self._follows, self._scale = not board.route, _NEAR
        self._drawn: tuple[Any, ...] = ()
        ui.add_css(_text("page.css"))
        ui.add_body_html(f"<script>{_text('page.js')}</script>")
        self._build()
        ui.timer(_LOOK, self._look)
        ui.on("helmHere", lambda: self._board.order("present", self._client.ip or ""))

    def _build(self) -> None:
        with _box("banner"):
            ui.label("No connection to the boat. The values are old, and no button works.").props("role=alert")
        with _box("marked line") as self._marked:
            self._text("overboard").props("role=alert")
            self._key("Clear MOB mark", "mob-over")
        with _box("helm"):
            self._build_head()
            self._build_chart()
            with _box("side"):
                with _box("readings"):
                    self._reading("sog", "SOG", "kn", "sog_within")
                    self._reading("cog", "COG", "", "cog_within")
                    self._reading("rate", "Course rate", "°/s", "rate_within")
                if self._board.has_autopilot:
                    self._build_autopilot()
                if self._board.route:
                    self._build_route()
                if self._board.has_autopilot:
                    self._build_holding()
                self._build_strips()
                self._build_estimator()
        with _box("bar", "footer"):
            if self._board.has_autopilot:
                self._build_start()
            self._key("MOB", "mob").classes("overboard").props('aria-label="man overboard"')
            if self._board.has_autopilot:
                self._stopper = _button("STOP", "stop", "stop").on("click", self._stop)

    def _build_head(self) -> None:
        with _box("head", "header"):
            ui.label("Steerway").classes("name").props("role=heading aria-level=1")
            self._dot = _box("dot good")
            self._text("status").props("aria-live=polite")
            self._text("fresh").classes("within fresh")
            self._text("time").classes("time")
            _button("Day / dark", "quiet", "shade").on("click", js_handler="() => helmShade()")

    def _build_chart(self) -> None:
        with _box("chart", "section"):
            with _box("place"):
                self._text("position")
                self._text("position_within").classes("within")
                with _box("zoom"):
                    _button("+", "quiet", "closer").on("click", lambda: self._zoom(1.0 / _ZOOM))
                    _button("−", "quiet", "wider").on("click", lambda: self._zoom(_ZOOM))
                    _button("Boat", "quiet", "follow").on("click", self._follow)
                    _button("All", "quiet", "whole").on("click", self._whole)
            with _box("sea"):
                ui.element("q-resize-observer").on("resize", self._resized)
                self._still = ui.html("", sanitize=False).classes("layer").props('data-name="still"')
                self._moving = ui.html("", sanitize=False).classes("layer").props('data-name="moving"')

    def _build_autopilot(self) -> None:
        with _card("Autopilot", "pilot"):
            with _box("line"):
                self._state = self._text("state").classes("state").props("aria-live=assertive")
                self._text("reason").classes("reason").props("aria-live=assertive")
            self._text("notice").classes("notice").props("role=alert")
            self._text("unreachable").classes("notice").props("role=alert")
            self._text("mode").props("aria-live=polite")
            with _box("pairs"):
                self._pair("asked_course", "Steer")
                self._pair("asked_speed", "Speed")
                self._pair("asked_rate", "Turn")
                self._pair("thrust", "Thrust")
                self._pair("port", "Port")
                self._pair("starboard", "Starboard")

    def _build_holding(self) -> None:
        legs = range(1, min(len(self._board.route), _LEGS + 1)) if len(self._board.route) > 2 else ()
        with _card("Hold", "holding"):
            for title, *keys in [*_KEYS, ("Leg", *((str(leg), "leg", leg) for leg in legs))]:
                if keys:
                    with _box("line keys"):
                        if title:
                            ui.label(title).classes("within")
                        for key in keys:
                            self._key(*key)

    def _key(self, text: str, what: str, value: Any = None) -> ui.button:
        name = what if value is None else f"{what}-{text}"
        button = _button(text, "quiet", name)
        return button.on("click", lambda event: self._ask(event.args, what, value), js_handler="() => emit(helmSeq)")

    def _ask(self, seen: object, what: str, value: Any = None) -> None:
        """Request it if the page was up to date: a delayed click must not turn the propellers. MOB always works."""
        if what == "mob" or (isinstance(seen, int) and 0 <= self._board.seq - seen <= _FRESH):
            self._board.order(what, self._client.ip or "", value)
        else:
            ui.notify("This page was out of date: nothing was sent. Press again.", type="warning", position="top")

    def _build_route(self) -> None:
        with _card("Cross-track error", "route-card"):
            with _box("line"):
                self._text("cross_track").classes("large")
                self._text("cross_track_side").classes("within")
            with _box("pairs"):
                self._pair("leg", "Next waypoint")
                self._pair("distance", "Distance")
                self._pair("left", "Route left")
                self._pair("arrival", "Time left")
                if not self._board.has_autopilot:
                    self._pair("steer", "Steer")
                    self._pair("bearing", "Bearing")
            with _box("progress"):
                self._bar = _box("done")

    def _build_strips(self) -> None:
        with _card("Last five minutes", "strips"):
            ui.element("q-resize-observer").on("resize", lambda event: self._strips_resized(event.args["width"]))
            ui.label("SOG, kn").classes("within")
            self._speeds = ui.html("", sanitize=False).props('data-name="speeds"')
            ui.label("COG").classes("within")
            self._courses = ui.html("", sanitize=False).props('data-name="courses"')

    def _build_estimator(self) -> None:
        with _card("Estimator", "estimator"):
            with _box("pairs"):
                self._pair("age", "Last fix")
                self._pair("nis", "NIS")
            self._pair("source", "Source")
            self._pair("counts", "Fixes")

    def _build_start(self) -> None:
        with ui.dialog() as asks, ui.card().classes("asks"):
            ui.label("Start the autopilot? The propellers will turn.")
            with _box("line choice"):
                _button("Cancel", "quiet", "cancel").on("click", asks.close)
                sure = _button("Start", "start", "sure").on("click", asks.close)
                sure.on("click", lambda event: self._ask(event.args, "start"), js_handler="() => emit(helmSeq)")
        self._asks = asks
        self._starter = _button("START", "start", "start").on("click", asks.open)

    def _text(self, name: str) -> Any:
        self._texts[name] = ui.label("").props(f'data-name="{name}"')
        return self._texts[name].classes("value")

    def _pair(self, name: str, title: str) -> None:
        with _box("pair"):
            ui.label(title)
            self._text(name)

    def _reading(self, name: str, title: str, unit: str, within: str) -> None:
        with _box("reading"):
            ui.label(title).classes("title")
            with _box("line"):
                self._text(name).classes("huge")
                ui.label(unit).classes("unit")
            self._text(within).classes("within")

    def _stop(self) -> None:
        self._asks.close()
        self._board.order("stop", self._client.ip or "")

    def _resized(self, event: Any) -> None:
        self._size = float(event.args["width"]), float(event.args["height"])
        self._window = None
        self._draw()

    def _strips_resized(self, width: float) -> None:
        self._strip_width = float(width) - 2.0 * _PADDING
        self._draw_strips()

    def _zoom(self, factor: float) -> None:
        if self._window is not None:
            self._scale = min(max(self._window.scale * factor, 0.01), 5000.0)
            self._follow()

    def _follow(self) -> None:
        self._follows, self._window = True, None
        self._draw()

    def _whole(self) -> None:
        self._follows, self._window = False, None
        self._draw()

    def _look(self) -> None:
        """Update the page to the newest view."""
        if self._board.seq == self._seq or not self._client.has_socket_connection:
            return
        self._seq, view = self._board.seq, self._board.view
        texts = words(view) | {"notice": self._board.notice}
        for name, label in self._texts.items():
            label.set_text(texts[name])
        self._marked.set_visibility(bool(texts["overboard"]))
        self._dot.classes(replace=f"box dot {tone(view)}")
        if self._board.has_autopilot:
            self._state.classes(replace=f"value state {view.state or 'idle'}")
            self._starter.set_enabled(view.state in ("ready", "stopped", "finished"))
            self._stopper.classes(replace=f"stop{' mute' if view.unreachable else ''}")
        if self._board.route:
            self._bar.style(f"width: {100.0 * (view.done or 0.0):.0f}%")
        self._draw()
        if view.time is not None and int(view.time) != self._second:
            self._second = int(view.time)
            self._draw_strips()
        ui.run_javascript(f"helmBeat({json.dumps(self._seq)})")

    def _draw(self) -> None:
        if min(self._size) < 50.0:
            return
        board, view = self._board, self._board.view
        boat = view.place
        if self._window is None or (boat and not self._window.holds(*boat, 0.3 if self._follows else 0.03)):
            self._window = self._framed(boat)
        track = board.history.track
        drawn = self._window, len(track), track[-1] if track else None, view.target
        if drawn != self._drawn:
            self._drawn = drawn
            self._still.set_content(still(self._window, board.route, track, view.target, board.fence))
        self._moving.set_content(moving(self._window, view, board.route))

    def _framed(self, boat: Place | None) -> Window:
        places = [place for place in self._board.history.track if place is not None]
        if not self._follows:
            return around(board_places(self._board, boat), *self._size)
        middle = boat or (places[-1] if places else (0.0, 0.0))
        return Window(*middle, self._scale, *self._size)

    def _draw_strips(self) -> None:
        if self._strip_width < 50.0:
            return
        moments = self._board.history.moments
        speeds = [Point(time, each.sog_kn, each.sog_within_kn) for time, each in moments]
        courses = unwound([Point(time, each.cog_deg, each.cog_within_deg) for time, each in moments])
        self._speeds.set_content(strip(speeds, self._strip_width, 96.0, _SPAN, 0.5))
        self._courses.set_content(strip(courses, self._strip_width, 96.0, _SPAN, 20.0, turns=True))


def board_places(board: Board, boat: Place | None) -> list[tuple[float, float]]:
    """The places that the whole chart shows; the fence, which may be far away, only if there is nothing else."""
    track = [place for place in board.history.track if place is not None]
    return [*board.route, *track, *([boat] if boat else [])] or list(board.fence)


def _box(names: str, tag: str = "div") -> ui.element:
    return ui.element(tag).classes(f"box {names}")


def _card(title: str, names: str) -> ui.element:
    card = _box(f"card {names}", "section")
    with card:
        ui.label(title).classes("title").props("role=heading aria-level=2")
    return card


def _button(text: str, names: str, name: str) -> ui.button:
    """A button in the page's own colours."""
    return ui.button(text, color=None).props(f'no-caps unelevated data-name="{name}"').classes(names)
