"""Small tables as text and as HTML: what a Python prompt and a notebook show of models and results."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from epicycle.actors import EpicycleError, visible

MAX_ROWS = 40


@dataclass(frozen=True)
class Table:
    """A head and rows of texts; of many rows, the first ones are shown."""

    head: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]

    @property
    def more(self) -> str:
        """The line about the rows that are not shown."""
        return f"... and {len(self.rows) - MAX_ROWS:,} more" if len(self.rows) > MAX_ROWS else ""


def as_text(caption: str, tables: Iterable[Table]) -> str:
    """The caption and the tables below each other, in columns; tables without rows are left out."""
    parts = [visible(caption)]
    for each in tables:
        if each.rows:
            rows = [each.head, *(tuple(map(visible, row)) for row in each.rows[:MAX_ROWS])]
            widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
            lines = ["  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]
            parts.append("\n".join([*lines, each.more] if each.more else lines))
    return "\n\n".join(parts)


def as_html(caption: str, tables: Iterable[Table]) -> str:
    """The same for a notebook, in plain HTML that takes on the notebook's own style."""
    from .html import table, tag  # here, because few runs are shown this way

    parts = [tag("p", caption)]
    for each in tables:
        if each.rows:
            parts.append(table(each.head, each.rows[:MAX_ROWS], names=0, scopes=False))
            parts += [tag("p", each.more)] if each.more else []
    return tag("div", parts)


class Tabled:
    """What a prompt and a notebook show as a caption and tables."""

    def _caption(self) -> str:
        raise NotImplementedError

    def _tables(self) -> list[Table]:
        raise NotImplementedError

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self._caption()}>"

    def __str__(self) -> str:
        return as_text(self._caption(), self._tables())

    def _repr_html_(self) -> str:
        return as_html(self._caption(), self._tables())


def pandas_module() -> Any:
    """The package pandas; raises ``EpicycleError`` if it is not installed."""
    try:
        return import_module("pandas")
    except ImportError:
        raise EpicycleError(
            "data frames need the package pandas, which is not installed: pip install 'epicycle[pandas]'"
        ) from None
