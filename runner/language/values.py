"""Values of a model file: nodes with their expressions evaluated, and parameters that composites declare."""

from __future__ import annotations

from collections.abc import Callable, Collection, Container
from typing import Any

from epicycle.actors import MAX_DEPTH, Parameter, ParameterError, Quantity, UnitError, is_too_deep
from epicycle.actors.expression import Budget, BudgetError, ExpressionError, check_names, interpolate, names_in

from ..text import Mapping, Node, Position, Problems, Scalar, Sequence, inside
from .declarations import ParameterText

MAX_STEPS = 500_000


class _Missing:
    """Replaces a value whose problem has already been reported; expressions that use it are not evaluated."""


class Values:
    """Evaluates nodes; what is wrong is added to ``problems``."""

    missing = _Missing()

    def __init__(self, problems: Problems, budget: Budget | None = None) -> None:
        self.problems = problems
        self.budget = budget or Budget(MAX_STEPS, "the values of the model take")
        self.outside: dict[str, object] = {}  # the names known to a value that is set from outside: none
        self.of_model: Container[str] = ()  # the model's parameters, which composites do not see

    def of(self, node: Node, names: dict[str, object], label: str, scope: str = "", later: Collection[str] = ()) -> Any:
        """The value of a node, or ``missing``.

        ``label`` names its owner, ``scope`` the composite that contains it; ``later`` are the names that are declared
        but have no value yet.
        """
        value = self._of(node, names, label, scope, later)
        if not isinstance(node, Scalar) and is_too_deep(value):
            self.problems.add(f"{label}: nested deeper than {MAX_DEPTH} levels", node.position, scope=scope)
            return self.missing
        return value

    def _of(self, node: Node, names: dict[str, object], label: str, scope: str, later: Collection[str]) -> Any:
        if not isinstance(node, Scalar):
            self._pay(node, len(node.items if isinstance(node, Sequence) else node.entries) // 3, label, scope)
        if isinstance(node, Sequence):
            items = [self._of(item, names, label, scope, later) for item in node.items]
            return self.missing if any(item is self.missing for item in items) else items
        if isinstance(node, Mapping):
            entries = {k: self._of(entry.value, names, label, scope, later) for k, entry in node.entries.items()}
            return self.missing if any(item is self.missing for item in entries.values()) else entries
        if not isinstance(node.value, str) or "${" not in node.value:
            return node.value
        try:
            asked = names_in(node.value)
            if any(name not in names and name not in later for name in asked):
                check_names(node.value, {*names, *(name for name in asked if name in later)})
            if any(names.get(name) is self.missing for name in asked):
                return self.missing  # the problem of that name has been reported
            if early := sorted(name for name in asked if name in later and name not in names):
                message = f"{label}: {early[0]!r} has no value yet: a default may use only the parameters above it"
                self.problems.add(message, node.position, f"declare {early[0]!r} further up", scope=scope)
                return self.missing
            value = interpolate(node.value, {name: names[name] for name in asked if name in names}, self.budget)
        except ExpressionError as error:
            self.problems.add(
                f"{label}: {error.message}", _inside(node, error), *self._unseen(node.value, names), scope=scope
            )
            if self.budget.is_spent:
                self.problems.raise_if_any()
            return self.missing
        if isinstance(value, (list, dict)):
            self._pay(node, len(value), label, scope)
        return value

    def _pay(self, node: Node, steps: int, label: str, scope: str) -> None:
        """Deduct steps from what all values may cost together; once that is spent, loading stops."""
        try:
            self.budget.spend(steps)
        except BudgetError as error:
            self.problems.stop(f"{label}: {error}", node.position, scope=scope)

    def _unseen(self, text: str, names: Container[str]) -> tuple[str, ...]:
        """What to do about a name of the model that is not known inside a composite, or outside the model."""
        try:
            unseen = sorted(name for name in names_in(text) if name not in names and name in self.of_model)
        except ExpressionError:
            return ()
        if not unseen:
            return ()
        if names is self.outside:
            return ("a value set from outside cannot use names of the model: write the value itself",)
        return (f"a composite knows only its own parameters: declare {unseen[0]!r} there and pass its value",)

    def declared(self, full: str, parameter: ParameterText, value: Any, position: Position, scope: str = "") -> Any:
        """A value for a parameter that a model or composite declares, converted to its unit and checked."""
        if value is self.missing or parameter.spoilt:
            return self.missing
        try:
            return self._convert(parameter, value)
        except (ParameterError, UnitError) as error:
            self.problems.add(f"{full}: {error}", position, scope=scope)
        return self.missing

    def _convert(self, parameter: ParameterText, value: Any) -> Any:
        default = parameter.value
        if isinstance(default, (Sequence, Mapping)):
            kind, word = (list, "list") if isinstance(default, Sequence) else (dict, "mapping")
            if not isinstance(value, kind):
                missing = f"a value is missing, expected a {word}"
                raise ParameterError(missing if value is None else f"{value!r} is not a {word}")
            return _each(self._reader(parameter, None), value)
        literal = None if default is None else default.value
        if value is None and default is not None and literal is None:
            return None  # a parameter that may be left empty
        if isinstance(literal, (int, float)):
            return self._reader(parameter, literal)(value)
        return _each(self._reader(parameter, literal), value)

    def _reader(self, parameter: ParameterText, default: object) -> Callable[[Any], Any]:
        """The conversion of a value, or of each one in a list, to what the parameter holds."""
        if parameter.choices:
            return Parameter(str, choices=parameter.choices).convert
        low, high = parameter.bounds()
        bounds: dict[str, Any] = {"min": low, "max": high}
        if parameter.unit:
            number, unit = Parameter(float, unit=parameter.unit, **bounds), parameter.unit
            return number.convert if unit == "1" else lambda value: _quantity(number.convert(value), unit)
        if isinstance(default, bool):
            return Parameter(bool).convert
        if isinstance(default, int):
            return Parameter(int, unit="1", **bounds).convert
        if isinstance(default, float) or low is not None or high is not None:
            return Parameter(float, unit="1", **bounds).convert
        return _as_it_is


def _each(read: Callable[[Any], Any], value: Any) -> Any:
    if isinstance(value, list):
        return value if read is _as_it_is else [_each(read, item) for item in value]
    return read(value)


def _as_it_is(value: Any) -> Any:
    return value


def _quantity(number: float | None, unit: str) -> Quantity | None:
    if number is None:
        return None
    made = Quantity(number, unit)
    made.si  # noqa: B018  raises any error of the conversion to SI units
    return made


def _inside(node: Scalar, error: ExpressionError) -> Position:
    """Where in the file an expression went wrong; the whole scalar if it is folded or has escapes."""
    part = node.text[error.offset :][: error.length]
    return inside(node, node.text, error.offset, part or " ")
