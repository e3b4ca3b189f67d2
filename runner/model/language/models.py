"""Model files and files of composite classes: the keys of everything that they declare, and how they are read."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from epicycle.actors import Parameter, to_nanoseconds

from ..catalogue.like import LIKE, dialects
from ..text.document import Entry, Mapping, Node, Scalar
from ..text.kinds import CLASS, FORM, UNKNOWN_KEY
from ..text.kinds import NAME as NOT_A_NAME
from ..text.limits import MAX_SEED
from ..text.problems import POISON, Poison, Position, Problems
from ..text.reading import NodeReader, Text
from .fields import (
    AT,
    NAMED,
    TEXT,
    TEXTS,
    TIME,
    Computed,
    Field,
    Reader,
    Record,
    Schema,
    computed,
    computed_as,
    keyed,
    named,
    nanoseconds,
    ref,
    sound,
)
from .metrics import METRICS, MONITORS, WatchText
from .modes import OF_MODES, machine_of
from .parts import PartText, parts
from .places import CONNECTIONS, PATTERNS, ConnectionText
from .ports import PARAMETERS as PARAMETER_SHAPE
from .ports import PORTS, ParameterText, PortText
from .settings import ACTS, ActText, Setting, settings_like

# -- composite classes --------------------------------------------------------------------------------------------


_START: Parameter[float | None] = Parameter(float, None, unit="s")


def _local_start(start: object) -> int | None:
    """The start of a local time in ns; it may be negative."""
    seconds = _START.convert(start)
    return None if seconds is None else to_nanoseconds(seconds)


def _like(default: str) -> dict[str, Field]:
    """The dialect of a director."""
    doc = f"{LIKE.doc[:1].upper()}{LIKE.doc[1:]} (default: {default})."
    return {"like": Field(computed_as(LIKE, schema={"type": "string"}), doc)}


MODEL_DIRECTOR = Record(
    "The rules of the model's director, and of the directors inside that do not override them.",
    _like("epicycle"),
)
DIRECTOR = Record(
    "A separate director, with a local clock.",
    {
        "start": Field(
            computed_as(_START, _local_start, computed("number", unit="s")),
            "The local time when the run begins (default: the time outside).",
        ),
        "drift": Field(
            computed_as(Parameter(float, unit="1", min=1e-6, max=1e6), schema=computed("number", unit="1")),
            "The rate of local time; 1 is as fast as the time outside.",
        ),
        **_like("as outside"),
    },
)
_SAID_OF_PORTS = "a list of names, or 'name: type' or 'name: {type, doc}'."


def _base(reader: NodeReader, node: Node, what: str) -> Text | Poison:
    """The name of a class."""
    name = reader.name(node, what)
    return POISON if name is POISON else Text(name, node.position)


@dataclass(frozen=True)
class CompositeText:
    """A composite class, or the model itself, which is the outermost composite."""

    name: str
    position: Position
    doc: str = keyed(TEXT, "What it shows or does.", default="")
    extends: Text | Poison | None = keyed(
        Reader(ref("name"), _base),
        "The composite class that this one inherits from and changes.",
        called="the class to extend",
        default=None,
    )
    parameters: dict[str, ParameterText] = keyed(
        PARAMETER_SHAPE,
        "Parameters: 'name: value' or 'name: {value, unit, min, max, choices, doc}'.",
        default_factory=dict,
    )
    inputs: dict[str, PortText] = keyed(PORTS, f"The input ports: {_SAID_OF_PORTS}", default_factory=dict)
    outputs: dict[str, PortText] = keyed(PORTS, f"The output ports: {_SAID_OF_PORTS}", default_factory=dict)
    director: dict[str, Computed] | None = keyed(
        Reader(ref("director"), DIRECTOR.read),
        "Its own director: the composite fires as one actor, in local time.",
        called="the director of {what}",
        default=None,
    )
    machine: PartText | None = None  # of its modes
    refinements: dict[str, PartText] = field(default_factory=dict)  # by the mode
    actors: dict[str, PartText] = keyed(
        parts("actor"),
        "The actors of the graph: 'name: {type, count, <parameter>: <value>, ...}'.",
        default_factory=dict,
    )
    connections: tuple[ConnectionText | Poison, ...] = keyed(
        CONNECTIONS,
        "Connections: 'actor.port -> actor.port, actor.port', '=>' for all to all; or {from, to, all, delay}.",
        default=(),
    )
    aspects: dict[str, PartText] = keyed(
        parts("aspect"),
        "Aspects that attach to ports and actors: 'name: {type, at, enabled, <parameter>: <value>}'.",
        default_factory=dict,
    )
    removed: dict[str, Position] = field(default_factory=dict)  # inherited actors that it removes
    written: tuple[Node | Poison, ...] = ()  # the values of its keys, as they are in the file

    def ports(self, direction: str) -> dict[str, PortText]:
        return self.inputs if direction == "input" else self.outputs


COMPOSITE = Record.of(CompositeText, "A composite class: a graph with its own ports.")
COMPOSITE.keys |= OF_MODES
# Where a class extends another, its actors and aspects may be changes to inherited ones.
_CHANGES = {
    "actors": Field(parts("actor", "changed_actor", derived=True), COMPOSITE.keys["actors"].doc),
    "aspects": Field(parts("aspect", "changed_aspect", derived=True), COMPOSITE.keys["aspects"].doc),
}
HEIR = Record(COMPOSITE.doc, {**COMPOSITE.keys, **_CHANGES})


def composite_schema(record: Record = COMPOSITE) -> Schema:
    """The schema of a composite class, or of a model, which may extend another."""
    found = record.schema
    for key, changes in _CHANGES.items():
        found["properties"][key] = {"description": changes.doc}
    return {
        **found,
        "if": {"required": ["extends"]},
        "then": {"properties": {key: each.shape.schema for key, each in _CHANGES.items()}},
        "else": {"properties": {key: COMPOSITE.keys[key].shape.schema for key in _CHANGES}},
    }


def _composite(reader: NodeReader, name: str, entry: Entry) -> CompositeText | Poison:
    entries = COMPOSITE.entries(reader, entry.value, f"composite {name!r}")
    return POISON if entries is POISON else composite(reader, name, entries, entry.key.position, "extends" in entries)


def composite(
    reader: NodeReader, name: str, entries: dict[str, Entry], position: Position, derived: bool
) -> CompositeText:
    """The keys that a model and a composite class share; in one that is ``derived``, they may be changes."""
    problems = reader.problems
    before = len(problems)
    read = (HEIR if derived else COMPOSITE).values(reader, entries, repr(name), position)
    declared = read.pop("connections", ())
    connections: tuple[ConnectionText | Poison, ...] = (POISON,) if declared is POISON else declared
    said = sound(read)
    if read.get("extends") is POISON:
        said["extends"] = POISON
    machine = {key: entries[key] for key in OF_MODES if said.pop(key, None) is not None and key in entries}
    if machine:
        said.setdefault("outputs", {}).setdefault(
            "mode", PortText("mode", position, doc="the mode that it has entered")
        )
        said |= machine_of(reader, name, machine, entries, position)
    inputs, outputs = said.get("inputs", {}), said.get("outputs", {})
    for port in outputs.values():
        if port.name in inputs:
            problems.add(f"port {port.name!r} is declared twice", port.position, kind=NOT_A_NAME)
    for actor in said.get("actors", {}).values():
        if actor.name in inputs or actor.name in outputs:
            message = f"{actor.name!r} is the name of both an actor and a port"
            problems.add(message, actor.position, "rename one", kind=NOT_A_NAME)
    for each in connections:
        if each and each.removes is not None and not derived:
            problems.add(f"{name} extends no class, so it has no connection to remove", each.removes, kind=CLASS)
    kept = tuple(each for each in connections if derived or not (each and each.removes))
    written = tuple(entry.value for entry in entries.values())
    wrong = (POISON,) if len(problems) > before else ()
    return CompositeText(name, position, **said, connections=kept, written=(*written, *wrong))


# -- whole files --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class RunText:
    """When a run ends, and what it records."""

    stop: Computed | None = keyed(
        computed_as(TIME, nanoseconds), "Time at which a run ends, such as 30 s.", default=None
    )
    stop_when: tuple[Text | Poison, ...] | None = keyed(
        PATTERNS,
        "Output ports that end the run: at true, at a number other than 0, at any crossing of an `ODE`.",
        default=None,
    )
    seed: Computed | None = keyed(
        computed_as(Parameter(int, min=0, max=MAX_SEED)), "Seed of all random streams.", default=None
    )
    record: tuple[Text | Poison, ...] | None = keyed(
        PATTERNS, "Output ports whose tokens are recorded, as patterns.", default=None
    )


RUN = Record.of(RunText, "When a run ends, and what it records.")


def _run(reader: NodeReader, node: Node, what: str) -> RunText | Poison:
    said = RUN.read(reader, node, what)
    return POISON if said is POISON else RunText(**sound(said))


@dataclass(frozen=True)
class ModelText:
    """A whole file, without what it includes: a model, composite classes, or a disturbance."""

    root: CompositeText
    extends: Text | None = keyed(
        AT, "The model that this one changes: packaged, or a file in or below this folder.", default=None
    )
    include: tuple[Text, ...] = keyed(TEXTS, "Files of composite classes, in or below this folder.", default=())
    settings: tuple[Setting, ...] = keyed(
        settings_like("observer[*].sensor.max_range: 5 m"),
        "Values for parameters of the model: 'path: value', as for --set.",
        key="set",
        default=(),
    )
    composites: dict[str, CompositeText] = keyed(
        named(ref("composite"), _composite), "Composite classes, for the types of actors.", default_factory=dict
    )
    run: RunText = keyed(Reader(ref("run"), _run), RUN.doc, default_factory=RunText)
    metrics: dict[str, WatchText] = keyed(
        METRICS, "Numbers computed from what ports send: 'name: {of, take, after, unit, ...}'.", default_factory=dict
    )
    monitors: dict[str, WatchText] = keyed(
        MONITORS,
        "Properties that a run must have: 'name: always port >= 2 m', or 'name: {property, between, stop, ...}'.",
        default_factory=dict,
    )
    exactly: tuple[ActText, ...] | None = keyed(
        ACTS,
        "The only acts of aspects that happen, these and the model's own: a list of {aspect, at, token}.",
        default=None,
    )
    figures: dict[str, PartText] = keyed(
        parts("figure"), "Figures of a run: 'name: {type, ...}'.", default_factory=dict
    )


def _model_director(reader: NodeReader, node: Node, what: str) -> dict[str, Computed] | Poison:
    """What a file declares about the model's director."""
    if isinstance(node, Scalar) and node.value in dialects():
        return reader.problems.add(
            f"{what} is not a mapping", node.position, f"write 'director: {{like: {node.value}}}'"
        )
    if isinstance(node, Mapping):
        for key in [key for key in ("start", "drift") if key in node.entries]:
            message = f"{what} has no {key!r}: the time of a run begins at 0 and has no drift"
            hint = "give it to the director of a composite, which has local time"
            reader.problems.add(message, node.entries[key].key.position, hint, kind=UNKNOWN_KEY)
        node = replace(node, entries={key: each for key, each in node.entries.items() if key not in ("start", "drift")})
    return MODEL_DIRECTOR.read(reader, node, what)


