"""Small tables as text and as HTML: what a Python prompt and a notebook show of models and results."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from importlib import import_module
from typing import Any

import numpy as np

from epicycle.actors import EpicycleError, visible

MAX_ROWS = 40


@dataclass(frozen=True)
class Table:
    """A head and rows of texts; of many rows, the first ones are shown."""

    head: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]

    def shown(self) -> tuple[list[tuple[str, ...]], str]:
        """The rows that are shown, and what is said of the others."""
        if len(self.rows) <= MAX_ROWS:
            return list(self.rows), ""
        return list(self.rows[:MAX_ROWS]), f"... and {len(self.rows) - MAX_ROWS:,} more"


def as_text(caption: str, tables: Iterable[Table]) -> str:
    """The caption and the tables below each other, in columns; tables without rows are left out."""
    parts = [visible(caption)]
    for table in tables:
        if not table.rows:
            continue
        shown, more = table.shown()
        rows = [tuple(map(visible, row)) for row in shown]
        widths = [max(len(row[column]) for row in (table.head, *rows)) for column in range(len(table.head))]
        lines = [
            "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
            for row in (table.head, *rows)
        ]
        parts.append("\n".join([*lines, more] if more else lines))
    return "\n\n".join(parts)


def as_html(caption: str, tables: Iterable[Table]) -> str:
    """The same for a notebook, in plain HTML that takes on the notebook's own style."""
    parts = [f"<p>{escape(caption)}</p>"]
    for table in tables:
        if not table.rows:
            continue
        rows, more = table.shown()
        head = "".join(f"<th>{escape(cell)}</th>" for cell in table.head)
        body = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in rows)
        parts.append(f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>")
        if more:
            parts.append(f"<p>{escape(more)}</p>")
    return f"<div>{''.join(parts)}</div>"


def short(value: Any) -> str:
    """A value in one short line; numbers to six digits."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        text = f"[{', '.join(short(item) for item in value[:20])}]"
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        inner = ", ".join(
            f"{name}={short(getattr(value, name))}" for name in (each.name for each in dataclasses.fields(value))
        )
        text = f"{type(value).__name__}({inner})"
    else:
        text = value if isinstance(value, str) else repr(value)
    text = " ".join(text.split())
    return text if len(text) <= 100 else text[:97] + "..."


def pandas_module() -> Any:
    """The package pandas; raises ``EpicycleError`` where it is not installed."""
    try:
        return import_module("pandas")
    except ImportError:
        raise EpicycleError(
            "data frames need the package pandas, which is not installed: pip install 'epicycle[pandas]'"
        ) from None
