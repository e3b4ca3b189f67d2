"""What results were made with: versions, machine and revision."""

from __future__ import annotations

import os
import platform
import re
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

PACKAGES = ("epicycle", "simpy", "numpy", "scipy", "numba", "filterpy", "networkx", "pyyaml", "pyarrow")


def version_of(package: str) -> str | None:
    """The version of an installed package; None if it is missing, or is run from its folder."""
    try:
        found = distribution(package)
    except PackageNotFoundError:
        return None
    # Only this field: reading all of them with the description takes ten times as long.
    field = re.search(r"^Version: *(\S+)", found.read_text("METADATA") or "", re.M)
    return field[1] if field is not None else found.version


def versions() -> dict[str, str | None]:
    """The versions of Python and of everything that takes part in a run."""
    found = {"python": platform.python_version(), "platform": sys.platform}
    return {**found, **{package: version_of(package) for package in PACKAGES}}


def machine() -> dict[str, Any]:
    """The computer."""
    return {"system": platform.platform(), "processor": platform.machine(), "cores": os.cpu_count()}


def git_revision(folder: Path) -> str | None:
    """The revision of the repository that contains a folder, with a + for changes; None without a repository."""
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
