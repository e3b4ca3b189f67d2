"""The desk as a language server, for editors: ``epicycle lsp``."""

from __future__ import annotations

import asyncio
import logging
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from lsprotocol import types as lsp
from pygls.exceptions import JsonRpcInvalidParams
from pygls.lsp.server import LanguageServer
from pygls.uris import from_fs_path, to_fs_path

from ..model.text.problems import Position, Problem
from . import changes, completion, meaning
from .knowledge import Knowledge
from .positions import Positions
from .session import Session

_OURS = re.compile(r"^(?:model|study|disturbance|composites)\s*:", re.MULTILINE)
_PAUSE = 0.05  # seconds without a change before a text is read
_SEVERITY = {"error": lsp.DiagnosticSeverity.Error, "warning": lsp.DiagnosticSeverity.Warning}
_KINDS = {
    "key": lsp.CompletionItemKind.Property,
    "type": lsp.CompletionItemKind.Class,
    "actor": lsp.CompletionItemKind.Module,
    "port": lsp.CompletionItemKind.Interface,
    "path": lsp.CompletionItemKind.Interface,
    "parameter": lsp.CompletionItemKind.Variable,
    "value": lsp.CompletionItemKind.EnumMember,
    "unit": lsp.CompletionItemKind.Unit,
    "function": lsp.CompletionItemKind.Function,
    "file": lsp.CompletionItemKind.File,
}
_SYMBOLS = {
    "section": lsp.SymbolKind.Namespace,
    "actor": lsp.SymbolKind.Object,
    "composite": lsp.SymbolKind.Class,
    "port": lsp.SymbolKind.Interface,
    "parameter": lsp.SymbolKind.Variable,
    "aspect": lsp.SymbolKind.Event,
}
_FIX_ALL = lsp.CodeActionKind("source.fixAll")


