"""The service's end of the pipe to the page: says five times a second what is to be seen, and obeys.

Nothing here waits: a page that does not keep up misses views, and one that ends is started again.
"""

import asyncio
import contextlib
import importlib.util
import json
import logging
import sys

from steerway.core.errors import InputError
from steerway.live.autopilot.mission import GeodeticRoute
from steerway.live.helm.address import Address
from steerway.live.helm.seeing import Plane, Seen, view
from steerway.live.links.listening import RETRY, kept_open
from steerway.live.service import Service

LOG = logging.getLogger("steerway.live")
RATE = 5.0
"""Views a second, Hz."""
_BACKLOG = 1 << 16  # bytes that may wait for the page
_LEAVING = 2.0  # s the page has to end


class Helm:
    """The page of a service. Runs beside it like a link; `route` is what is drawn.

    Raises InputError without the package that draws it.
    """

    def __init__(self, service: Service, address: Address, route: GeodeticRoute | None = None):
        if importlib.util.find_spec("nicegui") is None:
            raise InputError("the helm page needs the package nicegui, expected pip install steerway[helm]")
        self.service, self.address = service, address
        self._plane = Plane.of(route)
        self._notice = ""
        self._seq = 0

    async def run(self) -> None:
        """Keep the page up until cancelled."""
        while True:
            try:
                await kept_open(f"helm {self.address.url}", self._serve)
            except Exception:  # whatever is wrong with the page, the boat sails on
                LOG.exception("helm page: begun again")
                await asyncio.sleep(RETRY)

    async def _serve(self):
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", "steerway.live.helm.server"),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            start_new_session=True,  # Ctrl-C ends the service, and that the page
        )
        try:
            _say(process, self._settings())
            tasks = [asyncio.create_task(work) for work in (self._speak(process), self._obey(process))]
            try:
                done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
                for task in done:
                    task.result()
            finally:
                for task in tasks:
                    task.cancel()
        finally:
            await _end(process)

    def _settings(self):
        return {
            "host": self.address.host,
            "port": self.address.port,
            "token": self.address.token,
            "route": self._plane.route,
            "fence": self._plane.fence,
            "has_autopilot": self.service.autopilot is not None,
        }

    async def _speak(self, process):
        while True:
            if process.stdin.transport.get_write_buffer_size() < _BACKLOG:
                self._seq += 1
                shown = view(seen(self.service), self._plane)
                _say(process, {"seq": self._seq, "notice": self._notice, "view": shown._asdict()})
            await asyncio.sleep(1.0 / RATE)

    async def _obey(self, process):
        """What the page says, a line each, until it ends."""
        async for line in process.stdout:
            said = json.loads(line)
            if "failed" in said:
                raise OSError(0, said["failed"])
            if said.get("ready"):
                LOG.info("helm page: %s", self.address.url)
            elif said.get("do"):
                self._do(said["do"], said.get("who", ""))

    def _do(self, what, who):
        if self.service.autopilot is None:
            return
        LOG.info("helm page: %s asks to %s", who, what)
        self._notice = ""
        try:
            if what == "start":
                self.service.autopilot.start()
            elif what == "stop":
                self.service.autopilot.stop("stopped at the helm page")
        except InputError as error:
            self._notice = str(error)
            LOG.info("helm page: refused: %s", error)


def seen(service: Service) -> Seen:
    """What a service knows now."""
    navigator, latest = service.navigator, service.latest
    return Seen(
        latest.row,
        latest.leg,
        latest.order,
        navigator.position_covariance,
        navigator.last_fix,
        navigator.choice.present,
        latest.counts,
    )


def _say(process, message):
    process.stdin.write(json.dumps(message).encode() + b"\n")


async def _end(process):
    """The page ends when nothing more is said to it."""
    process.stdin.close()
    try:
        async with asyncio.timeout(_LEAVING):
            await process.wait()
    except TimeoutError:
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        await process.wait()
