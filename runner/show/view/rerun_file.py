"""Writes a run as a recording for rerun: by time, and by tag, where each microstep has its own place."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Iterable, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow
import rerun
import rerun.blueprint as views
from rerun.blueprint import StateTimelineView  # other packages of this name do not have it

from epicycle.actors import Tag

from ...execution.results import Signal
from ...support.files import replace_file
from ..samples import columns, selected
from .export import Act, Disc, Thing, about, acts, encodable, extent, firings, parts, things
from .recording import Recording, ViewError

PIXELS = 5.0  # radius of a point
AWAY = 1.4  # times the width of the space: from there, the camera sees all of it
THICKNESS = 1.0  # radius of a line, in pixels
PLACES = 128  # in the tokens of a signal, each an entity; further ones are left out
LAST = 2**62  # microstep after all others of an instant


def write_rerun(recording: Recording, path: Path) -> None:
    """Write a recording for rerun; raises ``ViewError``."""
    replace_file(path, _Writer(recording).written(), ViewError)


class _Writer:
    """Writes the parts of a run to one stream."""

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self._signals = list(recording.finished("a file").signals.values())
        self._things, self._acts = things(recording), list(acts(recording))
        self._fired: dict[str, list[Tag]] = {}
        for tag, actor in firings(recording):
            self._fired.setdefault(actor, []).append(tag)
        told = (*(signal.tags for signal in self._signals), *self._fired.values(), [act.tag for act in self._acts])
        self._tags = sorted(set(chain.from_iterable(told)))
        # No wall clock and no random name, so equal runs give equal recordings.
        digest = recording.finished("a file").digest
        self._stream = rerun.RecordingStream("epicycle", recording_id=digest, send_properties=False)

    def written(self) -> bytes:
        """The content of the file."""
        file = self._stream.binary_stream()
        self._stream.send_blueprint(self._blueprint())
        self._stream.log("space", rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        self._about()
        for signal in self._signals:
            self._signal(signal)
        for thing in self._things:
            self._space(thing)
        self._act()
        for actor, tags in self._fired.items():
            counts = np.arange(1.0, len(tags) + 1.0)
            self._send(["firings", *parts(actor)], tags, rerun.Scalars.columns(scalars=counts))
        data: bytes = file.read()
        self._stream.disconnect()
        return data

    def _send(self, path: list[str], tags: Sequence[Tag], columns: Iterable[Any]) -> None:
        times = rerun.TimeColumn("time", duration=np.array([tag.time for tag in tags], dtype="m8[ns]"))
        places = [max(0, bisect_right(self._tags, tag) - 1) for tag in tags]
        indices = [times, rerun.TimeColumn("tag", sequence=places)]
        self._stream.send_columns(rerun.new_entity_path(path), indices, columns, strict=True)

    def _blueprint(self) -> Any:
        """The initial view: the space beside the signals of the model's figures, states and acts."""
        results, figures = self._recording.finished("a file"), self._recording.figures.items()
        lines = [
            views.TimeSeriesView(name=name, origin="/signals", contents=[self._below(each) for each in shown])
            for name, figure in figures
            if getattr(figure, "style", "") and (shown := selected(figure.signal_patterns(), results))
        ]
        recorded = [self._below(name) for name in results.signals if name in self._recording.model.output.recorded]
        words = [
            StateTimelineView(name="states", origin="/signals", contents=recorded),
            views.TextLogView(name="aspects", origin="/aspects"),
            views.TextDocumentView(name="run", origin="/about"),
        ]
        tabs = views.Tabs(*(lines or [views.TimeSeriesView(name="signals", origin="/signals", contents=recorded)]))
        beside = views.Vertical(tabs, views.Tabs(*words))
        space = [self._space_from_above()] if self._things else []
        return views.Blueprint(views.Horizontal(*space, beside), collapse_panels=True)

    def _space_from_above(self) -> Any:
        (x, y), width = extent(self._things)
        eye = views.EyeControls3D(position=(x, y, AWAY * width), look_target=(x, y, 0.0), eye_up=(0.0, 1.0, 0.0))
        return views.Spatial3DView(name="space", origin="/space", eye_controls=eye)

    def _below(self, signal: str) -> str:
        path: str = rerun.new_entity_path(["signals", *parts(signal)])
        return f"{path}/**"

    def _about(self) -> None:
        rows = ("| {} | {} |".format(name, text.replace("|", "\\|")) for name, text in about(self._recording).items())
        text = "\n".join(("| run | |", "|---|---|", *rows))
        self._stream.log("about", rerun.TextDocument(text, media_type="text/markdown"), static=True)

    def _signal(self, signal: Signal) -> None:
        """Log each number in the tokens over time, and each state."""
        tags, (numbers, states) = signal.tags, columns(signal, PLACES)
        for where, (rows, values) in numbers.items():
            path = ["signals", *parts(where)]
            self._send(path, [tags[row] for row in rows], rerun.Scalars.columns(scalars=values))
        for where, (rows, found) in states.items():
            path = ["signals", *parts(where)]
            # An Arrow array: rerun would write None in a list as the text "None".
            texts = pyarrow.array([each and encodable(each) for each in found], pyarrow.string())
            self._send(path, [tags[row] for row in rows], rerun.StateChange.columns(state=texts))

    def _space(self, thing: Thing) -> None:
        path = ["space", thing.kind, *parts(thing.name)]
        thin, paint = rerun.Radius.ui_points(THICKNESS), [thing.colour]
        look: dict[str, Any] = {"line_radii": thin, "colors": paint, "fill_mode": "transparentfillmajorwireframe"}
        named = {"labels": [thing.label], "show_labels": True} if thing.label else {}
        # Each kind of shape: its style, and the shapes of each scene as columns.
        shapes: list[tuple[Any, list[list[Any]], Callable[[Any], Any]]] = [
            (
                rerun.Points3D.from_fields(radii=rerun.Radius.ui_points(PIXELS), colors=paint, **named),
                [[(x, y, 0.0) for x, y in scene.points] for scene in thing.scenes],
                lambda points: rerun.Points3D.columns(positions=points),
            ),
            (
                rerun.Cylinders3D.from_fields(**look),
                [[disc for disc in scene.discs if disc.along == disc.across] for scene in thing.scenes],
                self._circles,
            ),
            (
                rerun.Ellipsoids3D.from_fields(**look),
                [[disc for disc in scene.discs if disc.along != disc.across] for scene in thing.scenes],
                self._ellipses,
            ),
            (
                rerun.LineStrips3D.from_fields(radii=thin, colors=paint),
                [[[(x, y, 0.0) for x, y in way] for way in scene.paths] for scene in thing.scenes],
                lambda strips: rerun.LineStrips3D.columns(strips=strips),
            ),
        ]
        columns: list[Any] = []
        for style, rows, made in shapes:
            if any(rows):
                self._stream.log(rerun.new_entity_path(path), style, static=True)
                columns += made([*chain.from_iterable(rows)]).partition([len(row) for row in rows])
        if columns:
            self._send(path, [Tag(scene.time, LAST) for scene in thing.scenes], columns)

    def _circles(self, discs: list[Disc]) -> Any:
        return rerun.Cylinders3D.columns(
            centers=[(disc.x, disc.y, 0.0) for disc in discs],
            radii=[disc.along for disc in discs],
            lengths=[0.0] * len(discs),
        )

    def _ellipses(self, discs: list[Disc]) -> Any:
        turns = [disc.angle / 2.0 for disc in discs]
        return rerun.Ellipsoids3D.columns(
            centers=[(disc.x, disc.y, 0.0) for disc in discs],
            half_sizes=[(disc.along, disc.across, 0.0) for disc in discs],
            quaternions=[(0.0, 0.0, math.sin(turn), math.cos(turn)) for turn in turns],
        )

    def _act(self) -> None:
        told: dict[str, list[Act]] = {}
        for act in self._acts:
            told.setdefault(act.aspect, []).append(act)
        for aspect, found in told.items():
            texts = [encodable(act.text) for act in found]
            columns = rerun.TextLog.columns(text=texts, level=["INFO"] * len(found))
            self._send(["aspects", aspect], [act.tag for act in found], columns)
