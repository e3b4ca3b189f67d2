"""A page of HTML from nested elements; whatever is text is escaped, and what would hide in it is shown."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from typing import TypeAlias

from epicycle.actors import visible_lines

_VOID = frozenset({"img", "meta", "br"})


class Html(str):
    """Text that is HTML already."""

    __slots__ = ()


Content: TypeAlias = "str | Html | Iterable[Content] | None"


def html(content: Content) -> Html:
    """Escape what is text; what is HTML stays, lists are put together, and None is nothing."""
    if content is None:
        return Html("")
    if isinstance(content, Html):
        return content
    if isinstance(content, str):
        return Html(escape(visible_lines(content)))
    return Html("".join(html(each) for each in content))


def tag(element: str, /, *content: Content, **attributes: str | None) -> Html:
    """An element; ``class_`` is the attribute 'class', and an attribute that is None is left out."""
    said = "".join(f' {key.rstrip("_")}="{escape(value)}"' for key, value in attributes.items() if value is not None)
    inner = html(content)
    return Html(f"<{element}{said}>" if element in _VOID else f"<{element}{said}>{inner}</{element}>")


def table(head: Iterable[Content], rows: Iterable[Iterable[Content]], *, names: int = 1) -> Html:
    """A table whose first ``names`` columns are what the others are about."""
    header = tag("tr", [tag("th", cell, scope="col") for cell in head])
    body = [
        tag(
            "tr",
            [tag("th", cell, scope="row") if place < names else tag("td", cell) for place, cell in enumerate(row)],
        )
        for row in rows
    ]
    return tag("table", tag("thead", header), tag("tbody", body))


def with_class(element: Html, class_: str) -> Html:
    """An element that has no attributes yet, with a class."""
    return Html(element.replace(">", f' class="{escape(class_)}">', 1))


def page(title: str, style: str, *content: Content) -> str:
    """A whole document, which loads nothing from anywhere."""
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
        tag("title", title),
        tag("style", Html(style)),
    )
    return f"<!DOCTYPE html>\n{tag('html', head, tag('body', content), lang='en')}\n"
