"""What results were made with: versions, machine, revision."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

PACKAGES = ("epicycle", "simpy", "numpy", "scipy", "numba", "filterpy", "networkx", "pyyaml", "pyarrow")


def versions() -> dict[str, Any]:
    """The versions of Python and of all that takes part in a run."""
    found: dict[str, Any] = {"python": platform.python_version(), "platform": sys.platform}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = None
    return found


def machine() -> dict[str, Any]:
    """The computer."""
    return {"system": platform.platform(), "processor": platform.machine(), "cores": os.cpu_count()}


def git_revision(folder: Path) -> str | None:
    """The revision of the repository in which a folder lies, with a + for changes; None without one."""
    try:
        revision, changes = (
            subprocess.run(
                ["git", "-C", str(folder), *words], capture_output=True, text=True, check=True, timeout=10
            ).stdout
            for words in (("rev-parse", "HEAD"), ("status", "--porcelain", "--untracked-files=no"))
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return revision.strip() + ("+" if changes.strip() else "")
