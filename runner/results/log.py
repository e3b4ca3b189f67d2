"""The event log: every send and every act of an aspect, in order, and the digest of them all."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from epicycle.actors import EpicycleError, Tag, When, new_tag, to_seconds

from ..shown import short
from ..tables import pandas_module
from .encoding import canonical, plain
from .packing import TAKES_NUMBERS, Sheet, stamp
from .samples import Past
from .waiting import LARGE, WaitingTokens

if TYPE_CHECKING:
    import pandas

COLUMNS = ("time", "microstep", "event", "actor", "port", "channel", "aspect", "value")
_MANY = 1_000  # records that are hashed together at the end of a tag
_MOST = 10_000


Names = tuple[str, str, str, "int | None", str]  # event, actor, port, channel, aspect


class LogError(EpicycleError):
    """A log that cannot be written."""


@dataclass(frozen=True, slots=True)
class Record:
    """One line of the event log; ``event`` is "send" or what an aspect did, ``channel`` is None for all channels."""

    tag: Tag
    event: str
    actor: str
    port: str
    channel: int | None
    aspect: str
    value: Any

    def encoded(self, *, microstep: bool = True) -> bytes:
        """The record in the canonical form that the digest uses; without the microstep if ``microstep`` is false."""
        names = map(canonical, (self.event, self.actor, self.port, self.aspect, self.channel))
        tag = self.tag if microstep else Tag(self.tag.time, 0)
        return stamp(tag) + b"".join(names) + canonical(self.value)

    def __str__(self) -> str:
        channel = "" if self.channel is None else f"[{self.channel}]"
        what = f"{self.aspect}: {self.event}" if self.aspect else self.event
        place = f"{self.actor}.{self.port}{channel}" if self.port else self.actor
        return f"({to_seconds(self.tag.time):g} s, {self.tag.microstep}) {place} {what} {short(self.value)}"

    def row(self) -> tuple[float, int, str, str, str, int | None, str, str]:
        """The record in the columns of a file; the value is JSON text."""
        return (
            to_seconds(self.tag.time),
            self.tag.microstep,
            self.event,
            self.actor,
            self.port,
            self.channel,
            self.aspect,
            json.dumps(plain(self.value)),
        )


class Writer:
    """Appends records with the same names to a log; each needs only a tag and a value."""

    __slots__ = ("_head", "_keep", "log", "names")

    def __init__(self, log: EventLog, names: Names, keep: Callable[[Record], None] | None) -> None:
        event, actor, port, channel, aspect = self.names = names
        self.log = log
        self._head = b"".join(map(canonical, (event, actor, port, aspect, channel)))
        self._keep = keep

    def write(self, when: When, value: Any) -> None:
        """Append a record; raises an exception if the value cannot be logged."""
        log = self.log
        sheet = log.sheet
        if when is not log.when:
            log.turn_to(when)
        if not (TAKES_NUMBERS and sheet.add(self._head, value)):
            kept = log.tokens[type(value)](value)
            sheet.keep(self._head, kept)
            if type(kept) is bytes and len(kept) > LARGE:
                log.hash_records()
        if sheet.size > _MOST:  # nearly all at one tag
            log.hash_many(f"{self.names[1]}.{self.names[2]}")
        if self._keep is not None:
            self._keep(Record(_tag(when), *self.names, value))


def _tag(when: When) -> Tag:
    return when if type(when) is Tag else new_tag(when.time, when.microstep)


class EventLog:
    """Counts and digests every record, and keeps those for which ``keeps(event, actor, port, aspect)`` is true.

    With ``log_to``, it passes these on instead.
    """

    __slots__ = (
        "_hash", "_hashed", "_keeps", "_log_to", "_writers", "crowd", "records", "sheet", "tokens", "when",
    )  # fmt: skip

    def __init__(
        self,
        keeps: Callable[[str, str, str, str], bool] | None = None,
        log_to: Callable[[Record], None] | None = None,
    ) -> None:
        self.records: list[Record] = Past()
        self._log_to = log_to
        self._keeps = keeps
        self._writers: dict[Names, Writer] = {}
        self._hash = hashlib.sha256()
        self.sheet = Sheet()  # bytes to be hashed, many records at a time
        self.tokens = WaitingTokens()
        self._hashed = 0  # records
        self.when: When | None = None  # tag of the last record
        self.crowd: Callable[[Tag, str, int], None] | None = None  # counts many records at one tag

    def add(self, tag: Tag, event: str, actor: str, port: str, channel: int | None, aspect: str, value: Any) -> None:
        """Append a record."""
        self.writer(event, actor, port, channel, aspect).write(tag, value)

    def writer(self, event: str, actor: str, port: str, channel: int | None, aspect: str) -> Writer:
        """The writer of records with these names."""
        names = (event, actor, port, channel, aspect)
        if (writer := self._writers.get(names)) is None:
            keeps = self._keeps is not None and self._keeps(event, actor, port, aspect)
            keep = (self._log_to or self.records.append) if keeps else None
            writer = self._writers[names] = self.new_writer(names, keep)
        return writer

    def new_writer(self, names: Names, keep: Callable[[Record], None] | None) -> Writer:
        """A new writer."""
        return Writer(self, names, keep)

    def turn_to(self, when: When) -> None:
        """The following records have this tag."""
        self.when = when
        self.sheet.turn_to(when)
        if self.sheet.size > _MANY:
            self.hash_records()

    def hash_many(self, port: str) -> None:
        """Handle very many records at one tag, the last of them sent by a port just now."""
        if self.crowd is not None and self.when is not None:
            self.crowd(_tag(self.when), port, _MOST)
        self.hash_records()

    def hash_records(self) -> None:
        """Encode the waiting records."""
        size = self.sheet.size
        self._hash.update(self.sheet.taken(canonical))
        self._hashed += size
        self.tokens.forget()

    @property
    def count(self) -> int:
        """The number of records."""
        return self._hashed + self.sheet.size

    def to_pandas(self) -> pandas.DataFrame:
        """A row for each record, with the columns of a log file; raises ``LogError`` if the records were not kept."""
        if self._keeps is None or self._log_to is not None:
            raise LogError("the event log was not kept: make the run with Simulation(model, keep_log=True)")
        rows = [(*record.row()[:-1], record.value) for record in self.records]
        frame: pandas.DataFrame = pandas_module().DataFrame(rows, columns=list(COLUMNS))
        return frame

    @property
    def digest(self) -> str:
        """SHA-256 over all records so far, as hexadecimal text."""
        self.hash_records()
        return self._hash.hexdigest()
