"""The compiled core and the Python core make the same runs, and each reports which one it is."""

from __future__ import annotations

import hashlib
import json
import os
import re
import runpy
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from epicycle.actors import CORE, CORE_MODULES, CORE_REASON
from tests.engine.cores import ROOT, WAYS, Worker, differences, workers
from tests.engine.networks import network

MODULE = runpy.run_path(str(ROOT / "actors" / "compiled.py"), run_name="setup")
CHANGED = "the sources have changed since the core was compiled; reinstall Epicycle"
MISSING = "the core was not compiled at installation; reinstall Epicycle where a C compiler is available"


def is_there() -> bool:
    return not MODULE["_missing"](ROOT)


@pytest.fixture(scope="module")
def at() -> Iterator[dict[str, Worker]]:
    if not is_there():
        pytest.skip("the core is not compiled here")
    with workers() as found:
        yield found


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


def test_forms_are_of_the_actors_that_there_are() -> None:
    """As ``setup.py`` checks before it builds them."""
    forms = (ROOT / "runner/engine/forms.pyx").read_text(encoding="utf-8")
    found = re.findall(r'"([\w/]+\.py)", "(\w+)", "(\w*)"', forms)
    assert len(found) > 5
    for file, name, digest in found:
        text = MODULE["text_of"](ROOT / "actors" / file, name)
        assert hashlib.sha256(text.encode()).hexdigest()[:16] == digest, name


def run(*words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    settings = {key: value for key, value in os.environ.items() if not key.startswith("EPICYCLE_")}
    return subprocess.run(
        [sys.executable, "-m", "epicycle.runner.cli", *words],
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
        (lambda root: (root / "actors/compiled.json").unlink(), MISSING),
        (lambda root: (root / "actors/compiled.json").write_text("{"), MISSING),
        (lambda root: (root / "actors/core/moment.py").write_text("changed"), CHANGED),
        (lambda root: (root / "actors/core/moment.pxd").unlink(), CHANGED),
        (
            lambda root: (root / "actors/compiled.json").write_text('{"python": "cpython-27"}'),
            "the core was compiled for cpython-27; reinstall Epicycle",
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
    manifest = {"python": sys.implementation.cache_tag, "modules": MODULE["digests"](tmp_path)}
    (tmp_path / "actors/compiled.json").write_text(json.dumps(manifest))
    change(tmp_path)
    assert MODULE["_missing"](tmp_path) == reason


def test_the_choice_of_this_process() -> None:
    assert CORE in ("python", "compiled")
    assert bool(CORE_REASON) == (CORE == "python")


def test_what_a_form_is_a_form_of(tmp_path: Path) -> None:
    """Docstrings do not count, whatever else stands first does."""
    source = tmp_path / "one.py"
    kind = 'class A:\n    """Doc."""\n    def fire(self):\n        self.send(1)\n'
    source.write_text(f'{kind}\n\ndef f(x):\n    """Doc."""\n    return x\n')
    assert MODULE["text_of"](source, "A") == "class A:\n    def fire(self):\n        self.send(1)"
    assert MODULE["text_of"](source, "f") == "def f(x):\n    return x"
