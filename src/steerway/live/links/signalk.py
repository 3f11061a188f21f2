"""The WebSocket of a Signal K server."""

from contextlib import asynccontextmanager

from steerway.core.errors import InputError
from steerway.live.uri import Uri


def require_websockets(uri: Uri) -> None:
    """Raises InputError without the package that Signal K needs."""
    try:
        import websockets  # noqa: F401
    except ImportError:
        raise InputError(f"{uri.text}: needs the package websockets, expected pip install steerway[live]") from None


@asynccontextmanager
async def connected(uri: Uri):
    """The stream's WebSocket, nothing subscribed to; its failures are OSError as those of any link."""
    from websockets.asyncio.client import connect
    from websockets.exceptions import WebSocketException

    token = f"&token={uri.options['token']}" if uri.options.get("token") else ""
    address = f"ws://{uri.host}:{uri.port}/signalk/v1/stream?subscribe=none{token}"
    try:
        async with connect(address, open_timeout=5.0) as socket:
            yield socket
    except WebSocketException as error:
        raise ConnectionError(str(error)) from None
