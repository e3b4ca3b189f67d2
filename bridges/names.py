"""Names and words that bridges share."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

# What an output sends, as a model says it.
KINDS: Mapping[str, Any] = {"number": float, "truth value": bool, "text": str, "any value": Any}


def port_of(name: str) -> str:
    """Any name as that of a port: ``/robot/front/scan`` is ``robot_front_scan``, ``der(x[1])`` is ``der_x_1``."""
    found = re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_") or "nameless"
    return f"_{found}" if found[0].isdigit() else found


def reason_of(error: Exception) -> str:
    """What an error of another package says, on one line."""
    return " ".join(str(error).split())[:200].rstrip(".") or type(error).__name__
