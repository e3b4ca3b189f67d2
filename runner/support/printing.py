"""Printing: the one path by which text reaches a terminal, cleaned of whatever a model or a run has put into it.

Heavy modules are imported when needed, because ``epicycle --help`` prints, too.
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

WIDTH = 120  # width of output to a pipe, which has none; the usual 80 would fold tables


def open_streams() -> None:
    """Prepare the standard streams so that printing to them never fails.

    A stream closed before we started discards its output, and a character missing in an encoding becomes an escape.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        with suppress(AttributeError):  # somebody may have replaced it with something simpler
            stream.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]


def tell(text: str) -> None:
    """Print text for people."""
    from epicycle.actors import visible_lines

    print(visible_lines(text))


def complain(text: str) -> None:
    """Print what went wrong."""
    from epicycle.actors import readable

    print(readable(text), file=sys.stderr, flush=True)


def complain_traceback(error: BaseException) -> None:
    """Show the traceback of an exception, or of the one that an error of ours reports."""
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
    """Print JSON text exactly; characters that a terminal would obey or cannot show are escaped as in JSON."""
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
    """A console of rich for tables and bars: texts are never markup, and are clean."""
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
    """A table of rich without rules; columns whose titles are in ``whole`` are not wrapped."""
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
    """Show what the loggers of Epicycle report: notices of long operations, and the lines of ``Display``."""
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
