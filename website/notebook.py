"""A page from a notebook: its cells are run, with the output of each below it."""

from __future__ import annotations

import ast
import contextlib
import html
import io
import json
import tempfile
from pathlib import Path
from typing import Any


def page(notebook: Path) -> str:
    """The notebook as Markdown."""
    parts: list[str] = []
    names: dict[str, Any] = {"__name__": notebook.stem}
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        for cell in json.loads(notebook.read_text(encoding="utf-8"))["cells"]:
            source = "".join(cell["source"])
            parts += [source] if cell["cell_type"] == "markdown" else [f"```python\n{source}\n```", _run(source, names)]
    return "\n\n".join(filter(None, parts)) + "\n"


def _run(source: str, names: dict[str, Any]) -> str:
    tree = ast.parse(source)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    value, printed = None, io.StringIO()
    with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(io.StringIO()):  # it shows progress
        exec(compile(tree, "notebook", "exec"), names)
        if isinstance(last, ast.Expr):
            value = eval(compile(ast.Expression(last.value), "notebook", "eval"), names)
    return "\n\n".join(filter(None, (_text(printed.getvalue()), _shown(value))))


def _shown(value: Any) -> str:
    """Output as a notebook shows it, without empty lines, which would end a block of HTML in Markdown."""
    for form in ("_repr_html_", "_repr_svg_"):
        found = getattr(value, form, lambda: None)()
        if found is not None:
            drawing = found[found.find("<svg") :] if form == "_repr_svg_" else found  # without anything before it
            return f'<div class="output">{" ".join(drawing.split())}</div>'
    return "" if value is None else _text(repr(value))


def _text(text: str) -> str:
    return f'<pre class="output">{html.escape(text.rstrip()).replace(chr(10), "<br>")}</pre>' if text.strip() else ""
