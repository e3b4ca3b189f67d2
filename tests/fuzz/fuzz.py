"""Whatever stands in a file or an option, loading it ends soon in a Model or a ModelError, and touches nothing else.

    python -m tests.fuzz.fuzz [--mutants 50000] [--seed N] [--jobs 2]

makes mutants of the packaged models and of those in ``models/`` beside this file, loads each, and runs those that are
still good for a moment.  It prints what came of them; a mutant that breaks the rules is made as small as Hypothesis
can, and shown.  Without ``--seed``, each run tries other mutants.
"""

from __future__ import annotations

import argparse
import faulthandler
import gc
import itertools
import os
import pickle
import resource
import secrets
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import CodeType
from typing import Any, cast

import hypothesis
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from epicycle.actors import part_finders
from epicycle.actors.expression.translation import KNOWN
from epicycle.runner import Simulation
from epicycle.runner.execution.engine import ActorError, LoopError
from epicycle.runner.model.build.load import load_model
from epicycle.runner.model.catalogue.packaged import model_folders
from epicycle.runner.model.catalogue.types import built_in, figure_types, installed
from epicycle.runner.model.text.limits import NORMAL
from epicycle.runner.model.text.problems import ModelError
from tests.fuzz.mutants import Mutation, Seedling, of_options, of_text, of_tree, seedling
from tests.fuzz.recipes import cooked

SOURCES = Path(__file__).resolve().parents[2]
MODELS = [folder.resolve() for folder in model_folders()]
HERE = Path(__file__).parent / "models"
BAD_MODELS = Path(__file__).parents[1] / "bad_models"
MAX_SECONDS = 2.0  # user CPU time for one mutant
MAX_MEMORY = 500  # MB at the peak
OF_ITS_OWN = 200  # MB that a process takes with all that it imports
ADDRESS_SPACE = 3_000_000_000
CHUNK = 500
LARGEST = 5_000  # actors of a model that is large on purpose
# All that loading a model may do beside computing; files are judged by where they lie.
HARMLESS = {"compile", "object.__getattr__", "object.__setattr__", "sys._getframe", "builtins.id", "array.__new__"}
READING = {"open", "os.listdir", "os.scandir", "pathlib.Path.glob"}
DISTURBED = {"site", "collision_avoidance"}  # by the files in ``disturbances/`` beside them
LONG = {"collision_avoidance"}  # each of its steps takes too long to run so many
# Wrong models that are loaded before the mutants, with all that Python loads and compiles for a message.
FAULTY = ("many_faults", "extends", "loop_through_composites", "data_file", "not_utf8", "option_disturb")
# Problems of a whole file or model, which have no line of their own.
WHOLE = ("is empty", "is larger than", "there is no", "is a folder", "cannot read", "is UTF-16", "a way of more than")


class Hang(KeyboardInterrupt):
    """A mutant took too long; no handler but that of Ctrl-C must catch this."""


class Enough(KeyboardInterrupt):
    """A run has shown that it goes on."""


class Intrusion(KeyboardInterrupt):
    """A mutant made us do what a model must not."""


# --- the guard ----------------------------------------------------------------------------------------

_watched: list[Path] = []  # the folder that may be read; empty while nobody is watched


def _is_expression(code: Any) -> bool:
    """Whether this is an expression as functions, which can call nothing but what they are given."""
    if not isinstance(code, CodeType) or code.co_filename != "<expression>":
        return False
    inner = [each for each in code.co_consts if isinstance(each, CodeType)]  # with those of its list comprehensions
    named = {*KNOWN, "value", "number", "attempt", "dense", "abs", "sqrt"}  # the functions, and what steps of ODEs call
    return named >= set(code.co_names) and all(map(_is_expression, inner))


def _audit(event: str, arguments: tuple[Any, ...]) -> None:
    if not _watched:
        return
    folder, *_watched[:] = _watched  # what is done from here on is our own
    try:
        if event in READING:
            path = arguments[0]
            writes = event == "open" and (arguments[2] or 0) & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)
            named = isinstance(path, (str, bytes, Path)) and Path(os.fsdecode(path))
            if named and not writes and named.suffix == ".py" and named.resolve().is_relative_to(SOURCES):
                return  # a line of ours in a message
            if named and not writes and any(named.resolve().is_relative_to(each) for each in MODELS):
                return  # a packaged model may be extended
            fine = isinstance(path, (str, bytes, Path)) and Path(os.fsdecode(path)).resolve().is_relative_to(folder)
            if not fine or writes:
                raise Intrusion(f"{event} {arguments!r}")
        elif event == "exec" and ("<class 'networkx" in str(arguments) or _is_expression(arguments[0])):
            return  # networkx makes its wrappers with exec, each at its first use
        elif event == "function.__new__" and _is_expression(arguments[0]):
            return
        elif event not in HARMLESS:
            raise Intrusion(f"{event} {arguments!r}"[:500])
    finally:
        _watched.append(folder)


