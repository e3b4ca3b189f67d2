"""Disturbances of communication: they attach to input ports, and decide whether, when and how a message arrives."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from epicycle.actors import (
    Exponential,
    Normal,
    Parameter,
    Stream,
    Uniform,
    texts_parameter,
    to_nanoseconds,
    to_seconds,
)

from .core import CommunicationAspect, JoinPoint, LawParameter, RandomLoss, altered, is_bad, law

LAWS = {"uniform": Uniform(low=-1.0), "normal": Normal(), "exponential": Exponential()}
GAUSSIAN, BIT_FLIP = "gaussian", "bit_flip"
DROP, DELAY = "drop", "delay"


class PacketLoss(RandomLoss, CommunicationAspect):
    """Drops each message with a fixed probability, independently per receiver and message (Bernoulli).

    The counterpart of ``MeasurementFailure`` for messages; for bursts of losses, see ``GilbertElliott``.
    Event: ``dropped``.  Paper: the communication error of the disturbance level, section III.A.
    """

    probability = Parameter(float, min=0.0, max=1.0, unit="1", doc="probability that a message is lost")

    def draw(self, point: JoinPoint) -> bool:
        return bool(point.random.random() < self.probability)


class GilbertElliott(RandomLoss, CommunicationAspect):
    """Drops messages in bursts: a channel that is good or bad, and changes between the two from message to message.

    In the stationary state, the channel is bad with probability p / (p + r); it stays bad for 1 / r messages on
    average, and good for 1 / p.  The mean loss is (p * loss_bad + r * loss_good) / (p + r).  A loss of 25 % in bursts
    of four: ``r: 0.25, p: 0.0833``.  Event: ``dropped``.  Source: Gilbert, Bell Syst. Tech. J. 39, 1960; Elliott, 42,
    1963.
    """

    p = Parameter(float, min=0.0, max=1.0, unit="1", doc="probability that a good channel turns bad, per message")
    r = Parameter(float, 1.0, min=0.0, max=1.0, unit="1", doc="probability that a bad channel recovers, per message")
    loss_bad = Parameter(float, 1.0, min=0.0, max=1.0, unit="1", doc="probability of loss while the channel is bad")
    loss_good = Parameter(float, 0.0, min=0.0, max=1.0, unit="1", doc="probability of loss while it is good")

    def draw(self, point: JoinPoint) -> bool:
        probability = self.loss_bad if is_bad(point, self.p, self.r) else self.loss_good
        return bool(point.random.random() < probability)


class Latency(CommunicationAspect):
    """Delays each message by ``delay`` and a random part: ``jitter`` times a value drawn from the distribution.

    uniform: ``delay`` + U(-jitter, jitter); normal: ``delay`` + N(0, jitter^2); exponential: ``delay`` + Exp(mean
    ``jitter``); all limited to >= 0.  One value is drawn for every message, whatever the jitter.
    Unless ``reordering`` is allowed, a message waits for the previous one.  Event: ``delayed``, with the seconds.
    """

    events: ClassVar[tuple[str, ...]] = ("delayed",)

    delay = Parameter(float, 0.0, min=0.0, unit="s", doc="fixed part of the delay")
    jitter = Parameter(float, 0.0, min=0.0, unit="s", doc="size of the random part, in the sense of the distribution")
    distribution = LawParameter(LAWS, "uniform", doc="law of the random part, in units of the jitter")
    reordering = Parameter(bool, False, doc="whether a message may overtake an earlier one")

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        delay = max(0.0, self.delay + self.jitter * law(self.distribution, LAWS).draw(point.random))
        if not self.reordering:  # in whole nanoseconds: late in a long run, seconds are too coarse to keep an order
            now = point.tag.time
            last = point.memory.get("last", now)
            point.memory["last"] = max(now + to_nanoseconds(delay), last)
            delay = max(delay, to_seconds(last - now))
        point.delay(token, delay)


class Duplicate(CommunicationAspect):
    """Delivers a message more than once, with a fixed probability.

    Event: ``duplicated``, with the number of copies.
    """

    events: ClassVar[tuple[str, ...]] = ("duplicated",)

    probability = Parameter(float, min=0.0, max=1.0, unit="1", doc="probability that a message is duplicated")
    copies = Parameter(int, 1, min=1, max=1000, doc="number of additional deliveries")
    spacing = Parameter(float, 0.0, min=0.0, unit="s", doc="time between copies; 0 is the next microstep")

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        point.forward(token)
        if point.random.random() < self.probability:
            point.act("duplicated", token, self.copies)
            for copy in range(1, self.copies + 1):
                point.forward(token, copy * self.spacing)


class Reorder(CommunicationAspect):
    """With a fixed probability, holds a message back until later ones have overtaken it.

    A message still held at the end of the run is never delivered.  Events: ``held``, ``released``.
    """

    events: ClassVar[tuple[str, ...]] = ("held", "released")

    probability = Parameter(float, min=0.0, max=1.0, unit="1", doc="probability that a message is held back")
    overtaken_by = Parameter(int, 1, min=1, doc="number of later messages that pass before it is delivered")

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        held: list[list[Any]] = point.memory.setdefault("held", [])  # [messages still to pass, token]
        if point.random.random() < self.probability:
            point.act("held", token)
            held.append([self.overtaken_by, token])
            return
        self.pass_by(token, point)

    def pass_by(self, token: Any, point: JoinPoint) -> None:
        point.forward(token)
        held: list[list[Any]] = point.memory.get("held", [])
        for waiting in held:
            waiting[0] -= 1
        while held and held[0][0] <= 0:
            late = held.pop(0)[1]
            point.act("released", late)
            point.forward(late)


class Corrupt(CommunicationAspect):
    """Damages the numbers in a message, with a fixed probability.

    gaussian: adds N(0, deviation^2) to each.  bit_flip: flips one random bit of the 64 of each; results that are not
    finite are left to the receiver.  Event: ``corrupted``, with the new message.
    """

    events: ClassVar[tuple[str, ...]] = ("corrupted",)

    probability = Parameter(float, min=0.0, max=1.0, unit="1", doc="probability that a message is damaged")
    kind = Parameter(str, GAUSSIAN, choices=(GAUSSIAN, BIT_FLIP), doc="how a number is damaged")
    deviation = Parameter(float, 1.0, min=0.0, doc="standard deviation of the error, in the number's own unit")
    fields = texts_parameter(
        (), doc="fields of the message that can be damaged; if left out, all numbers except its time"
    )

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        hit = point.random.random() < self.probability
        if self.kind == BIT_FLIP:
            new = altered(token, self.fields, lambda numbers: _flip(numbers, point.random))
        else:
            new = altered(
                token, self.fields, lambda numbers: numbers + self.deviation * point.random.normal(size=numbers.shape)
            )
        if not hit:
            point.forward(token)
            return
        point.act("corrupted", token, new)
        point.forward(new)


def _flip(numbers: NDArray[np.float64], random: Stream) -> NDArray[np.float64]:
    """Each number with one bit of its IEEE 754 form flipped."""
    bits = np.left_shift(np.uint64(1), random.integers(0, 64, numbers.shape, dtype=np.uint64))
    return (numbers.view(np.uint64) ^ bits).view(np.float64)


class Throttle(CommunicationAspect):
    """Lets through at most ``rate`` messages per second in the long run, and ``burst`` at once (token bucket).

    The bucket holds ``burst`` permits, is full at the start and gains ``rate`` per second; each message takes one. A
    message that finds the bucket empty is dropped (policing) or waits for its permit in order (shaping).
    Events: ``dropped``; ``delayed``, with the seconds.
    """

    events: ClassVar[tuple[str, ...]] = ("dropped", "delayed")

    rate = Parameter(float, above=0, unit="1/s", doc="messages per second")
    burst = Parameter(int, 1, min=1, doc="messages that may pass at once")
    excess = Parameter(str, DROP, choices=(DROP, DELAY), doc="what happens to a message above these limits")

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        # Permits below zero are reserved for waiting messages.
        now = point.tag.time
        permits, since = point.memory.get("permits", (float(self.burst), now))
        permits = min(float(self.burst), permits + to_seconds(now - since) * self.rate)
        if permits >= 1.0 - 1e-9:  # rounding must not drop a message that comes exactly on time
            point.memory["permits"] = (permits - 1.0, now)
            point.forward(token)
        elif self.excess == DROP:
            point.memory["permits"] = (permits, now)
            point.act("dropped", token)
        else:
            point.memory["permits"] = (permits - 1.0, now)
            point.delay(token, (1.0 - permits) / self.rate)
