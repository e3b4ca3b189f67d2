"""The desk as a language server, for editors: ``epicycle lsp``."""

from __future__ import annotations

import asyncio
import logging
import re
from pathlib import Path
from typing import Any

from lsprotocol import types as lsp
from pygls.exceptions import JsonRpcInvalidParams
from pygls.lsp.server import LanguageServer

from .answers import ANSWERS, FIX_ALL, LEGEND, Answers, path_of, plain_value, uri_of
from .changes import RenameError

_OURS = re.compile(r"^(?:model|study|disturbance|composites)\s*:", re.MULTILINE)
_PAUSE = 0.05  # seconds without a change before a text is read
_OPTIONS: dict[str, Any] = {
    lsp.TEXT_DOCUMENT_COMPLETION: lsp.CompletionOptions([".", "{", " ", ",", "$", '"', "*", "["]),
    lsp.TEXT_DOCUMENT_RENAME: lsp.RenameOptions(prepare_provider=True),
    lsp.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL: LEGEND,
    lsp.TEXT_DOCUMENT_CODE_ACTION: lsp.CodeActionOptions([lsp.CodeActionKind.QuickFix, FIX_ALL]),
}


class Server(LanguageServer):
    """What it knows of the open texts."""

    def __init__(self, version: str, types: tuple[type, ...] = ()) -> None:
        # Whole texts: the lines of incremental changes are not those that Python counts.
        super().__init__("epicycle", version, text_document_sync_kind=lsp.TextDocumentSyncKind.Full)
        self._answers = Answers(types)
        self.ours: set[Path] = set()  # those that have looked like a file of Epicycle since they were opened
        self.versions: dict[Path, int | None] = {}
        self.waiting: dict[Path, asyncio.TimerHandle] = {}

    @property
    def answers(self) -> Answers:
        self._answers.encoding = plain_value(self.workspace.position_encoding)
        return self._answers

    def change(self, uri: str, text: str | None, version: int | None = None) -> None:
        """A text was opened, has changed or was closed (None): its problems follow when nobody types for a moment."""
        if (path := path_of(uri)) is None:
            return
        self.versions[path] = version
        if text is None:
            self.ours.discard(path)
        elif _OURS.search(text):
            self.ours.add(path)
        for each in {path, *self.answers.change(path, text)}:
            if each in self.waiting:
                self.waiting[each].cancel()
            self.waiting[each] = asyncio.get_running_loop().call_later(_PAUSE, self._tell, each)

    def _tell(self, path: Path) -> None:
        found = list[lsp.Diagnostic]()
        if path in self.ours and path in self.answers.texts:
            found = self.answers.problems(self.answers.knowledge(path))
        params = lsp.PublishDiagnosticsParams(uri_of(path), found, self.versions.get(path))
        self.text_document_publish_diagnostics(params)


def _is_no_refusal(record: logging.LogRecord) -> bool:
    """Whether a record is of more than a name that cannot be changed: the answer itself says that to the editor."""
    return not (record.exc_info and isinstance(record.exc_info[1], JsonRpcInvalidParams))


def make_server(version: str, types: tuple[type, ...] = ()) -> Server:
    """A server with everything that the desk offers."""
    server = Server(version, types)
    logging.getLogger("pygls.protocol.json_rpc").addFilter(_is_no_refusal)

    @server.feature(lsp.TEXT_DOCUMENT_DID_OPEN)
    def opened(params: lsp.DidOpenTextDocumentParams) -> None:
        document = params.text_document
        server.change(document.uri, document.text, document.version)

    @server.feature(lsp.TEXT_DOCUMENT_DID_CHANGE)
    def changed(params: lsp.DidChangeTextDocumentParams) -> None:
        uri = params.text_document.uri
        server.change(uri, server.workspace.get_text_document(uri).source, params.text_document.version)

    @server.feature(lsp.TEXT_DOCUMENT_DID_CLOSE)
    def closed(params: lsp.DidCloseTextDocumentParams) -> None:
        server.change(params.text_document.uri, None)

    def offer(method: str) -> None:
        @server.feature(method, _OPTIONS.get(method))
        def answer(params: Any) -> Any:
            try:
                return server.answers.ask(method, params)
            except RenameError as error:
                raise JsonRpcInvalidParams(str(error)) from None

    for method in ANSWERS:
        offer(method)
    return server
