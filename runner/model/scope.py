"""Building a model in Python: what can be done inside of a model or a composite.

A program makes and changes the same graph as a model file does, through the same rules: names, connections, pointcuts
and metrics go to the classes that read them from YAML, and a mistake raises ``ModelError`` that points at the line of
the program.  A call that fails changes nothing (``transaction``).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar, overload

from epicycle.actors import Actor, InputPort, OutputPort, accepts, type_name
from epicycle.aspects import Aspect, CompositeAspect, CompositeExecutionAspect, FiringTime

from ..language import CompositeText, ConnectionText, DeclarationReader, PartText, PointcutText, PortText, Values
from ..text import NAME, Position, Problems, Scalar, Text, call_site, did_you_mean, node_of, within
from .composite_aspect import ModelWeaving, check_nesting
from .decorated import weave_decorations
from .ends import (
    CompositePort,
    Ends,
    Instance,
    Places,
    check_aspect,
    clock_of,
    each_of,
    firing_time_of,
    mistake,
    raising,
)
from .graph import Hop
from .transaction import all_or_nothing
from .weave import Paths, Weaving
from .wiring import Child, Wiring
from .woven import WovenAspect

if TYPE_CHECKING:
    from .model import Model

_INSTANCE = re.compile(r"([A-Za-z_][A-Za-z0-9_]*)(?:\[(\d{1,9})\])?\Z")

OF_NO_CLASS = "Composite"  # what stands for the class of a composite that Python builds

A = TypeVar("A", bound=Actor)


class Scope:
    """The inside of a model or of a composite: where actors are added and connected."""

    def __init__(self, model: Model, path: str, label: str, position: Position) -> None:
        self.path = path
        self._model = model
        # What wiring reads: the same declarations that it reads of a model file.
        self._text = CompositeText(label, position)
        self._parts: dict[str, Child] = {}

    @property
    def model(self) -> Model:
        """The model that it is, or is in."""
        return self._model

    def forget_parts(self) -> None:
        """Engine: what is in here is to be found anew."""
        self._parts = {}
        self._text.actors.clear()

    @property
    def _children(self) -> dict[str, Child]:
        self._model.scopes.update()
        return self._parts

    # -- parts ----------------------------------------------------------------------------------------------------

    @overload
    def add(self, part: A, *, priority: int | None = None) -> A: ...
    @overload
    def add(self, part: Instance) -> Composite: ...
    @all_or_nothing
    def add(self, part: Actor | Instance, *, priority: int | None = None) -> Actor | Composite:
        """Add an actor, or an instance of a composite class, and return it.

        Elements of an array are called ``robot[0]``, ``robot[1]`` and so on, in this order.  Of actors of one depth,
        those of lower ``priority`` fire first, then those that were added first.  Raises ``ModelError``.
        """
        position = call_site()
        if isinstance(part, Actor) and part.home is not None:
            raise mistake(
                f"{part.path} is part of a model already, and an actor belongs to one model",
                position,
                f"make another one: {type(part).__name__}(...)",
            )
        with raising() as problems:
            full = self._free(part.path, position, problems)
        if isinstance(part, Actor):
            name = part.path
            part.move(full)
            self._model.graph.add_actor(part, position)
            try:
                with raising() as problems:
                    self._model.enlist(weave_decorations(part, self._model.graph, problems, position))
            except Exception:
                part.move(name)  # it may be added elsewhere
                raise
        else:
            part.unfold(full, self._model, position)
        if priority:
            self._model.graph.priorities[full] = priority
        self._model.changed()
        return part if isinstance(part, Actor) else self._model.scope(full)

    @all_or_nothing
    def composite(
        self,
        name: str,
        *,
        inputs: Iterable[str] = (),
        outputs: Iterable[str] = (),
        director: bool = False,
        start: float | str | None = None,
        drift: float = 1.0,
    ) -> Composite:
        """Add an empty composite, a scope for actors of its own, with ports through which it is connected.

        With ``director`` it has a director of its own and fires as one actor; local time then begins at ``start`` s
        (default: as around it) and goes ``drift`` times as fast.  Raises ``ModelError``.
        """
        position = call_site()
        with raising() as problems:
            full = self._free(name, position, problems)
            begin, speed = clock_of(full, start, drift, position, problems)
        self._model.graph.composites[full] = OF_NO_CLASS
        if director:
            self._model.graph.add_director(full, begin, speed)
        self._model.graph.positions.setdefault(full, position)
        made = self._model.scope(full)
        for port in inputs:
            made.input(port)
        for port in outputs:
            made.output(port)
        self._model.changed()
        return made

    @all_or_nothing
    def remove(self, name: str) -> None:
        """Take out an actor or a composite with all that is connected to it, stands at it and watches it."""
        position = call_site()
        child = self._children.get(name.partition("[")[0])
        full = self._full(name)
        with raising() as problems:
            if child is None or full not in child.paths:
                known = [path[len(self._full("")) :] for each in self._children.values() for path in each.paths]
                problems.add(
                    f"{self._text.name} has no actor {name!r}{did_you_mean(name, known)}",
                    position,
                    f"valid actors: {', '.join(known) or 'none'}",
                )
            elif full != child.paths[-1]:
                problems.add(f"{full} is not the last of its array", position, f"only {child.paths[-1]} can be removed")
        self._model.forget(full)

    def __getitem__(self, name: str) -> Any:
        """The actor, composite or port at a dotted path within."""
        full = self._full(name)
        graph = self._model.graph
        if full in graph.actors:
            return graph.actors[full]
        if full in graph.composites:
            return self._model.scope(full)
        if full in graph.ports:
            port = graph.ports.nodes[full]["port"]
            return CompositePort(full, graph.direction(full)) if port is None else port
        known = [*graph.actors, *graph.composites, *graph.ports]
        raise mistake(f"there is no {full!r}{did_you_mean(full, known)}", call_site())

    def _free(self, name: str, position: Position, problems: Problems) -> str:
        """The full path of a new part, if its name can be taken."""
        match = _INSTANCE.match(name)
        full = self._full(name)
        if match is None:
            problems.add(
                f"{name!r} is not a name",
                position,
                "use letters, digits and _, no digit first; an element of an array is called 'name[0]'",
                *(("what is inside of a composite is added to the composite",) if "." in name else ()),
            )
            return full
        base, index = match.groups()
        child = self._children.get(base)
        if base in self._text.inputs or base in self._text.outputs:
            problems.add(f"{self.path}.{base} is a port already", position, "give the actor another name")
        elif child is None:
            if index is not None and int(index) != 0:
                problems.add(f"{full} cannot be the first of its array", position, f"begin with {base}[0]")
        elif full in child.paths:
            at = self._model.graph.positions.get(full)
            where = (f"the first was added at {at.file}:{at.line}",) if at is not None else ()
            problems.add(f"there is a {full} already", position, *where, "give it another name")
        elif child.array != (index is not None):
            kind = "an array" if child.array else "a single actor"
            problems.add(f"{self._full(base)} is {kind} already", position, "give it another name")
        elif index is not None and int(index) != len(child.paths):
            problems.add(
                f"{full} is not the next of its array", position, f"the next is {self._full(base)}[{len(child.paths)}]"
            )
        return full

    def _full(self, name: str) -> str:
        return f"{self.path}.{name}" if self.path else name

    def enrol(self, name: str, child: Child, position: Position) -> None:
        """Engine: there is a new part, of which connections may speak."""
        base = name.partition("[")[0]
        known = self._parts.setdefault(base, child)
        if known is not child:
            known.paths += child.paths
            known.actors += child.actors
            known.count = len(known.paths)
        self._text.actors.setdefault(base, PartText(base, position, Text(child.kind, position)))

    # -- connections ----------------------------------------------------------------------------------------------

    @all_or_nothing
    def connect(self, source: Ends, destination: Ends | None = None, *, delay: float | str | None = None) -> None:
        """Connect ports, given as such or as text: ``connect(a.output, b.input)``, ``connect("a.output -> b.input")``.

        Every source is connected to every destination; in texts, ``[*]`` stands for all of an array, and on both
        sides connects equal indices.  ``delay`` is in seconds or a text with a unit; without it, tokens arrive
        within the tag in which they are sent.  Raises ``ModelError``.
        """
        position = call_site()
        graph = self._model.graph
        before = graph.mark()
        with raising() as problems:
            connection = self._connection(source, destination, delay, position, problems)
            if connection is not None:
                wiring = Wiring(self.path, self._text, self._children, graph, Values(problems), problems)
                wiring.connect(connection, {})
            for hop in graph.since(before):
                self._judge(hop, problems)
        self._model.changed()

    @all_or_nothing
    def disconnect(self, source: Ends, destination: Ends | None = None) -> None:
        """Take out the connections between ports, which are given as to ``connect``; there must be some."""
        position = call_site()
        graph = self._model.graph
        before, was_wired = graph.mark(), graph.is_wired
        try:
            with raising() as problems:
                connection = self._connection(source, destination, None, position, problems)
                if connection is not None:
                    wiring = Wiring(self.path, self._text, self._children, graph, Values(problems), problems)
                    wiring.connect(connection, {})
            pairs = dict.fromkeys((hop.source, hop.destination) for hop in graph.since(before))
        finally:
            # Connected only to find out which ports are meant.
            for hop in graph.since(before):
                graph.disconnect(hop)
            graph.is_wired = was_wired
        found = [hop for one, other in pairs for hop in graph.outgoing(one) if hop.destination == other]
        if not found:
            with raising() as problems:
                for one, other in pairs:
                    here = ", ".join(hop.destination for hop in graph.outgoing(one))
                    problems.add(
                        f"{one} is not connected to {other}", position, f"{one} is connected to: {here or 'nothing'}"
                    )
        for hop in found:
            graph.disconnect(hop)
        self._model.changed()

    def _connection(
        self,
        source: Ends,
        destination: Ends | None,
        delay: float | str | None,
        position: Position,
        problems: Problems,
    ) -> ConnectionText | None:
        """A connection as a model file would declare it."""
        if destination is None:
            if not isinstance(source, str):
                problems.add("the connection has no destination", position, "write connect(a.output, b.input)")
                return None
            connection = DeclarationReader(problems).connection(Scalar(source, source, False, position))
        else:
            sources = self._ends(source, position, problems)
            destinations = self._ends(destination, position, problems)
            connection = ConnectionText(sources, destinations, position)
        if connection is not None and delay is not None:
            connection.delay = node_of(delay, position)
        # A list that is empty connects nothing: there may be no robots.
        return connection if connection is not None and connection.sources and connection.destinations else None

    def _ends(self, ends: Ends, position: Position, problems: Problems) -> list[Text]:
        found = []
        for end in each_of(ends):
            name = end if isinstance(end, str) else self._name_of(end, position, problems)
            if name is not None:
                found.append(Text(name, within(Text(name, position), name)))
        return found

    def _known(self, port: Any, position: Position, problems: Problems) -> str | None:
        """The path of a port of this model."""
        graph = self._model.graph
        if isinstance(port, (Actor, Composite)):
            kind = "an actor" if isinstance(port, Actor) else "a composite"
            ports = [each for each in graph.ports if graph.owner(each) == port.path]
            problems.add(
                f"{port.path} is {kind}, not a port", position, f"name one of its ports: {', '.join(ports) or 'none'}"
            )
            return None
        if not isinstance(port, (InputPort, OutputPort, CompositePort)):
            problems.add(f"{port!r} is not a port", position, "give a port such as clock.output, or its path as text")
            return None
        path: str = port.path
        if not path:
            problems.add(
                f"{port!r} is declared in a class",
                position,
                "give the port of an actor that was added to the model",
            )
            return None
        if path not in graph.ports or graph.ports.nodes[path]["port"] not in (port, None):
            problems.add(f"the actor of {path} is not part of this model", position, "add it to the model first")
            return None
        return path

    def _name_of(self, port: object, position: Position, problems: Problems) -> str | None:
        """The name of a port as seen from inside this scope."""
        path = self._known(port, position, problems)
        if path is None:
            return None
        owner = path.rpartition(".")[0]
        if owner == self.path:
            return path.rpartition(".")[2]
        scope = owner.rpartition(".")[0]
        if scope != self.path:
            there = f"in {scope}" if scope else "at the top of the model"
            problems.add(
                f"{path} cannot be connected in {self._text.name}",
                position,
                f"connect it {there}, where {owner} is; ports of composites lead in and out",
            )
            return None
        return path[len(self._full("")) :]

    def _judge(self, hop: Hop, problems: Problems) -> None:
        """What can be said of a new connection at once; the rest is said when the model is whole."""
        graph = self._model.graph
        source, target = (graph.ports.nodes[path]["port"] for path in (hop.source, hop.destination))
        if source is not None and target is not None and not accepts(target.type, source.type):
            problems.add(
                f"{source.path} sends {type_name(source.type)}, but {target.path} takes {type_name(target.type)}",
                hop.position,
            )
        incoming = graph.incoming(hop.destination)
        if target is not None and not target.multi and incoming[0] is not hop:
            at = incoming[0].position
            where = f", at {at.file}:{at.line}" if at is not None else ""
            problems.add(
                f"{target.path} takes one connection, and {incoming[0].source} is connected to it already{where}",
                hop.position,
                "disconnect that one, or send through an actor that merges them",
            )

    # -- aspects --------------------------------------------------------------------------------------------------

    @all_or_nothing
    def weave(
        self,
        name: str,
        aspect: Aspect | Composite | Instance,
        *,
        at: Places | Mapping[str, Places],
        time: FiringTime | str | None = None,
    ) -> WovenAspect:
        """Let an aspect stand at ports or actors, given as such or as patterns over those that are there now.

        Aspects at one port or actor apply in the order in which they are woven.  An aspect may be a model: a composite
        of this model, or an instance of a composite class, which is added.  If it has several request ports, ``at``
        says what comes in by each: ``at={"in1": a.input, "in2": b.input}``.  With a ``time`` (s, a text with a
        unit, a distribution, or these by input port) such an aspect stands at actors, whose firings take so long.
        Raises ``ModelError``.
        """
        position = call_site()
        full = self._full(name)
        with raising() as problems:
            if not NAME.match(name):
                problems.add(f"{name!r} is not a name", position, "use letters, digits and _, no digit first")
            if any(woven.name == full for woven in self._model.aspects):
                problems.add(f"there is an aspect {full!r} already", position, "unweave it, or give this another name")
            check_aspect(aspect, (Aspect, Composite, Instance), position, problems)
            firing_time = firing_time_of(time, aspect, position, problems)
        if isinstance(aspect, Aspect):
            with raising() as problems:
                pointcuts = self._pointcuts(at, type(aspect), position, problems)
                weaving = Weaving(self._model.graph, self._paths, full, type(aspect), self.path, problems)
                woven = weaving.weave(aspect, pointcuts, lambda *_: position)
            self._model.enlist([woven])
            return woven
        model, kind = self._model, CompositeAspect if firing_time is None else CompositeExecutionAspect
        composite = aspect if isinstance(aspect, Composite) else self.add(aspect)
        with raising() as problems:
            pointcuts = self._pointcuts(at, kind, position, problems)
            for pointcut in pointcuts:
                pointcut.firing_time = firing_time or 0.0
            detour = ModelWeaving(model.graph, self._paths, full, composite.path, self.path, problems, position, kind)
            woven = detour.weave(kind(), pointcuts, lambda *_: position)
            detour.check(woven)
            check_nesting([*model.aspects, woven], model.graph, problems)
        detour.connect(woven)
        model.graph.positions.setdefault(f"aspect {full}", position)
        model.enlist([woven])
        model.changed()
        return woven

    @property
    def _paths(self) -> Paths:
        return Paths(self._model.graph)

    def _pointcuts(
        self, at: Places | Mapping[str, Places], cls: type[Aspect], position: Position, problems: Problems
    ) -> list[PointcutText]:
        """Pointcuts as a model file would declare them."""
        found = []
        for request, ends in at.items() if isinstance(at, Mapping) else ((None, at),):
            for end in each_of(ends):
                path = end if isinstance(end, str) else self._place(end, cls, position, problems)
                if path is not None:
                    here = path if path is end else path.removeprefix(self._full(""))
                    pointcut = PointcutText.of(Text(here, within(Text(here, position), here)))
                    pointcut.request = None if request is None else Text(request, position)
                    found.append(pointcut)
        return found

    def _place(self, place: object, cls: type[Aspect], position: Position, problems: Problems) -> str | None:
        """The path of a port, or of an actor or composite for an aspect that stands at such."""
        if "actor" not in cls.stands_at or not isinstance(place, (Actor, Composite)):
            return self._known(place, position, problems)
        if isinstance(place, Actor) and self._model.graph.actors.get(place.path) is not place:
            problems.add(f"{place.path} is not part of this model", position, "add it to the model first")
            return None
        return place.path

    @all_or_nothing
    def unweave(self, name: str) -> None:
        """Take an aspect out, with its composite if it is a model."""
        full = self._full(name)
        known = [woven.name for woven in self._model.aspects]
        if full not in known:
            raise mistake(
                f"the model has no aspect {full!r}{did_you_mean(full, known)}",
                call_site(),
                f"its aspects: {', '.join(known) or 'none'}",
            )
        woven = self._model.aspects[known.index(full)]
        if woven.model is None:
            self._model.aspects.remove(woven)
        else:  # its composite is of no use without it
            above, _, part = woven.model.path.rpartition(".")
            (self._model.scope(above) if above else self._model).remove(part)


class Composite(Scope):
    """A composite of a model: a scope for actors of its own, and ports through which it is connected.

    Inside, ``connect`` takes its own ports by their names alone: ``connect("trigger -> sensor.trigger")``.
    """

    def input(self, name: str) -> CompositePort:
        """Add an input port."""
        return self._port(name, "input")

    def output(self, name: str) -> CompositePort:
        """Add an output port."""
        return self._port(name, "output")

    @all_or_nothing
    def _port(self, name: str, direction: str) -> CompositePort:
        position = call_site()
        full = self._full(name)
        with raising() as problems:
            if not NAME.match(name):
                problems.add(f"{name!r} is not a port name", position)
            elif name in self._text.inputs or name in self._text.outputs:
                problems.add(f"port {full!r} is declared twice", position)
            elif name in self._children:
                problems.add(f"{full!r} is the name of an actor and of a port", position, "rename one")
        self._model.graph.add_composite_port(full, direction, position)
        self.enrol_port(name, direction, position)
        return CompositePort(full, direction)

    def enrol_port(self, name: str, direction: str, position: Position) -> None:
        """Engine: the composite has this port."""
        self._text.ports(direction)[name] = PortText(name, position)

    @property
    def declaration(self) -> CompositeText:
        """Engine: the composite as its surroundings see it."""
        return self._text

    def __repr__(self) -> str:
        inputs, outputs = ", ".join(self._text.inputs) or "none", ", ".join(self._text.outputs) or "none"
        return f"<Composite {self.path}: inputs {inputs}; outputs {outputs}>"
