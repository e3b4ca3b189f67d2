"""Tokens with fields, batches and joins."""

from __future__ import annotations

from typing import Any

import pytest

from epicycle.runner.execution.engine import ActorError, Simulation
from tests.actors.feeding import load
from tests.actors.library_parts import Feeds, behave, problem, tokens


@pytest.mark.parametrize(
    ("actor", "feeds", "expected"),
    [
        # One after the other, over what came and what was set before.
        ("SetFields, set: {b: a + 1, c: b * time, a: 10 * a, left: 0}, remove: left",
         [("input", [[2, {"a": 1}]])], [(2, 1, "output", {"a": 10, "b": 2, "c": 4.0})]),
        ("SetFields, set: {number: token}", [("input", [[0, 7]])], [(0, 1, "output", {"number": 7})]),
        ("SetFields, draw: {work: {type: Constant, value: 2 min}}", [("input", [[0, {"a": 1}]])],
         [(0, 1, "output", {"a": 1, "work": 120.0})]),
        ("RecordAssembler, fields: [a, b]", [("a", [[0, 1], [0, 2]]), ("b", [[1, "x"], [2, "y"]])],
         [(1, 1, "output", {"a": 1, "b": "x"}), (2, 1, "output", {"a": 2, "b": "y"})]),
        ("RecordDisassembler, fields: [b, a]", [("input", [[1, {"a": 1, "b": 2, "c": 3}]])],
         [(1, 1, "b", 2), (1, 1, "a", 1)]),
        ("Batch, number: 2", [("input", [[0, 1], [1, 2], [2, 3]])],
         [(0, 1, "waiting", 1), (1, 1, "output", [1, 2]), (1, 1, "waiting", 0), (2, 1, "waiting", 1)]),
        ("Batch, size: 5, weight: token", [("input", [[0, 3], [1, 3], [2, 2]])],
         [(0, 1, "waiting", 1), (1, 1, "output", [3]), (2, 1, "output", [3, 2]), (2, 1, "waiting", 0)]),
        # What is late leaves before what comes at the same tag.
        ("Batch, after: 2 s, key: kind", [("input", [[0, {"kind": 1}], [1, {"kind": 2}], [2, {"kind": 1}]])],
         [(0, 1, "waiting", 1), (1, 1, "waiting", 2), (2, 1, "output", [{"kind": 1}]),
          (3, 1, "output", [{"kind": 2}]), (3, 1, "waiting", 1), (4, 1, "output", [{"kind": 1}]),
          (4, 1, "waiting", 0)]),
        ("Batch", [("input", [[0, 3], [1, 3]]), ("trigger", [[1, 0], [2, 0]])],
         [(0, 1, "waiting", 1), (1, 1, "output", [3, 3]), (1, 1, "waiting", 0)]),
        ("Unbatch", [("input", [[0, [3, [1]]], [1, []]])], [(0, 1, "output", 3), (0, 1, "output", [1])]),
        ("Match, key: id", [("input", [[0, {"id": 1}], [0, {"id": 2}]]), ("input", [[1, {"id": 2}], [2, {"id": 1}]])],
         [(0, 1, "waiting", 2), (1, 1, "output", [{"id": 2}, {"id": 2}]), (1, 1, "waiting", 1),
          (2, 1, "output", [{"id": 1}, {"id": 1}]), (2, 1, "waiting", 0)]),
        # The order of fields does not count.
        ("Match, key: id", [("input", [[0, {"id": {"a": 1, "b": 2}}]]), ("input", [[0, {"id": {"b": 2, "a": 1}}]])],
         [(0, 1, "output", [{"id": {"a": 1, "b": 2}}, {"id": {"b": 2, "a": 1}}])]),
        ("Match", [("input", [[0, 1], [1, 2]]), ("input", [[1, 3], [1, 4]])],
         [(0, 1, "waiting", 1), (1, 1, "output", [1, 3]), (1, 1, "output", [2, 4]), (1, 1, "waiting", 0)]),
    ],
)  # fmt: skip
def test_entities(actor: str, feeds: Feeds, expected: list[Any]) -> None:
    assert behave(f"{{type: {actor}}}", feeds) == expected


def test_fields_are_drawn_by_streams_of_their_own() -> None:
    feeds: Feeds = [("input", [[n, n] for n in range(20)])]
    one = tokens(behave("{type: SetFields, draw: {a: {type: Uniform}}}", feeds, seed=4))
    both = tokens(behave("{type: SetFields, draw: {b: {type: Uniform}, a: {type: Uniform}}}", feeds, seed=4))
    assert [each["a"] for each in one] == [each["a"] for each in both]
    assert len({each["a"] for each in one}) == 20


def test_a_token_is_not_changed_for_others() -> None:
    token = {"a": 1}
    behave("{type: SetFields, set: {a: 2}}", [("input", [[0, token]])])
    assert token == {"a": 1}


@pytest.mark.parametrize(
    ("actor", "feeds", "message"),
    [
        ("SetFields, set: {b: cost}", [("input", [[0, {"cots": 1}]])],
         ("'cost': the token {'cots': 1} has no field 'cost', did you mean 'cots'? it has cots, and token, time are "
          "known")),
        ("RecordDisassembler, fields: [cost]", [("input", [[0, {"cots": 1}]])],
         "the token {'cots': 1} has no field 'cost', did you mean 'cots'? it has cots"),
        ("RecordDisassembler, fields: [cost]", [("input", [[0, 5]])], "the token 5 has no field 'cost'; it has none"),
        ("Unbatch", [("input", [[0, 5]])], "5 is not a list"),
        ("Batch, size: 3, weight: token", [("input", [[0, "heavy"]])],
         "'token' gives 'heavy', but a weight must be a finite number"),
        ("Batch, size: 3, weight: token", [("input", [[0, -1]])],
         "'token' gives -1 for -1, but a weight must be >= 0"),
        ("Batch", [("input", [[0, 5]])], "it never sends: give 'number', 'size' or 'after', or connect 'trigger'"),
    ],
)  # fmt: skip
def test_what_cannot_be(actor: str, feeds: Feeds, message: str) -> None:
    with pytest.raises(ActorError) as caught:
        behave(f"{{type: {actor}}}", feeds)
    assert caught.value.reason == message


def test_records_without_fields() -> None:
    assert problem("{type: RecordAssembler, fields: []}") == "it: fields: the list is empty; name at least one field"
    assert problem("{type: RecordDisassembler, fields: [a, a]}") == "it: fields: 'a' is listed twice"


def test_items_of_arrays_are_plain_numbers() -> None:
    text = """
model: m
actors:
  clock: {type: Clock, period: 1 s}
  state: {type: StateSpace, a: [[0, 1], [0, 0]], b: [[0], [0]], initial: [0, 1]}
  items: {type: Unbatch}
  channels: {type: Spread}
  first: {type: Recorder}
  second: {type: Recorder}
connections:
  - clock.output -> state.input, state.trigger
  - state.output -> items.input, channels.input
  - items.output -> first.input
  - channels.output -> second.input
run: {stop: 0 s}
"""
    simulation = Simulation(load(text))
    simulation.run()
    found = [*simulation["first"].tokens, *simulation["second"].tokens]  # type: ignore[attr-defined]
    assert [(type(each), each) for each in found] == [(float, 0.0), (float, 1.0), (float, 0.0)]
