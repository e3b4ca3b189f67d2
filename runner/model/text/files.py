"""Files that a model names: relative to where the name is written, and never outside that folder; and what was read."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from epicycle.actors import ParameterError, check_allowed, did_you_mean, irregular, read_regular

from .problems import Position

COMMAND_LINE = "command line"  # the file of a position in an option


@dataclass
class Opened:
    """Texts read in place of files, by their resolved paths, and everything that is read, by its name in messages.

    ``parsed`` are the latest texts without problems by the same names, and what they hold: several passes read them.
    """

    texts: Mapping[Path, str]
    parsed: dict[str, tuple[str, Any]]
    read: dict[str, tuple[Path, str]] = field(default_factory=dict)


_opened: ContextVar[Opened | None] = ContextVar("opened", default=None)


@contextmanager
def opened(texts: Mapping[Path, str], parsed: dict[str, tuple[str, Any]] | None = None) -> Iterator[Opened]:
    """Texts that are read in place of files, such as those of an editor; what is ``parsed`` is kept there."""
    found = Opened(texts, {} if parsed is None else parsed)
    token = _opened.set(found)
    try:
        yield found
    finally:
        _opened.reset(token)


def opened_text(path: Path) -> str | None:
    """The text that is open in place of a file, if there is one."""
    if (found := _opened.get()) is None:
        return None
    try:
        return found.texts.get(path.resolve())
    except (OSError, RuntimeError, ValueError):  # endless links, too long a name
        return None


def present() -> Opened | None:
    """What is known of the texts that are read for whoever opened others."""
    return _opened.get()


@dataclass
class Noted:
    """What loading a model has read."""

    files: dict[str, str] = field(default_factory=dict)  # SHA-256 by path
    packages: dict[str, str] = field(default_factory=dict)  # versions of packages whose types it names


_noted: ContextVar[Noted | None] = ContextVar("noted", default=None)


@contextmanager
def noting() -> Iterator[Noted]:
    """What loading models reads, filled while it reads; a caller that notes gets it, too."""
    found, outer = Noted(), _noted.get()
    token = _noted.set(found)
    try:
        yield found
    finally:
        _noted.reset(token)
        if outer is not None:
            outer.files |= found.files
            outer.packages |= found.packages


def note_file(path: Path, data: bytes) -> None:
    if (noted := _noted.get()) is not None:
        noted.files[str(path)] = hashlib.sha256(data).hexdigest()


def digest_of(name: str) -> str:
    """The SHA-256 of a file, as it is noted; empty if it cannot be read."""
    try:
        return hashlib.sha256(read_regular(name)).hexdigest()
    except OSError:
        return ""


def note_package(name: str, version: str) -> None:
    if (noted := _noted.get()) is not None:
        noted.packages[name] = version


def data_file(name: Path, position: Position) -> Path:
    """The file with that name; raises ``ParameterError`` if there is none, or if the model may not read it.

    A name in a YAML file means a file in or below the folder of that YAML file, so that a model can be moved with its
    data and cannot read anything else.  A name on the command line comes from the user: it is relative to the working
    directory and may lead anywhere.
    """
    folder = Path(position.file).parent
    target = name if position.file == COMMAND_LINE else folder / name
    try:
        if position.file != COMMAND_LINE and not target.resolve().is_relative_to(folder.resolve()):
            raise ParameterError(
                f"{str(name)!r} cannot be read: a file named in a model must be in or below the folder of its YAML file"
            )
        if target.is_file():
            check_allowed(target)
            if _noted.get() is not None:
                note_file(target, read_regular(target))
            return target
        if target.exists():
            raise ParameterError(f"{str(name)!r} is {irregular(target)}")
        beside = (
            sorted(str(name.parent / each.name) for each in target.parent.iterdir()) if target.parent.is_dir() else []
        )
    except (OSError, RuntimeError, ValueError) as error:  # endless links, too long a name
        raise ParameterError(f"{str(name)!r} cannot be read: {getattr(error, 'strerror', None) or error}") from None
    raise ParameterError(f"there is no file {str(name)!r}{did_you_mean(str(name), beside)}")
