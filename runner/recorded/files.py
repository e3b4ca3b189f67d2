"""Recordings of messages: MCAP files, and CSV logs with the columns time, topic and value."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from decimal import Decimal, InvalidOperation
from importlib.metadata import entry_points
from io import TextIOWrapper
from itertools import pairwise
from operator import itemgetter
from pathlib import Path
from struct import Struct
from typing import IO, Any, BinaryIO, NamedTuple, Protocol

from epicycle.actors import EpicycleError, did_you_mean, open_regular

from ..support.extras import needed
from ..support.files import replacing

FOLDERS = "epicycle.recordings"  # entry points of what reads folders
ENCODINGS = "epicycle.encodings"  # and messages in an encoding, by its name
COLUMNS = ["time", "topic", "value"]
NANOSECONDS = Decimal(1_000_000_000)
_LINE = 2**20  # characters in a line of a CSV log, at most
_CHUNK = 2**30  # bytes in a chunk of an MCAP file, at most
_TOPICS = 10_000
# Of MCAP, a record's kind and length; a message's channel, sequence number, log time and publish time.
_HEAD, _FIELDS = Struct("<BQ"), Struct("<HIQQ")


class RecordingError(EpicycleError):
    """A recording that cannot be read or written; the message names the file."""


class Message(NamedTuple):
    """One message: when it was received (ns), on which channel, its content, and what stands in the file beside it.

    ``content`` is bytes, or the text of a JSON value, or any text.
    """

    time: int
    channel: int
    content: bytes | str
    beside: Any = ""


class Codec(Protocol):
    """Knows what the bytes of messages mean; raises ``RecordingError``."""

    def read(self, topic: str, content: bytes) -> Any:
        """A message as a token."""

    def written(self, topic: str, token: Any) -> bytes:
        """A token as a message."""


class Recording(Protocol):
    """A file of messages: ``channels`` are the topics by the numbers of their channels."""

    path: Path
    channels: dict[int, str]

    def messages(self) -> Iterator[Message]:
        """The messages in order of time; raises ``RecordingError``."""

    def codec(self) -> Codec | None:
        """What reads messages that are bytes, if there is something."""

    def replacing(self, path: Path) -> AbstractContextManager[Writing]:
        """What writes a recording of the same kind; it is at a path once it is complete."""


class Writing(Protocol):
    """Writes messages in order of time; ``changed`` is the new content, None for the one that came."""

    def write(self, time: int, message: Message, changed: str | bytes | None) -> None: ...
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

    def codec(self) -> None:
        """None: there are no bytes."""

    def _writing(self, file: BinaryIO) -> Writing:
        return _CsvWriting(self.channels, file)


class _CsvWriting:
    def __init__(self, channels: dict[int, str], file: BinaryIO) -> None:
        self._channels = channels
        self._text = TextIOWrapper(file, encoding="utf-8", newline="")
        self._rows = csv.writer(self._text, lineterminator="\n")
        self._rows.writerow(COLUMNS)

    def write(self, time: int, message: Message, changed: str | bytes | None) -> None:
        said = message.beside if time == message.time else f"{(Decimal(time) / NANOSECONDS).normalize():f}"
        self._rows.writerow([said, self._channels[message.channel], message.content if changed is None else changed])

    def finish(self) -> None:
        self._text.detach()


# -- MCAP -------------------------------------------------------------------------------------------------------------


class McapRecording(_InFile):
    """An MCAP file; messages with the encoding json are read, others are bytes."""

    def __init__(self, path: Path, file: BinaryIO) -> None:
        make_reader = needed("mcap.reader", "an MCAP file", "mcap").make_reader
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
            latest = 0
            for message in self._in_turn():
                if message.time < latest:
                    raise self._error("its messages are not in order of time, and it has no index")
                latest, number = message.time, message.channel
                if number in self._are_read:
                    assert isinstance(message.content, bytes)
                    message = message._replace(content=self._text(message.content, self.channels[number], latest))
                yield message

    def _in_turn(self) -> Iterator[Message]:
        """The messages in order of time; those of a file without chunks as they stand: sorting would need them all."""
        chunks = sorted(
            self._summary.chunk_indexes, key=lambda each: (each.message_start_time, each.chunk_start_offset)
        )
        if chunks and not any(one.message_end_time >= other.message_start_time for one, other in pairwise(chunks)):
            for each in chunks:  # one follows the other, which takes a fifth of the time of merging them
                yield from sorted(self._in_chunk(each.chunk_start_offset), key=itemgetter(0))
            return
        for *_, found in self._reader.iter_messages(log_time_order=bool(chunks)):
            yield Message(found.log_time, found.channel_id, found.data, (found.sequence, found.publish_time))

    def _in_chunk(self, offset: int) -> Iterator[Message]:
        from mcap.data_stream import ReadDataStream
        from mcap.opcode import Opcode
        from mcap.records import Chunk
        from mcap.stream_reader import get_chunk_data_stream

        self._file.seek(offset + _HEAD.size)
        stream, length = get_chunk_data_stream(Chunk.read(ReadDataStream(self._file)))
        data, place = stream.read(length), 0
        while place < length:
            kind, size = _HEAD.unpack_from(data, place)
            place += _HEAD.size
            if kind == Opcode.MESSAGE:
                channel, sequence, time, published = _FIELDS.unpack_from(data, place)
                content = data[place + _FIELDS.size : place + size]
                yield Message(time, channel, content, (sequence, published))
            place += size

    def _text(self, data: bytes, topic: str, time: int) -> str:
        try:
            text = str(data, "utf-8")
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

    def codec(self) -> Codec | None:
        """What an installed package has for the encoding of the messages."""
        used = {each.message_encoding for each in self._summary.channels.values()}
        for point in entry_points(group=ENCODINGS):
            if point.name in used:
                made: Codec = point.load()(self.path)
                return made
        return None

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

    def write(self, time: int, message: Message, changed: str | bytes | None) -> None:
        content = message.content if changed is None else changed
        data = content.encode() if isinstance(content, str) else content
        sequence, published = message.beside
        self._writer.add_message(self._channels[message.channel], time, data, published, sequence)

    def finish(self) -> None:
        self._writer.finish()  # type: ignore[no-untyped-call]


def topics_like(patterns: Iterable[str], topics: Iterable[str]) -> list[str]:
    """The topics that a pattern matches; raises ``RecordingError`` for a pattern that matches none."""
    from fnmatch import fnmatchcase

    patterns, topics = list(patterns), list(topics)
    for pattern in patterns:
        if not any(fnmatchcase(topic, pattern) for topic in topics):
            listed = ", ".join(topics[:20]) + (", ..." if len(topics) > 20 else "")
            raise RecordingError(
                f"{pattern!r} matches no topic{did_you_mean(pattern, topics)}; topics: {listed or 'none'}"
            )
    return [topic for topic in topics if any(fnmatchcase(topic, pattern) for pattern in patterns)]
