"""Copies of the parts of a run: actors, agenda, ways of tokens, and everything that these hold.

``copy.deepcopy`` would do but for two things: it treats functions as constants, while actors of users may hold closures
over their state; and it recurses into every object, so that a chain of a thousand actors is too deep for it.  Here an
object is first created empty, and then added to a list of objects to fill.

What cannot change is not copied: numbers and texts, classes, functions without a memory, tuples and frozen dataclasses
of such things, arrays that are read-only.  Anything else is copied by Python's own protocol: ``__deepcopy__``, or the
``__reduce_ex__`` that every class has.
"""

from __future__ import annotations

import copyreg
import enum
import hashlib
import itertools
import re
import sys
import types
import typing
import weakref
from array import array
from collections import deque
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import PurePath
from typing import Any, TypeVar

import numpy as np

from epicycle.actors import CORE_MODULES, NO_TOKENS, Actor, EpicycleError, Parameter
from epicycle.actors.expression import Formula, PortFormula, TokenFormula
from epicycle.aspects import Aspect, JoinPoint

from ..results import Past

T = TypeVar("T")
_Fill = Callable[[Any, Any], None]


class CopyError(EpicycleError):
    """A part of a run that cannot be copied."""


class Copies:
    """Copies that belong together: an object that several of them refer to is copied once.

    ``shared`` are objects that the copies share with their originals.  With ``callbacks``, they include functions, and
    methods of objects outside the model, where somebody listens.  The list collects them.
    """

    def __init__(self, shared: Iterable[object] = (), callbacks: list[object] | None = None) -> None:
        self._known: dict[int, Any] = {id(thing): thing for thing in (NO_TOKENS, *shared)}
        self._kept: list[Any] = []  # originals are kept alive, so that nothing else gets their ids
        self._to_fill: list[tuple[_Fill, Any, Any, tuple[Any, str]]] = []
        self._owner: tuple[Any, str] = None, ""  # the owner of the object being copied, and the attribute
        self._callbacks = callbacks

    def of(self, thing: T) -> T:
        """The complete copy of an object; raises ``CopyError``."""
        waiting, self._to_fill = self._to_fill, []
        made: T = self._copy(thing)
        while self._to_fill:
            fill, source, target, self._owner = self._to_fill.pop()
            fill(source, target)
        self._to_fill = waiting
        return made

    def _copy(self, thing: Any) -> Any:
        cls: Any = type(thing)
        if cls in _CONSTANT:
            return thing
        known = self._known.get(id(thing), _NOTHING)
        if known is not _NOTHING:
            return known
        made = (_MAKE.get(cls) or _made_of(cls))(self, thing)
        self._known[id(thing)] = made
        self._kept.append(thing)
        return made

    def _later(self, fill: _Fill, thing: Any, made: T) -> T:
        self._known[id(thing)] = made
        self._to_fill.append((fill, thing, made, self._owner))
        return made

    # -- containers ------------------------------------------------------------------------------------------------

    def _list(self, thing: list[Any]) -> list[Any]:
        if _CONSTANT.issuperset(map(type, thing)):
            return thing.copy()
        return self._later(lambda thing, made: made.extend(map(self._copy, thing)), thing, [])

    def _set(self, thing: set[Any]) -> set[Any]:
        return self._later(lambda thing, made: made.update(map(self._copy, thing)), thing, set())

    def _dict(self, thing: dict[Any, Any]) -> dict[Any, Any]:
        if _CONSTANT.issuperset(map(type, thing)) and _CONSTANT.issuperset(map(type, thing.values())):
            return thing.copy()
        return self._later(self._fill_dict, thing, {})

    def _fill_dict(self, thing: dict[Any, Any], made: dict[Any, Any]) -> None:
        for key, value in thing.items():
            made[self._copy(key)] = self._copy(value)

    def _view(self, thing: types.MappingProxyType[Any, Any]) -> types.MappingProxyType[Any, Any]:
        inner: dict[Any, Any] = {}
        self._to_fill.append((self._fill_dict, thing, inner, self._owner))
        return types.MappingProxyType(inner)

    def _tuple(self, thing: Any) -> Any:
        items = [self._copy(item) for item in thing]
        if all(one is other for one, other in zip(items, thing, strict=True)):
            return thing
        return tuple.__new__(type(thing), items)

    def _frozen(self, thing: Any) -> Any:
        """A frozen dataclass, treated as a tuple."""
        copied = [(name, value, self._copy(value)) for name, value in _attributes(thing)]
        if all(value is other for _, value, other in copied):
            return thing
        made = _new_of(type(thing))(type(thing))
        for name, _, value in copied:
            object.__setattr__(made, name, value)
        return made

    # -- callables -------------------------------------------------------------------------------------------------

    def _is_outside(self, thing: Any) -> bool:
        if self._callbacks is None:
            return False
        self._callbacks.append(thing)
        return True

    def _function(self, thing: types.FunctionType) -> Any:
        has_memory = "<locals>" in thing.__qualname__ and (thing.__closure__ or thing.__defaults__)
        if not has_memory or self._is_outside(thing):
            return thing
        cells = tuple(map(self._copy, thing.__closure__ or ()))
        made = types.FunctionType(thing.__code__, thing.__globals__, thing.__name__, None, cells)
        made.__qualname__, made.__kwdefaults__ = thing.__qualname__, thing.__kwdefaults__
        return self._later(self._fill_function, thing, made)

    def _fill_function(self, thing: types.FunctionType, made: types.FunctionType) -> None:
        made.__defaults__ = self._copy(thing.__defaults__)
        made.__dict__.update(self._copy(thing.__dict__))

    def _cell(self, thing: Any) -> Any:
        return self._later(self._fill_cell, thing, types.CellType())

    def _fill_cell(self, thing: Any, made: Any) -> None:
        try:
            content = thing.cell_contents
        except ValueError:  # nothing assigned yet
            return
        made.cell_contents = self._copy(content)

    def _method(self, thing: Any) -> Any:
        if not isinstance(thing.__self__, (Actor, Aspect)) and self._is_outside(thing):
            return thing
        return types.MethodType(thing.__func__, self._copy(thing.__self__))

    def _built_in(self, thing: Any) -> Any:
        owner = thing.__self__
        if owner is None or isinstance(owner, types.ModuleType) or self._is_outside(thing):
            return thing
        return getattr(self._copy(owner), thing.__name__)

    def _partial(self, thing: partial[Any]) -> Any:
        keywords = {name: self._copy(value) for name, value in thing.keywords.items()}
        return partial(self._copy(thing.func), *map(self._copy, thing.args), **keywords)

    # -- objects ---------------------------------------------------------------------------------------------------

    def _array(self, thing: Any) -> Any:
        if thing.dtype.hasobject:
            return self._by_protocol(thing)
        return thing if not thing.flags.writeable and thing.base is None else thing.copy()

    def _weak(self, thing: Any) -> Any:
        there = thing()
        return thing if there is None else weakref.ref(self._copy(there))

    def _actor(self, thing: Actor) -> Any:
        """An actor; faster for one in a model, which may have thousands."""
        if self._callbacks is None:
            return self._object(thing)
        return self._later(self._fill_object, thing, thing.twin(self._known))

    def _object(self, thing: Any) -> Any:
        made = self._later(self._fill_object, thing, _new_of(type(thing))(type(thing)))
        if type(thing).__hash__ is not _HASH:  # it may look at its items right now
            self._fill_object(*self._to_fill.pop()[1:3])
        return made

    def _fill_object(self, thing: Any, made: Any) -> None:
        cls: Any = type(thing)
        owns = isinstance(thing, (Actor, JoinPoint, Aspect))
        shared: tuple[str, ...] = getattr(cls, "copies_share", ())
        descriptors, put = _descriptors(cls), object.__setattr__
        for name, value in _attributes(thing):
            if type(value) not in _CONSTANT and name not in shared:
                if owns:
                    self._owner = thing, name
                value = self._copy(value)
            if name in descriptors:
                made.__dict__[name] = value
            else:
                put(made, name, value)  # one by one, see ``_Port.bind``

    def _by_protocol(self, thing: Any) -> Any:
        """As ``copy.deepcopy`` does, for objects that define how they are copied."""
        if _is_global(thing):
            return thing
        try:
            if hasattr(thing, "__deepcopy__") and type(thing) is not np.ndarray:
                return thing.__deepcopy__(self._known)
            reduce = copyreg.dispatch_table.get(type(thing))
            reduced: Any = thing.__reduce_ex__(4) if reduce is None else reduce(thing)
            if isinstance(reduced, str):
                return thing
            make, arguments, state, items, pairs = (*reduced, None, None, None)[:5]
            made = make(*self.of(arguments))
        except CopyError:
            raise
        except Exception as error:
            raise CopyError(
                f"{_told(*self._owner)} holds a {type(thing).__qualname__}, which cannot be copied ({error}): define "
                "__deepcopy__ in its class, or name the attribute in copies_share to let copies of the run share it"
            ) from error
        # Items are taken now, while nothing changes, and added later, because they may lead here again.
        rest = state, list(items or ()), list(pairs or ())
        self._to_fill.append((self._fill_reduced, rest, made, self._owner))
        return made

    def _fill_reduced(self, reduced: tuple[Any, list[Any], list[Any]], made: Any) -> None:
        state, items, pairs = reduced
        if state is not None and hasattr(made, "__setstate__"):
            made.__setstate__(self.of(state))
        elif state is not None:
            in_dict, in_slots = state if isinstance(state, tuple) else (state, None)
            for name, value in {**(in_dict or {}), **(in_slots or {})}.items():
                object.__setattr__(made, name, self._copy(value))
        for item in items:
            made.append(self._copy(item))
        for key, value in pairs:
            made[self._copy(key)] = self._copy(value)


