"""Reads numbers and states from signals for figures, thinned to what a picture can show."""

from __future__ import annotations

from array import array
from collections.abc import Iterator, Sequence
from itertools import groupby, islice
from operator import itemgetter
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from epicycle.aspects import STAMP

from ..execution.results import Results, Signal, cell, leaves
from ..model.text.patterns import select

COLUMNS = 700  # approximate width of a panel in pixels
_DENSE = 4  # samples per column above which they are drawn as an envelope

Floats: TypeAlias = NDArray[np.float64]
Rows: TypeAlias = "array[int]"
Numbers: TypeAlias = dict[str, tuple[Floats, "array[float]"]]  # times and values
States: TypeAlias = dict[str, tuple[Floats, list[str | None]]]  # times and names
Span: TypeAlias = tuple[float, float, str]  # start, end, state


def selected(patterns: tuple[str, ...], results: Results) -> list[str]:
    """The signals that patterns select, each once."""
    return list(dict.fromkeys(name for pattern in patterns for name in select(pattern, results.signals)))


def read(patterns: tuple[str, ...], results: Results) -> tuple[Numbers, States]:
    """All numbers and states in tokens, by signal and place in the token."""
    numbers: Numbers = {}
    states: States = {}
    for name in selected(patterns, results):
        signal = results.signals[name]
        times, (of_numbers, of_states) = signal.times, columns(signal)
        numbers |= {where: (times[rows], values) for where, (rows, values) in of_numbers.items()}
        states |= {where: (times[rows], found) for where, (rows, found) in of_states.items()}
    return numbers, states


def columns(
    signal: Signal, most: int | None = None
) -> tuple[dict[str, tuple[Rows, array[float]]], dict[str, tuple[Rows, list[str | None]]]]:
    """The numbers and the states in the first ``most`` places of a signal's tokens, except time stamps, by signal and
    place, with the indices of their tokens.

    A state is None where the value is something else; a place that never holds a state is left out.
    """
    numbers: dict[str, tuple[Rows, array[float]]] = {}  # 16 bytes a number
    states: dict[str, tuple[Rows, list[str | None]]] = {}
    for row, (_, token) in enumerate(signal):
        for place, leaf in islice(leaves(token), most):
            if place.rpartition(".")[2] == STAMP:
                continue
            kind, value, text = cell(leaf)
            where, state = f"{signal.name}.{place}" if place else signal.name, None
            if kind in ("int", "float"):
                if value is not None:
                    rows, values = numbers.setdefault(where, (array("q"), array("d")))
                    rows.append(row)
                    values.append(value)
            elif kind != "none" and (isinstance(leaf, str) or not hasattr(leaf, "__len__")):
                state = text if kind != "bool" else "true" if value else "false"
            rows, found = states.setdefault(where, (array("q"), []))
            rows.append(row)
            found.append(state)
    return numbers, {where: column for where, column in states.items() if any(each is not None for each in column[1])}


# -- thinning ---------------------------------------------------------------------------------------------------------


class Envelope(NamedTuple):
    """For each column of a panel: its middle, the least and the greatest value, and the mean."""

    times: Floats
    low: Floats
    high: Floats
    mean: Floats
    width: float


def envelope(times: Floats, values: Floats, begin: float, end: float, *, holds: bool) -> Envelope | None:
    """The envelope of samples that are too many to distinguish; None if they are few.

    ``holds``: a value lasts until the next one, so it counts in the columns between, weighted by its duration.
    """
    first, last = np.searchsorted(times, [begin, end])
    if last - first <= _DENSE * COLUMNS or not end > begin:
        return None
    edges = np.linspace(begin, end, COLUMNS + 1)
    if holds:  # one more sample at each edge: the value there
        edges = edges[edges >= times[0]]
        before = np.searchsorted(times, edges[:-1], side="right") - 1
        times, values = np.concatenate([times, edges[:-1]]), np.concatenate([values, values[before]])
        order = np.argsort(times, kind="stable")
        times, values = times[order], values[order]
    inside = (times >= edges[0]) & (times <= edges[-1])
    times, values = times[inside], values[inside]
    column = np.minimum(np.searchsorted(edges, times, side="right") - 1, len(edges) - 2)
    starts = np.flatnonzero(np.diff(column, prepend=-1))
    weights = np.append(np.diff(times), max(edges[-1] - times[-1], 0.0)) if holds else np.ones(len(times))
    whole = np.add.reduceat(weights, starts)
    low, high = np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)
    mean = np.add.reduceat(values * weights, starts) / np.where(whole > 0.0, whole, 1.0)
    middle = (edges[:-1] + edges[1:])[column[starts]] / 2
    # A value without duration has no weight.
    return Envelope(middle, low, high, np.where(whole > 0.0, mean, (low + high) / 2), float(edges[1] - edges[0]))


def spans_of(times: Sequence[float] | Floats, states: Sequence[str | None], end: float) -> Iterator[Span]:
    """The span of each state; equal successive states are merged, and states without duration are left out."""
    parts = zip(times, [*times[1:], end][: len(times)], states, strict=True)
    for state, alike in groupby((part for part in parts if part[0] < part[1]), key=itemgetter(2)):
        (since, until, _), *rest = alike
        if state is not None:
            yield since, rest[-1][1] if rest else until, state


def longest_spans(spans: Sequence[Span], begin: float, end: float) -> list[Span]:
    """The visible spans; if there are very many, the state that lasts longest in each column of the panel."""
    seen = [(max(since, begin), min(until, end), state) for since, until, state in spans if until >= begin]
    seen = [each for each in seen if each[0] <= each[1]]
    if len(seen) <= _DENSE * COLUMNS:
        return seen
    shares: list[dict[str, float]] = [{} for _ in range(COLUMNS)]
    width = (end - begin) / COLUMNS
    for since, until, state in seen:
        first, last = (min(int((at - begin) / width), COLUMNS - 1) for at in (since, until))
        for column in range(first, last + 1):
            share = min(until, begin + (column + 1) * width) - max(since, begin + column * width)
            shares[column][state] = shares[column].get(state, 0.0) + share
    times = [begin + column * width for column in range(COLUMNS)]
    return list(spans_of(times, [max(each, key=each.__getitem__, default=None) for each in shares], end))
