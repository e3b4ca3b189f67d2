"""How many changes of our sources the quick tests notice: ``python -m tests.mutation [--count 200] [--seed 0]``.

cosmic-ray makes the mutants: it turns + into -, < into <=, 2 into 1, leaves out a decorator, a loop or a ``not``.  Each
lives in a copy of the project, never in the working tree; the tests that run its line are run, those first that run
little else, until one fails.  Kernels are mutated with numba switched off: to compile one anew takes half a minute.

``survivors.yaml`` holds those of earlier runs that were looked at, each with the reason why no test notices it.  Those
of them that are equivalent to what was there cannot be killed: the score without them is told beside the plain one.
The session lies in ``.mutants/session.sqlite``, as cosmic-ray's own tools read it (``cr-report``, ``cr-html``).
"""

from __future__ import annotations

import argparse
import math
import multiprocessing
import os
import shutil
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import yaml
from cosmic_ray.work_db import WorkDB, use_db
from cosmic_ray.work_item import MutationSpec, TestOutcome, WorkerOutcome, WorkItem, WorkResult

from tests.mutation import mutants as mutants_module
from tests.mutation import recorder, trial
from tests.mutation.mutants import KERNELS, Mutant

ROOT = Path(__file__).parents[2]
CACHE = ROOT / ".mutants"
# What has to do with compiling is tried with numba, and everything is compiled anew.
COMPILERS = {
    "actors/core/elementary/in_numba.py",
    *(f"actors/robotics/numerics/{name}.py" for name in ("compiled", "entry", "jit", "kept", "warm_up")),
}
COMPILING = 120.0  # s, at most
# Those that run the guarded folders in this process.
TESTS = (
    "tests/actors", "tests/api", "tests/aspects", "tests/bad_models", "tests/bridges/test_attached.py",
    "tests/bridges/test_processes.py", "tests/catalogue", "tests/commands/test_output.py",
    "tests/conformance", "tests/engine", "tests/language", "tests/model", "tests/modes", "tests/results",
    "tests/temporal", "tests/text", "tests/test_models.py", "tests/test_reference.py",
)  # fmt: skip
TESTS_OF_KERNELS = ("tests/actors",)
LONGEST = {True: 6.0, False: 4.0}  # s; a test that takes longer, compiled or not, is not asked
# So many tests, of so many seconds together; each the next ones.
STAGES = ((25, 1.5), (100, 3.0), (300, 5.0), (600, 15.0))


class Result(NamedTuple):
    """What became of a mutant; ``by`` names the test that noticed it."""

    mutant: Mutant
    killed: bool
    by: str
    tests: int
    seconds: float
    before: str
    after: str


# --- which tests run what ------------------------------------------------------------------------------


def chunks(tree: Path, places: Iterable[str], number: int) -> list[list[str]]:
    """The test files of places, in so many heaps of about the same size."""
    files = sorted(
        {
            path
            for place in places
            for path in ([tree / place] if place.endswith(".py") else (tree / place).rglob("test_*.py"))
        },
        key=lambda path: -path.stat().st_size,
    )
    heaps = [[str(path.relative_to(tree)) for path in files[first::number]] for first in range(number)]
    return [heap for heap in heaps if heap]


def record(task: tuple[Path, list[str], bool]) -> dict[str, Any]:
    """Which lines the tests of a heap of files run."""
    tree, files, compiled = task
    found, _, _ = trial.in_child(
        tree, compiled, 1500.0, lambda: recorder.run_and_record(tree, files, LONGEST[compiled], compiled)
    )
    if found is None:
        print(f"the tests of {' '.join(files)} have ended before their time", file=sys.stderr)
        return {}
    for test in found[1]:
        print(f"  not asked, as it fails by itself: {test}", file=sys.stderr)
    return dict(found[0])


def maps(trees: Sequence[Path], jobs: int) -> dict[bool, dict[str, Any]]:
    """The tests' times and lines, with kernels compiled and not."""
    tasks = [
        (trees[number % jobs], files, compiled)
        for compiled, places in ((True, TESTS), (False, TESTS_OF_KERNELS))
        for number, files in enumerate(chunks(trees[0], places, 8 * jobs))
    ]
    found: dict[bool, dict[str, Any]] = {True: {}, False: {}}
    with multiprocessing.get_context("fork").Pool(jobs) as pool:
        for number, ((_, _, compiled), each) in enumerate(zip(tasks, pool.imap(record, tasks), strict=True), 1):
            found[compiled] |= each
            print(f"{number} of {len(tasks)} heaps of tests have been run", flush=True)
    return found


def warm_up(tree: Path) -> None:
    """Compile what is compiled once: the kernels, all modules and all tests."""

    def work() -> bool:
        import pytest

        pytest.main([*trial.OPTIONS, "--collect-only", *TESTS])
        from epicycle.actors.robotics.numerics.warm_up import compile_now

        compile_now()
        return True

    if trial.in_child(tree, True, 300.0, work)[0] is None:
        raise SystemExit("the kernels cannot be compiled")


