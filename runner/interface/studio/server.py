"""Serves the page of one model to one browser on this machine: a page, its programs, and a socket.

Whoever knows the address may write the model's file and make runs, so the address holds a secret; and requests that a
page of somebody else could make a browser send are refused: ``Host`` and ``Origin`` must be those of the address.
"""

from __future__ import annotations

import asyncio
import hmac
import json
import secrets
from collections.abc import AsyncIterator, Callable, Coroutine, Mapping, MutableMapping, Sequence
from contextlib import asynccontextmanager, suppress
from functools import partial
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

from starlette.applications import Starlette
from starlette.datastructures import Headers
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from epicycle.actors import EpicycleError, read_regular

from ...model.text.document import MAX_BYTES
from ...show.view.page import PARTS, part, script
from ...show.view.recording import ViewError
from ...study.run.processes import Processes
from ...support.apart import DEAD, LATE
from ...support.files import replace_file
from .worker import Message, Worker

OWN = ("socket", "text", "wiring", "fields", "running", "what_if", "arrange")  # in this order
LONGEST = 2 * MAX_BYTES + 100_000  # bytes of a message, in which a character may take several
READING, GRACE = 30.0, 10.0  # s that reading a text may take, and that a run may take beyond its limit
START = 60.0  # s that a process may take until it listens
HEADERS = {
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}

Tell = Callable[[Message], Coroutine[Any, Any, None]]
Scope = MutableMapping[str, Any]


class Workers:
    """A process at a time, in which ``make`` makes what answers; of the questions that wait, only the latest of each
    kind is asked.

    With ``stops``, a question ends the one that is being answered.
    """

    def __init__(self, name: str, patience: float, make: Callable[[], Worker], *, stops: bool = False) -> None:
        self.name = name
        self.patience = patience  # s
        self.stops = stops
        self.processes = Processes(make, patience=START)
        self._turn = asyncio.Lock()
        self._latest: dict[str, Message] = {}

    async def ask(self, question: Message, tell: Tell) -> Message:
        """The answer; what comes before it goes to ``tell``.  A process that fails gives an answer that says so."""
        self._latest[str(question["ask"])] = question
        if self.stops:
            self.processes.hasten()
        # The turn ends with the answer, even if nobody waits for it any longer.
        return await asyncio.shield(asyncio.create_task(self._in_turn(question, tell)))

    async def _in_turn(self, question: Message, tell: Tell) -> Message:
        loop = asyncio.get_running_loop()

        def told(said: Message) -> None:
            asyncio.run_coroutine_threadsafe(tell(said), loop)

        async with self._turn:
            if self._latest.get(str(question["ask"])) is not question:
                return {"stale": True}
            try:
                what, answer = await asyncio.to_thread(self.processes.make, question, self.patience, told=told)
            except EpicycleError:
                what, answer = DEAD, None
        if what == LATE:
            answer = {"error": f"the {self.name} took longer than {self.patience:g} s, and was ended"}
        elif what == DEAD:
            answer = {"error": f"the {self.name} has died; it starts again with the next change"}
        return dict(answer)


class Document:
    """The file of a model: nothing else is ever written."""

    def __init__(self, path: Path) -> None:
        self.path = path.resolve()
        self.data = self._on_disk()
        if len(self.data) > MAX_BYTES:
            raise EpicycleError(f"{path} is larger than {MAX_BYTES // 1_000_000} MB")
        try:
            text = self.data.decode("utf-8")
        except UnicodeDecodeError as error:
            raise EpicycleError(f"{path} is not UTF-8 text: save it as UTF-8") from error
        # Browsers end lines with LF; where all others do it in another way, they get that back.
        self.has_crlf = "\r\n" in text and text.count("\r\n") == text.count("\n") == text.count("\r")
        self.text = text.replace("\r\n", "\n") if self.has_crlf else text

    def save(self, text: str, *, anyway: bool) -> Message:
        """Write the text, unless somebody else has written the file."""
        if self._on_disk() != self.data and not anyway:
            return {"conflict": f"{self.path.name} was changed by another program since it was read"}
        data = (text.replace("\n", "\r\n") if self.has_crlf else text).encode("utf-8")
        replace_file(self.path, data, ViewError)
        self.data = data
        return {"saved": True}

    def _on_disk(self) -> bytes:
        return read_regular(self.path) if self.path.exists() else b""


