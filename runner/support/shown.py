"""Values as shown to people and programs: in words, in one short line, to their significant digits, as JSON."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

SHORT = 100  # characters of a value in one line


def in_words(value: object, *, digits: int = 6, nothing: str = "none") -> str:
    """A value as people write it: yes or no, numbers to some digits, long ones to six."""
    if value is None:
        return nothing
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.{digits if abs(value) < 10 ** (digits + 1) else 6}g}"
    return str(value)


def in_time(seconds: float) -> str:
    """A duration as people say it: ``40 s``, ``7 min 5 s``, ``8 h``; fractions below two minutes."""
    if not 120.0 <= seconds < math.inf:
        return f"{seconds:.6g} s"
    rest, parts = round(seconds), []
    for size, unit in ((86_400, "d"), (3_600, "h"), (60, "min"), (1, "s")):
        count, rest = divmod(rest, size)
        if count:
            parts.append(f"{count:,} {unit}")
    return " ".join(parts)


def short(value: Any) -> str:
    """A value in one short line, as Python writes it; numbers to six digits."""
    if isinstance(value, float):
        return in_words(value)
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        text = f"[{', '.join(short(item) for item in value[:20])}]"
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        inner = ", ".join(f"{each.name}={short(getattr(value, each.name))}" for each in dataclasses.fields(value))
        text = f"{type(value).__name__}({inner})"
    else:
        text = value if isinstance(value, str) else repr(value)
    text = " ".join(text.split())
    return text if len(text) <= SHORT else text[: SHORT - 3] + "..."


def listed(texts: Sequence[str], last: str = "and", most: int = 1_000_000) -> str:
    """Texts as a list in a sentence, of which as many are shown as ``most``."""
    if len(texts) > most:
        texts = [*texts[:most], f"{len(texts) - most:,} more"]
    return f" {last} ".join([", ".join(texts[:-1]), texts[-1]] if len(texts) > 1 else texts)


def json_line(value: Any, widest: int) -> str:
    """Plain data as JSON on one line, with numbers to six digits, cut if too long."""
    text = json.dumps(six_digits(value), ensure_ascii=False)
    return text if len(text) <= widest else f"{text[: widest - 3]}..."


def rounded(value: float, width: float) -> str:
    """A number to two digits of half the interval around it; to six digits if there is no interval."""
    if not math.isfinite(value):
        return "–"
    exponent = math.floor(math.log10(width / 2)) if math.isfinite(width) and width > 0 else math.inf
    return f"{value:,.{max(0, 1 - exponent)}f}" if -12 <= exponent <= 12 else f"{value:.6g}"


def six_digits(value: Any) -> Any:
    """Plain data with its numbers to six digits."""
    return mapped(value, lambda number: float(f"{number:.6g}"))


def finite(value: Any) -> Any:
    """Plain data that JSON can represent: None replaces numbers that are not finite."""
    return mapped(value, lambda number: number if math.isfinite(number) else None)


def mapped(value: Any, change: Callable[[float], object]) -> Any:
    """Plain data with each of its floats changed."""
    if isinstance(value, dict):
        return {key: mapped(item, change) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [mapped(item, change) for item in value]
    return change(value) if isinstance(value, float) else value
