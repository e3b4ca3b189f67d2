"""Moments of a run, and the wake-ups that actors ask for."""

from __future__ import annotations

from typing import Protocol

from .tag import Tag, new_tag


class When(Protocol):
    """A tag, or what stands for one."""

    @property
    def time(self) -> int: ...
    @property
    def microstep(self) -> int: ...


class Moment:
    """What stands for a tag: time (ns) and microstep, and more in classes that derive from it."""

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
    """A wake-up that an actor asked for: ``due`` becomes true at its tag; ``cancel()`` before that removes it."""

    __slots__ = ("cancelled", "due", "microstep", "time")

    def __init__(self, when: When) -> None:
        self.move(when)
        self.due = False
        self.cancelled = False

    @property
    def tag(self) -> Tag:
        """When it is due."""
        return new_tag(self.time, self.microstep)

    def move(self, when: When) -> None:
        """Engine: tell another tag."""
        self.time = when.time
        self.microstep = when.microstep

    def cancel(self) -> None:
        """Ask the director to forget it."""
        self.cancelled = True


def new_wake(time: int, microstep: int) -> Wake:
    """A wake-up, without a detour through its class."""
    wake = Wake.__new__(Wake)
    wake.time, wake.microstep = time, microstep
    wake.due = wake.cancelled = False
    return wake
