"""The firings of a run as text or JSON: who fired when, and why."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from ...support.printing import console, notices, tell, tell_json_text

if TYPE_CHECKING:
    from epicycle.actors import Actor, Tag

    from ...execution.engine import Firing
    from ...model.build.model import Model
    from ...model.graph.model_graph import ModelGraph
    from ...study.run_spec import OpenedRun

WIDEST = 80  # characters of a token


def trace(run: OpenedRun, patterns: list[str], start: str | None, end: str | None, *, as_json: bool) -> None:
    """Make a run and print the firings of its actors, with the tokens and wake-ups that caused them."""
    from epicycle.actors import to_nanoseconds

    from ...execution.engine import Simulation, Tracer
    from ...study.run_spec import seconds

    first, last = to_nanoseconds(seconds("--from", start) or 0.0), seconds("--to", end)
    model = run.model
    actors = _actors(patterns, model)
    show = _as_json if as_json else _as_text(actors, model.graph)
    say = tell_json_text if as_json else tell

    def report(firing: Firing) -> None:
        if firing.tag.time >= first:
            say(show(firing))

    stop = model.stop if run.until is None else run.until
    last = stop if last is None else last if stop is None else min(last, stop)
    with notices(console(stderr=True)):
        Simulation(model, seed=run.seed, tracer=Tracer(actors, report)).run(until=last)


def _actors(patterns: list[str], model: Model) -> dict[str, Actor]:
    """The actors that patterns select, directly or as parts of selected composites."""
    from epicycle.actors import EpicycleError, did_you_mean

    from ...model.text.patterns import PatternError, select

    graph = model.graph
    known = [*graph.actors, *graph.composites]
    chosen: set[str] = set()
    for pattern in patterns or ["**"]:
        try:
            found = select(pattern, known)
        except PatternError as error:
            raise EpicycleError(f"--trace {pattern}: {error}") from None
        if not found and not model.graph.excuses(pattern):
            raise EpicycleError(f"--trace {pattern} matches no actor{did_you_mean(pattern, known)}")
        chosen.update(found)

    def is_chosen(path: str) -> bool:
        return path in chosen or ("." in path and is_chosen(path.rpartition(".")[0]))

    return {path: actor for path, actor in graph.actors.items() if is_chosen(path)}


# -- the text ---------------------------------------------------------------------------------------------------------


def _as_text(actors: dict[str, Actor], graph: ModelGraph) -> Callable[[Firing], str]:
    """A function that writes a firing as a few lines, in columns wide enough for these actors."""
    wide = max(map(len, actors), default=0)
    ports = [name for actor in actors.values() for name in (*actor.inputs, *actor.outputs)]
    narrow = max(map(len, (*ports, "wake-up"))) + 3  # and the channel
    sources = max((len(wire.source.path) for wire in graph.wires() if wire.destination.actor.path in actors), default=0)

    def show(firing: Firing) -> str:
        lines = []
        if firing.outside == "resumed":
            lines.append(("<-", "SimPy", "", "resumed the process"))
        for asked in firing.wakes:
            lines.append(("<-", "wake-up", "", "requested in initialize" if asked is None else f"requested at {asked}"))
        for arrival in firing.arrivals:
            port = (
                f"{arrival.port}[{arrival.channel}]"
                if actors[firing.actor].inputs[arrival.port].multi
                else arrival.port
            )
            late = f"  sent at {arrival.sent}" if arrival.sent != firing.tag else ""
            lines.append(("<-", port, arrival.source, _token(arrival.token) + late))
        for record in firing.records:
            port = record.port if record.channel is None else f"{record.port}[{record.channel}]"
            note = f"  {record.event} by aspect {record.aspect}" if record.aspect else ""
            note = "  released by an aspect" if firing.outside == "released" and not note else note
            lines.append(("->", port, "", _token(record.value) + note))
        head = f"{firing.tag!s:<18} {firing.actor:<{wide}}"
        text = []
        for arrow, port, source, rest in lines or [("", "", "", "")]:
            text.append(f"{head} {arrow} {port:<{narrow}} {source:<{sources}}  {rest}".rstrip())
            head = " " * len(head)
        return "\n".join(text)

    return show


def _token(token: Any) -> str:
    from ...execution.results import plain
    from ...support.shown import json_line

    return json_line(plain(token), WIDEST)


def _as_json(firing: Firing) -> str:
    from ...execution.results import plain

    def tag(at: Tag | None) -> dict[str, float | int] | None:
        return None if at is None else {"time": at.seconds, "microstep": at.microstep}

    return (
        json.dumps(
            {
                "time": firing.tag.seconds,
                "microstep": firing.tag.microstep,
                "actor": firing.actor,
                "outside": firing.outside or None,
                "wakes": [{"asked": tag(asked)} for asked in firing.wakes],
                "tokens": [
                    {
                        "port": arrival.port,
                        "channel": arrival.channel,
                        "token": plain(arrival.token),
                        "from": arrival.source,
                        "sent": tag(arrival.sent),
                    }
                    for arrival in firing.arrivals
                ],
                "sends": [
                    {
                        "event": record.event,
                        "port": record.port,
                        "channel": record.channel,
                        "aspect": record.aspect or None,
                        "token": plain(record.value),
                    }
                    for record in firing.records
                ],
            }
        )
        + "\n"
    )
