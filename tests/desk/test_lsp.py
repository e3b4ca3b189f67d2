"""``epicycle lsp``, asked by pygls' client: a scripted dialogue over a model of 300 lines, and random edits."""

from __future__ import annotations

import asyncio
import random  # noqa: TID251  no run depends on it
import re
import shutil
from collections.abc import Awaitable, Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from lsprotocol import types as lsp
from pygls.exceptions import JsonRpcException, JsonRpcInvalidParams

from epicycle.runner.desk.places import Positions
from epicycle.runner.model.build.load import load_model
from epicycle.runner.model.catalogue.packaged import packaged_models
from epicycle.runner.model.text.problems import ModelError, Problem
from tests.desk.desk_parts import MODELS, folder_with_model, place
from tests.desk.editor_parts import PATIENCE, Editor, edited, editor


def dialogue(talk: Callable[[Editor], Awaitable[None]]) -> None:
    async def run() -> None:
        async with editor() as found:
            await talk(found)

    asyncio.run(run())


def test_a_dialogue_over_a_model_of_300_lines(tmp_path: Path) -> None:
    path = folder_with_model(tmp_path)
    library = tmp_path / "robots" / "mobile_robot.yaml"
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) > 300

    async def talk(vim: Editor) -> None:
        client = vim.client
        assert await vim.write(path, text) == []

        # Complete: a port behind an actor that is a composite, in a line that is being written.
        before = "  - base.sent_plans -> news.input\n"
        changed = text.replace(before, f"{before}  - observer[0].\n")
        assert [each.code for each in await vim.write(path, changed)] == ["E0203"]
        asked = lsp.CompletionParams(**vim.at(path, *place(changed, "  - observer[0].", "\n")))
        items: Any = await client.text_document_completion_async(asked)
        assert {"role", "sent_plans", "estimate"} <= {each.label for each in items}
        await vim.write(path, text)

        # Hover: a parameter of a class, and an aspect with its places.
        hover: Any = await client.text_document_hover_async(
            lsp.HoverParams(**vim.at(path, *place(text, "shadow", "ing: 0")))
        )
        assert hover.contents.value.startswith("**shadowing**: parameter = `0` (line 30)")
        hover = await client.text_document_hover_async(lsp.HoverParams(**vim.at(path, *place(text, "  si", "ght:\n"))))
        assert hover.contents.value.endswith("at `main.sensor.measurement`, `base.sensor.measurement`, "
                                             "`observer[*].sensor.measurement`")  # fmt: skip

        # Definition: from a pointcut into the included file.
        sensor = vim.at(path, *place(text, 'at: "*.sen', 'sor.measurement"\n\nmonitors'))
        (found,) = await client.text_document_definition_async(lsp.DefinitionParams(**sensor))  # type: ignore[misc]
        assert found.uri == library.resolve().as_uri()

        # The include is a link.
        identifier = lsp.TextDocumentIdentifier(path.resolve().as_uri())
        (link,) = await client.text_document_document_link_async(lsp.DocumentLinkParams(identifier))  # type: ignore[misc]
        line = text.splitlines().index("include: robots/mobile_robot.yaml")
        assert (link.range, link.target) == (
            lsp.Range(lsp.Position(line, 9), lsp.Position(line, 33)),
            library.resolve().as_uri(),
        )

        # Rename over the include and the pointcuts; what is open and what is on disk.
        edit: Any = await client.text_document_rename_async(lsp.RenameParams(**sensor, new_name="eye"))
        assert set(edit.changes) == {path.resolve().as_uri(), library.resolve().as_uri()}
        renamed = edited(text, edit.changes[path.resolve().as_uri()])
        assert renamed.count("*.eye.measurement") == 2
        library.write_text(edited(library.read_text(), edit.changes[library.resolve().as_uri()]))
        assert await vim.write(path, renamed) == []
        with pytest.raises(JsonRpcException, match="'sen or' is not a name"):
            await client.text_document_rename_async(lsp.RenameParams(**sensor, new_name="sen or"))

        # Fix all problems.
        wrong = renamed
        for right, typo in (
            ("    type: Observer\n", "    type: Obsever\n"),
            ("stop: 40 s", "stp: 40 s"),
            ("take: max, unit", "take: max, unitt"),
            ("-> arrival.state", "-> arrival.sate"),
            ("correlation: 5 m", "corelation: 5 m"),
            ("range: ${sensor_range}", "range: ${sensor_rang}"),
            ("tolerance: 0.5 m}", "tolerance: 0.5 s}"),
        ):
            assert wrong.count(right) == 1
            wrong = wrong.replace(right, typo)
        codes = [each.code for each in await vim.write(path, wrong)]
        assert {"E0201", "E0301", "E0302", "E0305", "E0307", "E0401"} <= set(codes)
        while (found_ones := await vim.write(path, wrong)) and found_ones:
            (everything,) = [each for each in await vim.actions(path, wrong) if each.kind == "source.fixAll"]
            assert everything.edit is not None
            assert everything.edit.changes is not None
            before, wrong = wrong, edited(wrong, list(everything.edit.changes[path.resolve().as_uri()]))
            assert wrong != before
        assert wrong == renamed

        # The colours of names: the first one is a parameter.
        colours: Any = await client.text_document_semantic_tokens_full_async(
            lsp.SemanticTokensParams(lsp.TextDocumentIdentifier(path.resolve().as_uri()))
        )
        lines = renamed.splitlines()
        row, column, length, kind, _ = colours.data[:5]
        assert (lines[row][column : column + length] + ":", kind) == (lines[row].split()[0], 0)
        assert len(colours.data) // 5 > 100

        # The outline.
        symbols: Any = await client.text_document_document_symbol_async(
            lsp.DocumentSymbolParams(lsp.TextDocumentIdentifier(path.resolve().as_uri()))
        )
        assert "composites" in [each.name for each in symbols]

    dialogue(talk)


