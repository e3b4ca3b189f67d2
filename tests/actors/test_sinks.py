"""Sinks: what they keep, show, compare, and how they end a run."""

from __future__ import annotations

import logging
import math
from typing import Any

import numpy as np
import pytest

from epicycle.actors import Histogram, Recorder
from epicycle.runner.execution.engine import ActorError, Simulation
from epicycle.runner.model.text.problems import ModelError
from tests.actors.feeding import feed, model_of, tokens

EVENTS = [(1.0, 1.5), (1.0, 2.5), (2.0, 3.5)]


def test_recorder_keeps_tokens_with_their_tags() -> None:
    it, _, _ = feed({"type": "Recorder"}, {"input": [EVENTS, [(2.0, 9.5)]]})
    assert isinstance(it, Recorder)
    assert it.tokens == [1.5, 2.5, 3.5, 9.5]
    assert it.times.tolist() == [1.0, 1.0, 2.0, 2.0]
    assert [tag.microstep for tag in it.tags] == [1, 1, 1, 1]
    assert it.array().tolist() == it.tokens
    it, _, _ = feed({"type": "Recorder", "capacity": 2}, {"input": EVENTS})
    assert isinstance(it, Recorder)
    assert (it.tokens, it.times.tolist(), it.seen) == ([2.5, 3.5], [1.0, 2.0], 3)


def test_display_prints_or_logs(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    lines = ["1 s  it: 1.5", "1 s  it: 2.5", "2 s  it: 3.5"]
    model = model_of({"type": "Display"}, {"input": EVENTS})
    logger = logging.getLogger("epicycle.display")
    heard: list[str] = []
    handler = logging.Handler()
    handler.emit = lambda record: heard.append(record.getMessage())  # type: ignore[method-assign]
    monkeypatch.setattr(logger, "propagate", False)  # of the handlers that pytest adds
    Simulation(model).run()
    assert capsys.readouterr().out.splitlines() == lines
    monkeypatch.setattr(logger, "handlers", [handler])
    monkeypatch.setattr(logger, "level", logging.INFO)
    Simulation(model).run()
    assert heard == lines
    assert capsys.readouterr().out == ""


def test_histogram_is_that_of_numpy() -> None:
    random = np.random.default_rng(1)
    values = [*random.uniform(-0.2, 1.2, 500).tolist(), 0.0, 1.0, *np.linspace(0, 1, 8).tolist()]
    events = [(float(k), value) for k, value in enumerate(values)]
    actor = {"type": "Histogram", "low": 0, "high": 1, "bins": 7}
    it, sent, _ = feed(actor, {"input": events, "trigger": [(9.0, 0), (900.0, 0)]})
    assert isinstance(it, Histogram)
    counts, edges = np.histogram(values, 7, (0, 1))
    assert it.counts.tolist() == counts.tolist() == tokens(sent)[1]
    assert it.edges.tolist() == edges.tolist()
    assert (it.below, it.above) == (sum(v < 0 for v in values), sum(v > 1 for v in values))
    assert tokens(sent)[0] == np.histogram(values[:10], 7, (0, 1))[0].tolist()
    with pytest.raises(ModelError, match="it: low is 1 and high is 0: low must be below high"):
        model_of({**actor, "low": 1, "high": 0}, {"input": EVENTS})


@pytest.mark.parametrize(
    ("expected", "message"),
    [
        ({"values": [1.5, 2.5, 3.5]}, None),
        ({"values": [1.5, 2.5, 3.5 + 1e-10], "times": [1, 1, 2]}, None),
        ({"values": [1.5, 2.5, 3.5, 4.5], "complete": False}, None),
        ({"values": [1.5, 2.6, 3.5], "tolerance": 0.2}, None),
        ({"values": [1.5, 2.6]}, "it failed in fire() at (1 s, 1): token 1 is 2.5, expected 2.6 within 1e-09"),
        ({"values": [1.5, "2.5"]}, "it failed in fire() at (1 s, 1): token 1 is 2.5, expected '2.5' within 1e-09"),
        (
            {"values": [1.5, 2.5, 3.5], "times": [1, 2, 2], "tolerance": 0},
            "it failed in fire() at (1 s, 1): token 1 came at 1 s, expected at 2 s",
        ),
        ({"values": [1.5]}, "it failed in fire() at (1 s, 1): token 1 is 2.5, expected only 1 token"),
        (
            {"values": [1.5, 2.5, 3.5, 4.5]},
            "it failed in wrapup() at (2 s, 2): 3 of 4 expected tokens came; the next should have been 4.5",
        ),
    ],
)
def test_test_compares(expected: dict[str, Any], message: str | None) -> None:
    if message is None:
        feed({"type": "Test", **expected}, {"input": EVENTS})
        return
    with pytest.raises(ActorError) as caught:
        feed({"type": "Test", **expected}, {"input": EVENTS})
    assert str(caught.value).partition("\n")[0] == message


@pytest.mark.parametrize(
    ("token", "value", "is_alike"),
    [
        ([1, [2.0]], [1.0, [2]], True),
        ([1, 2], [1], False),
        (True, 1, False),
        (True, True, True),
        ({"a": 1}, {"a": 1}, True),
        (None, None, True),
        (float("inf"), float("inf"), True),
    ],
)
def test_test_compares_by_structure(token: Any, value: Any, is_alike: bool) -> None:
    actor = {"type": "Test", "values": [value]}
    if is_alike:
        feed(actor, {"input": [(1.0, token)]})
    else:
        with pytest.raises(ActorError, match="token 0 is"):
            feed(actor, {"input": [(1.0, token)]})


def test_nan_and_texts_are_something_else() -> None:
    for token, value in ((math.nan, 5.0), (5.0, math.nan), (1, "1"), (10**400, 1.5)):
        with pytest.raises(ActorError, match="token 0 is"):
            feed({"type": "Test", "values": [value], "tolerance": 0.1}, {"input": [(1.0, token)]})


def test_test_says_how_many_times_are_missing() -> None:
    with pytest.raises(ModelError, match="it: times: 1 time for 2 values; give one for each"):
        model_of({"type": "Test", "values": [1, 2], "times": [1]}, {"input": EVENTS})


def test_stop_ends_the_run_after_the_tag() -> None:
    events = [(1.0, False), (2.0, 0.0), (3.0, True), (3.0, False), (4.0, True)]
    _, _, results = feed({"type": "Stop"}, {"input": events})
    assert (results.end, results.stopped) == (3.0, "actor it")
