"""Names and words that bridges share."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from epicycle.runner import Model

Source = str | Path | Callable[[], Model]  # a packaged model, a file, or what makes one
# What an output sends, as a model says it.
KINDS: Mapping[str, Any] = {"number": float, "truth value": bool, "text": str, "any value": Any}


def ports_of(names: Iterable[str], *taken: str) -> dict[str, str]:
    """Names as those of ports: ``/robot/front/scan`` is ``robot_front_scan``, ``der(x[1])`` is ``der_x_1``."""
    found: dict[str, str] = {}
    for name in names:
        port = re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_") or "nameless"
        port = f"_{port}" if port[0].isdigit() else port
        while port in taken or port in found.values():
            port += "_"
        found[name] = port
    return found


def reason_of(error: Exception) -> str:
    """What an error of another package says, on one line."""
    return " ".join(str(error).split())[:200].rstrip(".") or type(error).__name__
