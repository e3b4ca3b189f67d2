"""A studio in a process of its own, and a browser that writes in it."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import httpx
from websockets.sync.client import ClientConnection, connect

PATIENCE = 60  # seconds
MODEL = """model: safe  # mine
actors:
  clock: {type: Clock, period: 1 s}
  gain: {type: Scale, factor: 2}
connections: [clock.output -> gain.input]
run: {stop: 10 s, record: gain.output}
metrics: {seen: {of: gain.output, take: count}}
"""


class Served(NamedTuple):
    """A studio: its address, that of its origin, and its process."""

    address: str
    origin: str
    process: subprocess.Popen[str]

    @property
    def socket(self) -> str:
        return self.address.replace("http", "ws", 1) + "socket"


@contextmanager
def served(model: Path, *options: str) -> Iterator[Served]:
    """A studio of a model; it must still be there in the end, and have complained of nothing."""
    command = [sys.executable, "-m", "epicycle", "studio", str(model), "--no-browser", *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=model.parent)
    assert process.stdout is not None
    found = re.search(r"(http://127\.0\.0\.1:\d+)/[\w-]{43}/", process.stdout.readline())
    assert found is not None
    try:
        for _ in range(200):
            try:
                httpx.get(found[0])
                break
            except httpx.ConnectError:
                continue
        yield Served(found[0], found[1], process)
        assert process.poll() is None
    finally:
        process.terminate()
        _, complaints = process.communicate(timeout=PATIENCE)
    assert complaints == "", complaints


class Asking:
    """A socket of a studio, as its page uses it."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.hello: dict[str, Any] = json.loads(socket.recv(PATIENCE))["hello"]
        self.count = 0

    def ask(self, **question: Any) -> dict[str, Any]:
        """The answer to a question, with what came before it."""
        self.count += 1
        self.socket.send(json.dumps({"id": self.count, **question}))
        found: dict[str, Any] = {}
        while not found.get("done"):
            said = json.loads(self.socket.recv(PATIENCE))
            if said["id"] == self.count:
                found |= said
        return {key: each for key, each in found.items() if key not in ("id", "done")}


@contextmanager
def asking(studio: Served) -> Iterator[Asking]:
    with connect(studio.socket, origin=studio.origin, max_size=None, open_timeout=PATIENCE) as socket:  # type: ignore[arg-type]
        yield Asking(socket)


class Writer:
    """Somebody at the page of a studio."""

    def __init__(self, tab: Any, said: list[str]) -> None:
        self.tab = tab
        self.said = said  # by the page, on its console

    def text(self) -> str:
        found: str = self.tab.evaluate("() => epicycle.studio.editor.text")
        return found

    def write(self, line: str) -> None:
        """Type a line; of what stands between «», only the part before | is typed, the rest is completed."""
        keys = self.tab.keyboard
        for typed, rest, plain in re.findall(r"«(.*?)\|(.*?)»|([^«»]+)", line):
            if plain:
                keys.type(plain)
                continue
            before = self.text()
            keys.type(typed)
            name = (typed.rpartition(".")[2].strip() + rest).removesuffix(": ")
            option = self.tab.locator(".cm-tooltip-autocomplete li[aria-selected] .cm-completionLabel")
            first = self.tab.locator(".cm-tooltip-autocomplete .cm-completionLabel").get_by_text(name, exact=True)
            first.first.wait_for(timeout=PATIENCE * 1000)
            for _ in range(40):
                if option.inner_text() == name:
                    break
                keys.press("ArrowDown")
            keys.press("Enter")
            assert self.text() == before + typed + rest

    def begin_line(self, indent: str) -> None:
        """A new line with an indentation, whatever the editor proposes."""
        self.tab.keyboard.press("Escape")
        self.tab.keyboard.press("Enter")
        while len(proposed := self.text().rpartition("\n")[2]) > len(indent):
            self.tab.keyboard.press("Backspace")
        self.tab.keyboard.type(indent[len(proposed) :])

    def until(self, condition: str, argument: Any = None) -> None:
        self.tab.wait_for_function(condition, arg=argument, timeout=PATIENCE * 1000)

    def until_run(self) -> dict[str, str]:
        """Wait for the run of what is written now; its metrics in words."""
        self.until("() => epicycle.studio.page.dataset.run === String(epicycle.studio.version)")
        rows = self.tab.locator(".figures tr").all()
        return {row.get_attribute("data-metric"): row.locator("td").first.inner_text() for row in rows}

    def drag(self, source: str, target: str) -> None:
        """Draw a line from port to port."""
        self.until("() => epicycle.studio.diagram.camera.scale")  # a new graph is painted first
        places = self.tab.evaluate(
            "(ports) => ports.map((name) => { const { diagram } = epicycle.studio, { camera } = diagram,"
            " port = diagram.ports.get(name), box = diagram.canvas.getBoundingClientRect();"
            " return [box.left + (port.x - camera.x) * camera.scale, box.top + (port.y - camera.y) * camera.scale]; })",
            [source, target],
        )
        mouse = self.tab.mouse
        mouse.move(*places[0])
        mouse.down()
        mouse.move(*places[1], steps=5)
        mouse.up()
