"""Reading MoML: an XML file as a tree of elements with their lines; nothing is fetched or expanded.

A file of Ptolemy II names its DTD on the line before the first element.  That line is blanked, and any other part of a
DTD is refused, so a file can neither define nor request entities.
"""

from __future__ import annotations

import codecs
import re
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any
from xml.sax import SAXParseException
from xml.sax.handler import ContentHandler

from epicycle.actors import EpicycleError

MAX_BYTES = 20_000_000
MAX_ELEMENTS = 300_000
MAX_DEPTH = 100

_DOCTYPE = re.compile(
    rb"""<!DOCTYPE\s+[\w.:-]+(?:\s+PUBLIC\s+(?:"[^"<>]*"|'[^'<>]*')|\s+SYSTEM)?(?:\s+(?:"[^"<>]*"|'[^'<>]*'))?\s*>"""
)
_PROLOG = re.compile(
    rb"\s*(?:<\?xml[^>]*\?>)?(?:\s|<!--(?:(?!-->).){0,100000}-->|<\?(?:(?!\?>).){0,100000}\?>)*", re.DOTALL
)
_ENCODING = re.compile(rb"<\?xml[^>]*\bencoding\s*=")


class MomlError(EpicycleError):
    """A file that cannot be imported; the message states why and where."""


@dataclass
class Element:
    """One element of the file."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Element] = field(default_factory=list)
    text: str = ""

    def get(self, name: str) -> str | None:
        """The value of an attribute, or None."""
        return self.attributes.get(name)


def read_document(path: Path) -> Element:
    """The root element of a file; raises ``MomlError``."""
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        raise MomlError(f"{path} cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if len(data) > MAX_BYTES:
        raise MomlError(f"{path} is larger than the maximum of {MAX_BYTES:,} bytes")
    return parse_document(data, str(path))


def parse_document(data: bytes, name: str) -> Element:
    """The root element of a text; messages call it ``name``."""
    # Imported here because no other command needs it.
    from defusedxml.common import DefusedXmlException
    from defusedxml.expatreader import DefusedExpatParser

    data = _without_doctype(_decodable(data))
    tree = _Tree(name)
    parser: Any = DefusedExpatParser(forbid_dtd=True)
    parser.setContentHandler(tree)
    try:
        parser.parse(BytesIO(data))
    except DefusedXmlException:
        line = parser.getLineNumber()
        raise MomlError(
            f"{name}:{line}: the file declares entities or its own DTD, which is not allowed\n"
            "   help: only a line like '<!DOCTYPE entity PUBLIC ...>' may precede the model"
        ) from None
    except SAXParseException as error:
        raise MomlError(f"{name}:{error.getLineNumber()}: not well-formed XML: {error.getMessage()}") from None
    except (ValueError, LookupError) as error:  # an encoding unknown to Python
        raise MomlError(f"{name}: not well-formed XML: {error}") from None
    if tree.root is None:
        raise MomlError(f"{name}: the file is empty")
    return tree.root


def _decodable(data: bytes) -> bytes:
    """The bytes as UTF-8.  Files that declare no encoding and are not UTF-8 are in Latin-1, as Java wrote some."""
    if data.startswith((codecs.BOM_UTF8, codecs.BOM_UTF16_BE, codecs.BOM_UTF16_LE)) or _ENCODING.match(data):
        return data
    try:
        data.decode()
    except UnicodeDecodeError:
        return data.decode("latin-1").encode()
    return data


def _without_doctype(data: bytes) -> bytes:
    """The text with the line that names the DTD blanked, so that lines keep their numbers."""
    start = data.find(b"<!DOCTYPE")
    prolog = _PROLOG.match(data.removeprefix(codecs.BOM_UTF8))
    if start < 0 or prolog is None or prolog.end() + (len(data) - len(data.removeprefix(codecs.BOM_UTF8))) != start:
        return data
    found = _DOCTYPE.match(data, start)
    if found is None:
        return data
    return data[:start] + re.sub(rb"[^\n]", b" ", found[0]) + data[found.end() :]


class _Tree(ContentHandler):
    """Builds the tree, within limits on its size and depth."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self.root: Element | None = None
        self._name = name
        self._open: list[Element] = []
        self._count = 0
        self._locator: Any = None

    def setDocumentLocator(self, locator: Any) -> None:  # noqa: N802  the name is SAX's
        self._locator = locator

    def _line(self) -> int:
        return int(self._locator.getLineNumber() or 0)

    def startElement(self, name: str, attrs: Any) -> None:  # noqa: N802
        self._count += 1
        if self._count > MAX_ELEMENTS:
            raise MomlError(f"{self._name}: more than the maximum of {MAX_ELEMENTS:,} elements")
        if len(self._open) >= MAX_DEPTH:
            raise MomlError(f"{self._name}:{self._line()}: elements are nested deeper than {MAX_DEPTH} levels")
        made = Element(name, dict(attrs.items()), self._line())
        if self._open:
            self._open[-1].children.append(made)
        else:
            self.root = made
        self._open.append(made)

    def endElement(self, name: str) -> None:  # noqa: N802
        self._open.pop()

    def characters(self, content: str) -> None:
        if self._open:
            self._open[-1].text += content

    def skippedEntity(self, name: str) -> None:  # noqa: N802
        raise MomlError(f"{self._name}:{self._line()}: unknown entity &{name};")
