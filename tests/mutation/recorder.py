"""Which test runs which lines: a pytest plugin, and what it wrote down."""

from __future__ import annotations

import ast
import json
import signal
import time
from collections import Counter, defaultdict
from collections.abc import Iterator
from operator import itemgetter
from pathlib import Path
from typing import Any

import coverage
import pytest

from tests.mutation.mutants import GUARDED
from tests.mutation.trial import OPTIONS


def _ring(*_: object) -> None:
    pytest.fail("it takes too long")


REFERENCE, FEW = "tests/test_reference.py::", 40


class Recorder:
    """Watches the tests of one process; ``found`` is each passed test's time and lines by file."""

    def __init__(self, root: Path, limit: float, compiled: bool) -> None:
        self.root = root.resolve()
        self.limit = limit
        self.patience = 3.0 * limit + 60.0 * compiled  # a solve that is not compiled may take minutes
        self.found: dict[str, tuple[float, dict[str, list[int]]]] = {}
        self.failed: list[str] = []
        self._passed: set[str] = set()
        self._seconds: dict[str, float] = {}
        include = [str(self.root / folder / "*") for folder in GUARDED]
        self._coverage = coverage.Coverage(data_file=None, include=include, config_file=False)

    def pytest_sessionstart(self) -> None:
        self._coverage.start()

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        self._coverage.switch_context(item.nodeid)
        before = time.process_time()  # of the processor: others may be using it, too
        signal.signal(signal.SIGPROF, _ring)
        signal.setitimer(signal.ITIMER_PROF, self.patience)
        yield
        self._seconds[item.nodeid] = time.process_time() - before
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        self._coverage.switch_context("")

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed:
            self.failed.append(report.nodeid)
        elif report.when == "call" and report.passed:
            self._passed.add(report.nodeid)

    def pytest_sessionfinish(self) -> None:
        self._coverage.stop()
        data = self._coverage.get_data()
        lines: dict[str, dict[str, list[int]]] = defaultdict(dict)
        for path in data.measured_files():
            by_line = data.contexts_by_lineno(path)
            name = str(Path(path).resolve().relative_to(self.root))
            for line, contexts in by_line.items():
                for context in contexts:
                    if context:
                        lines[context].setdefault(name, []).append(line)
        for test in sorted(self._passed.difference(self.failed)):
            if self._seconds[test] <= self.limit:
                self.found[test] = (self._seconds[test], lines.get(test, {}))


class Map:
    """Which tests run a line, those first that run little else."""

    def __init__(self, tests: dict[str, tuple[float, dict[str, list[int]]]]) -> None:
        self.seconds = {test: seconds for test, (seconds, _) in tests.items()}
        self._breadth = {test: sum(map(len, lines.values())) for test, (_, lines) in tests.items()}
        self._tests: dict[tuple[str, int], list[str]] = defaultdict(list)
        self._files: dict[str, dict[str, int]] = defaultdict(dict)
        for test, (_, by_file) in tests.items():
            for file, lines in by_file.items():
                self._files[file][test] = len(lines)
                for line in lines:
                    self._tests[file, line].append(test)

    def tests(self, file: str, source: str, line: int) -> list[str]:
        """The tests of a line, then those of its function, its class, its file, and its folder.

        What keeps its results runs a line only when it is asked first, and what stands in a class runs at import: the
        reference tells of it, too, which is made in a process of its own.
        """
        levels: list[list[str]] = []
        for lines in self._neighbourhoods(source, line):
            ran = {test for each in lines for test in self._tests.get((file, each), ())}
            levels.append(sorted(ran, key=lambda test: self._key(test, file)))
            if not levels[0] and len(levels) == 1:
                levels.append([test for test in self.seconds if test.startswith(REFERENCE)])
        folder = file.rpartition("/")[0]
        near = {test for other, tests in self._files.items() if other.rpartition("/")[0] == folder for test in tests}
        levels.append(sorted(near, key=lambda test: (self.seconds[test], test)))
        # Those of each level that know most of this file; then all others, and some of each file between them.
        first = [test for level in levels for test in level[:FEW]]
        others = (test for level in levels for pair in zip(level, in_turn(level), strict=True) for test in pair)
        return list(dict.fromkeys([*first, *others]))

    def _key(self, test: str, file: str) -> tuple[bool, float, str]:
        return self.seconds[test] > 1.0, self._cost(test, file), test

    def _cost(self, test: str, file: str) -> float:
        """Small for what is quick and about this file."""
        share = self._files[file].get(test, 0) / max(1, self._breadth[test])
        return (0.02 + self.seconds[test]) / (0.02 + share)

    def _neighbourhoods(self, source: str, line: int) -> Iterator[list[int]]:
        tree = ast.parse(source)
        around = [
            node
            for node in ast.walk(tree)
            if isinstance(node, ast.stmt) and node.lineno <= line <= (node.end_lineno or node.lineno)
        ]
        statement = max(around, key=lambda node: (node.lineno, -(node.end_lineno or 0)), default=None)
        if statement is None:
            return
        body = getattr(statement, "body", None)
        last = body[0].lineno - 1 if body else statement.end_lineno or statement.lineno
        yield list(range(statement.lineno, max(last, statement.lineno) + 1))
        for node in reversed(around):
            if isinstance(node, ast.ClassDef | ast.FunctionDef):
                yield list(range(node.lineno, (node.end_lineno or node.lineno) + 1))
        yield list(range(1, source.count("\n") + 2))


def in_turn(tests: list[str]) -> list[str]:
    """The first one of each file, then the second of each: of what all tests run, only some files are about it."""
    counts = Counter[str]()
    places = []
    for test in tests:
        file = test.partition("::")[0]
        counts[file] += 1
        places.append((counts[file], test))
    return [test for _, test in sorted(places, key=itemgetter(0))]


def save(path: Path, found: dict[bool, dict[str, Any]]) -> None:
    """Keep what was recorded, with kernels compiled and not."""
    path.write_text(json.dumps({"compiled": found[True], "plain": found[False]}), encoding="utf-8")


def load(path: Path) -> dict[bool, dict[str, Any]]:
    """What was kept."""
    found = json.loads(path.read_text(encoding="utf-8"))
    return {True: found["compiled"], False: found["plain"]}


def run_and_record(root: Path, files: list[str], limit: float, compiled: bool) -> tuple[dict[str, Any], list[str]]:
    """Run tests in this process; what they run, and which failed."""
    watcher = Recorder(root, limit, compiled)
    pytest.main([*OPTIONS, *files], plugins=[watcher])
    return watcher.found, watcher.failed
