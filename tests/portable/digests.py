"""What must be the same on every machine, as digests: ``python -m tests.portable.digests [PART ...]`` prints them.

Functions and laws at many points, interpreted and compiled; runs of every packaged model and disturbance, with their
metrics and signals; the table of a study; what every tutorial prints.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from epicycle.actors import random_stream
from epicycle.runner import Simulation, load_model
from epicycle.runner.model.catalogue.packaged import packaged_models
from tests.actors.core.test_random import CONTINUOUS, DISCRETE
from tests.test_docs import TUTORIALS, Reader, blocks

DISTURBED = "collision_avoidance"
# s; the other models run to their ends.
UNTIL = {DISTURBED: 2.0, "changing_roles": 4.0, "flying_observers": 2.0, "many_obstacles": 1.5, "safe_avoidance": 2.0}
SETTINGS = {DISTURBED: {"observers": 2, "disturbance": 0.25}}
TWO_ARGUMENTS = ("atan2", "hypot", "pow")
GROWING = ("cosh", "exp", "expm1", "sinh")
ONE_ARGUMENT = (*GROWING, "acos", "asin", "atan", "cos", "log", "log10", "log1p", "log2", "sin", "tan", "tanh")
SMALL = ("functions", "laws", "model mm1", "model bouncing_ball", "model feedback")  # what an emulator has time for


def hashed(*things: object) -> str:
    """The first digits of the SHA-256 of what things look like; floats show all their bits."""
    return hashlib.sha256("\n".join(map(repr, things)).encode()).hexdigest()[:16]


def functions(compiled: bool = False) -> str:
    """All elementary functions, over their domains."""
    from epicycle.actors.core import elementary

    stream, found = random_stream(0, "portable"), []
    for name in ONE_ARGUMENT + TWO_ARGUMENTS:
        function = getattr(elementary, name)
        if compiled:
            function = _compiled(function, name in TWO_ARGUMENTS)
        for _ in range(2_000):
            x = stream.uniform(-1.0, 1.0) * (1.0, 10.0, 700.0, 1e9)[stream.below(4)]
            x = abs(x) % 1.0 if name in ("acos", "asin") else abs(x) if name in ("log", "log2", "log10", "pow") else x
            x = abs(x) if name == "log1p" else max(-700.0, min(700.0, x)) if name in GROWING else x
            found.append((name, function(x, stream.uniform(0.0, 4.0)) if name in TWO_ARGUMENTS else function(x)))
    return hashed(*found)


def _compiled(function: Any, two: bool) -> Any:
    """As kernels call it."""
    import numba

    def of_one(x: float) -> Any:
        return function(x)

    def of_two(x: float, y: float) -> Any:
        return function(x, y)

    return numba.njit(of_two if two else of_one)


def laws() -> str:
    """All laws of random numbers."""
    stream = random_stream(1, "portable")
    drawn = [getattr(stream, name)(*given) for name, (given, _) in CONTINUOUS.items() for _ in range(300)]
    return hashed(*drawn, *(getattr(stream, name)(*given) for name, given, _ in DISCRETE for _ in range(300)))


def run(name: str, **options: Any) -> str:
    """A run: its log, metrics and signals."""
    results = Simulation(load_model(name, set=SETTINGS.get(name, {}), **options), seed=11).run(until=UNTIL.get(name))
    signals = {
        path: (signal.times.tolist(), list(map(repr, signal.tokens))) for path, signal in results.signals.items()
    }
    return hashed(results.digest, results.metrics, results.aspects, signals)


def table() -> str:
    """The table of a study."""
    from pyarrow import parquet

    from epicycle.runner.interface.cli import main

    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        main(["study", "waiting_time", "--replications", "1", "--out", folder])
        rows = parquet.read_table(Path(folder, "table.parquet")).to_pylist()
    return hashed(*({name: value for name, value in row.items() if "wall" not in name} for row in rows))


def printed(path: Path) -> list[str]:
    """The lines that a tutorial prints, without the time it takes."""
    reader, modules = Reader(), set(sys.modules)
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as here:
        here.chdir(folder)
        here.syspath_prepend(folder)
        try:
            lines = [line for _, _, told in reader.outputs(blocks(path)) for line in told.splitlines()]
        finally:
            reader.close()
    for name in set(sys.modules) - modules:
        if str(getattr(sys.modules[name], "__file__", "")).startswith(folder):
            del sys.modules[name]
    return [line for line in lines if not line.startswith("wall time")]


def tutorials() -> dict[str, Path]:
    """Those that do not start other programs, by the names of their parts."""
    return {f"tutorial {path.stem}": path for path in TUTORIALS if path.stem != "09_many_machines"}


def parts() -> dict[str, Callable[[], str]]:
    """What there is to compute, by name."""
    from epicycle.runner.model.catalogue.packaged import packaged_disturbances

    found: dict[str, Callable[[], str]] = {"functions": functions, "functions, compiled": lambda: functions(True)}
    found["laws"] = laws
    found |= {f"model {name}": lambda name=name: run(name) for name in sorted(packaged_models())}  # type: ignore[misc]
    found |= {
        f"disturbance {name}": lambda name=name: run(DISTURBED, disturb=name)  # type: ignore[misc]
        for name in sorted(packaged_disturbances())
    }
    found["study waiting_time"] = table
    found |= {name: lambda path=path: hashed(*printed(path)) for name, path in tutorials().items()}  # type: ignore[misc]
    return found


def digests(names: list[str]) -> Iterator[tuple[str, str]]:
    """The digests of the named parts, or of all."""
    known = parts()
    for name in names or known:
        yield name, known[name]()


if __name__ == "__main__":
    for name, digest in digests(sys.argv[1:]):
        print(json.dumps([name, digest]), flush=True)