@contextmanager
def watched(folder: Path) -> Iterator[None]:
    """Nothing but the folder is touched, and time is limited."""
    signal.setitimer(signal.ITIMER_VIRTUAL, MAX_SECONDS, 0.1)  # and again, for SimPy keeps what ends one process
    faulthandler.dump_traceback_later(60, exit=True)  # for what no signal can stop
    _watched.append(folder)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        _watched.clear()
        faulthandler.cancel_dump_traceback_later()


def _ring(*_: object) -> None:
    raise Hang(f"more than {MAX_SECONDS:g} s")


# --- one mutant ---------------------------------------------------------------------------------------


@dataclass
class Tally:
    """What came of the mutants, how long the slowest took to load (s of processor time), and the memory (MB)."""

    mutants: int = 0
    rejected: int = 0
    accepted: int = 0
    run: int = 0
    failed: int = 0
    long: int = 0
    slowest: float = 0.0
    memory: float = 0.0

    def add(self, other: Tally) -> None:
        """Count another process's mutants, too."""
        for name in ("mutants", "rejected", "accepted", "run", "failed", "long"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        self.slowest = max(self.slowest, other.slowest)
        self.memory = max(self.memory, other.memory)

    def __str__(self) -> str:
        return (
            f"{self.mutants:,} mutants: {self.rejected:,} rejected, {self.accepted:,} accepted, {self.run:,} run, "
            f"{self.failed:,} failed in the run, {self.long:,} stopped in a long step; "
            f"slowest {self.slowest:.2f} s, largest memory {self.memory:.0f} MB"
        )


class Plot:
    """A folder with the good models in it, in which mutants grow."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder.resolve()
        self.seedlings: list[Seedling] = []
        self.memory = 0.0  # in use before the mutant of the moment
        types = (*built_in().actors, *built_in().aspects)
        for number, source in enumerate((HERE, *model_folders())):
            bed = self.folder / str(number)
            shutil.copytree(source, bed, ignore=shutil.ignore_patterns("__pycache__", "*.py"))
            for model in sorted(bed.glob("*.yaml")):
                text = model.read_text(encoding="utf-8")
                parts = [part for part in sorted(bed.glob("*/*.yaml")) if f"{part.parent.name}/{part.name}" in text]
                self.seedlings += [seedling(model, changing, types) for changing in (model, *parts)]
                if model.stem in DISTURBED:
                    disturbances = sorted(bed.glob("disturbances/*.yaml"))
                    self.seedlings += [seedling(model, changing, types, (changing,)) for changing in disturbances]

    def try_file(self, plant: Seedling, data: bytes, tally: Tally) -> None:
        """Load a mutant of a file."""
        plant.changing.write_bytes(data)
        try:
            self._try(plant, {}, tally)
        finally:
            plant.changing.write_text(plant.text, encoding="utf-8")

    def try_recipe(self, kind: int, one: int, other: int, tally: Tally) -> str:
        """Load and run a model that is large, deep or extreme; its text."""
        text = cooked(kind, one, other, built_in())
        grown = self.folder / "grown" / "grown.yaml"
        grown.parent.mkdir(exist_ok=True)
        grown.write_text(text, encoding="utf-8")
        try:
            self._try(Seedling(grown, grown, (), text, b"", ()), {}, tally, is_short=True)
        except BaseException as error:
            error.add_note(text[:20_000])
            raise
        return text

    def try_options(self, plant: Seedling, options: dict[str, list[str]], tally: Tally) -> None:
        """Load a good model with mutant options."""
        self._try(plant, options, tally)

    def _try(self, plant: Seedling, options: dict[str, list[str]], tally: Tally, *, is_short: bool = False) -> None:
        """Load a model and run it for a moment; one that ``is_short`` has no step that may take its time."""
        tally.mutants += 1
        forget_peak()
        self.memory = peak_memory()
        started = time.process_time()
        try:
            with watched(plant.model.parent):
                most = LARGEST if is_short else NORMAL.actors
                model = load_model(plant.model, disturb=plant.disturb, max_actors=most, **options)
        except ModelError as error:
            tally.rejected += 1
            check_problems(error)
            return
        finally:
            tally.slowest = max(tally.slowest, time.process_time() - started)
            self.weigh(tally)
        tally.accepted += 1
        calls = 0

        def progress(_: float) -> None:
            nonlocal calls
            calls += 1
            if calls > 5:
                raise Enough

        if plant.model.stem not in LONG and len(model.graph.actors) < 500:
            tally.run += 1
            try:
                with watched(plant.model.parent):
                    Simulation(model).run(until=1.0, progress=progress)
            except (ActorError, LoopError):
                tally.failed += 1
            except Hang:
                if is_short:
                    raise
                tally.long += 1  # what a good model computes may take its time, and what it takes up meanwhile
                return
            except Enough:
                pass
            self.weigh(tally)

    def weigh(self, tally: Tally) -> None:
        """See that this mutant has not taken too much memory, whatever others have left behind."""
        memory = OF_ITS_OWN + peak_memory() - self.memory
        tally.memory = max(tally.memory, memory)
        assert memory < MAX_MEMORY, f"{memory:.0f} MB"


def check_problems(error: ModelError) -> None:
    """Every problem says what is wrong, and where."""
    assert error.problems
    text = str(error)
    for problem in error.problems:
        assert problem.message.strip(), text
        assert problem.position is not None or any(word in problem.message for word in WHOLE), text
        assert "Traceback" not in problem.message, text
        assert "object at 0x" not in problem.message, text
    rebuilt = pickle.loads(pickle.dumps(error))
    assert (rebuilt.problems, rebuilt.more) == (error.problems, error.more)


def forget_peak() -> None:
    """Let the peak of the memory in use begin anew, where the system can do that."""
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def peak_memory() -> float:
    """The most memory that was in use since ``forget_peak``, in MB."""
    with suppress(OSError):
        for line in Path("/proc/self/status").read_text().splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) / 1_024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1_024


# --- many mutants -------------------------------------------------------------------------------------

numbers = st.integers(0, 2**16)
mutations = st.lists(st.tuples(numbers, numbers, numbers), min_size=1, max_size=4)


@cache
def plot(folder: str) -> Plot:
    """The part of a folder that is this process's own, which has loaded and run each model once."""
    made = Plot(Path(tempfile.mkdtemp(dir=folder)))
    # What is imported and compiled at the first use is not the doing of a mutant.
    for plant in made.seedlings:
        Simulation(load_model(plant.model, disturb=plant.disturb)).run(until=0.0)
    figure_types().get("")  # which looks once for those of installed packages
    for find in part_finders:
        find("")
    installed().loaded()
    for name in FAULTY:
        with suppress(ModelError):
            load_model(BAD_MODELS / f"{name}.yaml", disturb=BAD_MODELS / "parts" / "storm.yaml")
    gc.collect()
    gc.freeze()  # or else Hypothesis, which collects before each test, would look through it all each time
    # A bomb that goes off takes this process alone, not the machine.
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE, ADDRESS_SPACE))
    faulthandler.register(signal.SIGUSR1)
    signal.signal(signal.SIGVTALRM, _ring)
    sys.addaudithook(_audit)
    return made


