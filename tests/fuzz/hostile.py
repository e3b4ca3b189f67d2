"""Whatever is hostile in a file or an option, each command ends soon, in words, and touches nothing else.

    python -m tests.fuzz.hostile [--inputs 5000] [--seed N] [--jobs 2] [--only SURFACE] [--number N]

makes inputs for each of ``surfaces/``, and gives each to a command in a process that may take 20 s, and 1 GB
more than it has; that may read nothing but the folder of the input, write nowhere else, run no code but ours, and start
nothing.  The seed says what the inputs are; ``--number`` makes one of them again, and shows what is said about it.
"""

from __future__ import annotations

import argparse
import faulthandler
import os
import resource
import secrets
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from functools import cache
from io import StringIO
from itertools import repeat
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import numpy as np

from epicycle.runner.interface.cli import main as epicycle
from epicycle.runner.model.catalogue import types as catalogue_types
from tests.fuzz.surfaces import SURFACES, Answer, Case

MAX_SECONDS = 20  # of wall-clock time for one input
MAX_MEMORY = 1_000_000_000  # bytes of address space above what a process has with all that is imported
CHUNK = 50
# What code of ours may read: itself, Python, and what the system says about itself.
TRUSTED = tuple(
    Path(each).resolve() for each in (Path(__file__).parents[2], sys.prefix, sys.base_prefix, "/proc", "/sys", "/usr")
)
DEVICES = {Path("/dev/null"), Path("/dev/urandom"), Path("/etc/localtime"), Path("/etc/mime.types")}
READING = {"open", "os.listdir", "os.scandir"}
WRITING = {"os.remove", "os.rename", "os.rmdir", "os.mkdir", "os.truncate", "os.chmod", "os.link", "os.symlink",
           "shutil.rmtree", "shutil.move", "shutil.copyfile"}  # fmt: skip
FORBIDDEN = ("subprocess.", "os.system", "os.exec", "os.posix_spawn", "os.spawn", "os.startfile", "socket.", "urllib.",
             "ftplib.", "http.", "smtplib.", "webbrowser.", "pty.")  # fmt: skip


class Late(KeyboardInterrupt):
    """An input took too long; no handler but that of Ctrl-C must catch this."""


# --- the guard ----------------------------------------------------------------------------------------

_home: list[Path] = []  # where this process keeps what it has made; empty while nobody is watched
_folder: list[Path] = []  # of the input
_code: list[Path] = []  # the folder whose code the command line names
_intrusions: list[str] = []


def _is_under(path: Path, *folders: Path) -> bool:
    return any(path.is_relative_to(each) for each in folders)


def _path(said: Any) -> Path | None:
    """Where something lies; None for an open file or what is not a path."""
    try:
        return Path(os.fsdecode(said)).resolve() if isinstance(said, (str, bytes, os.PathLike)) else None
    except (ValueError, OSError, RuntimeError):
        return None


def _may_run(code: Any) -> bool:
    """Whether code is ours, of a library, or of the file that the command line names."""
    if not isinstance(code, CodeType):
        return True  # text of ``exec``, whose code is then compiled, and comes here again
    if not code.co_filename.startswith("<"):
        path = Path(code.co_filename).resolve()
        return _is_under(path, *TRUSTED, *_code) and (bool(_code) or not _is_under(path, *_folder))
    # What dataclasses, named tuples and the like make, and our expressions, which can call only what they are given.
    frame: FrameType | None = sys._getframe(2)
    maker = Path(frame.f_code.co_filename).resolve() if frame is not None else Path("/")
    return _is_under(maker, *TRUSTED, *_code)


def _is_worker(command: Any) -> bool:
    """Whether this is a process of ours that makes runs."""
    return list(command) == [sys.executable, "-P", "-c", "from epicycle.runner.support.apart import serve; serve()"]


