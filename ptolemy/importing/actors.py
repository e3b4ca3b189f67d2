"""Converts the actors of a file to actors of the model language, by their rows in the table of counterparts."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from typing import Any

from epicycle.actors.expression import ExpressionError as OwnError
from epicycle.actors.expression import evaluate

from ..generators import LAWS
from .document import Property, is_aside, is_priority, is_text
from .limits import Notes
from .parts import Part
from .syntax import ExpressionError, names_of, parse
from .table import UNSAID, WORDS, Row, Setting
from .translation import Code, Kind, Meaning, Value, code_of, named
from .variables import Variables
from .writing import Names, plain, seconds


class Actor:
    """One actor that is being imported: its definition in the file, and its conversion."""

    def __init__(self, part: Part, row: Row, notes: Notes, variables: Variables) -> None:
        self.part, self.row, self.scope, self.path = part, row, part.scope, part.path
        self.notes, self.variables = notes, variables
        self.widths: dict[str, int] = {}  # how many channels its ports have; 0 of inputs to which nothing sends
        self.kinds: dict[str, Kind] = {}  # of what its ports receive, where that is known
        self.values: dict[str, Any] = {}  # what is written
        self.held: dict[str, object] = {}  # the initial values of our inputs that keep their latest token
        self.ports: dict[str, str] = {}  # our names for its ports that are not in the row
        self.told: set[str] = set()  # parameters that have been handled

    # -- reading the file -----------------------------------------------------------------------------------------

    def said(self, name: str) -> Property | None:
        """A parameter that the file sets; None if it keeps its default."""
        found = self.part.entity.properties.get(name)
        return found if found is not None and (found.value or "").strip() else None

    def get(self, name: str, default: object = None) -> Any:
        """The value of a parameter, for decisions made during the import."""
        self.told.add(name)
        said = self.said(name)
        return default if said is None else self.part.value(said, self.notes, default)

    def text(self, name: str, default: str = "") -> str:
        """A parameter read as text, regardless of its class."""
        self.told.add(name)
        said = self.part.entity.properties.get(name)
        if said is None or said.value is None:
            return default
        return self.scope.filled(said.value.strip() if is_text(said) else self.part.entity.word(name))

    def _tell(self, tell: Callable[[str], None], said: Property, what: str = " has no counterpart") -> None:
        text = " ".join((said.value or "").split())
        tell(f"{self.path}.{said.name} = {text if len(text) <= 60 else text[:57] + '...'!r}{what}")

    # -- expressions of the table -----------------------------------------------------------------------------------

    def meaning(self, text: object) -> Meaning:
        """What an expression of the table means for this actor, over its ports and parameters."""
        if not isinstance(text, str):
            return Value(text)
        tree = parse(text)
        return self.scope.meaning(tree, {name: said for name in names_of(tree) if (said := self._operand(name))})

    def value(self, text: object) -> Any:
        """The value of an expression of the table; None if it changes in a run."""
        found = self.meaning(text)
        return found.value if isinstance(found, Value) else None

    def _operand(self, name: str) -> Meaning | None:
        """A port or parameter; one that is both holds its latest token, and the value of the parameter before."""
        defaults: Mapping[str, object] = self.row.settings.get("given", {})
        said, port = self.said(name), self.row.ports.get(name)
        self.told.add(name)
        value: Meaning | None = None
        if said is not None and (port is not None or name in defaults):
            value = self.scope.meaning_of(said)
        elif name in defaults:
            value = self.meaning(defaults[name])
        if self.widths.get(name, 0) or (value is None and port is not None):
            ours = name if port is None else port.ours
            self.ports |= {name: ours} if port is None else {}
            if value is not None:
                self.held[ours] = plain(self.get(name, self.value(defaults.get(name))))
            return named(ours, self.kinds.get(name))
        inner = {"BlockExpression": ("block", "past"), "Expression": ("time",)}.get(self.row.type, ())
        return named(name) if value is None and name in inner else None if value is None else self.following(value)

    def following(self, said: Meaning) -> Meaning:
        """An expression, over inputs that are connected to the variables in it."""
        found = self.variables.in_(said)
        for each in found:
            if each.owner is not self.part.around:
                raise ExpressionError(f"{each.name}, a variable outside, has no counterpart in an expression")
            name = self.ports[each.named()] = each.named()
            self.held[name] = each.first()
            each.inputs[f"{self.part.name}.{name}"] = None
        return named(self.variables.text(said)) if found else said

    def expression(self, said: Meaning) -> None:
        """Make it an Expression, or a HoldingExpression if inputs hold a value.

        The text names all inputs that are fed, because a name that it does not use would not be a port.
        """
        text = code_of(said).text
        if self.row.type == "Expression":
            ours = {name: port.ours for name, port in self.row.ports.items() if port.direction == "input"}
            fed = [each for name, each in {**ours, **self.ports}.items() if self.widths.get(name, 0)]
            if left := [each for each in fed if not re.search(rf"(?<!\w){each}(?!\w)", text)]:
                text = f"[{text}, {', '.join(left)}][0]"
            self.values |= {"type": "HoldingExpression", "held": self.held} if self.held else {}
        self.values["expression"] = text

    # -- parameters -----------------------------------------------------------------------------------------------

    def convert(self) -> None:
        """Find the values of all parameters."""
        settings = self.row.settings
        if "note" in settings:
            self.notes.note(f"{self.path}: {settings['note']}")
        try:
            if "how" in settings:
                SPECIAL[settings["how"]](self)
            for name, row in self.row.parameters.items():
                if name not in self.told:
                    self._parameter(name, row)
            for ours, text in settings.get("compute", {}).items():
                if (value := self.value(text)) is not None:
                    self.values[ours] = plain(value)
            if "law" in settings:
                _law(self)
            if "expression" in settings:
                self.expression(self.meaning(settings["expression"]))
        except (ExpressionError, ValueError, TypeError) as error:
            self.notes.error(f"{self.path}: {error}")
        for name, said in self.part.entity.properties.items():
            if name in self.row.parameters or not said.value or is_aside(said) or is_priority(said):
                continue
            if name not in self.told and name not in WORDS["parameters without effect"]:
                self._tell(self.notes.note, said)
            elif name in self.told and not self.held and self.variables.changes(said, self.scope):
                self._tell(self.notes.note, said, " keeps its initial value")
        self.values = {**settings.get("set", {}), **self.values}

    def _parameter(self, name: str, row: Setting) -> None:
        self.told.add(name)
        said = self.said(name)
        if row.kind not in ("nothing", "word"):
            self.variables.follow(self.part, row.ours, name, said)
        if row.kind == "word":
            word = self.text(name, str(row.default))
            if word.lower() not in (row.words or {}):
                self.notes.error(f"{self.path}.{name} = {word!r} has no counterpart")
            self.values[row.ours] = (row.words or {}).get(word.lower())
        elif row.kind == "nothing":
            return
        elif said is None:
            if row.default is not UNSAID and row.kind != "must":
                self.values.setdefault(row.ours, written(row.default, row.kind))
        elif row.kind == "text":
            self.values[row.ours] = self.text(name)
        else:
            try:
                found = self.scope.value_of(said)
                if row.kind == "must" and found != row.default:
                    self._tell(self.notes.error, said)
                elif row.kind != "must":
                    value = self._by_name(said, found, row.kind) or written(found, row.kind)
                    self.values |= {} if value is None else {row.ours: value}
            except (ExpressionError, TypeError, ValueError, OverflowError) as error:
                self._tell(self.notes.error, said, f": {error}")

    def _by_name(self, said: Property, value: object, kind: str) -> str | None:
        """``${...}`` over the parameters of the model with this value; None if the values would differ."""
        own, scope = self.part.around.own_names, self.scope
        if is_text(said):
            return None
        tree = parse(said.value or "")
        used = {each for each in names_of(tree) & own.keys() if scope.own(each) in (None, said)}
        try:
            ours = scope.meaning(tree, {each: named(own[each]) for each in used}, asking=said, during_run=False)
            found = evaluate(ours.text, {own[each]: scope(each) for each in used}) if isinstance(ours, Code) else None
        except (ExpressionError, OwnError, KeyError):
            return None
        is_time = kind in ("time", "end", "once")
        if not isinstance(ours, Code) or found != value or not (is_time or type(found) is type(value)):
            return None
        self.part.around.used |= used
        return f"${{{ours.text}}}"


def written(value: Any, kind: str) -> object:
    """A value in the form written for a parameter of this kind; None if that is to be left out."""
    if value is None:
        raise ValueError("nil cannot be written")
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    match kind:
        case "limit":
            return value if is_number and value > 0 else None
        case "end":
            return seconds(value) if is_number and value < 1e300 else None
        case "once":
            return seconds(value) if not is_number or 0 <= value < math.inf else "1e8 s"
        case "time":
            return seconds(value)
        case "list":
            return [plain(each) for each in (value if isinstance(value, list) else [value])]
    return plain(value)


# -- what a row cannot express ----------------------------------------------------------------------------------------


Special = Callable[[Actor], None]


def _set_variable(actor: Actor) -> None:
    """A SetVariable, which starts with the value set in the model."""
    try:
        value = None if actor.scope.around is None else actor.scope.around(actor.text("variableName"))
    except (KeyError, ExpressionError):
        return
    if value is not None:
        actor.values["value"] = plain(value)


def _chosen_input(actor: Actor) -> None:
    """A ConfigurationSelect, which passes on one of its inputs."""
    is_true = actor.get("selector", False) is True
    actor.part.unwired.add("falseInput" if is_true else "trueInput")


def _fields(actor: Actor) -> None:
    """The ports added to a RecordAssembler or RecordDisassembler are the fields: inputs, or outputs."""
    sends = any(face.direction == "output" for face in actor.row.ports.values())
    known = Names(actor.row.ports)
    for port in actor.part.entity.ports.values():
        is_field = port.flag("input" if sends else "output") and port.name not in actor.row.ports
        if is_field and actor.widths.get(port.name, 0):
            actor.ports[port.name] = known.of(port.name)
    actor.values["fields"] = [*actor.ports.values()]
    for name, ours in known.renamed().items():
        actor.notes.note(f"{actor.path}.{name} is renamed {ours}")


def _expression(actor: Actor) -> None:
    """An Expression, whose inputs are ports added in the model."""
    entity = actor.part.entity
    actor.told.add("expression")
    names = Names(("output", "gives", "hold"), in_expressions=True)
    parameters = [name for name, said in entity.properties.items() if said.kind.endswith("PortParameter")]
    # Inputs with an initial value: linked PortParameters, and ports with a default.
    held = {name: entity.properties[name] for name in parameters if actor.widths.get(name, 0)}
    for port in entity.ports.values():
        if port.flag("input") and port.word("defaultValue"):
            held[port.name] = port.properties["defaultValue"]
    ports = [port.name for port in entity.ports.values() if port.flag("input") and port.name not in parameters]
    actor.ports |= {name: names.of(name) for name in dict.fromkeys([*ports, *held])}
    for name, ours in names.renamed().items():
        actor.notes.note(f"{actor.path}.{name} is renamed {ours}")
    known: dict[str, Meaning] = {name: named(ours, actor.kinds.get(name)) for name, ours in actor.ports.items()}
    known |= {"time": named("time"), "iteration": named("iteration", int)}
    try:
        tree = parse(entity.text("expression") or "")
        used = names_of(tree)
        actor.told |= used
        said = actor.following(actor.scope.meaning(tree, known))
        for name in held.keys() & used:
            actor.held[actor.ports[name]] = plain(actor.scope.value_of(held[name]))
    except (ExpressionError, ValueError) as error:
        actor.notes.error(f"{actor.path}: expression: {error}")
        return
    actor.values |= {"iteration": True} if "iteration" in used else {}
    actor.expression(said)


# -- random numbers ---------------------------------------------------------------------------------------------------


def _law(actor: Actor) -> None:
    """The distribution of a random actor."""
    said = dict(actor.row.settings["law"])
    found: dict[str, Any] = {"type": said.pop("type")}
    for ours, text in said.items():
        value = actor.value(text)
        fed = [name for name in names_of(parse(text)) if actor.widths.get(name, 0)]
        if fed:
            actor.notes.error(f"{actor.path}.{fed[0]}: a distribution that changes during the run has no counterpart")
        if value is not None:
            found[ours] = value
    actor.values["distribution"] = found
    _generator(actor)


def java_hash(text: str) -> int:
    """The hash of a text in Java."""
    found = 0
    for character in text:
        found = (31 * found + ord(character)) % 2**32
    return (found + 2**31) % 2**32 - 2**31


def _generator(actor: Actor) -> None:
    """The numbers of Java's generators, if the model fixes them by its own seed or the shared one."""
    root = actor.part.root
    own, shared = actor.get("privateSeed"), actor.get("seed")
    for each in root.with_property("seed") if shared is None else ():  # the value set at one holds for all
        if each.row is not None and each.row.type in ("Random", "PoissonClock"):
            shared = shared or each.value(each.entity.properties["seed"], actor.notes)
    kind = "DRand" if ".colt." in actor.part.entity.java else "JavaRandom"
    law = actor.values.get("distribution", {}).get("type", "Exponential")  # which a PoissonClock draws
    if law not in LAWS and (own or shared):
        actor.notes.note(f"{actor.path}: the numbers of its {law} distribution will differ")
    elif isinstance(own, int):
        actor.values["generator"] = {"type": kind, "seed": own}
    elif isinstance(shared, int) and shared:
        actor.values["generator"] = {"type": kind, "seed": shared + java_hash(f".{root.entity.name}.{actor.path}")}