class Server(LanguageServer):
    """What it knows of the open texts."""

    def __init__(self, version: str, types: tuple[type, ...] = ()) -> None:
        # Whole texts: the lines of incremental changes are not those that Python counts.
        super().__init__("epicycle", version, text_document_sync_kind=lsp.TextDocumentSyncKind.Full)
        self.session = Session(types)
        self.ours: set[Path] = set()  # those that have looked like a file of Epicycle since they were opened
        self.versions: dict[Path, int] = {}
        self.waiting: dict[Path, asyncio.Task[None]] = {}

    # -- texts ----------------------------------------------------------------------------------------------------

    def take(self, uri: str, text: str, version: int) -> None:
        """A text was opened or has changed."""
        if (path := path_of(uri)) is None:
            return
        self.versions[path] = version
        if _OURS.search(text):
            self.ours.add(path)
        for each in self.session.change(path, text):
            self.plan(each)

    def close(self, uri: str) -> None:
        if (path := path_of(uri)) is None:
            return
        self.ours.discard(path)
        if (task := self.waiting.pop(path, None)) is not None:
            task.cancel()
        for each in self.session.change(path, None):
            self.plan(each)
        self.text_document_publish_diagnostics(lsp.PublishDiagnosticsParams(uri, []))

    def plan(self, path: Path) -> None:
        """Report the problems of a text when nobody has typed for a moment."""
        if (task := self.waiting.pop(path, None)) is not None:
            task.cancel()
        self.waiting[path] = asyncio.get_running_loop().create_task(self._later(path))

    async def _later(self, path: Path) -> None:
        await asyncio.sleep(_PAUSE)
        self.waiting.pop(path, None)
        self.tell(path)

    def tell(self, path: Path) -> None:
        """Publish the problems of a text."""
        found = self.diagnostics(path) if path in self.ours and path in self.session.texts else []
        self.text_document_publish_diagnostics(
            lsp.PublishDiagnosticsParams(uri_of(path), found, self.versions.get(path))
        )

    # -- problems -------------------------------------------------------------------------------------------------

    def diagnostics(self, path: Path) -> list[lsp.Diagnostic]:
        """The problems of a text; those in other files stand at its beginning, with a link."""
        knowledge = self.session.knowledge(path)
        return [self._diagnostic(knowledge, each) for each in knowledge.reading.problems]

    def _diagnostic(self, knowledge: Knowledge, problem: Problem) -> lsp.Diagnostic:
        at, message = problem.position, "\n".join([problem.message, *(f"help: {each}" for each in problem.help)])
        related = None
        if at is not None and at.file == knowledge.file:
            where = self.range_of(knowledge, at)
        else:
            where = lsp.Range(lsp.Position(0, 0), lsp.Position(0, 0))
            if at is not None:
                message = f"{at}: {message}"
                related = [lsp.DiagnosticRelatedInformation(self.location(knowledge, at), problem.message)]
        return lsp.Diagnostic(
            where,
            message,
            _SEVERITY[problem.severity],
            problem.kind.code,
            source="epicycle",
            related_information=related,
        )

    def actions(self, params: lsp.CodeActionParams) -> list[lsp.CodeAction]:
        """Fixes of the problems in a range, and of all problems."""
        if (knowledge := self.known(params.text_document.uri)) is None:
            return []
        found, wanted = [], params.range
        for problem in knowledge.reading.problems:
            diagnostic = self._diagnostic(knowledge, problem)
            if (edit := changes.fix(knowledge, problem)) is None or not _overlap(diagnostic.range, wanted):
                continue
            shown = edit.text.strip().removeprefix(", ")
            title = f"add {shown!r}" if edit.start == edit.end else f"write {shown!r}"
            action = lsp.CodeAction(title, lsp.CodeActionKind.QuickFix, [diagnostic], is_preferred=True)
            action.edit = self.workspace_edit(knowledge, [edit])
            found.append(action)
        if edits := changes.fix_all(knowledge):
            everything = lsp.CodeAction("fix all problems that have one certain fix", _FIX_ALL)
            everything.edit = self.workspace_edit(knowledge, edits)
            found.append(everything)
        only = [str(_value(each)) for each in params.context.only or ()]
        return [each for each in found if not only or any(str(_value(each.kind)).startswith(kind) for kind in only)]

    # -- places ---------------------------------------------------------------------------------------------------

    def known(self, uri: str, *, alone: bool = False) -> Knowledge | None:
        """What is known of a text; None if it is none of ours."""
        path = path_of(uri)
        if path is None or path not in self.session.texts:
            return None
        return self.session.knowledge(path) if alone else self.session.around(path)

    def positions(self, text: str) -> Positions:
        return Positions(text, str(_value(self.workspace.position_encoding)))

    def place(self, knowledge: Knowledge, position: lsp.Position) -> tuple[int, int]:
        return self.positions(knowledge.text).from_client(position.line, position.character)

    def range_of(self, knowledge: Knowledge, at: Position) -> lsp.Range:
        text = knowledge.reading.files[at.file][1] if at.file in knowledge.reading.files else ""
        return self._range(text, at.line - 1, at.column - 1, at.column - 1 + at.length)

    def _range(self, text: str, line: int, start: int, end: int) -> lsp.Range:
        count = self.positions(text).to_client
        return lsp.Range(lsp.Position(*count(line, start)), lsp.Position(*count(line, end)))

    def location(self, knowledge: Knowledge, at: Position) -> lsp.Location:
        return lsp.Location(uri_of(meaning.path_of(knowledge, at)), self.range_of(knowledge, at))

    def workspace_edit(self, knowledge: Knowledge, edits: Iterable[changes.Edit]) -> lsp.WorkspaceEdit:
        """Edits as the protocol has them, by file."""
        texts = dict(knowledge.reading.files.values())
        found: dict[str, list[lsp.TextEdit]] = {}
        for each in edits:
            where = self._range(texts[each.path], each.line, each.start, each.end)
            found.setdefault(uri_of(each.path), []).append(lsp.TextEdit(where, each.text))
        return lsp.WorkspaceEdit(changes=found)


def path_of(uri: str) -> Path | None:
    """The file of an address; None if it is no file."""
    try:
        path = to_fs_path(uri) if uri.startswith("file:") else None
        return None if path is None else Path(path).resolve()
    except (OSError, RuntimeError, ValueError):
        return None


def uri_of(path: Path) -> str:
    return from_fs_path(str(path.resolve())) or ""


def _value(kind: Any) -> Any:
    return getattr(kind, "value", kind)


def _is_no_refusal(record: logging.LogRecord) -> bool:
    """Whether a record is of more than a name that cannot be changed: the answer itself says that to the editor."""
    return not (record.exc_info and isinstance(record.exc_info[1], JsonRpcInvalidParams))


def _overlap(one: lsp.Range, other: lsp.Range) -> bool:
    return one.start <= other.end and other.start <= one.end


# -- what editors ask -------------------------------------------------------------------------------------------------