def _audit(event: str, arguments: tuple[Any, ...]) -> None:
    if not _home:
        return
    home, *_home[:] = _home  # what is done from here on is our own
    try:
        bad = False
        if event in READING or event in WRITING:
            path = _path(arguments[0])
            writes = event in WRITING or (
                event == "open" and (arguments[2] or 0) & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)
            )
            fine = (home, *_folder) if writes else (home, *_folder, *TRUSTED)
            bad = path is not None and path not in DEVICES and not _is_under(path, *fine)
            bad = bad and not (event == "os.listdir" and path == Path.cwd())
        elif event == "exec":
            bad = not _may_run(arguments[0])
        elif event.startswith(FORBIDDEN):
            bad = not (event == "subprocess.Popen" and _is_worker(arguments[1]))
        if bad:
            _intrusions.append(f"{event} {arguments!r}"[:300])
            raise PermissionError(_intrusions[-1])
    finally:
        _home.append(home)


def _ring(*_: object) -> None:
    raise Late(f"more than {MAX_SECONDS} s")


@contextmanager
def watched(home: Path, folder: Path, case: Case) -> Iterator[None]:
    """Nothing but the folder is touched, and time and memory are limited."""
    signal.setitimer(signal.ITIMER_REAL, MAX_SECONDS, 1)
    # For what no signal can stop.
    faulthandler.dump_traceback_later(3 * MAX_SECONDS, exit=True, file=sys.__stderr__)
    base = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (base + MAX_MEMORY, resource.RLIM_INFINITY))
    _intrusions.clear()
    _folder[:], _code[:] = [folder], [case.code] if case.code is not None else []
    _home.append(home)
    try:
        yield
    finally:
        _home.clear()
        signal.setitimer(signal.ITIMER_REAL, 0)
        faulthandler.cancel_dump_traceback_later()
        resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))


# --- one input ----------------------------------------------------------------------------------------


def _run(home: Path, folder: Path, case: Case) -> tuple[Answer, str]:
    """What a command says about an input, and what is wrong with how it ends."""
    wrong = ""
    with redirect_stdout(StringIO()) as out, redirect_stderr(StringIO()) as err:
        try:
            with watched(home, folder, case):
                code = epicycle([str(each) for each in case.arguments])
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else 1
        except BaseException:
            code, wrong = -1, traceback.format_exc()
    return Answer(code, out.getvalue(), err.getvalue()), wrong


def problem(home: Path, folder: Path, case: Case) -> tuple[Answer, str]:
    """What a command says about an input, and what is wrong with that; nothing is if it is empty."""
    started, before = time.monotonic(), (list(sys.path), set(sys.modules))
    if case.path is not None:
        sys.path.insert(0, str(case.path))
        _forget_types()
    try:
        answer, wrong = _run(home, folder, case)
    finally:
        sys.path[:] = before[0]
        for name in set(sys.modules) - before[1]:
            if _is_under(Path(getattr(sys.modules[name], "__file__", None) or "/").resolve(), folder):
                del sys.modules[name]
        if case.path is not None:
            _forget_types()
    said = answer.out + answer.err
    if not wrong and _intrusions:
        wrong = f"touches what it must not: {_intrusions[0]}"
    if not wrong and (seconds := time.monotonic() - started) > MAX_SECONDS:
        wrong = f"takes {seconds:.0f} s"
    if not wrong and answer.code not in (0, 1, 2, 3):
        wrong = f"ends with {answer.code}"
    if not wrong and "Traceback (most recent call last)" in said:
        wrong = "tells a traceback"
    if not wrong and answer.code in (1, 2) and not said.strip():
        wrong = "says nothing"
    return answer, wrong or case.judge(answer)


def _forget_types() -> None:
    for each in vars(catalogue_types).values():
        if hasattr(each, "cache_clear"):
            each.cache_clear()


def made(home: Path, seed: int, number: int) -> tuple[str, Path, Case]:
    """The input with a number: its surface, its folder, and the command that reads it."""
    surface = SURFACES[number % len(SURFACES)]
    folder = home / "input" / str(number)
    folder.mkdir(parents=True)
    return surface.name, folder, surface.make(np.random.default_rng([seed, number]), home / surface.name, folder)


# --- many inputs --------------------------------------------------------------------------------------


