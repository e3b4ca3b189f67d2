"""Translates expressions of Ptolemy II to Epicycle's; what is known before the run is evaluated."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import TypeAlias

from .budget import spend
from .syntax import (
    MAX_LENGTH,
    Array,
    Binary,
    Call,
    Choice,
    Const,
    ExpressionError,
    Lambda,
    Matrix,
    Method,
    Name,
    Record,
    Tree,
    Unary,
)
from .values import Function, Scope, evaluate

# How tightly a piece of an expression binds.
_CHOICE, _OR, _AND, _NOT, _COMPARE, _SUM, _PRODUCT, _SIGN, _POWER, _ATOM = range(10)
_SIGNS: Mapping[str, tuple[str, int]] = {
    "||": ("or", _OR), "|": ("or", _OR), "&&": ("and", _AND), "&": ("and", _AND),
    "==": ("==", _COMPARE), "!=": ("!=", _COMPARE), "<": ("<", _COMPARE), "<=": ("<=", _COMPARE),
    ">": (">", _COMPARE), ">=": (">=", _COMPARE), "+": ("+", _SUM), "-": ("-", _SUM),
    "*": ("*", _PRODUCT), "/": ("/", _PRODUCT), "%": ("%", _PRODUCT), "^": ("**", _POWER),
}  # fmt: skip
_SAME = ("abs", "min", "max", "sqrt", "exp", "log", "sin", "cos", "tan", "atan2", "hypot", "sum")
MAX_OPENED = 20  # functions within functions
MAX_TEXT = 2_000  # characters of a translated expression
_PATTERNS: Mapping[str, str] = {  # arguments are in parentheses or between commas
    "floor": "float(floor({0}))",
    "ceil": "float(ceil({0}))",
    "round": "floor({0} + 0.5)",
    "roundToInt": "floor({0} + 0.5)",
    "log10": "log({0}, 10)",
    "log2": "log({0}, 2)",
    "pow": "({0}) ** ({1})",
    "asin": "atan2({0}, sqrt(1 - ({0}) ** 2))",
    "acos": "atan2(sqrt(1 - ({0}) ** 2), {0})",
    "atan": "atan2({0}, 1)",
    "sinh": "((exp({0}) - exp(-({0}))) / 2)",
    "cosh": "((exp({0}) + exp(-({0}))) / 2)",
    "toRadians": "(({0}) / 180 * pi)",
    "toDegrees": "(({0}) * 180 / pi)",
    "within": "(abs({0} - ({1})) <= {2})",
    "isCloseTo": "(abs({0} - ({1})) <= {2})",
    "isInfinite": "(abs({0}) == inf)",
    "equals": "(({0}) == ({1}))",
    "isEqualTo": "(({0}) == ({1}))",
    "isLessThan": "(({0}) < ({1}))",
    "isGreaterThan": "(({0}) > ({1}))",
    "add": "(({0}) + ({1}))",
    "subtract": "(({0}) - ({1}))",
    "multiply": "(({0}) * ({1}))",
    "doubleValue": "float({0})",
    "intValue": "int({0})",
    "parseInt": "int({0})",
    "parseDouble": "float({0})",
    "substring": "({0})[{1}:{2}]",
    "startsWith": "(({0})[:len({1})] == ({1}))",
    "concat": "({0} + {1})",
    "update": "(({0})[:{1}] + [{2}] + ({0})[{1} + 1:])",
    "and": "(({0}) and ({1}))",
    "or": "(({0}) or ({1}))",
    "not": "(not ({0}))",
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
_Made: TypeAlias = "tuple[tuple[str, ...], Tree, _Translation]"  # arguments, body, and what its names mean


def translated(
    tree: Tree, names: Mapping[str, str], scope: Scope, whole: Collection[str] = (), arrays: Collection[str] = ()
) -> str:
    """The translated expression, in which ``names`` are known only during the run; raises ``ExpressionError``.

    Those in ``whole`` are whole numbers, whose quotients are whole in Ptolemy, too; those in ``arrays`` are arrays,
    which are added and multiplied item by item.
    """
    try:
        return _Translation(names, scope, whole, arrays=arrays).said(tree)[0]
    except RecursionError:
        raise ExpressionError("the expression is nested too deeply") from None


def literal(value: object) -> str:
    """A value as written in an expression; raises ``ExpressionError``."""
    if isinstance(value, list):
        return "[" + ", ".join(map(literal, value)) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{name!r}: {literal(each)}" for name, each in value.items()) + "}"
    if value is None or isinstance(value, Function):
        raise ExpressionError(f"{'nothing' if value is None else 'a function'} cannot be a value here")
    return repr(value)


def names_of(tree: Tree) -> set[str]:
    """All names in an expression, including those of functions."""
    spend()
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
        case Lambda(names, body):
            return names_of(body) - {*names}
        case _:
            return names_of(tree.first) | names_of(tree.step) | names_of(tree.last)


def _leaves(tree: Tree) -> Iterator[Tree]:
    """The operands of an expression."""
    match tree:
        case Unary(_, operand):
            yield from _leaves(operand)
        case Binary(_, left, right):
            yield from _leaves(left)
            yield from _leaves(right)
        case _:
            yield tree


class _Translation:
    def __init__(
        self,
        names: Mapping[str, str],
        scope: Scope,
        whole: Collection[str],
        depth: int = 0,
        arrays: Collection[str] = (),
    ) -> None:
        self._names = names
        self._scope = scope
        self._whole = set(whole)
        self._arrays = set(arrays)
        self._depth = depth  # of expanded functions

    def said(self, tree: Tree) -> Said:
        """The text, and how tightly it binds."""
        text, holds = self._written(tree)
        spend(len(text) // 10)
        if len(text) > MAX_LENGTH:
            raise ExpressionError(f"the translated expression has more than the maximum of {MAX_LENGTH:,} characters")
        return text, holds

    def _written(self, tree: Tree) -> Said:
        if not names_of(tree) & self._names.keys():
            text = literal(evaluate(tree, self._scope))
            return text, _SIGN if text.startswith("-") else _ATOM
        match tree:
            case Name(name):
                return self._names[name], _ATOM
            case Unary("-") | Binary() if self._is_array(tree):
                array = next(each for each in _leaves(tree) if self._is_array(each))
                return f"[{self._item(tree)} for k in range(len({self.said(array)[0]}))]", _ATOM
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
            case Call(Name("map" | "filter" as name), (made, array)) if (found := self._made(made)) is not None:
                return self._each(name, found, array)
            case Call(function, arguments) if (found := self._made(function)) is not None:
                return self._opened(found, [self._held(each, _ATOM) for each in arguments], arguments)
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
        raise ExpressionError("it has an operator that is not supported")

    # -- functions defined in the model ---------------------------------------------------------------------------

    def _made(self, tree: Tree) -> _Made | None:
        """A function, if the model defines it."""
        if isinstance(tree, Lambda):
            return tree.names, tree.body, self
        if not isinstance(tree, Name) or tree.name in self._names or not self._is_known(tree.name):
            return None
        found = self._scope(tree.name)
        if not isinstance(found, Function):
            return None
        return found.names, found.body, _Translation({}, found.scope, (), self._depth)

    def _opened(self, made: _Made, texts: list[str], given: tuple[Tree, ...] = ()) -> Said:
        """The body of a function, with the given texts in place of its arguments."""
        names, body, around = made
        if len(names) != len(texts):
            raise ExpressionError(f"wrong number of arguments: the function takes {len(names)}, not {len(texts)}")
        if self._depth > MAX_OPENED:
            raise ExpressionError("functions that call themselves are not supported")
        whole = {name for name, each in zip(names, given, strict=False) if self._is_whole(each)}
        meant = {**around._names, **dict(zip(names, texts, strict=True))}
        inner = _Translation(meant, around._scope, (around._whole - {*names}) | whole, self._depth + 1)
        found = inner.said(body)
        if len(found[0]) > MAX_TEXT:
            raise ExpressionError("the expression is too long after expanding its functions")
        return found

    def _each(self, name: str, made: _Made, array: Tree) -> Said:
        """A function applied to each element of an array."""
        if len(made[0]) != 1:
            raise ExpressionError(f"{name} takes a function of one argument, not of {len(made[0])}")
        item = made[0][0]
        while item in self._names.values():
            item += "_"
        text, holds = self._opened(made, [item])
        held = text if holds > _CHOICE else f"({text})"
        source = self._held(array, _OR)
        found = f"{held} for {item} in {source}" if name == "map" else f"{item} for {item} in {source} if {held}"
        return f"[{found}]", _ATOM

    # -- operators ------------------------------------------------------------------------------------------------

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
        if sign == "%":
            return self._rest(left, right)
        if sign in ("==", "!=") and right == Const(0) and isinstance(left, Binary) and left.sign == "%":
            # Whether there is a remainder does not depend on signs.
            return f"{self._held(left.left, _PRODUCT)} % {self._held(left.right, _SIGN)} {word} 0", _COMPARE
        beside = 1 if level in (_COMPARE, _SUM, _PRODUCT, _POWER) else 0
        first = self._held(left, level + (1 if level in (_COMPARE, _POWER) else 0))
        return f"{first} {word} {self._held(right, level + beside)}", level

    def _is_array(self, tree: Tree) -> bool:
        """Whether this is known to be an array."""
        match tree:
            case Name(name) if name in self._names:
                return name in self._arrays
            case Array():
                return True
            case Unary("-", operand):
                return self._is_array(operand)
            case Binary("+" | "-" | "*" | "/", left, right):
                return self._is_array(left) or self._is_array(right)
            case Name():
                return type(evaluate(tree, self._scope)) is list
        return False

    def _item(self, tree: Tree) -> str:
        """The item of an array at index ``k``; a value that is not an array is the same for all items."""
        match tree:
            case Unary("-", operand) if self._is_array(operand):
                return f"-{self._item(operand)}"
            case Binary(sign, left, right) if self._is_array(tree):
                return f"({self._item(left)} {sign} {self._item(right)})"
        return f"{self._held(tree, _ATOM)}[k]" if self._is_array(tree) else self._held(tree, _ATOM)

    def _rest(self, left: Tree, right: Tree) -> Said:
        """The remainder has the sign of the first operand in Ptolemy, and that of the second here."""
        first, second = self._held(left, _ATOM), self._held(right, _SIGN)
        if not self._is_at_least(right, 1e-300):
            second = f"abs({second})"
        if self._is_at_least(left, 0):
            return f"{first} % {second}", _PRODUCT
        return f"({first} % {second} if {first} >= 0 else -(-{first} % {second}))", _ATOM

    def _is_at_least(self, tree: Tree, least: float) -> bool:
        value = None if names_of(tree) & self._names.keys() else evaluate(tree, self._scope)
        return isinstance(value, (int, float)) and value >= least

    def _is_whole(self, tree: Tree) -> bool:
        """Whether this is known to be a whole number."""
        match tree:
            case Name(name) if name in self._names:
                return name in self._whole
            case Unary("-", operand):
                return self._is_whole(operand)
            case Binary("+" | "-" | "*" | "/" | "%", left, right):
                return self._is_whole(left) and self._is_whole(right)
            case Binary("^", left, Const(int())):
                return self._is_whole(left)
            case Choice(_, one, other):
                return self._is_whole(one) and self._is_whole(other)
            case Call(Name("min" | "max" | "abs"), arguments):
                return all(map(self._is_whole, arguments))
            case Call(Name("round" | "roundToInt"), _) | Method(_, "length", _):
                return True
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
        raise ExpressionError(f"the function {name!r} is not supported")
