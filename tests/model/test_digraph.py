"""Directed graphs of names: an order, and the loop for which there is none."""

from __future__ import annotations

from graphlib import CycleError

import pytest

from epicycle.runner.model.graph.digraph import find_loop, in_order


def test_each_node_comes_before_those_behind_it() -> None:
    graph = {"a": ["c"], "b": ["a", "d"], "c": [], "d": ["c", "a"], "alone": []}
    order = in_order(graph)
    assert sorted(order) == sorted(graph)
    assert all(order.index(node) < order.index(far) for node in graph for far in graph[node])
    assert find_loop(graph) == []
    assert in_order({}) == find_loop({}) == []


@pytest.mark.parametrize(
    ("graph", "loop"),
    [
        ({"a": ["a"]}, ["a"]),
        ({"a": ["b"], "b": ["c"], "c": ["a"]}, ["a", "b", "c"]),
        ({"c": ["a"], "a": ["b"], "b": ["c"]}, ["c", "a", "b"]),  # from the first on
        ({"in": ["b"], "a": ["c", "out"], "b": ["a"], "c": ["b"], "out": []}, ["a", "c", "b"]),
    ],
)
def test_a_loop_begins_with_its_first_node(graph: dict[str, list[str]], loop: list[str]) -> None:
    assert find_loop(graph) == loop
    with pytest.raises(CycleError):
        in_order(graph)
