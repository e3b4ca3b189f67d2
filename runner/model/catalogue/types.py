"""Which types a model may name: Epicycle's own, those of installed packages, and the caller's.

A package offers types as entry points (``Name = "package.module:Name"``) of the groups ``epicycle.actors``,
``epicycle.aspects``, ``epicycle.figures`` and ``epicycle.study_figures``; ``epicycle.parts`` for what stands as a
value in a model, such as an ``Objective``; and dialects as those of ``epicycle.dialects``.

They are known by name and imported when a model names them. Epicycle's own names always mean Epicycle's types; if a
name is taken, or two packages offer it, ``package.Name`` selects one.  Parts go by the names of their classes alone.
"""

from __future__ import annotations

import hashlib
import re
import sys
from collections import ChainMap
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, cached_property
from importlib.metadata import EntryPoint, distributions, entry_points
from importlib.util import module_from_spec, spec_from_file_location
from inspect import isabstract, isfunction, signature
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any, Generic, TypeVar

import epicycle.actors
import epicycle.aspects
from epicycle.actors import (
    Actor,
    Configurable,
    EpicycleError,
    FaultError,
    ParameterError,
    Process,
    part_finders,
    read_regular,
)
from epicycle.aspects import Aspect, CompositeAspect, CompositeExecutionAspect, JoinPointAspect

from ..text.files import note_package
from .dialect import Dialect
from .figure import Figure, own_figures
from .packaged import unreadable

_ENTRY = re.compile(r"[A-Za-z_][\w.]*\s*:\s*[A-Za-z_][\w.]*\s*(\[.*\])?\Z", re.ASCII)

T = TypeVar("T")


def _words(base: type) -> str:
    """The name of a kind of types in a sentence."""
    return "part" if base is Configurable else re.sub(r"(?<=[a-z])(?=[A-Z])", " ", base.__name__).lower()


class CatalogueError(FaultError):
    """A type that is not available, or an ambiguous name."""

    kind = "type"

    def __init__(self, message: str, *help: str) -> None:
        super().__init__(message, help=help)
        self.args = (message, *help)  # what pickle rebuilds the error from

    def __str__(self) -> str:
        return "\n   help: ".join(self.args)


_of_packages: set[type] = set()  # types of packages


@dataclass
class _Offer:
    """A type that a package declares as an entry point."""

    point: EntryPoint
    base: type

    @cached_property
    def package(self) -> tuple[str, str] | None:
        """The package's name for pip and its version, which are read from disk."""
        return None if self.point.dist is None else (self.point.dist.name, self.point.dist.version)

    @property
    def distribution(self) -> str:
        """What pip calls the package."""
        return self.package[0] if self.package is not None else self.point.module.partition(".")[0]

    @property
    def qualified(self) -> str:
        """``package.Name``."""
        return f"{re.sub(r'[-_.]+', '_', self.distribution).lower()}.{self.point.name}"

    def load(self) -> type:
        """The type, which is imported once; raises a ``CatalogueError`` if anything goes wrong."""
        if isinstance(self.found, CatalogueError):
            raise self.found
        if self.package is not None:
            note_package(*self.package)
        return self.found

    @cached_property
    def found(self) -> type | CatalogueError:
        """The type, or what is wrong with it."""
        if not _ENTRY.match(self.point.value):
            return self._error("its entry point is not of the form package.module:Class")
        try:
            found = self.point.load()
        except (Exception, SystemExit) as error:  # a package's module may raise anything while it is imported
            return self._error(f"{type(error).__name__}: {error}")
        if not (isinstance(found, type) and issubclass(found, self.base)) or isabstract(found):
            return self._error(f"{self.point.value} is not a complete subclass of {self.base.__name__}")
        name = found.name if issubclass(found, Dialect) else found.__name__
        if name != self.point.name:
            return self._error(f"the class is called {name}, and its entry point must have the same name")
        _of_packages.add(found)
        return found

    def _error(self, reason: str) -> CatalogueError:
        return CatalogueError(
            f"{_words(self.base)} {self.point.name!r} of the package {self.distribution!r} cannot be loaded: {reason}",
            f"its entry point in the group {self.point.group} is {self.point.name} = {self.point.value}",
            f"fix or uninstall {self.distribution!r}",
        )


def _points(group: str) -> Iterable[EntryPoint]:
    """The entry points of a group; raises ``CatalogueError`` if a package has a list of them that cannot be read."""
    try:
        return entry_points(group=group)
    except Exception:  # of importlib.metadata, which does not say whose list it is
        for each in distributions():
            try:
                _ = each.entry_points
            except Exception as error:
                raise CatalogueError(
                    f"the entry points of the package {each.name!r} cannot be read: {error}",
                    f"fix or uninstall {each.name!r}",
                ) from None
        raise


