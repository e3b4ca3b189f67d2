"""Tests of a single actor without a model: tokens in at given times, and the tokens that it sends.

>>> harness = Harness(Scale("scale", factor=3))
>>> harness.run(until=2.0, input=[(0.5, 1.0), (1.5, 2.0)])
>>> harness.sent["output"]
[(0.5, 3.0), (1.5, 6.0)]

``epicycle.aspects.testing`` has tools for tests of aspects.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from simpy.events import Event, EventPriority

from .core import Actor, Environment, Events, Streams, Tag, Wake, to_nanoseconds


class Harness:
    """A run of one actor, reactive or a process; its time begins at 0 s.

    ``sent``: the tokens that the actor has sent, as (seconds, token) by output port.  ``channels``: the channel of
    each, None for all channels.  ``wakes``: the pending wake-ups.  ``stopped``: the reason if the actor has ended the
    run.

    Optional ports are not connected, unless ``widths`` gives their number of connections or a token comes.
    """

    def __init__(self, actor: Actor, *, seed: int = 1, widths: Mapping[str, int] | None = None) -> None:
        self.actor = actor
        self.tag = Tag(0, 0)
        self.seed = seed
        self.streams = Streams(seed)
        self.events = Events()
        self.environment = Environment(self)
        self.wakes: list[Wake] = []
        self.stopped: str | None = None
        self.sent: dict[str, list[tuple[float, Any]]] = {name: [] for name in actor.outputs}
        self.channels: dict[str, list[int | None]] = {name: [] for name in actor.outputs}
        for name, port in actor.inputs.items():
            port.width = (widths or {}).get(name, int(port.required))
        for name, output in actor.outputs.items():
            output.width = (widths or {}).get(name, 1)
            output.connect(lambda token, channel=None, name=name: self._keep(name, token, channel))
        actor.enter(self)
        actor.initialize()

    def _keep(self, name: str, token: Any, channel: int | None) -> None:
        self.sent[name].append((self.tag.seconds, token))
        self.channels[name].append(channel)

    @property
    def time(self) -> int:
        """The time of the present tag (ns)."""
        return self.tag.time

    @property
    def next_event(self) -> int:
        """The time of SimPy's next event (ns)."""
        return self.events.first

    def put_event(self, event: Event, priority: EventPriority, delay: int) -> None:
        """Called by the environment: let an event happen after ``delay`` ns."""
        self.events.put(self.time + delay, priority, event)

    def wake(self, actor: Actor, time: int) -> Wake:
        """Called by ``wake_in`` and ``wake_at`` of the actor."""
        tag = Tag(time, 1) if time > self.tag.time else Tag(self.tag.time, self.tag.microstep + 1)
        self.wakes.append(Wake(tag))
        return self.wakes[-1]

    def stop(self, reason: str) -> None:
        """Called by the actor to end the run."""
        self.stopped = reason

    def fire(self, seconds: float, microstep: int = 1, **tokens: Any) -> None:
        """Fire once at a tag, with a token for each of these inputs; wake-ups of this tag are due.

        A list of tokens goes to the channels of a port with several connections, one each, except None; anything else
        goes to the first channel.
        """
        self._fire(Tag(to_nanoseconds(seconds), microstep), tokens.items())

    def run(self, until: float, **inputs: Iterable[tuple[float, Any]]) -> None:
        """Let time pass up to and including ``until`` s: fire for these tokens, (seconds, token) by port, and wake-ups.

        A list of tokens is distributed as in ``fire``; tokens with the same time arrive at the same tag.
        """
        coming: dict[int, list[tuple[str, Any]]] = {}
        for name, feed in inputs.items():
            for seconds, token in feed:
                coming.setdefault(to_nanoseconds(seconds), []).append((name, token))
        end = to_nanoseconds(until)
        while self.stopped is None:
            self.wakes = [wake for wake in self.wakes if not wake.cancelled]
            tags = [wake.tag for wake in self.wakes] + [Tag(time, 1) for time in coming]
            tag = min(tags, default=Tag(end + 1, 0))
            if self.next_event <= min(tag.time, end):
                self._resume()
            elif tag.time > end:
                break
            else:
                self._fire(tag, coming.pop(tag.time, []) if tag.microstep == 1 else [])

    def _resume(self) -> None:
        """Let SimPy's next event happen, which may resume a process."""
        self.tag = max(self.tag, Tag(self.next_event, 1))
        self.events.happen()

    def _fire(self, tag: Tag, tokens: Iterable[tuple[str, Any]]) -> None:
        self.tag = tag
        for name, token in tokens:
            port = self.actor.inputs[name]
            each_channel = token if port.multi and isinstance(token, list) else [token]
            port.width = max(port.width, len(each_channel))
            for channel, each in enumerate(each_channel):
                if each is not None:
                    port.receive(each, channel)
        due = [wake for wake in self.wakes if wake.tag == tag and not wake.cancelled]
        for wake in due:
            wake.due = True
            self.wakes.remove(wake)
        self.actor.fire()
        for port in self.actor.inputs.values():
            port.clear()

    def tokens(self, port: str) -> list[Any]:
        """The tokens that one port has sent, without the times."""
        return [token for _, token in self.sent[port]]

    def last(self, port: str) -> Any:
        """The latest token of one port."""
        return self.sent[port][-1][1]
