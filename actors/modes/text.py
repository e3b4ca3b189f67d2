"""Reads modes, transitions and actions from one-line texts or mappings."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, ClassVar, Final

from ..core import Configurable, Fault, MappingParameter, Parameter, ParameterError, Span, brief, texts_parameter
from ..core.units import quantity
from ..expression import Formula, FormulaParameter

_QUOTED: Final = re.compile(r"'[^']*'|\"[^\"]*\"")
_ARROW: Final = re.compile(r"\s*(?P<sources>[^>]+?)\s*->\s*(?P<target>[^\s;]+)(?P<rest>(\s.*)?)", re.DOTALL)
_FLAGS: Final = "else|immediate|nondeterministic|preemptive|history|error"
_AFTER_IT: Final = f"{_FLAGS}|priority|probability|rate|on|after|when|do"
_FLAG: Final = re.compile(
    rf"\s*(?:(?P<flag>{_FLAGS})|priority\s+(?P<priority>-?\d+)"
    rf"|(?P<number>probability|rate)\s+(?P<value>\S.*?)(?=\s+(?:{_AFTER_IT})(?:\s|$)|\s*$))"
    r"(?=\s|$)",
    re.DOTALL,
)
# After a complete expression or name; alone, or after an operator, it is a name itself, other than 'else'.
_LATE_FLAG: Final = re.compile(
    r"(?:(?<![\w.])(?!(?:and|or|not|if|else|in)\b)[\w.)\]}]+|(?=\s+else))"
    rf"\s+(?P<flag>(?:{_FLAGS}|(?:priority|probability|rate)\s+\S.*?)\s*$)",
    re.DOTALL,
)
_CLAUSE: Final = re.compile(r"(?<![\w.])(on|after|when|do)(?![\w.])")
_DIVISION: Final = re.compile(r"[\s\d.eE+-]*[*/]")
_ASSIGNMENT: Final = re.compile(r"\s*(?P<name>[A-Za-z_]\w*)\s*=(?!=)(?P<formula>.*)", re.DOTALL)
_FORM: Final = "'a -> b on PORT after TIME when CONDITION do NAME = VALUE; ...'"

_TRUTHS: Final[dict[Any, Any]] = {"true": True, "false": False}  # as YAML writes them
Action = tuple[str, Formula]


class _QuantityParameter(FormulaParameter):
    """A quantity that is at least 0, or an expression for one in its unit."""

    def __init__(self, what: str, unit: str, doc: str) -> None:
        super().__init__(None, doc=doc)
        self.what, self.of_unit = what, unit

    def describe_type(self) -> str:
        return f"{self.what} or expression"

    def convert(self, value: object) -> Formula | None:
        if not isinstance(value, (str, Formula)) or _has_unit(value):
            given = Parameter(float, unit=self.of_unit, min=0.0, optional=self.optional).convert(value)
            return None if given is None else Formula(repr(given))
        return super().convert(value)


def _has_unit(value: str | Formula) -> bool:
    """Whether a text is a number with a unit; ``3 / x`` is an expression."""
    return isinstance(value, str) and quantity(value) is not None and not _DIVISION.match(value)


class _ActionsParameter(Parameter[Any]):
    """``name = expression; name = expression``, or a mapping of names to expressions."""

    def __init__(self, doc: str) -> None:
        super().__init__(object, (), doc=doc)

    def describe_type(self) -> str:
        return "actions 'name = expression; ...'"

    def convert(self, value: object) -> tuple[Action, ...]:
        if isinstance(value, tuple) or value is None:
            return value or ()
        faults: list[Fault] = []
        given: list[tuple[str, Any, int | None]]
        if isinstance(value, Mapping):
            given = [(name, formula, None) for name, formula in value.items()]
        elif isinstance(value, str):
            given = list(self._actions(value, faults))
        else:
            raise ParameterError(f"{brief(value)} is not a {self.describe_type()}")
        found = []
        for name, formula, offset in given:
            try:
                read = FormulaParameter().convert(
                    _TRUTHS.get(formula, formula) if isinstance(formula, str) else formula
                )
            except ParameterError as error:
                new = error.within(*(() if offset is not None else (name,)), prefix=f"{name} = ")
                faults += new if offset is None else [_moved(each, offset, str(formula)) for each in new]
                continue
            assert read is not None
            found.append((name, read))
        if faults:
            raise ParameterError.several(faults)
        return tuple(found)

    def _actions(self, text: str, faults: list[Fault]) -> Iterator[tuple[str, str, int]]:
        """The name, the expression and its place, of each action."""
        start = 0
        for end in [*(found.start() for found in re.finditer(";", _masked(text))), len(text)]:
            part, first, start = text[start:end], start, end + 1
            if not part.strip():
                continue
            match = _ASSIGNMENT.fullmatch(part)
            if match is None:
                message = f"{part.strip()!r} is not an action: write 'name = expression'"
                faults.append(Fault(message, span=_stripped(part, first)))
                continue
            offset, _ = _stripped(match["formula"], first + match.start("formula"))
            yield match["name"], match["formula"].strip(), offset


def _stripped(part: str, offset: int) -> Span:
    """Where a part of a text is, without the blanks around it."""
    return offset + len(part) - len(part.lstrip()), len(part.strip())


def _moved(fault: Fault, offset: int, part: str) -> Fault:
    """A fault in a part of a text, by its place in the whole text."""
    start, length = fault.span or (0, len(part))
    return replace(fault, span=(offset + start, length))


class Mode(Configurable):
    """The declaration of a mode."""

    written_as = "a mode"
    refused: ClassVar[Mapping[str, str]] = {
        "refinement": "a mode of an actor has no refinement: write modes into a composite, beside its 'inputs'"
    }

    flow = MappingParameter(
        FormulaParameter(), {}, doc="rates of change of variables in it, per s; others stay constant"
    )
    entry = _ActionsParameter("actions taken whenever it is entered")
    exit = _ActionsParameter("actions taken whenever it is left")
    final = Parameter(bool, False, doc="whether the machine ends when it is entered")
    doc = Parameter(str, "", doc="its purpose")


class Transition(Configurable):
    """The declaration of a transition."""

    written_as = "a transition"
    reserved: ClassVar[frozenset[str]] = frozenset()

    from_ = texts_parameter(doc="the modes that it leaves; * for all but its target")
    to = Parameter(str, doc="the mode that it enters")
    on = texts_parameter((), doc="inputs of which one must have a token")
    after = _QuantityParameter("time", "s", "time after the entry from which it may be taken, in s")
    when = FormulaParameter(None, doc="the guard")
    probability = FormulaParameter(None, doc="probability that it is enabled when it would otherwise be")
    rate = _QuantityParameter("rate", "1/s", "how often it comes while its guard holds: after an exponential time")
    do = _ActionsParameter("actions when it is taken: sends outputs and sets variables, one after the other")
    priority = Parameter(int, 0, doc="if several are enabled, the lowest is taken")
    else_ = Parameter(bool, False, doc="whether it is enabled only if no other is")
    immediate = Parameter(bool, False, doc="whether it can be taken in the reaction in which its mode is entered")
    nondeterministic = Parameter(bool, False, doc="whether one is drawn if several such are enabled")
    preemptive = Parameter(bool, False, doc="whether it comes before others, and before its mode's refinement fires")
    history = Parameter(bool, False, doc="whether the refinement of its target resumes where it was left")
    error = Parameter(bool, False, doc="whether it handles errors of its mode's refinement; 'error' holds the message")


class ModesParameter(Parameter[Any]):
    """Names of modes, or a mapping of names to their declarations."""

    def describe_type(self) -> str:
        return "list of names, or mapping of names to declarations of modes"

    def convert(self, value: object) -> dict[str, Mode]:
        if isinstance(value, (list, tuple)) and all(isinstance(each, str) for each in value):
            if len(set(value)) < len(value):
                raise ParameterError(f"{next(each for each in value if value.count(each) > 1)!r} is declared twice")
            value = dict.fromkeys(value)
        if not isinstance(value, Mapping):
            raise ParameterError(f"{brief(value)} is not a {self.describe_type()}")
        found, faults = {}, list[Fault]()
        for name, said in value.items():
            if not isinstance(name, str) or not name.isidentifier():
                faults.append(Fault(f"{name!r} is not a name", (str(name),), of_key=True))
                continue
            try:
                found[name] = said if isinstance(said, Mode) else _made(Mode, {} if said is None else said, name)
            except ParameterError as error:
                faults += error.within(name)
        if faults:
            raise ParameterError.several(faults)
        return found


class TransitionsParameter(Parameter[Any]):
    """Transitions, each a text of one line or a mapping."""

    def describe_type(self) -> str:
        return f"list of transitions such as {_FORM}"

    def convert(self, value: object) -> tuple[Transition, ...]:
        if not isinstance(value, (list, tuple)):
            raise ParameterError(f"{brief(value)} is not a {self.describe_type()}")
        found, faults = [], list[Fault]()
        for place, each in enumerate(value):
            try:
                if isinstance(each, str):
                    found.append(read_transition(each))
                else:
                    what = f"transition {place + 1}"
                    found.append(each if isinstance(each, Transition) else _made(Transition, each, what))
            except ParameterError as error:
                faults += error.within(place)
        if faults:
            raise ParameterError.several(faults)
        return tuple(found)


def _made(kind: type[Any], said: object, what: str) -> Any:
    if not isinstance(said, Mapping):
        raise ParameterError(f"{what}: {brief(said)} is not a mapping")
    try:
        return kind(**said)
    except ParameterError as error:
        of_class = f"{kind.__name__}."  # which nobody has written
        faults = (replace(fault, message=fault.message.removeprefix(of_class)) for fault in error.faults)
        raise ParameterError.several(fault.within(prefix=f"{what}: ") for fault in faults) from None


def read_transition(text: str) -> Transition:
    """Read a one-line transition; raises ``ParameterError`` if it is not one."""
    said, places = _clauses(text)
    try:
        made: Transition = _made(Transition, said, text)
    except ParameterError as error:
        raise ParameterError.several(_in_line(fault, text, places) for fault in error.faults) from None
    return made


def _in_line(fault: Fault, text: str, places: Mapping[str, Span]) -> Fault:
    """A fault of a transition by its place in the line that declares it."""
    if not fault.keys or fault.keys[0] not in places:
        return replace(fault, keys=())
    offset, length = places[str(fault.keys[0])]
    return replace(_moved(fault, offset, text[offset : offset + length]), keys=())


def _clauses(text: str) -> tuple[dict[str, object], dict[str, Span]]:
    """What a one-line transition gives, and where in it."""
    arrow = _ARROW.fullmatch(text)
    if arrow is None:
        raise ParameterError(f"{text!r} is not a transition: write {_FORM}")
    said: dict[str, object] = {"to": arrow["target"], "from": [each.strip() for each in arrow["sources"].split(",")]}
    places: dict[str, Span] = {}
    start, outside = arrow.start("rest"), _masked(text)
    while (flag := _FLAG.match(outside, start)) is not None:
        if flag["number"] is not None:
            said[flag["number"]] = text[slice(*flag.span("value"))]
            places[flag["number"]] = flag.start("value"), len(flag["value"])
        elif flag["priority"] is not None:
            said["priority"] = int(flag["priority"])
        else:
            said[flag["flag"]] = True
        start = flag.end()
    rest, masked = text[start:], outside[start:]
    clauses = list(_CLAUSE.finditer(masked))
    actions = next((number for number, clause in enumerate(clauses) if clause[0] == "do"), len(clauses))
    clauses = clauses[: actions + 1]
    if masked[: clauses[0].start() if clauses else None].strip():
        first = rest.split()[0]
        span = start + rest.index(first), len(first)
        raise ParameterError(f"{text!r}: unexpected {first!r}: write {_FORM}", span=span)
    for number, clause in enumerate(clauses):
        end = clauses[number + 1].start() if number + 1 < len(clauses) else len(rest)
        value = rest[clause.end() : end]
        if clause[0] in said:
            span = start + clause.start(), len(clause[0])
            raise ParameterError(f"{text!r}: {clause[0]!r} is given twice", span=span)
        places[clause[0]] = _stripped(value, start + clause.end())
        if (late := _LATE_FLAG.search(masked, clause.end(), end)) is not None:
            misplaced = rest[late.start("flag") : end].strip()
            form = f"'a -> b {misplaced} {clauses[0][0]} ...'"
            span = start + late.start("flag"), len(misplaced)
            raise ParameterError(f"{text!r}: {misplaced.split()[0]!r} comes first: write {form}", span=span)
        value = value.strip()
        said[clause[0]] = [each.strip() for each in value.split(",")] if clause[0] == "on" else value
    return said, places


def _masked(text: str) -> str:
    """The text with everything in quotes or brackets blanked out."""
    text = _QUOTED.sub(lambda match: "_" * len(match[0]), text)
    depth, found = 0, []
    for character in text:
        depth -= character in ")]}"
        found.append("_" if depth > 0 else character)
        depth += character in "([{"
    return "".join(found)
