"""Prepares signals as lanes over time: numbers as lines, states as strips, thinned to what a screen can show."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...execution.results import Results
from ...model.catalogue.figure import Figure
from ..samples import Floats, read

POINTS = 8_000  # per line; above this, the lowest and highest value in each of half as many parts of the run
CHANGES = 20_000  # per strip
MOST = 400  # lanes


@dataclass(frozen=True)
class Lane:
    """Numbers (``states`` is None) or indices of ``states``, each valid from its time (s) on; named as on the page."""

    name: str
    times: Floats
    values: Floats
    states: list[str] | None
    line: bool  # whether numbers are joined by straight lines
    asked: bool  # whether a figure of the model shows it
    left_out: int  # samples


def lanes(results: Results, figures: Iterable[Figure]) -> tuple[list[Lane], int]:
    """The lanes of all recorded signals, those of figures first, and how many are too many."""
    asked: dict[str, bool] = {}
    for figure in figures:
        if style := getattr(figure, "style", ""):
            numbers, states = read(figure.signal_patterns(), results)
            asked.update(dict.fromkeys((*numbers, *states), style == "line"))
    numbers, states = read(("**",), results)
    found = [_line(name, np.array(times), np.array(values), asked) for name, (times, values) in numbers.items()]
    found += [_strip(name, np.array(times), texts, asked) for name, (times, texts) in states.items()]
    order = {name: place for place, name in enumerate(asked)}
    found.sort(key=lambda lane: order.get(lane.name, len(order)))
    return found[:MOST], max(0, len(found) - MOST)


def _line(name: str, times: Floats, values: Floats, asked: dict[str, bool]) -> Lane:
    kept = np.arange(len(times)) if len(times) <= POINTS else turning_points(times, values, POINTS // 4)
    return Lane(name, times[kept], values[kept], None, asked.get(name, False), name in asked, len(times) - len(kept))


def turning_points(times: Floats, values: Floats, parts: int) -> NDArray[np.int64]:
    """The samples that show the shape of a line: the first, lowest, highest and last in each part of the time, and the
    first that is not finite."""
    span = (times[-1] - times[0]) or 1.0
    starts = np.flatnonzero(np.diff(np.minimum((times - times[0]) / span * parts, parts - 1).astype(int), prepend=-1))
    kept: list[int] = []
    for start, end in zip(starts, [*starts[1:], len(times)], strict=True):
        some = values[start:end]
        gaps = np.flatnonzero(~np.isfinite(some))[:1]  # seen, but neither lowest nor highest
        low, high = (np.where(np.isfinite(some), some, away) for away in (np.inf, -np.inf))
        places = (0, low.argmin(), high.argmax(), len(some) - 1, *gaps)
        kept += sorted({int(start) + int(place) for place in places})
    return np.array(kept, dtype=np.int64)


def _strip(name: str, times: Floats, texts: list[str | None], asked: dict[str, bool]) -> Lane:
    names = {text: place for place, text in enumerate(dict.fromkeys(text for text in texts if text is not None))}
    codes = np.array([-1 if text is None else names[text] for text in texts], dtype=float)
    changed = np.flatnonzero(np.diff(codes, prepend=-2.0))
    kept = changed[:: 1 + len(changed) // CHANGES]
    return Lane(name, times[kept], codes[kept], list(names), False, name in asked, len(changed) - len(kept))
