"""Writes a run as an MCAP file for Foxglove and Lichtblick: Foxglove's own messages, and signals and firings in JSON.

Lichtblick reads a subset of JSON Schema: objects, and arrays of numbers, texts or objects.  Other content of tokens is
converted: matrices become arrays, row by row, and values of several types become text.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Iterator
from heapq import merge
from io import BytesIO
from itertools import chain
from operator import itemgetter
from pathlib import Path
from typing import Any

import foxglove
from foxglove import messages as fox
from foxglove.channels import FrameTransformChannel, LogChannel, SceneUpdateChannel
from foxglove.mcap import MCAPWriteOptions

from epicycle.actors import Tag

from ...execution.results import Signal, plain
from ...support.files import replace_file
from ...support.shown import finite
from .export import Act, Colour, Disc, Point, Scene, Thing, about, acts, encodable, extent, firings, parts, things
from .recording import Recording, ViewError

WORLD = "world"  # the frame of all positions
FAINT = 0.25  # opacity of discs
MOST = 65_535  # channels per file
SHARE = 0.012  # diameter of a point, relative to the whole space

Schema = dict[str, Any]
Message = tuple[int, Any, Any]  # time (ns), channel, content


def write_mcap(recording: Recording, path: Path) -> None:
    """Write an MCAP file of a run; raises ``ViewError``."""
    replace_file(path, mcap(recording), ViewError)


def mcap(recording: Recording) -> bytes:
    """The content of a run's MCAP file; equal for equal runs with the same version of the library."""
    file, channels = BytesIO(), Channels()
    placed = things(recording)
    _, width = extent(placed)
    streams = [
        *(_signal(signal, channels) for signal in recording.finished("a file").signals.values()),
        *(_space(thing, SHARE * width, channels) for thing in placed),
        *(_frames(thing, channels) for thing in placed if thing.kind == "body"),
        _acts(acts(recording), channels),
        _firings(firings(recording), channels),
    ]
    options = MCAPWriteOptions(compression_threads=0)  # the bytes do not depend on how many there are
    with foxglove.open_mcap(file, context=channels.context, writer_options=options) as writer:
        writer.write_metadata("run", about(recording))
        for time, channel, message in merge(*streams, key=itemgetter(0)):
            channel.log(message, log_time=time)
    return file.getvalue()


class Channels:
    """The channels of a file, by topic."""

    def __init__(self) -> None:
        self.context = foxglove.Context()
        self._made: dict[str, Any] = {}

    def of(self, kind: Callable[..., Any], *topic: str, **given: Schema) -> Any:
        path = "/" + "/".join(topic)
        if path not in self._made:
            if len(self._made) == MOST:  # the library would leave out the messages of further ones
                raise ViewError(
                    f"an MCAP file holds at most {MOST:,} channels, and the run has more signals and actors"
                )
            self._made[path] = kind(path, context=self.context, **given)
        return self._made[path]


# -- signals and firings ----------------------------------------------------------------------------------------------


def _signal(signal: Signal, channels: Channels) -> Iterator[Message]:
    schema = _fitting({"microstep": 0, "value": each} for each in (None, *map(_flat, map(plain, signal.tokens))))
    about = {"title": f"epicycle.{signal.name}", **schema}
    channel = channels.of(foxglove.Channel, "signals", *parts(signal.name), schema=about)
    for tag, token in signal:
        value = _fitted(finite(_flat(plain(token))), schema["properties"]["value"])
        yield tag.time, channel, {"microstep": tag.microstep, "value": value}


def _fitting(values: Iterable[Any], empty: str = "string") -> Schema:
    """The schema that all of these values fit: text if no other does, and the type ``empty`` if all are None."""
    found = [value for value in values if value is not None]
    if not found:
        return {"type": empty}
    if all(isinstance(value, dict) for value in found):
        names = dict.fromkeys(chain.from_iterable(found))
        return {"type": "object", "properties": {name: _fitting(each.get(name) for each in found) for name in names}}
    if all(isinstance(value, list) for value in found):
        return {"type": "array", "items": _fitting(chain.from_iterable(found), "number")}
    if all(isinstance(value, bool) for value in found):
        return {"type": "boolean"}
    if any(isinstance(value, (bool, str, dict, list)) for value in found):
        return {"type": "string"}
    return {"type": "integer" if all(isinstance(value, int) for value in found) else "number"}


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


