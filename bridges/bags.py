"""Recordings of ROS 2, read and written without ROS: folders with MCAP or SQLite files, and single MCAP files.

A message becomes a token: a mapping of its fields, in which those of a field are attributes, too
(``message.pose.pose.position.x``), with its header, and arrays as arrays.  The time of a message is that of its
recording; time 0 of a run is the first message.
"""

from __future__ import annotations

import copy
import dataclasses
import re
import shutil
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from rosbags import rosbag2
from rosbags.interfaces import MessageDefinitionFormat, Nodetype
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

from epicycle.actors import (
    Actor,
    EpicycleError,
    InputPort,
    OutputPort,
    Parameter,
    ParameterError,
    brief,
    did_you_mean,
    texts_parameter,
)
from epicycle.runner import Model
from epicycle.runner.recorded import Message, RecordingError, Writing, topics_like

from .names import KINDS, ports_of, reason_of

_TEXTS = ("string", "wstring")
_OCTETS = {"byte": "uint8", "octet": "uint8", "char": "uint8"}
LONGEST = 1_000_000_000 * 10**9  # ns, of a run


class Fields(dict[str, Any]):
    """The fields of a message, which are attributes, too."""

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError:
            near = did_you_mean(name, self)
            raise AttributeError(f"the message has no field {name!r}{near}; fields: {', '.join(self)}") from None


class BagFile:
    """What is in a recording, a folder or a file: ``topics`` with the types of their messages."""

    def __init__(self, path: Path) -> None:
        self.path = path
        with self._opened() as reader:
            self.topics: dict[str, str] = {each.topic: each.msgtype for each in reader.connections}
            for each in reader.connections:
                if (encoding := each.ext.serialization_format) != "cdr":
                    raise self.error(f"messages of {each.topic} are in {encoding or 'no encoding'}, not in cdr")

    def raw(self, topics: Iterable[str] = ()) -> Iterator[tuple[int, str, bytes]]:
        """Time (ns), topic and bytes of each message, of all topics if none is named; raises ``RecordingError``."""
        last: list[tuple[str, int]] = []
        topics = tuple(topics)
        with self._opened(last) as reader:
            chosen = [each for each in reader.connections if not topics or each.topic in topics]
            for connection, time, data in reader.messages(chosen):
                if last and time < last[0][1]:
                    raise self.error(f"a message of {connection.topic} at {time} ns comes after one at {last[0][1]} ns")
                last[:] = [(connection.topic, time)]
                yield time, connection.topic, data

    def messages(self, topics: Iterable[str] = ()) -> Iterator[tuple[int, str, Fields]]:
        """Time (ns), topic and fields of each message; raises ``RecordingError``."""
        for time, topic, data in self.raw(topics):
            yield time, topic, self.read(topic, data, f" at {time} ns")

    def read(self, topic: str, content: bytes, when: str = "") -> Any:
        """The fields of a message; raises ``RecordingError``."""
        kind = self.topics[topic]
        try:
            return fields_of(self.store.deserialize_cdr(content, kind))
        except EpicycleError:
            raise
        except Exception as error:  # of many kinds, for bytes that are no such message
            raise self.error(f"a message of {topic}{when} is not a {kind}: {reason_of(error)}") from None

    def written(self, topic: str, token: Any) -> bytes:
        """The message with these fields; raises ``RecordingError`` if they do not fit its type."""
        kind = self.topics[topic]
        try:
            return bytes(self.store.serialize_cdr(self._message(kind, token), kind))
        except EpicycleError:
            raise
        except Exception as error:  # of many kinds, for values of all kinds
            raise RecordingError(
                f"{brief(token)} cannot be a {kind} of {topic} in {self.path}: {reason_of(error)}"
            ) from None

    def _message(self, kind: str, fields: Mapping[str, Any]) -> Any:
        """The message of a type; numbers beyond the range of theirs become its ends."""
        told = self.store.fielddefs[kind][1]
        return self.store.types[kind](**{name: self._value(is_of, fields[name]) for name, is_of in told})

    def _value(self, is_of: tuple[Any, Any], value: Any) -> Any:
        node, of = is_of
        if node == Nodetype.NAME:
            return self._message(of, value)
        if node == Nodetype.BASE:
            return value if of[0] in _TEXTS else _in_range(of[0], value).item()
        inner, name = of[0], of[0][1][0]
        if inner[0] == Nodetype.BASE and name not in _TEXTS:
            return _in_range(name, value)
        return [self._value(inner, each) for each in value]

    @cached_property
    def start(self) -> int:
        """The time of the first message (ns)."""
        first = next(self.raw(), None)
        return 0 if first is None else first[0]

    @cached_property
    def store(self) -> Any:
        """What knows the types of the messages, which takes a while to make."""
        found: dict[str, Any] = {}
        with self._opened() as reader:
            for each in reader.connections:
                kind, text = each.msgtype, each.msgdef.data
                if each.msgdef.format == MessageDefinitionFormat.MSG:
                    found |= get_types_from_msg(text, kind)
                elif text:
                    found |= get_types_from_idl(re.sub(r"^(=+\nIDL: .*|=+)$", "", text, flags=re.M))
            named = repr([(kind, fields, [each[:2] for each in told]) for kind, (told, fields) in found.items()])
            if re.search("['\"]", re.sub(r"'[A-Za-z_][A-Za-z0-9_/]*'", "", named)):
                raise self.error("a type of messages, or a field, has a name that is none")  # and would become code
            store = get_typestore(Stores.EMPTY if found else Stores.LATEST)
            store.register(found)
        return store

    @contextmanager
    def _opened(self, last: Iterable[tuple[str, int]] = ()) -> Iterator[Any]:
        """The reader of the file, of which errors name the ``last`` message that was read.

        The libraries raise errors of many kinds for files that are damaged.
        """
        try:
            with rosbag2.Reader(self.path) as reader:
                yield reader
        except (EpicycleError, GeneratorExit):
            raise
        except Exception as error:
            reason = f"it holds {error}, which is not of ROS 2" if isinstance(error, KeyError) else reason_of(error)
            after = "".join(f", after a message of {topic} at {time} ns" for topic, time in last)
            raise self.error(f"{reason}{after}") from None

    def error(self, reason: str) -> RecordingError:
        """What is wrong with the file."""
        return RecordingError(f"{self.path} is not a recording of ROS 2: {reason}")


