"""What differs between two recordings of the same model, or of two: first record, first firing, metrics, actors."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import takewhile, zip_longest
from typing import Any

from epicycle.actors import Tag, shortened

from ...support.shown import in_words
from .recording import NOTHING, Kept, Recording

_WIDEST, _NARROW = 80, 40  # characters of a token, and of one of several


@dataclass(frozen=True)
class First:
    """The first firing that is not the same in two runs, or that only one of them has; in words, what it does in each.

    ``numbers`` are those that it has in each, None where it is missing.
    """

    actor: str
    at: Tag
    numbers: tuple[int | None, int | None]
    does: tuple[str, ...]

    @property
    def time(self) -> float:
        return self.at.seconds

    @property
    def tag(self) -> str:
        return f"({self.time:.9g} s, {self.at.microstep})"


def difference(recordings: Sequence[Recording]) -> dict[str, Any] | None:
    """The first record in which the logs differ, and the first firing: numbers among the kept ones, and words."""
    if (record := _first(*(each.hashes for each in recordings[:2]))) is None:
        return None
    first = first_firing(recordings)
    numbers = [NOTHING if n is None else n for n in ((None, None) if first is None else first.numbers)]
    return {
        "records": [each.among_kept("record", [record])[0] for each in recordings],
        "texts": [_said(each, record) for each in recordings],
        "firings": [each.among_kept("firing", [n])[0] for each, n in zip(recordings, numbers, strict=True)],
        "fired": [] if first is None else [f"{first.at} {first.actor} {each}" for each in first.does],
    }


def first_firing(recordings: Sequence[Recording]) -> First | None:
    """The first firing that took or sent something else, or that only one of the runs has."""
    one, other = (each.fired for each in recordings[:2])
    number = _first(one.hashes, other.hashes)
    if number is None:
        return None
    heads = {n: _head(each, number) for n, each in enumerate(recordings[:2]) if number < len(each.fired)}
    # If only one of them has it: the one that comes first, or that the other run does not have at this tag.
    which = min(heads, key=lambda n: (heads[n][0], _comes(recordings[1 - n], number, heads[n])))
    tag, actor = heads[which]
    numbers = [number if heads.get(n) == heads[which] else None for n in (0, 1)]
    does = [
        "does not fire" if n is None else _took(recording, n) for recording, n in zip(recordings, numbers, strict=False)
    ]
    return First(actor, tag, (numbers[0], numbers[1]), tuple(does))


def _head(recording: Recording, number: int) -> tuple[Tag, str]:
    fired = recording.fired
    return fired.tag(number), list(recording.places)[fired.actors[number]]


def _comes(recording: Recording, number: int, head: tuple[Tag, str]) -> bool:
    """Whether a run has a firing of this actor at this tag, from a number on."""
    (tag, path), fired = head, recording.fired
    actor = recording.places.get(path)
    until_then = takewhile(lambda n: fired.tag(n) <= tag, range(number, len(fired)))
    return any(fired.actors[n] == actor and fired.tag(n) == tag for n in until_then)


def affected(recordings: Sequence[Recording]) -> dict[str, Tag]:
    """The actors whose firings are not the same in both runs, with the tag of the first one, in that order."""
    found: dict[str, Tag] = {}
    both = [_by_actor(each) for each in recordings[:2]]
    for actor in {**both[0], **both[1]}:
        for numbers in zip_longest(*(each.get(actor, ()) for each in both)):
            here = [(each.fired, n) for each, n in zip(recordings, numbers, strict=True) if n is not None]
            if len(here) == 1 or here[0][0].hashes[here[0][1]] != here[1][0].hashes[here[1][1]]:
                found[actor] = min(fired.tag(n) for fired, n in here)
                break
    return dict(sorted(found.items(), key=lambda each: (each[1], each[0])))


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
    where = f"{kept.tags[tag]} {list(recording.places)[place]}.{name}"
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
