"""Where tokens end: Recorder, Display, Histogram, Test, Stop."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from .core import (
    ABSENT,
    Actor,
    EpicycleError,
    InputPort,
    OutputPort,
    Parameter,
    ParameterError,
    Tag,
    array_parameter,
    counted,
    rounds,
    visible_lines,
)

_DISPLAY = logging.getLogger("epicycle.display")


class Recorder(Actor):
    """Keeps what comes, for Python to read after the run: ``simulation["path"].tokens``.

    In a model file ``run: {record: [port]}`` does the same without an actor.  Ptolemy: ``Recorder``.
    """

    input = InputPort(multi=True, doc="what is kept")

    capacity: Parameter[int | None] = Parameter(
        int, None, min=0, doc="how many of the latest tokens are kept; all if left out"
    )

    def initialize(self) -> None:
        self.tags: list[Tag] = []
        self.tokens: list[Any] = []
        self.seen = 0

    def fire(self) -> None:
        tokens = self.input.tokens
        self.seen += len(tokens)
        self.tokens.extend(tokens)
        self.tags.extend([self.tag] * len(tokens))
        if self.capacity is not None and len(self.tokens) > self.capacity:
            surplus = len(self.tokens) - self.capacity
            del self.tokens[:surplus], self.tags[:surplus]

    @property
    def times(self) -> NDArray[np.float64]:
        """The times of the tokens in s."""
        return np.array([tag.seconds for tag in self.tags], dtype=float)

    def array(self) -> NDArray[Any]:
        """The tokens as an array, one row each."""
        return np.asarray(self.tokens)


class Display(Actor):
    """Writes a line for each token: time, own path, and the token.

    Lines go to the logger ``epicycle.display``: on the command line they appear on standard error, so that ``--json``
    stays readable for programs.  Where nobody listens to the logger, as in a plain Python session, they are printed.
    Ptolemy: ``Display``, ``Discard`` with a face.
    """

    input = InputPort(multi=True, doc="what is shown")

    title = Parameter(str, "", doc="what stands in the line in place of the path")

    def fire(self) -> None:
        for token in self.input.tokens:
            line = visible_lines(f"{self.now:.9g} s  {self.title or self.path}: {token}")
            if _DISPLAY.hasHandlers():
                _DISPLAY.info("%s", line)
            else:
                print(line)


class Histogram(Actor):
    """Counts how many tokens fall into each of ``bins`` equal intervals from ``low`` to ``high``.

    A bin holds its lower bound and not its upper one; the last holds both.  What lies outside is counted apart.
    Python reads ``counts``, ``edges``, ``below`` and ``above`` after the run.  Ptolemy: ``HistogramPlotter``.
    """

    input = InputPort(float, multi=True, doc="what is counted")
    trigger = InputPort(required=False, doc="asks for the counts")
    output: OutputPort[Any] = OutputPort(list[int], doc="the counts of the bins so far, for each trigger")

    low = Parameter(float, doc="where the first bin begins")
    high = Parameter(float, doc="where the last bin ends")
    bins = Parameter(int, 20, min=1, max=1_000_000, doc="how many bins there are")

    def check(self) -> None:
        if not -math.inf < self.low < self.high < math.inf:
            raise ParameterError(f"low is {self.low:g} and high is {self.high:g}: low must be below high")
        self.edges: NDArray[np.float64] = np.linspace(self.low, self.high, self.bins + 1)

    def initialize(self) -> None:
        self.counts: NDArray[np.int64] = np.zeros(self.bins, dtype=np.int64)
        self.below = self.above = 0

    def fire(self) -> None:
        for token in self.input.tokens:
            if math.isnan(token):
                raise EpicycleError("nan belongs into no bin")
            if token < self.low:
                self.below += 1
            elif token > self.high:
                self.above += 1
            else:
                # The edges decide, not a division, whose rounding could put an edge into the wrong bin.
                place = int(np.searchsorted(self.edges, token, side="right")) - 1
                self.counts[min(place, self.bins - 1)] += 1
        if self.trigger.present:
            self.output.send(self.counts.tolist())


class Test(Actor):
    """Compares what comes with what is expected, in order, and ends the run with an error where they differ.

    Numbers may differ by ``tolerance``, also within lists and fields; everything else must be equal, but for ``null``,
    which stands for anything.  Values that are missing at the end of the run are an error, too, and so is a token too
    many, unless more may ``follow``.  With ``together``, each value is a list of what comes together, a token on each
    channel.  Ptolemy: ``Test``, ``NonStrictTest``.
    """

    __test__: ClassVar[bool] = False  # for pytest, which would take it for a class of tests

    input = InputPort(multi=True, doc="what is compared")
    output = OutputPort(bool, doc="with each token, if somebody listens, whether all values have come by now")

    values: Parameter[Any] = Parameter(object, shape=(None,), doc="what is expected, in order")
    times: Parameter[Any] = array_parameter(
        (None,), None, unit="s", doc="when it is expected, a time for each value; not compared if left out"
    )
    tolerance = Parameter(float, 1e-9, min=0, doc="by how much a number, or a time in s, may differ")
    complete = Parameter(bool, True, doc="whether all values must have come when the run ends")
    together = Parameter(bool, False, doc="whether a value is a list, of a token on each channel")
    follow = Parameter(bool, False, ptolemy=True, doc="whether other tokens may come after those that are expected")
    lenient = Parameter(
        bool, False, ptolemy=True, doc="whether a number is as good as its text, and NaN as good as any number"
    )

    def check(self) -> None:
        if self.times is not None and len(self.times) != len(self.values):
            raise ParameterError(f"{counted(len(self.times), 'time')} for {counted(len(self.values), 'value')}")
        if self.together:
            for index, value in enumerate(self.values):
                if not isinstance(value, (list, tuple)):
                    raise ParameterError(f"values: value {index} is {value!r}, no list of a token on each channel")

    def initialize(self) -> None:
        self._seen = 0

    def fire(self) -> None:
        if not self.together:
            for token in self.input.tokens:
                self._compare(token)
            return
        for (tokens,) in rounds(self.input):
            if ABSENT in tokens and self._seen < len(self.values):
                raise EpicycleError(f"for value {self._seen} no token came on channel {tokens.index(ABSENT)}")
            self._compare(tokens)

    def _compare(self, token: Any) -> None:
        self._judge(token)
        if self.output.width:
            self.output.send(self._seen >= len(self.values))

    def _judge(self, token: Any) -> None:
        index = self._seen
        if index >= len(self.values) and self.follow:
            return
        self._seen += 1
        if index >= len(self.values):
            raise EpicycleError(f"token {index} is {token!r}, but only {len(self.values)} are expected")
        expected = self.values[index]
        if not _alike(token, expected, self.tolerance, self.lenient):
            raise EpicycleError(f"token {index} is {token!r}, expected {expected!r}{self._within()}")
        if self.times is not None and abs(self.now - self.times[index]) > self.tolerance:
            raise EpicycleError(
                f"token {index} came at {self.now:.9g} s, expected at {self.times[index]:.9g} s{self._within()}"
            )

    def _within(self) -> str:
        return f" within {self.tolerance:g}" if self.tolerance else ""

    def wrapup(self) -> None:
        if self.complete and self._seen < len(self.values):
            raise EpicycleError(
                f"{self._seen} of {counted(len(self.values), 'expected token')} came, the next was to be "
                f"{self.values[self._seen]!r}"
            )


def _alike(token: Any, expected: Any, tolerance: float, lenient: bool) -> bool:
    """Whether a token is what is expected; lists, arrays and fields are compared item by item."""
    if expected is None:
        return True
    if isinstance(token, (np.ndarray, np.generic)):
        token = token.tolist()
    if isinstance(expected, (list, tuple)):
        is_list = isinstance(token, (list, tuple)) and len(token) == len(expected)
        return is_list and all(
            _alike(one, other, tolerance, lenient) for one, other in zip(token, expected, strict=True)
        )
    if isinstance(expected, Mapping) and isinstance(token, Mapping):
        return token.keys() == expected.keys() and all(
            _alike(token[name], expected[name], tolerance, lenient) for name in expected
        )
    if lenient and isinstance(expected, str) is not isinstance(token, str):
        return _is_text_of(expected, token) if isinstance(expected, str) else _is_text_of(token, expected)
    if isinstance(expected, bool) or isinstance(token, bool):
        return token is expected
    if isinstance(expected, (int, float)) and isinstance(token, (int, float)):
        if token == expected:
            return True
        try:
            if math.isnan(token) or math.isnan(expected):
                return lenient
            return token - tolerance <= expected <= token + tolerance
        except OverflowError:  # whole numbers may be longer than any other
            return False
    return bool(token == expected)


def _is_text_of(text: str, value: Any) -> bool:
    """Whether a text is a truth value or a number as Java writes it."""
    if isinstance(value, bool):
        return text == ("true" if value else "false")
    if isinstance(value, int):
        return text == str(value)
    try:
        return isinstance(value, float) and not text.lstrip("-").isdigit() and float(text) == value
    except ValueError:
        return False


class Stop(Actor):
    """Ends the run with the tag at which a true token comes; what belongs to that tag is still done.

    In a model file ``run: {stop_when: port}`` does the same without an actor.  Ptolemy: ``Stop``.
    """

    input: InputPort[Any] = InputPort(float | bool, multi=True, doc="ends the run when it is true, or not 0")

    def fire(self) -> None:
        if any(self.input.tokens):
            self.context.stop(f"actor {self.path}")
