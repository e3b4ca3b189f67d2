"""Parameters, declared once: type, unit, default, bounds and doc feed the constructor, checks and the reference."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from keyword import iskeyword
from pathlib import Path
from types import MappingProxyType, UnionType
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypedDict, TypeVar, Unpack, overload
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from .errors import Fault, ParameterError
from .messages import bounds_text, brief, did_you_mean, digits, nearest
from .quantity import MAX_DEPTH, Quantity, counted_in_si, is_too_deep
from .units import UnitError, convert, in_si, quantity
from .variants import variant_of, variants

T = TypeVar("T")
V = TypeVar("V")

if TYPE_CHECKING:

    class Bounds(TypedDict, total=False):
        """What a declaration may say besides type and default."""

        unit: str
        min: float | None
        above: float | None
        max: float | None
        choices: Sequence[str]
        renamed: Mapping[str, str]
        doc: str

    class Options(Bounds, total=False):
        """The same, and the shape of a list."""

        shape: tuple[int | None, ...] | None


class _Required:
    """The default of a parameter that has none."""

    def __repr__(self) -> str:
        return "required"


REQUIRED: Any = _Required()
_EXACT = 2**53  # up to here, all whole numbers are exact as floats
_WORDS: dict[Any, str] = {
    float: "number",
    int | float: "number",
    int: "integer",
    bool: "true or false",
    str: "text",
    Path: "file",
    object: "any value",
}


_INSTEAD = (
    "take float, int, bool, str, Path, object or a Configurable class; for a list of numbers Parameter(float, "
    "shape=(None,)), for an array array_parameter((None,)), for texts texts_parameter(), for any list or mapping "
    "Parameter(object)"
)


def _check_type(given: Any) -> None:
    """Raise ``TypeError`` for what is not a type of parameters, with what to write instead."""
    if not (isinstance(given, type) and issubclass(given, Configurable)) and given not in _WORDS:
        name = given.__name__ if type(given) is type else str(given)
        raise TypeError(f"a parameter cannot have the type {name}: {_INSTEAD}")


class Parameter(Generic[T]):
    """A declared parameter: on an instance it reads as its value, on the class as itself.

    ``type`` is ``float``, ``int``, ``bool``, ``str``, ``Path``, ``object`` (any value that YAML can write, for tokens)
    or a ``Configurable`` class (the value is then a mapping with a ``type`` key that names one of its subclasses).  A
    number may come as text with a unit (``"8 m/s"``); it is converted to ``unit``, which is ``"1"`` for a pure number.
    A parameter without a unit has that of the tokens, and a value with a unit is converted to SI units; the ``unit`` of
    a ``Configurable`` class applies to the parameters in it that have none.  ``shape`` makes it an array of floats:
    ``(2,)`` a pair, ``(None, 2)`` rows of pairs; with ``str`` and ``object``, ``(None,)`` is a tuple.  ``int | float``
    is a number that stays an integer if it is one.
    A text is one of ``choices``; ``renamed`` gives the present names of former ones.
    Numbers are at least ``min``, or else greater than ``above``, and at most ``max``.
    A parameter that accepts values of several kinds has one parameter for each kind as its ``forms``.
    """

    # What it reads as, for type checkers: also as None, if that is the default or it is optional.
    @overload
    def __init__(self: Parameter[V | None], type: type[V], default: None, **options: Unpack[Options]) -> None: ...
    @overload
    def __init__(
        self: Parameter[V | None],
        type: type[V],
        default: V = ...,
        *,
        optional: bool,
        **options: Unpack[Options],
    ) -> None: ...
    @overload
    def __init__(self: Parameter[V], type: type[V], default: V = ..., **options: Unpack[Options]) -> None: ...
    @overload
    def __init__(self: Parameter[float | None], type: UnionType, default: None, **options: Unpack[Options]) -> None: ...
    @overload
    def __init__(self: Parameter[float], type: UnionType, default: float = ..., **options: Unpack[Options]) -> None: ...
    def __init__(
        self,
        type: Any,
        default: Any = REQUIRED,
        *,
        unit: str = "",
        min: float | None = None,
        above: float | None = None,
        max: float | None = None,
        choices: Sequence[str] = (),
        renamed: Mapping[str, str] | None = None,
        shape: tuple[int | None, ...] | None = None,
        optional: bool = False,
        doc: str = "",
    ) -> None:
        if self.__class__ is Parameter:  # others describe their types themselves
            _check_type(type)
        self.type: Any = type
        self.default: T | None = default
        self.unit = unit
        self.min = min
        self.above = above
        self.max = max
        self.choices = tuple(choices)
        self.renamed = dict(renamed or {})
        self.shape = shape
        self.optional = optional or default is None
        self.doc = doc
        self.name = ""
        self.forms: tuple[Parameter[Any], ...] = ()

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name.rstrip("_")  # `from_` is the parameter 'from', as keywords of Python cannot be names

    @overload
    def __get__(self, instance: None, owner: type) -> Parameter[T]: ...
    @overload
    def __get__(self, instance: object, owner: type) -> T: ...
    def __get__(self, instance: object | None, owner: type) -> Parameter[T] | T:
        # Values are in the instance's __dict__, which Python looks up before this; only the class gets here, and a
        # parameter named like a keyword.
        if instance is None:
            return self
        if self.name in instance.__dict__:
            value: T = instance.__dict__[self.name]
            return value
        raise AttributeError(f"{owner.__name__}.{self.name} was read before it was set")

    def store(self, instance: object, value: T | None) -> None:
        """Give an instance its value."""
        setattr(instance, self.name, value)

    def value_in(self, instance: object) -> T | None:
        """The value that an instance was given."""
        value: T | None = vars(instance).get(self.name)
        return value

    @property
    def required(self) -> bool:
        """Whether a value must be given."""
        return self.default is REQUIRED

    @cached_property
    def default_value(self) -> T | None:
        """The default as stored in an instance."""
        default = self.default
        return default if default is None or isinstance(default, Configurable) else self.convert(default)

    def describe_type(self) -> str:
        """The type in words, for messages and the reference."""
        if isinstance(self.type, type) and issubclass(self.type, Configurable):
            return " or ".join(sorted(variants(self.type)))
        word = _WORDS[self.type]
        if self.shape is None:
            return word
        if self.type in (str, object):
            return "list of texts" if self.type is str else "list of values"
        sizes = " x ".join("n" if size is None else str(size) for size in self.shape)
        return f"list of {sizes} {word}s"

    def in_unit(self, unit: str) -> Parameter[T]:
        """The same parameter, in this unit if it has none."""
        if self.unit or self.type not in (float, int | float):
            return self
        changed = type(self).__new__(type(self))
        vars(changed).update(vars(self))
        changed.unit = unit
        return changed

    def convert(self, value: object) -> T | None:
        """The value to be stored; raises ``ParameterError`` with a message that follows 'NAME: '."""
        if value is None:
            if self.optional:
                return None
            raise ParameterError(f"a value is missing, expected {self._expected()}")
        result: Any
        if isinstance(self.type, type) and issubclass(self.type, Configurable):
            result = build_variant(self.type, value, self.unit)
        elif self.shape is None:
            result = self._scalar(value)
        elif self.type in (str, object):
            is_single = self.type is str and isinstance(value, str)
            result = (value,) if is_single else tuple(self._rows(value, self.shape, value))
        else:
            result = self._array(value)
        return result  # type: ignore[no-any-return]

    def _expected(self) -> str:
        text = self.describe_type()
        if self.choices:
            return f"one of {', '.join(self.choices)}"
        if text in ("number", "integer", "text", "file") or self.shape is not None:
            text = f"an {text}" if text == "integer" else f"a {text}"
        if self.unit and self.unit != "1":
            text += f" in {self.unit}"
        if self.min is not None and self.max is not None:
            return f"{text} from {digits(self.min)} to {digits(self.max)}"
        return text + bounds_text(self.min, self.above, self.max, digits)

    def _scalar(self, value: object) -> object:
        if self.type is object:
            if is_too_deep(value):
                raise ParameterError(f"nested deeper than {MAX_DEPTH} levels")
            return counted_in_si(value)
        if self.type is Path:
            if isinstance(value, (str, Path)) and str(value) and "\0" not in str(value):
                return Path(value)
        elif self.type is bool:
            if isinstance(value, (bool, np.bool_)):
                return bool(value)
        elif self.type is str:
            if isinstance(value, str):
                if value in self.renamed:
                    raise ParameterError(f"{value!r} is now called {self.renamed[value]!r}")
                if self.choices and value not in self.choices:
                    message = f"{value!r} is not {self._expected()}{did_you_mean(value, self.choices)}"
                    raise ParameterError(message, kind="choice", meant=nearest(value, self.choices) or "")
                return value
        elif isinstance(value, (int, float, np.integer, np.floating, str)) and not isinstance(value, bool):
            return self._bounded(self._number(value))
        hints = [f"the choices are texts: write '{brief(value)}' in quotes"] if brief(value) in self.choices else []
        raise ParameterError(f"{brief(value)} is not {self._expected()}", help=hints)

    def _number(self, value: Any) -> float | int:
        unit = self.unit or ("1" if self.type is int and isinstance(value, Quantity) else "")
        try:
            if isinstance(value, str):
                found = self._read(value)
                if found is None:
                    raise ParameterError(f"{brief(value)} is not {self._expected()}")
                value = found
            elif isinstance(value, Quantity):
                value = value.to(unit) if unit else value.si
        except UnitError as error:
            raise ParameterError(str(error), kind="unit", meant=self._in_right_unit(value, error)) from None
        try:
            number = float(value)
        except OverflowError:
            raise ParameterError(f"{brief(value)} is too large, expected {self._expected()}") from None
        if self.type is float or (self.type is not int and not isinstance(value, (int, np.integer))):
            return number
        if not number.is_integer():  # nor are nan and the infinities
            raise ParameterError(f"{brief(value)} is not {self._expected()}")
        return int(value)

    def _in_right_unit(self, value: object, error: UnitError) -> str:
        """A text with its unit as it is spelled right, or else with the parameter's; empty if it has no number."""
        found = quantity(value) if isinstance(value, str) else None
        if found is None:
            return ""
        number = str(value).removesuffix(found[1]).strip()
        return f"{number} {error.faults[0].meant or self.unit}" if self.unit not in ("", "1") else ""

    def _read(self, text: str) -> float | None:
        """The number of a text with a unit; None if it is not one."""
        if self.unit in ("", "1") and quantity(text) is None:
            return None
        if self.unit:
            return convert(text, self.unit)
        return None if self.type is int else in_si(text)

    def _bounded(self, value: float | int) -> float | int:
        if math.isnan(value):
            raise ParameterError(f"nan is not {self._expected()}")
        if not self._holds(value, value):
            raise ParameterError(f"{digits(value)} is out of bounds, expected {self._expected()}")
        if self.above == 0 and self.unit == "s" and value < 1e-9:
            raise ParameterError(f"{digits(value)} s is shorter than a nanosecond, the shortest time")
        return value

    def _holds(self, low: float, high: float) -> bool:
        """Whether all numbers from one to another are within bounds."""
        return (
            (self.min is None or low >= self.min)
            and (self.above is None or low > self.above)
            and (self.max is None or high <= self.max)
        )

    def _array(self, value: object) -> NDArray[np.float64]:
        assert self.shape is not None
        rows = value if self._is_plain_row(value) else self._rows(value, self.shape, value)
        array = np.array(rows, dtype=float)
        if array.size == 0:
            array = array.reshape([0 if size is None else size for size in self.shape])
        array.flags.writeable = False
        return array

    def _is_plain_row(self, value: object) -> bool:
        """Whether this is a list of plain numbers within bounds: the common case, and lists may be long."""
        if self.shape != (None,) or self.type is not float or not isinstance(value, (list, tuple)):
            return False
        if not value or not {float, int}.issuperset(map(type, value)):
            return False
        if any(isinstance(each, int) and abs(each) > _EXACT for each in value) or any(map(math.isnan, value)):
            return False
        return self._holds(min(value), max(value))

    def _rows(self, value: Any, shape: tuple[int | None, ...], whole: object) -> Any:
        if not shape:
            return self._scalar(value)
        if not isinstance(value, (list, tuple, np.ndarray)) or shape[0] not in (None, len(value)):
            raise ParameterError(f"{brief(whole)} is not {self._expected()}")
        return [self._rows(item, shape[1:], whole) for item in value]


