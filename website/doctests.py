"""Shows the doctests of docstrings as Python, wherever they stand."""

from __future__ import annotations

import re
from typing import Any

import griffe


class Doctests(griffe.Extension):
    """Fences every doctest, as Markdown takes `>>>` for a quotation in a quotation."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Change the docstring of what griffe has read."""
        if obj.docstring is not None:
            obj.docstring.value = re.sub(
                r"^>>> .*(?:\n(?!\s*$).*)*", r"```pycon\n\g<0>\n```", obj.docstring.value, flags=re.M
            )
