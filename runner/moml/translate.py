"""Expressions of Ptolemy II as expressions of Epicycle's; what is known before the run is computed."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from .syntax import Array, Binary, Call, Choice, Const, ExpressionError, Matrix, Method, Name, Record, Tree, Unary
from .values import Scope, evaluate

# How tightly a piece of an expression holds together.
_CHOICE, _OR, _AND, _NOT, _COMPARE, _SUM, _PRODUCT, _SIGN, _POWER, _ATOM = range(10)
_SIGNS: Mapping[str, tuple[str, int]] = {
    "||": ("or", _OR), "|": ("or", _OR), "&&": ("and", _AND), "&": ("and", _AND),
    "==": ("==", _COMPARE), "!=": ("!=", _COMPARE), "<": ("<", _COMPARE), "<=": ("<=", _COMPARE),
    ">": (">", _COMPARE), ">=": (">=", _COMPARE), "+": ("+", _SUM), "-": ("-", _SUM),
    "*": ("*", _PRODUCT), "/": ("/", _PRODUCT), "%": ("%", _PRODUCT), "^": ("**", _POWER),
}  # fmt: skip
_SAME = ("abs", "min", "max", "sqrt", "exp", "log", "sin", "cos", "tan", "atan2", "sum")
_PATTERNS: Mapping[str, str] = {  # arguments are in brackets or between commas
    "floor": "float(floor({0}))",
    "ceil": "float(ceil({0}))",
    "round": "floor({0} + 0.5)",
    "roundToInt": "floor({0} + 0.5)",
    "log10": "log({0}, 10)",
    "log2": "log({0}, 2)",
    "pow": "({0}) ** ({1})",
    "sgn": "(1 if {0} > 0 else -1 if {0} < 0 else 0)",
    "neighborhood": "(abs({0} - ({1})) <= {2})",
    "length": "len({0})",
    "size": "len({0})",
    "get": "({0})[{1}]",
    "getElement": "({0})[{1}]",
    "sort": "sorted({0})",
    "append": "({0} + {1})",
    "concatenate": "({0} + {1})",
    "subarray": "({0})[{1}:{1} + {2}]",
    "repeat": "([{1}] * ({0}))",
    "contains": "({1} in {0})",
    "int": "int({0})",
    "double": "float({0})",
    "toString": "str({0})",
    "stringValue": "str({0})",
}
_CASTS: Mapping[str, str] = {"int": "int", "long": "int", "double": "float", "string": "str", "boolean": "bool"}
Said = tuple[str, int]


def translated(tree: Tree, names: Mapping[str, str], scope: Scope, whole: Collection[str] = ()) -> str:
    """The expression, in which ``names`` stand for what is known in the run alone; raises ``ExpressionError``.

    Those in ``whole`` stand for whole numbers, whose quotients are whole in Ptolemy, too.
    """
    try:
        return _Translation(names, scope, whole).said(tree)[0]
    except RecursionError:
        raise ExpressionError("it is nested too deeply") from None


def literal(value: object) -> str:
    """A value as it stands in an expression; raises ``ExpressionError``."""
    if isinstance(value, list):
        return "[" + ", ".join(map(literal, value)) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{name!r}: {literal(each)}" for name, each in value.items()) + "}"
    if value is None:
        raise ExpressionError("nothing cannot be a value here")
    return repr(value)


def names_of(tree: Tree) -> set[str]:
    """All names in an expression, those of functions included."""
    match tree:
        case Name(name):
            return {name}
        case Const():
            return set()
        case Unary(_, operand):
            return names_of(operand)
        case Binary(_, left, right):
            return names_of(left) | names_of(right)
        case Choice(test, one, other):
            return names_of(test) | names_of(one) | names_of(other)
        case Call(function, arguments):
            return names_of(function).union(*map(names_of, arguments))
        case Method(of, _, arguments):
            return names_of(of).union(*map(names_of, arguments or ()))
        case Array(items):
            return set().union(*map(names_of, items))
        case Record(fields):
            return set().union(*(names_of(each) for _, each in fields))
        case Matrix(rows):
            return set().union(*(names_of(each) for row in rows for each in row))
        case _:
            return names_of(tree.first) | names_of(tree.step) | names_of(tree.last)


class _Translation:
    def __init__(self, names: Mapping[str, str], scope: Scope, whole: Collection[str]) -> None:
        self._names = names
        self._scope = scope
        self._whole = whole

    def said(self, tree: Tree) -> Said:
        """The text, and how tightly it holds together."""
        if not names_of(tree) & self._names.keys():
            text = literal(evaluate(tree, self._scope))
            return text, _SIGN if text.startswith("-") else _ATOM
        match tree:
            case Name(name):
                return self._names[name], _ATOM
            case Unary("-", operand):
                return f"-{self._held(operand, _SIGN)}", _SIGN
            case Unary("!", operand):
                return f"not {self._held(operand, _NOT)}", _NOT
            case Binary(sign, left, right) if sign in _SIGNS:
                return self._binary(sign, left, right)
            case Choice(test, one, other):
                parts = self._held(one, _OR), self._held(test, _OR), self._held(other, _CHOICE)
                return "{} if {} else {}".format(*parts), _CHOICE
            case Method(of, name, None):
                return f"{self._held(of, _ATOM)}[{name!r}]", _ATOM
            case Method(of, name, arguments) if arguments is not None and (name in _SAME or name in _PATTERNS):
                return self._function(name, (of, *arguments))
            case Method(of, name, arguments) if arguments is not None:
                indices = "".join(f"[{self.said(each)[0]}]" for each in arguments)
                return f"{self._held(of, _ATOM)}[{name!r}]{indices}", _ATOM
            case Call(Name(name), arguments) if name not in self._names and not self._is_known(name):
                return self._function(name, arguments)
            case Call(function, arguments):
                return self._held(function, _ATOM) + "".join(f"[{self.said(each)[0]}]" for each in arguments), _ATOM
            case Array(items):
                return "[" + ", ".join(self.said(each)[0] for each in items) + "]", _ATOM
            case Record(fields):
                return "{" + ", ".join(f"{name!r}: {self.said(each)[0]}" for name, each in fields) + "}", _ATOM
            case Matrix(rows):
                lines = ("[" + ", ".join(self.said(each)[0] for each in row) + "]" for row in rows)
                return "[" + ", ".join(lines) + "]", _ATOM
        raise ExpressionError("it has an operator that is not known here")

    def _is_known(self, name: str) -> bool:
        try:
            self._scope(name)
        except KeyError:
            return False
        return True

    def _held(self, tree: Tree, level: int) -> str:
        text, holds = self.said(tree)
        return text if holds >= level else f"({text})"

    def _binary(self, sign: str, left: Tree, right: Tree) -> Said:
        word, level = _SIGNS[sign]
        if sign == "+" and (self._is_text(left) or self._is_text(right)):
            return f"{self._text(left)} + {self._text(right)}", _SUM
        if sign == "/" and self._is_whole(left) and self._is_whole(right):
            return f"int({self._held(left, level)} / {self._held(right, level + 1)})", _ATOM
        beside = 1 if level in (_COMPARE, _SUM, _PRODUCT, _POWER) else 0
        first = self._held(left, level + (1 if level in (_COMPARE, _POWER) else 0))
        return f"{first} {word} {self._held(right, level + beside)}", level

    def _is_whole(self, tree: Tree) -> bool:
        """Whether this is known to be a whole number."""
        match tree:
            case Name(name) if name in self._names:
                return name in self._whole
            case Unary("-", operand):
                return self._is_whole(operand)
            case Binary("+" | "-" | "*" | "/" | "%", left, right):
                return self._is_whole(left) and self._is_whole(right)
        if names_of(tree) & self._names.keys():
            return False
        return type(evaluate(tree, self._scope)) is int

    def _is_text(self, tree: Tree) -> bool:
        """Whether this is known to be a text."""
        match tree:
            case Const(value):
                return isinstance(value, str)
            case Binary("+", left, right):
                return self._is_text(left) or self._is_text(right)
            case Call(Name("toString"), _) | Method(_, "toString" | "stringValue", _):
                return True
            case Name(name) if name not in self._names:
                try:
                    return isinstance(self._scope(name), str)
                except KeyError:
                    return False
        return False

    def _text(self, tree: Tree) -> str:
        return self._held(tree, _SUM) if self._is_text(tree) else f"str({self.said(tree)[0]})"

    def _function(self, name: str, arguments: tuple[Tree, ...]) -> Said:
        said = [self.said(each)[0] for each in arguments]
        if name in _SAME:
            return f"{name}({', '.join(said)})", _ATOM
        if name == "cast" and len(arguments) == 2 and isinstance(arguments[0], Name):
            return f"{_CASTS.get(arguments[0].name, 'float')}({said[1]})", _ATOM
        pattern = _PATTERNS.get(name)
        try:
            if pattern is not None:
                bare = not pattern.startswith("(") or pattern.endswith("]")
                return pattern.format(*said), _ATOM if bare or pattern.endswith(")") else _POWER
        except IndexError:
            raise ExpressionError(f"{name} has too few arguments") from None
        raise ExpressionError(f"the function {name!r} is not known here")
