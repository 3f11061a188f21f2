"""The connections to the page: how many there may be, from one address and in all, and how long one may be idle.

A connection without a request is closed after `_IDLE`, so that idle ones, and headers that never end, keep nobody out.
When all places are taken, those who have not logged in give way to newcomers.
"""

import asyncio

MOST = 200
"""Connections in all."""
_FROM_ONE = 32  # connections of one address; a browser opens six beside its WebSocket
_IDLE = 5.0  # s without a request


class _Connection:
    """One connection."""

    def __init__(self, transport, address, now):
        self.transport, self.address, self.since = transport, address, now
        self.knows = False  # has logged in, or needs no login
        self.requests = 0  # in progress; a WebSocket is one


class Places:
    """The open connections by the client's address and port."""

    def __init__(self, most: int = MOST, from_one: int = _FROM_ONE, idle: float = _IDLE):
        self._most, self._from_one, self._idle = most, from_one, idle
        self._places: dict[tuple, _Connection] = {}

    def __len__(self) -> int:
        return len(self._places)

    def admit(self, transport, now: float) -> bool:
        """Whether a new connection may stay; others may be closed for it."""
        client = tuple((transport.get_extra_info("peername") or ("", 0))[:2])
        self._forget_closed()
        here = [each for each in self._places.values() if each.address == client[0]]
        for crowd, most in ((here, self._from_one), (list(self._places.values()), self._most)):
            if len(crowd) >= most and not self._closed_one(crowd):
                return False
        self._places[client] = _Connection(transport, client[0], now)
        return True

    def begin(self, client: tuple, knows: bool) -> None:
        """A request of a client begins; whether it is of one who has logged in."""
        place = self._places.get(tuple(client or ())[:2])
        if place is not None:
            place.requests += 1
            place.knows |= knows

    def end(self, client: tuple, now: float) -> None:
        """A request has ended."""
        place = self._places.get(tuple(client or ())[:2])
        if place is not None:
            place.requests -= 1
            place.since = now

    def close_idle(self, now: float) -> None:
        """Close the connections that have had no request for long."""
        self._forget_closed()
        for client, place in list(self._places.items()):
            if place.requests == 0 and now - place.since > self._idle:
                place.transport.abort()
                del self._places[client]

    async def watch(self) -> None:
        """Close idle connections until cancelled."""
        loop = asyncio.get_running_loop()
        while True:
            await asyncio.sleep(0.2 * self._idle)
            self.close_idle(loop.time())

    def _closed_one(self, crowd):
        """Whether one of these could be closed: the oldest of those who have not logged in."""
        unknown = [each for each in crowd if not each.knows]
        if not unknown:
            return False
        oldest = min(unknown, key=lambda each: each.since)
        oldest.transport.abort()
        self._places = {client: each for client, each in self._places.items() if each is not oldest}
        return True

    def _forget_closed(self):
        self._places = {client: each for client, each in self._places.items() if not each.transport.is_closing()}


def protocol_with(places: Places, protocol: type) -> type:
    """A protocol of the web server whose connections are admitted by `places`."""

    class Placed(protocol):
        """Refuses a connection for which there is no place."""

        def connection_made(self, transport):
            """See asyncio.Protocol."""
            super().connection_made(transport)
            if not places.admit(transport, asyncio.get_running_loop().time()):
                transport.abort()

    return Placed
