"""Model files and files of composite classes: the keys of everything that they declare, and how they are read."""

from __future__ import annotations

from dataclasses import replace
from keyword import iskeyword, kwlist

from epicycle.actors import Actor, UnitError, in_si, parse_unit
from epicycle.actors.expression import CONSTANTS, FUNCTIONS
from epicycle.aspects import Aspect

from ..catalogue import LIKE, dialects
from ..text import (
    MAX_SEED,
    NAME,
    NORMAL,
    SURE,
    Entry,
    Mapping,
    Node,
    NodeReader,
    Position,
    Problems,
    Scalar,
    Text,
    is_empty,
    nearest,
)
from .declarations import CompositeText, ConnectionText, ModelText, ParameterText, PartText, PortText
from .fields import (
    AT,
    COMPUTED_FLAG,
    LABEL,
    NAMED,
    QUANTITY_SCHEMA,
    TEXT,
    TEXTS,
    Construct,
    Key,
    Schema,
    Shape,
    computed,
    named,
    names_of,
    node_as,
    number,
    one_or_more,
    ref,
)
from .fields import NAME as NAME_PATTERN
from .metrics import METRICS
from .modes import OF_MODES, machine_of
from .monitors import MONITORS
from .places import CONNECTIONS, PATTERNS, POINTCUTS

# -- ports and parameters -----------------------------------------------------------------------------------------

PORT = Construct(
    "A port of a composite: its type, or {type, doc}.",
    {
        "type": Key(
            AT,
            "What passes through it, such as float, 'float | int', array[2] or a token class.",
            called="the type of {what}",
        ),
        "doc": Key(TEXT, "What it is."),
    },
    type=["object", "string", "null"],
)


def _ports(reader: NodeReader, node: Node, what: str) -> dict[str, PortText]:
    """``[a, b]`` or ``{a: type, b: {type: ..., doc: ...}, c: }``."""
    if isinstance(node, Mapping):
        found = [_port(reader, name, entry) for name, entry in node.entries.items()]
    else:
        found = [PortText(text.text, text.position) for text in reader.texts(node, what)]
    ports: dict[str, PortText] = {}
    for port in found:
        if not NAME.match(port.name):
            reader.problems.add(f"{port.name!r} is not a port name", port.position)
            continue
        if port.name in ports:
            reader.problems.add(f"port {port.name!r} is declared twice", port.position)
        ports[port.name] = port
    return ports


def _port(reader: NodeReader, name: str, entry: Entry) -> PortText:
    what = f"port {name!r}"
    if isinstance(entry.value, Mapping):
        said = PORT.read(reader, entry.value, what) or {}
    else:
        said = {} if is_empty(entry.value) else {"type": AT.read(reader, entry.value, f"the type of {what}")}
    return PortText(name, entry.key.position, **said)


def _unit(reader: NodeReader, node: Node, what: str) -> str | None:
    unit = reader.text(node, f"unit of {what}")
    try:
        if unit:
            parse_unit(unit)
    except UnitError as error:
        reader.problems.add(f"{what}: {error}", node.position)
    return unit


def _choices(reader: NodeReader, node: Node, what: str) -> tuple[str, ...]:
    before = len(reader.problems)
    found = tuple(text.text for text in reader.texts(node, "choices"))
    if not found and len(reader.problems) == before:
        reader.problems.add(f"{what} has an empty list of choices", node.position)
    return found


_FREE_NUMBER = number(float)


def _bound(reader: NodeReader, node: Node, what: str) -> float | str | None:
    """A number, or a text with a unit, which is converted once the parameter's own is known."""
    value = node.value if isinstance(node, Scalar) else None
    try:
        if isinstance(value, str) and in_si(value) is not None:
            return value
    except UnitError as error:
        reader.problems.add(f"{what}: {error}", node.position)
        return None
    found: float | None = _FREE_NUMBER.read(reader, node, what)
    return found


_BOUND = Shape(QUANTITY_SCHEMA, _bound)
_OF_PARAMETER = "{key} of {what}"
PARAMETER = Construct(
    "",
    {
        "value": Key(node_as({}), "The default; without one, a value must be given."),
        "unit": Key(Shape(ref("text"), _unit), "The unit of numbers, such as m/s; 1 for a pure number.", "{what}"),
        "min": Key(_BOUND, "The smallest value, in its unit or with one of its own.", _OF_PARAMETER),
        "max": Key(_BOUND, "The largest value, in its unit or with one of its own.", _OF_PARAMETER),
        "choices": Key(Shape(one_or_more(LABEL), _choices), "The texts to choose from.", "{what}"),
        "doc": Key(TEXT, "What it is.", _OF_PARAMETER),
    },
    type=["object", "array", "string", "number", "boolean", "null"],
)


