"""What a model file says, read off its nodes: shape is checked here, meaning in ``elaborate``."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from keyword import iskeyword

from epicycle.actors import Parameter, ParameterError, UnitError, declared_parameters, parse_unit
from epicycle.actors.expression import CONSTANTS, FUNCTIONS
from epicycle.aspects import FiringTime

from ..catalogue import TAKES, Measure, take_problem
from ..text import (
    NAME,
    SURE,
    Entry,
    Mapping,
    Node,
    NodeReader,
    Position,
    Scalar,
    Sequence,
    Text,
    inside,
    nearest,
    split,
)

MODEL_KEYS = (
    "model",
    "doc",
    "include",
    "parameters",
    "composites",
    "actors",
    "connections",
    "aspects",
    "run",
    "metrics",
    "figures",
)
DISTURBANCE_KEYS = ("disturbance", "doc", "set", "parameters", "composites", "aspects")
STUDY_KEYS = (
    "study",
    "doc",
    "model",
    "set",
    "vary",
    "disturb",
    "replications",
    "seed",
    "paired",
    "until",
    "metrics",
    "claims",
    "guideline",
    "figures",
)
STUDY_METRIC_KEYS = ("value", "unit", "to", "doc")
RANGE_KEYS = ("from", "to", "step")
HYPERCUBE_KEYS = ("size", "seed", "ranges")
UNTIL_KEYS = ("metric", "half_width", "batch", "at_most")
CLAIM_KEYS = ("doc", "less", "greater", "rises", "falls", "always", "at", "than", "over", "per", "where", "share")
GUIDELINE_KEYS = ("choose", "least", "greatest", "tolerance")
LIBRARY_KEYS = ("doc", "include", "composites")
COMPOSITE_KEYS = ("doc", "extends", "parameters", "inputs", "outputs", "director", "actors", "connections", "aspects")
DIRECTOR_KEYS = ("start", "drift")
PARAMETER_KEYS = ("value", "unit", "min", "max", "choices", "doc")
PORT_KEYS = ("type", "doc")
CONNECTION_KEYS = ("from", "to", "all", "delay")
POINTCUT_KEYS = ("at", "type", "tag", "port", "parameter", "request", "time")
RUN_KEYS = ("stop", "stop_when", "seed", "record")
METRIC_KEYS = ("of", *declared_parameters(Measure))


@dataclass
class ParameterText:
    """A parameter that a model or composite declares."""

    name: str
    position: Position
    value: Node | None = None
    unit: str = ""
    min: float | None = None
    max: float | None = None
    choices: tuple[str, ...] = ()
    doc: str = ""
    spoilt: bool = False  # the declaration is wrong and has been told so: values are not checked against it
    given: tuple[str, ...] = ("value",)  # the keys of the declaration, which change those of an inherited one


@dataclass
class PortText:
    """A port that a composite declares; without a type it is as the ports that are connected to it."""

    name: str
    position: Position
    type: Text | None = None
    doc: str = ""


@dataclass
class PointcutText:
    """Where an aspect stands: a pattern, or a type or tag and perhaps a port; ``exclude``: where it does not.

    For an aspect that is a model, ``request`` is the port by which tokens or firings come in, ``time`` says that it
    stands at actors and how long their firings take; ``firing_time`` is its value.
    One that holds neither pattern, type nor tag is misshapen, and has been told so.
    """

    text: str
    position: Position
    exclude: bool = False
    type: Text | None = None
    tag: Text | None = None
    port: Text | None = None
    parameter: Text | None = None
    request: Text | None = None
    time: Node | None = None
    firing_time: FiringTime = 0.0

    @classmethod
    def of(cls, text: Text) -> PointcutText:
        """``pattern``, or ``!pattern`` for where an aspect does not stand."""
        pattern = text.text.strip()
        exclude = pattern.startswith("!")
        return cls(pattern[1:].strip() if exclude else pattern, text.position, exclude)


@dataclass
class PartText:
    """An actor, aspect or figure: a type and values for its parameters.

    In a class that extends another, the type may be empty, which leaves the inherited one.
    """

    name: str
    position: Position
    type: Text
    values: dict[str, Entry] = field(default_factory=dict)
    count: Node | None = None
    at: list[PointcutText] = field(default_factory=list)
    enabled: Node | None = None
    priority: Node | None = None
    removes: bool = False  # it takes the inherited part of that name away
    tags: list[Text] = field(default_factory=list)


@dataclass
class ConnectionText:
    """One entry of ``connections``; with ``to_all``, of several on both sides each goes to all, else in pairs."""

    sources: list[Text]
    destinations: list[Text]
    position: Position
    delay: Node | None = None
    to_all: bool = False
    removes: bool = False  # it takes these connections away from the inherited ones


@dataclass
class MetricText:
    """A number taken from what a port sends; ``values`` are those of a ``Measure``."""

    name: str
    port: Text
    values: dict[str, Entry]
    position: Position


@dataclass
class CompositeText:
    """A composite class, or the model itself, which is the outermost one."""

    name: str
    position: Position
    doc: str = ""
    extends: Text | None = None
    parameters: dict[str, ParameterText] = field(default_factory=dict)
    inputs: dict[str, PortText] = field(default_factory=dict)
    outputs: dict[str, PortText] = field(default_factory=dict)
    director: dict[str, Entry] | None = None  # what is said of its own one
    actors: dict[str, PartText] = field(default_factory=dict)
    connections: list[ConnectionText] = field(default_factory=list)
    is_wired: bool = True  # whether all its connections could be read
    aspects: dict[str, PartText] = field(default_factory=dict)
    removed: dict[str, Position] = field(default_factory=dict)  # inherited actors that it does without
    spoilt: bool = False  # it could not be read as a whole, or made from its base: what is missing is no news

    def ports(self, direction: str) -> dict[str, PortText]:
        """Its ``input`` or ``output`` ports."""
        return self.inputs if direction == "input" else self.outputs


@dataclass
class ModelText:
    """A whole model file, without what it includes."""

    root: CompositeText
    include: list[Text] = field(default_factory=list)
    composites: dict[str, CompositeText] = field(default_factory=dict)
    run: dict[str, Entry] = field(default_factory=dict)
    metrics: list[MetricText] = field(default_factory=list)
    figures: dict[str, PartText] = field(default_factory=dict)


class DeclarationReader(NodeReader):
    """Reads one file's nodes; whatever is misshapen is added to ``problems`` and left out."""

    def model(self, node: Node) -> ModelText | None:
        """A file that is a model: it has the key ``model``."""
        entries = self.entries(node, "the model", MODEL_KEYS)
        if entries is None:
            return None
        name = "model"
        if "model" in entries:
            name = self.name(entries["model"].value, "the model's name") or name
        else:
            self.problems.add(
                "the model has no name", node.position, "begin the file with a line like 'model: my_model'"
            )
        text = ModelText(self.composite(name, entries, node.position))
        self.library(entries, text)
        if "run" in entries:
            text.run = self.entries(entries["run"].value, "run", RUN_KEYS) or {}
        for key, entry in self.named(entries, "metrics"):
            if (metric := self.metric(key, entry)) is not None:
                text.metrics.append(metric)
        for key, entry in self.named(entries, "figures"):
            if (part := self.part(key, entry, "figure")) is not None:
                text.figures[key] = part
        return text

    def included(self, node: Node) -> ModelText | None:
        """A file of composite classes."""
        entries = self.entries(node, "an included file", LIBRARY_KEYS)
        if entries is None:
            return None
        text = ModelText(CompositeText("", node.position))
        self.library(entries, text)
        return text

    def library(self, entries: dict[str, Entry], text: ModelText) -> None:
        """``include`` and ``composites``, which models and included files share."""
        if "include" in entries:
            text.include = self.texts(entries["include"].value, "include")
        for key, entry in self.named(entries, "composites"):
            inner = self.entries(entry.value, f"composite {key!r}", COMPOSITE_KEYS)
            if inner is not None:
                text.composites[key] = self.composite(key, inner, entry.key.position)

    def composite(self, name: str, entries: dict[str, Entry], position: Position) -> CompositeText:
        """The keys that a model and a composite class share."""
        before = len(self.problems)
        result = CompositeText(name, position)
        if "doc" in entries:
            result.doc = self.text(entries["doc"].value, "doc") or ""
        if "extends" in entries:
            base = self.name(entries["extends"].value, "the class to extend")
            result.spoilt = base is None
            result.extends = Text(base or "", entries["extends"].value.position)
        for key, entry in self.named(entries, "parameters"):
            result.parameters[key] = self.parameter(key, entry)
        for direction in ("input", "output"):
            if f"{direction}s" in entries:
                for port in self.ports(entries[f"{direction}s"].value, f"{direction}s"):
                    if port.name in result.inputs or port.name in result.outputs:
                        self.problems.add(f"port {port.name!r} is declared twice", port.position)
                    result.ports(direction)[port.name] = port
        if "director" in entries:
            director = self.entries(entries["director"].value, f"the director of {name!r}", DIRECTOR_KEYS)
            result.director = {} if director is None else director
        for key, entry in self.named(entries, "actors"):
            if (part := self.part(key, entry, "actor", derived=result.extends is not None)) is not None:
                result.actors[key] = part
                if key in result.inputs or key in result.outputs:
                    self.problems.add(
                        f"{key!r} is the name of an actor and of a port", entry.key.position, "rename one"
                    )
        if "connections" in entries:
            items = self.items(entries["connections"].value, "connections")
            result.is_wired = items is not None
            for item in items or ():
                connection = self.connection(item)
                if connection is None:
                    result.is_wired = False
                elif connection.removes and result.extends is None:
                    self.problems.add(f"{name} extends no class whose connections it could remove", item.position)
                else:
                    result.connections.append(connection)
        for key, entry in self.named(entries, "aspects"):
            if (part := self.part(key, entry, "aspect", derived=result.extends is not None)) is not None:
                result.aspects[key] = part
        result.spoilt = result.spoilt or len(self.problems) > before
        return result

    def ports(self, node: Node, what: str) -> list[PortText]:
        """``[a, b]`` or ``{a: type, b: {type: ..., doc: ...}, c: }``."""
        if not isinstance(node, Mapping):
            found = [PortText(text.text, text.position) for text in self.texts(node, what)]
        else:
            found = [self.port(name, entry) for name, entry in node.entries.items()]
        for port in found:
            if not NAME.match(port.name):
                self.problems.add(f"{port.name!r} is not a port name", port.position)
        return [port for port in found if NAME.match(port.name)]

    def port(self, name: str, entry: Entry) -> PortText:
        """One port with what is said of it."""
        port = PortText(name, entry.key.position)
        if isinstance(entry.value, Mapping):
            inner = self.entries(entry.value, f"port {name!r}", PORT_KEYS) or {}
            port.doc = (self.text(inner["doc"].value, "doc") or "") if "doc" in inner else ""
            node = inner["type"].value if "type" in inner else None
        else:
            node = None if _is_empty(entry.value) else entry.value
        if node is not None and (text := self.text(node, f"the type of port {name!r}")) is not None:
            port.type = Text(text, node.position)
        return port

    def parameter(self, name: str, entry: Entry) -> ParameterText:
        """``name: value`` or ``name: {value: ..., unit: ..., min: ..., max: ..., choices: ..., doc: ...}``."""
        result = ParameterText(name, entry.key.position)
        if name in CONSTANTS or name in FUNCTIONS or name == "index" or iskeyword(name):
            meaning = "which instance of an array it is" if name == "index" else "something else"
            self.problems.add(
                f"a parameter cannot be called {name!r}: in expressions, that name means {meaning}",
                entry.key.position,
                "give it another name",
            )
        if not isinstance(entry.value, Mapping):
            result.value = entry.value
            return result
        inner = self.entries(entry.value, f"parameter {name!r}", PARAMETER_KEYS) or {}
        result.given = tuple(inner)
        result.value = inner["value"].value if "value" in inner else None
        for key in ("unit", "doc"):
            if key in inner:
                setattr(result, key, self.text(inner[key].value, f"{key} of parameter {name!r}") or "")
        try:
            if result.unit:
                parse_unit(result.unit)
        except UnitError as error:
            self.problems.add(f"parameter {name!r}: {error}", inner["unit"].value.position)
            result.spoilt = True
        for key in ("min", "max"):
            if key in inner:
                node = inner[key].value
                try:
                    setattr(result, key, Parameter(float).convert(node.value if isinstance(node, Scalar) else ""))
                except ParameterError as error:
                    self.problems.add(f"{key} of parameter {name!r}: {error}", node.position)
                    result.spoilt = True
        if "choices" in inner:
            before = len(self.problems)
            result.choices = tuple(text.text for text in self.texts(inner["choices"].value, "choices"))
            if not result.choices and len(self.problems) == before:
                self.problems.add(f"parameter {name!r} has no choices to choose from", inner["choices"].value.position)
                result.spoilt = True
        if result.min is not None and result.max is not None and result.min > result.max:
            self.problems.add(f"parameter {name!r}: min is greater than max", inner["min"].value.position)
            result.spoilt = True
        return result

    def part(self, name: str, entry: Entry, kind: str, *, derived: bool = False) -> PartText | None:
        """``name: {type: ..., ...}``; in a class that extends another also without type, and ``name: null``."""
        if derived and _is_empty(entry.value):
            return PartText(name, entry.key.position, Text("", entry.key.position), removes=True)
        if not isinstance(entry.value, Mapping):
            said = entry.value.value if isinstance(entry.value, Scalar) else None
            type_said = said if isinstance(said, str) and NAME.match(said) else "..."
            self.problems.add(
                f"{kind} {name!r} is not a mapping",
                entry.value.position,
                f"write '{name}: {{type: {type_said}}}' with the {kind}'s type and parameters",
            )
            return None
        values = dict(entry.value.entries)
        kind_entry = values.pop("type", None)
        if (kind_entry is None and not derived) or (kind_entry is not None and _is_empty(kind_entry.value)):
            meant = None if kind_entry is not None else nearest("type", values, SURE)
            near = f", did you mean 'type' by {meant!r}?" if meant is not None else ""
            at = entry.key if meant is None else values[meant].key
            self.problems.add(
                f"{kind} {name!r} has no type{near}", at.position, *(() if near else ("add 'type: ...'",))
            )
            return None
        named = entry.key if kind_entry is None else kind_entry.value
        type_name = "" if kind_entry is None else self.text(kind_entry.value, f"the type of {name!r}")
        if type_name is None:
            return None
        part = PartText(name, entry.key.position, Text(type_name, named.position), values)
        if kind == "actor":
            for key in ("count", "priority"):
                if key in values:
                    setattr(part, key, values.pop(key).value)
            if "tags" in values:
                part.tags = self.texts(values.pop("tags").value, "tags")
        if kind == "aspect":
            if "at" in values:
                part.at = self.pointcuts(values.pop("at").value)
            if "enabled" in values:
                part.enabled = values.pop("enabled").value
        return part

    def pointcuts(self, node: Node) -> list[PointcutText]:
        """A pattern, ``!pattern``, ``{at: ...}``, ``{type: ..., port: ...}`` or ``{tag: ...}``, or a list of these."""
        found = []
        for item in node.items if isinstance(node, Sequence) else (node,):
            if not isinstance(item, Mapping):
                found += [PointcutText.of(text) for text in self.texts(item, "at")]
                continue
            entries = self.entries(item, "a pointcut", POINTCUT_KEYS) or {}
            texts = {
                key: Text(text, entry.value.position)
                for key, entry in entries.items()
                if key != "time" and (text := self.text(entry.value, f"{key} of a pointcut")) is not None
            }
            by_pattern = "at" in texts
            found.append(PointcutText.of(texts.pop("at")) if by_pattern else PointcutText("", item.position))
            if [key in entries for key in ("at", "type", "tag")].count(True) != 1 or (by_pattern and "port" in texts):
                self.problems.add(
                    "a pointcut chooses by pattern, by type or by tag",
                    item.position,
                    "write {at: ...}, {type: ..., port: ...} or {tag: ...}",
                )
                continue
            found[-1].time = entries["time"].value if "time" in entries else None
            for key, said in texts.items():
                setattr(found[-1], key, said)
        return found

    def connection(self, node: Node) -> ConnectionText | None:
        """``a.out -> b.in``, ``a[*].out => b[*].in``, ``{from: ..., to: ..., delay: ...}`` or ``{remove: ...}``."""
        if isinstance(node, Mapping) and list(node.entries) == ["remove"]:
            removed = self.connection(node.entries["remove"].value)
            return None if removed is None else replace(removed, removes=True)
        if isinstance(node, Scalar):
            text = node.value if isinstance(node.value, str) else node.text
            places = [(start, end) for arrow in ("->", "=>") for start, end in split(text, arrow)[1:]]
            if len(places) != 1:
                self.problems.add(f"{text!r} is not a connection", node.position, "write 'actor.port -> actor.port'")
                return None
            right = places[0][0]
            sources, destinations = (
                self.endpoints(node, text, 0, right - 2),
                self.endpoints(node, text, right, len(text)),
            )
            if not sources or not destinations:
                side = "right" if sources else "left"
                self.problems.add(
                    f"{text!r} has no port on its {side}", node.position, "write 'actor.port -> actor.port'"
                )
                return None
            return ConnectionText(sources, destinations, node.position, to_all=text[right - 2] == "=")
        if not isinstance(node, Mapping):
            self.problems.add(
                "this is not a connection",
                node.position,
                "write 'actor.port -> actor.port' or {from: ..., to: ..., delay: ...}",
            )
            return None
        entries = self.entries(node, "a connection", CONNECTION_KEYS) or {}
        before = len(self.problems)
        ends = {key: self.texts(entries[key].value, key) if key in entries else [] for key in ("from", "to")}
        for key, ports in ends.items():
            if not ports and len(self.problems) == before:
                self.problems.add(f"the connection has no {key!r}", node.position)
        if not ends["from"] or not ends["to"]:
            return None
        delay = entries["delay"].value if "delay" in entries else None
        to_all = False
        if "all" in entries:
            said = entries["all"].value
            if not isinstance(said, Scalar) or not isinstance(said.value, bool):
                self.problems.add("'all' of a connection is neither true nor false", said.position)
            else:
                to_all = said.value
        return ConnectionText(ends["from"], ends["to"], node.position, delay, to_all)

    def endpoints(self, node: Scalar, text: str, start: int, end: int) -> list[Text]:
        """The comma-separated ports of one side of a connection; brackets around the list are allowed."""
        side = text[start:end]
        if side.strip().startswith("[") and side.strip().endswith("]"):
            start, end = start + side.index("[") + 1, start + side.rindex("]")
        found = []
        for first, last in split(text[start:end], ","):
            part = text[start + first : start + last]
            if name := part.strip():
                offset = start + first + len(part) - len(part.lstrip())
                found.append(Text(name, inside(node, text, offset, name)))
        return found

    def metric(self, name: str, entry: Entry) -> MetricText | None:
        """``name: {of: port, take: last, unit: s, doc: ...}``."""
        inner = self.entries(entry.value, f"metric {name!r}", METRIC_KEYS)
        if inner is None:
            return None
        if "of" not in inner or _is_empty(inner["of"].value):
            self.problems.add(f"metric {name!r} does not say of what", entry.key.position, "add 'of: actor.port'")
            return None
        of = inner.pop("of").value
        port = self.text(of, "of")
        take = self.text(inner["take"].value, "take") if "take" in inner else "last"
        if take is not None and (problem := take_problem(name, take)):
            self.problems.add(problem[0], inner["take"].value.position, problem[1])
        if port is None or take not in TAKES:
            return None
        return MetricText(name, Text(port, of.position), inner, entry.key.position)


def _is_empty(node: Node) -> bool:
    return isinstance(node, Scalar) and node.value is None
