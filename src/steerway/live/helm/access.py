"""Access control of the page, against other computers and against other web pages.

Another computer in the boat's network has to send the token once and gets a signed cookie. Any web page in the
skipper's own browser can send requests to this address. Such requests are recognised by the headers Host (a foreign
name that points here) and Origin (a foreign page).

The number of connections is limited, per address and in all. A connection without a request is closed after `_IDLE`, so
that idle connections and endless headers lock nobody out. When all places are taken, a connection without login is
closed for a new one.
"""

import asyncio
import hashlib
import hmac
import re
import time
from collections import OrderedDict
from collections.abc import Sequence
from html import escape
from importlib.resources import files
from typing import Any
from urllib.parse import parse_qs

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import Request, cookie_parser
from starlette.responses import HTMLResponse, PlainTextResponse, RedirectResponse
from starlette.types import Message, Receive, Scope, Send

from steerway.live.uri import Address, is_loopback

MOST = 200
"""Largest number of connections."""
_FROM_ONE = 32  # largest number of connections of one address; a browser opens six and a WebSocket
_IDLE = 5.0  # time without a request after which a connection is closed, s


class _Connection:
    """One connection."""

    def __init__(self, transport: Any, address: Address, now: float) -> None:
        self.transport, self.address, self.since = transport, address, now
        self.knows = False  # has logged in, or needs no login
        self.requests = 0  # requests in progress; an open WebSocket counts as one


class Places:
    """The open connections by the client's address and port."""

    def __init__(self, most: int = MOST, from_one: int = _FROM_ONE, idle: float = _IDLE):
        self._most, self._from_one, self._idle = most, from_one, idle
        self._places: dict[tuple[Any, ...], _Connection] = {}

    def __len__(self) -> int:
        return len(self._places)

    def admit(self, transport: Any, now: float) -> bool:
        """Whether a new connection may stay; an older one without login may be closed for it."""
        client = tuple((transport.get_extra_info("peername") or ("", 0))[:2])
        self._forget_closed()
        here = [each for each in self._places.values() if each.address == client[0]]
        for crowd, most in ((here, self._from_one), (list(self._places.values()), self._most)):
            if len(crowd) >= most and not self._closed_one(crowd):
                return False
        self._places[client] = _Connection(transport, client[0], now)
        return True

    def begin(self, client: Sequence[Any] | None, knows: bool) -> None:
        """A request of a client begins. `knows`: whether the client has logged in."""
        place = self._places.get(tuple(client or ())[:2])
        if place is not None:
            place.requests += 1
            place.knows |= knows

    def end(self, client: Sequence[Any] | None, now: float) -> None:
        """A request has ended."""
        place = self._places.get(tuple(client or ())[:2])
        if place is not None:
            place.requests -= 1
            place.since = now

    def close_idle(self, now: float) -> None:
        """Close the connections that have had no request for longer than `idle` s."""
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

    def _closed_one(self, crowd: list[_Connection]) -> bool:
        """Close the oldest of these connections without login; return whether there was one."""
        unknown = [each for each in crowd if not each.knows]
        if not unknown:
            return False
        oldest = min(unknown, key=lambda each: each.since)
        oldest.transport.abort()
        self._places = {client: each for client, each in self._places.items() if each is not oldest}
        return True

    def _forget_closed(self) -> None:
        self._places = {client: each for client, each in self._places.items() if not each.transport.is_closing()}


def protocol_with(places: Places, protocol: Any) -> type:
    """A protocol of the web server whose connections are admitted by `places`."""

    class Placed(protocol):  # type: ignore[misc]
        """Refuses a connection for which there is no place."""

        def connection_made(self, transport: Any) -> None:
            """See asyncio.Protocol."""
            super().connection_made(transport)
            if not places.admit(transport, asyncio.get_running_loop().time()):
                transport.abort()

    return Placed


COOKIE = "steerway_helm"
LOGIN = "/login"
_VALID = 30 * 86400  # duration of a login, s
_PATIENCE = 10.0  # longest duration of a request without login, s
_PAUSE = 1.0  # time after a wrong token before the same computer may try again, s
_REMEMBERED = 1000  # computers whose wrong tokens are remembered
_MOST_BYTES = 4096  # longest body of a login request
_HOST = re.compile(r"(?P<name>\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9._-]+)(:[0-9]{1,5})?")
_HTTP_OF = {"http": "http", "ws": "http", "https": "https", "wss": "https"}


class Sessions:
    """Logins that outlive a restart of the service: the cookie is its expiry time, signed with the token."""

    def __init__(self, token: str):
        self._token = token.encode()

    def is_token(self, text: str) -> bool:
        """Whether a text is the token, in constant time."""
        return hmac.compare_digest(hashlib.sha256(text.encode()).digest(), hashlib.sha256(self._token).digest())

    def cookie(self) -> str:
        """A new login."""
        return self._signed(int(time.time()) + _VALID)

    def knows(self, cookie: str) -> bool:
        """Whether a cookie was issued here and is valid."""
        expiry = cookie.partition(".")[0]
        if not (expiry.isascii() and expiry.isdigit() and len(expiry) < 16):
            return False
        return hmac.compare_digest(cookie.encode(), self._signed(int(expiry)).encode()) and int(expiry) > time.time()

    def _signed(self, expiry: int) -> str:
        return f"{expiry}.{hmac.new(self._token, f'helm {expiry}'.encode(), hashlib.sha256).hexdigest()}"


