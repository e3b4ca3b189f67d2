"""Recordings of messages: MCAP files, and CSV logs with the columns time, topic and value."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from importlib.metadata import entry_points
from io import TextIOWrapper
from itertools import pairwise
from pathlib import Path
from typing import IO, Any, BinaryIO, Protocol

from epicycle.actors import EpicycleError, did_you_mean, open_regular

from ..support.files import replacing

FOLDERS = "epicycle.recordings"  # entry points of what reads folders
COLUMNS = ["time", "topic", "value"]
NANOSECONDS = Decimal(1_000_000_000)
_LINE = 2**20  # characters in a line of a CSV log, at most
_CHUNK = 2**30  # bytes in a chunk of an MCAP file, at most
_TOPICS = 10_000


class RecordingError(EpicycleError):
    """A recording that cannot be read or written; the message names the file."""


@dataclass(frozen=True)
class Message:
    """One message: when it was received (ns), on which channel, its content, and what stands in the file beside it.

    ``content`` is bytes that nobody reads, or the text of a JSON value, or any text.
    """

    time: int
    channel: int
    content: bytes | str
    beside: str = ""


class Recording(Protocol):
    """A file of messages: ``channels`` are the topics by the numbers of their channels."""

    path: Path
    channels: dict[int, str]

    def messages(self) -> Iterator[Message]:
        """The messages in order of time; raises ``RecordingError``."""

    def replacing(self, path: Path) -> AbstractContextManager[Writing]:
        """What writes a recording of the same kind; it is at a path once it is complete."""


class Writing(Protocol):
    """Writes messages in order of time; ``changed`` is the new content as JSON text, None for the one that came."""

    def write(self, time: int, message: Message, changed: str | None) -> None: ...
    def finish(self) -> None: ...


@contextmanager
def opened(path: Path) -> Iterator[Recording]:
    """The recording in a file; raises ``RecordingError``."""
    if path.is_dir():
        yield _folder(path)
        return
    kinds: dict[str, Any] = {".mcap": McapRecording, ".csv": CsvRecording}
    kind = kinds.get(path.suffix.lower())
    if kind is None:
        raise RecordingError(f"{path} is not a recording: its name must end in .mcap or .csv, or it is a folder")
    try:
        with open_regular(path) as file:
            yield kind(path, file)
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {error.strerror or error}") from None


def _folder(path: Path) -> Recording:
    """A recording that is a folder, as an installed package reads it."""
    for point in entry_points(group=FOLDERS):
        made: Recording = point.load()(path)
        return made
    raise RecordingError(f"{path} is a folder, and no installed package reads those")


class _InFile:
    """What recordings of both kinds of files have in common."""

    path: Path

    @contextmanager
    def replacing(self, path: Path) -> Iterator[Writing]:
        with replacing(path, RecordingError) as file:
            yield self._writing(file)

    def _writing(self, file: BinaryIO) -> Writing:
        raise NotImplementedError

    def _error(self, reason: str) -> RecordingError:
        return RecordingError(f"{self.path} is not a recording: {reason}")


# -- CSV --------------------------------------------------------------------------------------------------------------


class CsvRecording(_InFile):
    """A CSV file with the columns time (s, ascending), topic and value (a number, JSON, or any text)."""

    def __init__(self, path: Path, file: BinaryIO) -> None:
        self.path = path
        self._file = file
        numbers: dict[str, int] = {}
        self._numbers = numbers
        for _ in self.messages():
            pass
        self.channels = {number: topic for topic, number in numbers.items()}

    def messages(self) -> Iterator[Message]:
        self._file.seek(0)
        text = TextIOWrapper(self._file, encoding="utf-8", newline="")
        try:
            yield from self._rows(text)
        except UnicodeDecodeError:
            raise self._error("it is not a text in UTF-8") from None
        finally:
            with suppress(ValueError):  # the file may be closed before a run that failed lets go of this
                text.detach()

    def _rows(self, text: TextIOWrapper) -> Iterator[Message]:
        rows = csv.reader(self._lines(text), strict=True)
        try:
            self._check_head(next(rows, []))
            latest: Decimal | None = None
            for row in rows:
                if not row:
                    continue
                if len(row) != len(COLUMNS):
                    raise self._error(f"line {rows.line_num:,}: {len(row)} cells, expected {', '.join(COLUMNS)}")
                time = self._time(row[0], rows.line_num)
                if latest is not None and time < latest:
                    raise self._error(f"line {rows.line_num:,}: time {row[0]} is before that of the row above")
                latest = time
                number = self._numbers.setdefault(row[1], len(self._numbers))
                if number >= _TOPICS:
                    raise self._error(f"it has more than {_TOPICS:,} topics")
                yield Message(int((time * NANOSECONDS).to_integral_value()), number, row[2], row[0])
        except csv.Error as error:
            raise self._error(f"line {rows.line_num:,}: {error}") from None

    def _check_head(self, head: list[str]) -> None:
        if head != COLUMNS:
            raise self._error(f"its first line must be {','.join(COLUMNS)}, not {','.join(head)[:100] or 'empty'}")

    def _lines(self, text: IO[str]) -> Iterator[str]:
        number = 0
        while line := text.readline(_LINE):
            number += 1
            if len(line) == _LINE:
                raise self._error(f"line {number:,} is longer than {_LINE:,} characters")
            yield line

    def _time(self, text: str, line: int) -> Decimal:
        try:
            time = Decimal(text)
        except InvalidOperation:
            time = Decimal("nan")
        if not (time.is_finite() and -NANOSECONDS * 10 < time < NANOSECONDS * 10):
            raise self._error(f"line {line:,}: {text[:50]!r} is not a time in s")
        return time

    def _writing(self, file: BinaryIO) -> Writing:
        return _CsvWriting(self.channels, file)


class _CsvWriting:
    def __init__(self, channels: dict[int, str], file: BinaryIO) -> None:
        self._channels = channels
        self._text = TextIOWrapper(file, encoding="utf-8", newline="")
        self._rows = csv.writer(self._text, lineterminator="\n")
        self._rows.writerow(COLUMNS)

    def write(self, time: int, message: Message, changed: str | None) -> None:
        said = message.beside if time == message.time else f"{(Decimal(time) / NANOSECONDS).normalize():f}"
        self._rows.writerow([said, self._channels[message.channel], message.content if changed is None else changed])

    def finish(self) -> None:
        self._text.detach()


# -- MCAP -------------------------------------------------------------------------------------------------------------


class McapRecording(_InFile):
    """An MCAP file; messages with the encoding json are read, others pass as they are."""

    def __init__(self, path: Path, file: BinaryIO) -> None:
        try:
            from mcap.reader import make_reader
        except ImportError:
            raise RecordingError(
                "an MCAP file needs the package mcap, which is not installed: pip install 'epicycle[mcap]'"
            ) from None
        self.path = path
        self._file = file
        with self._checked():
            self._reader = make_reader(file)
            self._header = self._reader.get_header()
            summary = self._reader.get_summary()
            if summary is None or not summary.channels:
                raise self._error("it has no summary of its channels; repair it with 'mcap recover'")
            large = max((each.uncompressed_size for each in summary.chunk_indexes), default=0)
            if large > _CHUNK:
                raise self._error(f"a chunk of {large:,} bytes is larger than {_CHUNK:,}")
            self._summary = summary
        self.channels = {number: channel.topic for number, channel in summary.channels.items()}
        self._are_read = {number for number, each in summary.channels.items() if each.message_encoding == "json"}

    def messages(self) -> Iterator[Message]:
        with self._checked():
            # Without chunks, messages are taken as they stand: sorting would need them all.
            is_sorted = bool(self._summary.chunk_indexes)
            latest = 0
            in_turn = self._each_chunk() if is_sorted else None
            for message in in_turn or (each for *_, each in self._reader.iter_messages(log_time_order=is_sorted)):
                if message.log_time < latest:
                    raise self._error("its messages are not in order of time, and it has no index")
                latest, number = message.log_time, message.channel_id
                content: bytes | str = message.data
                if number in self._are_read:
                    content = self._text(message.data, self.channels[number], message.log_time)
                yield Message(message.log_time, number, content, f"{message.sequence} {message.publish_time}")

    def _each_chunk(self) -> Iterator[Any] | None:
        """The messages, chunk by chunk, if these follow each other; this takes half the time of merging them."""
        chunks = sorted(
            self._summary.chunk_indexes, key=lambda each: (each.message_start_time, each.chunk_start_offset)
        )
        if any(one.message_end_time >= other.message_start_time for one, other in pairwise(chunks)):
            return None
        return self._messages_of(chunks)

    def _messages_of(self, chunks: list[Any]) -> Iterator[Any]:
        from mcap.data_stream import ReadDataStream
        from mcap.records import Chunk
        from mcap.records import Message as Record
        from mcap.stream_reader import breakup_chunk

        for each in chunks:
            self._file.seek(each.chunk_start_offset + 9)  # behind its kind and length
            records = breakup_chunk(Chunk.read(ReadDataStream(self._file)))
            yield from sorted((one for one in records if isinstance(one, Record)), key=lambda one: one.log_time)

    def _text(self, data: bytes, topic: str, time: int) -> str:
        try:
            text = data.decode("utf-8")
            json.loads(text)
        except (ValueError, RecursionError):
            raise self._error(f"a message of {topic} at {time} ns is not JSON, as its channel says") from None
        return text

    @contextmanager
    def _checked(self) -> Iterator[None]:
        """The library raises errors of many kinds for files that are damaged."""
        try:
            yield
        except (RecordingError, GeneratorExit):
            raise
        except Exception as error:
            said = " ".join(str(error).split())[:200]
            raise self._error(f"{said or type(error).__name__}") from None

    def _writing(self, file: BinaryIO) -> Writing:
        return _McapWriting(self, file)

    def copy_to(self, writer: Any) -> dict[int, int]:
        """Write everything but messages; the numbers of the channels in the new file by those in this one."""
        with self._checked():
            writer.start(profile=self._header.profile, library="epicycle")
            for attachment in self._reader.iter_attachments():
                writer.add_attachment(
                    attachment.create_time, attachment.log_time, attachment.name, attachment.media_type, attachment.data
                )
            for metadata in self._reader.iter_metadata():
                writer.add_metadata(metadata.name, metadata.metadata)
            schemas = {0: 0}
            for number, schema in sorted(self._summary.schemas.items()):
                schemas[number] = writer.register_schema(schema.name, schema.encoding, schema.data)
            return {
                number: writer.register_channel(
                    channel.topic, channel.message_encoding, schemas[channel.schema_id], channel.metadata
                )
                for number, channel in sorted(self._summary.channels.items())
            }


class _McapWriting:
    def __init__(self, recording: McapRecording, file: BinaryIO) -> None:
        from mcap.writer import Writer

        self._writer = Writer(file)
        self._channels = recording.copy_to(self._writer)

    def write(self, time: int, message: Message, changed: str | None) -> None:
        content = message.content if changed is None else changed
        data = content.encode() if isinstance(content, str) else content
        sequence, published = map(int, message.beside.split())
        self._writer.add_message(self._channels[message.channel], time, data, published, sequence)

    def finish(self) -> None:
        self._writer.finish()  # type: ignore[no-untyped-call]


def check_topics(patterns: Iterable[str], topics: Iterable[str]) -> None:
    """Raise ``RecordingError`` for a pattern that matches no topic."""
    from fnmatch import fnmatchcase

    topics = list(topics)
    for pattern in patterns:
        if not any(fnmatchcase(topic, pattern) for topic in topics):
            listed = ", ".join(topics[:20]) + (", ..." if len(topics) > 20 else "")
            raise RecordingError(
                f"{pattern!r} matches no topic{did_you_mean(pattern, topics)}; topics: {listed or 'none'}"
            )
