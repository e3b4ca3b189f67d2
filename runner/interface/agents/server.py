"""The server of the Model Context Protocol: its tools are commands, with the words and options that these declare."""

from __future__ import annotations

import argparse
import base64
from collections.abc import Iterator, Mapping
from importlib.resources import files
from typing import Any, NamedTuple

import anyio.to_thread
from mcp import types as mcp
from mcp.server.mcpserver import MCPServer
from mcp.server.mcpserver.exceptions import ResourceError, ToolError

from ...model.catalogue.packaged import packaged_models
from .limited import LimitedCall

INSTRUCTIONS = """Epicycle simulates networks of actors. A model is YAML: read epicycle://language first, then write a
model, 'validate' it, apply its fixes, 'run' it. A model is named by its packaged name, by its path in the folder of the
server, or given as YAML text."""
_FOLDER = "--out={out}"  # of the call, which goes with it


class Tool(NamedTuple):
    """A command, the options that an assistant may give it, and those that it gets before; ``good`` are exit codes."""

    command: str
    options: str = "set disturb aspect without"
    first: tuple[str, ...] = ()
    good: tuple[int, ...] = (0,)
    picture: str = ""  # its name, where the answer is one


_CHANGES = Tool("").options
_RUN = f"{_CHANGES} seed until"
TOOLS = {
    "validate": Tool("validate", good=(0, 2)),
    "describe": Tool("describe"),
    "list": Tool("list", ""),
    "run": Tool("run", f"{_RUN} max_tags", ("--max-tags=200000",)),
    "compare": Tool("compare", f"{_RUN} vary replications", ("--jobs=1", _FOLDER)),
    "search": Tool(
        "search", f"{_RUN} break vary runs max_faults", ("--jobs=1", _FOLDER, "--break=", "--runs=100"), (0, 1, 3)
    ),
    "explain": Tool("explain", f"{_RUN} monitor runs", ("--jobs=1", "--no-page", _FOLDER)),
    "diff": Tool("diff", good=(0, 1)),
    "what_if": Tool("what-if", f"{_RUN} at change remove let_through lose", ("--no-page", _FOLDER)),
    "draw": Tool("graph", f"{_CHANGES} depth", picture="graph.png"),
}


class Offered:
    """A tool as the command's own parser knows it."""

    def __init__(self, name: str, tool: Tool, parser: argparse.ArgumentParser) -> None:
        self.name, self.tool, self.said = name, tool, parser.description
        wanted, known = tool.options.split(), {_name(each): each for each in parser._actions}
        self.known = {name: each for name, each in known.items() if name in wanted or not each.option_strings}

    def described(self) -> mcp.Tool:
        properties = {name: _schema(each) for name, each in self.known.items()}
        required = [name for name, each in self.known.items() if each.required]
        schema = {"type": "object", "properties": properties, "required": required, "additionalProperties": False}
        return mcp.Tool(name=self.name, description=self.said, input_schema=schema)

    def words(self, call: LimitedCall, given: Mapping[str, Any]) -> tuple[list[str], list[str]]:
        """The models, or other names, and the options; raises ``ToolError``."""
        names, options = list[str](), list(self.tool.first)
        if missing := [name for name in self.described().input_schema["required"] if name not in given]:
            raise ToolError(f"{self.name} needs {', '.join(missing)}")
        for name, value in given.items():
            if (action := self.known.get(name)) is None:
                raise ToolError(f"{self.name} takes no {name!r}: it takes {', '.join(self.known)}")
            for each in _texts(name, value):
                if not action.option_strings:
                    names.append(each)
                else:
                    said = call.inside(each) if name == "disturb" else each
                    options.append(f"{action.option_strings[-1]}={said}")
        return names, options


def _name(action: argparse.Action) -> str:
    return "".join(action.option_strings[-1:]).removeprefix("--").replace("-", "_") or action.dest


def _schema(action: argparse.Action) -> dict[str, Any]:
    """What an option takes, for assistants."""
    words = " ".join((action.help or "").replace("; may be repeated", "").split())
    one: dict[str, Any] = {"type": "string" if isinstance(action, argparse._AppendAction) else ["string", "number"]}
    if action.choices is not None:
        one = {"enum": list(action.choices)}
    if isinstance(action, argparse._AppendAction):
        return {"type": "array", "items": one, "description": f"{words} ({action.metavar})"}
    if action.choices is None and not action.option_strings:
        words += "; or the text of a model itself"
    return {**one, "description": words}


def _texts(name: str, value: Any) -> Iterator[str]:
    for each in value if isinstance(value, list) else [value]:
        if isinstance(each, bool) or not isinstance(each, (str, int, float)):
            raise ToolError(f"{name}: expected a text or a number, or a list of them")
        yield str(each)


class Assisting(MCPServer):
    """The server whose tools run commands in one folder."""

    def __init__(self, call: LimitedCall, version: str, parsers: Mapping[str, argparse.ArgumentParser]) -> None:
        super().__init__("epicycle", instructions=INSTRUCTIONS, version=version, log_level="ERROR")
        self.call = call
        self.offered = {name: Offered(name, tool, parsers[tool.command]) for name, tool in TOOLS.items()}

    async def list_tools(self) -> list[mcp.Tool]:
        return [each.described() for each in self.offered.values()]

    async def call_tool(self, name: str, arguments: dict[str, Any], context: Any = None) -> mcp.CallToolResult:
        return mcp.CallToolResult(content=[await anyio.to_thread.run_sync(self._answer, name, arguments)])

    def _answer(self, name: str, given: Mapping[str, Any]) -> mcp.ContentBlock:
        if (chosen := self.offered.get(name)) is None:
            raise ToolError(f"there is no tool {name[:80]!r}: {', '.join(self.offered)}")
        tool, (names, options) = chosen.tool, chosen.words(self.call, given)
        found = self.call.call(tool.command, names, *options, good=tool.good, file=tool.picture)
        if tool.picture:
            return mcp.ImageContent(type="image", data=base64.b64encode(found).decode(), mime_type="image/png")
        return mcp.TextContent(type="text", text=found.decode())


def make_server(call: LimitedCall, version: str, parsers: Mapping[str, argparse.ArgumentParser]) -> MCPServer:
    """The server, with what it offers to read; ``parsers`` are those of the commands."""
    server = Assisting(call, version, parsers)

    @server.resource("epicycle://language", mime_type="text/markdown")
    def language() -> str:
        """The language of models in 200 lines."""
        return (files(__package__) / "language.md").read_text(encoding="utf-8")

    @server.resource("epicycle://reference/{name}", mime_type="application/json")
    async def reference(name: str) -> str:
        """Ports and parameters of a type of actors or aspects."""
        try:
            return (await anyio.to_thread.run_sync(call.call, "describe", [name])).decode()
        except ToolError as error:
            raise ResourceError(str(error)) from None

    @server.resource("epicycle://examples", mime_type="text/plain")
    def examples() -> str:
        """The names of the packaged models, whose texts are at epicycle://examples/NAME."""
        return "\n".join(packaged_models())

    @server.resource("epicycle://examples/{name}", mime_type="application/yaml")
    def example(name: str) -> str:
        """The text of a packaged model."""
        if name not in packaged_models():
            raise ResourceError(f"there is no packaged model {name[:80]!r}: {', '.join(packaged_models())}")
        return packaged_models()[name].read_text(encoding="utf-8")

    return server
