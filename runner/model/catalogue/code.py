"""The files whose code runs when types of the user's own are loaded."""

from __future__ import annotations

import hashlib
import sys
import sysconfig
from collections.abc import Iterable
from modulefinder import ModuleFinder
from pathlib import Path

from epicycle.actors import read_regular

from .types import PROGRAM, TypesError


def code_of(types: Iterable[Path]) -> dict[str, str]:
    """SHA-256 of the files and of all modules of the user's own that they import, by their full paths; none is run.

    Installed packages are known by their versions instead.
    """
    installed = {Path(path).resolve() for path in sysconfig.get_paths().values()}
    own = [path for path in sys.path if Path(path).is_dir() and not _is_below(Path(path).resolve(), installed)]
    found: dict[str, str] = {}
    for each in types:
        file = each.resolve()
        if file.suffix == PROGRAM:
            try:
                found[str(file)] = hashlib.sha256(read_regular(file)).hexdigest()
            except OSError as error:
                raise TypesError(f"--types {each}: {error.strerror or error}") from error
            continue
        finder = ModuleFinder(path=[str(file.parent), *own], excludes=["epicycle"])
        try:
            finder.run_script(str(file))
            names = [str(file), *sorted(one.__file__ for one in finder.modules.values() if one.__file__ is not None)]  # type: ignore[attr-defined]
            found |= {name: hashlib.sha256(read_regular(name)).hexdigest() for name in names}
        except (OSError, SyntaxError, ValueError) as error:
            raise TypesError(f"--types {each}: {getattr(error, 'strerror', None) or error}") from error
    return found


def _is_below(path: Path, folders: Iterable[Path]) -> bool:
    return any(path.is_relative_to(folder) for folder in folders)