_OF_FILES = Record.of(ModelText).keys


def _of_file(doc: str, *keys: str, **own: Field) -> Record:
    """A kind of files: these keys in their order, some of them with a meaning of their own."""
    return Record(doc, {key: own.get(key) or _OF_FILES.get(key) or COMPOSITE.keys[key] for key in keys})


LIBRARY = _of_file("", "doc", "include", "composites")
MODEL = _of_file(
    "",
    *("model", "doc", "extends", "include", "parameters", "composites", "director", "actors", "connections", "aspects"),
    *("run", "metrics", "monitors", "figures"),
    model=Field(
        NAMED,
        "The name of the model.",
        "the model's name",
        missing=("the model has no name", "begin the file with a line like 'model: my_model'"),
        name="name",
    ),
    director=Field(Reader(ref("model_director"), _model_director), MODEL_DIRECTOR.doc, "the director of {what}"),
)
DISTURBANCE = _of_file(
    "Aspects in a separate file, to be added to a model.",
    *("disturbance", "doc", "set", "parameters", "composites", "aspects", "exactly"),
    disturbance=Field(
        NAMED,
        "The name of the disturbance.",
        "the disturbance's name",
        missing=("the disturbance has no name", "begin the file with a line like 'disturbance: my_disturbance'"),
        name="name",
    ),
    # Which may take over the ports of the aspects that they replace.
    aspects=Field(parts("aspect", "added_aspect"), COMPOSITE.keys["aspects"].doc),
)


