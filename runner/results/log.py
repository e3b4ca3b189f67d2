"""The event log: every send and every act of an aspect, in order, and the digest of them all."""

from __future__ import annotations

import hashlib
import json
import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from epicycle.actors import EpicycleError, Tag, to_seconds

from ..shown import short
from ..tables import pandas_module
from .encoding import canonical, plain
from .signal import Past
from .waiting import LARGE, WaitingTokens

if TYPE_CHECKING:
    import pandas

COLUMNS = ("time", "microstep", "event", "actor", "port", "channel", "aspect", "value")
_TAG = struct.Struct("<cqcq").pack  # as ``canonical`` writes two integers
_PIECES = 3_000  # that are hashed together, when a tag is over
_MOST_PIECES = 30_000

Write = Callable[["Tag", Any], None]


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
        """The record in the canonical form of which the digest is made; with ``microstep`` false without that."""
        names = map(canonical, (self.event, self.actor, self.port, self.aspect, self.channel))
        tag = _TAG(b"i", self.tag.time, b"i", self.tag.microstep if microstep else 0)
        return tag + b"".join(names) + canonical(self.value)

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


class EventLog:
    """Counts and digests every record, and keeps those that ``keeps(event, actor, port, aspect)`` says.

    With ``log_to`` it keeps none of these, but gives them to that.
    """

    def __init__(
        self,
        keeps: Callable[[str, str, str, str], bool] | None = None,
        log_to: Callable[[Record], None] | None = None,
    ) -> None:
        self.records: list[Record] = Past()
        self._log_to = log_to
        self._keeps = keeps
        self._writers: dict[tuple[str, str, str, str, int | None], Write] = {}
        # What the digest is made of, three pieces a record: tag, names, what was kept of the value.  Many are hashed at
        # a time.
        self._hash = hashlib.sha256()
        self._pieces: list[Any] = []
        self._tokens = WaitingTokens()
        self._hashed = 0  # records
        self._tag: Tag | None = None  # of the last record
        self._stamp = b""  # the same in bytes
        self.crowd: Callable[[Tag, str, int], None] | None = None  # is told of many records at one tag

    def add(self, tag: Tag, event: str, actor: str, port: str, channel: int | None, aspect: str, value: Any) -> None:
        """Append a record."""
        self.writer(event, actor, port, channel, aspect)(tag, value)

    def writer(self, event: str, actor: str, port: str, channel: int | None, aspect: str) -> Write:
        """What appends records with these names: a tag and a value are all that there is to give for each."""
        names = (event, actor, port, aspect, channel)
        write = self._writers.get(names)
        if write is None:
            write = self._writers[names] = self._new_writer(event, actor, port, channel, aspect)
        return write

    def _new_writer(self, event: str, actor: str, port: str, channel: int | None, aspect: str) -> Write:
        head = b"".join(map(canonical, (event, actor, port, aspect, channel)))
        pieces, tokens = self._pieces, self._tokens

        def write(tag: Tag, value: Any) -> None:
            kept = tokens[type(value)](value)  # raises what cannot be logged
            if tag is not self._tag:
                self._turn_to(tag)
            pieces.extend((self._stamp, head, kept))
            if len(pieces) > _MOST_PIECES:  # all of them at one tag, nearly
                if self.crowd is not None:
                    self.crowd(tag, f"{actor}.{port}", _MOST_PIECES // 3)
                self._hash_pieces()
            elif type(kept) is bytes and len(kept) > LARGE:
                self._hash_pieces()

        if self._keeps is None or not self._keeps(event, actor, port, aspect):
            return write

        keep = self._log_to or self.records.append

        def write_and_keep(tag: Tag, value: Any) -> None:
            write(tag, value)
            keep(Record(tag, event, actor, port, channel, aspect, value))

        return write_and_keep

    def _turn_to(self, tag: Tag) -> None:
        """The records that follow are of this tag."""
        self._tag = tag
        time, microstep = tag
        self._stamp = _TAG(b"i", time, b"i", microstep)
        if len(self._pieces) > _PIECES:
            self._hash_pieces()

    def _hash_pieces(self) -> None:
        pieces = self._pieces
        pieces[2::3] = self._tokens.encode(pieces[2::3])
        self._hash.update(b"".join(pieces))
        self._hashed += len(pieces) // 3
        pieces.clear()

    @property
    def count(self) -> int:
        """The number of records."""
        return self._hashed + len(self._pieces) // 3

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
        self._hash_pieces()
        return self._hash.hexdigest()
