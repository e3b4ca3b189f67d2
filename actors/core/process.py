"""Process: an actor written as a SimPy generator instead of ``fire``.

``run()`` yields events: ``self.wait(seconds)``, ``self.read(port)``, or any SimPy event (a resource's request, a
condition, another process).  Waits and reads resume it as a firing, at the tag and in the order in which a reactive
actor would fire; a SimPy event resumes it when SimPy does, and what it then sends is received at the next microstep
of that time.  Tokens that arrive while it waits for something else queue up at the port until they are read; a read
that lost a race (``read | wait``) or was interrupted takes no token unless the process waits for it again.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Generator
from typing import Any, ClassVar
from weakref import ReferenceType, ref

from simpy.events import Event
from simpy.events import Process as SimPyProcess

from .actor import Actor
from .environment import end, settle
from .ports import InputPort
from .tag import Wake


class Process(Actor):
    """Base of actors written as a generator ``run()``.

    All times are in seconds.  A delay is rounded to the nearest nanosecond (of two, the even one), so one up to half
    a nanosecond is 0; a timeout of infinity never ends.
    """

    is_source: ClassVar[bool] = True

    def run(self) -> Generator[Event, Any, None]:
        """The behaviour; yields events and sends tokens."""
        raise NotImplementedError(f"{type(self).__name__} has no run()")

    def initialize(self) -> None:
        self._waits: list[tuple[Wake, Event]] = []
        # Weak, so that a read that nothing waits for is forgotten when the process drops it; one that is waited for
        # is kept, because it may be the only reference to the waiting process.
        self._reads: list[tuple[str, ReferenceType[Event]]] = []
        self._awaited: set[Event] = set()
        self._queued: dict[str, deque[Any]] = {name: deque() for name in self.inputs}
        self.failure: BaseException | None = None
        self.process = SimPyProcess(self.environment, self._behave(self.beginning()))

    def beginning(self) -> Event:
        """What ``run()`` waits for: the first tag."""
        return self.wait(0.0)

    def _behave(self, start: Event) -> Generator[Event, Any, None]:
        yield start
        try:
            yield from self.run()
        except (GeneratorExit, KeyboardInterrupt):
            raise
        except BaseException as error:
            self.failure = error  # which does not show the actor
            raise

    def halt(self) -> None:
        end(self.process)

    @property
    def environment(self) -> Any:
        """The SimPy environment, for resources, conditions and interrupts; its clock and delays are in seconds."""
        return self.context.environment

    def wait(self, delay: float) -> Event:
        """An event that happens in ``delay`` seconds; 0 is the next microstep."""
        event = Event(self.environment)
        self._waits.append((self.wake_in(delay), event))
        return event

    def read(self, port: InputPort[Any]) -> Event:
        """An event whose value is the port's next token: immediately if one is queued, or else when it arrives."""
        event = Event(self.environment)
        queue = self._queued[port.name]
        if queue:
            settle(event, queue.popleft())
        else:
            event.callbacks = _Listeners(ref(event), self._awaited)
            self._reads.append((port.name, ref(event)))
        return event

    def unread(self, port: InputPort[Any]) -> list[Any]:
        """The tokens that have arrived at a port and that nobody has read."""
        return list(self._queued[port.name])

    def fire(self) -> None:
        for name, port in self.inputs.items():
            if port.present:
                self._queued[name].extend(port.tokens)
        due = [entry for entry in self._waits if entry[0].due]
        if due:
            self._waits = [entry for entry in self._waits if not entry[0].due]
        for _, event in due:
            settle(event, None)
        # A resumed process may request the next token at once, so repeat until no read can be served.
        while (entry := self._next_read()) is not None:
            name, event = entry
            settle(event, self._queued[name].popleft())
        if self.failure is not None:
            raise self.failure

    def _next_read(self) -> tuple[str, Event] | None:
        """Take the first read for which a token is queued."""
        if not self._reads:
            return None
        self._reads = [entry for entry in self._reads if entry[1]() is not None]
        for index, (name, reference) in enumerate(self._reads):
            event = reference()
            if event is not None and self._queued[name] and not getattr(event.callbacks, "deserted", False):
                del self._reads[index]
                self._awaited.discard(event)
                return name, event
        return None


class _Listeners(list[Any]):
    """The callbacks of a read, which note when nothing waits for it any longer.

    A condition and an interrupt remove their callback; without this, the read would swallow the next token.
    """

    deserted = False

    def __init__(self, event: ReferenceType[Event], awaited: set[Event]) -> None:
        super().__init__()
        self._event, self._awaited = event, awaited

    def append(self, callback: Any) -> None:
        self.deserted = False
        super().append(callback)
        if (event := self._event()) is not None:
            self._awaited.add(event)

    def remove(self, callback: Any) -> None:
        super().remove(callback)
        self.deserted = not self
        if self.deserted and (event := self._event()) is not None:
            self._awaited.discard(event)
