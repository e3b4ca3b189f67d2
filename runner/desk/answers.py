"""What the Language Server Protocol asks about a text, for editors (``server.py``) and for the page of the studio."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from lsprotocol import types as lsp
from pygls.uris import from_fs_path, to_fs_path

from ..model.text.document import Mapping as MappingNode
from ..model.text.document import Node, Scalar
from ..model.text.problems import Position, Problem
from . import changes, completion, meaning
from .knowledge import Knowledge
from .names import SECTIONS, declared_in
from .places import positions
from .reading import Parsed, read

FIX_ALL = lsp.CodeActionKind("source.fixAll")
_SEVERITY = {"error": lsp.DiagnosticSeverity.Error, "warning": lsp.DiagnosticSeverity.Warning}
_ITEM, _SYMBOL = lsp.CompletionItemKind, lsp.SymbolKind
# What stands somewhere, as a completion, in an outline, and as a token, of which editors know how to colour the type.
_LOOKS = {
    "parameter": (_ITEM.Variable, _SYMBOL.Variable, "parameter"),
    "port": (_ITEM.Interface, _SYMBOL.Interface, "property"),
    "actor": (_ITEM.Module, _SYMBOL.Object, "variable"),
    "aspect": (_ITEM.Event, _SYMBOL.Event, "decorator"),
    "composite": (_ITEM.Class, _SYMBOL.Class, "class"),
    "metric": (_ITEM.Field, _SYMBOL.Field, "enumMember"),
    "monitor": (_ITEM.Field, _SYMBOL.Field, "event"),
    "figure": (_ITEM.Field, _SYMBOL.Field, "function"),
    "section": (_ITEM.Field, _SYMBOL.Namespace, ""),
    "key": (_ITEM.Property, _SYMBOL.Field, ""),
    "type": (_ITEM.Class, _SYMBOL.Field, ""),
    "path": (_ITEM.Interface, _SYMBOL.Field, ""),
    "value": (_ITEM.EnumMember, _SYMBOL.Field, ""),
    "unit": (_ITEM.Unit, _SYMBOL.Field, ""),
    "function": (_ITEM.Function, _SYMBOL.Field, ""),
}
LEGEND = lsp.SemanticTokensLegend([token for *_, token in _LOOKS.values() if token], [])


class Answers:
    """Texts that somebody has open, by their resolved paths, and answers about them; what has changed is read again.

    ``encoding`` is that of the client's columns.
    """

    def __init__(self, types: tuple[type, ...] = (), encoding: str = "utf-16") -> None:
        self.types = types
        self.encoding = encoding
        self.texts: dict[Path, str] = {}
        self._known: dict[Path, Knowledge] = {}
        self._parsed: Parsed = {}

    def change(self, path: Path, text: str | None) -> list[Path]:
        """Open a text, change it, or close it (None); the open files to which that makes a difference."""
        path = path.resolve()
        if text is None:
            self.texts.pop(path, None)
        else:
            self.texts[path] = text
        stale = {path, *(each for each, known in self._known.items() if path in _files(known))}
        self._known = {each: known for each, known in self._known.items() if each not in stale}
        return [each for each in stale if each in self.texts]

    def knowledge(self, path: Path) -> Knowledge:
        """What is known of an open file, or of one on disk."""
        path = path.resolve()
        if path not in self._known:
            self._known[path] = Knowledge(read(path, self.texts, self.types, parsed=self._parsed))
        return self._known[path]

    def around(self, path: Path) -> Knowledge:
        """What is known of a file, as part of an open model that includes it, if there is one."""
        path = path.resolve()
        for each in self.texts:
            if each != path and path in _files(known := self.knowledge(each)):
                return Knowledge(known.reading, path)
        return self.knowledge(path)

    def ask(self, method: str, params: Any) -> Any:
        """The answer to a request; None if that is about no text of ours."""
        path = path_of(params.text_document.uri)
        if path is None or path not in self.texts:
            return None
        return ANSWERS[method](self, self.around(path), params)

    # -- places ---------------------------------------------------------------------------------------------------

    def place(self, known: Knowledge, params: Any) -> int:
        """The offset of the place that a request is about."""
        return positions(known.text, self.encoding).from_client(params.position.line, params.position.character)

    def _range(self, text: str, start: int, end: int) -> lsp.Range:
        count = positions(text, self.encoding).to_client
        return lsp.Range(lsp.Position(*count(start)), lsp.Position(*count(end)))

    def range_of(self, known: Knowledge, at: Position) -> lsp.Range:
        path, start, end = known.stretch(at)
        return self._range(known.texts.get(path, ""), start, end)

    def locations(self, known: Knowledge, found: Iterable[Position]) -> list[lsp.Location]:
        return [lsp.Location(uri_of(known.stretch(at)[0]), self.range_of(known, at)) for at in found]

    def text_edit(self, known: Knowledge, edit: changes.Edit) -> lsp.TextEdit:
        return lsp.TextEdit(self._range(known.texts[edit.path], edit.start, edit.end), edit.text)

    def workspace_edit(self, known: Knowledge, edits: Iterable[changes.Edit]) -> lsp.WorkspaceEdit:
        found: dict[str, list[lsp.TextEdit]] = {}
        for each in edits:
            found.setdefault(uri_of(each.path), []).append(self.text_edit(known, each))
        return lsp.WorkspaceEdit(changes=found)

    # -- problems -------------------------------------------------------------------------------------------------

    def problems(self, known: Knowledge) -> list[lsp.Diagnostic]:
        """The problems of a text; those in other files stand at its beginning, with a link."""
        return [self._diagnostic(known, each) for each in known.reading.problems]

    def _diagnostic(self, known: Knowledge, problem: Problem) -> lsp.Diagnostic:
        """A problem, with the change of this text that removes it, if there is one, as its data."""
        at, message = problem.position, "\n".join([problem.message, *(f"help: {each}" for each in problem.help)])
        found = lsp.Diagnostic(self._range("", 0, 0), message, _SEVERITY[problem.severity], problem.kind.code)
        found.source = "epicycle"
        if at is not None and at.file == known.file:
            found.range = self.range_of(known, at)
        elif at is not None:
            found.message = f"{at}: {message}"
            [location] = self.locations(known, [at])
            found.related_information = [lsp.DiagnosticRelatedInformation(location, problem.message)]
        if (edit := changes.fix(known, problem)) is not None and edit.path.resolve() == known.path:
            found.data = self.text_edit(known, edit)
        return found

    def actions(self, known: Knowledge, params: lsp.CodeActionParams) -> list[lsp.CodeAction]:
        """Fixes of the problems in a range, and of all problems."""
        found, wanted = [], params.range
        for problem in self.problems(known):
            edit: Any = problem.data
            if edit is None or problem.range.start > wanted.end or wanted.start > problem.range.end:
                continue
            shown = edit.new_text.strip().removeprefix(", ")
            title = f"add {shown!r}" if edit.range.start == edit.range.end else f"write {shown!r}"
            action = lsp.CodeAction(title, lsp.CodeActionKind.QuickFix, [problem], is_preferred=True)
            action.edit = lsp.WorkspaceEdit({uri_of(known.path): [edit]})
            found.append(action)
        if edits := changes.fix_all(known):
            everything = lsp.CodeAction("fix all problems that have one certain fix", FIX_ALL)
            everything.edit = self.workspace_edit(known, edits)
            found.append(everything)
        only = [plain_value(each) for each in params.context.only or ()]
        return [each for each in found if not only or any(plain_value(each.kind).startswith(kind) for kind in only)]

    # -- requests about a place -----------------------------------------------------------------------------------

    def complete(self, known: Knowledge, params: lsp.CompletionParams) -> list[lsp.CompletionItem]:
        offset, found = self.place(known, params), []
        for each in completion.complete(known.path, offset, self.texts, self.types, self._parsed):
            start = max(offset - each.replaces, known.text.rfind("\n", 0, offset) + 1)
            item = lsp.CompletionItem(each.text.strip().removesuffix(":"), kind=_LOOKS[each.kind][0])
            item.detail, item.documentation, item.filter_text = each.what or None, each.doc or None, each.text
            item.text_edit = lsp.TextEdit(self._range(known.text, start, offset), each.text)
            found.append(item)
        return found

    def hover(self, known: Knowledge, params: lsp.HoverParams) -> lsp.Hover | None:
        text = meaning.hover(known, self.place(known, params))
        return lsp.Hover(lsp.MarkupContent(lsp.MarkupKind.Markdown, text)) if text else None

    def definition(self, known: Knowledge, params: lsp.DefinitionParams) -> list[lsp.Location]:
        return self.locations(known, meaning.definition(known, self.place(known, params)))

    def references(self, known: Knowledge, params: lsp.ReferenceParams) -> list[lsp.Location]:
        return self.locations(known, meaning.references(known, self.place(known, params)))

    def prepare(self, known: Knowledge, params: lsp.PrepareRenameParams) -> lsp.Range | None:
        use = known.use_at(self.place(known, params))
        return None if use is None else self.range_of(known, use.position)

    def rename(self, known: Knowledge, params: lsp.RenameParams) -> lsp.WorkspaceEdit:
        edits = changes.rename(known, self.place(known, params), params.new_name, self.texts)
        return self.workspace_edit(known, edits)

    # -- requests about a text ------------------------------------------------------------------------------------

    def symbols(self, known: Knowledge, params: Any) -> list[lsp.DocumentSymbol]:
        """What a file declares, section by section."""

        def symbol(kind: str, key: Scalar, inside: list[lsp.DocumentSymbol]) -> lsp.DocumentSymbol:
            where = self.range_of(known, key.position)
            return lsp.DocumentSymbol(key.text or " ", _LOOKS[kind][1], where, where, kind, children=inside)

        def sections(node: Node | None) -> Iterator[lsp.DocumentSymbol]:
            if not isinstance(node, MappingNode):
                return
            for name, section in node.entries.items():
                inside = declared_in(node, name, SECTIONS).values() if name in SECTIONS else ()
                symbols = [
                    symbol(SECTIONS[name], each.key, [*sections(each.value)] if name == "composites" else [])
                    for each in inside
                ]
                yield symbol("section", section.key, symbols)

        return [*sections(known.reading.nodes.get(known.file))]

    def links(self, known: Knowledge, params: Any) -> list[lsp.DocumentLink]:
        return [lsp.DocumentLink(self.range_of(known, at), uri_of(path)) for at, path in meaning.links(known)]

    def tokens(self, known: Knowledge, params: Any) -> lsp.SemanticTokens:
        """The names in a text with what they are, each by its distance from the one before."""
        kinds, found = list(_LOOKS), set[tuple[int, int, int, int]]()
        for use in known.names.uses:
            if use.position.file == known.file:
                where, kind = self.range_of(known, use.position), min(each.kind for each in use.names)
                found.add((where.start.line, where.start.character, where.end.character, kinds.index(kind)))
        data, before = list[int](), (0, 0)
        for line, start, end, number in sorted(found):
            data += [line - before[0], start - before[1] if line == before[0] else start, end - start, number, 0]
            before = line, start
        return lsp.SemanticTokens(data)


ANSWERS: Mapping[str, Callable[[Answers, Knowledge, Any], Any]] = {
    lsp.TEXT_DOCUMENT_COMPLETION: Answers.complete,
    lsp.TEXT_DOCUMENT_HOVER: Answers.hover,
    lsp.TEXT_DOCUMENT_DEFINITION: Answers.definition,
    lsp.TEXT_DOCUMENT_REFERENCES: Answers.references,
    lsp.TEXT_DOCUMENT_PREPARE_RENAME: Answers.prepare,
    lsp.TEXT_DOCUMENT_RENAME: Answers.rename,
    lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL: Answers.symbols,
    lsp.TEXT_DOCUMENT_DOCUMENT_LINK: Answers.links,
    lsp.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL: Answers.tokens,
    lsp.TEXT_DOCUMENT_CODE_ACTION: Answers.actions,
}


def _files(known: Knowledge) -> set[Path]:
    return {path.resolve() for path, _ in known.reading.files.values()} | {known.reading.path.resolve()}


def path_of(uri: str) -> Path | None:
    """The file of an address; None if it is no file."""
    try:
        path = to_fs_path(uri) if uri.startswith("file:") else None
        return None if path is None else Path(path).resolve()
    except (OSError, RuntimeError, ValueError):
        return None


def uri_of(path: Path) -> str:
    return from_fs_path(str(path.resolve())) or ""


def plain_value(kind: Any) -> str:
    """A text of the protocol, which may be one of an enumeration."""
    return str(getattr(kind, "value", kind))
