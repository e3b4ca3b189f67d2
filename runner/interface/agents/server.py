"""The server of the Model Context Protocol: one tool for each command that looks at models."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import Annotated, Any, Literal

import anyio.to_thread
from mcp.server.mcpserver import Image, MCPServer
from mcp.server.mcpserver.exceptions import ResourceError
from mcp.server.mcpserver.exceptions import ToolError as Refusal
from pydantic import BaseModel, Field

from ...model.catalogue.packaged import packaged_models
from .limited import LimitedCall, ToolError

INSTRUCTIONS = """Epicycle simulates networks of actors. A model is YAML: read epicycle://language first, then write a
model, 'validate' it, apply its fixes, 'run' it. A model is named by its packaged name, by its path in the folder of the
server, or given as YAML text."""
_MODEL = "a packaged model, a file in the folder of this server, or the YAML text itself"

Model = Annotated[str, Field(description=_MODEL)]
Time = Annotated[float | str | None, Field(description="in s, or with a unit: '500 ms'")]
Seed = Annotated[int | None, Field(description="of all random streams (default: the model's)", ge=0)]
Number = Annotated[int, Field(ge=1, le=1000)]


class Changes(BaseModel, extra="forbid"):
    """What is changed in a model before it is run."""

    set: Annotated[dict[str, Any], Field(description="values of parameters, by path")] = {}
    disturb: Annotated[list[str], Field(description="packaged disturbances, or files")] = []
    aspects: Annotated[list[str], Field(description="such as 'loss=PacketLoss,probability=0.1,at=a.in'")] = []
    without_aspects: Annotated[list[str], Field(description="names of aspects that are removed")] = []


def make_server(call: LimitedCall, version: str) -> MCPServer:
    """The server whose tools run commands in one folder."""
    server = MCPServer("epicycle", instructions=INSTRUCTIONS, version=version, log_level="ERROR")

    async def facts(command: str, names: Sequence[str], *options: str, good: Sequence[int] = (0,)) -> str:
        def found() -> str:
            try:
                return json.dumps(call.facts(command, names, *options, good=good), indent=1, ensure_ascii=False)
            except ToolError as error:
                raise Refusal(str(error)) from None

        return await anyio.to_thread.run_sync(found)

    def changed(changes: Changes | None) -> list[str]:
        return _options(call, changes or Changes())

    @server.tool(structured_output=False)
    async def validate(model: Model, changes: Changes | None = None) -> str:
        """Everything that is wrong with a model: code, message, place, help, and where it is certain the change of text
        that removes it ('fix')."""
        return await facts("validate", [model], *changed(changes), good=(0, 2))

    @server.tool(structured_output=False)
    async def describe(name: Model, changes: Changes | None = None) -> str:
        """A model: parameters, metrics, monitors, aspects, disturbances that fit it. Or a type: its ports and
        parameters with units and defaults."""
        return await facts("describe", [name], *changed(changes))

    @server.tool(name="list", structured_output=False)
    async def list_(what: Literal["models", "actors", "aspects"]) -> str:
        """What there is: packaged models, disturbances and studies, or the types of actors or aspects."""
        return await facts("list", [what])

    @server.tool(structured_output=False)
    async def run(
        model: Model,
        changes: Changes | None = None,
        seed: Seed = None,
        until: Time = None,
        max_tags: Annotated[int, Field(ge=1, le=2_000_000)] = 200_000,
    ) -> str:
        """Run a model: metrics, monitors, counts of aspects, and the digest of the event log. A run that is not over
        after 'max_tags' tags ends there, 'stopped' by the program."""
        options = [*changed(changes), *_run(seed, until), f"--max-tags={max_tags}"]
        return await facts("run", [model], *options)

    @server.tool(structured_output=False)
    async def compare(
        model: Model,
        disturb: Annotated[list[str], Field(description="a variant for each; 'none' is the unchanged model")] = [],  # noqa: B006 (read only)
        vary: Annotated[list[str], Field(description="a variant for each, such as 'load=0.9,servers=2'")] = [],  # noqa: B006
        replications: Number = 10,
        changes: Changes | None = None,
        seed: Seed = None,
        until: Time = None,
    ) -> str:
        """Run variants of a model with the same seeds and compare their metrics in pairs, with intervals."""
        given = (changes or Changes()).model_copy(update={"disturb": []})  # here each is a variant
        options = [*changed(given), *_run(seed, until), *(f"--disturb={_inside(call, each)}" for each in disturb)]
        options += [*(f"--vary={each}" for each in vary), f"--replications={replications}", "--jobs=1", "--out={out}"]
        return await facts("compare", [model], *options)

    @server.tool(structured_output=False)
    async def search(
        model: Model,
        property: Annotated[
            str, Field(description="a monitor, or such as 'always server.size < 3'; empty: any monitor")
        ] = "",
        vary: Annotated[list[str], Field(description="ranges of parameters, such as 'load=0.5..0.9'")] = [],  # noqa: B006
        runs: Number = 100,
        max_faults: Annotated[int, Field(ge=0, le=3)] = 0,
        changes: Changes | None = None,
        seed: Seed = None,
        until: Time = None,
    ) -> str:
        """Search for a run that breaks a property, over seeds, parameters, or single faults of aspects."""
        options = [*changed(changes), *_run(seed, until), f"--break={property}", *(f"--vary={each}" for each in vary)]
        options += [f"--runs={runs}", "--jobs=1", "--out={out}"]
        options += [f"--max-faults={max_faults}"] if max_faults else []
        return await facts("search", [model], *options, good=(0, 1, 3))

    @server.tool(structured_output=False)
    async def explain(
        model: Model,
        monitor: Annotated[
            str, Field(description="a monitor, or a property; empty: the one that is broken first")
        ] = "",
        runs: Number = 200,
        changes: Changes | None = None,
        seed: Seed = None,
        until: Time = None,
    ) -> str:
        """The smallest set of faults (losses, delays, failures) that breaks a property of a run."""
        options = [*changed(changes), *_run(seed, until), *([f"--monitor={monitor}"] if monitor else [])]
        return await facts("explain", [model], *options, f"--runs={runs}", "--jobs=1", "--no-page", "--out={out}")

    @server.tool(structured_output=False)
    async def diff(before: Model, after: Model) -> str:
        """What differs between two models: actors, ports, connections, values, aspects and their places."""
        return await facts("diff", [before, after], good=(0, 1))

    @server.tool(structured_output=False)
    async def what_if(
        model: Model,
        at: Annotated[float | str, Field(description="the time or tag, such as '3.2 s' or '(3.2 s, 1)'")],
        change: Annotated[dict[str, Any], Field(description="new values of parameters, by path")] = {},  # noqa: B006
        remove: Annotated[list[str], Field(description="aspects that end")] = [],  # noqa: B006
        let_through: Annotated[
            list[str], Field(description="ASPECT or ASPECT@PLACE: its next fault does not happen")
        ] = [],  # noqa: B006
        lose: Annotated[list[str], Field(description="ports whose next token is lost")] = [],  # noqa: B006
        changes: Changes | None = None,
        seed: Seed = None,
        until: Time = None,
    ) -> str:
        """Change something from a tag of a run on: the first firing that changes, and what follows."""
        options = [
            *changed(changes),
            *_run(seed, until),
            f"--at={at}",
            *(f"--change={each}" for each in _settings(change)),
        ]
        for flag, names in (("--remove", remove), ("--let-through", let_through), ("--lose", lose)):
            options += [f"{flag}={each}" for each in names]
        return await facts("what-if", [model], *options, "--no-page", "--out={out}")

    @server.tool(structured_output=False)
    async def draw(
        model: Model, depth: Annotated[int | None, Field(ge=0, le=20)] = None, changes: Changes | None = None
    ) -> Image:
        """The graph of a model as a picture."""

        def drawn() -> bytes:
            options = [*changed(changes), *([] if depth is None else [f"--depth={depth}"])]
            try:
                return call.file("graph", [model], *options, name="graph.png")
            except ToolError as error:
                raise Refusal(str(error)) from None

        return Image(data=await anyio.to_thread.run_sync(drawn), format="png")

    @server.resource("epicycle://language", mime_type="text/markdown")
    def language() -> str:
        """The language of models in 200 lines."""
        return (files(__package__) / "language.md").read_text(encoding="utf-8")

    @server.resource("epicycle://reference/{name}", mime_type="application/json")
    async def reference(name: str) -> str:
        """Ports and parameters of a type of actors or aspects."""
        try:
            return await facts("describe", [name])
        except Refusal as error:
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


def _run(seed: int | None, until: float | str | None) -> list[str]:
    return [*([] if seed is None else [f"--seed={seed}"]), *([] if until is None else [f"--until={until}"])]


def _settings(values: Mapping[str, Any]) -> list[str]:
    return [f"{path}={each if isinstance(each, str) else json.dumps(each)}" for path, each in values.items()]


def _inside(call: LimitedCall, name: str) -> str:
    try:
        return call.inside(name)
    except ToolError as error:
        raise Refusal(str(error)) from None


def _options(call: LimitedCall, changes: Changes) -> list[str]:
    """The options of what is changed; files must be in the folder."""
    return [
        *(f"--set={each}" for each in _settings(changes.set)),
        *(f"--disturb={_inside(call, each)}" for each in changes.disturb),
        *(f"--aspect={each}" for each in changes.aspects),
        *(f"--without={each}" for each in changes.without_aspects),
    ]