def _parameter(reader: NodeReader, name: str, entry: Entry) -> ParameterText:
    """``name: value`` or ``name: {value: ..., unit: ..., min: ..., max: ..., choices: ..., doc: ...}``."""
    if name in _NO_PARAMETERS or iskeyword(name):
        meaning = "the index of an instance in its array" if name == "index" else "something else"
        message = f"a parameter cannot be called {name!r}: in expressions, that name means {meaning}"
        reader.problems.add(message, entry.key.position, "give it another name")
    if not isinstance(entry.value, Mapping):
        return ParameterText(name, entry.key.position, entry.value)
    what = f"parameter {name!r}"
    entries = PARAMETER.entries(reader, entry.value, what) or {}
    before = len(reader.problems)
    said = PARAMETER.values(reader, entries, what, entry.key.position)
    found = ParameterText(name, entry.key.position, **said, given=tuple(entries))
    is_known = found.unit or not {type(found.min), type(found.max)} & {str}  # otherwise it may be inherited
    if len(reader.problems) == before and is_known:
        try:
            found.bounds()
        except UnitError as error:
            at = next(key for key in ("min", "max") if key in entries)
            reader.problems.add(f"{what}: {error}", entries[at].value.position)
    return replace(found, spoilt=len(reader.problems) > before)


_NO_PARAMETERS = {"index", *CONSTANTS, *FUNCTIONS}

# -- actors, aspects and figures ----------------------------------------------------------------------------------

# The keys besides the parameters of an actor or aspect.
BESIDE = {
    "count": Key(
        node_as(computed("integer", 0, NORMAL.actors)),
        "The number of instances, name[0] to name[count - 1]; see 'index'.",
    ),
    "priority": Key(
        node_as(computed("integer")),
        "Of two actors at the same tag and depth, the one with the smaller priority fires first.",
    ),
    "at": Key(
        POINTCUTS,
        "Where it attaches: patterns of ports or actors, 'a.out -> b.in', {type, port}, {tag, port}; not at !pattern.",
    ),
    "tags": Key(TEXTS.described(one_or_more(ref("text"))), "Names by which aspects can select it: 'at: {tag: ...}'."),
    "enabled": Key(node_as(COMPUTED_FLAG), "Whether it is active (default: true)."),
}
RESERVED = {"actor": Actor.reserved, "aspect": Aspect.reserved, "figure": frozenset({"type"})}


def part(reader: NodeReader, name: str, entry: Entry, kind: str, *, derived: bool = False) -> PartText | None:
    """``name: {type: ..., ...}``; in a class that extends another, ``type`` may be missing, or ``name: null``."""
    problems = reader.problems
    if derived and is_empty(entry.value):
        return PartText(name, entry.key.position, Text("", entry.key.position), removes=True)
    if not isinstance(entry.value, Mapping):
        said = entry.value.value if isinstance(entry.value, Scalar) else None
        type_said = said if isinstance(said, str) and NAME.match(said) else "..."
        hint = f"write '{name}: {{type: {type_said}}}' with the {kind}'s type and parameters"
        problems.add(f"{kind} {name!r} is not a mapping", entry.value.position, hint)
        return None
    values = dict(entry.value.entries)
    kind_entry = values.pop("type", None)
    if (kind_entry is None and not derived) or (kind_entry is not None and is_empty(kind_entry.value)):
        meant = None if kind_entry is not None else nearest("type", values, SURE)
        near = f", did you mean 'type' by {meant!r}?" if meant is not None else ""
        at = entry.key if meant is None else values[meant].key
        problems.add(f"{kind} {name!r} has no type{near}", at.position, *(() if near else ("add 'type: ...'",)))
        return None
    type_name = Text("", entry.key.position)
    if kind_entry is not None:
        type_name = AT.read(reader, kind_entry.value, f"the type of {name!r}")
        if type_name is None:
            return None
    beside = {key: values.pop(key).value for key in sorted(RESERVED[kind]) if key in values}
    read = {key: BESIDE[key].shape.read(reader, node, key) for key, node in beside.items()}
    return PartText(name, entry.key.position, type_name, values, **read)


def parts(kind: str, definition: str = "", *, derived: bool = False) -> Shape:
    """Actors, aspects or figures by name."""
    return named(ref(definition or kind), lambda reader, name, entry: part(reader, name, entry, kind, derived=derived))


# -- composite classes --------------------------------------------------------------------------------------------


def _like(default: str) -> dict[str, Key]:
    """The dialect of a director."""
    doc = f"{LIKE.doc[:1].upper()}{LIKE.doc[1:]} (default: {default})."
    return {"like": Key(node_as({"type": "string"}), doc)}


