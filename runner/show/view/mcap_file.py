"""Writes a run as an MCAP file for Foxglove and Lichtblick: JSON messages, with Foxglove's schemas where they exist.

Lichtblick reads a subset of JSON Schema: objects, and arrays of numbers, texts or objects.  Other content of tokens is
converted: matrices become arrays, row by row, and values of several types become text.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator
from heapq import merge
from io import BytesIO
from itertools import chain
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

from epicycle.actors import Tag

from ...execution.results import Signal, plain
from ...support.extras import needed
from ...support.files import replace_file
from ...support.shown import finite
from .export import Act, Colour, Disc, Point, Scene, Thing, about, acts, extent, firings, parts, things
from .recording import Recording, ViewError

if TYPE_CHECKING:
    from mcap.writer import Writer

WORLD = "world"  # the frame of all positions
INFO = 2  # level of foxglove.Log
LINE_STRIP = 0  # type of foxglove.LinePrimitive
FAINT = 0.25  # opacity of discs
MOST = 65_535  # channels per file
SHARE = 0.012  # diameter of a point, relative to the whole space

Schema = dict[str, Any]
Message = tuple[int, int, Any]  # time (ns), channel, content to write as JSON


def write_mcap(recording: Recording, path: Path) -> None:
    """Write an MCAP file of a run; raises ``ViewError``."""
    replace_file(path, mcap(recording), ViewError)


def require_mcap() -> type[Writer]:
    """The class that writes MCAP files; raises ``EpicycleError`` if it is not installed."""
    found: type[Writer] = needed("mcap.writer", "an MCAP file", "mcap").Writer
    return found


def mcap(recording: Recording) -> bytes:
    """The content of a run's MCAP file; equal for equal runs with the same version of the library."""
    file = BytesIO()
    writer = require_mcap()(file)
    writer.start(profile="", library="epicycle")
    writer.add_metadata("run", about(recording))
    channels = Channels(writer)
    placed = things(recording)
    _, width = extent(placed)
    streams = [
        *(_signal(signal, channels) for signal in recording.finished("a file").signals.values()),
        *(_space(thing, SHARE * width, channels) for thing in placed),
        *(_frames(thing, channels) for thing in placed if thing.kind == "body"),
        _acts(acts(recording), channels),
        _firings(firings(recording), channels),
    ]
    encoder = json.JSONEncoder(separators=(",", ":"))
    for time, channel, message in merge(*streams, key=itemgetter(0)):
        data = encoder.encode(message).encode()
        writer.add_message(channel, log_time=time, publish_time=time, data=data)
    writer.finish()  # type: ignore[no-untyped-call]
    return file.getvalue()


class Channels:
    """The channels of a file; each schema is written once."""

    def __init__(self, writer: Writer) -> None:
        self._writer = writer
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}

    def number(self, topic: list[str], name: str, schema: Schema) -> int:
        path = "/" + "/".join(topic)
        if path not in self._channels:
            if len(self._channels) == MOST:
                raise ViewError(
                    f"an MCAP file holds at most {MOST:,} channels, and the run has more signals and actors"
                )
            if name not in self._schemas:
                data = json.dumps({"title": name, **schema}).encode()
                self._schemas[name] = self._writer.register_schema(name, "jsonschema", data)
            self._channels[path] = self._writer.register_channel(path, "json", self._schemas[name])
        return self._channels[path]


# -- schemas ----------------------------------------------------------------------------------------------------------

TRUTH, NUMBER, TEXT = ({"type": name} for name in ("boolean", "number", "string"))


def _fitting(values: Iterable[Any], empty: Schema = TEXT) -> Schema:
    """The schema that all of these values fit: text if no other does, and ``empty`` if all are None."""
    found = [value for value in values if value is not None]
    if not found:
        return empty
    if all(isinstance(value, dict) for value in found):
        names = dict.fromkeys(chain.from_iterable(found))
        return {"type": "object", "properties": {name: _fitting(each.get(name) for each in found) for name in names}}
    if all(isinstance(value, list) for value in found):
        return {"type": "array", "items": _fitting(chain.from_iterable(found), NUMBER)}
    if all(isinstance(value, bool) for value in found):
        return TRUTH
    return TEXT if any(isinstance(value, (bool, str, dict, list)) for value in found) else NUMBER


# -- signals ----------------------------------------------------------------------------------------------------------


def _signal(signal: Signal, channels: Channels) -> Iterator[Message]:
    schema = _fitting({"microstep": 0, "value": each} for each in (None, *map(_flat, map(plain, signal.tokens))))
    number = channels.number(["signals", *parts(signal.name)], f"epicycle.{signal.name}", schema)
    for tag, token in signal:
        value = _fitted(finite(_flat(plain(token))), schema["properties"]["value"])
        yield tag.time, number, {"microstep": tag.microstep, "value": value}


def _flat(value: Any) -> Any:
    """A value with nested arrays flattened into one, in order."""
    if isinstance(value, dict):
        return {key: _flat(each) for key, each in value.items()}
    if isinstance(value, list):
        inner = [_flat(each) for each in value]
        return list(chain.from_iterable(each if isinstance(each, list) else [each] for each in inner))
    return value


def _fitted(value: Any, schema: Schema) -> Any:
    """A value that fits its schema: converted to text if it is of another type."""
    if schema["type"] == "string" and value is not None and not isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, dict):
        return {key: _fitted(each, schema["properties"][key]) for key, each in value.items()}
    if isinstance(value, list):
        return [_fitted(each, schema["items"]) for each in value]
    return value


# -- space ------------------------------------------------------------------------------------------------------------


