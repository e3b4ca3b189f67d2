"""The event log: every send and every act of an aspect, in order, and the digest of them all."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from epicycle.actors import EpicycleError, Moment, Tag, new_tag, to_seconds

from ...support.shown import short
from ...support.tables import pandas_module
from .encoding import canonical, plain
from .record import Names, Past, RecordHash, Writer

if TYPE_CHECKING:
    import pandas

COLUMNS = ("time", "microstep", "event", "actor", "port", "channel", "aspect", "value")


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
        """The record by itself in canonical bytes; without the microstep if ``microstep`` is false."""
        tag = (self.tag.time, self.tag.microstep if microstep else 0)
        names = (self.event, self.actor, self.port, self.aspect, self.channel)
        return b"".join(map(canonical, (*tag, *names, self.value)))

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


def _tag(when: Tag | Moment) -> Tag:
    return when if type(when) is Tag else new_tag(when.time, when.microstep)


class EventLog:
    """Counts and digests every record, and keeps those for which ``keeps(event, actor, port, aspect)`` is true.

    With ``log_to``, it passes these on instead.
    """

    __slots__ = ("_keeps", "_log_to", "_writers", "crowd", "hash", "records")

    def __init__(
        self,
        keeps: Callable[[str, str, str, str], bool] | None = None,
        log_to: Callable[[Record], None] | None = None,
    ) -> None:
        self.records: list[Record] = Past()
        self._log_to = log_to
        self._keeps = keeps
        self._writers: dict[Names, Writer] = {}
        self.hash = RecordHash()
        self.crowd: Callable[[Tag, str, int], None] | None = None  # counts many records at one tag

    def add(self, tag: Tag, event: str, actor: str, port: str, channel: int | None, aspect: str, value: Any) -> None:
        """Append a record."""
        self.writer(event, actor, port, channel, aspect).write(tag, value)

    def writer(self, event: str, actor: str, port: str, channel: int | None, aspect: str) -> Writer:
        """The writer of records with these names."""
        names = (event, actor, port, channel, aspect)
        if (writer := self._writers.get(names)) is None:
            keeps = self._keeps is not None and self._keeps(event, actor, port, aspect)
            writer = self._writers[names] = self.new_writer(names, keeps)
        return writer

    def new_writer(self, names: Names, keeps: bool) -> Writer:
        """A new writer, whose records are kept or not."""
        return Writer(self, names, keeps)

    def keep(self, when: Tag | Moment, names: Names, value: Any) -> None:
        """Keep a record, or pass it on."""
        (self._log_to or self.records.append)(Record(_tag(when), *names, value))

    def report(self, when: Tag | Moment, names: Names, number: int) -> None:
        """Report very many records at one tag, the last of them sent by a port just now."""
        if self.crowd is not None:
            self.crowd(_tag(when), f"{names[1]}.{names[2]}", number)

    @property
    def count(self) -> int:
        """The number of records."""
        return self.hash.count

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
        return self.hash.hexdigest()