@cache
def _offered(base: Any, group: str) -> dict[str, list[_Offer]]:
    """What the installed packages offer of a kind, by ``Name`` and by ``package.Name``; the search takes a while."""
    # Of two with one name, the first counts.
    offers = {(offer := _Offer(point, base)).qualified: offer for point in [*_points(group)][::-1]}
    found: dict[str, list[_Offer]] = {}
    for qualified in sorted(offers):
        found.setdefault(offers[qualified].point.name, []).append(offers[qualified])
    return found | {qualified: [offer] for qualified, offer in offers.items()}


class Types(Mapping[str, type[T]], Generic[T]):
    """Types by name; looking one up may import it, and raises ``CatalogueError`` if that fails.

    ``own`` win over those that packages offer in a ``group`` of entry points.
    """

    def __init__(self, base: type[T], own: Mapping[str, type[T]], group: str) -> None:
        self._base = base
        self._own = own
        self._group = group

    @property
    def _offers(self) -> dict[str, list[_Offer]]:
        kind: Any = self._base
        return _offered(kind, self._group)

    def __getitem__(self, name: str) -> type[T]:
        if name in self._own:
            return self._own[name]
        offers, kind = self._offers.get(name), _words(self._base)
        if offers is None:
            if self._base is Actor and name in epicycle.actors.FORMER:
                raise CatalogueError(f"there is no {kind} type {name!r} any more", epicycle.actors.FORMER[name])
            raise KeyError(name)
        if len(offers) > 1:
            packages = " and ".join(repr(each.distribution) for each in offers)
            names = " or ".join(each.qualified for each in offers)
            raise CatalogueError(f"{kind} type {name!r} is offered by the packages {packages}", f"write {names}")
        return offers[0].load()

    def __contains__(self, name: object) -> bool:
        return name in self._own or name in self._offers

    def __iter__(self) -> Iterator[str]:
        """The shortest name of each type."""
        yield from self._own
        for name, offers in self._offers.items():
            if name == offers[0].point.name:
                yield from [name] if len(offers) == 1 and name not in self._own else (each.qualified for each in offers)

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def with_types(self, own: Mapping[str, type[T]]) -> Types[T]:
        """The same with further types, which win over others with their name."""
        return Types(self._base, _with(self._own, own), self._group)


@dataclass(frozen=True)
class Catalogue:
    """Actor and aspect types by name; ``given`` are those of the caller, which win over all others."""

    actors: Mapping[str, type[Actor]]
    aspects: Mapping[str, type[Aspect]]
    given: tuple[type, ...] = ()

    def with_types(self, types: Iterable[type]) -> Catalogue:
        """The catalogue with further types, by the names of their classes; the last one with a name counts."""
        given = tuple(types)
        return replace(self._with(given), given=(*self.given, *given))

    def like(self, dialect: type[Dialect]) -> Catalogue:
        """The types that have these names under a dialect."""
        return self._with(dialect.types())._with(self.given)

    def _with(self, types: Iterable[type]) -> Catalogue:
        actors: dict[str, type[Actor]] = {}
        aspects: dict[str, type[Aspect]] = {}
        for each in types:
            if issubclass(each, Actor):
                actors[each.__name__] = each
            elif issubclass(each, Aspect):
                aspects[each.__name__] = each
            elif not issubclass(each, Configurable):  # a part, such as an Objective, is known since it was defined
                raise TypeError(f"{each.__name__} is neither an Actor nor an Aspect")
        return replace(self, actors=_with(self.actors, actors), aspects=_with(self.aspects, aspects))

    def loaded(self) -> tuple[Catalogue, list[CatalogueError]]:
        """The catalogue with every type imported, and the problems of those that are left out."""
        (actors, wrong), (aspects, wrong_too) = load_all(self.actors), load_all(self.aspects)
        return replace(self, actors=actors, aspects=aspects), [*wrong, *wrong_too]


class _Public(Mapping[str, type[T]], Generic[T]):
    """The types of a public module, some of which it imports on demand; without ``bases``."""

    def __init__(self, face: ModuleType, base: type[T], *bases: type) -> None:
        self._face = face
        self._base = base
        self._bases = (base, *bases)

    def __getitem__(self, name: str) -> type[T]:
        found = getattr(self._face, name) if name in self._face.__all__ else None
        if not isinstance(found, type) or not issubclass(found, self._base):
            raise KeyError(name)
        if found in self._bases or isabstract(found):
            raise KeyError(name)
        return found

    def __iter__(self) -> Iterator[str]:
        return (name for name in self._face.__all__ if name in self)

    def __len__(self) -> int:
        return sum(1 for _ in self)