@pytest.mark.slow
def test_a_change_of_an_included_text_is_seen(tmp_path: Path) -> None:
    path = folder_with_model(tmp_path)
    library = tmp_path / "robots" / "mobile_robot.yaml"
    text, inside = path.read_text(encoding="utf-8"), library.read_text(encoding="utf-8")

    async def talk(vim: Editor) -> None:
        assert await vim.write(path, text) == []
        assert await vim.write(library, inside) == []
        told = vim.expect(path)
        await vim.write(library, inside.replace("  sensor:", "  senso:"))
        while not (found := await asyncio.wait_for(told, PATIENCE)):
            told = vim.expect(path)  # that was about the text before
        # They are in the other file.
        assert all(each.range.start.line == 0 or "mobile_robot" not in each.message for each in found)

    dialogue(talk)


@pytest.mark.slow
def test_a_file_of_others_is_left_alone(tmp_path: Path) -> None:
    async def talk(vim: Editor) -> None:
        assert await vim.write(tmp_path / "compose.yaml", "services: {web: {image: x}}\n") == []
        assert [each.code for each in await vim.write(tmp_path / "m.yaml", "model: 1x\n")] == ["E0204"]
        assert [each.code for each in await vim.write(tmp_path / "m.yaml", "modl: x\n")] == ["E0201"]

    dialogue(talk)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "utf-32"])
def test_places_are_counted_in_units_of_the_client(encoding: str) -> None:
    text = "a: é\r\nb: 😀 \u2028c: d\ne"
    positions, size = Positions(text, encoding), {"utf-8": 4, "utf-16": 2, "utf-32": 1}[encoding]
    assert positions.to_client(positions.offset(1, 4)) == (1, 3 + size)
    assert positions.to_client(positions.offset(2, 0)) == (1, 5 + size - 1 + {"utf-8": 3}.get(encoding, 1))
    for line, column in ((0, 0), (0, 4), (1, 3), (1, 4), (2, 0), (2, 3), (3, 1)):
        offset = positions.offset(line, column)
        assert positions.from_client(*positions.to_client(offset)) == offset
        assert positions.place(offset) == (line, column)
    marked = Positions("\ufeffa: b", encoding)
    assert marked.place(marked.from_client(0, {"utf-8": 3}.get(encoding, 1))) == (0, 0)


# -- random edits -----------------------------------------------------------------------------------------------------

_PIECES = (
    "{", "}", "[", "]", ":", ": ", ",", "-", "- ", "\n", "\n  ", "'", '"', "${", "#", "*", "**.", "->", "=>", "&a ",
    "!!x ", "type: Clock", "count: 3", "5 m", "0.1 s", "null", "true", "é", "😀", "\t", "at: x", "model: y", "<<: z",
)  # fmt: skip