def model_of(node: Node, problems: Problems) -> ModelText | Poison:
    """The declarations of a model file: one with the key ``model``."""
    return _read(MODEL, node, "the model", "model", problems)


def library_of(node: Node, problems: Problems) -> ModelText | Poison:
    """The declarations of a file of composite classes."""
    return _read(LIBRARY, node, "an included file", "", problems)


def disturbance_of(node: Node, problems: Problems) -> ModelText | Poison:
    """The declarations of a disturbance."""
    return _read(DISTURBANCE, node, "the disturbance", "disturbance", problems)


def _read(record: Record, node: Node, what: str, name: str, problems: Problems) -> ModelText | Poison:
    """The declarations of a kind of file; ``name`` is its name if it says none."""
    with problems.looking_for(FORM):
        reader = NodeReader(problems)
        entries = record.entries(reader, node, what)
        if entries is POISON:
            return POISON
        before, of_root = len(problems), COMPOSITE.keys.keys() - {"extends", "director"}  # as in other composites
        keys = Record("", {key: each for key, each in record.keys.items() if key not in of_root})
        said = sound(keys.values(reader, entries, what, node.position))
        own = {key: entry for key, entry in entries.items() if key in of_root}
        director = said.pop("director", None)
        root = composite(reader, said.pop("name", name), own, node.position, "extends" in entries)
        others = [entry.value for key, entry in entries.items() if key not in (*of_root, "composites")]
        # In a disturbance, whatever is wrong may use what seems unused.
        wrong = [POISON] if record is DISTURBANCE and len(problems) > before else []
        return ModelText(replace(root, director=director, written=(*root.written, *others, *wrong)), **said)
