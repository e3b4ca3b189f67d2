"""What a hostile page, name or model can do to a studio: nothing."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from tests.studio.studio_parts import MODEL, PATIENCE, Served, Writer, asking, served

# -- who is answered --------------------------------------------------------------------------------------------------


def test_the_page_and_its_parts_are_served_with_a_policy(studio_at: tuple[Served, Path]) -> None:
    studio, _ = studio_at
    page = httpx.get(studio.address)
    host = studio.origin.removeprefix("http://")
    nonce = page.text.partition('data-nonce="')[2].partition('"')[0]
    assert page.status_code == 200
    assert page.headers["content-security-policy"] == (
        f"default-src 'none'; script-src 'self'; style-src 'self' 'nonce-{nonce}'; img-src data:; "
        f"connect-src ws://{host}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
    assert page.headers["x-frame-options"] == "DENY"
    for name, kind in (
        ("studio.js", "text/javascript"),
        ("studio.css", "text/css"),
        ("codemirror.js", "text/javascript"),
    ):
        part = httpx.get(studio.address + name)
        assert (part.status_code, part.headers["content-type"]) == (200, f"{kind}; charset=utf-8")
        for header, value in (
            ("cache-control", "no-store"),
            ("cross-origin-resource-policy", "same-origin"),
            ("referrer-policy", "no-referrer"),
            ("x-content-type-options", "nosniff"),
        ):
            assert part.headers[header] == value


FOREIGN: dict[str, Callable[[str, str], tuple[str, dict[str, str]]]] = {
    "no secret": lambda origin, address: (f"{origin}/", {}),
    "another secret": lambda origin, address: (f"{origin}/{'x' * 43}/", {}),
    "part of the secret": lambda origin, address: (address[:-2] + "/", {}),
    "another host": lambda origin, address: (address, {"Host": "evil.example"}),
    "a host that leads here": lambda origin, address: (
        address,
        {"Host": origin.removeprefix("http://") + ".evil.example"},
    ),
    "another port": lambda origin, address: (address, {"Host": "127.0.0.1:1"}),
    "another origin": lambda origin, address: (address, {"Origin": "http://evil.example"}),
    "no origin": lambda origin, address: (address, {"Origin": "null"}),
    "an origin of another kind": lambda origin, address: (address, {"Origin": origin.replace("http", "https")}),
    "a page elsewhere": lambda origin, address: (address, {"Sec-Fetch-Site": "cross-site"}),
    "a page of a neighbour": lambda origin, address: (address, {"Sec-Fetch-Site": "same-site"}),
}


@pytest.mark.parametrize("name", FOREIGN)
def test_a_foreign_request_finds_nothing(name: str, studio_at: tuple[Served, Path]) -> None:
    studio, _ = studio_at
    address, headers = FOREIGN[name](studio.origin, studio.address)
    found = httpx.get(address, headers=headers)
    assert (found.status_code, found.text) == (404, "Not found")
    assert httpx.get(address + "studio.js", headers=headers).status_code == 404
    given = {"Host": studio.origin.removeprefix("http://"), "Origin": studio.origin, **headers}
    assert _handshake(studio, address, given) == 403


def test_the_handshake_of_the_page_is_accepted(studio_at: tuple[Served, Path]) -> None:
    studio, _ = studio_at
    given = {"Host": studio.origin.removeprefix("http://"), "Origin": studio.origin}
    assert _handshake(studio, studio.address, given) == 101


def _handshake(studio: Served, address: str, headers: dict[str, str]) -> int:
    """The status with which a socket is opened, for any headers: client libraries choose Host themselves."""
    path = address.removeprefix(studio.origin)
    lines = [f"GET {path}socket HTTP/1.1", *(f"{name}: {value}" for name, value in headers.items())]
    lines += ["Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13"]
    lines += ["Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==", "", ""]
    with socket.create_connection(("127.0.0.1", int(studio.origin.rpartition(":")[2])), timeout=PATIENCE) as raw:
        raw.sendall("\r\n".join(lines).encode())
        return int(raw.recv(4096).split()[1])


def test_a_request_without_a_path_finds_nothing(studio_at: tuple[Served, Path]) -> None:
    studio, _ = studio_at
    host = studio.origin.removeprefix("http://")
    for line in ("GET * HTTP/1.1", "OPTIONS * HTTP/1.1", "GET //x/ HTTP/1.1", "GET http://evil.example/ HTTP/1.1"):
        with socket.create_connection(("127.0.0.1", int(host.rpartition(":")[2])), timeout=PATIENCE) as raw:
            raw.sendall(f"{line}\r\nHost: {host}\r\n\r\n".encode())
            assert raw.recv(4096).split()[1] == b"404"


def test_a_socket_without_an_origin_is_refused(studio_at: tuple[Served, Path]) -> None:
    with pytest.raises(InvalidStatus) as refused:
        connect(studio_at[0].socket)
    assert refused.value.response.status_code == 403


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS"])
def test_nothing_is_sent_to_the_page(method: str, studio_at: tuple[Served, Path]) -> None:
    found = httpx.request(method, studio_at[0].address, content=b"x" * 10)
    assert found.status_code == 405
    assert "access-control-allow-origin" not in found.headers


@pytest.mark.parametrize(
    "name", ["../safe.yaml", "%2e%2e/safe.yaml", "..%2fsafe.yaml", "safe.yaml", "server.py", "/etc/passwd"]
)
def test_no_other_file_is_served(name: str, studio_at: tuple[Served, Path]) -> None:
    assert httpx.get(studio_at[0].address + name).status_code == 404


def test_it_listens_on_this_machine_only(studio_at: tuple[Served, Path]) -> None:
    port = int(studio_at[0].origin.rpartition(":")[2])
    others = {each[4][0] for each in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)} - {"127.0.0.1"}
    for address in others:
        with pytest.raises(OSError, match="refused"):
            socket.create_connection((str(address), port), timeout=5)
    with socket.socket() as another:  # the port is free at all other addresses
        another.bind(("127.0.0.2", port))


# -- what is answered -------------------------------------------------------------------------------------------------

COMPLETION, HOVER, RENAME = "textDocument/completion", "textDocument/hover", "textDocument/rename"
OTHER = {"textDocument": {"uri": "file:///etc/passwd"}}


def place(line: int) -> dict[str, int]:
    return {"line": line, "character": 5}


ODD: dict[str, Any] = {
    "no question": {"id": 1},
    "another question": {"id": 1, "ask": "shell", "text": "", "command": "id"},
    "a method of a worker": {"id": 1, "ask": "answer", "text": ""},
    "no text": {"id": 1, "ask": "read"},
    "a text that is none": {"id": 1, "ask": "read", "text": [1]},
    "a place that is none": {"id": 1, "ask": COMPLETION, "text": MODEL, "params": {"position": "x"}},
    "no parameters": {"id": 1, "ask": COMPLETION, "text": MODEL},
    "parameters that are none": {"id": 1, "ask": COMPLETION, "text": MODEL, "params": [1]},
    "a place far away": {"id": 1, "ask": HOVER, "text": MODEL, "params": {"position": place(10**30)}},
    "a place behind": {"id": 1, "ask": HOVER, "text": MODEL, "params": {"position": place(10**9)}},
    "a place before": {"id": 1, "ask": COMPLETION, "text": MODEL, "params": {"position": place(-5)}},
    "a name that is none": {"id": 1, "ask": RENAME, "text": MODEL, "params": {"position": place(3), "newName": "<b>"}},
    "a text of somebody else": {"id": 1, "ask": HOVER, "text": MODEL, "params": {"position": place(3), **OTHER}},
    "a request for more": {"id": 1, "ask": "workspace/executeCommand", "text": MODEL, "params": {"command": "id"}},
    "a question that is a list": {"id": 1, "ask": ["read"], "text": MODEL},
    "no change": {"id": 1, "ask": "edit", "text": MODEL, "what": "data_of", "given": []},
    "a change of nothing": {"id": 1, "ask": "edit", "text": MODEL, "what": "connect", "given": []},
    "a change with too much": {"id": 1, "ask": "edit", "text": MODEL, "what": "switch", "given": ["a"] * 9},
    "a save of nothing": {"id": 1, "ask": "save"},
    "a save of half a character": {"id": 1, "ask": "save", "text": "\ud800"},
    "a read of half a character": {"id": 1, "ask": "read", "text": "model: \ud800"},
    "fields of nothing": {"id": 1, "ask": "fields", "text": MODEL, "path": "a.b.c"},
    "another path": {"id": 1, "ask": "save", "text": MODEL, "path": "/elsewhere/other.yaml", "name": "../other.yaml"},
}


@pytest.mark.parametrize("name", ODD)
def test_an_odd_question_is_answered_in_words(name: str, studio_at: tuple[Served, Path]) -> None:
    studio, path = studio_at
    with asking(studio) as page:
        found = page.ask(**{key: each for key, each in ODD[name].items() if key != "id"})
        assert found.keys() & {"error", "result", "saved", "problems"}
        assert "root:" not in str(found)
        assert "Traceback" not in str(found)
        assert page.ask(ask="read", text=MODEL)["valid"] is True
    assert path.read_text() == MODEL
    assert [each.name for each in path.parent.iterdir()] == [path.name]


@pytest.mark.parametrize("said", ["{", "[]", "1", "null", '"x"', '{"id": "x"}', "[" * 100_000])
def test_what_is_no_question_ends_the_socket_only(said: str, studio_at: tuple[Served, Path]) -> None:
    studio, _ = studio_at
    with connect(studio.socket, origin=studio.origin) as page:  # type: ignore[arg-type]
        page.recv(PATIENCE)
        page.send(said)
        with pytest.raises(ConnectionClosed, match="this was not a question"):
            page.recv(PATIENCE)
    with asking(studio) as again:
        assert again.ask(ask="read", text=MODEL)["valid"] is True


@pytest.mark.slow
def test_a_message_that_is_too_large_ends_the_socket_only(studio_at: tuple[Served, Path]) -> None:
    studio, _ = studio_at
    with connect(studio.socket, origin=studio.origin) as page:  # type: ignore[arg-type]
        page.recv(PATIENCE)
        page.send(json.dumps({"id": 1, "ask": "read", "text": "x" * 21_000_000}))
        with pytest.raises(ConnectionClosed):
            page.recv(PATIENCE)
    with asking(studio) as again:
        assert again.ask(ask="read", text="x" * 10_000_001) == {"error": "a text has at most 10 MB"}


@pytest.mark.slow
def test_a_model_reads_no_other_file_and_runs_no_code(studio_at: tuple[Served, Path], tmp_path: Path) -> None:
    secret, mark = tmp_path / "secret.yaml", tmp_path / "mark"
    secret.write_text("composites: {Secret: {actors: {hidden: {type: Clock, period: 1 s}}}}\n")
    (tmp_path / "evil.py").write_text(f"open({str(mark)!r}, 'w')\n")
    hostile = (
        f"include: {secret}\n",
        f"include: ../{tmp_path.name}/secret.yaml\n",
        "include: ../../../../../../etc/passwd\n",
        f"extends: {secret}\n",
        f"actors: {{a: {{type: '{tmp_path}/evil.py:A'}}}}\n",
        "actors: {a: {type: '!!python/object/apply:os.system'}}\n",
        f"x: !!python/object/apply:os.system ['touch {mark}']\n",
        f"parameters: {{a: \"${{__import__('os').system('touch {mark}')}}\"}}\n",
        f"actors: {{a: {{type: Process, command: 'touch {mark}'}}}}\n",
        f"actors: {{a: {{type: FMU, file: '{secret}'}}}}\n",
    )
    with asking(studio_at[0]) as page:
        for lines in hostile:
            text = (
                MODEL + lines if not lines.startswith(("actors", "extends")) else "model: x\nrun: {stop: 1 s}\n" + lines
            )
            found = page.ask(ask="read", text=text)
            assert found["valid"] is False
            assert "hidden" not in json.dumps(found)
            assert page.ask(ask="run", text=text) == {"error": "the model is not valid"}
    assert not mark.exists()


# -- the file ---------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_file_that_somebody_else_has_written_is_not_overwritten_unasked(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_bytes(MODEL.replace("\n", "\r\n").encode())
    with served(path) as studio, asking(studio) as page:
        assert page.hello == {"text": MODEL, "name": "mine.yaml", "is_new": False}
        new = MODEL.replace("10 s", "20 s")
        assert page.ask(ask="save", text=new) == {"saved": True}
        assert path.read_bytes() == new.replace("\n", "\r\n").encode()
        path.write_text("model: other\n")
        assert page.ask(ask="save", text=MODEL) == {
            "conflict": "mine.yaml was changed by another program since it was read"
        }
        assert path.read_text() == "model: other\n"
        assert page.ask(ask="save", text=MODEL, anyway=True) == {"saved": True}
        assert path.read_bytes() == MODEL.replace("\n", "\r\n").encode()


def test_another_tab_takes_over(studio_at: tuple[Served, Path]) -> None:
    studio, _ = studio_at
    with asking(studio) as first, asking(studio) as second:
        with pytest.raises(ConnectionClosed, match="another tab has opened this model"):
            first.socket.recv(PATIENCE)
        assert second.ask(ask="read", text=MODEL)["valid"] is True


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["none/x.yaml"], "error: there is no folder none"),
        (["collision_avoidance"], "error: collision_avoidance is no file of a model: its name ends with .yaml"),
        (
            ["x.yaml", "--seconds", "0"],
            "epicycle studio: error: argument --seconds: '0' is not a number of seconds greater than 0",
        ),
        (["bad.yaml"], "error: bad.yaml is not UTF-8 text: save it as UTF-8"),
    ],
)
def test_what_cannot_be_opened_is_said(arguments: list[str], message: str, tmp_path: Path) -> None:
    (tmp_path / "bad.yaml").write_bytes(b"\xff")
    command = [sys.executable, "-m", "epicycle", "studio", "--no-browser", *arguments]
    found = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False, timeout=PATIENCE)
    assert (found.returncode, found.stdout, found.stderr.splitlines()[-1]) == (2, "", message)


# -- names and docs ---------------------------------------------------------------------------------------------------

TAG = "<img src=x onerror=alert(1)><script>alert(2)</script>"
INJECTING = f"""model: "{TAG}"
doc: "{TAG}"
parameters: {{loss: {{value: 0.1, min: 0, max: 1, doc: "{TAG}"}}}}
actors:
  clock: {{type: Clock, period: 1 s, values: ["{TAG}"]}}
  "{TAG}": {{type: Clock, period: 1 s}}
  gain: {{type: "{TAG}"}}
  sink: {{type: Merge}}
