"""The examples of SimPy's own source distribution, unchanged but for where ``env`` comes from.

They are not in this repository: they are taken from the folder that EPICYCLE_SIMPY_SDIST names, or downloaded.

    python -m benchmarks.truth.programs NAME    what an example prints on Epicycle's director
"""

from __future__ import annotations

import contextlib
import io
import os
import subprocess
import sys
import tarfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

from epicycle.bridges import Environment

MADE = "env = simpy.Environment()"


@cache
def examples() -> Path | None:
    """The folder of the examples; None if they are not to be had."""
    folder = Path(os.environ.get("EPICYCLE_SIMPY_SDIST") or mkdtemp(prefix="simpy"))
    if not any(folder.rglob("bank_renege.py")):
        words = ["download", "--quiet", "--no-deps", "--no-binary", "simpy", "--dest", str(folder), "simpy>=4.1,<5"]
        done = subprocess.run([sys.executable, "-m", "pip", *words], capture_output=True, check=False)
        if done.returncode:
            return None
        with tarfile.open(next(folder.glob("simpy-*.tar.gz"))) as archive:
            archive.extractall(folder, filter="data")
    return next(folder.rglob("bank_renege.py")).parent


def published(name: str) -> list[str]:
    """The lines that an example prints, as SimPy publishes them."""
    folder = examples()
    if folder is None:
        raise SystemExit("SimPy's source distribution cannot be downloaded; EPICYCLE_SIMPY_SDIST may name its folder")
    return (folder / f"{name}.out").read_text(encoding="utf-8").splitlines()


def printed(name: str, made: Callable[[], Any] = Environment, change: Callable[[str], str] = str) -> list[str]:
    """The lines that an example prints with another environment, after another change of its text, if any."""
    folder = examples()
    assert folder is not None
    text = (folder / f"{name}.py").read_text(encoding="utf-8")
    if MADE not in text:
        raise ValueError(f"{name} does not make its environment by '{MADE}'")
    names: dict[str, Any] = {"__name__": "__main__", "made": made}
    with contextlib.redirect_stdout(io.StringIO()) as out:
        exec(compile(change(text.replace(MADE, "env = made()")), name, "exec"), names)
    return out.getvalue().splitlines()


if __name__ == "__main__":
    print("\n".join(printed(sys.argv[1])))
