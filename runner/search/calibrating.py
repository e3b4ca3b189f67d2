"""Calibrate: parameters for which signals of a model are closest to measured ones, by least squares."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import chain
from pathlib import Path
from statistics import pstdev
from typing import TYPE_CHECKING, Any

from epicycle.actors import EpicycleError, read_table, to_nanoseconds, to_seconds

from ..execution.engine import Simulation
from ..model.build.model import Model
from ..model.language.dimensions import number_node
from ..model.language.settings import Setting
from ..model.text.files import COMMAND_LINE
from ..model.text.problems import ModelError, Position
from ..study.run.processes import Worker, check_same
from ..study.session import available_cores
from ..support.bars import Show, unseen
from ..support.student import student_quantile
from .cache import NUMBER, EvaluationCache
from .calibration import Calibration, Fitted, Matched
from .evaluator import Evaluator, files_of
from .proposals import SPREAD, Point, spread
from .space import Interval, SearchSpec, read_space
from .spec import Match, results_folder

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

LEVEL = 0.95
STARTS = 3  # of the points that are spread first, the best ones, from which least squares start
_STEP = 1e-4  # of a range: the step of derivatives
_ALIKE = 0.01  # of a range: within which two starts end at the same place
_LARGEST = 1e9  # s; no clock of a model goes further
_BLIND = 1e-7  # of the largest singular value: below it, the data do not tell a direction


def calibrate(
    spec: SearchSpec,
    goal: Match,
    out: Path | None = None,
    *,
    jobs: int | None = None,
    show: Show = unseen,
) -> Calibration:
    """Fit parameters to measured signals, from the best of points that are spread over the ranges.

    Each run is noted in the folder, so that a search that was killed continues there.  Raises ``EpicycleError``.
    """
    task = _Task(spec, goal)
    folder = out or results_folder(task.model.name, "calibration")
    cache = EvaluationCache(task.model, task.about(), [NUMBER], folder)
    with Evaluator(task, jobs or available_cores(), _Task, spec, goal, task.read) as evaluator:
        found = _fitted(_Runs(task, evaluator, cache, show))
    found.folder = folder
    return found


def _fitted(runs: _Runs) -> Calibration:
    import numpy as np
    from scipy.optimize import least_squares

    task = runs.task
    count = len(task.axes)
    if len(task.scales) <= count:
        raise EpicycleError(f"{len(task.scales)} measured values cannot tell {count} parameters: more are needed")

    def residuals(shares: NDArray[np.float64]) -> NDArray[np.float64]:
        gaps = (one - other for one, other in zip(task.measured, runs.modelled(_point(shares)), strict=True))
        return np.array([gap / scale for gap, scale in zip(gaps, task.scales, strict=True)])

    def tried(shares: NDArray[np.float64]) -> NDArray[np.float64]:
        ahead([[shares]])
        return residuals(shares)

    def jacobian(shares: NDArray[np.float64]) -> NDArray[np.float64]:
        """What changes from a little below to a little above, within the ranges."""
        ahead(pairs := _around(shares))
        return np.array([(residuals(above) - residuals(below)) / (above - below).max() for below, above in pairs]).T

    def ahead(places: Iterable[Iterable[NDArray[np.float64]]]) -> None:
        """Expect runs at some places, and then those that each further start begins with."""
        runs.expect(map(_point, chain.from_iterable(chain(places, *map(_around, starts)))))

    starts = list(map(np.array, (point for number in range(SPREAD) for point in spread(count, task.seed, number))))
    runs.expect(map(_point, starts))
    costs = [math.fsum(each * each for each in residuals(start).tolist()) for start in starts]
    starts = [starts[at] for at in sorted(range(len(starts)), key=costs.__getitem__)[:STARTS]]
    ends = []
    while starts:
        found = least_squares(
            tried,
            starts.pop(0),
            jac=jacobian,
            bounds=(0.0, 1.0),
            xtol=1e-10,
            ftol=1e-10,
            gtol=1e-12,
            max_nfev=100,
        )
        ends.append((float(found.cost), _point(found.x), found.jac))
    cost, best, slopes = min(ends, key=lambda each: each[0])
    agreeing = sum(max(abs(a - b) for a, b in zip(place, best, strict=True)) < _ALIKE for _, place, _ in ends)
    parameters, pairs = _parameters(task.axes, best, slopes, 2.0 * cost)
    modelled, matches, start = runs.modelled(best), [], 0
    for signal, times, measured in task.signals:
        matches.append(Matched(signal, times, measured, modelled[start : start + len(times)]))
        start += len(times)
    return Calibration(task.model.name, task.seed, parameters, matches, pairs, len(ends), agreeing)


def _parameters(
    axes: Sequence[Interval], best: Sequence[float], slopes: NDArray[np.float64], squares: float
) -> tuple[list[Fitted], list[tuple[str, str, float]]]:
    """Values with intervals from the slopes of the residuals, as if the model were linear in its parameters there."""
    import numpy as np

    freedom = len(slopes) - len(axes)
    _, sizes, directions = np.linalg.svd(slopes, full_matrices=False)
    told = sizes > _BLIND * max(float(sizes[0]), 1e-300)
    unseen = [row for row, is_told in zip(directions.tolist(), told, strict=True) if not is_told]
    blind = [any(abs(row[at]) > 0.1 for row in unseen) for at in range(len(axes))]
    inverse = directions[told].T / sizes[told]
    spread_of = inverse @ inverse.T * (squares / freedom)
    errors = [math.inf if blind[at] else math.sqrt(float(spread_of[at, at])) for at in range(len(axes))]
    fitted = []
    for axis, share, error in zip(axes, best, errors, strict=True):
        low, width = float(axis.low), float(axis.high) - float(axis.low)
        value, half = low + share * width, student_quantile((1.0 + LEVEL) / 2.0, freedom) * error * width
        at_end = min(share, 1.0 - share) < 1e-3
        fitted.append(Fitted(axis.path, axis.unit, value, error * width, value - half, value + half, at_end))
    pairs = []
    for at, one in enumerate(axes):
        for other in range(at):
            both = errors[at] * errors[other]
            if 0.0 < both < math.inf and abs(likeness := float(spread_of[at, other]) / both) > LEVEL:
                pairs.append((axes[other].path, one.path, likeness))
    return fitted, pairs


def _point(shares: NDArray[np.float64]) -> Point:
    return tuple(map(float, shares))


def _around(shares: NDArray[np.float64]) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """The places by which the derivatives at some shares are found: for each, a step below and above."""
    import numpy as np

    steps = _STEP * np.eye(len(shares))
    return [(np.maximum(shares - step, 0.0), np.minimum(shares + step, 1.0)) for step in steps]


class _Task(Worker):
    """What is fitted to what, read once; makes runs with given parameters."""

    def __init__(self, spec: SearchSpec, goal: Match, read: Mapping[str, str] | None = None) -> None:
        """``read`` are the files that were read before for the model."""
        self.spec, self.linear = spec, goal.between == "linear"
        self.model = spec.load()
        self.read = files_of(self.model) if read is None else read
        space = read_space(spec, self.model)
        self.axes = [axis for axis in space.axes if isinstance(axis, Interval) and axis.kind == "float"]
        if wrong := [axis.path for axis in space.axes if axis not in self.axes]:
            raise EpicycleError(f"{wrong[0]!r} has no range of real numbers, which least squares need")
        if not self.axes:
            raise EpicycleError("there is nothing to vary\n   help: add --vary load=0.5..0.9")
        self.signals = [_measured(text) for text in goal.files]
        if not self.signals:
            raise EpicycleError("there is nothing to match\n   help: add --match server.size=measured.csv")
        self.measured = [value for _, _, values in self.signals for value in values]
        # By which residuals of signals in different units are made alike.
        scales = [pstdev(values) or 1.0 for _, _, values in self.signals]
        self.scales = [scale for scale, (_, times, _) in zip(scales, self.signals, strict=True) for _ in times]
        self.seed = self.model.output.seed if spec.seed is None else spec.seed
        self.files = goal.files

    def about(self) -> dict[str, Any]:
        """What outcomes depend on besides the model."""
        said = {"model": self.model.name, "seed": self.seed, "match": self.files, "linear": self.linear}
        return said | {
            "digest": self.results(self.model).digest,
            "times": [times for _, times, _ in self.signals],
        }

    def results(self, model: Model) -> Any:
        """What comes of a run, with the signals that are matched."""
        for signal, _, _ in self.signals:
            try:
                model.record(signal)
            except ModelError as error:
                option = f"--match {signal}"
                at = Position(COMMAND_LINE, 1, 9, len(signal), option)
                raise ModelError(replace(problem, position=at) for problem in error.problems) from None
        return Simulation(model, seed=self.seed).run()

    def settings(self, point: Point) -> list[Setting]:
        """What sets the parameters to the shares of their ranges."""
        return [
            Setting(axis.path, number_node(_number(axis, share), axis.unit, axis.position), axis.position)
            for axis, share in zip(self.axes, point, strict=True)
        ]

    def key(self, point: Point) -> str:
        """The same in words."""
        return ", ".join(f"{each.path}={getattr(each.node, 'text', '')}" for each in self.settings(point))

    def make(self, point: Point) -> list[float]:
        """What the model sends at the times of all measured values."""
        key = self.key(point)
        try:
            model = self.spec.load(self.settings(point))
            results = self.results(model)
        except EpicycleError as error:
            raise EpicycleError(f"{key}: {error}") from error
        check_same(self.read, files_of(model))
        return [
            value
            for signal, times, _ in self.signals
            for value in _sampled(results.signals[signal], signal, times, results.end, self.linear, key)
        ]


class _Runs:
    """Runs with different parameters, each made once."""

    def __init__(self, task: _Task, evaluator: Evaluator, cache: EvaluationCache, show: Show) -> None:
        self.task = task
        self._evaluator, self._cache, self._show = evaluator, cache, show
        self._number = 0

    def expect(self, points: Iterable[Point]) -> None:
        """Say which runs will be asked for next."""
        keys = ((self.task.key(point), point) for point in points)
        self._evaluator.expect(each for each in keys if each[0] not in self._cache)

    def modelled(self, point: Point) -> list[float]:
        """What the model sends at the times of all measured values."""
        key = self.task.key(point)

        def found() -> Any:
            self._number += 1
            self._show(self._number, None, f"{self._number:,} runs")
            return self._evaluator.make(key, point)

        values: list[float] = self._cache.outcome(key, found)
        return values


def _number(axis: Interval, share: float) -> float:
    low, high = float(axis.low), float(axis.high)
    return min(max(low + share * (high - low), low), high)


def _measured(text: str) -> tuple[str, list[int], list[float]]:
    """The signal that ``signal=file`` names, with the times (ns) and values of its file."""
    signal, equals, name = (each.strip() for each in text.partition("="))
    if not equals or not signal or not name:
        raise EpicycleError(f"--match {text}: write signal=file.csv")
    if "*" in signal:
        raise EpicycleError(f"--match {text}: give one output port, not a pattern")
    path = Path(name)
    if path.suffix.lower() not in (".csv", ".parquet"):
        raise EpicycleError(f"--match {text}: {path.name!r} must end in .csv or .parquet")
    try:
        table = read_table(path)
    except OSError as error:
        raise EpicycleError(f"{path} cannot be read: {error.strerror}") from None
    columns = table.column_names
    values = [each for each in (signal, "value") if each in columns] or [each for each in columns if each != "time"]
    is_clear = len(values) == 1 or values[:1] in ([signal], ["value"])
    if "time" not in columns or len(set(columns)) < len(columns) or not is_clear:
        raise EpicycleError(
            f"{path} has the columns {', '.join(columns)}\n   help: it needs 'time' and 'value', or {signal!r}"
        )
    rows = []
    for row, pair in enumerate(zip(table["time"].to_pylist(), table[values[0]].to_pylist(), strict=True), start=1):
        time, value = (_cell(path, row, *each) for each in zip(("time", values[0]), pair, strict=True))
        if not 0.0 <= time <= _LARGEST:
            raise EpicycleError(f"{path}: row {row}: time is {time:g}, expected 0 to {_LARGEST:g} s")
        rows.append((to_nanoseconds(time), value))
    if not rows:
        raise EpicycleError(f"{path} has no rows")
    rows.sort(key=lambda each: each[0])
    return signal, [time for time, _ in rows], [value for _, value in rows]


def _cell(path: Path, row: int, column: str, cell: Any) -> float:
    """The number in a cell; a column in which one cell is none has texts."""
    with suppress(TypeError, ValueError):
        if not isinstance(cell, bool) and math.isfinite(number := float(cell)):
            return number
    shown = "empty" if cell is None or cell == "" else repr(cell)
    raise EpicycleError(f"{path}: row {row}: {column} is {shown}, expected a number")


def _sampled(signal: Any, name: str, times: Sequence[int], end: float, linear: bool, key: str) -> list[float]:
    """The values of a signal at some times: each token lasts until the next one, or changes linearly to it."""
    sent, tokens = list(signal.samples.times), signal.tokens
    if any(isinstance(each, bool) or not isinstance(each, (int, float)) for each in tokens):
        raise EpicycleError(f"{name} does not send numbers, which measured values can be compared with")
    first = to_seconds(sent[0]) if sent else math.inf
    if not sent or times[0] < sent[0]:
        missing = f"{name} has no value at {to_seconds(times[0])} s yet; its first is at {first} s"
        raise EpicycleError(f"{key}: {missing}")
    if times[-1] > to_nanoseconds(end):
        last = to_seconds(times[-1])
        raise EpicycleError(f"{key}: the run ends at {end} s, before the last measured value at {last} s")
    found = []
    for time in times:
        at = bisect_right(sent, time) - 1
        value = float(tokens[at])
        if linear and sent[at] < time and at + 1 < len(sent):
            share = (time - sent[at]) / (sent[at + 1] - sent[at])
            value += share * (float(tokens[at + 1]) - value)
        found.append(value)
    if not all(map(math.isfinite, found)):
        raise EpicycleError(f"{key}: {name} is not finite at all times")
    return found
