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
    if _has_order(graph):
        return []
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        loop: list[str] = error.args[1][:0:-1]
        place = {node: number for number, node in enumerate(graph)}
        start = loop.index(min(loop, key=place.__getitem__))
        return loop[start:] + loop[:start]
    return []


def _has_order(graph: Digraph) -> bool:
    """Whether there is no loop, in a third of the time that it takes to find one."""
    before = dict.fromkeys(graph, 0)
    for successors in graph.values():
        for each in successors:
            before[each] = before.get(each, 0) + 1
    waiting, left = [node for node, number in before.items() if not number], len(before)
    while waiting:
        left -= 1
        for each in graph.get(waiting.pop(), ()):
            before[each] -= 1
            if not before[each]:
                waiting.append(each)
    return not left
