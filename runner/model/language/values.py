"""Values of a model file: nodes with their expressions evaluated, and parameters that composites declare."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Container, Mapping
from dataclasses import dataclass, field
from typing import Any

from epicycle.actors import (
    MAX_DEPTH,
    Fault,
    FaultError,
    Parameter,
    ParameterError,
    Quantity,
    UnitError,
    is_too_deep,
    parse_unit,
    quantity,
)
from epicycle.actors.expression import Budget, BudgetError, ExpressionError, check_names, interpolate, names_in

from ..text.document import Mapping as MappingNode
from ..text.document import Node, Scalar, Sequence
from ..text.faults import blame
from ..text.kinds import EXPRESSION
from ..text.patterns import in_general
from ..text.problems import POISON, Fix, Poison, Position, Problems
from ..text.reading import inside
from .fields import Computed
from .ports import ParameterText

MAX_STEPS = 500_000
_SEVERAL = re.compile(r",\s*[A-Za-z_][\w.\[\]*]*=(?!=)")  # a=1,b=2 behind --set


@dataclass(frozen=True, slots=True)
class Locals:
    """What a value may use: the ``names`` of a composite, whose path is that of its problems.

    ``later`` are names that are declared but have no value yet; ``is_outside`` means that the value is set from
    outside, where no names are known.
    """

    path: str = ""
    names: Mapping[str, object] = field(default_factory=dict)
    later: Collection[str] = ()
    is_outside: bool = False


OUTSIDE = Locals(is_outside=True)


class Values:
    """Evaluates nodes; what is wrong is added to ``problems``, and its value is ``POISON``."""

    def __init__(self, problems: Problems, budget: Budget | None = None) -> None:
        self.problems = problems
        self.budget = budget or Budget(MAX_STEPS, "the values of the model take")
        self.of_model: Container[str] = ()  # the model's parameters, which composites do not see

    def of(self, node: Node, local: Locals, label: str) -> Any:
        """The value of a node, whose owner is called ``label``."""
        value = self._of(node, local, label)
        if not isinstance(node, Scalar) and is_too_deep(value):
            return self._tell(label, f"nested deeper than {MAX_DEPTH} levels", node.position, local)
        return value

    def _of(self, node: Node, local: Locals, label: str) -> Any:
        if isinstance(node, Sequence):
            self._pay(node, len(node.items) // 3, label, local)
            items = [self._of(item, local, label) for item in node.items]
            return POISON if any(item is POISON for item in items) else items
        if isinstance(node, MappingNode):
            self._pay(node, len(node.entries) // 3, label, local)
            entries = {key: self._of(entry.value, local, label) for key, entry in node.entries.items()}
            return POISON if any(item is POISON for item in entries.values()) else entries
        if not isinstance(node.value, str) or "${" not in node.value:
            return node.value
        names, later = local.names, local.later
        try:
            asked = names_in(node.value)
            if any(name not in names and name not in later for name in asked):
                check_names(node.value, {*names, *(name for name in asked if name in later)})
            if any(names.get(name) is POISON for name in asked):
                return POISON
            if early := sorted(name for name in asked if name in later and name not in names):
                message = f"{early[0]!r} has no value yet: a default may use only the parameters above it"
                return self._tell(label, message, node.position, local, f"declare {early[0]!r} further up")
            value = interpolate(node.value, {name: names[name] for name in asked if name in names}, self.budget)
        except ExpressionError as error:
            part = node.text[error.offset :][: error.length] or " "
            at = inside(node, node.text, error.offset, part)
            meant = error.faults[0].meant
            fix = Fix(at, meant) if meant and at is not node.position else None
            hints = (*self._unseen(node.value, local), *advice_on(node, local))
            self._tell(label, error.message, at, local, *hints, fix=fix)
            if self.budget.is_spent:
                self.problems.raise_if_any()
            return POISON
        if isinstance(value, (list, dict)):
            self._pay(node, len(value), label, local)
        return value

    def _pay(self, node: Node, steps: int, label: str, local: Locals) -> None:
        """Deduct steps from what all values may cost together; once that is spent, loading stops."""
        try:
            self.budget.spend(steps)
        except BudgetError as error:
            self.problems.stop(f"{label}: {error}", node.position, scope=local.path)

    def _unseen(self, text: str, local: Locals) -> tuple[str, ...]:
        """What to do about a name of the model that is not known inside a composite, or outside the model."""
        try:
            unseen = sorted(name for name in names_in(text) if name not in local.names and name in self.of_model)
        except ExpressionError:
            return ()
        if not unseen:
            return ()
        if local.is_outside:
            return ("a value set from outside cannot use names of the model: write the value itself",)
        return (f"a composite knows only its own parameters: declare {unseen[0]!r} there and pass its value",)

    def _tell(
        self, label: str, message: str, position: Position, local: Locals, *hints: str, fix: Fix | None = None
    ) -> Poison:
        about = (in_general(label), "") if local.is_outside else ()  # a setting may be wrong for all of an array
        said = f"{label}: {message}"
        return self.problems.add(said, position, *hints, scope=local.path, about=about, kind=EXPRESSION, fix=fix)

    def blame(self, label: str, error: Exception, where: Node | Position, local: Locals, *hints: str) -> Poison:
        """Report what is wrong with a node, or with something at a position; or how code of a class failed."""
        return blame(self.problems, label, error, where, local.path, *hints, in_all=local.is_outside)

    def converted(self, node: Node, local: Locals, label: str, convert: Callable[[Any], Any]) -> Any:
        """The value of a node as ``convert`` makes it."""
        value = self.of(node, local, label)
        if value is POISON:
            return POISON
        try:
            return convert(value)
        except (FaultError, ValueError) as error:
            return self.blame(label, error, node, local, *advice_on(node, local))

    def value(self, computed: Computed, local: Locals, label: str) -> Any:
        """A value that may be computed."""
        return self.converted(computed.node, local, label, computed.convert)

    def declared(self, parameter: ParameterText, node: Node | Poison, local: Locals, label: str) -> Any:
        """A value for a parameter that a model or composite declares, converted to its unit and checked."""
        if node is POISON:
            return POISON
        if parameter.value is POISON:
            self.of(node, local, label)
            return POISON
        value = self.of(node, local, label)
        if value is POISON:
            return POISON
        try:
            found = _converted(parameter, value)
            if parameter.of is not None and found is not None:
                parameter.of.convert(found)
        except Exception as error:  # of a user's class
            hints = [f"declared by {parameter.source}"] if parameter.source else []
            if not parameter.unit and node is parameter.value:
                hints += _unit_to_declare(parameter.name, getattr(node, "value", None))
            return self.blame(label, error, node, local, *hints, *advice_on(node, local))
        return found


def advice_on(node: Node, local: Locals) -> list[str]:
    """What to do about a wrong value: it computes with a text such as ``3 h``, or is several settings in one."""
    if isinstance(node, MappingNode):
        return [hint for entry in node.entries.values() for hint in advice_on(entry.value, local)]
    if local.is_outside and isinstance(node, Scalar) and _SEVERAL.search(node.text):
        return ["if several parameters are meant, give each a --set of its own"]
    if not isinstance(node, Scalar) or not isinstance(node.value, str) or "${" not in node.value:
        return []
    try:
        names = sorted(names_in(node.value))
    except ExpressionError:
        return []
    if len(names) == 1 and node.value == f"${{{names[0]}}}":
        return []
    return [hint for name in names for hint in _unit_to_declare(name, local.names.get(name))]


def _unit_to_declare(name: str, value: object) -> list[str]:
    """How to declare a parameter whose value is the text of a number with a unit."""
    found = quantity(value) if isinstance(value, str) else None
    if found is None or not found[1]:
        return []
    try:
        parse_unit(found[1])
    except UnitError:
        return []
    return [f"the value of {name} is a text: declare its unit, {name}: {{value: {value}, unit: {found[1]}}}"]


def _converted(parameter: ParameterText, value: Any) -> Any:
    default = parameter.value
    if isinstance(default, (Sequence, MappingNode)):
        kind, word = (list, "list") if isinstance(default, Sequence) else (dict, "mapping")
        if not isinstance(value, kind) and (parameter.of is None or value is None):  # or else that one knows
            missing = f"a value is missing, expected a {word}"
            raise ParameterError(missing if value is None else f"{value!r} is not a {word}")
        return _each(_reader(parameter, None), value)
    literal = None if default is None else default.value
    if value is None and default is not None and literal is None:
        return None  # a parameter that may be left empty
    if isinstance(literal, (int, float)):
        return _reader(parameter, literal)(value)
    return _each(_reader(parameter, literal), value)


def _reader(parameter: ParameterText, default: object) -> Callable[[Any], Any]:
    """The conversion of a value, or of each one in a list, to what the parameter holds."""
    if parameter.choices:
        return Parameter(str, choices=tuple(parameter.choices)).convert
    low, above, high = parameter.bounds()
    bounds: dict[str, Any] = {"min": low, "above": above, "max": high}
    if parameter.unit:
        number, unit = Parameter(float, unit=parameter.unit, **bounds), parameter.unit
        return number.convert if unit == "1" else lambda value: _quantity(number.convert(value), unit)
    if isinstance(default, bool):
        return Parameter(bool).convert
    if isinstance(default, int):
        return Parameter(int, unit="1", **bounds).convert
    if isinstance(default, float) or any(bound is not None for bound in bounds.values()):
        return Parameter(float, unit="1", **bounds).convert
    return _as_it_is


def _each(read: Callable[[Any], Any], value: Any) -> Any:
    if not isinstance(value, list) or read is _as_it_is:
        return read(value)
    found, faults = [], list[Fault]()
    for place, item in enumerate(value):
        try:
            found.append(_each(read, item))
        except FaultError as error:
            faults += error.within(place)
    if faults:
        raise ParameterError.several(faults)
    return found


def _as_it_is(value: Any) -> Any:
    return value


def _quantity(number: float | None, unit: str) -> Quantity | None:
    if number is None:
        return None
    made = Quantity(number, unit)
    made.si  # noqa: B018  raises any error of the conversion to SI units
    return made
