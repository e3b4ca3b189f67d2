"""Superdense time: a tag is an instant in integer nanoseconds and a microstep within that instant.

Moments of a run, and the wake-ups that actors request, have tags.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from .primitives import nearest

NANOSECONDS_PER_SECOND = 1_000_000_000
# The end of time: about 146 years. A later time is a mistake, and int64 columns could not hold it.
LATEST = 2**62
_FAR = float(LATEST)


class Tag(NamedTuple):
    """A point of superdense time; tags are ordered by time, then microstep."""

    time: int
    microstep: int

    @property
    def seconds(self) -> float:
        """The time in seconds."""
        return to_seconds(self.time)

    def __str__(self) -> str:
        return f"({to_seconds(self.time):g} s, {self.microstep})"


_new = tuple.__new__


def new_tag(time: int, microstep: int) -> Tag:
    """Make a tag, in half the time that its class takes."""
    return _new(Tag, (time, microstep))


def to_nanoseconds(seconds: float) -> int:
    """The nearest whole nanosecond; raises ``ValueError`` for NaN, infinities and times past ``LATEST``."""
    if type(seconds) is float:  # nearly always
        product = seconds * 1e9
        if -_FAR <= product <= _FAR:
            return nearest(product)
    if not math.isfinite(seconds):
        raise ValueError(f"{seconds!r} is not a time")
    # Compared first as floats: the product may be infinite, which has no integer value.
    nanoseconds = seconds * NANOSECONDS_PER_SECOND
    if abs(nanoseconds) > LATEST:
        raise ValueError(f"{float(seconds):g} s is out of range; the latest time is {to_seconds(LATEST):g} s")
    return round(nanoseconds)


def below_nanoseconds(seconds: float) -> float:
    """What rounding to whole nanoseconds leaves out of a time (s): added to the next time, it does not accumulate."""
    return seconds - to_seconds(to_nanoseconds(seconds))


def to_seconds(nanoseconds: int) -> float:
    """Seconds, as used outside the engine."""
    return nanoseconds / NANOSECONDS_PER_SECOND


class Moment:
    """Represents a tag: time (ns) and microstep, and more in derived classes."""

    __slots__ = ("_tag", "microstep", "time")

    def __init__(self, time: int, microstep: int) -> None:
        self.time = time
        self.microstep = microstep
        self._tag: Tag | None = None

    @property
    def tag(self) -> Tag:
        """The tag by itself."""
        if self._tag is None:
            self._tag = new_tag(self.time, self.microstep)
        return self._tag


class Wake:
    """A wake-up that an actor requested: ``due`` becomes true at its tag; ``cancel()`` before that removes it."""

    __slots__ = ("cancelled", "due", "microstep", "time")

    def __init__(self, when: Tag | Moment) -> None:
        self.move(when)
        self.due = False
        self.cancelled = False

    @property
    def tag(self) -> Tag:
        """When it is due."""
        return new_tag(self.time, self.microstep)

    def move(self, when: Tag | Moment) -> None:
        """Engine: set another tag."""
        self.time = when.time
        self.microstep = when.microstep

    def cancel(self) -> None:
        """Cancel the wake-up."""
        self.cancelled = True


def new_wake(time: int, microstep: int) -> Wake:
    """Make a wake-up, without the detour through its class."""
    wake = Wake.__new__(Wake)
    wake.time, wake.microstep = time, microstep
    wake.due = wake.cancelled = False
    return wake
