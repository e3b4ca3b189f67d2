"""A director for one actor: enough of the engine to give it tokens, let it fire, and see what it sends."""

from __future__ import annotations

from typing import Any

from epicycle.actors import Actor, InputPort, Tag, Wake, to_nanoseconds


class Harness:
    """Implements ``Context`` for one actor and keeps what it sends, by port, as (seconds, token) pairs.

    Ports that need not be connected are not, unless ``widths`` or a token says so.
    """

    def __init__(self, actor: Actor, *, seed: int = 1, widths: dict[str, int] | None = None) -> None:
        self.actor = actor
        self.tag = Tag(0, 0)
        self.seed = seed
        self.environment = None
        self.wakes: list[Wake] = []
        self.sent: dict[str, list[tuple[float, Any]]] = {name: [] for name in actor.outputs}
        self.channels: dict[str, list[int | None]] = {name: [] for name in actor.outputs}
        for name, port in [*actor.inputs.items(), *actor.outputs.items()]:
            is_left_out = isinstance(port, InputPort) and not port.required
            port.width = (widths or {}).get(name, 0 if is_left_out else 1)
        for name, port in actor.outputs.items():
            port.connect(lambda token, channel=None, name=name: self._keep(name, token, channel))
        actor.enter(self)
        actor.initialize()

    def _keep(self, name: str, token: Any, channel: int | None) -> None:
        self.sent[name].append((self.tag.seconds, token))
        self.channels[name].append(channel)

    def wake(self, actor: Actor, time: int) -> Wake:
        tag = Tag(time, 1) if time > self.tag.time else Tag(self.tag.time, self.tag.microstep + 1)
        self.wakes.append(Wake(tag))
        return self.wakes[-1]

    def fire(self, seconds: float, microstep: int = 1, **tokens: Any) -> None:
        """Fire at a time; a list of tokens goes to the channels of a multi-port, one each, None left out."""
        self.tag = Tag(to_nanoseconds(seconds), microstep)
        for name, token in tokens.items():
            port = self.actor.inputs[name]
            port.width = max(port.width, len(token) if port.multi else 1)
            for channel, each in enumerate(token if port.multi else [token]):
                if each is not None:
                    put, put_channel = port.entry()
                    put(each)
                    put_channel(channel)
        self.actor.fire()
        for port in self.actor.inputs.values():
            port.clear()

    def run(self, until: float) -> None:
        """Let an actor that wakes itself do so up to and including a time."""
        while True:
            due = [wake for wake in self.wakes if not wake.cancelled and wake.tag.time <= to_nanoseconds(until)]
            if not due:
                return
            wake = min(due, key=lambda each: each.tag)
            self.wakes.remove(wake)
            self.tag = wake.tag
            wake.due = True
            self.actor.fire()

    def last(self, port: str) -> Any:
        return self.sent[port][-1][1]

    def tokens(self, port: str) -> list[Any]:
        return [token for _, token in self.sent[port]]
