"""The compiled core and the Python core make the same runs, and each reports which one it is."""

from __future__ import annotations

import json
import os
import runpy
import subprocess
import sys
from collections.abc import Iterator
from importlib.machinery import EXTENSION_SUFFIXES, PathFinder
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from epicycle.actors import CORE, CORE_MODULES, CORE_REASON
from tests.engine.cores import ROOT, WAYS, Worker, differences, workers
from tests.engine.networks import network

MODULE = runpy.run_path(str(ROOT / "actors" / "compiled.py"), run_name="setup")
REMEDY = "'make core', or an installation with EPICYCLE_BUILD=all, compiles it where there is a C compiler"
CHANGED = f"the sources have changed since the core was compiled; {REMEDY}"
MISSING = f"the core is not compiled; {REMEDY}"


def is_there() -> bool:
    return not MODULE["_usable"](ROOT)[1]


@pytest.fixture(scope="module")
def at() -> Iterator[dict[str, Worker]]:
    if not is_there():
        pytest.skip("the core is not compiled here")
    with workers() as found:
        yield found


@pytest.mark.slow
@settings(max_examples=60, suppress_health_check=list(HealthCheck))
@given(numbers=st.randoms(use_true_random=False), way=st.sampled_from(WAYS))
def test_networks(at: dict[str, Worker], numbers: Any, way: str) -> None:
    assert differences(at, [{"model": network(numbers), "way": way}]) == []


def test_a_difference_would_be_found(at: dict[str, Worker]) -> None:
    """Ask one worker for another seed than the others."""
    model = {"actors": {"s": {"type": "PoissonClock"}}, "run": {"stop": 5, "seed": 1}}
    other = {**model, "run": {"stop": 5, "seed": 2}}
    for name, worker in at.items():
        worker.ask([{"model": other if name == "python" else model, "way": "run"}])
    told = {name: worker.answers(1)[0] for name, worker in at.items()}
    assert told["python"] != told["compiled"] == told["compiled, without native forms"]


def run(*words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    settings = {key: value for key, value in os.environ.items() if not key.startswith("EPICYCLE_")}
    return subprocess.run(
        [sys.executable, "-m", "epicycle.runner.interface.cli", *words],
        env={**settings, **environment},
        capture_output=True,
        text=True,
        check=False,
    )


def test_the_version_says_which_core() -> None:
    done = run("--version", EPICYCLE_CORE="python")
    version = f"Python {sys.version_info.major}.{sys.version_info.minor}.{sys.version_info.micro}"
    assert (done.stdout, done.stderr) == (f"epicycle 0.1.0, python core (chosen by EPICYCLE_CORE), {version}\n", "")
    if is_there():
        done = run("--version")
        assert (done.stdout, done.stderr) == (f"epicycle 0.1.0, compiled core, {version}\n", "")


def test_a_core_that_cannot_be_had() -> None:
    done = run("run", "mm1", EPICYCLE_CORE="fast")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "error: EPICYCLE_CORE=fast is unknown; the cores are python and compiled\n"


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda root: None, ""),
        (lambda root: (root / MODULE["MANIFEST"]).unlink(), MISSING),
        (lambda root: (root / MODULE["MANIFEST"]).write_text("{"), MISSING),
        (lambda root: (root / "actors/core/order.py").write_text("changed"), CHANGED),
        (lambda root: (root / "actors/core/order.pxd").unlink(), CHANGED),
        (
            lambda root: (root / MODULE["MANIFEST"]).write_text('{"python": "cpython-27", "libraries": {}}'),
            f"the core was compiled for cpython-27; {REMEDY}",
        ),
    ],
)
def test_why_python_serves(tmp_path: Path, change: Any, reason: str) -> None:
    for name in CORE_MODULES:
        source = Path(*name.split(".")[1:])
        (tmp_path / source).parent.mkdir(parents=True, exist_ok=True)
        for ending in (".py", ".pxd", ".pyx"):
            if (ROOT / source).with_suffix(ending).exists():
                (tmp_path / source).with_suffix(ending).write_bytes((ROOT / source).with_suffix(ending).read_bytes())
    (tmp_path / MODULE["FOLDER"]).mkdir(parents=True)
    manifest = {"python": sys.implementation.cache_tag, "libraries": MODULE["digests"](tmp_path)}
    (tmp_path / MODULE["MANIFEST"]).write_text(json.dumps(manifest))
    for library in MODULE["LIBRARIES"]:
        MODULE["library_file"](tmp_path, library).write_text("")
    change(tmp_path)
    usable, why = MODULE["_usable"](tmp_path)
    assert (usable, why) == ([] if reason else [*MODULE["LIBRARIES"]], reason)


def test_the_choice_of_this_process() -> None:
    assert CORE in ("python", "compiled")
    assert bool(CORE_REASON) == (CORE == "python")


def test_a_compiled_file_of_an_earlier_build_is_not_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Python itself would prefer it to the source beside it."""
    package = tmp_path / "somewhere"
    package.mkdir()
    (package / "part.py").write_text("")
    stale = package / f"part{EXTENSION_SUFFIXES[0]}"
    stale.write_text("not even a library")
    assert PathFinder.find_spec("epicycle.somewhere.part", [str(package)]).origin == str(stale)
    (finder,) = (each for each in sys.meta_path if type(each).__module__ == "epicycle.actors.compiled")
    assert finder.find_spec("epicycle.somewhere.part", [str(package)]).origin == str(package / "part.py")
    assert finder.find_spec("elsewhere.part", [str(package)]) is None


@pytest.mark.parametrize("core", ["python", "compiled"])
def test_help_shows_what_a_class_takes(core: str) -> None:
    if core == "compiled" and not is_there():
        pytest.skip("the core is not compiled here")
    program = (
        "import inspect; from epicycle.actors import InputPort, Parameter\n"
        "class Own(Parameter):\n"
        "    def __init__(self, a, b=1): pass\n"
        "for each in (InputPort, Parameter): print(*inspect.signature(each).parameters, each.__doc__.splitlines()[0])\n"
        "print(inspect.signature(Own))\n"
    )
    words = [sys.executable, "-c", program]
    told = subprocess.run(
        words, env={**os.environ, "EPICYCLE_CORE": core}, capture_output=True, text=True, check=True
    ).stdout
    declared = "A declared parameter: on an instance it reads as its value, on the class as itself."
    assert told.splitlines() == [
        "type shape multi required triggers doc A port where tokens arrive: of any type if none is given.",
        f"type default unit min above max choices renamed shape optional doc {declared}",
        "(a, b=1)",
    ]