def make_server(version: str, types: tuple[type, ...] = ()) -> Server:
    """A server with everything that the desk offers."""
    server = Server(version, types)
    logging.getLogger("pygls.protocol.json_rpc").addFilter(_is_no_refusal)

    @server.feature(lsp.TEXT_DOCUMENT_DID_OPEN)
    def opened(params: lsp.DidOpenTextDocumentParams) -> None:
        document = params.text_document
        if document.language_id == "epicycle" and (path := path_of(document.uri)) is not None:
            server.ours.add(path)
        server.take(document.uri, document.text, document.version)

    @server.feature(lsp.TEXT_DOCUMENT_DID_CHANGE)
    def changed(params: lsp.DidChangeTextDocumentParams) -> None:
        uri = params.text_document.uri
        server.take(uri, server.workspace.get_text_document(uri).source, params.text_document.version)

    @server.feature(lsp.TEXT_DOCUMENT_DID_CLOSE)
    def closed(params: lsp.DidCloseTextDocumentParams) -> None:
        server.close(params.text_document.uri)

    @server.feature(
        lsp.TEXT_DOCUMENT_COMPLETION, lsp.CompletionOptions(trigger_characters=[".", "{", " ", ",", "$", '"', "*", "["])
    )
    def complete(params: lsp.CompletionParams) -> list[lsp.CompletionItem]:
        path = path_of(params.text_document.uri)
        if path is None or (text := server.session.texts.get(path)) is None:
            return []
        positions = server.positions(text)
        line, column = positions.from_client(params.position.line, params.position.character)
        found = []
        for each in completion.complete(path, line, column, server.session.texts, server.session.types):
            start = lsp.Position(*positions.to_client(line, max(column - each.replaces, 0)))
            item = lsp.CompletionItem(each.text.strip().removesuffix(":"), kind=_KINDS[each.kind])
            item.detail, item.documentation = each.what or None, each.doc or None
            item.text_edit = lsp.TextEdit(lsp.Range(start, params.position), each.text)
            item.filter_text = each.text
            found.append(item)
        return found

    @server.feature(lsp.TEXT_DOCUMENT_HOVER)
    def hover(params: lsp.HoverParams) -> lsp.Hover | None:
        if (known := server.known(params.text_document.uri)) is None:
            return None
        text = meaning.hover(known, *server.place(known, params.position))
        return lsp.Hover(lsp.MarkupContent(lsp.MarkupKind.Markdown, text)) if text else None

    @server.feature(lsp.TEXT_DOCUMENT_DEFINITION)
    def definition(params: lsp.DefinitionParams) -> list[lsp.Location]:
        if (known := server.known(params.text_document.uri)) is None:
            return []
        found = meaning.definition(known, *server.place(known, params.position))
        return [server.location(known, each) for each in found]

    @server.feature(lsp.TEXT_DOCUMENT_REFERENCES)
    def references(params: lsp.ReferenceParams) -> list[lsp.Location]:
        if (known := server.known(params.text_document.uri)) is None:
            return []
        found = meaning.references(known, *server.place(known, params.position))
        return [server.location(known, each) for each in found]

    @server.feature(lsp.TEXT_DOCUMENT_RENAME, lsp.RenameOptions(prepare_provider=True))
    def rename(params: lsp.RenameParams) -> lsp.WorkspaceEdit | None:
        if (known := server.known(params.text_document.uri)) is None:
            return None
        place = server.place(known, params.position)
        try:
            edits = changes.rename(known, *place, params.new_name, server.session.texts)
        except changes.RenameError as error:
            raise JsonRpcInvalidParams(str(error)) from None
        return server.workspace_edit(known, edits)

    @server.feature(lsp.TEXT_DOCUMENT_PREPARE_RENAME)
    def prepare(params: lsp.PrepareRenameParams) -> lsp.Range | None:
        if (known := server.known(params.text_document.uri)) is None:
            return None
        use = known.names.at(known.file, *server.place(known, params.position))
        return None if use is None else server.range_of(known, use.position)

    @server.feature(lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    def symbols(params: lsp.DocumentSymbolParams) -> list[lsp.DocumentSymbol]:
        if (known := server.known(params.text_document.uri, alone=True)) is None:
            return []

        def symbol(each: meaning.Symbol) -> lsp.DocumentSymbol:
            where, kind = server.range_of(known, each.position), _SYMBOLS.get(each.kind, lsp.SymbolKind.Field)
            inside = [symbol(inner) for inner in each.inside]
            return lsp.DocumentSymbol(each.name or " ", kind, where, where, each.kind, children=inside)

        return [symbol(each) for each in meaning.symbols(known.reading.nodes.get(known.file))]

    @server.feature(lsp.TEXT_DOCUMENT_DOCUMENT_LINK)
    def links(params: lsp.DocumentLinkParams) -> list[lsp.DocumentLink]:
        if (known := server.known(params.text_document.uri, alone=True)) is None:
            return []
        return [lsp.DocumentLink(server.range_of(known, at), uri_of(path)) for at, path in meaning.links(known)]

    @server.feature(
        lsp.TEXT_DOCUMENT_CODE_ACTION, lsp.CodeActionOptions(code_action_kinds=[lsp.CodeActionKind.QuickFix, _FIX_ALL])
    )
    def actions(params: lsp.CodeActionParams) -> list[lsp.CodeAction]:
        return server.actions(params)

    return server