# -- checks -----------------------------------------------------------------------------------------------------------


def _test(actor: Actor) -> None:
    """A Test or NonStrictTest: expected values, on one channel or on several together."""
    actor.told.add("correctValues")
    said, written, why = actor.said("correctValues"), None, "is in training mode and checks nothing"
    if _shared(actor, "trainingMode") is not True:
        try:
            values = [True] if said is None else actor.scope.value_of(said)
            written = plain(values if isinstance(values, list) else [values])
        except (ExpressionError, ValueError) as error:
            why = f"checks nothing: correctValues: {error}"
    if not isinstance(written, list):
        actor.notes.note(f"{actor.path} {why}")
        actor.values = {"type": "Recorder"}
        actor.told |= actor.row.parameters.keys()
        return
    width = actor.widths.get("input", 1)
    is_strict = actor.part.entity.kind == "Test"
    if is_strict and width == 1:  # an array holds the values of all channels, here of one
        written = [each[0] if type(each) is list and len(each) == 1 else each for each in written]
    elif is_strict and written and all(type(each) is list for each in written):
        actor.values["together"] = True
    complete = _shared(actor, "requireAllCorrectValues")
    actor.values = {"values": written, **actor.values}
    actor.values |= {"complete": complete} if isinstance(complete, bool) else {}


def _shared(actor: Actor, name: str) -> object:
    """A parameter that all actors of a class share: the last one in the file sets it for all."""
    actor.told.add(name)
    for each in reversed(actor.part.root.with_property(name)):
        if each.entity.java == actor.part.entity.java:
            return actor.part.value(each.entity.properties[name], actor.notes)
    return None


SPECIAL: Mapping[str, Special] = {
    "set_variable": _set_variable,
    "chosen_input": _chosen_input,
    "fields": _fields,
    "expression": _expression,
    "generator": _generator,
    "test": _test,
}
