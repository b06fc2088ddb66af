"""Who may talk to the server: pages that it served itself, to a browser on this machine; and which files it may touch.

A page of another site that the same browser has open can send requests to 127.0.0.1, and a name that it owns can point
there. So the Host must be this server's, and the Origin, where a browser says one, too.
"""

from collections.abc import Awaitable, Callable, Iterable, MutableMapping
from pathlib import Path
from typing import Any

from barberpole.errors import InputError, must

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

LOOPBACK = ("127.0.0.1", "localhost", "[::1]")
REFUSED = "barberpole workbench answers only to its own pages on this machine.\n"
HEADERS = (
    (b"x-frame-options", b"DENY"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-resource-policy", b"same-origin"),
)


class Guard:
    """ASGI middleware: refuses other hosts and other origins, for pages, posts and web sockets alike."""

    def __init__(self, app: App, port: int):
        self._app = app
        self._hosts = {f"{name}:{port}" for name in LOOPBACK} | (set(LOOPBACK) if port == 80 else set())

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
        elif not self.allows(scope["headers"]):
            await _refuse(scope, receive, send)
        else:
            await self._app(scope, receive, _with_headers(send))

    def allows(self, headers: Iterable[tuple[bytes, bytes]]) -> bool:
        """Whether these request headers are of a page of this server."""
        found: dict[bytes, list[str]] = {}
        for name, value in headers:
            found.setdefault(name.lower(), []).append(value.decode("latin-1").lower())
        hosts, origins = found.get(b"host", []), found.get(b"origin", [])
        own = {f"http://{host}" for host in self._hosts}
        strange = found.get(b"sec-fetch-site", ["none"]) == ["cross-site"]
        navigated = found.get(b"sec-fetch-mode", [""]) == ["navigate"]
        return (
            len(hosts) == 1
            and hosts[0] in self._hosts
            and all(origin in own for origin in origins)
            and (navigated or not strange)
        )


async def _refuse(scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008})
        return
    await send({"type": "http.response.start", "status": 403, "headers": [(b"content-type", b"text/plain")]})
    await send({"type": "http.response.body", "body": REFUSED.encode()})


def _with_headers(send: Send) -> Send:
    async def adding(message: MutableMapping[str, Any]) -> None:
        if message["type"] == "http.response.start":
            message["headers"] = [*message.get("headers", []), *HEADERS]
        await send(message)

    return adding


def below(folder: Path, name: str, what: str = "the file") -> Path:
    """The path of `name` in the folder or one within. Raises InputError where it leads elsewhere, by links too."""
    root = folder.resolve()
    path = (root / name.replace("\0", "")).resolve()
    if not name.strip() or "\0" in name or path == root or not path.is_relative_to(root):
        raise InputError(must(what, f"within {root}", name or "nothing"))
    return path
