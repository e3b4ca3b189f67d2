"""Actors and aspects of a Python file that the user names on the command line; a model file cannot do that."""

from __future__ import annotations

import sys
from contextlib import suppress
from importlib.util import module_from_spec, spec_from_file_location
from inspect import isabstract
from pathlib import Path
from types import ModuleType

from epicycle.actors import Actor, EpicycleError
from epicycle.aspects import Aspect

from .packaged import unreadable


class TypesError(EpicycleError):
    """A file from which no types can be had."""


def types_of_file(path: Path) -> list[type]:
    """The actors and aspects that a Python file defines; its code is run, as ``import`` would.

    Raises ``TypesError``.
    """
    module = _imported(path)
    found = [
        each
        for name, each in vars(module).items()
        if isinstance(each, type)
        and issubclass(each, (Actor, Aspect))
        and each.__module__ == module.__name__
        and not name.startswith("_")
        and not isabstract(each)
    ]
    if not found:
        raise TypesError(f"--types {path}: the file defines no actor and no aspect")
    return found


def _imported(path: Path) -> ModuleType:
    if path.suffix != ".py" or not path.stem.isidentifier():
        raise TypesError(f"--types {path}: expected a Python file such as my_actors.py")
    if reason := unreadable(path):
        raise TypesError(f"--types {path}: this {reason}")
    if reason is None:
        raise TypesError(f"--types {path}: there is no such file")
    file, name = path.resolve(), path.stem
    known = sys.modules.get(name)
    if known is not None:
        if Path(getattr(known, "__file__", None) or "").resolve() == file:
            return known
        raise TypesError(f"--types {path}: another module is called {name!r}; give the file another name")
    spec = spec_from_file_location(name, file)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    # What stands beside the file can be imported from it, as when Python runs a script.
    sys.path.insert(0, str(file.parent))
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException as error:  # whatever the user's module does
        sys.modules.pop(name, None)
        if type(error) is KeyboardInterrupt:  # Ctrl-C
            raise
        raise TypesError(f"--types {path}: {type(error).__name__}: {error}{_line(error, file)}") from error
    finally:
        with suppress(ValueError):
            sys.path.remove(str(file.parent))
    return module


def _line(error: BaseException, file: Path) -> str:
    """Where in the file it went wrong; a syntax error says so itself."""
    lines = []
    trace = error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == str(file):
            lines.append(trace.tb_lineno)
        trace = trace.tb_next
    return f" (line {lines[-1]})" if lines else ""