def _firings(found: Iterable[tuple[Tag, str]], channels: Channels) -> Iterator[Message]:
    counts: dict[str, int] = {}
    for tag, actor in found:
        counts[actor] = count = counts.get(actor, 0) + 1
        channel = channels.of(foxglove.Channel, "firings", *parts(actor), schema=FIRING)
        yield tag.time, channel, {"microstep": tag.microstep, "count": count}


FIRING = {"title": "epicycle.Firing", **_fitting([{"microstep": 0, "count": 0}])}

# -- space and acts ---------------------------------------------------------------------------------------------------


def _space(thing: Thing, size: float, channels: Channels) -> Iterator[Message]:
    channel = channels.of(SceneUpdateChannel, "space", thing.kind, *parts(thing.name))
    for scene in thing.scenes:
        yield scene.time, channel, fox.SceneUpdate(entities=[_entity(thing, scene, size)])


def _entity(thing: Thing, scene: Scene, size: float) -> fox.SceneEntity:
    paint, cube = _paint(thing.colour), fox.Vector3(x=size, y=size, z=size)
    return fox.SceneEntity(
        timestamp=_time(scene.time),
        frame_id=WORLD,
        id=f"{thing.kind} {thing.name}",
        lifetime=fox.Duration(sec=0),  # until the next one
        frame_locked=True,
        metadata=[fox.KeyValuePair(key="name", value=thing.name)],
        spheres=[fox.SpherePrimitive(pose=_pose(*point), size=cube, color=paint) for point in scene.points],
        cylinders=[_cylinder(disc, size, _paint(thing.colour, FAINT)) for disc in scene.discs],
        lines=[_line(path, paint) for path in scene.paths],
        texts=[_label(thing.label, x, y + 1.5 * size, paint) for x, y in scene.points if thing.label],
    )


def _cylinder(disc: Disc, size: float, paint: fox.Color) -> fox.CylinderPrimitive:
    extent = fox.Vector3(x=2.0 * disc.along, y=2.0 * disc.across, z=size / 10.0)
    pose = _pose(disc.x, disc.y, disc.angle)
    return fox.CylinderPrimitive(pose=pose, size=extent, bottom_scale=1.0, top_scale=1.0, color=paint)


def _line(path: list[Point], paint: fox.Color) -> fox.LinePrimitive:
    points = [fox.Point3(x=x, y=y) for x, y in path]
    return fox.LinePrimitive(pose=_pose(0.0, 0.0), thickness=2.0, scale_invariant=True, points=points, color=paint)


def _label(text: str, x: float, y: float, paint: fox.Color) -> fox.TextPrimitive:
    look: Any = {"billboard": True, "font_size": 14.0, "scale_invariant": True}  # in pixels
    return fox.TextPrimitive(pose=_pose(x, y), color=paint, text=text, **look)


def _frames(thing: Thing, channels: Channels) -> Iterator[Message]:
    """A frame for each body, which a viewer can follow."""
    channel = channels.of(FrameTransformChannel, "frames", *parts(thing.name))
    for scene in thing.scenes:
        for x, y in scene.points:
            frame = fox.FrameTransform(
                timestamp=_time(scene.time),
                parent_frame_id=WORLD,
                child_frame_id=thing.label,
                translation=fox.Vector3(x=x, y=y),
                rotation=_turn(0.0),
            )
            yield scene.time, channel, frame


def _acts(found: Iterable[Act], channels: Channels) -> Iterator[Message]:
    for tag, aspect, text in found:
        told = fox.Log(timestamp=_time(tag.time), level=fox.LogLevel.Info, message=encodable(text), name=aspect)
        yield tag.time, channels.of(LogChannel, "aspects", aspect), told


def _turn(angle: float) -> fox.Quaternion:
    return fox.Quaternion(z=math.sin(angle / 2.0), w=math.cos(angle / 2.0))


def _pose(x: float, y: float, angle: float = 0.0) -> fox.Pose:
    return fox.Pose(position=fox.Vector3(x=x, y=y), orientation=_turn(angle))


def _paint(colour: Colour, opacity: float = 1.0) -> fox.Color:
    red, green, blue = (each / 255.0 for each in colour)
    return fox.Color(r=red, g=green, b=blue, a=opacity)


def _time(nanoseconds: int) -> fox.Timestamp:
    seconds, rest = divmod(nanoseconds, 10**9)
    return fox.Timestamp(sec=seconds, nsec=rest)
