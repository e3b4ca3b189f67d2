"""The declarations of a file as objects: models, composite classes and their parts, each with its place in the text."""

from __future__ import annotations

from dataclasses import dataclass, field

from epicycle.actors import UnitError, convert
from epicycle.aspects import FiringTime

from ..text import Entry, Node, Poison, Position, Text


@dataclass(frozen=True)
class ParameterText:
    """A parameter that a model or composite declares."""

    name: str
    position: Position
    value: Node | Poison | None = None  # poison if something is wrong with the declaration
    unit: str = ""
    min: float | str | None = None  # as written: a text has a unit of its own
    max: float | str | None = None
    choices: tuple[str, ...] = ()
    doc: str = ""
    given: tuple[str, ...] = ("value",)  # the keys of the declaration, which change those of an inherited one

    def bounds(self) -> tuple[float | None, float | None]:
        """The least and the greatest value, in its unit; raises ``UnitError``."""
        low, high = (None if each is None else convert(each, self.unit or "1") for each in (self.min, self.max))
        if low is not None and high is not None and low > high:
            raise UnitError("min is greater than max")
        return low, high


@dataclass(frozen=True)
class PortText:
    """A port that a composite declares; without a type it takes that of the ports connected to it."""

    name: str
    position: Position
    type: Text | None = None
    doc: str = ""


@dataclass(frozen=True)
class PointcutText:
    """Where an aspect attaches: a pattern, or a type or tag and perhaps a port; ``exclude``: where it does not.

    For an aspect that is a model, ``request`` is the port by which tokens or firings come in, ``time`` makes it attach
    to actors and gives the time of their firings; ``firing_time`` is its value.
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
        """``pattern``, or ``!pattern`` for where an aspect does not attach."""
        pattern = text.text.strip()
        exclude = pattern.startswith("!")
        return cls(pattern[1:].strip() if exclude else pattern, text.position, exclude)


@dataclass(frozen=True)
class PartText:
    """An actor, aspect or figure: a type and values for its parameters.

    In a class that extends another, the type may be empty, which leaves the inherited one.
    """

    name: str
    position: Position
    type: Text
    values: dict[str, Entry] = field(default_factory=dict)
    count: Node | None = None
    at: tuple[PointcutText | Poison, ...] = ()
    enabled: Node | None = None
    priority: Node | None = None
    removes: bool = False  # it removes the inherited part with that name
    tags: tuple[Text, ...] = ()


@dataclass(frozen=True)
class ConnectionText:
    """One entry of ``connections``; with ``to_all``, each source leads to all destinations, otherwise they are paired.

    If it is ``shared``, it is one channel at each port.
    """

    sources: tuple[Text, ...]
    destinations: tuple[Text, ...]
    position: Position
    delay: Node | None = None
    to_all: bool = False
    shared: bool = False
    removes: Position | None = None  # where the file removes these from the inherited ones


@dataclass(frozen=True)
class MetricText:
    """A number computed from what ports send, or from other metrics; ``values`` are those of a ``Measure``."""

    name: str
    ports: tuple[Text, ...]
    formula: Text | None
    values: dict[str, Entry]
    position: Position


@dataclass(frozen=True)
class MonitorText:
    """A property that a run must have; ``values`` are those of a ``Requirement``."""

    name: str
    values: dict[str, Entry]
    position: Position

    def place(self, key: str) -> Position:
        """Where one of its values is; its own place if that is a default."""
        return self.values[key].value.position if key in self.values else self.position


@dataclass(frozen=True)
class ActText:
    """A single act of an aspect: its place, and the number of the token there, counted from 1."""

    aspect: Text
    at: Text
    token: int
    position: Position


@dataclass(frozen=True)
class CompositeText:
    """A composite class, or the model itself, which is the outermost composite."""

    name: str
    position: Position
    doc: str = ""
    extends: Text | Poison | None = None
    parameters: dict[str, ParameterText] = field(default_factory=dict)
    inputs: dict[str, PortText] = field(default_factory=dict)
    outputs: dict[str, PortText] = field(default_factory=dict)
    director: dict[str, Entry] | None = None  # what it declares about its own director
    machine: PartText | None = None  # of its modes
    refinements: dict[str, PartText] = field(default_factory=dict)  # by the mode
    actors: dict[str, PartText] = field(default_factory=dict)
    connections: tuple[ConnectionText | Poison, ...] = ()
    aspects: dict[str, PartText] = field(default_factory=dict)
    removed: dict[str, Position] = field(default_factory=dict)  # inherited actors that it removes
    written: tuple[Node | Poison, ...] = ()  # the values of its keys, as they are in the file

    def ports(self, direction: str) -> dict[str, PortText]:
        return self.inputs if direction == "input" else self.outputs


@dataclass(frozen=True)
class ModelText:
    """A whole model file, without what it includes."""

    root: CompositeText
    include: tuple[Text, ...] = ()
    composites: dict[str, CompositeText] = field(default_factory=dict)
    run: dict[str, Entry] = field(default_factory=dict)
    metrics: tuple[MetricText, ...] = ()
    monitors: tuple[MonitorText, ...] = ()
    exactly: tuple[ActText, ...] | None = None  # the only acts of aspects that happen
    figures: dict[str, PartText] = field(default_factory=dict)
