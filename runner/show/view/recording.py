"""Records a run for a page: which actors fired when, what they sent, and what caused it, in columns.

A recording holds each firing, each record of the event log, each token that arrived and each wake-up.  Above a number
of firings, it is thinned as it grows: firings are kept in stretches, and whenever there are too many, every second
stretch is dropped.  The rest is spread evenly over the run and complete within each stretch, and the page shows what is
missing.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from epicycle.actors import EpicycleError, Tag

from ...execution.engine import Firing, Interventions, Simulation, Tracer
from ...execution.results import Record, Results, canonical, plain
from ...model.build.model import Model
from ...model.catalogue.figure import Figure
from ...model.text.patterns import select
from ...support.shown import json_line

MOST = 1_600_000  # firings that are kept: a page of some 15 MB
STRETCH = 512  # firings in a row that are kept or left out together
LONGEST = 160  # characters per token
MISSING, NOTHING = -2, -1  # in a column of numbers: left out, or non-existent


class ViewError(EpicycleError):
    """A page or another file that shows a run cannot be made."""


class Names(dict[Any, int]):
    """Numbers things in the order in which they are first looked up."""

    def __missing__(self, key: Any) -> int:
        self[key] = number = len(self)
        return number


# The columns of firings, of records, of tokens that arrived and of wake-ups.  Firings and records are referenced by
# number: ``record_firing`` is the firing that caused a record, ``record_about`` the send that an act of an aspect
# concerns, ``arrival_record`` the send of a token, ``wake_tag`` when a wake-up was requested, if not in ``initialize``.
COLUMNS = {
    "firing": ("tag", "actor", "outside"),
    "record": ("tag", "firing", "port", "channel", "event", "aspect", "text", "about"),
    "arrival": ("firing", "port", "channel", "record"),
    "wake": ("firing", "tag"),
}
REFERENCES = {"firing": "firing", "record": "record", "about": "record"}  # of columns, what their numbers refer to
OUTSIDE = ("", "resumed", "released")


class Stretch:
    """Consecutive firings from a number on, and everything that belongs to them, in columns."""

    def __init__(self, firing: int, record: int) -> None:
        self.firing = firing
        self.record = record
        self.tags, self.texts = Names(), Names()  # here, so that they are dropped with the stretch
        self.columns = {f"{kind}_{name}": array("i") for kind, names in COLUMNS.items() for name in names}

    def add(self, kind: str, *row: int) -> None:
        for name, value in zip(COLUMNS[kind], row, strict=True):
            self.columns[f"{kind}_{name}"].append(value)

    def count(self, kind: str) -> int:
        return len(self.columns[f"{kind}_tag"])


class Kept(NamedTuple):
    """The columns of a recording; tags and texts are given by their numbers."""

    columns: dict[str, array[int]]
    tags: list[Tag]
    texts: list[str]


class Fired:
    """All firings of a run: their tags, actors by number, and hashes of what they took and sent."""

    def __init__(self) -> None:
        self.times, self.microsteps, self.actors, self.hashes = array("q"), array("i"), array("i"), array("q")

    def add(self, firing: Firing, actor: int) -> None:
        took = [(each.port, each.channel, canonical(each.token)) for each in firing.arrivals]
        sent = [record.encoded() for record in firing.records]
        self.times.append(firing.tag.time)
        self.microsteps.append(firing.tag.microstep)
        self.actors.append(actor)
        self.hashes.append(hash((firing.tag, firing.actor, firing.outside, *took, *sent)))

    def tag(self, number: int) -> Tag:
        return Tag(self.times[number], self.microsteps[number])

    def __len__(self) -> int:
        return len(self.hashes)


class Recording:
    """One run of a model, recorded as it runs; ``results`` holds its results, too.

    ``most`` is how many firings are kept.  The log is bit for bit that of any run with this model and seed; signals
    that the model's ``figures`` show in space are recorded as well.  With ``is_compared``, there are ``hashes`` of all
    records and of all firings, to find the first ones in which two runs differ.  ``acts`` say which acts of aspects
    happen.
    """

    def __init__(
        self,
        model: Model,
        figures: Mapping[str, Figure],
        *,
        seed: int | None = None,
        most: int = MOST,
        is_compared: bool = False,
        acts: Interventions | None = None,
    ) -> None:
        self.model = model
        self.figures = figures
        self.hashes = array("q")
        self.fired = Fired()
        self._is_compared = is_compared
        self.results: Results | None = None
        self.firings = self.records = 0  # in the whole run
        self.events, self.aspects = Names(), Names()
        self.places = Names()  # of actors and composites
        self.ports = Names()  # (place, name)
        self._most = max(2, most // STRETCH)
        self._stride = 1  # one stretch in so many is kept
        self._stretches: list[Stretch] = []
        self._last: Stretch | None = None
        # Acts at an output before their token is sent, by port and channel, and then by aspect: stretch and row.
        self._passing: dict[tuple[int, int], dict[int, tuple[int, int]]] = {}
        patterns = [pattern for figure in figures.values() for pattern in figure.mark_patterns()]
        outputs = [path for path in model.graph.ports if model.graph.direction(path) == "output"]
        recorded = model.output.recorded
        model.output.recorded = list(
            dict.fromkeys((*recorded, *(path for each in patterns for path in select(each, outputs))))
        )
        tracer = Tracer(model.graph.actors, self._fired, self._seen)
        self._simulation = Simulation(model, seed=seed, tracer=tracer, acts=acts)
        model.output.recorded = recorded

    def run(self, *, until: float | None = None, progress: Callable[[float], None] | None = None) -> Results:
        """Run to the end; an exception in an actor is raised as ``ActorError``; everything before it is recorded."""
        try:
            self.results = self._simulation.run(until=until, progress=progress)
        except BaseException as error:
            self.results = self._simulation.results("interrupted" if isinstance(error, KeyboardInterrupt) else "failed")
            raise
        return self.results

    def finished(self, what: str) -> Results:
        """The results; raises ``ViewError`` if ``what`` shows them is asked for before the run has been made."""
        if self.results is None:
            raise ViewError(f"{what} needs a run that has been made: call Recording.run first")
        return self.results

    def so_far(self) -> Results:
        """The results up to now, while it runs."""
        return self._simulation.results("not over")

    # -- events from the tracer -------------------------------------------------------------------------------------

    def _fired(self, firing: Firing) -> None:
        kept, number, actor = self._stretch(), self.firings, self.places[firing.actor]
        kept.add("firing", kept.tags[firing.tag], actor, OUTSIDE.index(firing.outside))
        for arrival in firing.arrivals:
            kept.add("arrival", number, self.ports[actor, arrival.port], arrival.channel, arrival.number)
        for asked in firing.wakes:
            kept.add("wake", number, NOTHING if asked is None else kept.tags[asked])
        if self._is_compared:
            self.fired.add(firing, actor)
        self._passing.clear()
        self.firings += 1

    def _seen(self, record: Record, is_own: bool, about: int) -> None:
        kept = self._stretch()
        port = self.ports[self.places[record.actor], record.port]
        channel = NOTHING if record.channel is None else record.channel
        aspect = self.aspects[record.aspect] if record.aspect else NOTHING
        if is_own:
            self._pass(kept, port, channel, aspect)
        kept.add(
            "record",
            kept.tags[record.tag],
            self.firings if is_own else NOTHING,
            port,
            channel,
            self.events[record.event],
            aspect,
            kept.texts[_text(record.value)],
            NOTHING if about == self.records else about,
        )
        if self._is_compared:
            self.hashes.append(hash(record.encoded()))
        self.records += 1

    def _pass(self, kept: Stretch, port: int, channel: int, aspect: int) -> None:
        """Assign acts at an output to the send that follows; to none if the aspect acts again before it."""
        passing = self._passing.setdefault((port, channel), {})
        if aspect == NOTHING:
            for firing, row in passing.values():
                if firing == kept.firing:
                    kept.columns["record_about"][row] = self.records
        if aspect == NOTHING or aspect in passing:
            passing.clear()
        if aspect != NOTHING:
            passing[aspect] = kept.firing, kept.count("record")

    def _stretch(self) -> Stretch:
        """The stretch for what happens now."""
        place = self.firings // STRETCH
        if self._last is None or self._last.firing != place * STRETCH:
            self._last = Stretch(place * STRETCH, self.records)
            if place % self._stride == 0:
                self._stretches.append(self._last)
            if len(self._stretches) > self._most:
                self._stride *= 2
                self._stretches = [each for each in self._stretches if each.firing // STRETCH % self._stride == 0]
        return self._last

    # -- kept data ----------------------------------------------------------------------------------------------------

    def kept(self) -> Kept:
        """Everything that was kept: firings and records are renumbered, tags are in order."""
        tags, texts = sorted({tag for stretch in self._stretches for tag in stretch.tags}), Names()
        place = {tag: number for number, tag in enumerate(tags)}
        columns = {name: array("i") for name in Stretch(0, 0).columns}
        for stretch in self._stretches:
            own_tags, own_texts = [place[tag] for tag in stretch.tags], [texts[text] for text in stretch.texts]
            for name, column in stretch.columns.items():
                if name.endswith("_tag"):
                    columns[name].extend(tag if tag < 0 else own_tags[tag] for tag in column)
                else:
                    columns[name].extend(map(own_texts.__getitem__, column) if name == "record_text" else column)
        for name, column in columns.items():
            if (what := REFERENCES.get(name.partition("_")[2])) is not None:
                columns[name] = array("i", self.among_kept(what, column))
        return Kept(columns, tags, list(texts))

    def among_kept(self, what: str, numbers: Sequence[int]) -> list[int]:
        """The numbers of firings or records among the kept ones; ``MISSING`` for those left out or not made."""
        starts = np.array([0, *(getattr(stretch, what) for stretch in self._stretches)])
        counts = np.array([0, *(stretch.count(what) for stretch in self._stretches)])
        old = np.array(numbers, dtype=int)
        at = np.searchsorted(starts, old, side="right") - 1
        new = np.cumsum(counts)[at] - counts[at] + old - starts[at]
        found: list[int] = np.where(old < 0, old, np.where(old < starts[at] + counts[at], new, MISSING)).tolist()
        return found

    def gaps(self) -> list[tuple[int, int]]:
        """The gaps between kept firings: the number of the first one after the gap, and how many are left out."""
        found, kept, before = [], 0, 0
        for stretch in self._stretches:
            if stretch.firing > before:
                found.append((kept, stretch.firing - before))
            kept += stretch.count("firing")
            before = stretch.firing + stretch.count("firing")
        return [*found, (kept, self.firings - before)] if self.firings > before else found


def _text(token: Any) -> str:
    if type(token) is float:  # as most are, and as ``json_line`` writes it
        return f"{token:.6g}"
    return json_line(plain(token), LONGEST)