# --- one mutant ----------------------------------------------------------------------------------------


def is_compiled(mutant: Mutant) -> bool:
    """Whether a mutant is tried with kernels compiled."""
    return not mutant.file.startswith(KERNELS) or mutant.file in COMPILERS


def stages(tests: Sequence[str], seconds: dict[str, float]) -> Iterator[tuple[list[str], float]]:
    """The tests in heaps, with the time of each heap."""
    at = 0
    for count, limit in STAGES:
        heap, total = [], 0.0
        while at < len(tests) and len(heap) < count and total < limit:
            heap.append(tests[at])
            total += seconds[tests[at]]
            at += 1
        if heap:
            yield heap, total


def attempt(mutant: Mutant, tree: Path, by_kind: dict[bool, recorder.Map], but: frozenset[str] = frozenset()) -> Result:
    """Put a mutant into a tree, ask the tests, and take it out again."""
    path = tree / mutant.file
    original = path.read_text(encoding="utf-8")
    stat = path.stat()
    compiled = is_compiled(mutant)
    anew = mutant.file in COMPILERS
    patience = 8.0 + COMPILING * anew
    known = by_kind[compiled]
    tests = [test for test in known.tests(mutant.file, original, mutant.line) if test not in but]
    before, after = mutant.lines(original)
    asked, spent, verdict = 0, 0.0, trial.Verdict(True, "", 0.0)
    path.write_text(mutant.text, encoding="utf-8")
    try:
        for heap, total in stages(tests, known.seconds):
            asked += len(heap)
            verdict = trial.run_tests(tree, heap, compiled, 3.0 * total + patience, anew)
            spent += verdict.seconds
            if not verdict.passed:
                break
    finally:
        path.write_text(original, encoding="utf-8")
        os.utime(path, ns=(stat.st_atime_ns, stat.st_mtime_ns))
    return Result(mutant, not verdict.passed, verdict.failed, asked, spent, before, after)


def worker(tree: Path, tasks: Any, results: Any, by_kind: dict[bool, recorder.Map]) -> None:
    """Try mutants until there are no more."""
    while (task := tasks.get()) is not None:
        results.put(attempt(task[0], tree, by_kind, task[1]))


def attempt_all(
    tasks: Sequence[tuple[Mutant, frozenset[str]]], trees: Sequence[Path], by_kind: dict[bool, recorder.Map]
) -> Iterator[Result]:
    """Try mutants, one in each tree at a time."""
    context = multiprocessing.get_context("fork")
    waiting, results = context.Queue(), context.Queue()
    for task in (*tasks, *(None for _ in trees)):
        waiting.put(task)
    workers = [context.Process(target=worker, args=(tree, waiting, results, by_kind)) for tree in trees]
    for each in workers:
        each.start()
    for _ in tasks:
        yield results.get()
    for each in workers:
        each.join()


def unreliable(results: Iterable[Result], tree: Path) -> set[tuple[bool, str]]:
    """Tests that have noticed a mutant and fail without one, too."""
    killers: dict[tuple[bool, str], list[str]] = defaultdict(list)
    for result in results:
        if "::" in result.by:
            compiled = is_compiled(result.mutant)
            killers[compiled, result.by.partition("::")[0]].append(result.by)
    found = set()
    for (compiled, _), tests in killers.items():
        left = list(dict.fromkeys(tests))
        while left:
            verdict = trial.run_tests(tree, left, compiled, 300.0)
            if verdict.passed:
                break
            bad = verdict.failed if verdict.failed in left else left[0]
            found.add((compiled, bad))
            left.remove(bad)
    return found


# --- the report ----------------------------------------------------------------------------------------


def argued() -> dict[tuple[str, str, str], dict[str, Any]]:
    """The survivors that were looked at, by file and change."""
    path = Path(__file__).parent / "survivors.yaml"
    entries = yaml.safe_load(path.read_text(encoding="utf-8")) or [] if path.is_file() else []
    return {(entry["file"], entry["from"], entry["to"]): entry for entry in entries}


def note(database: Path, results: Iterable[Result]) -> None:
    """Write a session as cosmic-ray's own tools read it."""
    database.parent.mkdir(exist_ok=True)
    database.unlink(missing_ok=True)
    with use_db(database, WorkDB.Mode.create) as db:
        for number, (mutant, killed, by, _, _, before, after) in enumerate(results):
            start, end = (mutant.line, mutant.column), (mutant.line, mutant.column + 1)
            spec = MutationSpec(Path(mutant.file), mutant.operator, mutant.occurrence, start, end)
            db.add_work_item(WorkItem.single(str(number), spec))
            outcome = TestOutcome.KILLED if killed else TestOutcome.SURVIVED
            diff = f"--- {mutant.file}:{mutant.line}\n-{before}\n+{after}"
            db.set_result(str(number), WorkResult(WorkerOutcome.NORMAL, by, outcome, diff))


