"""Progress: a bar on a terminal or in a notebook, and nothing elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from importlib import import_module
from typing import TYPE_CHECKING, Any, TypeAlias

from .printing import console

if TYPE_CHECKING:
    from rich.console import Console

Show: TypeAlias = Callable[[float, float | None, str], None]  # how much is done, of how much, and the same in words

SOON = 0.5  # s before a bar appears, where many short tasks may follow each other
_OFTEN = 0.1  # s between two updates in a notebook


@contextmanager
def bar(name: str, *, after: float = 0.0, terminal: Console | None = None) -> Iterator[Show | None]:
    """A function that shows a bar, after at least ``after`` s; None where nobody would see it."""
    terminal = terminal or console(stderr=True)
    if not in_notebook() and not terminal.is_terminal:
        yield None
        return
    begun = time.monotonic()
    with ExitStack() as stack:
        shown: Show | None = None

        def show(done: float, total: float | None, words: str) -> None:
            nonlocal shown
            if shown is None and time.monotonic() - begun >= after:
                drawn = _in_notebook(name) if in_notebook() else _on_terminal(name, words, terminal)
                shown = stack.enter_context(drawn)
            if shown is not None:
                shown(done, total, words)

        yield show


def telling(
    show: Show | None, words: Callable[..., tuple[float, float | None, str]], progress: object = True
) -> Callable[..., None]:
    """A function that shows how far something has come, by what ``words`` make of it; or ``progress``, if it is one.

    Nothing is shown if ``progress`` is false.
    """

    def tell(*told: Any) -> None:
        if callable(progress):
            progress(*told)
        elif show is not None and progress:
            show(*words(*told))

    return tell


def unseen(done: float, total: float | None, words: str) -> None:
    """Nobody looks."""


def in_notebook() -> bool:
    """Whether a notebook shows what this process displays."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return hasattr(shell, "kernel")


@contextmanager
def _on_terminal(name: str, words: str, terminal: Console) -> Iterator[Show]:
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    about, said = (TextColumn(text, markup=False) for text in ("{task.description}", "{task.fields[words]}"))
    with Progress(about, said, BarColumn(), TimeElapsedColumn(), console=terminal, transient=True) as drawn:
        task = drawn.add_task(name, total=None, words=words)
        yield lambda done, total, words: drawn.update(task, total=total, completed=done, words=words)


@contextmanager
def _in_notebook(name: str) -> Iterator[Show]:
    """Plain HTML that is rewritten in place, so that no widgets are needed; it is removed at the end."""
    from .html import tag

    notebook: Any = import_module("IPython.display")
    place, latest = notebook.display(notebook.HTML(""), display_id=True), 0.0

    def show(done: float, total: float | None, words: str) -> None:
        nonlocal latest
        if (now := time.monotonic()) - latest >= _OFTEN:
            latest = now
            known = {} if total is None else {"value": f"{done:g}", "max": f"{total:g}"}
            place.update(notebook.HTML(tag("div", f"{name} ", tag("progress", **known), f" {words}")))

    try:
        yield show
    finally:
        place.update(notebook.HTML(""))