class Configurable:
    """Base of everything with declared parameters: actors, aspects and their parts."""

    # Keys that YAML uses beside parameters; no parameter may have these names.
    reserved: ClassVar[frozenset[str]] = frozenset({"type", "count", "priority", "tags", "inherit"})
    # Inherited parameters that would do nothing: 'inherit: all' of a model leaves them out.
    unused: ClassVar[tuple[str, ...]] = ()
    # What messages call one of a class whose name no text says, such as 'a transition': its parameters are keys.
    written_as: ClassVar[str] = ""
    # Advice for names that might be mistaken for parameters.
    refused: ClassVar[Mapping[str, str]] = {}
    # Attributes that its copies, for a run or a snapshot, share with it.
    copies_share: ClassVar[tuple[str, ...]] = ()

    def __init__(self, /, **values: object) -> None:  # of which one may be called 'self', by mistake
        self._configure(values)
        self.check()

    def check(self) -> None:
        """Called when each parameter is valid by itself; raises ``ParameterError`` if they do not fit together.

        Set here what follows from the parameters, such as the type of a port.
        """

    def _configure(self, values: Mapping[str, object]) -> None:
        declared = declared_parameters(type(self))
        # `from_=3` in Python, where `from` is a keyword.
        values = {name[:-1] if iskeyword(name[:-1]) else name: value for name, value in values.items()}
        for name in values:
            if name not in declared:
                has_guess = name not in self.refused and bool(did_you_mean(name, declared))  # which ends a sentence
                noun = "keys" if self.written_as else "parameters"
                valid = f"{'' if has_guess else ';'} valid {noun}: {', '.join(declared) or 'none'}"
                raise ParameterError(
                    unknown_parameter(type(self), name) + valid,
                    (name,),
                    of_key=True,
                    kind="parameter",
                    meant=nearest(name, declared) or "",
                )
        faults: list[Fault] = []
        for name, parameter in declared.items():
            if name not in values:
                if parameter.required:
                    faults.append(Fault(f"{self.written_as or type(self).__name__} needs a value for {name!r}"))
                else:
                    parameter.store(self, parameter.default_value)
                continue
            try:
                parameter.store(self, parameter.convert(values[name]))
            except ParameterError as error:
                faults += _within(type(self), name, error)
        if faults:
            raise ParameterError.several(faults)

    def __init_subclass__(cls, **keywords: object) -> None:
        super().__init_subclass__(**keywords)
        for name, value in vars(cls).items():
            if isinstance(value, Parameter) and name in cls.reserved:
                raise TypeError(f"{cls.__name__}: a parameter must not be named {name!r}")

    def __repr__(self) -> str:
        """The parameters that were given a value."""
        values = ", ".join(
            f"{name}={parameter.value_in(self)!r}"
            for name, parameter in declared_parameters(type(self)).items()
            if parameter.required or parameter.value_in(self) is not parameter.default_value
        )
        return f"{type(self).__name__}({values})"


