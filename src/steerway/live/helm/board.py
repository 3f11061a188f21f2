"""What the pages show."""

from collections.abc import Callable

from steerway.live.helm.history import History
from steerway.live.helm.view import View


class Board:
    """The newest view and the history, for every open page."""

    def __init__(self, settings: dict, send: Callable[[dict], None]):
        self.route = [tuple(place) for place in settings["route"]]
        self.fence = [tuple(place) for place in settings["fence"]]
        self.has_autopilot = bool(settings["has_autopilot"])
        self.history = History()
        self.view = View()
        self.notice = ""
        self.seq = 0
        self._send = send

    def update(self, message: dict) -> None:
        """The next message of the service."""
        self.view = View(**message["view"])
        self.notice, self.seq = message["notice"], message["seq"]
        self.history.add(self.view)

    def order(self, what: str, who: str, value: object = None) -> None:
        """Send a request to the service; see `live.controls.Controls`."""
        self._send({"do": what, "value": value, "who": who})