def _of_class(find: Callable[[Any], T]) -> Callable[[Any], T]:
    """Compute something once per class, and forget it with the class: users reload theirs."""
    known: weakref.WeakKeyDictionary[Any, T] = weakref.WeakKeyDictionary()

    def found(cls: Any) -> T:
        if (answer := known.get(cls)) is None:
            answer = known[cls] = find(cls)
        return answer

    return found


@_of_class
def _made_of(cls: Any) -> Callable[[Copies, Any], Any]:
    """The function that copies the instances of a class."""
    if issubclass(cls, _UNCHANGING):
        return lambda _, thing: thing
    if issubclass(cls, Actor):
        return Copies._actor
    if issubclass(cls, tuple) and hasattr(cls, "_fields"):
        return Copies._tuple
    if hasattr(cls, "__deepcopy__") or not _is_plain(cls):
        return Copies._by_protocol
    params = vars(cls).get("__dataclass_params__")
    return Copies._frozen if params is not None and params.frozen else Copies._object


def _is_plain(cls: type) -> bool:
    """Whether an instance consists of its attributes alone."""
    try:
        _new_of(cls)(cls)
    except TypeError:  # it has more state, known only to the class
        return False
    is_ours = all(base is object or base.__flags__ & _HEAP_TYPE or _is_compiled(base) for base in cls.__mro__)
    return is_ours and all(getattr(cls, name, None) is getattr(object, name, None) for name in _PROTOCOL)


