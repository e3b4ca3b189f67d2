"""Directed graphs as far as each model needs them: of every node, those right behind it.

What is drawn, and what is wrong, is looked at with networkx; it takes a fifth of a small run's time to import.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from graphlib import CycleError, TopologicalSorter
from typing import TypeAlias

Digraph: TypeAlias = Mapping[str, Collection[str]]


def in_order(graph: Digraph) -> list[str]:
    """All nodes, each before those behind it; raises ``graphlib.CycleError`` if there is a loop."""
    return [*TopologicalSorter(graph).static_order()][::-1]  # which asks for those before each


def find_loop(graph: Digraph) -> list[str]:
    """The nodes of a loop, from the first of them in the graph on; empty if there is none."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        loop: list[str] = error.args[1][:0:-1]
        place = {node: number for number, node in enumerate(graph)}
        start = loop.index(min(loop, key=place.__getitem__))
        return loop[start:] + loop[:start]
    return []
