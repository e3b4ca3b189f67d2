"""The commands that installed packages offer as entry points (``name = "package.module:command"``)."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from importlib.metadata import EntryPoint, entry_points
from typing import TYPE_CHECKING

from ...support.printing import complain
from .options import Command

if TYPE_CHECKING:
    import argparse

GROUP = "epicycle.commands"


def offered_commands() -> Iterator[Command]:
    """Each of them, by name; one that cannot be had says why when it is called, and leaves the others in peace."""
    points: dict[str, list[EntryPoint]] = {}
    try:
        for each in entry_points(group=GROUP):
            points.setdefault(each.name, []).append(each)
    except Exception as error:  # of importlib.metadata, when one of the packages has a list that cannot be read
        complain(f"warning: the commands of installed packages cannot be read: {error}")
        return
    for name, found in sorted(points.items()):
        packages = " and ".join(sorted(f"{_package(each)!r}" for each in found))
        if len(found) > 1:
            yield _without(name, f"is offered by the packages {packages}: uninstall one of them")
            continue
        try:
            command = found[0].load()
        except (Exception, SystemExit) as error:  # a package's module may raise anything while it is imported
            yield _without(name, f"of the package {packages} cannot be loaded: {type(error).__name__}: {error}")
            continue
        if not isinstance(command, Command) or command.name != name:
            expected = f"expected a Command that is called {name!r}"
            yield _without(name, f"of the package {packages} cannot be used: {found[0].value}: {expected}")
            continue
        yield command


def _package(point: EntryPoint) -> str:
    return point.dist.name if point.dist is not None else point.module.partition(".")[0]


def _without(name: str, reason: str) -> Command:
    """A command that only says why it cannot be had."""
    message = f"command {name!r} {reason}"
    return Command(name, "(cannot be loaded)", message, (), (), partial(_fail, message))


def _fail(message: str, options: argparse.Namespace) -> int:
    from epicycle.actors import EpicycleError

    raise EpicycleError(message)
