"""Computed outputs: Expression, Function, LookupTable."""

from __future__ import annotations

import inspect
import math
import typing
from bisect import bisect_right
from collections.abc import Callable, Mapping
from importlib.metadata import entry_points
from types import UnionType
from typing import Any

import numpy as np

from .core import (
    Actor,
    EpicycleError,
    InputPort,
    Latest,
    OutputPort,
    Parameter,
    ParameterError,
    any_parameter,
    array_parameter,
    counted,
    declared_parameters,
    did_you_mean,
    token_type,
)
from .expression import FormulaParameter

FUNCTION_GROUP = "epicycle.functions"
_KINDS: dict[str, Any] = {"number": float, "truth value": bool, "text": str, "any value": Any}
_IS_KIND: dict[str, Callable[[Any], bool]] = {
    "number": lambda value: type(value) is float or (isinstance(value, (int, float)) and not isinstance(value, bool)),
    "truth value": lambda value: isinstance(value, bool),
    "text": lambda value: isinstance(value, str),
    "any value": lambda value: True,
}


class Expression(Actor):
    """Evaluates an expression whenever one of its inputs gets a token.

    Every name in the expression is an input port: ``expression: a + 2 * b`` has the inputs ``a`` and ``b``.  ``time``
    is the present time in s, ``pi``, ``e`` and ``inf`` are constants.  The language is that of ``${...}``: it has no
    access to files or Python.  An array comes as a list, a record as a dict of its fields (``state['position'][0]``).
    ``${...}`` is replaced by the text of its value, so write a value that may be negative in parentheses: ``(${a}) **
    2``.

    Nothing is sent before every input has had a token.  Ptolemy: ``Expression``, and most actors that compute one token
    from another: ``input[index]`` is its ``ArrayElement``.
    """

    output: OutputPort[Any] = OutputPort(float, doc="the value of the expression")

    expression = FormulaParameter(doc="the expression; its names are the input ports")
    gives = Parameter(
        str,
        None,
        choices=tuple(_KINDS),
        doc="type of the value; if left out, a truth value for a comparison, a number otherwise",
    )
    hold = Parameter(bool, True, doc="whether an input without a token is used with its latest one")
    iteration = Parameter(bool, False, doc="whether the name 'iteration' is the number of the evaluation, from 1")

    def check(self) -> None:
        self._kind = self.gives or ("truth value" if self.expression.is_condition else "number")
        self.output.type = _KINDS[self._kind]

    def own_ports(self) -> dict[str, InputPort[Any] | OutputPort[Any]]:
        known = ("time", "iteration") if self.iteration else ("time",)
        names = [name for name in self.expression.names if name not in known]
        return {name: InputPort(doc="a name in the expression") for name in names}

    def initialize(self) -> None:
        self._latest = Latest(self.inputs.values(), hold=self.hold)
        self._count = 0

    def fire(self) -> None:
        for values in self._latest.rounds():
            self.output.send(self._value(values))

    def _value(self, values: dict[str, Any]) -> Any:
        formula, values["time"] = self.expression, self.now
        if self.iteration:
            self._count += 1
            values["iteration"] = self._count
        return self._checked(formula(values))

    def _checked(self, value: Any) -> Any:
        if _IS_KIND[self._kind](value):
            return value
        fits = next(kind for kind, is_kind in _IS_KIND.items() if is_kind(value))
        raise EpicycleError(f"{self.expression} gives {value!r}, which is not a {self._kind}; set 'gives: {fits}'")


class FunctionParameter(Parameter[Callable[..., Any]]):
    """A function named in a model file: given in Python, or offered by an installed package."""

    def __init__(self, given: Mapping[str, Callable[..., Any]], *, doc: str = "") -> None:
        super().__init__(str, doc=doc)  # type: ignore[arg-type]
        self.given = given

    def describe_type(self) -> str:
        return "function"

    def convert(self, value: object) -> Callable[..., Any]:
        if callable(value):  # from Python
            return value
        if not isinstance(value, str):
            raise ParameterError(f"{value!r} is not the name of a function")
        return self.given[value] if value in self.given else self._named(value)

    def _named(self, value: str) -> Callable[..., Any]:
        """A function that is not given, by its name."""
        offered = entry_points(group=FUNCTION_GROUP)
        for point in offered:
            if value in (point.name, point.value):
                try:
                    found = point.load()
                except Exception as error:
                    raise ParameterError(f"{value!r} cannot be loaded: {type(error).__name__}: {error}") from None
                if not callable(found):
                    raise ParameterError(f"{value!r} is not a function but of type {type(found).__name__}")
                return found  # type: ignore[no-any-return]
        known = sorted({*self.given, *(point.name for point in offered)})
        raise ParameterError(
            f"{value!r} is not a function that models may call{did_you_mean(value, known)}; they may call: "
            f"{', '.join(known) or 'none'}; packages offer functions as entry points of the group "
            f"{FUNCTION_GROUP!r}, Python programs with load_model(types=[Function.knowing(f)])"
        )


