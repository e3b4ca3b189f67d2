"""Problems of a model, reported so that they can be fixed: where, what, and what would be right."""

import re
import unicodedata
from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from enum import Enum
from itertools import accumulate
from typing import Final, Literal, NoReturn, TypeAlias, TypeVar

from epicycle.actors import EpicycleError, nearest, shortened, visible, visible_character

from .kinds import OTHER, SIZE, Kind

MAX_PROBLEMS = 100
MAX_SOURCE_WIDTH = 120
_CUT = "..."

T = TypeVar("T")
Near: TypeAlias = tuple[str, Iterable[str]]  # a wrong name, and the right ones
NONE: Final[Near] = ("", ())


class Poison(Enum):
    """What stands for something wrong that has been reported: what depends on it is wrong, too, and not reported.

    It is false, and ``Problems.add`` returns it.
    """

    POISON = "poison"

    def __bool__(self) -> Literal[False]:
        return False


POISON: Final = Poison.POISON


@dataclass(frozen=True, slots=True)
class Position:
    """A stretch of one line of a file; line and column count from 1, `source` is the whole line."""

    file: str
    line: int
    column: int
    length: int
    source: str

    def __str__(self) -> str:
        """``file:line:column``, for messages that refer to another place."""
        return f"{self.file}:{self.line}:{self.column}"


@dataclass(frozen=True, slots=True)
class Fix:
    """What a program may write to remove a problem: a text in place of what is there.

    With a ``key``, it is a value for that key, which is missing in the mapping of which the place is the name.
    """

    position: Position
    text: str
    key: str = ""


@dataclass(frozen=True, slots=True)
class Problem:
    """One problem, its place, and what may help."""

    message: str
    position: Position | None = None
    help: tuple[str, ...] = ()
    severity: str = "error"  # or "warning"
    raised: Position | None = None  # the line of a user's program that raised an exception
    kind: Kind = OTHER
    fix: Fix | None = None

    def __str__(self) -> str:
        head = f"{self.severity}: {visible(shortened(self.message))}"
        lines = [head]
        if (at := self.position) is not None:
            lines = [f"{visible(at.file)}:{at.line}:{at.column}: {head}"]
            lines += marked(at)
        if self.raised is not None:
            lines += told_raised(self.raised)
        lines += [f"   help: {visible(shortened(line))}" for line in self.help]
        return "\n".join(lines)


class ModelError(EpicycleError):
    """A model that cannot be used, with the problems found in it; `more` means that there are others."""

    def __init__(self, problems: Iterable[Problem], more: bool = False) -> None:
        self.problems = tuple(problems)
        self.more = more
        super().__init__(self.problems, more)  # args are what pickle and copy rebuild the error from

    def __str__(self) -> str:
        parts = [str(problem) for problem in self.problems]
        text = "\n\n".join(parts)
        if len(parts) > 1:
            files = dict.fromkeys(visible(p.position.file) for p in self.problems if p.position is not None)
            count = f"more than {len(parts)}" if self.more else f"{len(parts)}"
            text += f"\n{count} errors" + (f" in {', '.join(files)}" if files else "")
        return text


