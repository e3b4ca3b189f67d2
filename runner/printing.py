"""Printing: the one way on which text reaches a terminal, clean whatever a model or a run has put into it.

What is heavy is imported when it is needed: ``epicycle --help`` comes by here, too.
"""

from __future__ import annotations

import codecs
import json
import os
import sys
from collections.abc import Container, Iterable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

WIDTH = 120  # of what goes into a pipe, which has none of its own; the usual 80 would fold tables


def open_streams() -> None:
    """Make the standard streams such that printing never fails for their sake.

    One that was closed before we started leads nowhere, and a character that its encoding lacks becomes an escape.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        with suppress(AttributeError):  # somebody may have put something simpler in its place
            stream.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]


def tell(text: str) -> None:
    """Print text for people."""
    from epicycle.actors import visible_lines

    print(visible_lines(text))


def complain(text: str) -> None:
    """Say what went wrong."""
    from epicycle.actors import readable

    print(readable(text), file=sys.stderr, flush=True)


def complain_traceback(error: BaseException) -> None:
    """Show through which lines of code an exception came, or the one that an error of ours tells of."""
    import traceback

    from epicycle.actors import visible_lines

    print(
        visible_lines("".join(traceback.format_exception(error.__cause__ or error))),
        end="",
        file=sys.stderr,
        flush=True,
    )


def tell_json(value: object, *, indent: int | None = None) -> None:
    """Print JSON."""
    tell_json_text(json.dumps(value, indent=indent, ensure_ascii=False, allow_nan=False) + "\n")


def tell_json_text(text: str) -> None:
    """Print what is JSON already, exactly: what a terminal would obey or cannot show is escaped as JSON does it."""
    if not text.isprintable():
        text = "".join(each if each.isprintable() or each == "\n" else _escape(each) for each in text)
    encoding = getattr(sys.stdout, "encoding", None) or "utf-8"
    sys.stdout.write(text.encode(encoding, "epicycle.json").decode(encoding))


def _escape(text: str) -> str:
    return json.dumps(text)[1:-1]


def _escape_error(error: UnicodeError) -> tuple[str, int]:
    assert isinstance(error, UnicodeEncodeError)
    return _escape(error.object[error.start : error.end]), error.end


codecs.register_error("epicycle.json", _escape_error)


def console(*, stderr: bool = False) -> Console:
    """A console of rich's for tables and bars: texts are texts, never markup, and clean."""
    from rich.console import Console
    from rich.segment import Segment

    from epicycle.actors import visible_lines

    class Clean(Console):
        def render(self, *arguments: Any, **options: Any) -> Any:
            for segment in super().render(*arguments, **options):
                yield segment if segment.control else Segment(visible_lines(segment.text), segment.style)

    found = Clean(stderr=stderr, markup=False, emoji=False, highlight=False)
    if not found.is_terminal:
        found.width = WIDTH
    return found


def columns(head: Iterable[str], rows: Iterable[Iterable[str]], *, whole: Container[str] = ()) -> Table:
    """A table of rich's without lines; columns whose titles are ``whole`` are not broken."""
    from rich.table import Table
    from rich.text import Text

    found = Table(box=None, pad_edge=False, header_style="dim")
    for title in head:
        found.add_column(title, overflow="fold", no_wrap=title in whole)
    for row in rows:
        found.add_row(*map(Text, row))
    return found


@contextmanager
def notices(terminal: Console) -> Iterator[None]:
    """Show what the loggers of Epicycle say: what takes long, and the lines of ``Display``."""
    import logging

    from rich.logging import RichHandler

    logger = logging.getLogger("epicycle")
    handler = RichHandler(console=terminal, show_time=False, show_level=False, show_path=False)
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    try:
        yield
    finally:
        logger.removeHandler(handler)
