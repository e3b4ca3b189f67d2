"""What a port and a wake-up are while a model runs; compiled, where a compiler was there (see ``inbox.pxd``)."""

from __future__ import annotations

from typing import Any, Protocol

from .errors import EpicycleError
from .tag import Tag, new_tag

NOTHING: list[Any] = []  # what a port shows that keeps its tokens to itself


class PortError(EpicycleError):
    """A port was read or written in a way that its declaration or the model does not allow."""


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

    __slots__ = ("cancelled", "due", "when")

    def __init__(self, when: When) -> None:
        self.when = when
        self.due = False
        self.cancelled = False

    @property
    def tag(self) -> Tag:
        """When it is due."""
        return self.when if type(self.when) is Tag else new_tag(self.when.time, self.when.microstep)

    def cancel(self) -> None:
        """Ask the director to forget it."""
        self.cancelled = True


def new_wake(when: When) -> Wake:
    """A wake-up, without a detour through its class."""
    wake = Wake.__new__(Wake)
    wake.when = when
    wake.due = wake.cancelled = False
    return wake


class Inbox:
    """The tokens that an input port holds at the present tag, and their channels."""

    __slots__ = ("arrived", "channels", "path", "shown", "width")

    def __init__(self, path: str = "") -> None:
        self.path = path
        self.width = 0
        self.clear()

    def clear(self) -> None:
        """Engine: forget what has come."""
        self.arrived: list[Any] = []
        self.channels: list[int] = []  # of these tokens, where there are several connections
        self.shown = self.arrived

    @property
    def present(self) -> bool:
        """Whether a token has arrived at the present tag."""
        return bool(self.shown)

    @property
    def value(self) -> Any:
        """The token of the present tag, the latest if there are several; raises ``PortError`` if there is none."""
        if not self.shown:
            raise PortError(f"{self.path} has no token at this tag; ask 'present' before 'value'")
        return self.shown[-1]

    @property
    def tokens(self) -> tuple[Any, ...]:
        """All tokens of the present tag in the order of their arrival."""
        return tuple(self.shown)

    def by_channel(self) -> list[list[Any]]:
        """The tokens of the present tag, a list for each channel."""
        if self.width == 1:
            return [list(self.shown)]
        result: list[list[Any]] = [[] for _ in range(self.width)]
        for token, channel in zip(self.shown, self.channels, strict=False):
            result[channel].append(token)
        return result

    def receive(self, token: Any, channel: int) -> None:
        """Engine: a token arrives."""
        self.arrived.append(token)
        if self.width > 1:
            self.channels.append(channel)

    def take(self) -> tuple[list[Any], list[int]]:
        """Engine: take the tokens out, as if they had not come yet."""
        taken = self.arrived[:], self.channels[:]
        self.clear()
        return taken

    def give(self, taken: tuple[list[Any], list[int]]) -> None:
        """Engine: show tokens that were taken out."""
        self.arrived, self.channels = taken[0][:], taken[1][:]
        self.shown = self.arrived
