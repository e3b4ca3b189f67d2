"""One actor under test, fed with tokens at given times."""

from __future__ import annotations

import json
from typing import Any

from tests.actors.feeding import Feed
from tests.engine.engine_parts import load, simulate

Sends = list[tuple[float, int, str, Any]]
Feeds = list[tuple[str, list[list[Any]]]]


def text(actor: str, feeds: Feeds, outputs: int = 0, like: str = "") -> str:
    """A model with the actor ``it``, a feed for each entry, and ``outputs`` connections of its output."""
    lines = [*([f"director: {{like: {like}}}"] if like else []), "actors:", f"  it: {actor}"]
    lines += [f"  feed{n}: {{type: Feed, events: {json.dumps(tokens)}}}" for n, (_, tokens) in enumerate(feeds)]
    lines += [f"  out{n}: {{type: Probe}}" for n in range(outputs)]
    lines += ["connections:"]
    lines += [f"  - feed{n}.output -> it.{port}" for n, (port, _) in enumerate(feeds)]
    lines += [f"  - it.output -> out{n}.input" for n in range(outputs)]
    return "\n".join(lines if len(feeds) + outputs else lines[:-1])


def behave(actor: str, feeds: Feeds, until: float = 100, seed: int = 0, outputs: int = 0, like: str = "") -> Sends:
    """What the actor sends: time, microstep, port with the channel if one was given, token."""
    _, results = simulate(text(actor, feeds, outputs, like), until=until, seed=seed, types=[Feed])
    return [
        (r.tag.seconds, r.tag.microstep, r.port if r.channel is None else f"{r.port}/{r.channel}", r.value)
        for r in results.log.records
        if r.event == "send" and r.actor == "it"
    ]


def tokens(sends: Sends, port: str = "output") -> list[Any]:
    """The tokens of one port."""
    return [token for _, _, name, token in sends if name == port]


def problem(actor: str, feeds: Feeds = [], like: str = "") -> str:  # noqa: B006
    """The message of what is wrong with the actor."""
    from epicycle.runner.model.text.problems import ModelError

    try:
        load(text(actor, feeds, like=like), types=[Feed])
    except ModelError as error:
        return "\n".join(each.message for each in error.problems)
    return "nothing is wrong"