MODEL_DIRECTOR = Construct(
    "The rules of the model's director, and of the directors inside that do not override them.",
    _like("epicycle"),
)
DIRECTOR = Construct(
    "A separate director, with a local clock.",
    {
        "start": Key(
            node_as(computed("number", unit="s")), "The local time when the run begins (default: the time outside)."
        ),
        "drift": Key(
            node_as(computed("number", unit="1")), "The rate of local time; 1 is as fast as the time outside."
        ),
        **_like("as outside"),
    },
)
DOC = Key(TEXT, "What it shows or does.")
INCLUDE = Key(TEXTS, "Files of composite classes, in or below this folder.")
PARAMETERS = Key(
    Shape(
        {
            **names_of(ref("parameter")),
            "propertyNames": {"pattern": f"^{NAME_PATTERN}$", "not": {"enum": sorted({*_NO_PARAMETERS, *kwlist})}},
        },
        named({}, _parameter).read,
    ),
    "Parameters: 'name: value' or 'name: {value, unit, min, max, choices, doc}'.",
)
_PORTS = Shape({"anyOf": [one_or_more(ref("name")), names_of(ref("port_declaration"))]}, _ports)
_SAID_OF_PORTS = "a list of names, or 'name: type' or 'name: {type, doc}'."
ACTORS = Key(parts("actor"), "The actors of the graph: 'name: {type, count, <parameter>: <value>, ...}'.")
ASPECTS = Key(
    parts("aspect"), "Aspects that attach to ports and actors: 'name: {type, at, enabled, <parameter>: <value>}'."
)


def _base(reader: NodeReader, node: Node, what: str) -> Text:
    """The name of a class; empty if the node is not a name, which has been reported."""
    return Text(reader.name(node, what) or "", node.position)


COMPOSITE = Construct(
    "A composite class: a graph with its own ports.",
    {
        "doc": DOC,
        "extends": Key(
            Shape(ref("name"), _base),
            "The composite class that this one inherits from and changes.",
            "the class to extend",
        ),
        "parameters": PARAMETERS,
        "inputs": Key(_PORTS, f"The input ports: {_SAID_OF_PORTS}"),
        "outputs": Key(_PORTS, f"The output ports: {_SAID_OF_PORTS}"),
        "director": Key(
            Shape(ref("director"), lambda reader, node, what: DIRECTOR.entries(reader, node, what) or {}),
            "Its own director: the composite fires as one actor, in local time.",
            "the director of {what}",
        ),
        "actors": ACTORS,
        "connections": Key(
            CONNECTIONS,
            "Connections: 'actor.port -> actor.port, actor.port', '=>' for all to all; or {from, to, all, delay}.",
        ),
        "aspects": ASPECTS,
        **OF_MODES,
    },
)
# Where a class extends another, its actors and aspects may be changes to inherited ones.
_CHANGES = {
    "actors": Key(parts("actor", "changed_actor", derived=True), ACTORS.doc),
    "aspects": Key(parts("aspect", "changed_aspect", derived=True), ASPECTS.doc),
}
HEIR = Construct(COMPOSITE.doc, {**COMPOSITE.keys, **_CHANGES})


def composite_schema() -> Schema:
    """The schema of a composite class, which may extend another."""
    found = COMPOSITE.schema
    for key, changes in _CHANGES.items():
        found["properties"][key] = {"description": changes.doc}
    return {
        **found,
        "if": {"required": ["extends"]},
        "then": {"properties": {key: each.shape.schema for key, each in _CHANGES.items()}},
        "else": {"properties": {key: COMPOSITE.keys[key].shape.schema for key in _CHANGES}},
    }


def _composite(reader: NodeReader, name: str, entry: Entry) -> CompositeText | None:
    entries = COMPOSITE.entries(reader, entry.value, f"composite {name!r}")
    return None if entries is None else composite(reader, name, entries, entry.key.position)


def composite(reader: NodeReader, name: str, entries: dict[str, Entry], position: Position) -> CompositeText:
    """The keys that a model and a composite class share."""
    problems = reader.problems
    before = len(problems)
    derived = "extends" in entries
    said = (HEIR if derived else COMPOSITE).values(reader, entries, repr(name), position)
    machine = {key: entries[key] for key in OF_MODES if said.pop(key, None) is not None and key in entries}
    if machine:
        said.setdefault("outputs", {}).setdefault(
            "mode", PortText("mode", position, doc="the mode that it has entered")
        )
        said |= machine_of(reader, name, machine, entries, position)
    inputs, outputs = said.get("inputs", {}), said.get("outputs", {})
    for port in outputs.values():
        if port.name in inputs:
            problems.add(f"port {port.name!r} is declared twice", port.position)
    for actor in said.get("actors", {}).values():
        if actor.name in inputs or actor.name in outputs:
            problems.add(f"{actor.name!r} is the name of both an actor and a port", actor.position, "rename one")
    written: tuple[ConnectionText | None, ...] = said.pop("connections", (None,) if "connections" in entries else ())
    connections = [each for each in written if each is not None]
    for each in connections:
        if each.removes is not None and not derived:
            problems.add(f"{name} extends no class, so it has no connection to remove", each.removes)
    return CompositeText(
        name,
        position,
        **said,
        connections=tuple(each for each in connections if derived or each.removes is None),
        is_wired=None not in written,
        spoilt=len(problems) > before or (derived and not said["extends"].text),
    )