class Function(Actor):
    """Calls a Python function whenever one of its inputs gets a token, and sends what it returns.

    The parameters of the function are the input ports; those with a default need not be connected.  Annotations with
    plain types are the types of the ports.  Nothing is sent before every connected input has had a token, nor when
    the function returns ``None``.  The function should be pure: it is called whenever tokens come, and internal state
    or random numbers would make runs differ.

    A model file cannot make Epicycle run arbitrary code.  It may name functions that an installed package offers as
    entry points of the group ``epicycle.functions`` (``magnitude = "my_package.geometry:magnitude"``), by their name or
    as ``my_package.geometry:magnitude``; and those that a Python program provides: ``load_model("m.yaml",
    types=[Function.knowing(magnitude)])``.
    """

    output = OutputPort(doc="the return value of the function")

    function = FunctionParameter({}, doc="the function, by its name or as package.module:name")
    hold = Parameter(bool, True, doc="whether an input without a token is used with its latest one")

    @classmethod
    def knowing(cls, *functions: Callable[..., Any]) -> type[Function]:
        """This actor class, for models that may also name these functions, as ``name`` or ``module:name``."""
        before = declared_parameters(cls)["function"]
        assert isinstance(before, FunctionParameter)
        given = dict(before.given)
        for function in functions:
            given[function.__name__] = given[f"{function.__module__}:{function.__qualname__}"] = function
        parameter = FunctionParameter(given, doc=before.doc)
        return type(cls.__name__, (cls,), {"function": parameter, "__doc__": cls.__doc__, "__module__": cls.__module__})

    def check(self) -> None:
        self.output.type = _port_type(_hints(self.function).get("return"))

    def own_ports(self) -> dict[str, InputPort[Any] | OutputPort[Any]]:
        name = getattr(self.function, "__name__", repr(self.function))
        try:
            parameters = inspect.signature(self.function).parameters.values()
        except (TypeError, ValueError):
            raise ParameterError(
                f"function: {name} does not declare its parameters, which are needed as ports"
            ) from None
        hints = _hints(self.function)
        ports: dict[str, InputPort[Any] | OutputPort[Any]] = {}
        for each in parameters:
            if each.kind in (each.VAR_POSITIONAL, each.VAR_KEYWORD):
                raise ParameterError(
                    f"function: {name} takes any number of arguments ({each.name}), so its ports are unknown"
                )
            ports[each.name] = InputPort(
                _port_type(hints.get(each.name)), required=each.default is each.empty, doc=f"argument of {name}"
            )
        self._positional = [each.name for each in parameters if each.kind is each.POSITIONAL_ONLY]
        return ports

    def initialize(self) -> None:
        self._latest = Latest(self.inputs.values(), hold=self.hold)

    def fire(self) -> None:
        for values in self._latest.rounds():
            first = [values.pop(name) for name in self._positional if name in values]
            result = self.function(*first, **values)
            if result is not None:
                self.output.send(result)


def _hints(function: Callable[..., Any]) -> dict[str, Any]:
    try:
        return typing.get_type_hints(function)
    except Exception:  # annotations may be anything, and may make no sense here
        return {}


def _port_type(hint: Any) -> Any:
    """The port type for an annotation: a plain class or a union of them, otherwise any type."""
    if isinstance(hint, UnionType):
        kinds = [each for each in typing.get_args(hint) if each is not type(None)]
        return typing.Union[tuple(map(_port_type, kinds))]  # noqa: UP007
    return hint if isinstance(hint, type) and hint is not type(None) else Any


class LookupTable(Actor):
    """Looks a number up in a table.

    Without ``at``, the input is an index into ``values``, from 0.  With ``at``, ``values[k]`` is the value at the
    argument ``at[k]``, and values are interpolated linearly between arguments.
    Ptolemy: ``LookupTable``, ``Interpolator``.
    """

    input = InputPort(float, doc="an index, or an argument if 'at' is given")
    output = OutputPort(doc="the value at the index or argument")

    values = any_parameter(shape=(None,), doc="the table")
    at = array_parameter((None,), None, doc="the arguments of the values, ascending")
    outside = Parameter(
        str,
        "error",
        choices=("error", "nearest", "nothing"),
        doc="what is sent for an input outside the table",
    )

    def check(self) -> None:
        if not self.values:
            raise ParameterError("values: the table is empty; give at least one value")
        self.output.type = token_type(self.values)
        numeric = self.output.type in (int, float)
        if self.at is None:
            return
        self.output.type = float
        if not numeric:
            raise ParameterError(
                "values: they must be numbers to be interpolated; leave out 'at' to look them up by index"
            )
        if len(self.at) != len(self.values):
            raise ParameterError(
                f"at: {counted(len(self.at), 'argument')} for {counted(len(self.values), 'value')}; give one for each"
            )
        if not np.all(np.diff(self.at) > 0):
            raise ParameterError(f"at: {self.at.tolist()} is not ascending")

    def fire(self) -> None:
        low, high = (0, len(self.values) - 1) if self.at is None else (self.at[0], self.at[-1])
        for token in self.input.tokens:
            inside = low <= token <= high
            if not inside and (self.outside == "error" or math.isnan(token)):
                raise EpicycleError(f"{token!r} is outside the table, which goes from {low:g} to {high:g}")
            if inside or self.outside == "nearest":
                self.output.send(self._at(min(max(token, low), high)))

    def _at(self, argument: float) -> Any:
        if self.at is None:
            if int(argument) != argument:
                raise EpicycleError(f"{argument!r} is not an index; give 'at' to interpolate the table")
            return self.values[int(argument)]
        right = bisect_right(self.at, argument)
        if right == len(self.at):
            return self.values[-1]
        left = right - 1
        share = (argument - self.at[left]) / (self.at[right] - self.at[left])
        return float(self.values[left] + share * (self.values[right] - self.values[left]))
