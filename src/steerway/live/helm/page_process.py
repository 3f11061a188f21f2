"""The service's end of the pipe to the page: it sends a view five times a second, and carries out requests.

The service never waits: a page that does not keep up misses views, and a page that ends is started again.
"""

import asyncio
import contextlib
import json
import sys
from asyncio.subprocess import Process
from typing import TYPE_CHECKING, Any

from steerway.core.errors import InputError
from steerway.core.extras import require
from steerway.live.autopilot.mission import GeodeticRoute
from steerway.live.controls import PRESENT
from steerway.live.helm.make_view import ChartPlane, view
from steerway.live.links.link import RETRY, kept_open
from steerway.live.uri import LOG, Address

if TYPE_CHECKING:
    from steerway.live.service import Service

RATE = 5.0
"""Views a second, Hz."""
_BACKLOG = 1 << 16  # largest number of bytes that wait for the page
_LEAVING = 2.0  # longest time until the page ends, then it is killed, s


class HelmPage:
    """The page of a service; runs beside it like a link. `route` is drawn on the chart.

    Raises InputError without the extra package that draws the page.
    """

    def __init__(self, service: "Service", address: Address, route: GeodeticRoute | None = None):
        require("the helm page", "helm")
        self.service, self.address = service, address
        self._plane = ChartPlane.of(route)
        self._notice = ""
        self._seq = 0
        self._has_begun = False

    async def run(self) -> None:
        """Keep the page up until cancelled. Raises InputError if its port is in use at the first attempt."""
        while True:
            try:
                await kept_open(f"helm {self.address.url}", self._serve)
            except InputError:
                raise
            except Exception:  # no fault of the page may stop the service
                LOG.exception("helm page: restarted")
                await asyncio.sleep(RETRY)

    async def _serve(self) -> None:
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", "steerway.live.helm.server"),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            start_new_session=True,  # Ctrl-C ends the service, which ends the page
        )
        to_page, from_page = process.stdin, process.stdout
        assert to_page is not None and from_page is not None  # pipes
        try:
            _send(to_page, self._settings())
            tasks = [asyncio.create_task(work) for work in (self._send_views(to_page), self._read(from_page))]
            try:
                done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
                for task in done:
                    task.result()
            finally:
                for task in tasks:
                    task.cancel()
        finally:
            to_page.close()
            await _end(process)

    def _settings(self) -> dict[str, Any]:
        return {
            "host": self.address.host,
            "port": self.address.port,
            "token": self.address.token,
            "origin": self.address.origin,
            "route": self._plane.route,
            "fence": self._plane.fence,
            "has_autopilot": self.service.supervisor is not None,
        }

    async def _send_views(self, page: asyncio.StreamWriter) -> None:
        while True:
            if page.transport.get_write_buffer_size() < _BACKLOG:
                self._seq += 1
                shown = view(self.service, self._plane)
                _send(page, {"seq": self._seq, "notice": self._notice, "view": shown._asdict()})
            await asyncio.sleep(1.0 / RATE)

    async def _read(self, page: asyncio.StreamReader) -> None:
        """Read the page's messages, one per line, until the page ends."""
        async for line in page:
            message = _message(line)
            if "failed" in message:
                raise OSError(0 if self._has_begun else message.get("errno", 0), str(message["failed"]))
            if message.get("ready"):
                self._has_begun = True
                LOG.info("helm page: %s", self.address.url)
            elif message.get("do"):
                self._do(message["do"], message.get("value"), message.get("who", ""))

    def _do(self, what: str, value: Any, who: str) -> None:
        if what == PRESENT:
            self.service.controls.present()
            return
        LOG.info("helm page: request from %s", who)
        self._notice = ""
        try:
            self.service.controls.do(what, value, "the helm page")
        except InputError as error:
            self._notice = str(error)


def _message(line: bytes) -> dict[str, Any]:
    """The message in a line of the page's process; empty for other output, as a library may print it."""
    try:
        message = json.loads(line)
    except (ValueError, RecursionError):
        return {}
    return message if isinstance(message, dict) else {}


def _send(page: asyncio.StreamWriter, message: dict[str, Any]) -> None:
    page.write(json.dumps(message).encode() + b"\n")


async def _end(process: Process) -> None:
    """Wait for the page to end, as it does when its input is closed; else kill it."""
    try:
        async with asyncio.timeout(_LEAVING):
            await process.wait()
    except TimeoutError:
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        await process.wait()