COMPOSITES = Key(named(ref("composite"), _composite), "Composite classes, for the types of actors.")

# -- whole files --------------------------------------------------------------------------------------------------

RUN = Construct(
    "When a run ends, and what it records.",
    {
        "stop": Key(node_as(computed("number", 0.0, unit="s")), "Time at which a run ends, such as 30 s."),
        "stop_when": Key(
            PATTERNS,
            "Output ports that end the run: at true, at a number other than 0, at any crossing of an `ODE`.",
        ),
        "seed": Key(node_as(computed("integer", 0, MAX_SEED)), "Seed of all random streams."),
        "record": Key(PATTERNS, "Output ports whose tokens are recorded, as patterns."),
    },
)


def _model_director(reader: NodeReader, node: Node, what: str) -> dict[str, Entry]:
    """What a file declares about the model's director."""
    if isinstance(node, Scalar) and node.value in dialects():
        reader.problems.add(f"{what} is not a mapping", node.position, f"write 'director: {{like: {node.value}}}'")
        return {}
    if isinstance(node, Mapping):
        for key in [key for key in ("start", "drift") if key in node.entries]:
            message = f"{what} has no {key!r}: the time of a run begins at 0 and has no drift"
            hint = "give it to the director of a composite, which has local time"
            reader.problems.add(message, node.entries[key].key.position, hint)
        node = replace(node, entries={key: each for key, each in node.entries.items() if key not in ("start", "drift")})
    return MODEL_DIRECTOR.entries(reader, node, what) or {}


LIBRARY = Construct("", {"doc": DOC, "include": INCLUDE, "composites": COMPOSITES})
MODEL = Construct(
    "",
    {
        "model": Key(
            NAMED,
            "The name of the model.",
            "the model's name",
            missing=("the model has no name", "begin the file with a line like 'model: my_model'"),
            name="name",
        ),
        "doc": DOC,
        "include": INCLUDE,
        "parameters": PARAMETERS,
        "composites": COMPOSITES,
        "director": Key(Shape(ref("model_director"), _model_director), MODEL_DIRECTOR.doc, "the director of {what}"),
        "actors": ACTORS,
        "connections": COMPOSITE.keys["connections"],
        "aspects": ASPECTS,
        "run": Key(Shape(ref("run"), RUN.entries), RUN.doc),
        "metrics": Key(
            Shape(METRICS.schema, lambda reader, node, what: tuple(METRICS.read(reader, node, what).values())),
            "Numbers computed from what ports send: 'name: {of, take, after, unit, ...}'.",
        ),
        "monitors": Key(
            Shape(MONITORS.schema, lambda reader, node, what: tuple(MONITORS.read(reader, node, what).values())),
            "Properties that a run must have: 'name: always port >= 2 m', or 'name: {property, between, stop, ...}'.",
        ),
        "figures": Key(parts("figure"), "Figures of a run: 'name: {type, ...}'."),
    },
)
_OF_ROOT = {key for key, each in MODEL.keys.items() if COMPOSITE.keys.get(key) is each}  # as in other composites
_OF_FILE = Construct("", {key: each for key, each in MODEL.keys.items() if key not in _OF_ROOT})


def model_of(node: Node, problems: Problems) -> ModelText | None:
    """The declarations of a model file: one with the key ``model``."""
    reader = NodeReader(problems)
    entries = MODEL.entries(reader, node, "the model")
    if entries is None:
        return None
    said = _OF_FILE.values(reader, entries, "the model", node.position)
    own = {key: entry for key, entry in entries.items() if key in _OF_ROOT}
    director = said.pop("director", None)
    root = composite(reader, said.pop("name", "model"), own, node.position)
    return ModelText(replace(root, director=director), **said)


def library_of(node: Node, problems: Problems) -> ModelText | None:
    """The declarations of a file of composite classes."""
    said = LIBRARY.read(NodeReader(problems), node, "an included file")
    return None if said is None else ModelText(CompositeText("", node.position, said.pop("doc", "")), **said)
