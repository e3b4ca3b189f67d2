"""Shows doctests anywhere in docstrings as Python."""

from __future__ import annotations

import re
from typing import Any

import griffe


class Doctests(griffe.Extension):
    """Fences every doctest, because Markdown reads `>>>` as nested quotations."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Change the docstring of an object that griffe has read."""
        if obj.docstring is not None:
            obj.docstring.value = re.sub(
                r"^>>> .*(?:\n(?!\s*$).*)*", r"```pycon\n\g<0>\n```", obj.docstring.value, flags=re.M
            )
