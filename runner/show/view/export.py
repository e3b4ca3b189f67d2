"""Prepares a run for other viewers: its marks as points, discs and paths, its firings, and the acts of its aspects.

There are two exporters, because rerun (0.41) loads only frames and logs of Foxglove's messages, no scenes and no JSON.
These viewers have neither figures nor superdense time.  A mark becomes scenes, each of which holds until the next; at
any moment, a viewer needs only the latest scene.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from epicycle.actors import Tag, to_nanoseconds

from ...model.catalogue.figure import Mark
from ...support.shown import short
from ..sheet import LIMIT, PALETTE
from .recording import NOTHING, Recording

TRAIL = 200  # points of a trail, and how often it is drawn again
STALE = 1.6  # usual intervals after which a line of sight ends
LATEST = 1e9  # s, later than any run

Point = tuple[float, float]
Colour = tuple[int, int, int]


class Disc(NamedTuple):
    """An ellipse: its centre, both half axes (m), and the angle (rad) of the first."""

    x: float
    y: float
    along: float
    across: float
    angle: float


@dataclass(frozen=True)
class Scene:
    """The shapes of a mark from a time (ns) on."""

    time: int
    points: list[Point] = field(default_factory=list)
    discs: list[Disc] = field(default_factory=list)
    paths: list[list[Point]] = field(default_factory=list)


class Thing(NamedTuple):
    """A mark, or the trail of a body, over time; ``label`` is shown beside its point."""

    kind: str  # the mark's shape, or "trail"
    name: str
    label: str
    colour: Colour
    scenes: list[Scene]


class Act(NamedTuple):
    """An act of an aspect at a port."""

    tag: Tag
    aspect: str
    text: str


def parts(name: str) -> list[str]:
    """The parts of a dotted path."""
    return [part for part in name.split(".") if part]


def encodable(text: str) -> str:
    """Text with a replacement for characters that UTF-8 cannot encode."""
    return text.encode("utf-8", "replace").decode()


def about(recording: Recording) -> dict[str, str]:
    """The run in words: its origin and its results."""
    results = recording.finished("a file")
    left_out = sum(count for _, count in recording.gaps())
    said = {
        "model": results.model,
        "seed": str(results.seed),
        "end": f"{results.end:g} s, by {results.stopped}",
        "digest": results.digest,
        **({"left out": f"{left_out:,} of {recording.firings:,} firings"} if left_out else {}),
        **{f"setting {name}": short(value) for name, value in results.parameters.items()},
        **{f"metric {each.name}": results.outcomes[each.name].shown(short) for each in recording.model.output.metrics},
    }
    return {name: encodable(text) for name, text in said.items()}


def firings(recording: Recording) -> Iterator[tuple[Tag, str]]:
    """The firings of actors, in order."""
    columns, tags, _ = recording.kept()
    places = list(recording.places)
    for tag, actor in zip(columns["firing_tag"], columns["firing_actor"], strict=True):
        yield tags[tag], places[actor]


def acts(recording: Recording) -> Iterator[Act]:
    """The acts of aspects, in order."""
    columns, tags, texts = recording.kept()
    places, ports = list(recording.places), list(recording.ports)
    aspects, events = list(recording.aspects), list(recording.events)
    for row, aspect in enumerate(columns["record_aspect"]):
        if aspect == NOTHING:
            continue
        place, port = ports[columns["record_port"][row]]
        event, channel = events[columns["record_event"][row]], columns["record_channel"][row]
        where = f"{places[place]}.{port}" if channel == NOTHING else f"{places[place]}.{port}, channel {channel}"
        text = f"{where}: {event} {texts[columns['record_text'][row]]}"
        yield Act(tags[columns["record_tag"][row]], aspects[aspect], text)


# -- space ------------------------------------------------------------------------------------------------------------


def things(recording: Recording) -> list[Thing]:
    """Everything that figures of the model place in space, each thing once."""
    results, found = recording.finished("a file"), dict[tuple[str, str], Thing]()
    for figure in recording.figures.values():
        for mark in figure.marks(results):
            for thing in _things(mark, to_nanoseconds(results.end)):
                found.setdefault((thing.kind, thing.name), thing)
    return list(found.values())


def extent(placed: list[Thing]) -> tuple[Point, float]:
    """The middle of the space that the points occupy, and its greater width."""
    points = [point for thing in placed for scene in thing.scenes for point in scene.points] or [(0.0, 0.0)]
    (left, right), (low, high) = ((min(line), max(line)) for line in zip(*points, strict=True))
    return ((left + right) / 2.0, (low + high) / 2.0), max(right - left, high - low) or 1.0


def _things(mark: Mark, end: int) -> Iterator[Thing]:
    colour = LIMIT if mark.colour is None else PALETTE[mark.colour % len(PALETTE)]
    red, green, blue = bytes.fromhex(colour[1:])
    label = {"body": mark.name.rpartition(".")[0] or mark.name, "goal": mark.name}.get(mark.shape, "")
    moments = np.asarray(mark.times, dtype=float)
    order = [place for place in np.argsort(moments, kind="stable") if 0.0 <= moments[place] <= LATEST]
    times = [to_nanoseconds(float(moments[place])) for place in order]
    rows: NDArray[np.float64] = np.asarray(mark.rows, dtype=float)[order]
    scenes = [
        _scene(mark, time, row.tolist()) if np.isfinite(row).all() else Scene(time)
        for time, row in zip(times, rows, strict=True)
    ]
    if mark.shape == "line":
        scenes = list(_ending(scenes, end))
    if mark.shape == "body":
        trail = list(_trail(scenes))
        yield Thing("trail", mark.name, "", (red, green, blue), trail)
    yield Thing(mark.shape, mark.name, label, (red, green, blue), scenes)


def _scene(mark: Mark, time: int, row: list[float]) -> Scene:
    x, y = row[:2]
    match mark.shape:
        case "body" | "goal":
            discs = [Disc(x, y, mark.radius, mark.radius, 0.0)] if mark.radius else []
            return Scene(time, points=[(x, y)], discs=discs)
        case "ellipse":
            return Scene(time, discs=[Disc(*row)])
        case "tube":
            circles = list(dict.fromkeys(zip(row[::3], row[1::3], row[2::3], strict=True)))
            discs = [Disc(x, y, radius, radius, 0.0) for x, y, radius in circles if radius > 0.0]
            return Scene(time, discs=discs, paths=[[(x, y) for x, y, _ in circles]])
        case "line":
            return Scene(time, paths=[[(x, y), (row[2], row[3])]])


def _ending(scenes: list[Scene], end: int) -> Iterator[Scene]:
    """The scenes up to the end of the run (ns), ended early where the next one comes much later than usual."""
    gaps = np.diff([scene.time for scene in scenes])
    usual = int(STALE * np.median(gaps)) if len(gaps) else 0
    for scene, gap in zip(scenes, [*gaps.tolist(), math.inf], strict=True):
        yield scene
        if 0 < usual < gap and scene.time + usual <= end:
            yield Scene(scene.time + usual)


def _trail(scenes: list[Scene]) -> Iterator[Scene]:
    """The past positions of a body; between two scenes of its trail, a straight line extends the last one."""
    step, way = 1 + len(scenes) // TRAIL, list[Point]()
    for place, scene in enumerate(scenes):
        if place % step == 0:
            way = [*way, *scene.points]
            yield Scene(scene.time, paths=[way] if len(way) > 1 else [])
        elif way and scene.points:
            scene.paths.append([way[-1], *scene.points])
