"""What differs between two recordings of the same model, or of two: first record, first firing, metrics, actors."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import zip_longest
from typing import Any

from epicycle.actors import NEVER, Tag, shortened

from ...support.shown import in_words
from .recording import NOTHING, Kept, Recording

_WIDEST, _NARROW = 80, 40  # characters of a token, and of one of several
_NEVER = Tag(NEVER, 0)


@dataclass(frozen=True)
class First:
    """The first firing of an actor that is not the same in two runs, or that only one of them has.

    ``numbers`` are those that it has in each, None where it is missing.
    """

    actor: str
    at: Tag
    numbers: tuple[int | None, ...]
    recordings: Sequence[Recording] = field(repr=False, compare=False)

    @property
    def time(self) -> float:
        return self.at.seconds

    @property
    def tag(self) -> str:
        return _told(self.at)

    @property
    def does(self) -> tuple[str, ...]:
        """What it does in each run, in words."""
        both = zip(self.recordings, self.numbers, strict=True)
        return tuple("does not fire" if n is None else _took(recording, n) for recording, n in both)


def difference(recordings: Sequence[Recording]) -> dict[str, Any] | None:
    """The first record in which the logs differ, and the first firing: numbers among the kept ones, and words."""
    if (record := _first(*(each.hashes for each in recordings[:2]))) is None:
        return None
    first = next(iter(changed(recordings)), None)
    numbers = [NOTHING if n is None else n for n in ((None, None) if first is None else first.numbers)]
    return {
        "records": [each.among_kept("record", [record])[0] for each in recordings],
        "texts": [_said(each, record) for each in recordings],
        "firings": [each.among_kept("firing", [n])[0] for each, n in zip(recordings, numbers, strict=True)],
        "fired": [] if first is None else [f"{first.tag} {first.actor} {each}" for each in first.does],
    }


def changed(recordings: Sequence[Recording]) -> list[First]:
    """The first firing of each actor that took or sent something else, or that only one of the runs has, in order."""
    both, found = recordings[:2], []
    own = [_by_actor(each) for each in both]
    for actor in dict.fromkeys([*own[0], *own[1]]):
        runs = [(each.fired, firings.get(actor, [])) for each, firings in zip(both, own, strict=True)]
        place = _first(*([fired.hashes[n] for n in firings] for fired, firings in runs))
        if place is not None:
            tags = [fired.tag(firings[place]) if place < len(firings) else _NEVER for fired, firings in runs]
            at = min(tags)
            numbers = [firings[place] if tag == at else None for (_, firings), tag in zip(runs, tags, strict=True)]
            found.append(First(actor, at, tuple(numbers), both))
    return sorted(found, key=lambda each: (each.at, min(n for n in each.numbers if n is not None)))


def _by_actor(recording: Recording) -> dict[str, list[int]]:
    rows = defaultdict[int, list[int]](list)
    for number, actor in enumerate(recording.fired.actors):
        rows[actor].append(number)
    places = list(recording.places)
    return {places[actor]: found for actor, found in rows.items()}


def _first(one: Sequence[int], other: Sequence[int]) -> int | None:
    """Where two sequences differ first; None if they are equal."""
    return next((n for n, (a, b) in enumerate(zip_longest(one, other)) if a != b), None)


def _said(recording: Recording, record: int) -> str:
    """A record of the log in words."""
    (number,) = recording.among_kept("record", [record])
    if number < 0:
        return "the run has ended" if record >= recording.records else "a record that this page leaves out"
    kept = recording.kept()
    tag, port, event, aspect = (kept.columns[f"record_{each}"][number] for each in ("tag", "port", "event", "aspect"))
    place, name = list(recording.ports)[port]
    by = f" by {list(recording.aspects)[aspect]}" if aspect != NOTHING else ""
    where = f"{_told(kept.tags[tag])} {list(recording.places)[place]}.{name}"
    return f"{where} {list(recording.events)[event]}{by}: {_token(kept, number, _WIDEST)}"


def _took(recording: Recording, number: int) -> str:
    """What a firing took and sent, in words."""
    (firing,) = recording.among_kept("firing", [number])
    if firing < 0:
        return "a firing that this page leaves out"
    kept, ports = recording.kept(), [name for _, name in recording.ports]
    columns = kept.columns

    def rows(kind: str) -> list[int]:
        return [row for row, owner in enumerate(columns[f"{kind}_firing"]) if owner == firing]

    def said(port: int, record: int) -> str:
        return f"{ports[port]} {_token(kept, record, _NARROW)}".rstrip()

    took = [said(columns["arrival_port"][row], columns["arrival_record"][row]) for row in rows("arrival")]
    woke = ["a wake-up" for _ in rows("wake")]
    sent = [said(columns["record_port"][r], r) for r in rows("record") if columns["record_aspect"][r] == NOTHING]
    return f"takes {', '.join([*took, *woke]) or 'nothing'}; sends {', '.join(sent) or 'nothing'}"


def _told(tag: Tag) -> str:
    """A tag in words, to the nanosecond."""
    return f"({tag.seconds:.15g} s, {tag.microstep})"


def _token(kept: Kept, record: int, widest: int) -> str:
    """What a record holds; nothing if it is not kept."""
    return shortened(kept.texts[kept.columns["record_text"][record]], widest) if record >= 0 else ""


def comparison(recordings: Sequence[Recording]) -> list[list[str]]:
    """The metrics of two runs, and their differences, in words."""
    rows = []
    one, other = (each.finished("a comparison") for each in recordings[:2])
    for name, value in one.metrics.items():
        if name in other.metrics:
            numbers = [each for each in (value, other.metrics[name]) if isinstance(each, (int, float))]
            change = four(float(numbers[1] - numbers[0])) if len(numbers) == 2 else ""
            rows.append([name, one.outcomes[name].shown(four), other.outcomes[name].shown(four), change])
    return rows


def four(value: Any) -> str:
    """A value with four digits."""
    return in_words(value, digits=4, nothing="–")
