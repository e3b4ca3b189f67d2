"""A page of HTML from nested elements; text is escaped, and hidden characters in it are shown."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterable
from html import escape
from typing import TypeAlias

from epicycle.actors import visible_lines

_VOID = frozenset({"img", "meta", "br"})


class Html(str):
    """Text that is already HTML."""

    __slots__ = ()


Content: TypeAlias = "str | Html | Iterable[Content] | None"


def html(content: Content) -> Html:
    """Escape text, keep HTML, join lists; None is empty."""
    if content is None:
        return Html("")
    if isinstance(content, Html):
        return content
    if isinstance(content, str):
        return Html(escape(visible_lines(content)))
    return Html("".join(html(each) for each in content))


def tag(element: str, /, *content: Content, **attributes: str | None) -> Html:
    """An element; ``class_`` is the attribute 'class', ``aria_label`` 'aria-label'; one that is None is left out."""
    given = {key.rstrip("_").replace("_", "-"): value for key, value in attributes.items() if value is not None}
    said = "".join(f' {key}="{escape(value)}"' for key, value in given.items())
    inner = html(content)
    return Html(f"<{element}{said}>" if element in _VOID else f"<{element}{said}>{inner}</{element}>")


def table(
    head: Iterable[Content],
    rows: Iterable[Iterable[Content]],
    *,
    names: int = 1,
    class_: str | None = None,
    scopes: bool = True,
) -> Html:
    """A table whose first ``names`` columns are headers of its rows; with ``scopes``, screen readers know them."""

    def heading(cell: Content, scope: str) -> Html:
        return tag("th", cell, scope=scope if scopes else None)

    body = [
        tag("tr", [heading(cell, "row") if at < names else tag("td", cell) for at, cell in enumerate(row)])
        for row in rows
    ]
    header = tag("tr", [heading(cell, "col") for cell in head])
    return tag("table", tag("thead", header), tag("tbody", body), class_=class_)


def wide_table(
    head: Iterable[Content], rows: Iterable[Iterable[Content]], *, names: int = 1, class_: str | None = None
) -> Html:
    """A table with its own scroll bar where the page is narrower."""
    return tag("div", table(head, rows, names=names, class_=class_), class_="scroll", tabindex="0")


def note(text: str) -> Html:
    """A paragraph of explanation."""
    return tag("p", text, class_="note")


def page(title: str, style: str, *content: Content, script: str = "") -> str:
    """A whole document, which loads nothing: a browser runs this script and no other."""
    may = {"default-src": "'none'", "img-src": "data:", "style-src": _hashed(style), "base-uri": "'none'"}
    may |= {"script-src": _hashed(script)} if script else {}
    policy = "; ".join(f"{what} {where}" for what, where in may.items())
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", http_equiv="Content-Security-Policy", content=policy),
        tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
        tag("title", title),
        tag("style", Html(style)),
    )
    run = tag("script", Html(script)) if script else None
    return f"<!DOCTYPE html>\n{tag('html', head, tag('body', content, run), lang='en')}\n"


def _hashed(text: str) -> str:
    """The hash by which a content security policy allows this text in a page."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
