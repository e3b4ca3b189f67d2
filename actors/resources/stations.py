"""Process actors that work as in SimPy's tutorials: Station, with a resource, and Machine, with interrupts."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import simpy
from simpy.events import Event

from ..core import InputPort, OutputPort, Parameter, Process
from ..distributions import Distribution


class Station(Process):
    """A station with ``places``, each of which serves one token at a time; urgent tokens go first.

    A ``simpy.PriorityResource``: a service that has begun is not interrupted.  The time of a service is drawn when it
    begins.  ``Server`` does the same without priorities and without SimPy.
    """

    input = InputPort(required=False, doc="tokens to serve")
    urgent = InputPort(required=False, doc="urgent tokens, served before those that wait at input")
    begun = OutputPort(depends_on=(), doc="each token when its service begins")
    output = OutputPort(depends_on=(), doc="each token when its service ends")

    places = Parameter(int, 1, min=1, doc="number of tokens served at a time")
    service_time = Parameter(Distribution, unit="s", doc="duration of a service")

    def run(self) -> Generator[Event, Any, None]:
        self.resource = simpy.PriorityResource(self.environment, self.places)
        self.environment.process(self._admit(self.urgent, priority=0))
        yield from self._admit(self.input, priority=1)

    def _admit(self, port: InputPort[Any], priority: int) -> Generator[Event, Any, None]:
        while True:
            token = yield self.read(port)
            self.environment.process(self._serve(token, priority))

    def _serve(self, token: Any, priority: int) -> Generator[Event, Any, None]:
        with self.resource.request(priority=priority) as request:
            yield request
            self.begun.send(token)
            yield self.wait(self.service_time.draw_time(self.random))
        self.output.send(token)


class Machine(Process):
    """A machine that makes one part after another, breaks down now and then, and waits for repair.

    A breakdown interrupts the work on a part, which resumes where it was when the machine runs again.  The machine
    sends its ``number`` when it breaks down, and runs again when this number comes back.
    """

    repaired = InputPort(int, doc="numbers of repaired machines; those of other machines are ignored")
    broken = OutputPort(int, depends_on=(), doc="its number, when it breaks down")
    part = OutputPort(int, depends_on=(), doc="number of parts made so far, sent for each finished part")

    number = Parameter(int, 0, doc="the number that identifies the machine")
    work_time = Parameter(Distribution, unit="s", doc="time to make a part")
    time_to_failure = Parameter(Distribution, unit="s", doc="time that it runs until it breaks down")

    def run(self) -> Generator[Event, Any, None]:
        self._runs = True
        self.environment.process(self._break())
        parts = 0
        while True:
            left = self.work_time.draw_time(self.random)
            is_made = False
            while not is_made:
                begin = self.now
                try:
                    yield self.wait(left)  # at least a microstep, or parts that take no time would come without end
                    is_made = True
                except simpy.Interrupt:
                    left = max(left - (self.now - begin), 0.0)
                    yield from self._repair()
            parts += 1
            self.part.send(parts)

    def _break(self) -> Generator[Event, Any, None]:
        while True:
            yield self.wait(self.time_to_failure.draw_time(self.random))
            if self._runs:  # a broken machine does not break down
                self.process.interrupt()

    def _repair(self) -> Generator[Event, Any, None]:
        self._runs = False
        self.broken.send(self.number)
        while (yield self.read(self.repaired)) != self.number:
            pass
        self._runs = True