def _in_range(name: str, value: Any) -> Any:
    """An array of a type of numbers of ROS, those beyond its range at its ends; raises ``ValueError`` for NaN."""
    dtype, found = np.dtype(_OCTETS.get(name, name)), np.asarray(value)
    if dtype.kind in "iu" and found.dtype != dtype:
        ends = np.iinfo(dtype)
        if found.dtype.kind == "f":
            if not np.isfinite(found).all():
                raise ValueError(f"{brief(value)} is no {name}")
            highest = float(ends.max) if dtype.itemsize < 8 else np.nextafter(float(ends.max), 0.0)
            found = np.clip(np.rint(found), ends.min, highest)
        else:
            own = np.iinfo(found.dtype)
            found = np.clip(found, max(ends.min, own.min), min(ends.max, own.max))
    return found.astype(dtype)


def bag(path: str | Path) -> BagFile:
    """Open a recording of ROS 2: a folder (or the metadata.yaml in it), or an MCAP file; raises ``RecordingError``."""
    path = Path(path)
    if path.name == "metadata.yaml":
        path = path.parent
    if not path.is_dir() and path.suffix.lower() not in ("", ".mcap"):
        raise RecordingError(f"{path} is not a recording of ROS 2: a folder with metadata.yaml, or a file *.mcap")
    if not path.exists():
        raise RecordingError(f"{path} cannot be read: there is no such file")
    return BagFile(path)


_names: dict[type, tuple[str, ...]] = {}


def fields_of(message: Any) -> Any:
    """A message as a token, or what an aspect has made of one, with attributes again."""
    if isinstance(message, list):
        return [fields_of(each) for each in message]
    if isinstance(message, Mapping):
        return Fields({name: fields_of(each) for name, each in message.items()})
    kind = type(message)
    if kind not in _names:
        found = [each.name for each in dataclasses.fields(kind)] if dataclasses.is_dataclass(kind) else []
        _names[kind] = tuple(name for name in found if not name.startswith("_"))
    if not (names := _names[kind]):
        return message
    return Fields({name: fields_of(getattr(message, name)) for name in names})


class _Position:
    """A place among the messages of a recording; a copy goes there again by itself."""

    def __init__(self, file: BagFile, topics: tuple[str, ...]) -> None:
        self._file, self._topics, self._number = file, topics, 0
        self._messages: Iterator[tuple[int, str, Fields]] | None = None

    def next(self) -> tuple[int, str, Fields] | None:
        """The next message; None behind the last."""
        if self._messages is None:
            self._messages = self._file.messages(self._topics)
            for _ in range(self._number):
                next(self._messages, None)
        self._number += 1
        return next(self._messages, None)

    def __deepcopy__(self, memo: dict[int, Any]) -> _Position:
        made = _Position(self._file, self._topics)
        made._number = self._number
        return made