class Gate:
    """An ASGI application that passes permitted requests to another one."""

    def __init__(self, app: Any, address: Address, places: Places | None = None):
        self.app, self._address = app, address
        self._places = places or Places()
        self._sessions = None if address.token is None else Sessions(address.token)
        self._wrong: OrderedDict[str, float] = OrderedDict()  # earliest next attempt by computer, s

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """See ASGI."""
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        cookie = cookie_parser(headers.get("cookie", "")).get(COOKIE, "")
        knows = self._sessions is None or self._sessions.knows(cookie)
        client, loop = scope.get("client"), asyncio.get_running_loop()
        self._places.begin(client, knows and not is_foreign(scope, headers, self._address))
        try:
            async with asyncio.timeout(None if knows else _PATIENCE):
                await self._passed(scope, receive, send, headers, knows)
        except TimeoutError:
            if knows:
                raise
        finally:
            self._places.end(client, loop.time())

    async def _passed(self, scope: Scope, receive: Receive, send: Send, headers: Headers, knows: bool) -> None:
        if is_foreign(scope, headers, self._address):
            await _refuse(scope, receive, send, 403, "Only this page itself may send requests.")
        elif knows:
            if scope["path"] == LOGIN:
                await RedirectResponse("/", 303)(scope, receive, send)
                return
            await self.app(scope, receive, _guarded(send, headers["host"]))
        elif scope["type"] == "http" and scope["path"] == LOGIN:
            await self._login(scope, receive, _guarded(send, headers["host"]))
        elif scope["type"] == "http" and scope["method"] == "GET" and scope["path"] == "/":
            await RedirectResponse(LOGIN, 303)(scope, receive, send)
        else:
            await _refuse(scope, receive, send, 401, "Log in first.")

    async def _login(self, scope: Scope, receive: Receive, send: Send) -> None:
        request, sessions = Request(scope, receive), self._sessions or Sessions("")
        if request.method == "GET":
            await _login_page()(scope, receive, send)
        elif request.method != "POST":
            await _refuse(scope, receive, send, 405, "Expected GET or POST.")
        else:
            who = request.client.host if request.client else ""
            if self._must_wait(who):
                await _login_page("Too many attempts. Wait a second and try again.", 429)(scope, receive, send)
            elif sessions.is_token(await _token_in(request)):
                reply = RedirectResponse("/", 303)
                secure = (self._address.origin or "").startswith("https:")
                cookie = sessions.cookie()
                reply.set_cookie(COOKIE, cookie, _VALID, secure=secure, httponly=True, samesite="strict")
                await reply(scope, receive, send)
            else:
                await asyncio.sleep(_PAUSE)
                await _login_page("Wrong token.", 401)(scope, receive, send)

    def _must_wait(self, who: str) -> bool:
        """Whether this computer tried within the pause; every attempt starts a new pause."""
        now = time.monotonic()
        waits = self._wrong.pop(who, -1.0) > now
        self._wrong[who] = now + _PAUSE
        while len(self._wrong) > _REMEMBERED:
            self._wrong.popitem(last=False)
        return waits


def is_foreign(scope: Scope, headers: Headers, address: Address) -> bool:
    """Whether a request comes from another web page, or is addressed to a foreign name.

    A request that acts (POST, WebSocket) must have this page as its origin; a request that reads must not have another
    origin. A proxy passes on the host that browsers name, or its own name for this computer.
    """
    host = headers.get("host", "")
    match = _HOST.fullmatch(host)
    if match is None or len(headers.getlist("host")) > 1:
        return True
    named = address.origin is not None and host == address.origin.partition("://")[2]
    if address.is_loopback and not named and not is_loopback(match["name"].strip("[]")):
        return True
    origins = headers.getlist("origin")
    acts = scope["type"] == "websocket" or scope["method"] not in ("GET", "HEAD")
    own = (f"{_HTTP_OF[scope['scheme']]}://{host}", address.origin)
    return any(origin not in own for origin in origins) or (acts and len(origins) != 1)


async def _token_in(request: Request) -> str:
    body = b""
    async for piece in request.stream():
        body += piece
        if len(body) > _MOST_BYTES:
            return ""
    return parse_qs(body.decode(errors="replace")).get("token", [""])[0]


async def _refuse(scope: Scope, receive: Receive, send: Send, status: int, why: str) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": 1008})
    else:
        await PlainTextResponse(why, status)(scope, receive, send)


def _guarded(send: Send, host: str) -> Send:
    """Add response headers, so that the page loads nothing foreign and no other page frames it."""
    policy = (
        "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
        f"img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self' ws://{host} wss://{host}; "
        "frame-ancestors 'none'; form-action 'self'; base-uri 'self'"
    )

    async def guarded(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(raw=message.setdefault("headers", []))
            headers["Content-Security-Policy"] = policy
            headers["X-Frame-Options"] = "DENY"
            headers["X-Content-Type-Options"] = "nosniff"
            headers["Referrer-Policy"] = "same-origin"
        await send(message)

    return guarded


def _login_page(notice: str = "", status: int = 200) -> HTMLResponse:
    page = files("steerway.live.helm").joinpath("login.html").read_text(encoding="utf-8")
    return HTMLResponse(page.replace("NOTICE", escape(notice)), status, {"Cache-Control": "no-store"})
