"""Building a model in Python: what can be done inside a model or a composite.

A program makes and changes the same graph as a model file, by the same rules: the classes that read YAML take names,
connections, pointcuts and metrics, and a mistake raises a ``ModelError`` that points at the line of the program. Each
call first works out the result, which may raise an error but changes nothing, and then applies it.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any, TypeVar, overload

from epicycle.actors import Actor, accepts, did_you_mean, paths, type_name
from epicycle.aspects import Aspect, CompositeAspect, CompositeExecutionAspect, FiringTime

from ..graph.model_graph import ModelGraph
from ..graph.nodes import Edge
from ..graph.woven import WovenAspect
from ..language.values import Values
from ..text.problems import Position, Problems
from ..text.program import call_site
from ..text.reading import NAME, NAMES_HAVE
from .building import Building
from .composite_aspect import check_nesting, weave_model
from .composite_class import CompositeInstance
from .connect import Member, Wiring, make, member_of_actors
from .named import (
    CompositePort,
    Ends,
    Holder,
    Named,
    Places,
    check_aspect,
    director_of,
    firing_time_of,
    mistake,
    raising,
)
from .paths import Paths
from .weave import Pointcuts
from .weave_all import weave_decorations

_INSTANCE = re.compile(r"([A-Za-z_][A-Za-z0-9_]*)(?:\[(\d{1,9})\])?\Z")

OF_NO_CLASS = "Composite"  # the class name of a composite that Python builds

A = TypeVar("A", bound=Actor)


class _Members(Mapping[str, Member]):
    """The contents of a composite of a graph, looked up on demand: a program connects in many calls."""

    def __init__(self, graph: ModelGraph, path: str) -> None:
        self._graph = graph
        self._parts = graph.parts(path)

    def __getitem__(self, name: str) -> Member:
        graph, instances = self._graph, self._parts[name]
        first, is_array = instances[0], instances[0].endswith("]")
        if first in graph.actors:
            return member_of_actors(type(graph.actors[first]), instances, is_array, len(instances), graph)
        inputs, outputs = ([*map(paths.name, ports)] for ports in graph.borders(first))
        return Member(_label(graph, first), instances, is_array, len(instances), inputs, outputs)

    def __iter__(self) -> Iterator[str]:
        return iter(self._parts)

    def __len__(self) -> int:
        return len(self._parts)


class Scope(Holder):
    """The inside of a model or a composite, where actors are added and connected."""

    def __init__(self, model: Building, path: str) -> None:
        self.path = path
        self._model = model

    @property
    def _name(self) -> str:
        """Its name in messages."""
        return _label(self._model.graph, self.path) if self.path else self._model.name

    # -- parts ----------------------------------------------------------------------------------------------------

    @overload
    def add(self, part: A, *, priority: int | None = None) -> A: ...
    @overload
    def add(self, part: CompositeInstance) -> Composite: ...
    def add(self, part: Actor | CompositeInstance, *, priority: int | None = None) -> Actor | Composite:
        """Add an actor, or an instance of a composite class, and return it.

        Elements of an array are called ``robot[0]``, ``robot[1]`` and so on, in this order.  At equal depth, actors
        with lower ``priority`` fire first, then those that were added first.  Raises ``ModelError``.
        """
        position = call_site()
        if isinstance(part, Actor) and part.is_part:
            message = f"{part.path} is already part of a model, and an actor belongs to only one"
            raise mistake(message, position, f"create another one: {type(part).__name__}(...)")
        with raising() as problems:
            full = self._free(part.path, position, problems)
        made, aspects = self._made(part, full, position)
        made.components[full].priority = priority or made.components[full].priority
        graph = self._model.edit()
        graph.merge(made, graph.director_of(full))
        self._model.enlist(aspects)
        return part if isinstance(part, Actor) else self._composite(full)

    def _made(
        self, part: Actor | CompositeInstance, full: str, position: Position
    ) -> tuple[ModelGraph, list[WovenAspect]]:
        """A part to be merged, and the aspects that come with it."""
        graph = self._model.graph
        if not isinstance(part, Actor):
            return part.unfold(full, graph, position)
        made, name = graph.part(graph.director_of(full)), part.path
        part.move(full)
        made.add_actor(part, position)
        try:
            with raising() as problems:
                return made, weave_decorations(part, made, problems, position)
        except Exception:
            part.move(name)  # it may be added elsewhere
            part.is_part = False
            raise

    def composite(
        self,
        name: str,
        *,
        inputs: Iterable[str] = (),
        outputs: Iterable[str] = (),
        director: bool = False,
        start: float | str | None = None,
        drift: float = 1.0,
        like: str | None = None,
    ) -> Composite:
        """Add an empty composite, a scope for its own actors, with ports through which it is connected.

        With ``director``, it has its own director and fires as one actor; local time then begins at ``start`` s
        (default: the time outside) and runs ``drift`` times as fast.  ``like`` is the dialect of this director
        (default: that of the director outside).  Raises ``ModelError``.
        """
        position = call_site()
        made, ports = Composite(self._model, self._full(name)), [("input", each) for each in inputs]
        ports += [("output", each) for each in outputs]
        with raising() as problems:
            full = self._free(name, position, problems)
            given = director_of(full, {"start": start, "drift": drift, "like": like}, position, problems)
            for key, is_given in (("start", start is not None), ("drift", drift != 1.0), ("like", like is not None)):
                if is_given and not director:
                    message = f"{full}: {key!r} belongs to a director, and {full} has none of its own"
                    elsewhere = ", or set it for the model" if key == "like" else ""
                    problems.add(message, position, f"write director=True{elsewhere}")
        for number, (_, port) in enumerate(ports):
            made.check_port(port, [each for _, each in ports[:number]], position)
        graph = self._model.edit()
        graph.add_component(full, OF_NO_CLASS, position)
        if director:
            graph.add_director(full, **given)
        for direction, port in ports:
            graph.add_composite_port(f"{full}.{port}", direction)
        return self._composite(full)

    def remove(self, name: str) -> None:
        """Remove an actor or a composite with all connections, aspects and recordings at it."""
        position = call_site()
        full, parts = self._full(name), self._model.graph.parts(self.path)
        instances = parts.get(name.partition("[")[0], [])
        with raising() as problems:
            if full not in instances:
                known = [paths.relative(path, self.path) for each in parts.values() for path in each]
                hint = f"valid actors: {', '.join(known) or 'none'}"
                problems.add(f"{self._name} has no actor {name!r}{did_you_mean(name, known)}", position, hint)
            elif full != instances[-1]:
                problems.add(f"{full} is not the last of its array", position, f"only {instances[-1]} can be removed")
            elif full in ((around := self._model.graph.domain_of(full)).machine, *around.refinements.values()):
                problems.add(f"{full} belongs to the modes of {self.path}", position, f"remove {self.path} as a whole")
        self._model.forget(full)

    def _composite(self, full: str) -> Composite:
        """The scope of a composite, which is always the same."""
        found: Composite = self._model.scopes.setdefault(full, Composite(self._model, full))
        return found

    def __getitem__(self, name: str) -> Any:
        """The actor, composite or port at a dotted path within."""
        full = self._full(name)
        graph = self._model.graph
        if full in graph.actors:
            return graph.actors[full]
        if graph.is_composite(full):
            return self._composite(full)
        if full in graph.ports:
            port = graph.ports[full].port
            return CompositePort(full, graph.direction(full)) if port is None else port
        known = [*graph.actors, *graph.composites, *graph.ports]
        raise mistake(f"there is no {full!r}{did_you_mean(full, known)}", call_site())

    def _free(self, name: str, position: Position, problems: Problems) -> str:
        """The full path of a new part, if its name can be taken."""
        match = _INSTANCE.match(name)
        full = self._full(name)
        if match is None:
            hint = f"{NAMES_HAVE}; an element of an array is called 'name[0]'"
            inside = ("add parts of a composite to the composite",) if "." in name else ()
            problems.add(f"{name!r} is not a name", position, hint, *inside)
            return full
        base, index = match.groups()
        graph = self._model.graph
        instances = graph.parts(self.path).get(base, [])
        if self._full(base) in graph.ports:
            problems.add(f"{self.path}.{base} is already a port", position, "give the actor another name")
        elif not instances:
            if index is not None and int(index) != 0:
                problems.add(f"{full} cannot be the first of its array", position, f"begin with {base}[0]")
        elif full in instances:
            at = graph.position_of(full)
            where = (f"the first was added at {at.file}:{at.line}",) if at is not None else ()
            problems.add(f"there is already a {full}", position, *where, "give it another name")
        elif (is_array := instances[0].endswith("]")) != (index is not None):
            kind = "an array" if is_array else "a single actor"
            problems.add(f"{self._full(base)} is already {kind}", position, "give it another name")
        elif index is not None and int(index) != len(instances):
            problems.add(
                f"{full} is not the next of its array", position, f"the next is {self._full(base)}[{len(instances)}]"
            )
        return full

    def _full(self, name: str) -> str:
        return paths.join(self.path, name)

    # -- connections ----------------------------------------------------------------------------------------------

    def connect(self, source: Ends, destination: Ends | None = None, *, delay: float | str | None = None) -> None:
        """Connect ports, given as objects or text: ``connect(a.output, b.input)``, ``connect("a.output -> b.input")``.

        Every source is connected to every destination; in texts, ``[*]`` means all of an array, and on both sides
        connects equal indices.  ``delay`` is in seconds or a text with a unit; without it, tokens arrive within the tag
        in which they are sent.  Raises ``ModelError``.
        """
        position = call_site()
        with raising() as problems:
            edges = self._edges(source, destination, delay, position, problems)
            self._judge(edges, problems)
        make(edges, self._model.edit())

    def disconnect(self, source: Ends, destination: Ends | None = None) -> None:
        """Remove the connections between ports, given as for ``connect``; there must be at least one."""
        position, graph = call_site(), self._model.graph
        with raising() as problems:
            edges = self._edges(source, destination, None, position, problems)
        pairs = dict.fromkeys((edge.source, edge.destination) for edge in edges)
        found = [edge for one, other in pairs for edge in graph.outgoing(one) if edge.destination == other]
        if not found:
            with raising() as problems:
                for one, other in pairs:
                    here = ", ".join(edge.destination for edge in graph.outgoing(one))
                    problems.add(
                        f"{one} is not connected to {other}", position, f"{one} is connected to: {here or 'nothing'}"
                    )
        graph = self._model.edit()
        for edge in found:
            graph.disconnect(edge)

    def _edges(
        self, source: Ends, destination: Ends | None, delay: float | str | None, position: Position, problems: Problems
    ) -> list[Edge]:
        graph = self._model.graph
        connection = Named(graph, self.path, position, problems).connection(source, destination, delay, self._name)
        if connection is None:
            return []
        members, borders = _Members(graph, self.path), graph.borders(self.path)
        inputs, outputs = ([*map(paths.name, ports)] for ports in borders)
        wiring = Wiring(graph, Values(problems), self.path, self._name, inputs, outputs, members.keys(), members)
        return [edge for edge in wiring.resolve(connection, {}) if edge]

    def _judge(self, edges: list[Edge], problems: Problems) -> None:
        """Check what can be checked of new connections now; the rest is checked when the model is complete."""
        graph, new = self._model.graph, dict[str, Edge]()
        for edge in edges:
            source, target = (graph.ports[path].port for path in (edge.source, edge.destination))
            if source is not None and target is not None and not accepts(target.type, source.type):
                taken = f"{target.path} takes {type_name(target.type)}"
                problems.add(f"{source.path} sends {type_name(source.type)}, but {taken}", edge.position)
            if target is None or target.multi:
                continue
            before = next(iter(graph.incoming(edge.destination)), None) or new.get(edge.destination)
            if before is not None:
                at = before.position
                where = f", at {at.file}:{at.line}" if at is not None else ""
                message = f"{target.path} takes one connection, and {before.source} is already connected to it{where}"
                problems.add(message, edge.position, "disconnect that one, or send through an actor that merges them")
            new.setdefault(edge.destination, edge)

    # -- aspects --------------------------------------------------------------------------------------------------

    def weave(
        self,
        name: str,
        aspect: Aspect | Composite | CompositeInstance,
        *,
        at: Places | Mapping[str, Places],
        time: FiringTime | str | None = None,
    ) -> WovenAspect:
        """Attach an aspect to ports or actors, given as objects or as patterns over those that exist now.

        Aspects at one port or actor apply in the order in which they are woven.  An aspect may be a model: a composite
        of this model, or an instance of a composite class, which is added.  If it has several request ports, ``at``
        gives what comes in by each: ``at={"in1": a.input, "in2": b.input}``.  With a ``time`` (s, a text with a unit, a
        distribution, or these by input port), such an aspect attaches to actors, whose firings take that long.  Raises
        ``ModelError``.
        """
        position = call_site()
        full = self._full(name)
        with raising() as problems:
            if not NAME.match(name):
                problems.add(f"{name!r} is not a name", position, NAMES_HAVE)
            if any(woven.name == full for woven in self._model.aspects):
                problems.add(f"there is already an aspect {full!r}", position, "unweave it, or give this another name")
            check_aspect(aspect, (Aspect, Composite, CompositeInstance), position, problems)
            firing_time = firing_time_of(time, aspect, position, problems)
        model = self._model
        if isinstance(aspect, Aspect):
            with raising() as problems:
                named = Named(model.graph, self.path, position, problems).pointcuts(at, type(aspect))
                pointcuts = Pointcuts(Paths(model.graph), full, self.path, problems, type(aspect))
                places, _ = pointcuts.resolve(named)
                woven = pointcuts.bind(aspect, places, lambda _: position, position)
            model.enlist([woven])
            return woven
        graph, others = model.graph.copy(), list[WovenAspect]()
        if isinstance(aspect, Composite):
            path = aspect.path
        else:
            with raising() as problems:
                path = self._free(aspect.path, position, problems)
            made, others = aspect.unfold(path, graph, position)
            graph.merge(made, graph.director_of(path))
        kind = CompositeAspect if firing_time is None else CompositeExecutionAspect
        with raising() as problems:
            named = Named(graph, self.path, position, problems).pointcuts(at, kind)
            named = [replace(each, firing_time=firing_time or 0.0) for each in named]
            pointcuts = Pointcuts(Paths(graph), full, self.path, problems, kind, path)
            made_model = weave_model(pointcuts, kind(), named, lambda _: position, position)
            assert made_model
            check_nesting([*model.aspects, made_model], graph, problems)
        model.adopt(graph, [*others, made_model])
        return made_model

    def unweave(self, name: str) -> None:
        """Remove an aspect, with its composite if it is a model."""
        full, model = self._full(name), self._model
        known = [woven.name for woven in model.aspects]
        if full not in known:
            hint = f"its aspects: {', '.join(known) or 'none'}"
            raise mistake(f"the model has no aspect {full!r}{did_you_mean(full, known)}", call_site(), hint)
        woven = model.aspects[known.index(full)]
        if woven.model is not None:  # its composite has no other use
            model.forget(woven.model.path)
        model.aspects = [each for each in model.aspects if each.name != full]
        model.enlist(())  # which is a change, too


class Composite(Scope):
    """A composite of a model: a scope for its own actors, and ports through which it is connected.

    Inside it, ``connect`` takes its ports by their names alone: ``connect("trigger -> sensor.trigger")``.
    """

    def input(self, name: str) -> CompositePort:
        """Add an input port."""
        return self._port(name, "input")

    def output(self, name: str) -> CompositePort:
        """Add an output port."""
        return self._port(name, "output")

    def _port(self, name: str, direction: str) -> CompositePort:
        position = call_site()
        self.check_port(name, (), position)
        full = self._full(name)
        self._model.edit().add_composite_port(full, direction)
        return CompositePort(full, direction)

    def check_port(self, name: str, others: Collection[str], position: Position) -> None:
        """Raise ``ModelError`` if there cannot be such a port besides the existing ones and ``others``."""
        full, graph = self._full(name), self._model.graph
        with raising() as problems:
            if not NAME.match(name):
                problems.add(f"{name!r} is not a port name", position)
            elif full in graph.ports or name in others:
                problems.add(f"port {full!r} is declared twice", position)
            elif name in graph.parts(self.path):
                problems.add(f"{full!r} is the name of both an actor and a port", position, "rename one")

    def __repr__(self) -> str:
        inputs, outputs = (
            ", ".join(map(paths.name, ports)) or "none" for ports in self._model.graph.borders(self.path)
        )
        return f"<Composite {self.path}: inputs {inputs}; outputs {outputs}>"


def _label(graph: ModelGraph, composite: str) -> str:
    """The name of a composite in messages: its class, if it has one."""
    kind = graph.components[composite].kind
    return composite if kind == OF_NO_CLASS else kind
