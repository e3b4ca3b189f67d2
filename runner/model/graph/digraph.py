"""Directed graphs as far as each model needs them: the successors of every node.

Drawing and diagnosis use networkx, whose import takes a fifth of a small run's time.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from graphlib import CycleError, TopologicalSorter
from typing import TypeAlias

Digraph: TypeAlias = Mapping[str, Collection[str]]


def in_order(graph: Digraph) -> list[str]:
    """All nodes, each before its successors; raises ``graphlib.CycleError`` if there is a loop."""
    return [*TopologicalSorter(graph).static_order()][::-1]  # which takes the predecessors of each


def find_loop(graph: Digraph) -> list[str]:
    """The nodes of a loop, starting with the first of them in the graph; empty if there is none."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        loop: list[str] = error.args[1][:0:-1]
        place = {node: number for number, node in enumerate(graph)}
        start = loop.index(min(loop, key=place.__getitem__))
        return loop[start:] + loop[:start]
    return []
