"""Moments of a run, and the wake-ups that actors request."""

from __future__ import annotations

from .tag import Tag, new_tag


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