class Bag(Actor):
    """Sends the messages of a recording of ROS 2, each at its time and by the output of its topic.

    The output of ``/robot/front/scan`` is ``robot_front_scan``.  A token is a mapping of the fields of the message,
    with its header.  Time 0 is the first message of the recording.
    """

    file = Parameter(Path, doc="an .mcap file, or the metadata.yaml of a folder")
    topics: Any = texts_parameter(None, doc="the topics to send; all if left out")

    is_source: ClassVar[bool] = True
    copies_share: ClassVar[tuple[str, ...]] = ("_bag",)

    @staticmethod
    def told(path: Path) -> str:
        """What ``epicycle describe`` says of a recording: its topics."""
        topics = bag(path).topics
        width = max(map(len, topics), default=0)
        return "\n".join(f"{topic.ljust(width)}  {kind}" for topic, kind in topics.items())

    def own_ports(self) -> dict[str, InputPort[Any] | OutputPort[Any]]:
        self._bag = bag(self.file)
        topics = tuple(self._bag.topics if self.topics is None else self.topics)
        for topic in topics:
            if topic not in self._bag.topics:
                near, known = did_you_mean(topic, self._bag.topics), ", ".join(self._bag.topics)
                raise ParameterError(f"topics: {self.file.name} has no topic {topic!r}{near}; topics: {known}")
        self.ports = ports_of(topics)
        return {port: OutputPort(doc=f"messages of {topic}") for topic, port in self.ports.items()}

    _next: tuple[int, str, Fields] | None = None

    def initialize(self) -> None:
        self._start = self._bag.start
        self._position = _Position(self._bag, tuple(self.ports))
        self._next = self._position.next()
        self._wake()

    def restart(self) -> None:
        while self._next is not None and self._next[0] - self._start < self.context.time:
            self._next = self._position.next()
        self._wake()

    def _wake(self) -> None:
        if self._next is not None:
            time = self._next[0] - self._start
            if time > LONGEST:
                raise self._bag.error(f"a message of {self._next[1]} comes {time // 10**9:,} s after the first one")
            self.context.wake(self, time)

    def fire(self) -> None:
        assert self._next is not None
        _, topic, message = self._next
        self.outputs[self.ports[topic]].send(message)
        self._next = self._position.next()
        self._wake()


class _Node(Actor):
    """A program that listens to topics; a subclass knows the program and its topics."""

    program: ClassVar[Any]
    topics: ClassVar[Mapping[str, str]]  # by input

    def initialize(self) -> None:
        program = type(self).program
        made = program() if isinstance(program, type) else program
        self._hear = copy.deepcopy(made).on_message if hasattr(made, "on_message") else made

    def fire(self) -> None:
        for name, port in self.inputs.items():
            for token in port.tokens:
                said = self._hear(self.topics[name], fields_of(token))
                if said is not None:
                    self._send(name, said)

    def _send(self, name: str, said: Any) -> None:
        returns, known = f"on_message({self.topics[name]!r}, ...) returns", ", ".join(self.outputs) or "none"
        if len(self.outputs) == 1 and not (isinstance(said, Mapping) and said.keys() <= self.outputs.keys()):
            said = dict.fromkeys(self.outputs, said)
        if not isinstance(said, Mapping):
            raise EpicycleError(f"{returns} {brief(said)}, not a mapping of outputs to values; outputs: {known}")
        for key, value in said.items():
            if key not in self.outputs:
                near = did_you_mean(key, self.outputs)
                raise EpicycleError(f"{returns} a value for {key!r}, which is no output{near}; outputs: {known}")
            port = self.outputs[key]
            port.send(float(value) if port.type is float else value)