@cache
def built_in() -> Catalogue:
    """What Epicycle's public modules offer, without bases that define no behaviour."""
    bases = (JoinPointAspect, CompositeAspect, CompositeExecutionAspect)  # types of the last two are composites
    return Catalogue(_Public(epicycle.actors, Actor, Process), _Public(epicycle.aspects, Aspect, *bases))


@cache
def installed() -> Catalogue:
    """What Epicycle and the installed packages offer."""
    own = built_in()
    return Catalogue(Types(Actor, own.actors, "epicycle.actors"), Types(Aspect, own.aspects, "epicycle.aspects"))


def with_offered(base: type[T], group: str, own: Mapping[str, type[T]]) -> Mapping[str, type[T]]:
    """Types by name, and those that installed packages offer, which are named by their entry points."""
    return Types(base, {name: cls for name, cls in own.items() if cls not in _of_packages}, group)


def _import_part(name: str) -> None:
    """Import the parts of a name that installed packages offer; raises ``ParameterError`` if that fails."""
    try:
        Types(Configurable, {}, "epicycle.parts").get(name)
    except CatalogueError as error:
        raise ParameterError("; ".join((error.message, *error.help))) from None


part_finders.append(_import_part)


def figure_types() -> Mapping[str, type[Figure]]:
    """The figures that a model may use, by name."""
    return with_offered(Figure, "epicycle.figures", own_figures())


def _with(types: Mapping[str, type[T]], more: Mapping[str, type[T]]) -> Mapping[str, type[T]]:
    """Types by name, with more of them, which win; none is imported for that."""
    if isinstance(types, Types):
        return types.with_types(more)
    known: Any = types
    return ChainMap({**more}, known) if more else types


def load_all(types: Mapping[str, type[T]]) -> tuple[dict[str, type[T]], list[CatalogueError]]:
    """All types that can be imported, and the problems of the others."""
    found, errors = {}, []
    for name in types:
        try:
            found[name] = types[name]
        except CatalogueError as error:
            errors.append(error)
    return found, errors


_functions: dict[str, Callable[..., Any]] = {}


def given_functions() -> Mapping[str, Callable[..., Any]]:
    """The functions of files that the user has named (``types_of_file``), as ``module.name``.

    Those that have a parameter ``env``: they are written for SimPy.
    """
    return MappingProxyType(_functions)


PROGRAM = ".fmu"  # the ending of a file that is a program, which an actor runs

_programs: set[str] = set()


def given_programs() -> Collection[str]:
    """The SHA-256 of each program that the user has named (``types_of_file``): no other one may run."""
    return frozenset(_programs)


class TypesError(EpicycleError):
    """A file that provides no types."""


def types_of_file(path: Path) -> list[type]:
    """The actors, aspects and parts that a Python file defines; its code is run, as by ``import``.

    Its functions for SimPy become known, too (``given_functions``).  An FMU has no types: naming it lets it run
    (``given_programs``).  Raises ``TypesError``.
    """
    if path.suffix == PROGRAM:
        try:
            _programs.add(hashlib.sha256(read_regular(path)).hexdigest())
        except OSError as error:
            raise TypesError(f"--types {path}: {error.strerror or error}") from None
        return []
    module = _imported(path)
    found = [
        each
        for name, each in vars(module).items()
        if isinstance(each, type)
        and issubclass(each, Configurable)
        and each.__module__ == module.__name__
        and not name.startswith("_")
        and not isabstract(each)
    ]
    functions = {
        f"{module.__name__}.{name}": each
        for name, each in vars(module).items()
        if isfunction(each) and each.__module__ == module.__name__ and "env" in signature(each).parameters
    }
    _functions.update(functions)
    if not found and not functions:
        raise TypesError(
            f"--types {path}: the file defines no actor, no aspect, no part such as an Objective, and no function with "
            "a parameter 'env'"
        )
    return found


def _imported(path: Path) -> ModuleType:
    if path.suffix != ".py" or not path.stem.isidentifier():
        raise TypesError(f"--types {path}: expected a Python file such as my_actors.py, or an FMU")
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
    # The file can import its neighbours, as when Python runs a script.
    sys.path.insert(0, str(file.parent))
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException as error:  # the user's module may raise anything
        sys.modules.pop(name, None)
        if type(error) is KeyboardInterrupt:  # Ctrl-C
            raise
        raise TypesError(f"--types {path}: {type(error).__name__}: {error}{_line(error, file)}") from error
    finally:
        with suppress(ValueError):
            sys.path.remove(str(file.parent))
    return module


def _line(error: BaseException, file: Path) -> str:
    """Where in the file it went wrong; a syntax error already contains that."""
    lines = []
    trace = error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == str(file):
            lines.append(trace.tb_lineno)
        trace = trace.tb_next
    return f" (line {lines[-1]})" if lines else ""