connections: [clock.output -> sink.input]
aspects:
  lossy: {{type: PacketLoss, probability: "${{loss}}", at: "sink.input"}}
  "{TAG}": {{type: "{TAG}", at: "{TAG}"}}
run: {{stop: 10 s, record: sink.output}}
metrics: {{seen: {{of: sink.output, take: count, doc: "{TAG}"}}, "{TAG}": {{of: sink.output, take: count}}}}
"""


@pytest.mark.slow
def test_names_and_docs_are_text_on_the_page(studio: Callable[..., Writer], tmp_path: Path) -> None:
    path = tmp_path / "injecting.yaml"
    path.write_text(INJECTING)
    writer = studio(path)
    tab = writer.tab
    writer.until("() => epicycle.studio.page.dataset.read === '0' && document.querySelectorAll('.problems li').length")
    assert TAG in tab.locator(".problems").inner_text()
    assert TAG in tab.locator(".side").inner_text()
    # What is valid of it runs, and is shown in all views.
    kept = [line for line in INJECTING.splitlines() if not line.startswith((f'  "{TAG}"', "  gain", "model"))]
    valid = "\n".join(["model: x", *kept]).replace(f', "{TAG}": {{of: sink.output, take: count}}', "")
    tab.evaluate(
        "(newText) => epicycle.studio.editor.write([{ range: { start: { line: 0, character: 0 },"
        " end: { line: 1e6, character: 0 } }, newText }])",
        valid,
    )
    writer.until_run()
    for view in ("signals", "sequence", "details"):
        tab.locator(f".tabs [data-view={view}]").click()
    assert TAG in tab.locator(".details").inner_text()
    chosen = "epicycle.studio.diagram.chosen = { path: 'clock', kind: '<b>', doc: '<b>' }"
    tab.evaluate(f"() => epicycle.studio.showChosen({chosen})")
    tab.locator(".chosen .row").first.wait_for()
    tab.locator(".name-parameter").first.hover()
    tab.locator(".described").wait_for()
    assert TAG in tab.locator(".described").inner_text()
    assert tab.locator("img, script:not([src]), b b").count() == 0


@pytest.mark.slow
def test_a_policy_forbids_what_would_get_in_nevertheless(studio: Callable[..., Writer], tmp_path: Path) -> None:
    writer = studio(tmp_path / "new.yaml")
    found = writer.tab.evaluate(
        """() => new Promise((done) => {
          const found = [];
          document.addEventListener("securitypolicyviolation", (event) => found.push(event.effectiveDirective));
          const script = document.createElement("script");
          script.textContent = "window.got = 1";
          document.body.append(script);
          fetch("http://127.0.0.1:1/").catch(() => found.push("fetch failed"));
          setTimeout(() => done([found.sort(), window.got ?? null]), 500);
        })"""
    )
    assert found == [["connect-src", "fetch failed", "script-src-elem"], None]
    assert len(writer.said) == 3
    assert all("violates the following Content Security Policy directive" in each for each in writer.said[:2])
    writer.said.clear()
