"""Who may ask: a plain ASGI layer around everything, websockets and uploads too.

A page of any website can send requests to programs on the reader's own machine. It does not know the token, so it gets
nothing; it does not have our name as its ``Host`` (a foreign name that was made to point here has its own), nor our
address as its ``Origin``, so it is refused even where the browser would send the cookie along.
"""

import hmac
import ipaddress
from collections.abc import Awaitable, Callable, Iterable, MutableMapping
from http.cookies import CookieError, SimpleCookie
from typing import Any, TypeAlias
from urllib.parse import parse_qs, urlsplit

__all__ = ["Guard"]

Scope: TypeAlias = MutableMapping[str, Any]
Receive: TypeAlias = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send: TypeAlias = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App: TypeAlias = Callable[[Scope, Receive, Send], Awaitable[None]]

LOCAL = ("127.0.0.1", "localhost", "::1")
POLICY = (
    "default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:; "  # Vue compiles templates in the browser
    "frame-ancestors 'none'; form-action 'self'; base-uri 'self'"
)
HEADERS = (
    (b"content-security-policy", POLICY.encode()),  # nothing is ever asked of another machine
    (b"referrer-policy", b"no-referrer"),
    (b"x-content-type-options", b"nosniff"),
)


class Guard:
    """Lets only requests through that know the token, for our own name, from our own page.

    Parameters
    ----------
    app : ASGI application
    token : str
    names : iterable of str
        By which this machine may be called, beside the local ones.
    any_address : bool
        Whether any numeric address will do as a name: nobody can make a foreign name of one.
    """

    def __init__(self, app: App, token: str, names: Iterable[str] = (), *, any_address: bool = False) -> None:
        self.app = app
        self.token = token
        self.names = {name.lower() for name in (*LOCAL, *names)}
        self.any_address = any_address

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on, or refuse with 403."""
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
            return
        headers = {key.decode("latin-1"): value.decode("latin-1") for key, value in scope["headers"]}
        host = headers.get("host", "")
        cookie = f"opencsp_calib_{scope['server'][1]}"  # cookies do not tell ports apart
        new = self._knows(parse_qs(scope["query_string"].decode("latin-1")).get("token", [""])[0])
        if not (self._is_ours(host) and _same_page(headers.get("origin"), host)):
            await _refuse(scope, send, "this address is not ours")
        elif not (new or self._knows(_cookie(headers.get("cookie", ""), cookie))):
            await _refuse(scope, send, "open the address that opencsp-calib gui printed, with its token")
        else:
            add = (b"set-cookie", f"{cookie}={self.token}; Path=/; HttpOnly; SameSite=Strict".encode()) if new else None
            await self.app(scope, receive, _with_headers(send, add))

    def _knows(self, token: str) -> bool:
        return hmac.compare_digest(token.encode(), self.token.encode())

    def _is_ours(self, host: str) -> bool:
        try:
            name = (urlsplit(f"//{host}").hostname or "").lower()
        except ValueError:
            return False
        return name in self.names or (self.any_address and _is_address(name))


def _same_page(origin: str | None, host: str) -> bool:
    """Whether a request comes from a page of ours, or from no page at all."""
    try:
        return origin is None or urlsplit(origin).netloc.lower() == host.lower()
    except ValueError:
        return False


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _cookie(header: str, name: str) -> str:
    try:
        found = SimpleCookie(header).get(name)
    except CookieError:
        return ""
    return found.value if found else ""


def _with_headers(send: Send, cookie: tuple[bytes, bytes] | None) -> Send:
    async def sending(message: MutableMapping[str, Any]) -> None:
        if message["type"] == "http.response.start":
            more = (*HEADERS, cookie) if cookie else HEADERS
            message["headers"] = [*message.get("headers", []), *more]
        await send(message)

    return sending


async def _refuse(scope: Scope, send: Send, why: str) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": 1008})  # before it is accepted: the server answers 403
        return
    body = f"403: {why}\n".encode()
    plain = [(b"content-type", b"text/plain; charset=utf-8"), (b"content-length", str(len(body)).encode())]
    await send({"type": "http.response.start", "status": 403, "headers": plain})
    await send({"type": "http.response.body", "body": body})
