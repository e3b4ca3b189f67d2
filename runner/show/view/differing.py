"""What differs between two recordings of the same model, or of two: first record, first firing, metrics, actors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from epicycle.actors import Tag, shortened

from ...support.shown import in_words
from .recording import NOTHING, Recording

_WIDEST, _NARROW = 80, 40  # characters of a token, and of one of several


class FirstFiring(NamedTuple):
    """The first firing that is not the same in two runs; ``numbers`` are those in each, None where it is missing.

    Without one of them, the actor does not fire at that tag in that run.
    """

    actor: str
    tag: Tag
    numbers: tuple[int | None, int | None]


def difference(recordings: Sequence[Recording]) -> dict[str, Any] | None:
    """The first record in which the logs differ, and the first firing: numbers among the kept ones, and words."""
    if (record := _first(*(each.hashes for each in recordings[:2]))) is None:
        return None
    firing = first_firing(recordings)
    numbers: Sequence[int | None] = (None, None) if firing is None else firing.numbers
    return {
        "records": [each.kept_record(record) for each in recordings],
        "texts": [said(each, record) for each in recordings],
        "firings": [NOTHING if n is None else each.kept_firing(n) for each, n in zip(recordings, numbers, strict=True)],
        "fired": []
        if firing is None
        else [f"{firing.tag} {firing.actor} {each}" for each in fired(recordings, firing)],
    }


def first_firing(recordings: Sequence[Recording]) -> FirstFiring | None:
    """The first firing that took or sent something else, or that only one of the runs has."""
    one, other = (each.fired for each in recordings[:2])
    number = _first(one.hashes, other.hashes)
    if number is None:
        return None
    heads = {n: _head(each, number) for n, each in enumerate(recordings[:2]) if number < len(each.fired)}
    if len(heads) == 2 and heads[0] == heads[1]:
        return FirstFiring(heads[0][1], heads[0][0], (number, number))
    # Only one of them has this firing: the one that comes first, or that the other run does not have at this tag.
    which = min(heads, key=lambda n: (heads[n][0], _comes(recordings[1 - n], number, heads[n])))
    tag, actor = heads[which]
    return FirstFiring(actor, tag, (number, None) if which == 0 else (None, number))


def _head(recording: Recording, number: int) -> tuple[Tag, str]:
    fired = recording.fired
    return fired.tag(number), recording.place(fired.actors[number])


def _comes(recording: Recording, number: int, head: tuple[Tag, str]) -> bool:
    """Whether a run has a firing of this actor at this tag, from a number on."""
    while number < len(recording.fired) and recording.fired.tag(number) <= head[0]:
        if _head(recording, number) == head:
            return True
        number += 1
    return False


def affected(recordings: Sequence[Recording]) -> dict[str, Tag]:
    """The actors whose firings are not the same in both runs, with the tag of the first one, in that order."""
    found: dict[str, Tag] = {}
    both = [_by_actor(each) for each in recordings[:2]]
    for actor in dict.fromkeys([*both[0], *both[1]]):
        rows = [each.get(actor, []) for each in both]
        number = _first(
            *([recording.fired.hashes[n] for n in row] for recording, row in zip(recordings, rows, strict=False))
        )
        if number is not None:
            tags = [rec.fired.tag(row[number]) for rec, row in zip(recordings, rows, strict=False) if number < len(row)]
            found[actor] = min(tags)
    return dict(sorted(found.items(), key=lambda each: (each[1], each[0])))


def _by_actor(recording: Recording) -> dict[str, list[int]]:
    rows: dict[int, list[int]] = {}
    for number, actor in enumerate(recording.fired.actors):
        rows.setdefault(actor, []).append(number)
    return {recording.place(actor): found for actor, found in rows.items()}


def _first(one: Sequence[int], other: Sequence[int]) -> int | None:
    """Where two sequences differ first; None if they are equal."""
    same = next((n for n, (a, b) in enumerate(zip(one, other, strict=False)) if a != b), min(len(one), len(other)))
    return None if same == len(one) == len(other) else same


def said(recording: Recording, record: int) -> str:
    """A record of the log in words."""
    number = recording.kept_record(record)
    if number < 0:
        return "the run has ended" if record >= recording.records else "a record that this page leaves out"
    kept = recording.kept()
    return f"{kept.tags[kept.columns['record_tag'][number]]} {_record(recording, number)}"


def _record(recording: Recording, number: int) -> str:
    columns, _, texts = recording.kept()
    place, name = list(recording.ports)[columns["record_port"][number]]
    event, aspect = list(recording.events)[columns["record_event"][number]], columns["record_aspect"][number]
    by = f" by {list(recording.aspects)[aspect]}" if aspect != NOTHING else ""
    text = shortened(texts[columns["record_text"][number]], _WIDEST)
    return f"{recording.place(place)}.{name} {event}{by}: {text}"


def fired(recordings: Sequence[Recording], firing: FirstFiring) -> list[str]:
    """What a firing took and sent in each run, in words."""
    return [
        "does not fire" if number is None else _took(recording, recording.kept_firing(number))
        for recording, number in zip(recordings, firing.numbers, strict=False)
    ]


def _took(recording: Recording, firing: int) -> str:
    if firing < 0:
        return "a firing that this page leaves out"
    columns, ports, texts = recording.kept().columns, list(recording.ports), recording.kept().texts
    took = []
    for row, owner in enumerate(columns["arrival_firing"]):
        if owner == firing:
            record = columns["arrival_record"][row]
            token = f" {shortened(texts[columns['record_text'][record]], _NARROW)}" if record >= 0 else ""
            took.append(f"{ports[columns['arrival_port'][row]][1]}{token}")
    woke = ["a wake-up"] * columns["wake_firing"].count(firing)
    sent = []
    for row, owner in enumerate(columns["record_firing"]):
        if owner == firing and columns["record_aspect"][row] == NOTHING:
            sent.append(
                f"{ports[columns['record_port'][row]][1]} {shortened(texts[columns['record_text'][row]], _NARROW)}"
            )
    return f"takes {', '.join([*took, *woke]) or 'nothing'}; sends {', '.join(sent) or 'nothing'}"


def comparison(recordings: Sequence[Recording]) -> list[list[str]]:
    """The metrics of two runs, and their differences, in words."""
    rows = []
    one, other = (each.results for each in recordings[:2])
    assert one is not None
    assert other is not None
    for name, value in one.metrics.items():
        if name in other.metrics:
            numbers = [each for each in (value, other.metrics[name]) if isinstance(each, (int, float))]
            change = four(float(numbers[1] - numbers[0])) if len(numbers) == 2 else ""
            rows.append([name, one.outcomes[name].shown(four), other.outcomes[name].shown(four), change])
    return rows


def four(value: Any) -> str:
    """A value with four digits."""
    return in_words(value, digits=4, nothing="–")
