"""An editor without a display: pygls' client, and a server in a process of its own."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

from lsprotocol import types as lsp
from pygls.lsp.client import LanguageClient

PATIENCE = 60  # seconds


class Editor:
    """Texts as an editor has them, and what the server says about them."""

    def __init__(self, client: LanguageClient) -> None:
        self.client = client
        self.texts: dict[str, str] = {}
        self._versions: dict[str, int] = {}
        self._told: dict[str, asyncio.Future[list[lsp.Diagnostic]]] = {}
        self.log: list[str] = []

        @client.feature(lsp.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)
        def published(params: lsp.PublishDiagnosticsParams) -> None:
            waiting = self._told.get(params.uri)
            if waiting is not None and not waiting.done() and params.version == self._versions.get(params.uri):
                waiting.set_result(list(params.diagnostics))

        @client.feature(lsp.WINDOW_LOG_MESSAGE)
        def logged(params: lsp.LogMessageParams) -> None:
            self.log.append(params.message)

    async def write(self, path: Path, text: str) -> list[lsp.Diagnostic]:
        """Open or change a text; the problems that the server tells of."""
        uri = path.resolve().as_uri()
        version = self._versions[uri] = self._versions.get(uri, 0) + 1
        told = self.expect(path)
        if uri not in self.texts:
            document = lsp.TextDocumentItem(uri, "yaml", version, text)
            self.client.text_document_did_open(lsp.DidOpenTextDocumentParams(document))
        else:
            change = lsp.TextDocumentContentChangeWholeDocument(text)
            identifier = lsp.VersionedTextDocumentIdentifier(version, uri)
            self.client.text_document_did_change(lsp.DidChangeTextDocumentParams(identifier, [change]))
        self.texts[uri] = text
        return await asyncio.wait_for(told, PATIENCE)

    def expect(self, path: Path) -> asyncio.Future[list[lsp.Diagnostic]]:
        """What the server will tell of a text next."""
        told = self._told[path.resolve().as_uri()] = asyncio.get_running_loop().create_future()
        return told

    def at(self, path: Path, line: int, column: int) -> dict[str, Any]:
        """A place in a text, as parameters of requests."""
        uri = path.resolve().as_uri()
        return {"text_document": lsp.TextDocumentIdentifier(uri), "position": lsp.Position(line, column)}

    async def actions(self, path: Path, text: str) -> list[lsp.CodeAction]:
        """Everything that can be mended in a text."""
        whole = lsp.Range(lsp.Position(0, 0), lsp.Position(text.count("\n") + 1, 0))
        identifier = lsp.TextDocumentIdentifier(path.resolve().as_uri())
        params = lsp.CodeActionParams(identifier, whole, lsp.CodeActionContext([]))
        found: Any = await self.client.text_document_code_action_async(params)
        return list(found)


def edited(text: str, edits: list[lsp.TextEdit]) -> str:
    """A text (of ASCII) after the edits of a server."""
    lines = text.splitlines(keepends=True)
    starts = [sum(map(len, lines[:number])) for number in range(len(lines) + 1)]
    for each in sorted(edits, key=lambda edit: (edit.range.start.line, edit.range.start.character), reverse=True):
        first, last = (starts[at.line] + at.character for at in (each.range.start, each.range.end))
        text = text[:first] + each.new_text + text[last:]
    return text


@asynccontextmanager
async def editor() -> AsyncIterator[Editor]:
    """A server, asked by an editor; it must end by itself, without a word of an error."""
    client = LanguageClient("tests", "1")
    found = Editor(client)
    await client.start_io(sys.executable, "-m", "epicycle", "lsp")
    capabilities = lsp.ClientCapabilities()
    await client.initialize_async(lsp.InitializeParams(capabilities))
    client.initialized(lsp.InitializedParams())
    try:
        yield found
    finally:
        await asyncio.wait_for(client.shutdown_async(None), PATIENCE)
        client.exit(None)
        await asyncio.wait_for(client.stop(), PATIENCE)
        assert client._server is not None
        assert client._server.stderr is not None
        complaints = await client._server.stderr.read()
    assert complaints == b"", complaints.decode()
    assert found.log == []
