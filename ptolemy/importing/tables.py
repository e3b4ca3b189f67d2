"""Reads the tables of the importer, which are YAML files beside it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import yaml


@cache
def table(name: str) -> Mapping[str, Any]:
    """The contents of a table."""
    text = Path(__file__).with_name(f"{name}.yaml").read_text(encoding="utf-8")
    found: Mapping[str, Any] = yaml.load(text, getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    return found


WORDS = {name: frozenset(said.split()) for name, said in table("words").items() if isinstance(said, str)}
CONSTANTS: Mapping[str, Any] = table("functions")["constants"]
FUNCTIONS: Mapping[str, tuple[str, ...]] = {
    name: (said,) if isinstance(said, str) else tuple(said) for name, said in table("functions")["functions"].items()
}


def pattern(name: str) -> re.Pattern[str]:
    """A pattern of a table, which is written on several lines."""
    return re.compile(table("words")[name].replace(" ", ""))


def why_not(java: str) -> str:
    """The end of the message about a class without a counterpart: a reason, or nothing."""
    reasons = table("words")["reasons"].items()
    return next((f": {reason}" for pattern, reason in reasons if re.search(pattern, java)), "")