def _is_compiled(cls: type) -> bool:
    """Whether a class belongs to the core in C: its attributes are those named in ``__slots__``, as in Python."""
    return not cls.__flags__ & _HEAP_TYPE and cls.__module__ in CORE_MODULES


@_of_class
def _new_of(cls: Any) -> Callable[[Any], Any]:
    """A function that creates an instance without attributes."""
    return next((base.__new__ for base in cls.__mro__ if _is_compiled(base)), object.__new__)


def _attributes(thing: Any) -> Iterable[tuple[str, Any]]:
    """The attributes of an object, by name."""
    cls: Any = type(thing)
    named: dict[str, Any] = getattr(thing, "__dict__", _EMPTY)
    if slots := _slots(cls):
        named = {**named, **{name: getattr(thing, name) for name in slots if hasattr(thing, name)}}
    return named.items()


@_of_class
def _slots(cls: Any) -> tuple[str, ...]:
    """The names of the slots that a class has."""
    named = [vars(base).get("__slots__", ()) for base in cls.__mro__]
    names = [name for each in named for name in ((each,) if isinstance(each, str) else each)]
    return tuple(dict.fromkeys(name for name in names if name not in ("__dict__", "__weakref__")))


@_of_class
def _descriptors(cls: Any) -> frozenset[str]:
    """The names that do not set the attribute itself."""
    return frozenset(
        name for base in cls.__mro__ for name, value in vars(base).items() if hasattr(type(value), "__set__")
    ).difference(_slots(cls))


def _is_global(thing: Any) -> bool:
    """Whether a module has the object under its own name."""
    module = sys.modules.get(getattr(thing, "__module__", None) or "")
    return getattr(module, getattr(thing, "__qualname__", ""), _NOTHING) is thing


def _told(owner: Any, attribute: str) -> str:
    """An attribute of an actor or aspect, in words."""
    if isinstance(owner, JoinPoint):
        return f"aspect {owner.aspect} at {owner.port}"
    return f"{owner.path if isinstance(owner, Actor) else type(owner).__name__}.{attribute}" if owner else "the run"


_HASH: Any = object.__hash__
_PROTOCOL = ("__reduce_ex__", "__reduce__", "__getstate__", "__setstate__", "__getnewargs__", "__getnewargs_ex__")
_HEAP_TYPE = 1 << 9  # a flag of classes made by Python code
_NOTHING: Any = object()
_EMPTY: dict[str, Any] = {}
_CONSTANT = frozenset(
    {
        type(None), bool, int, float, complex, str, bytes, type, range, slice, types.CodeType, types.ModuleType,
        object, type(Ellipsis), type(NotImplemented), re.Pattern, property, types.UnionType, types.GenericAlias,
        type(typing.Any), type(list[int] | T), type(typing.Annotated[int, 1]), np.float64, np.int64, np.bool_,
    }
)  # fmt: skip
_UNCHANGING = (type, enum.Enum, PurePath, np.dtype, np.generic, np.ufunc, Parameter, Formula, PortFormula, TokenFormula)
_MAKE: dict[type, Callable[[Copies, Any], Any]] = {
    list: Copies._list,
    deque: lambda copies, thing: copies._later(
        lambda thing, made: made.extend(map(copies._copy, thing)), thing, deque(maxlen=thing.maxlen)
    ),
    dict: Copies._dict,
    set: Copies._set,
    types.MappingProxyType: Copies._view,
    tuple: Copies._tuple,
    types.FunctionType: Copies._function,
    types.CellType: Copies._cell,
    types.MethodType: Copies._method,
    types.BuiltinMethodType: Copies._built_in,
    types.MethodWrapperType: Copies._built_in,
    partial: Copies._partial,
    np.ndarray: Copies._array,
    itertools.count: lambda _, thing: itertools.count(next(thing) + 1),  # lacks only a number that nobody needs
    weakref.ref: Copies._weak,
    array: lambda _, thing: thing[:],
    type(hashlib.sha256()): lambda _, thing: thing.copy(),
    Past: lambda _, thing: Past(thing),
}
