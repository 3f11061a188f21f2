"""The process of the page: reads views on standard input, writes requests on standard output, a line of JSON each.

It ends when its input does.
"""

import asyncio
import contextlib
import json
import os
import socket
import sys
import traceback
from collections.abc import Callable
from typing import Any

from steerway.live.helm.view import Board
from steerway.live.uri import Address

_NICE = 10  # the service has priority for the processor
_LONGEST = 1 << 20  # longest line from the service and longest message from a browser, bytes


def main() -> None:
    """Serve until standard input ends."""
    os.nice(_NICE)
    settings = json.loads(open(sys.stdin.fileno(), "rb", buffering=0, closefd=False).readline())
    orders = os.fdopen(os.dup(sys.stdout.fileno()), "wb", buffering=0)
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # a library's output is no request

    def send(message: dict[str, Any]) -> None:
        with contextlib.suppress(BrokenPipeError):
            orders.write(json.dumps(message).encode() + b"\n")

    address = Address(settings["host"], settings["port"], settings["token"], settings["origin"])
    try:
        listener = _listener(address)
    except OSError as error:
        send({"failed": os.strerror(error.errno) if error.errno else str(error), "errno": error.errno or 0})
        return
    asyncio.run(_serve(address, listener, Board(settings, send), send))


def _listener(address: Address) -> socket.socket:
    family = socket.AF_INET6 if ":" in address.host else socket.AF_INET
    return socket.create_server((address.host, address.port), family=family)


async def _serve(
    address: Address, listener: socket.socket, board: Board, send: Callable[[dict[str, Any]], None]
) -> None:
    import uvicorn
    from fastapi import FastAPI
    from uvicorn.protocols.http.auto import AutoHTTPProtocol

    from steerway.live.helm.access import Gate, Places, protocol_with
    from steerway.live.helm.page import serve_with

    app = FastAPI(openapi_url=None)
    serve_with(app, board)
    places = Places()
    config = uvicorn.Config(
        Gate(app, address, places),
        http=protocol_with(places, AutoHTTPProtocol),
        log_level="warning",
        access_log=False,
        server_header=False,
        proxy_headers=False,
        ws="websockets-sansio",
        ws_max_size=_LONGEST,
    )
    serving = asyncio.create_task(uvicorn.Server(config).serve([listener]))
    reading = asyncio.create_task(_read(board))
    watching = asyncio.create_task(places.watch())
    send({"ready": True})
    await asyncio.wait((serving, reading, watching), return_when=asyncio.FIRST_COMPLETED)
    for task in (serving, reading):
        if task.done() and task.exception() is not None:
            traceback.print_exception(task.exception())
    os._exit(0)  # nothing has to be saved, and the next service needs the port


async def _read(board: Board) -> None:
    """Read the service's messages until they end."""
    reader = asyncio.StreamReader(_LONGEST)
    loop = asyncio.get_running_loop()
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    async for line in reader:
        board.update(json.loads(line))


if __name__ == "__main__":
    main()