def is_below(threshold: float, killed: int, number: int) -> bool:
    """Whether so few were killed that one is 95 % sure of a smaller share than the threshold: samples differ."""
    chances = (
        math.comb(number, each) * threshold**each * (1.0 - threshold) ** (number - each) for each in range(killed + 1)
    )
    return math.fsum(chances) < 0.05


def report(results: Sequence[Result]) -> tuple[int, int]:
    """Print survivors and scores; how many were killed, of how many that are not known to be equivalent."""
    known = argued()
    by_folder: dict[str, Counter[bool]] = defaultdict(Counter)
    kinds: Counter[str] = Counter()
    for result in sorted(results):
        folder = next(each for each in mutants_module.GUARDED if result.mutant.file.startswith(each))
        by_folder[folder][result.killed] += 1
        if not result.killed:
            entry = known.get((result.mutant.file, result.before, result.after))
            kinds[entry["kind"] if entry else "new"] += 1
            print(f"{result.mutant.file}:{result.mutant.line}: survived {result.tests} tests")
            print(f"    - {result.before}\n    + {result.after}")
            print(f"    {entry['kind']}: {entry['why']}" if entry else "    not looked at yet")
    print()
    for folder, counts in by_folder.items():
        print(f"{folder:16} {counts[True]:5} of {counts.total():5} killed, {counts[True] / counts.total():6.1%}")
    killed = sum(counts[True] for counts in by_folder.values())
    print(f"{'all':16} {killed:5} of {len(results):5} killed, {killed / len(results):6.1%}")
    told = ", ".join(f"{number} {kind}" for kind, number in sorted(kinds.items()))
    print(f"survivors: {told or 'none'}")
    number = len(results) - kinds["equivalent"]
    if number < len(results):
        print(f"without those that are equivalent: {killed:,} of {number:,}, {killed / number:.1%}")
    return killed, number


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--count", type=int, default=200, help="mutants to try")
    options.add_argument("--seed", type=int, default=0, help="of the sample")
    options.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    options.add_argument("--threshold", type=float, default=0.9, help="exit code 1 if surely less are killed")
    options.add_argument("--map", type=Path, help="keep which tests run what in this file, or take it from there")
    options.add_argument("--only", default="", help="mutants of files that begin so")
    given = options.parse_args()
    began = time.monotonic()
    mutants = [each for each in mutants_module.mutants_of(ROOT) if each.file.startswith(given.only)]
    chosen = mutants_module.sample(ROOT, mutants, given.count, given.seed)
    print(f"{len(mutants):,} mutants, of which {len(chosen)} are tried", flush=True)
    trial.preload()
    scratch = Path(tempfile.mkdtemp(prefix="epicycle-mutants-"))
    try:
        trees = [trial.copy_project(ROOT, scratch / str(number)) for number in range(given.jobs)]
        with multiprocessing.get_context("fork").Pool(given.jobs) as pool:
            pool.map(warm_up, trees)
        if given.map is not None and given.map.is_file():
            found = recorder.load(given.map)
        else:
            found = maps(trees, given.jobs)
            if given.map is not None:
                recorder.save(given.map, found)
        by_kind = {compiled: recorder.Map(each) for compiled, each in found.items()}
        print(f"{len(found[True])} tests, {len(found[False])} of kernels; {time.monotonic() - began:.0f} s", flush=True)
        results: dict[Mutant, Result] = {}
        tasks: list[tuple[Mutant, frozenset[str]]] = [(each, frozenset()) for each in chosen]
        doubted: frozenset[str] = frozenset()
        while tasks:
            for number, result in enumerate(attempt_all(tasks, trees, by_kind), 1):
                results[result.mutant] = result
                if not result.killed or number % 50 == 0:
                    place = f"{result.mutant.file}:{result.mutant.line}"
                    told = f"{'killed' if result.killed else 'SURVIVED'} {place}: {result.after}"
                    print(f"{number} of {len(tasks)}, {time.monotonic() - began:.0f} s: {told}", flush=True)
            bad = unreliable([results[each] for each, _ in tasks], trees[0])
            doubted |= {test for _, test in bad}
            for _, test in sorted(bad):
                print(f"fails without a mutant, and is not asked again: {test}", flush=True)
            tasks = [(each, doubted) for each, _ in tasks if results[each].by in doubted]
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    note(CACHE / "session.sqlite", results.values())
    killed, number = report(list(results.values()))
    print(f"{time.monotonic() - began:.0f} s")
    return int(is_below(given.threshold, killed, number))


if __name__ == "__main__":
    sys.exit(main())