def sow(folder: str, seed: int, count: int) -> tuple[Tally, str]:
    """Try so many mutants; what came of them, and the story of the first bad one."""
    tally = Tally()
    first: list[str] = []
    garden = plot(folder)
    # Large models take longer, so they have fewer mutants.
    beds = [plant for plant in garden.seedlings for _ in range(1 + 8_000 // plant.model.stat().st_size)]

    @hypothesis.seed(seed)
    @settings(
        max_examples=count,
        database=None,
        deadline=None,
        phases=(Phase.generate, Phase.shrink),
        suppress_health_check=list(HealthCheck),
        print_blob=False,
    )
    @given(st.sampled_from(range(len(beds))), st.integers(0, 10), mutations)
    def holds(bed: int, kind: int, changes: list[Mutation]) -> None:
        plant, what = beds[bed], cast(Any, "")
        try:
            if kind == 10:
                what = changes[0]
                garden.try_recipe(*changes[0], tally)
            elif kind == 9:
                what = of_options(plant, changes)
                garden.try_options(plant, what, tally)
            else:
                what = of_text(plant.text, changes) if kind < 3 else of_tree(plant, changes)
                garden.try_file(plant, what, tally)
        except (Hang, Intrusion, Exception) as error:
            shown = what.decode("utf-8", "backslashreplace") if isinstance(what, bytes) else str(what)
            first.append(f"{plant}: {error!r}\n{shown[:20_000]}")
            raise AssertionError(first[-1]) from error

    try:
        holds()
    except BaseException:
        return tally, f"{traceback.format_exc()}\n--- the first one, as it was found\n{''.join(first[:1])}"
    return tally, ""


def main() -> int:
    """Try the mutants asked for, on several processors."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--mutants", type=int, default=50_000)
    options.add_argument("--seed", type=int, default=None)
    options.add_argument("--jobs", type=int, default=2)
    given = options.parse_args()
    seed = secrets.randbelow(10**6) if given.seed is None else given.seed
    print(f"seed {seed}", flush=True)
    counts = [CHUNK] * (given.mutants // CHUNK) + ([given.mutants % CHUNK] if given.mutants % CHUNK else [])
    seeds = range(1_000 * seed, 1_000 * seed + len(counts))
    total, bad, folder = Tally(), 0, tempfile.mkdtemp(prefix="epicycle-fuzz-")
    started = time.perf_counter()
    try:
        with ProcessPoolExecutor(given.jobs) as pool:
            for tally, story in pool.map(sow, itertools.repeat(folder), seeds, counts):
                total.add(tally)
                bad += bool(story)
                print(story or f"{total}", flush=True)
    except BrokenProcessPool:
        print(f"a process was ended by a mutant; the files as they were stand in {folder}")
        return 1
    shutil.rmtree(folder)
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(
        f"{total}\n{bad} of {len(counts)} rounds found a mutant that breaks the rules; "
        f"{time.perf_counter() - started:.0f} s, processor time {children.ru_utime + children.ru_stime:.0f} s"
    )
    return min(bad, 1)


if __name__ == "__main__":
    raise SystemExit(main())