class Problems:
    """Collects problems, so that one run shows them all; identical ones count once, and collecting ends after 100.

    A problem in an array is reported for the first instance: ``about`` identifies it in all instances, although the
    message names one.  A fault of a composite class is reported for its first use: ``scope`` is the path of the
    instance that has it, and a problem at one place is reported for the first of them.

    ``kind`` is that of problems for which no other is given: what the present pass looks for.
    """

    def __init__(self, kind: Kind = OTHER) -> None:
        self.kind = kind
        self._kept: dict[object, Problem] = {}
        self._warnings: dict[object, Problem] = {}
        self._count = 0
        self._scopes: dict[Position, str] = {}
        self._cause: BaseException | None = None  # the first exception in a user's code

    def __len__(self) -> int:
        """How many there are, including those that follow from reported ones."""
        return self._count

    def __bool__(self) -> bool:
        """True for any collector, as `problems or Problems()` must not lose an empty one; ask len()."""
        return True

    @property
    def found(self) -> tuple[Problem, ...]:
        """The problems kept so far, in the order in which they were found."""
        return tuple(self._kept.values())

    @property
    def warnings(self) -> tuple[Problem, ...]:
        """What is odd but not wrong, so far."""
        return tuple(self._warnings.values())

    @contextmanager
    def looking_for(self, kind: Kind) -> Iterator[None]:
        """A pass that looks for a kind of problems."""
        outer, self.kind = self.kind, kind
        try:
            yield
        finally:
            self.kind = outer

    def warn(
        self,
        message: str,
        position: Position | None = None,
        *hints: str,
        kind: Kind,
        about: tuple[str, ...] = (),
    ) -> None:
        """Note something that may be intended but probably is not; it does not count as a problem."""
        if len(self._warnings) < MAX_PROBLEMS:
            warning = Problem(message, position, hints, "warning", kind=kind)
            self._warnings.setdefault((about, position) if about else warning, warning)

    def add(
        self,
        message: str,
        position: Position | None = None,
        *hints: str,
        scope: str = "",
        about: tuple[str, ...] = (),
        raised: Position | None = None,
        cause: BaseException | None = None,
        kind: Kind | None = None,
        near: Near = NONE,
        fix: Fix | None = None,
    ) -> Poison:
        """Note a problem; each hint becomes a line of help.  One too many raises all problems as a ModelError.

        ``cause`` is an exception in a user's code, and ``raised`` where it comes from.  ``near`` is a wrong name and
        the right ones: the nearest of them ends the message, and is a ``fix``.
        """
        name, candidates = near
        if name and (meant := nearest(name, candidates)) is not None:
            message += f", did you mean {meant!r}?"
            fix = fix or instead(position, name, meant)
        problem = Problem(message, position, hints, raised=raised, kind=kind or self.kind, fix=fix)
        key = (about, position) if about else problem
        if key in self._kept:
            return POISON
        self._count += 1
        if position is not None and self._scopes.setdefault(position, scope) != scope:
            return POISON
        if len(self._kept) == MAX_PROBLEMS:
            # Finding them all, and the nearest valid names, may take very long.
            raise self._error(more=True) from self._cause
        self._kept[key] = problem
        self._cause = self._cause or cause
        return POISON

    def raise_if_any(self) -> None:
        """Raise all problems as one ModelError, if there are any."""
        if self._kept:
            raise self._error() from self._cause

    def stop(self, message: str, position: Position | None, *hints: str, scope: str = "") -> NoReturn:
        """Note that a model is too large to continue, and raise all problems as one ModelError."""
        self.add(message, position, *hints, scope=scope, kind=SIZE)
        raise self._error() from self._cause

    def whole(self, made: T | Poison | None) -> T:
        """What has been made; raises all problems as one ModelError if there are any."""
        self.raise_if_any()
        assert made is not None, "what cannot be made is a problem"
        assert made is not POISON, "so is what is made of it"
        return made

    def _error(self, *, more: bool = False) -> ModelError:
        return ModelError(sorted(self.found, key=self._place), more)

    def _place(self, problem: Problem) -> tuple[int, int, int]:
        """Where a problem is shown: file by file as they were met, and from top to bottom."""
        if (at := problem.position) is None:
            return -1, 0, 0
        files = list(dict.fromkeys(each.position.file for each in self.found if each.position is not None))
        return files.index(at.file), at.line, at.column


def instead(at: Position | None, wrong: str, right: str) -> Fix | None:
    """One name in place of another that is at a place; None if it is not there, or there twice."""
    if at is None:
        return None
    start = at.column - 1
    found = [*re.finditer(rf"(?<!\w){re.escape(wrong)}(?!\w)", at.source[start : start + at.length])]
    if len(found) != 1:
        return None
    return Fix(replace(at, column=at.column + found[0].start(), length=len(wrong)), right)


def told_raised(at: Position) -> list[str]:
    """The lines of a message that say where an exception comes from."""
    return [f"   raised at {visible(at.file)}:{at.line}:{at.column}", *marked(at)]


def marked(at: Position) -> list[str]:
    """The line of a place and the carets below it; empty if the line is not available, as at a Python prompt."""
    if not at.length:
        return []
    source, carets = _excerpt(at)
    gutter = max(5, len(str(at.line)))
    return [f"{at.line:>{gutter}} | {source}".rstrip(), f"{'':>{gutter}} | {carets}"]


def _cell(character: str) -> tuple[str, int]:
    """Return how one character of a source line is shown, and its width in columns."""
    if character == "\t":
        return "    ", 4
    shown = visible_character(character)
    if len(shown) > 1 or shown.isascii():
        return shown, len(shown)
    if unicodedata.category(shown) in ("Mn", "Me"):
        return shown, 0
    return shown, 2 if unicodedata.east_asian_width(shown) in "WF" else 1


def _excerpt(at: Position) -> tuple[str, str]:
    """Return the source line, cut to a readable width around the place, and the carets below it."""
    start = min(max(at.column - 1, 0), len(at.source))
    # A file may be one line of megabytes: only what can be shown is looked at.
    first = max(0, start - MAX_SOURCE_WIDTH)
    cells = [_cell(character) for character in at.source[first : start + 2 * MAX_SOURCE_WIDTH]]
    start -= first
    columns = [*accumulate((width for _, width in cells), initial=0)]  # where each begins
    whole = first == 0 and len(cells) == len(at.source)
    low, high = 0, len(cells)
    if not whole or columns[-1] > MAX_SOURCE_WIDTH:
        room = MAX_SOURCE_WIDTH - 2 * len(_CUT)
        low = bisect_left(columns, columns[start] - room // 3)
        high = bisect_right(columns, columns[low] + room) - 1
        low = bisect_left(columns, columns[high] - room)  # near the end of the line, the left side takes what is left
    cut_left = _CUT if first or low else ""
    cut_right = _CUT if first + high < len(at.source) else ""
    source = cut_left + "".join(shown for shown, _ in cells[low:high]) + cut_right
    before = len(cut_left) + columns[start] - columns[low]
    end = min(start + max(at.length, 1), high)
    return source, " " * before + "^" * max(columns[end] - columns[start], 1)
