"""Who may talk to the server: whoever has the token, from the page that it served, by the name it was called.

Checked before every route and every socket. Without the right token nothing is told, not even that a route
exists. The host is checked so that no other site's name can be pointed here (DNS rebinding), the origin so
that no other site's page can use a token that it has got hold of.
"""

from __future__ import annotations

import hmac
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any

from starlette.datastructures import Headers
from starlette.responses import PlainTextResponse
from starlette.websockets import WebSocketClose

Scope = MutableMapping[str, Any]
App = Callable[[Scope, Callable[[], Awaitable[Any]], Callable[[Any], Awaitable[None]]], Awaitable[None]]

HEADERS = {
    "cache-control": "no-store",
    "referrer-policy": "no-referrer",
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "cross-origin-resource-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
}


class Guard:
    """hosts: what the Host header may say, as "127.0.0.1:8765"."""

    def __init__(self, app: App, token: str, hosts: frozenset[str]) -> None:
        self._app, self._token, self._hosts = app, token, hosts

    async def __call__(self, scope: Scope, receive: Any, send: Any) -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        if not self._allowed(scope):
            refuse: Any = PlainTextResponse("not found\n", 404, HEADERS)
            if scope["type"] == "websocket":
                refuse = WebSocketClose(1008)
            await refuse(scope, receive, send)
            return
        inner = dict(scope)
        inner["path"] = "/" + scope["path"].split("/", 2)[2]
        await self._app(inner, receive, send)

    def _allowed(self, scope: Scope) -> bool:
        headers = Headers(scope=scope)
        pieces = str(scope["path"]).split("/", 2)
        known = len(pieces) == 3 and hmac.compare_digest(pieces[1].encode(), self._token.encode())
        host, origin = headers.get("host", ""), headers.get("origin")
        own = origin in {f"http://{name}" for name in self._hosts}
        # Browsers name the origin of every socket and of whatever is not a plain GET.
        plain = scope["type"] == "http" and scope["method"] in ("GET", "HEAD")
        return known and host in self._hosts and (own or (origin is None and plain))
