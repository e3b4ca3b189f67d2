"""Values of a model file: nodes with their expressions evaluated, and parameters that composites declare."""

from __future__ import annotations

from typing import Any

from epicycle.actors import Parameter, ParameterError, UnitError, parse_unit

from .declarations import ParameterText
from .document import Mapping, Node, Scalar, Sequence
from .expression import CONSTANTS, FUNCTIONS, ExpressionError, interpolate
from .problems import Position, Problems


class _Missing:
    """Stands for a value whose problem has been told already; expressions that use it are not evaluated."""


class Values:
    """Evaluates nodes; what is wrong is added to ``problems``."""

    missing = _Missing()

    def __init__(self, problems: Problems) -> None:
        self.problems = problems

    def of(self, node: Node, names: dict[str, object]) -> Any:
        """The value of a node, or ``missing``."""
        if isinstance(node, Sequence):
            items = [self.of(item, names) for item in node.items]
            return self.missing if any(item is self.missing for item in items) else items
        if isinstance(node, Mapping):
            entries = {key: self.of(entry.value, names) for key, entry in node.entries.items()}
            return self.missing if any(item is self.missing for item in entries.values()) else entries
        if not isinstance(node.value, str) or "${" not in node.value:
            return node.value
        try:
            value = interpolate(node.value, {k: v for k, v in names.items() if v is not self.missing})
        except ExpressionError as error:
            if not any(value is self.missing and name in node.value for name, value in names.items()):
                self.problems.add(str(error.message), _inside(node, error))
            return self.missing
        return value

    def declared(self, full: str, parameter: ParameterText, value: Any, position: Position) -> Any:
        """A value for a parameter that a model or composite declares, converted to its unit and checked."""
        if parameter.name in CONSTANTS or parameter.name in FUNCTIONS:
            self.problems.add(
                f"{full}: a parameter cannot be called {parameter.name!r}, expressions use that name",
                parameter.position,
            )
        if value is self.missing:
            return value
        try:
            return self._convert(parameter, value)
        except ParameterError as error:
            self.problems.add(f"{full}: {error}", position)
        except UnitError as error:
            self.problems.add(f"{full}: {error}", parameter.position)
        return self.missing

    def _convert(self, parameter: ParameterText, value: Any) -> Any:
        if isinstance(value, list):
            return [self._convert(parameter, item) for item in value]
        if parameter.choices:
            return Parameter(str, choices=parameter.choices).convert(value)
        if isinstance(value, dict):
            return value
        default = parameter.value.value if isinstance(parameter.value, Scalar) else None
        bounds: dict[str, Any] = {"min": parameter.min, "max": parameter.max}
        if parameter.unit:
            parse_unit(parameter.unit)
            if value is None:
                return None
            return Parameter(float, unit=parameter.unit, **bounds).convert(value)
        if isinstance(default, bool):
            return Parameter(bool).convert(value)
        if isinstance(default, int):
            return Parameter(int, **bounds).convert(value)
        if isinstance(default, float) or parameter.min is not None or parameter.max is not None:
            return Parameter(float, unit="1", **bounds).convert(value)
        return value


def _inside(node: Scalar, error: ExpressionError) -> Position:
    """Where in the file an expression went wrong; the whole scalar if it is quoted or folded."""
    at = node.position
    if node.plain and at.source[at.column - 1 :].startswith(node.text):
        return Position(at.file, at.line, at.column + error.offset, max(1, error.length), at.source)
    return at
