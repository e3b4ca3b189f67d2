"""Writes the page of one run or of two: data and program in one file that loads and runs nothing else."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from typing import Any

import numpy as np

from epicycle.actors import to_nanoseconds

from ...execution.results import Results, Verdict
from ...model.build.model import Model
from ...model.catalogue.figure import Figure
from ...model.graph.model_graph import ModelGraph
from ...support.html import Html, page, tag
from ...support.shown import short
from ..sheet import PALETTE
from .differing import comparison, difference, four
from .drawing import drawn
from .lanes import lanes
from .packing import Pack
from .recording import Recording

SETTINGS = 40  # that are listed
# In this order, because each uses the ones before it; a program that arranges them follows.
PARTS = ("data", "causes", "paint", "state", "space", "graph", "timeline", "lanes", "chart", "details", "viewer")


def page_of(recordings: Sequence[Recording], *, names: Sequence[str] = (), story: Sequence[str] = ()) -> str:
    """The page of one run, or of two, which ``names`` distinguish; ``story`` are sentences about both."""
    data = Html(data_of(recordings, names=names, story=story))
    return page(
        f"{recordings[0].model.name} - Epicycle",
        part("page.css"),
        tag("div", tag("noscript", "This page shows a run of a simulation; it needs JavaScript."), id="page"),
        tag("script", data, type="text/plain", id="data"),
        script=script(part(f"{name}.js") for name in (*PARTS, "main")),
    )


def data_of(recordings: Sequence[Recording], *, names: Sequence[str] = (), story: Sequence[str] = ()) -> str:
    """What the page shows, packed as text."""
    pack = Pack()
    runs = [_run(each, name, pack) for each, name in zip(recordings, [*names, "", ""], strict=False)]
    about = {
        "palette": PALETTE,
        "runs": runs,
        "story": list(story),
        "difference": difference(recordings) if len(recordings) > 1 else None,
        "comparison": comparison(recordings) if len(recordings) > 1 else [],
    }
    return pack.text(about)


def script(parts: Iterable[str]) -> str:
    """The program of a page, as one function, of its parts in this folder and of others as text."""
    return '"use strict";\n(() => {\n' + "\n".join(parts) + "})();\n"


def part(name: str) -> str:
    """A file of this folder's program or style."""
    return (files(__package__) / "browser" / name).read_text(encoding="utf-8")


# -- data of a run ----------------------------------------------------------------------------------------------------


def _run(recording: Recording, name: str, pack: Pack) -> dict[str, Any]:
    model, results, kept = recording.model, recording.finished("a page"), recording.kept()
    figures = recording.figures.values()
    actors = [path for path in model.graph.actors if path not in recording.places]  # that never fired
    places = [*recording.places, *actors]
    settings = [_setting(model, *each) for each in results.parameters.items()]
    shown, left_out = lanes(results, figures)
    numbers = {path: number for number, path in enumerate(places)}
    return {
        "name": name,
        "model": model.name,
        "doc": model.doc,
        "seed": str(results.seed),  # a browser's numbers have 53 bits
        "end": to_nanoseconds(results.end),
        "stopped": results.stopped,
        "digest": results.digest,
        "settings": settings[:SETTINGS] + ([f"and {rest} more"] if (rest := len(settings) - SETTINGS) > 0 else []),
        "metrics": metrics(recording),
        "monitors": [_monitor(recording, name, each) for name, each in results.monitors.items()],
        "firings": recording.firings,
        "records": recording.records,
        "gaps": recording.gaps(),
        "places": places,
        "ports": [_port(model.graph, places[place], name, numbers) for place, name in recording.ports],
        "events": list(recording.events),
        "aspects": list(recording.aspects),
        "columns": {column: pack.whole(values) for column, values in kept.columns.items()},
        "tags": [pack.exact([tag.time for tag in kept.tags]), pack.whole([tag.microstep for tag in kept.tags])],
        "texts": pack.texts(kept.texts),
        "drawing": drawn(model),
        "lanes": [{**vars(lane), "times": pack.exact(lane.times), "values": pack.rough(lane.values)} for lane in shown],
        "lanes_left_out": left_out,
        "marks": [each for figure in figures for each in _marks(recording, results, figure, pack)],
    }


def _setting(model: Model, name: str, value: object) -> str:
    """A parameter of the model with its value, in the unit in which it is declared."""
    unit = model.declared[name].unit if name in model.declared else ""
    return f"{name} = {short(value)}" + ("" if unit in ("", "1") else f" {unit}")


def metrics(recording: Recording) -> list[list[Any]]:
    """Metrics as they are now: name, value in words, unit, what it is, and the number."""
    outcomes, found = (recording.results or recording.so_far()).outcomes, list[list[Any]]()
    for each in recording.model.output.metrics:
        value, unit = outcomes[each.name].value, "" if each.unit == "1" else each.unit
        number = float(value) if isinstance(value, (int, float)) and abs(value) < 1e300 else None
        found.append([each.name, outcomes[each.name].shown(four), unit, each.measure.doc, number])
    return found


def _monitor(recording: Recording, name: str, verdict: Verdict) -> dict[str, Any]:
    """What a monitor says of the run, and when (ns) it was broken first."""
    required = next(each.requirement for each in recording.model.output.monitors if each.name == name)
    unit = f" {required.unit}" if required.unit else ""
    margin = f", robustness {four(verdict.robustness)}{unit}"
    said = f"cannot be judged: {verdict.missing}" if verdict.missing else "holds" if verdict.holds else verdict.remark
    time = None if verdict.time is None else to_nanoseconds(verdict.time)
    return {
        "name": name,
        "property": required.property,
        "holds": verdict.holds is True and not verdict.missing,
        "text": (said or "broken") + ("" if verdict.missing else margin),
        "time": None if verdict.holds else time,
    }


def _port(graph: ModelGraph, path: str, name: str, numbers: Mapping[str, int]) -> dict[str, Any]:
    """A port, and the actors that receive its tokens; ``numbers`` are those of the places."""
    actor = graph.actors.get(path)
    port = None if actor is None else {**actor.inputs, **actor.outputs}.get(name)
    leads: dict[str, None] = {}
    waiting, seen = [f"{path}.{name}"], set[str]()
    while waiting:
        here = waiting.pop()
        owner = here.rpartition(".")[0]
        if owner in graph.actors and here.rpartition(".")[2] in graph.actors[owner].inputs:
            leads[owner] = None
        elif here not in seen and here in graph.ports:
            seen.add(here)
            waiting += [hop.destination for hop in graph.outgoing(here)]
    return {
        "place": numbers[path],
        "name": name,
        "multi": port is not None and port.multi,
        "leads": [numbers[owner] for owner in leads],
    }


def _marks(recording: Recording, results: Results, figure: Figure, pack: Pack) -> list[dict[str, Any]]:
    graph, found = recording.model.graph, []
    for mark in figure.marks(results):
        times, rows = np.asarray(mark.times, dtype=float), np.asarray(mark.rows, dtype=float)
        ends = graph.source_of(mark.name) if mark.name in graph.ports else []
        found.append(
            {
                "name": mark.name,
                "port": ends[0].path if ends else "",
                "shape": mark.shape,
                "times": pack.exact(times),
                "rows": pack.rough(rows),
                "width": rows.shape[1],
                "interval": float(np.median(np.diff(times))) if len(times) > 1 else 1e18,
                "radius": mark.radius,
                "colour": mark.colour,
            }
        )
    return found
