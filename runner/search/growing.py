"""A study that grows: it gets points as a search chooses them, and its results folder has their runs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from ..model.language.dimensions import Level
from ..model.language.study import Study, study_of_text
from ..study.judge.study_results import StudyResults
from ..study.plan.plan import Plan, Search
from ..study.run.backlog import Backlog, Task
from ..study.run.locking import lock
from ..study.run.making import Recorder, make_in, recording
from ..study.run.manifest import manifest_text
from ..study.run.processes import Processes
from ..study.run.runner import Runner
from ..study.run.store import BEST_FIRST, Row, prepare, write
from ..study.session import available_cores, manifest_of
from .proposals import Point
from .space import SearchSpec, Space, said

_GROWTH = 1.1  # of the number of points, after which the folder is told of them: each time, of all

Place = tuple[Any, ...]  # the values of a point, by which two points are the same


@dataclass(kw_only=True)
class _SearchTask(Task):
    """A run of a plan that the process which makes it may not know yet."""

    batch: int
    plan: Plan


class _Worker:
    """Makes the runs of one plan after the other."""

    _runner: Runner
    _batch = 0

    def prepare(self, task: _SearchTask) -> None:
        """Load the model of the run's condition, unless it is there."""
        if task.batch != self._batch:
            self._runner, self._batch = Runner(task.plan), task.batch
        self._runner.prepare(task)

    def make(self, task: _SearchTask) -> Row:
        """The row of a run, for which the model is there."""
        return self._runner.make(task)


class Growing:
    """The points of a space that were chosen, beside what a ``study`` varies of its own, and their runs.

    ``keys`` are what its file says.  Raises ``ModelError`` unless the model loads at the ends of the space.
    """

    def __init__(
        self,
        study: Study,
        keys: Mapping[str, Any],
        space: Space,
        *,
        runs: int,
        command: Sequence[str],
    ) -> None:
        tried = Plan.made(replace(study, dimensions=(*space.ends(), *study.dimensions)))
        extra = {name: digest for each in tried.extra for more in each.values() for name, digest in more.items()}
        self.study = study
        self._keys = keys
        self._space = space
        made_by = Search(runs=runs, command=list(command))
        self._base = replace(tried, study=study, sources=tried.sources | extra, search=made_by)
        self._levels: dict[Place, Level] = {}  # of all points, each once
        self._told = 0  # points that the folder knows
        self._batches = 0
        self._known: dict[str, Row] = {}  # the runs by their keys
        self._recorder: Recorder
        self._processes: Processes

    @contextmanager
    def opened(self, points: Sequence[Point], folder: Path, jobs: int | None, timeout: float | None) -> Iterator[None]:
        """Make runs in a folder, and first those of some points; raises ``StoreError``.

        Runs that are there already are not made again.  At the end, the table of all is written.
        """
        self._jobs = jobs or available_cores()
        self.levels(points)
        plan = self._whole()
        with lock(folder):
            store = prepare(folder, manifest_of(plan))
            rows: list[Row] = [row for batch in store.rows() for row in batch.to_pylist()]
            rows.sort(key=lambda row: BEST_FIRST.index(row["status"]), reverse=True)  # the best of a run last
            self._known = {row["run"]: row for row in rows}
            with recording(store, Backlog(plan, {}, ()), timeout) as recorder, Processes(_Worker) as processes:
                self._recorder, self._processes, recorder.tell = recorder, processes, self._keep
                try:
                    yield
                finally:
                    self._tell(over=True)
            StudyResults(folder).write_table()

    def _keep(self, row: Row) -> None:
        self._known[row["run"]] = row

    def levels(self, points: Iterable[Point]) -> list[Level]:
        """What some points set; the folder will know of them."""
        levels = [self._space.level(point) for point in points]
        self._levels |= {_place_of(level): level for level in levels}
        return levels

    def runs(
        self, levels: Sequence[Level], replications: Callable[[int], Iterable[int]], tell: Callable[[], None]
    ) -> list[list[Row]]:
        """The rows of each point in all conditions of the study, with the replications of each."""
        self._tell()
        self._batches += 1
        distinct = {_place_of(level): level for level in levels}
        plan, order = self._plan(list(distinct.values())), list(distinct)
        sent, others = replace(plan, texts={}), plan.conditions // len(order)
        keys, tasks = list[list[str]](), dict[str, Task]()
        for at, level in enumerate(levels):
            first = order.index(_place_of(level)) * others
            runs = [(index, each) for index in range(first, first + others) for each in replications(at)]
            keys.append([])
            for index, replication in runs:
                condition = plan.condition(index)
                keys[-1].append(key := plan.key(condition, replication))
                if key not in self._known:
                    seed = plan.seed(condition, replication)
                    tasks[key] = _SearchTask(index, replication, seed, key, batch=self._batches, plan=sent)
        self._recorder.backlog = Backlog(plan, {}, tasks.values())
        make_in(self._processes, self._recorder, self._jobs, tell)
        return [[self._known[key] for key in each] for each in keys]

    def _plan(self, levels: Sequence[Level]) -> Plan:
        """A plan of some points."""
        dimensions = (*self._space.dimensions(levels), *self.study.dimensions)
        return replace(self._base, study=replace(self.study, dimensions=dimensions), extra=[{} for _ in dimensions])

    def _whole(self) -> Plan:
        """What a folder is to know: all points until now."""
        levels = list(self._levels.values())
        plan = self._plan(levels)
        return replace(plan, study=replace(plan.study, text=_text_of(self._keys, levels)))

    def _tell(self, *, over: bool = False) -> None:
        """Tell the folder of the points, now and then while they grow, and when the search is over."""
        if over or len(self._levels) >= _GROWTH * self._told:
            self._told = len(self._levels)
            store = self._recorder.store
            write(store.folder / "manifest.json", manifest_text({**store.manifest, **self._whole().manifest()}))


def _place_of(level: Level) -> Place:
    return tuple(level.values.values())


def study_of(
    spec: SearchSpec, keys: Mapping[str, Any], path: Path, replications: int | None = None, seed: int | None = None
) -> Study:
    """The study that gets points: what its file says, and what the search changes in its model."""
    study = study_of_text(_text_of(keys, []), path, spec.set, map(Path, spec.types), replications, seed)
    return replace(study, aspects=spec.aspects, without_aspects=spec.without_aspects, stop=spec.stop)


def _text_of(keys: Mapping[str, Any], levels: Sequence[Level]) -> str:
    """The study of some points, as its file would say it."""
    vary = {**said(levels), **(keys.get("vary") or {})}
    text: str = yaml.safe_dump(
        {**keys, **({"vary": vary} if vary else {})}, sort_keys=False, allow_unicode=True, width=1_000
    )
    return text
