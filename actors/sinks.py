"""Sinks of tokens: Recorder, Display, Histogram, Test, Stop."""

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
    any_parameter,
    array_parameter,
    counted,
    rounds,
    visible_lines,
)

_DISPLAY = logging.getLogger("epicycle.display")


class Recorder(Actor):
    """Keeps tokens, for Python to read after the run: ``simulation["path"].tokens``.

    In a model file ``run: {record: [port]}`` does the same without an actor.  Ptolemy: ``Recorder``.
    """

    input = InputPort(multi=True, doc="tokens to keep")

    capacity = Parameter(int, None, min=0, doc="number of latest tokens to keep; all if left out")

    def initialize(self) -> None:
        self.tags: list[Tag] = []
        self.tokens: list[Any] = []
        self.seen = 0

    def fire(self) -> None:
        tokens = self.input.tokens
        self.seen += len(tokens)
        if self.capacity == 0:
            return  # it only counts
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
    """Writes a line for each token: the time, the path of the actor, and the token.

    Lines go to the logger ``epicycle.display``: on the command line they appear on standard error, so that programs can
    read the output of ``--json``.  If the logger has no handler, as in a plain Python session, they are printed.
    Ptolemy: ``Display``.
    """

    input = InputPort(multi=True, doc="tokens to show")

    title = Parameter(str, "", doc="text in the line instead of the path")

    def fire(self) -> None:
        for token in self.input.tokens:
            line = visible_lines(f"{self.now:.9g} s  {self.title or self.path}: {token}")
            if _DISPLAY.hasHandlers():
                _DISPLAY.info("%s", line)
            else:
                print(line)


class Histogram(Actor):
    """Counts how many tokens fall into each of ``bins`` equal intervals from ``low`` to ``high``.

    A bin includes its lower bound and not its upper one; the last bin includes both.  Numbers outside are counted
    separately.  Python reads ``counts``, ``edges``, ``below`` and ``above`` after the run.  Ptolemy:
    ``HistogramPlotter``.
    """

    input = InputPort(float, multi=True, doc="numbers to count")
    trigger = InputPort(required=False, doc="requests the counts")
    output: OutputPort[Any] = OutputPort(list[int], doc="counts of the bins so far, for each trigger")

    low = Parameter(float, doc="lower bound of the first bin")
    high = Parameter(float, doc="upper bound of the last bin")
    bins = Parameter(int, 20, min=1, max=1_000_000, doc="number of bins")

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
                raise EpicycleError("nan belongs to no bin")
            if token < self.low:
                self.below += 1
            elif token > self.high:
                self.above += 1
            else:
                # Compared with the edges: a division could put an edge into the wrong bin by rounding.
                place = int(np.searchsorted(self.edges, token, side="right")) - 1
                self.counts[min(place, self.bins - 1)] += 1
        if self.trigger.present:
            self.output.send(self.counts.tolist())


class Test(Actor):
    """Compares tokens with expected values, in order, and ends the run with an error if they differ.

    Numbers may differ by ``tolerance``, also within lists and fields; everything else must be equal, except ``null``,
    which matches anything.  Missing values at the end of the run are also an error, and so is a surplus token, unless
    more may ``follow``.  With ``together``, each value is a list of tokens that come together, one on each channel.
    Ptolemy: ``Test``, ``NonStrictTest``.
    """

    __test__: ClassVar[bool] = False  # for pytest, which would treat it as a class of tests

    input = InputPort(multi=True, doc="tokens to compare")
    output = OutputPort(bool, doc="whether all values have come, sent with each token if connected")

    values = any_parameter(shape=(None,), doc="expected values, in order")
    times = array_parameter((None,), None, unit="s", doc="expected time of each value; not compared if left out")
    tolerance = Parameter(float, 1e-9, min=0, doc="largest difference of a number, or of a time in s")
    complete = Parameter(bool, True, doc="whether all values must have come by the end of the run")
    together = Parameter(bool, False, doc="whether a value is a list with a token for each channel")
    follow = Parameter(bool, False, doc="whether further tokens may follow the expected ones")

    def check(self) -> None:
        if self.times is not None and len(self.times) != len(self.values):
            raise ParameterError(
                f"times: {counted(len(self.times), 'time')} for {counted(len(self.values), 'value')}; give one for each"
            )
        if self.together:
            for index, value in enumerate(self.values):
                if not isinstance(value, (list, tuple)):
                    raise ParameterError(
                        f"values: value {index} is {value!r}, expected a list with a token for each channel"
                    )

    def initialize(self) -> None:
        self._seen = 0

    def fire(self) -> None:
        if not self.together:
            for token in self.input.tokens:
                self._compare(token)
            return
        for (tokens,) in rounds(self.input):
            if ABSENT in tokens and self._seen < len(self.values):
                raise EpicycleError(f"no token came for value {self._seen} on channel {tokens.index(ABSENT)}")
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
            raise EpicycleError(f"token {index} is {token!r}, expected only {counted(len(self.values), 'token')}")
        expected = self.values[index]
        if not self.matches(token, expected):
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
                f"{self._seen} of {counted(len(self.values), 'expected token')} came; the next should have been "
                f"{self.values[self._seen]!r}"
            )

    def matches(self, token: Any, expected: Any) -> bool:
        """Whether a token is as expected; lists, arrays and fields are compared item by item."""
        if expected is None:
            return True
        if isinstance(token, (np.ndarray, np.generic)):
            token = token.tolist()
        if isinstance(expected, (list, tuple)):
            is_list = isinstance(token, (list, tuple)) and len(token) == len(expected)
            return is_list and all(map(self.matches, token, expected))
        if isinstance(expected, Mapping) and isinstance(token, Mapping):
            return token.keys() == expected.keys() and all(
                self.matches(token[name], expected[name]) for name in expected
            )
        return self.equals(token, expected)

    def equals(self, token: Any, expected: Any) -> bool:
        """Whether a number, text or truth value is as expected."""
        if isinstance(expected, bool) or isinstance(token, bool):
            return token is expected
        if isinstance(expected, (int, float)) and isinstance(token, (int, float)):
            if token == expected:
                return True
            try:
                return token - self.tolerance <= expected <= token + self.tolerance
            except OverflowError:  # whole numbers may be too large for a float
                return False
        return bool(token == expected)


class Stop(Actor):
    """Ends the run with the tag at which a true token comes; that tag is completed.

    In a model file ``run: {stop_when: port}`` does the same without an actor.  Ptolemy: ``Stop``.
    """

    input: InputPort[Any] = InputPort(float | bool, multi=True, doc="ends the run when it is true, or not 0")

    def fire(self) -> None:
        if any(self.input.tokens):
            self.context.stop(f"actor {self.path}")