_declared: WeakKeyDictionary[type, Mapping[str, Parameter[Any]]] = WeakKeyDictionary()


def declared_parameters(cls: type) -> Mapping[str, Parameter[Any]]:
    """The parameters of a class by name, its own before those of its bases."""
    if (known := _declared.get(cls)) is not None:  # asked for every instance of a class
        return known
    found: dict[str, Parameter[Any]] = {}
    for base in cls.__mro__:
        for value in vars(base).values():
            if isinstance(value, Parameter):
                found.setdefault(value.name, value)
    return _declared.setdefault(cls, MappingProxyType(found))


def unknown_parameter(cls: type, name: str) -> str:
    """The message for a parameter that the class does not have."""
    if issubclass(cls, Configurable) and name in cls.refused:
        return cls.refused[name]
    written = getattr(cls, "written_as", "")
    what = f"{written} has no key" if written else f"{cls.__name__} has no parameter"
    return f"{what} {name!r}{did_you_mean(name, declared_parameters(cls))}"


def build_variant(base: type, value: object, unit: str = "") -> object:
    """Make one of the variants of ``base`` from a mapping with a ``type`` key; an instance is returned as it is.

    Parameters of the variant without a unit have the given ``unit``.
    """
    if isinstance(value, base):
        return value
    cls, values = variant_of(base, value)
    declared = declared_parameters(cls)
    for key in [key for key in values if unit and key in declared]:
        try:
            values[key] = declared[key].in_unit(unit).convert(values[key])
        except ParameterError as error:
            raise ParameterError.several(_within(cls, key, error)) from None
    return cls(**values)


def _within(cls: type, name: str, error: ParameterError) -> list[Fault]:
    """The faults of a parameter of something that is itself a value."""
    return error.within(name, prefix=f"{cls.__name__}.{name}: ")