@cache
def settled(folder: str, names: tuple[str, ...]) -> Path:
    """A folder of this process's own, with the good files of the surfaces; all is imported and compiled by now."""
    home = Path(tempfile.mkdtemp(dir=folder)).resolve()
    for name in ("HOME", "XDG_STATE_HOME", "XDG_CACHE_HOME", "XDG_CONFIG_HOME", "MPLCONFIGDIR", "TMPDIR"):
        (home / "user").mkdir(exist_ok=True)
        os.environ[name] = str(home / "user")
    tempfile.tempdir = None
    # Modules that a command imports first are compiled, and would be written beside their sources.
    sys.dont_write_bytecode, os.environ["PYTHONDONTWRITEBYTECODE"] = True, "1"
    os.chdir(home / "user")
    for surface in SURFACES:
        if surface.name in names:
            (home / surface.name).mkdir()
            with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
                surface.prepare(home / surface.name)
    catalogue_types.installed().loaded()
    signal.signal(signal.SIGALRM, _ring)
    sys.addaudithook(_audit)
    return home


def attack(folder: str, seed: int, numbers: list[int]) -> tuple[Counter[str], list[str]]:
    """Try inputs; how they ended, by surface, and the stories of the bad ones."""
    home = settled(folder, tuple(each.name for each in SURFACES))
    counts: Counter[str] = Counter()
    stories = []
    for number in numbers:
        name, place, case = made(home, seed, number)
        (home / "last").write_text(f"{name} {number}", encoding="utf-8")  # for when the process is ended
        answer, wrong = problem(home, place, case)
        counts[f"{name}: {'wrong' if wrong else f'exit code {answer.code}'}"] += 1
        if wrong:
            arguments = " ".join(map(str, case.arguments))
            stories.append(f"--- {name}, --seed {seed} --number {number}\nepicycle {arguments}\n{wrong}".rstrip())
        shutil.rmtree(place)
    return counts, stories


def show(folder: str, seed: int, number: int) -> int:
    """Make one input again, and show what is said about it."""
    home = settled(folder, (SURFACES[number % len(SURFACES)].name,))
    _, place, case = made(home, seed, number)
    answer, wrong = problem(home, place, case)
    print(f"epicycle {' '.join(map(str, case.arguments))}\n{answer.out}{answer.err}exit code {answer.code}\n{wrong}")
    return min(len(wrong), 1)


def main() -> int:
    """Try the inputs asked for, on several processors."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--inputs", type=int, default=5_000)
    options.add_argument("--seed", type=int, default=None)
    options.add_argument("--jobs", type=int, default=2)
    options.add_argument("--only", choices=[each.name for each in SURFACES], default=None)
    options.add_argument("--number", type=int, default=None)
    given = options.parse_args()
    seed = secrets.randbelow(10**6) if given.seed is None else given.seed
    folder = tempfile.mkdtemp(prefix="epicycle-hostile-")
    print(f"seed {seed}", flush=True)
    if given.number is not None:
        return show(folder, seed, given.number)
    names = [each.name for each in SURFACES]
    step, first = (1, 0) if given.only is None else (len(names), names.index(given.only))
    numbers = [first + step * each for each in range(given.inputs)]
    chunks = [numbers[at : at + CHUNK] for at in range(0, len(numbers), CHUNK)]
    counts: Counter[str] = Counter()
    bad, started = 0, time.perf_counter()
    try:
        with ProcessPoolExecutor(given.jobs) as pool:
            for found, stories in pool.map(attack, repeat(folder), repeat(seed), chunks):
                counts += found
                bad += len(stories)
                for story in stories:
                    print(story, flush=True)
    except BrokenProcessPool:
        last = [each.read_text(encoding="utf-8") for each in Path(folder).glob("*/last")]
        print(f"a process was ended by one of these inputs: {', '.join(last)}; their files stand in {folder}")
        return 1
    shutil.rmtree(folder)
    for ending, count in sorted(counts.items()):
        print(f"{count:6,}  {ending}")
    print(f"{counts.total():,} hostile inputs, {bad:,} of them with a bad end; {time.perf_counter() - started:.0f} s")
    return min(bad, 1)


if __name__ == "__main__":
    raise SystemExit(main())