def mutant(text: str, draw: random.Random) -> str:
    """A text after one random edit."""
    lines = text.split("\n")
    at, line = draw.randrange(len(text) + 1), draw.randrange(len(lines))
    match draw.randrange(7):
        case 0:
            return text[:at] + draw.choice(_PIECES) + text[at:]
        case 1:
            return text[:at] + text[at + draw.randrange(1, 8) :]
        case 2:
            return "\n".join([*lines[:line], *lines[line + 1 :]])
        case 3:
            return "\n".join([*lines[: line + 1], *lines[line:]])
        case 4:
            words = [*re.finditer(r"\w+|\Z", text)]
            one, other = draw.choice(words), draw.choice(words)
            return text[: one.start()] + other[0] + text[one.end() :]
        case 5:
            return text[:at]
        case _:
            return text[:at] + text[at + 1 : at + 2] + text[at : at + 1] + text[at + 2 :]


def validated(path: Path) -> list[Problem]:
    """What a fresh validation says."""
    try:
        return [*load_model(path).warnings]
    except ModelError as error:
        return [*error.problems]


def expected(problem: Problem, path: Path, text: str) -> tuple[str, str, int, int]:
    """A problem as an editor shows it: its code, text, and where it begins."""
    message, at = "\n".join([problem.message, *(f"help: {each}" for each in problem.help)]), problem.position
    if at is None or at.file != str(path):
        return problem.kind.code, f"{at}: {message}" if at else message, 0, 0
    line, before, lines = at.line - 1, at.source[: at.column - 1], text.split("\n")
    if line >= len(lines):  # behind the end
        line, before = len(lines) - 1, lines[-1]
    return problem.kind.code, message, line, len(before.encode("utf-16-le", "surrogatepass")) // 2


def edit_at_random(folder: Path, number: int, seed: int) -> None:
    shutil.copytree(MODELS, folder / "models")
    draw, names = random.Random(seed), sorted(packaged_models())

    async def talk(vim: Editor) -> None:
        text, path = "", folder
        for count in range(number):
            if count % 5 == 0:  # otherwise, another edit of what is wrong already
                path = (folder / "models" / f"{draw.choice(names)}.yaml").resolve()
                text = (MODELS / path.name).read_text(encoding="utf-8")
                await vim.write(path, text)
            text = mutant(text, draw) or "model: m"
            path.write_text(text, encoding="utf-8")
            # The server reads the text while this process validates the file.
            found, valid = await asyncio.gather(vim.write(path, text), asyncio.to_thread(validated, path))
            path.write_text((MODELS / path.name).read_text(encoding="utf-8"), encoding="utf-8")
            errors = [each for each in found if each.severity == lsp.DiagnosticSeverity.Error] or found
            told = [(each.code, each.message, each.range.start.line, each.range.start.character) for each in errors]
            assert told == [expected(each, path, text) for each in valid], f"edit {count}: {text}"
            if count % 3:
                continue
            lines = text.split("\n")
            line = draw.randrange(len(lines))
            await ask(vim, vim.at(path, line, draw.randrange(len(lines[line]) + 1)), path, text)

    dialogue(talk)


async def ask(vim: Editor, at: dict[str, Any], path: Path, text: str) -> None:
    """Everything that can be asked about a place: no answer is an error, but for a name that cannot be changed."""
    client = vim.client
    await client.text_document_completion_async(lsp.CompletionParams(**at))
    await client.text_document_hover_async(lsp.HoverParams(**at))
    await client.text_document_definition_async(lsp.DefinitionParams(**at))
    await client.text_document_references_async(lsp.ReferenceParams(**at, context=lsp.ReferenceContext(True)))
    await client.text_document_document_symbol_async(lsp.DocumentSymbolParams(at["text_document"]))
    await client.text_document_document_link_async(lsp.DocumentLinkParams(at["text_document"]))
    await client.text_document_semantic_tokens_full_async(lsp.SemanticTokensParams(at["text_document"]))
    await client.text_document_prepare_rename_async(lsp.PrepareRenameParams(**at))
    await vim.actions(path, text)
    with suppress(JsonRpcInvalidParams):
        await client.text_document_rename_async(lsp.RenameParams(**at, new_name="another"))


@pytest.mark.slow
def test_random_edits(tmp_path: Path) -> None:
    edit_at_random(tmp_path, 2_000, seed=1)


def test_a_few_random_edits(tmp_path: Path) -> None:
    edit_at_random(tmp_path, 6, seed=2)
