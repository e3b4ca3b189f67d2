"""WaitingLine: a queue with a discipline."""

from __future__ import annotations

from collections import deque
from typing import Any, ClassVar

from ..core import EpicycleError, InputPort, OutputPort, Parameter
from ..expression import FormulaParameter, number_of_token
from .waiting import WaitingActor, check_channels


class WaitingLine(WaitingActor):
    """A queue in any order from which each trigger takes a token: on the channel of the output that it came by.

    ``order: due`` lets the earliest due date go first, ``order: work`` the shortest job, ``order: -value`` the highest
    value, ``order: channel`` what comes in by the first connection; ``discipline`` decides among equals.  A token that
    has to wait may turn away (``balking``), find no ``room``, or lose its ``patience``.  At one tag those that renege
    go first, then tokens come in, then triggers let them out; outputs leave at the next microstep, so the actor may
    stand in a loop.  With ``credits: 2``, before a ``Server`` of 2 servers whose output triggers it, it is a queue of
    type G/G/2 with that discipline.  ``Queue`` is the plain one.  Sources: Gross and others, Fundamentals of Queueing
    Theory; SimPy's ``Store`` and ``PriorityStore``.
    """

    entrance: ClassVar[str] = "input"

    input = InputPort(multi=True, doc="what comes in")
    trigger = InputPort(multi=True, required=False, doc="lets the next token go")
    output = OutputPort(multi=True, depends_on=(), doc="the tokens, each on the channel of its trigger")
    rejected = OutputPort(depends_on=(), doc="the tokens that found no room")
    balked = OutputPort(depends_on=(), doc="the tokens that did not care to wait")
    reneged = OutputPort(depends_on=(), doc="the tokens that lost their patience")
    waiting = OutputPort(int, depends_on=(), doc="how many wait, whenever that changes")

    size = FormulaParameter("1", doc="how much room a token takes; of its fields, token, time, channel")
    credits = Parameter(int, 0, min=0, doc="how many tokens each channel lets go before its first trigger")
    persistent_trigger = Parameter(bool, True, doc="whether a trigger that finds no token waits for the next one")

    def initialize(self) -> None:
        super().initialize()
        check_channels(self, "trigger", "output")
        self._triggers = deque(channel for _ in range(self.credits) for channel in range(max(self.trigger.width, 1)))

    def fire(self) -> None:
        self._send()
        self._renege()
        for channel, tokens in enumerate(self.trigger.by_channel()):
            self._triggers.extend([channel] * len(tokens))
        newcomers = [
            self._waiter(token, channel, self._size(token, channel))
            for channel, tokens in enumerate(self.input.by_channel())
            for token in tokens
        ]
        self._join(newcomers, self._serve)
        if not self.persistent_trigger:
            self._triggers.clear()
        self._tell_count("waiting", len(self._waiting))

    def _size(self, token: Any, channel: int) -> float:
        size = number_of_token(self.size, "a size", token, time=self.now, channel=channel)
        if size < 0:
            raise EpicycleError(f"{self.size} gives {size:g}, but a size is >= 0")
        return size

    def _serve(self) -> None:
        while self._triggers and len(self._waiting):
            first, channel = self._waiting.first, self._triggers.popleft()
            self._waiting.remove(first)
            self._tell("output", first.token, channel if self.trigger.width > 1 and self.output.width > 1 else None)
