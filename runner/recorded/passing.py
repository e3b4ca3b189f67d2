"""A recording passes the aspects of disturbances: a model replays it, and a model's aspects do not know that."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from epicycle.actors import Actor, InputPort, OutputPort, texts_parameter
from epicycle.aspects import FieldError

from ..execution.engine import ActorError, Simulation
from ..execution.results import Results
from ..model.build.disturbance import disturb_ports
from ..model.build.model import Model
from ..model.language.settings import Setting
from ..support.shown import finite
from .disturbed import Disturbed
from .files import Message, Recording, RecordingError, check_topics, opened

SENDER = "recording"
_LONGEST = 1_000_000_000 * 10**9  # ns
_MESSAGE = "\0"  # the field of a token that says which message it was: a text, which no aspect alters
_VALUE = "value"  # the field of a token with the content, if that has no fields


class Opaque:
    """Content that nobody reads: an aspect that would alter it fails."""

    def __init__(self, data: bytes) -> None:
        self.data = data

    def __repr__(self) -> str:
        return f"<{len(self.data)} bytes>"


class _Sender(Actor):
    """Sends the messages of a recording at their times, each channel by its own output."""

    copies_share = ("_recording", "_came")

    ports = texts_parameter(doc="names of the outputs, in the order of the channels")

    def __init__(self, path: str, recording: Recording, came: dict[str, int], ports: list[str]) -> None:
        self._recording = recording
        self._came = came  # by topic
        super().__init__(path, ports=ports)

    def own_ports(self) -> dict[str, InputPort[Any] | OutputPort[Any]]:
        return {name: OutputPort(doc="messages of a topic") for name in self.ports}

    def initialize(self) -> None:
        self._messages = self._recording.messages()
        self._outputs = dict(zip(self._recording.channels, self.ports, strict=True))
        self._start: int | None = None
        self._prepare()

    def _prepare(self) -> None:
        self._next = next(self._messages, None)
        if self._next is not None:
            if self._start is None:
                self._start = self._next.time
            time = self._next.time - self._start
            if time > _LONGEST:
                topic = self._recording.channels[self._next.channel]
                raise RecordingError(
                    f"{self._recording.path} cannot be replayed: a message of {topic} comes {time // 10**9:,} s after "
                    f"the first one, and a run lasts {_LONGEST // 10**9:,} s at most"
                )
            self.context.wake(self, time)

    def fire(self) -> None:
        assert self._next is not None
        self._came[self._recording.channels[self._next.channel]] += 1
        self.outputs[self._outputs[self._next.channel]].send(_token(self._next))
        self._prepare()


class _Receiver(Actor):
    """Hands on the messages of topics that differ in their last part only."""

    copies_share = ("_deliver",)

    ports = texts_parameter(doc="names of the inputs")

    def __init__(self, path: str, deliver: Callable[[int, Any], None], ports: list[str]) -> None:
        self._deliver = deliver
        super().__init__(path, ports=ports)

    def own_ports(self) -> dict[str, InputPort[Any] | OutputPort[Any]]:
        return {name: InputPort(doc="messages of a topic") for name in self.ports}

    def fire(self) -> None:
        for port in self.inputs.values():
            for token in port.tokens:
                self._deliver(self.context.time, token)


def pass_recording(
    source: Path,
    target: Path,
    disturbances: Iterable[str | Path],
    *,
    at: Iterable[str] = (),
    set: Iterable[str | Setting] | Mapping[str, object] = (),
    seed: int = 0,
    types: Iterable[type] = (),
) -> Disturbed:
    """Write a recording as it is after its messages have passed the aspects of disturbances.

    ``at`` are patterns of topics, in place of those of the disturbances.  Raises ``EpicycleError``.
    """
    if source.suffix.lower() != target.suffix.lower():
        raise RecordingError(f"{target} must be of the same kind as {source}: {source.suffix}")
    with opened(source) as recording:
        names = _names(recording.channels)
        with recording.replacing(target) as writing:
            start = next((message.time for message in recording.messages()), 0)
            came: dict[str, int] = dict.fromkeys(recording.channels.values(), 0)
            delivered = dict(came)

            def deliver(time: int, token: Any) -> None:
                message, changed = _message(token)
                delivered[recording.channels[message.channel]] += 1
                writing.write(start + time, message, changed)

            model = _model(source.stem, recording, names, came, deliver)
            places = _places(names, recording.channels, list(at))
            left_out, model.exactly = disturb_ports(model, map(str, disturbances), places, set, types)
            results = _run(model, seed)
            writing.finish()
    return Disturbed(source, target, came, delivered, results.aspects, left_out, seed)


def _run(model: Model, seed: int) -> Results:
    try:
        return Simulation(model, seed=seed).run()
    except ActorError as error:
        if isinstance(error.__cause__, RecordingError):
            raise error.__cause__ from None
        if isinstance(error.__cause__, FieldError):
            raise RecordingError(
                f"{error}\n   help: only JSON messages can be altered; choose their topics with at"
            ) from None
        raise


# -- the model --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Names:
    """What a channel is in the model: an output of the sender and an input of a receiver."""

    output: str
    actor: str
    port: str


def _names(channels: Mapping[int, str]) -> dict[int, _Names]:
    """``/robot/front/scan`` is the input ``robot_front.scan`` and the output ``recording.robot_front_scan``."""
    found: dict[int, _Names] = {}
    taken: set[str] = set()
    for number, topic in channels.items():
        parts = [re.sub(r"\W", "_", part, flags=re.ASCII) for part in re.split(r"[/.]", topic) if part] or ["_"]
        parts = [f"_{part}" if part[0].isdigit() else part for part in parts]
        actor, port = "_".join(parts[:-1]) or "topic", parts[-1]
        actor += "_" * (actor == SENDER)
        while f"{actor}.{port}" in taken or f"{actor}_{port}" in taken:
            port += "_"
        taken |= {f"{actor}.{port}", f"{actor}_{port}"}
        found[number] = _Names(f"{actor}_{port}", actor, port)
    return found


def _model(
    name: str,
    recording: Recording,
    names: Mapping[int, _Names],
    came: dict[str, int],
    deliver: Callable[[int, Any], None],
) -> Model:
    model = Model(name)
    model.add(_Sender(SENDER, recording, came, [each.output for each in names.values()]))
    ports: dict[str, list[str]] = {}
    for each in names.values():
        ports.setdefault(each.actor, []).append(each.port)
    for actor, inputs in ports.items():
        model.add(_Receiver(actor, deliver, inputs))
    for each in names.values():
        model.connect(f"{SENDER}.{each.output}", f"{each.actor}.{each.port}")
    return model


def _places(
    names: Mapping[int, _Names], channels: Mapping[int, str], patterns: list[str]
) -> dict[str, list[str]] | None:
    """The inputs and outputs of the topics that patterns match; None without patterns."""
    if not patterns:
        return None
    check_topics(patterns, channels.values())
    chosen = [
        names[number] for number, topic in channels.items() if any(fnmatchcase(topic, pattern) for pattern in patterns)
    ]
    return {
        "input": [f"{each.actor}.{each.port}" for each in chosen],
        "output": [f"{SENDER}.{each.output}" for each in chosen],
    }


# -- tokens -----------------------------------------------------------------------------------------------------------


def _token(message: Message) -> dict[str, Any]:
    """The fields of a message, and what is needed to write it again."""
    if isinstance(message.content, bytes):
        fields: dict[str, Any] = {_VALUE: Opaque(message.content)}
        has_fields, text = False, None
    else:
        text = message.content
        value = _value(text)
        has_fields = isinstance(value, dict) and _MESSAGE not in value
        fields = value if has_fields else {_VALUE: value}
    return {**fields, _MESSAGE: json.dumps([message.time, message.channel, message.beside, has_fields, text])}


def _message(token: Any) -> tuple[Message, str | None]:
    """The message that a token was, and its new content; None if that is as it was."""
    if not isinstance(token, dict) or _MESSAGE not in token:
        raise RecordingError("an aspect has replaced a message by something else")
    time, channel, beside, has_fields, text = json.loads(token[_MESSAGE])
    fields = {name: each for name, each in token.items() if name != _MESSAGE}
    if text is None:
        return Message(time, channel, fields[_VALUE].data, beside), None
    said = json.dumps(fields if has_fields else fields[_VALUE])
    changed = None
    if said != json.dumps(_value(text)):
        changed = json.dumps(finite(json.loads(said)), ensure_ascii=False, separators=(",", ":"))
    return Message(time, channel, text, beside), changed


def _value(text: str) -> Any:
    """The JSON value that a text is, or else the text."""
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return text
