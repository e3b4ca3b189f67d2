"""WaitingLine: a queue with a discipline."""

from __future__ import annotations

from collections import deque
from typing import Any, ClassVar

from ..core import EpicycleError, InputPort, OutputPort, Parameter
from ..expression import TokenFormulaParameter
from .waiting import Waiter, WaitingActor, check_channels


class WaitingLine(WaitingActor):
    """A queue in any order from which each trigger takes a token, sent on the same channel of the output.

    ``order: due`` serves the earliest due date first, ``order: work`` the shortest job, ``order: -value`` the highest
    value, ``order: channel`` the tokens of the first connection; ``discipline`` decides among equals.  A token that has
    to wait may turn away (``balking``), find no ``room``, or lose its ``patience``.  At one tag, tokens renege first,
    then tokens come in, then triggers release them; outputs are sent at the next microstep, so the actor may be part of
    a loop.  With ``credits: 2``, before a ``Server`` of 2 servers whose output triggers it, it is a G/G/2 queue with
    that discipline.  ``Queue`` is the simple version.  Sources: Gross and others, Fundamentals of Queueing Theory;
    SimPy's ``Store`` and ``PriorityStore``.
    """

    entrance: ClassVar[str] = "input"

    input = InputPort(multi=True, doc="tokens that wait")
    trigger = InputPort(multi=True, required=False, doc="releases the next token")
    output = OutputPort(multi=True, depends_on=(), doc="tokens, each on the channel of its trigger")
    rejected = OutputPort(depends_on=(), doc="tokens that found no room")
    balked = OutputPort(depends_on=(), doc="tokens that did not join the line")
    reneged = OutputPort(depends_on=(), doc="tokens that lost their patience")
    waiting = OutputPort(int, depends_on=(), doc="number of waiting tokens, whenever it changes")

    size = TokenFormulaParameter(
        "1",
        known=("time", "channel"),
        doc="room that a token takes: an expression over its fields, token, time, channel",
    )
    credits = Parameter(int, 0, min=0, doc="number of tokens released on each channel before its first trigger")
    persistent_trigger = Parameter(bool, True, doc="whether a trigger that finds no token waits for the next one")

    def initialize(self) -> None:
        super().initialize()
        check_channels(self, "trigger", "output")
        self._answers_by_channel = self.trigger.width > 1 and self.output.width > 1
        self._credits = self.credits * max(self.trigger.width, 1)  # that are left, for the channels in turn
        self._triggers: deque[int] = deque()

    def _make_room(self) -> bool:
        self._triggers.extend(channel for channel, _ in self.trigger.arrivals())
        return self.trigger.present

    def _newcomer(self, token: Any, channel: int, now: float) -> Waiter:
        size = self.size.number("a size", token, now, channel)
        if size < 0:
            raise EpicycleError(f"{self.size} gives {size:g}, but a size must be >= 0")
        return self._waiter(token, channel, now, size)

    def _serve(self) -> None:
        while self._waiting and (self._credits or self._triggers):
            channel = self._next_channel()
            self._tell("output", self._waiting.take().token, channel if self._answers_by_channel else None)
        if not self.persistent_trigger:
            self._credits = 0
            self._triggers.clear()

    def _tell_counts(self) -> None:
        self._tell_count("waiting", len(self._waiting))

    def _next_channel(self) -> int:
        if not self._credits:
            return self._triggers.popleft()
        self._credits -= 1
        return -(self._credits + 1) % max(self.trigger.width, 1)
