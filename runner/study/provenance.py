"""What results were made with: versions, machine and revision."""

from __future__ import annotations

import os
import platform
import re
import sys
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

from epicycle.actors import open_regular

PACKAGES = ("epicycle", "simpy", "numpy", "scipy", "numba", "filterpy", "networkx", "pyyaml", "pyarrow")

_REVISION = re.compile(r"[0-9a-f]{40}|[0-9a-f]{64}")
_REFERENCE = re.compile(r"refs(/(?!\.)[^/\s\x00\\]+)+")
_MOST = 2**24  # bytes of a file that are read


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
    """The revision of the repository that contains a folder; None without a repository, or if it cannot be read.

    Its files are read as they are: git itself would run programs that the repository's configuration names, and the
    folder may be somebody else's.  For the same reason, nothing says whether files have changed since; the digests of
    all files that were read are in the manifest, too.
    """
    try:
        for parent in (folder, *folder.parents):
            if (found := parent / ".git").exists():
                return _head_of(found)
    except (OSError, ValueError):
        pass
    return None


def _head_of(git: Path) -> str | None:
    """The revision that is checked out; raises ``OSError`` and ``ValueError``."""
    if git.is_file():  # of a worktree or a submodule, whose repository is elsewhere
        git = git.parent / _line(git).removeprefix("gitdir: ")
    common = git / "commondir"  # where the references of a worktree are
    shared = git / _line(common) if common.exists() else git
    found = _line(git / "HEAD")
    if _REFERENCE.fullmatch(name := found.removeprefix("ref: ")):
        packed = re.compile(rf"^([0-9a-f]+) {re.escape(name)}$", re.M)
        if (shared / name).is_file():
            found = _line(shared / name)
        elif said := packed.search(_text(shared / "packed-refs")):
            found = said[1]
    return found if _REVISION.fullmatch(found) else None


def _line(path: Path) -> str:
    return _text(path).strip()


def _text(path: Path) -> str:
    with open_regular(path) as file:
        return file.read(_MOST).decode()
