"""The server for assistants: the SDK's client runs each tool, and hostile arguments end with a message."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any

import anyio
import pytest

pytest.importorskip("mcp")  # the extra 'agents'

from mcp import Client, StdioServerParameters
from mcp.client.stdio import stdio_client
from mcp.server.mcpserver.exceptions import ToolError

import epicycle
from epicycle.runner.interface.agents import LimitedCall
from epicycle.runner.interface.cli import main

MODEL = """model: line
actors:
  clock: {type: Clock, period: 1 s}
  count: {type: Ramp}
  heard: {type: Recorder}
connections: [clock.output -> count.trigger, count.output -> heard.input]
aspects: {lossy: {type: PacketLoss, probability: 0.5, at: heard.input}}
run: {stop: 20 s, seed: 1}
metrics: {sent: {of: count.output, take: count}}
monitors: {small: {property: "always count.output <= 5"}}
"""
TYPES = """
from epicycle.actors import Actor, OutputPort

class Mine(Actor):
    output = OutputPort(float, doc="nothing")
"""
PATIENCE = 120  # s for a call, which has limits of its own


class Assistant:
    """A client, and what it is told."""

    def __init__(self, client: Client) -> None:
        self.client = client

    async def raw(self, tool: str, **arguments: Any) -> Any:
        with anyio.fail_after(PATIENCE):
            return await self.client.call_tool(tool, arguments)

    async def told(self, tool: str, **arguments: Any) -> Any:
        """What a tool answers."""
        found = await self.raw(tool, **arguments)
        assert not found.is_error, found.content
        return json.loads(found.content[0].text)

    async def refused(self, tool: str, **arguments: Any) -> str:
        """The message of a tool that refuses."""
        found = await self.raw(tool, **arguments)
        assert found.is_error, found.content
        text: str = found.content[0].text
        assert "Traceback" not in text
        return text.removeprefix(f"Error executing tool {tool}: ")


@asynccontextmanager
async def assistant(folder: Path, *options: str) -> AsyncIterator[Assistant]:
    words = ["-m", "epicycle", "mcp", str(folder), *options]
    async with Client(stdio_client(StdioServerParameters(command=sys.executable, args=words))) as client:
        yield Assistant(client)


def dialogue(folder: Path, talk: Callable[[Assistant], Awaitable[None]], *options: str) -> None:
    failed: list[BaseException] = []

    async def held() -> None:
        async with assistant(folder, *options) as one:
            try:
                await talk(one)
            except (Exception, pytest.fail.Exception) as error:  # outside of the SDK's groups it can be read
                failed.append(error)

    anyio.run(held)
    for each in failed:
        raise each


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    made = tmp_path / "work"
    made.mkdir()
    (made / "line.yaml").write_text(MODEL, encoding="utf-8")
    return made


@pytest.mark.slow
def test_each_tool_answers(folder: Path) -> None:
    async def talk(one: Assistant) -> None:
        names = [each.name for each in (await one.client.list_tools()).tools]
        assert names == [
            "validate", "describe", "list", "run", "compare", "search", "explain", "diff", "what_if", "draw",
        ]  # fmt: skip
        assert await one.told("validate", model="line.yaml") == {"valid": True, "problems": [], "more": False}
        wrong = (await one.told("validate", model=MODEL.replace("Clock", "Clok")))["problems"]
        assert [(each["message"], each["file"], each["fix"]["text"]) for each in wrong[:1]] == [
            ("clock: there is no actor type 'Clok', did you mean 'Clock'?", "model.yaml", "Clock")
        ]
        assert [each["monitor"] for each in (await one.told("describe", model="line.yaml"))["monitors"]] == ["small"]
        assert (await one.told("describe", model="PacketLoss"))["kind"] == "aspect"
        assert "mm1" in (await one.told("list", what="models"))["models"]
        run = await one.told("run", model="line.yaml", set=["clock.period=2 s"], until="10 s")
        assert run["metrics"] == {"sent": 6, "small": 1.0, "small_robustness": 0.0}
        short = await one.told("run", model="line.yaml", max_tags=3)
        assert (short["stopped"], short["metrics"]["sent"]) == ("the program", 3)
        compared = await one.told("compare", model="line.yaml", vary=["clock.period=2"], replications=2)
        assert compared["seeds"] == [1, 2]
        assert (await one.told("search", model="line.yaml", runs=2))["broken"] == ["small"]
        found = await one.told("explain", model="line.yaml", monitor="always count.output <= 5", runs=3)
        assert "without any fault of an aspect" in found["sentence"]
        assert (await one.told("diff", before="line.yaml", after=MODEL.replace("0.5", "0.6")))["changes"][0][
            "after"
        ] == 0.6
        other = await one.told("what_if", model="line.yaml", at="5 s", change=["count.step=3"], lose=["heard.input"])
        assert other["first_firing"]["actor"] == "count"
        picture = (await one.raw("draw", model="line.yaml")).content[0]
        assert (picture.type, picture.mime_type) == ("image", "image/png")
        assert len(picture.data) > 2_000
        assert list(folder.iterdir()) == [folder / "line.yaml"]

    dialogue(folder, talk)


@pytest.mark.slow
def test_resources_are_the_language_the_reference_and_examples(folder: Path) -> None:
    async def talk(one: Assistant) -> None:
        async def read(uri: str) -> str:
            [content] = (await one.client.read_resource(uri)).contents
            text: str = content.text
            return text

        language = await read("epicycle://language")
        assert language.startswith("# The language of Epicycle")
        assert len(language.splitlines()) <= 200
        assert (await one.refused("run")) == "run needs model"
        assert (await one.refused("run", model="mm1", out="x")) == (
            "run takes no 'out': it takes model, seed, until, max_tags, set, disturb, aspect, without"
        )
        assert json.loads(await read("epicycle://reference/Clock"))["name"] == "Clock"
        assert "mm1" in (await read("epicycle://examples")).splitlines()
        assert "model: mm1" in await read("epicycle://examples/mm1")
        with pytest.raises(Exception, match="there is no packaged model 'mm2'"):
            await read("epicycle://examples/mm2")

    dialogue(folder, talk)


@pytest.mark.slow
def test_hostile_arguments_end_with_a_message(folder: Path, tmp_path: Path) -> None:
    secret = tmp_path / "secret.yaml"
    secret.write_text("token: 12345\n", encoding="utf-8")
    (folder / "link.yaml").symlink_to(secret)
    (folder / "epicycle.py").write_text("raise SystemExit('run')", encoding="utf-8")
    (folder / "mine.py").write_text(TYPES, encoding="utf-8")
    (folder / "results").mkdir()
    (folder / "results" / "manifest.json").write_text(
        json.dumps({"run": {"model": str(secret)}, "digest": ""}), encoding="utf-8"
    )
    (folder / "far.yaml").write_text(f"model: far\nextends: {secret}\n", encoding="utf-8")

    async def talk(one: Assistant) -> None:
        for name in (
            str(secret),
            "../secret.yaml",
            "link.yaml",
            "results",
            "results/../../secret.yaml",
            "no.yaml",
            "\0.yaml",
        ):
            assert await one.refused("run", model=name) == f"there is no file {name!r} in the folder of this server"
        assert await one.refused("run", model="mm1", disturb=["../secret.yaml"]) == (
            "there is no file '../secret.yaml' in the folder of this server"
        )
        for said in (
            await one.refused("run", model="far.yaml"),
            await one.refused("run", model=MODEL, aspect=[f"slow=ExecutionTime,times={secret},at=count"]),
            await one.refused("run", model=MODEL.replace("Recorder", "Mine")),
            await one.refused("run", model=MODEL, set=["types=mine.py"]),
            await one.refused("run", model="--types=mine.py"),
            await one.refused("run", model=MODEL, types=["mine.py"]),
            await one.refused("run", model=MODEL, set=["x\n--types=mine.py"]),
            await one.refused("run", model=MODEL, until="--types=mine.py"),
            await one.refused("run", model=3),
            await one.refused("run", model=MODEL, out="elsewhere"),
            await one.refused("run", model=MODEL, overrides=[str(secret)]),
            await one.refused("run", model=MODEL, set=[{"clock.period": 2}]),
            await one.refused("run", model=[MODEL, MODEL]),
            await one.refused("shell", command="id"),
            await one.refused("run", model=MODEL, seed=-1),
            await one.refused("run", model=MODEL, seed="x"),
            await one.refused("run", model=MODEL, until={"a": 1}),
            await one.refused("run", model="a" * 300_000),
            await one.refused("run", model="model: a\n" + "x" * 300_000),
            await one.refused("run", model="\n"),
            await one.refused("run", model=MODEL, set=[f"p{n}=1.0" for n in range(50_000)]),
            await one.refused("run", model=MODEL, set=["clock.period=\0"]),
            await one.refused("run", model="&a [*a]\n"),
            await one.refused("compare", model="mm1", replications=10**9),
            await one.refused("search", model="mm1", **{"break": "always ((("}),
            await one.refused("explain", model="mm1", monitor="nothing"),
            await one.refused("what_if", model="line.yaml", at="never"),
            await one.refused("what_if", model="line.yaml", at=1, lose=["no.port"]),
            await one.refused("draw", model="mm1", depth=-1),
            await one.refused("describe", model="NoSuchType"),
            await one.refused("list", what="files"),
            await one.refused("run"),
        ):
            assert said
            assert "12345" not in said
        assert "ended after 4 s" in await one.refused(
            "run", model=MODEL, until=9e8, max_tags=2_000_000, set=["clock.period=1 ns"]
        )
        many = MODEL.replace("{type: Recorder}", "{type: Recorder, count: 19000}").replace(
            "heard.input", '"heard[*].input"'
        )
        assert await one.refused("run", model=many)
        assert (await one.told("run", model="line.yaml"))["metrics"]["sent"] == 21  # it still answers

    dialogue(folder, talk, "--seconds", "4")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["\ud83d"], f"there is no file {chr(0xD83D)!r} in the folder of this server"),
        (["mm1", "\ud83d="], "the arguments are no text"),
        (["mm1", "--set=a=\0"], "the arguments are no text"),
        (["mm1", *["--set=load=0.5"] * 10_000], "the arguments have more than 100,000 characters"),
        (["a" * 5_000 + ".yaml"], f"there is no file {'a' * 200!r} in the folder of this server"),
    ],
)
def test_what_no_process_can_be_given(folder: Path, words: list[str], message: str) -> None:
    with pytest.raises(ToolError) as raised:
        LimitedCall(folder).call("run", words[:1], *words[1:])
    assert str(raised.value) == message


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_nothing_goes_on_after_its_time(folder: Path) -> None:
    endless = [
        "--until=9e8",
        "--set",
        "clock.period=1 us",
        "--vary=lossy.probability=0.1",
        "--vary=lossy.probability=0.2",
    ]
    with pytest.raises(ToolError) as raised:
        LimitedCall(folder, seconds=6.0).call("compare", ["line.yaml"], *endless)
    assert str(raised.value).startswith("it was ended after 6 s")
    assert Path.cwd() in places()
    since = time.monotonic()
    while folder.resolve() in places():  # its processes see that nobody is there any more
        assert time.monotonic() - since < 10.0
        time.sleep(0.05)


def places() -> list[Path]:
    """The working directories of all processes."""
    found = []
    for each in Path("/proc").glob("[0-9]*/cwd"):
        with suppress(OSError):
            found.append(each.readlink())
    return found


@pytest.mark.slow
def test_types_are_those_that_the_command_line_names(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(TYPES, encoding="utf-8")

    async def talk(one: Assistant) -> None:
        assert (await one.told("describe", model="Mine"))["name"] == "Mine"

    dialogue(folder, talk, "--types", str(tmp_path / "mine.py"))


LANGUAGE = Path("runner/interface/agents/language.md")


def test_the_language_names_only_what_there_is() -> None:
    from epicycle.actors import declared_parameters
    from epicycle.runner.model.catalogue.types import installed, load_all

    text, catalogue = LANGUAGE.read_text("utf-8"), installed()
    types, _ = load_all({**catalogue.actors, **catalogue.aspects})
    named = re.findall(r"`([A-Z][A-Za-z]+)(?: \{([^`]*)\})?`", text)
    assert len(named) == 38
    for name, parameters in named:
        assert name in types, name
        known = declared_parameters(types[name])
        assert {each.strip() for each in parameters.split(",") if parameters} <= known.keys(), name


def test_the_models_in_the_language_can_be_loaded(tmp_path: Path) -> None:
    blocks = re.findall(r"```yaml\n(.*?)```", LANGUAGE.read_text("utf-8"), re.DOTALL)
    assert len(blocks) == 3
    path = tmp_path / "model.yaml"
    path.write_text(blocks[0], encoding="utf-8")
    assert epicycle.run(path, progress=False).metrics["heard"] > 0
    path.write_text(f"model: stations\n{blocks[1]}", encoding="utf-8")
    assert "station[1].count" in epicycle.load(path).graph.actors


def test_llms_txt_leads_to_documents() -> None:
    docs = Path("docs")
    links = re.findall(r"\]\(([^)]+)\)", (docs / "llms.txt").read_text("utf-8"))
    assert len(links) > 15
    assert [each for each in links if not (docs / each).is_file()] == []


def test_the_command_refuses_what_it_cannot_serve(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["mcp", str(tmp_path / "nowhere")]) == 2
    assert capsys.readouterr().err == f"error: there is no folder {tmp_path / 'nowhere'}\n"
    with pytest.raises(SystemExit):
        main(["mcp", str(tmp_path), "--seconds", "0"])
    assert capsys.readouterr().err.splitlines()[-1] == (
        "epicycle mcp: error: argument --seconds: '0' is not a number of seconds greater than 0"
    )


@pytest.mark.parametrize("words", [["--help"], ["run", "--help"], ["run", "mm1", "--until", "1", "--json"]])
def test_other_commands_import_none_of_it(words: list[str]) -> None:
    program = (
        "import sys\nfrom epicycle.runner.interface.cli import main\n"
        "try:\n    main(sys.argv[1:])\nexcept SystemExit:\n    pass\n"
        "ours = ['interface.agents', 'search.what_if']\n"
        "ours = ['mcp', *('epicycle.runner.' + each for each in ours)]\n"
        "print([each for each in ours if each in sys.modules], file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", program, *words], capture_output=True, text=True, check=True)
    assert done.stderr.splitlines()[-1] == "[]"