def lockstep(
    recording: str | Path,
    program: Any,
    *,
    outputs: Iterable[str] | Mapping[str, str],
    topics: Iterable[str] | None = None,
    disturb: str | Path | Iterable[str | Path] = (),
    at: str | Iterable[str] | None = None,
    set: Mapping[str, object] | None = None,
) -> Model:
    """A model in which a program hears the messages of a recording, one after the other: each run has the same bits.

    ``program`` is a function of a topic and a message, or a class (each run makes an object of it) or object (each run
    has a copy) with ``on_message(topic, message)``.  It returns values for ``outputs`` by name, one value if there is
    only one output, or None.  ``outputs`` may say what they send: ``{"error": "number"}``.  ``disturb`` names
    disturbances, ``at`` the topics that they are for, by patterns (default: the ports that they name; ``/imu`` is
    ``node.imu``).
    The parts are ``bag`` and ``node``.  Raises ``RecordingError``, ``ModelError``.

    >>> model = lockstep("walk.mcap", Filter, outputs={"error": "number"}, disturb="lost.yaml", at="/gps")
    """
    file = bag(recording)
    model = Model(file.path.stem)
    source = model.add(Bag("bag", file=file.path.resolve(), topics=None if topics is None else list(topics)))
    names = {port: topic for topic, port in source.ports.items()}
    kinds = dict(outputs) if isinstance(outputs, Mapping) else dict.fromkeys(outputs, "any value")
    for name, each in kinds.items():
        if name in names:
            raise EpicycleError(f"output {name!r} has the name of the topic {names[name]}: choose another one")
        if each not in KINDS:
            raise EpicycleError(f"output {name} sends {each!r}{did_you_mean(each, KINDS)}; valid: {', '.join(KINDS)}")
    ports: dict[str, Any] = {name: InputPort[Any](doc=f"messages of {topic}") for name, topic in names.items()}
    ports |= {name: OutputPort(KINDS[each]) for name, each in kinds.items()}
    members = {**ports, "program": staticmethod(program) if not isinstance(program, type) else program, "topics": names}
    node = model.add(type("Node", (_Node,), {**members, "__doc__": _Node.__doc__, "__module__": __name__})("node"))
    for name in names:
        model.connect(source.outputs[name], node.inputs[name])
    places = None
    if at is not None:
        chosen = topics_like([at] if isinstance(at, str) else at, names.values())
        heard = [name for name, topic in names.items() if topic in chosen]
        places = [path for name in heard for path in (f"node.{name}", f"bag.{name}")]
    for each in [disturb] if isinstance(disturb, (str, Path)) else disturb:
        model.disturb(each, at=places, set=set)
    model.record(*(node.outputs[name] for name in kinds))
    return model


class BagFolder:
    """A recording that is a folder, for ``epicycle recording apply``."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file = bag(path)
        self._numbers = {topic: number for number, topic in enumerate(self._file.topics)}
        self.channels = {number: topic for topic, number in self._numbers.items()}

    def messages(self) -> Iterator[Message]:
        """The messages in order of time."""
        for time, topic, data in self._file.raw():
            yield Message(time, self._numbers[topic], bytes(data))

    def codec(self) -> BagFile:
        """What reads the messages."""
        return self._file

    @contextmanager
    def replacing(self, path: Path) -> Iterator[Writing]:
        """A new folder, with the same kind of files."""
        if path.exists() and not (path / "metadata.yaml").is_file():
            raise RecordingError(f"{path} exists and is not a recording: choose another name")
        aside = path.with_name(f".{path.name}")
        shutil.rmtree(aside, ignore_errors=True)
        try:
            aside.mkdir()
            made = aside / path.name  # after which the files in it are named
            with self._file._opened() as reader:
                stored = rosbag2.StoragePlugin.MCAP if any(self.path.glob("*.mcap")) else rosbag2.StoragePlugin.SQLITE3
                with rosbag2.Writer(made, version=9, storage_plugin=stored) as writer:
                    yield _Writing(writer, reader, self._numbers)
            if path.exists():
                shutil.rmtree(path)
            made.rename(path)
        except OSError as error:
            raise RecordingError(f"{path} cannot be written: {error.strerror or error}") from None
        finally:
            with suppress(OSError):
                shutil.rmtree(aside, ignore_errors=True)


class _Writing:
    def __init__(self, writer: Any, reader: Any, numbers: Mapping[str, int]) -> None:
        self._writer = writer
        self._connections: dict[int, Any] = {}
        for each in reader.connections:
            if numbers[each.topic] not in self._connections:
                self._connections[numbers[each.topic]] = writer.add_connection(
                    each.topic,
                    each.msgtype,
                    msgdef=each.msgdef.data,
                    rihs01=each.digest,
                    serialization_format=each.ext.serialization_format,
                    offered_qos_profiles=each.ext.offered_qos_profiles,
                )

    def write(self, time: int, message: Message, changed: str | bytes | None) -> None:
        """Add a message."""
        self._writer.write(self._connections[message.channel], time, message.content if changed is None else changed)

    def finish(self) -> None:
        """Nothing: the file is closed by who has opened it."""
