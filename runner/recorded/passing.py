"""A recording passes the aspects of disturbances: a model replays it, and a model's aspects do not know that."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from epicycle.actors import Actor, EpicycleError, InputPort, OutputPort, texts_parameter
from epicycle.aspects import FieldError

from ..execution.engine import ActorError, Simulation
from ..model.build.disturbance import disturb
from ..model.build.model import Model
from ..model.language.settings import Setting
from ..support.shown import finite, short
from ..support.tables import Table, Tabled
from .files import Codec, Message, Recording, RecordingError, opened, topics_like

SENDER = "recording"
_LONGEST = 1_000_000_000 * 10**9  # ns
_MESSAGE = "\0"  # the field of a token that says which message it was: a text, which no aspect alters
_VALUE = "value"  # the field of a token with the content, if that has no fields


@dataclass(repr=False)
class Disturbed(Tabled):
    """A recording that was disturbed: messages by topic, before and after, and what the aspects counted."""

    recording: Path
    out: Path
    came: dict[str, int]
    delivered: dict[str, int]
    aspects: dict[str, dict[str, float | None]]
    left_out: list[str]  # aspects and settings of the disturbances that are not for recordings
    seed: int

    def facts(self) -> dict[str, Any]:
        """Everything that is known of it, as JSON-like data."""
        return {**asdict(self), "recording": str(self.recording), "out": str(self.out)}

    def _caption(self) -> str:
        came, delivered = (sum(each.values()) for each in (self.came, self.delivered))
        left_out = f"; not for recordings, and left out: {', '.join(self.left_out)}" if self.left_out else ""
        return f"{self.recording}: {came:,} messages came, {delivered:,} were delivered, seed {self.seed}{left_out}"

    def _tables(self) -> list[Table]:
        topics = [(topic, f"{came:,}", f"{self.delivered[topic]:,}") for topic, came in self.came.items()]
        figures = [
            (name, what, "-" if figure is None else short(figure))
            for name, each in self.aspects.items()
            for what, figure in each.items()
        ]
        return [Table(("topic", "came", "delivered"), topics), Table(("aspect", "figure", "value"), figures)]


class Opaque:
    """A message whose content nobody has read: an aspect that would alter it fails."""

    __slots__ = ("message",)

    def __init__(self, message: Message) -> None:
        self.message = message

    def __repr__(self) -> str:
        return f"<{len(self.message.content)} bytes>"


class _Sender(Actor):
    """Sends the messages of a recording at their times, each channel by its own output."""

    copies_share = ("_recording", "_came", "_token")

    ports = texts_parameter(doc="names of the outputs, in the order of the channels")

    def __init__(
        self, path: str, recording: Recording, came: dict[str, int], token: Callable[[Message], Any], ports: list[str]
    ) -> None:
        self._recording, self._token = recording, token
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
        self.outputs[self._outputs[self._next.channel]].send(self._token(self._next))
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
        raise RecordingError(f"{target} must be of the same kind as {source}: {source.suffix or 'a folder'}")
    patterns, names = list(at), list(map(str, disturbances))
    with opened(source) as recording:

        def weave(model: Model, channels: _Channels) -> list[str]:
            places = _places(channels, recording.channels, patterns)
            return disturb(model, names, set, types, only_ports=True, at=places)[1]

        try:
            return _pass(source, recording, target, weave, seed, None)  # of bytes that nobody reads, which is faster
        except ActorError as error:
            codec = _codec(recording, error)
        return _pass(source, recording, target, weave, seed, codec)


def _codec(recording: Recording, error: ActorError) -> Codec:
    """What reads the messages that an aspect wants to know; raises ``EpicycleError``."""
    try:
        codec = recording.codec()
    except EpicycleError as lacking:
        raise RecordingError(f"{error}\n   help: {lacking}") from None
    if codec is not None:
        return codec
    if isinstance(error.__cause__, FieldError):
        raise RecordingError(
            f"{error}\n   help: only messages in JSON, and those of ROS 2, can be altered; choose their topics with at"
        ) from None
    raise error


def _pass(
    source: Path,
    recording: Recording,
    target: Path,
    weave: Callable[[Model, _Channels], list[str]],
    seed: int,
    codec: Codec | None,
) -> Disturbed:
    """Let the messages pass, those that aspects reach with their fields if there is a codec."""
    channels, tokens = _names(recording.channels), _Tokens(recording.channels, codec)
    with recording.replacing(target) as writing:
        start = next((message.time for message in recording.messages()), 0)
        came: dict[str, int] = dict.fromkeys(recording.channels.values(), 0)
        delivered = dict(came)

        def deliver(time: int, token: Any) -> None:
            message, changed = tokens.message(token)
            delivered[recording.channels[message.channel]] += 1
            writing.write(start + time, message, changed)

        model = _model(recording, channels, came, tokens.of, deliver)
        left_out = weave(model, channels)
        reached = {path for woven in model.aspects for path in woven.ports}
        tokens.are_read = {number for number, each in channels.items() if not reached.isdisjoint(each.paths)}
        try:
            results = Simulation(model, seed=seed).run()
        except ActorError as error:
            raise (error.__cause__ if isinstance(error.__cause__, RecordingError) else error) from None
        writing.finish()
    return Disturbed(source, target, came, delivered, results.aspects, left_out, seed)


# -- the model --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Names:
    """What a channel is in the model: an output of the sender and an input of a receiver."""

    output: str
    actor: str
    port: str

    @property
    def paths(self) -> tuple[str, str]:
        return f"{SENDER}.{self.output}", f"{self.actor}.{self.port}"


_Channels = dict[int, _Names]


def _names(channels: Mapping[int, str]) -> _Channels:
    """``/robot/front/scan`` is the input ``robot_front.scan`` and the output ``recording.robot_front_scan``."""
    found: _Channels = {}
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
    recording: Recording,
    names: _Channels,
    came: dict[str, int],
    token: Callable[[Message], Any],
    deliver: Callable[[int, Any], None],
) -> Model:
    model = Model(recording.path.stem)
    model.add(_Sender(SENDER, recording, came, token, [each.output for each in names.values()]))
    ports: dict[str, list[str]] = {}
    for each in names.values():
        ports.setdefault(each.actor, []).append(each.port)
    for actor, inputs in ports.items():
        model.add(_Receiver(actor, deliver, inputs))
    for each in names.values():
        model.connect(f"{SENDER}.{each.output}", f"{each.actor}.{each.port}")
    return model


def _places(names: _Channels, channels: Mapping[int, str], patterns: list[str]) -> dict[str, list[str]] | None:
    """The inputs and outputs of the topics that patterns match; None without patterns."""
    if not patterns:
        return None
    found = topics_like(patterns, channels.values())
    chosen = [names[number] for number, topic in channels.items() if topic in found]
    return {
        "input": [f"{each.actor}.{each.port}" for each in chosen],
        "output": [f"{SENDER}.{each.output}" for each in chosen],
    }


# -- tokens -----------------------------------------------------------------------------------------------------------


class _Tokens:
    """What messages are as tokens; those of channels that ``are_read`` by a codec have fields."""

    def __init__(self, topics: Mapping[int, str], codec: Codec | None) -> None:
        self._topics, self._codec = topics, codec
        self.are_read: set[int] = set()

    def of(self, message: Message) -> Any:
        """The fields of a message, and what is needed to write it again."""
        time, channel, content, beside = message
        if isinstance(content, str):
            text, value = content, _value(content)
        elif self._codec is not None and channel in self.are_read:
            text, value = content.decode("latin-1"), self._codec.read(self._topics[channel], content)
        else:
            return Opaque(message)
        has_fields = isinstance(value, dict) and _MESSAGE not in value
        note = json.dumps([time, channel, beside, has_fields, isinstance(content, str), text])
        return {**(value if has_fields else {_VALUE: value}), _MESSAGE: note}

    def message(self, token: Any) -> tuple[Message, str | bytes | None]:
        """The message that a token was, and its new content; None if that is as it was."""
        if isinstance(token, Opaque):
            return token.message, None
        if not isinstance(token, dict) or _MESSAGE not in token:
            raise RecordingError("an aspect has replaced a message by something else")
        time, channel, beside, has_fields, is_text, text = json.loads(token[_MESSAGE])
        fields = {name: each for name, each in token.items() if name != _MESSAGE}
        value = fields if has_fields else fields[_VALUE]
        if not is_text:
            assert self._codec is not None
            content, topic = text.encode("latin-1"), self._topics[channel]
            new = self._codec.written(topic, value)
            is_same = new == self._codec.written(topic, self._codec.read(topic, content))
            return Message(time, channel, content, beside), None if is_same else new
        said, changed = json.dumps(value), None
        if said != json.dumps(_value(text)):
            changed = json.dumps(finite(json.loads(said)), ensure_ascii=False, separators=(",", ":"))
        return Message(time, channel, text, beside), changed


def _value(text: str) -> Any:
    """The JSON value that a text is, or else the text."""
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return text
