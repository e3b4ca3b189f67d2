"""The Python files of a user's types: results depend on them, and a results folder that was sent names them."""

from __future__ import annotations

import sys
import sysconfig
from collections.abc import Iterable
from modulefinder import ModuleFinder
from pathlib import Path


def code_files(file: Path) -> list[Path]:
    """A Python file, and those beside it that it imports, directly or not.  None of them is run."""
    file = file.resolve()
    if file.parent in {Path(path).resolve() for path in sysconfig.get_paths().values()}:
        return [file]  # beside an installed module there are unrelated ones
    finder = ModuleFinder(path=[str(file.parent)])
    finder.run_script(str(file))
    found = (getattr(module, "__file__", None) for module in finder.modules.values())
    return sorted({file, *(Path(name).resolve() for name in found if name is not None)})


def files_of_types(types: Iterable[type]) -> list[Path]:
    """The files of the code of types that are not Epicycle's own."""
    names = dict.fromkeys(each.__module__ for each in types if each.__module__.partition(".")[0] != "epicycle")
    files = (getattr(sys.modules.get(name), "__file__", None) for name in names)
    return sorted({each for file in files if file is not None for each in code_files(Path(file))})