class Studio:
    """One model, its workers, and the browser that is connected."""

    def __init__(self, document: Document, seconds: float, events: int, types: Sequence[Path]) -> None:
        self.document = document
        make = partial(Worker.limited, document.path, seconds, events, [*map(str, types)])
        self.reading = Workers("reading of the text", READING, make)
        self.running = {
            "run": Workers("run", seconds + GRACE, make, stops=True),
            "what_if": Workers("what if", 3 * seconds + GRACE, make, stops=True),
        }
        self.token = secrets.token_urlsafe(32)
        self.nonce = secrets.token_urlsafe(16)
        self.hosts: frozenset[str] = frozenset()
        self._browser: WebSocket | None = None
        routes = [
            Route("/{token}/", self.page),
            Route("/{token}/{name}", self.file),
            WebSocketRoute("/{token}/socket", self.socket),
        ]
        self._app = Starlette(routes=routes, lifespan=self.working)

    def address(self, port: int) -> str:
        """The address for the browser; only this one is answered."""
        self.hosts = frozenset({f"127.0.0.1:{port}", f"localhost:{port}"})
        return f"http://127.0.0.1:{port}/{self.token}/"

    async def __call__(self, scope: Scope, receive: Any, send: Any) -> None:
        """Answers requests that come from its own page or from the address line only."""
        if scope["type"] not in ("http", "websocket") or self.is_welcome(scope):
            await self._app(scope, receive, send)
        elif scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})
        else:
            await PlainTextResponse("Not found", 404)(scope, receive, send)

    def is_welcome(self, scope: Scope) -> bool:
        """Whether a request has the secret, and comes from where it must."""
        headers = Headers(scope=scope)
        token = scope["path"].removeprefix("/").partition("/")[0].encode("utf-8", "surrogateescape")
        hosts, origins = headers.getlist("host"), headers.getlist("origin")
        if not hmac.compare_digest(token, self.token.encode()) or len(hosts) != 1 or hosts[0] not in self.hosts:
            return False
        if origins != [f"http://{hosts[0]}"] and (origins or scope["type"] == "websocket"):
            return False
        return headers.get("sec-fetch-site", "none") in ("none", "same-origin")

    # -- the page -------------------------------------------------------------------------------------------------

    async def page(self, request: Request) -> Response:
        host = request.headers["host"]
        policy = (
            f"default-src 'none'; script-src 'self'; style-src 'self' 'nonce-{self.nonce}'; img-src data:; "
            f"connect-src ws://{host}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
        )
        html = Template(_own("studio.html")).substitute(name=escape(self.document.path.name), nonce=self.nonce)
        return _response(html, "text/html", {"Content-Security-Policy": policy, "X-Frame-Options": "DENY"})

    async def file(self, request: Request) -> Response:
        match request.path_params["name"]:
            case "codemirror.js" as name:
                return _response(_own(name), "text/javascript")
            case "studio.js":
                parts = [*(part(f"{each}.js") for each in PARTS), *(_own(f"{each}.js") for each in OWN)]
                return _response(script(parts), "text/javascript")
            case "studio.css" as name:
                return _response(part("page.css") + _own(name), "text/css")
        return PlainTextResponse("Not found", 404)

    # -- the socket -----------------------------------------------------------------------------------------------

    async def socket(self, browser: WebSocket) -> None:
        """Questions of the page, each answered when its answer is there."""
        await browser.accept()
        before, self._browser = self._browser, browser
        if before is not None:
            await _close(before, "another tab has opened this model")
        document = self.document
        hello = {"text": document.text, "name": document.path.name, "is_new": not document.path.exists()}
        await browser.send_text(json.dumps({"hello": hello}))
        try:
            async with asyncio.TaskGroup() as answers:
                while True:
                    message = json.loads(await browser.receive_text())
                    if not isinstance(message, dict) or not isinstance(message.get("id"), int):
                        raise ValueError("not a question")
                    answers.create_task(self.answer(browser, message))
        except* WebSocketDisconnect:
            pass
        except* (ValueError, KeyError, RecursionError):
            await _close(browser, "this was not a question")
        finally:
            if self._browser is browser:
                self._browser = None

    async def answer(self, browser: WebSocket, message: Message) -> None:
        ask = str(message.get("ask"))

        async def tell(said: Message) -> None:
            with suppress(RuntimeError, WebSocketDisconnect):  # it has gone
                await browser.send_text(json.dumps({**said, "id": message["id"]}))

        if ask == "save":
            found = self.save(message)
        else:
            found = await self.running.get(ask, self.reading).ask({**message, "ask": ask}, tell)
        await tell({**found, "done": True})

    def save(self, message: Message) -> Message:
        text = message.get("text")
        if not isinstance(text, str) or len(text) > MAX_BYTES:
            return {"error": f"a text has at most {MAX_BYTES // 1_000_000} MB"}
        try:
            return self.document.save(text, anyway=message.get("anyway") is True)
        except (EpicycleError, OSError, UnicodeEncodeError) as error:
            return {"error": str(error)}

    @asynccontextmanager
    async def working(self, app: Starlette) -> AsyncIterator[None]:
        """While it serves, there are workers."""
        yield
        for each in (self.reading, *self.running.values()):
            each.processes.end()


def _own(name: str) -> str:
    """A file of the page's program or style."""
    return (files(__package__) / "browser" / name).read_text(encoding="utf-8")


def _response(text: str, kind: str, more: Mapping[str, str] | None = None) -> Response:
    return Response(text, media_type=kind, headers={**HEADERS, **(more or {})})


async def _close(browser: WebSocket, reason: str) -> None:
    with suppress(RuntimeError, WebSocketDisconnect):
        await browser.close(1000, reason)


def serve(studio: Studio, port: int, opened: Callable[[str], None]) -> None:
    """Serve until Ctrl-C, at a port (0: any) of this machine only; ``opened`` is called with the address."""
    import socket

    import uvicorn

    listening = socket.socket()
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind(("127.0.0.1", port))
    except OSError as error:
        raise EpicycleError(f"port {port} cannot be used: {error.strerror or error}") from error
    address = studio.address(listening.getsockname()[1])
    config = uvicorn.Config(
        studio,
        log_level="error",
        access_log=False,
        ws_max_size=LONGEST,
        ws_max_queue=64,
        limit_concurrency=32,
        server_header=False,
        timeout_graceful_shutdown=1,
        lifespan="on",
    )
    opened(address)
    uvicorn.Server(config).run(sockets=[listening])