def _space(thing: Thing, size: float, channels: Channels) -> Iterator[Message]:
    number = channels.number(["space", thing.kind, *parts(thing.name)], "foxglove.SceneUpdate", SCENE)
    for scene in thing.scenes:
        yield scene.time, number, {"deletions": [], "entities": [_entity(thing, scene, size)]}


def _entity(thing: Thing, scene: Scene, size: float) -> dict[str, Any]:
    paint, cube = _paint(thing.colour), _vector(size, size, size)
    return {
        "timestamp": _time(scene.time),
        "frame_id": WORLD,
        "id": f"{thing.kind} {thing.name}",
        "lifetime": _time(0),  # until the next one
        "frame_locked": True,
        "metadata": [{"key": "name", "value": thing.name}],
        "arrows": [],
        "cubes": [],
        "spheres": [{"pose": _pose(point), "size": cube, "color": paint} for point in scene.points],
        "cylinders": [_cylinder(disc, size, _paint(thing.colour, FAINT)) for disc in scene.discs],
        "lines": [_line(path, paint) for path in scene.paths],
        "triangles": [],
        "texts": [_label(thing.label, point, size, paint) for point in scene.points if thing.label],
        "models": [],
    }


def _cylinder(disc: Disc, size: float, paint: Schema) -> dict[str, Any]:
    extent = _vector(2.0 * disc.along, 2.0 * disc.across, size / 10.0)
    pose = _pose((disc.x, disc.y), disc.angle)
    return {"pose": pose, "size": extent, "bottom_scale": 1.0, "top_scale": 1.0, "color": paint}


def _line(path: list[Point], paint: Schema) -> dict[str, Any]:
    return {
        "type": LINE_STRIP,
        "pose": _pose((0.0, 0.0)),
        "thickness": 2.0,  # pixels
        "scale_invariant": True,
        "points": [_vector(x, y) for x, y in path],
        "color": paint,
        "colors": [],
        "indices": [],
    }


def _label(text: str, point: Point, size: float, paint: Schema) -> dict[str, Any]:
    return {
        "pose": _pose((point[0], point[1] + 1.5 * size)),
        "billboard": True,
        "font_size": 14.0,  # pixels
        "scale_invariant": True,
        "color": paint,
        "text": text,
    }


def _frames(thing: Thing, channels: Channels) -> Iterator[Message]:
    """A frame for each body, which a viewer can follow."""
    number = channels.number(["frames", *parts(thing.name)], "foxglove.FrameTransform", FRAME)
    for scene in thing.scenes:
        for point in scene.points:
            yield scene.time, number, _frame(thing, scene.time, point)


def _frame(thing: Thing, time: int, point: Point) -> dict[str, Any]:
    return {
        "timestamp": _time(time),
        "parent_frame_id": WORLD,
        "child_frame_id": thing.label,
        "translation": _vector(*point),
        "rotation": _turn(0.0),
    }


def _vector(x: float, y: float, z: float = 0.0) -> dict[str, float]:
    return {"x": x, "y": y, "z": z}


def _turn(angle: float) -> dict[str, float]:
    return {"x": 0.0, "y": 0.0, "z": math.sin(angle / 2.0), "w": math.cos(angle / 2.0)}


def _pose(point: Point, angle: float = 0.0) -> dict[str, dict[str, float]]:
    return {"position": _vector(*point), "orientation": _turn(angle)}


def _paint(colour: Colour, opacity: float = 1.0) -> dict[str, float]:
    red, green, blue = (round(each / 255.0, 4) for each in colour)
    return {"r": red, "g": green, "b": blue, "a": opacity}


def _time(nanoseconds: int) -> dict[str, int]:
    seconds, rest = divmod(nanoseconds, 10**9)
    return {"sec": seconds, "nsec": rest}


def _every_scene() -> dict[str, Any]:
    """A message with everything that one may have, and what a run never has, but a viewer expects."""
    disc = Disc(0.0, 0.0, 1.0, 1.0, 0.0)
    entity = _entity(EVERY, Scene(0, points=[(0.0, 0.0)], discs=[disc], paths=[[(0.0, 0.0)]]), 1.0)
    entity |= {name: [{"pose": _pose((0.0, 0.0))}] for name in ("arrows", "cubes", "triangles", "models")}
    entity["lines"][0] |= {"colors": [_paint(EVERY.colour)], "indices": [0]}
    return {"deletions": [{"timestamp": _time(0), "type": 0, "id": ""}], "entities": [entity]}


EVERY = Thing("", "", "label", (0, 0, 0), [])
SCENE, FRAME = _fitting([_every_scene()]), _fitting([_frame(EVERY, 0, (0.0, 0.0))])


# -- acts and firings -------------------------------------------------------------------------------------------------


def _acts(found: Iterable[Act], channels: Channels) -> Iterator[Message]:
    for act in found:
        yield act.tag.time, channels.number(["aspects", act.aspect], "foxglove.Log", LOG), _log(act)


def _log(act: Act) -> dict[str, Any]:
    told = {"message": act.text, "name": act.aspect, "file": "", "line": 0}
    return {"timestamp": _time(act.tag.time), "level": INFO, **told}


def _firings(found: Iterable[tuple[Tag, str]], channels: Channels) -> Iterator[Message]:
    counts: dict[str, int] = {}
    for tag, actor in found:
        counts[actor] = count = counts.get(actor, 0) + 1
        number = channels.number(["firings", *parts(actor)], "epicycle.Firing", FIRING)
        yield tag.time, number, {"microstep": tag.microstep, "count": count}


LOG, FIRING = _fitting([_log(Act(Tag(0, 0), "", ""))]), _fitting([{"microstep": 0, "count": 0}])
