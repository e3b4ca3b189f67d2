"""Connections: from the names that stand in a composite's ``connections`` to edges between ports."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from epicycle.actors import Actor, Parameter, ParameterError, counted, declared_ports, has_own_ports, to_nanoseconds

from ..language import CompositeText, ConnectionText, Values
from ..text import RAISE_IT, Problems, Scalar, Text, did_you_mean, within
from .graph import ModelGraph
from .indices import BadIndexError, resolve

_ENDPOINT = re.compile(r"(?:([A-Za-z_]\w*)(?:\[([^\[].*|)\])?\.)?([A-Za-z_]\w*)\Z", re.ASCII | re.DOTALL)


@dataclass
class End:
    """The ports behind one end of a connection, and how they are spoken of."""

    text: Text
    ports: list[str]
    several: bool = False  # whether it may stand for any number of ports
    own: bool = False  # whether it is a port of the composite itself


@dataclass
class Child:
    """A name inside a composite: the instances behind it; ``count`` is None if how many is not known."""

    paths: list[str]
    array: bool
    composite: CompositeText | None
    actor_type: type[Actor] | None
    count: int | None
    actors: list[Actor] = field(default_factory=list)  # the instances that could be made

    @property
    def kind(self) -> str:
        """The name of its type."""
        if self.composite is not None:
            return self.composite.name
        return self.actor_type.__name__ if self.actor_type is not None else ""

    def ports(self, direction: str) -> list[str]:
        """The names of its ports of one direction."""
        if self.composite is not None:
            return list(self.composite.inputs if direction == "input" else self.composite.outputs)
        if self.actor_type is None:
            return []
        if has_own_ports(self.actor_type):
            ports = [each.inputs if direction == "input" else each.outputs for each in self.actors]
            return list(dict.fromkeys(name for each in ports for name in each))
        return [name for name, port in declared_ports(self.actor_type).items() if port.direction == direction]

    @property
    def ports_are_known(self) -> bool:
        """Whether there are no ports but those that ``ports`` tells; an instance not made may have had others."""
        return self.actor_type is None or not has_own_ports(self.actor_type) or len(self.actors) == self.count != 0


class Wiring:
    """Connects the inside of one instance of a composite."""

    def __init__(
        self,
        path: str,
        composite: CompositeText,
        children: dict[str, Child],
        graph: ModelGraph,
        values: Values,
        problems: Problems,
    ) -> None:
        self.path = path
        self.composite = composite
        self.children = children
        self.graph = graph
        self.values = values
        self.problems = problems

    def connect(self, connection: ConnectionText, names: dict[str, object]) -> None:
        """Every source to every destination; where both stand for several, the first to the first and so on."""
        delay = self._delay(connection, names)
        sources = [self._endpoint(text, "output", names) for text in connection.sources]
        targets = [self._endpoint(text, "input", names) for text in connection.destinations]
        for source in sources:
            for target in targets:
                if source is None or target is None:
                    self.graph.is_wired = False
                    continue
                in_pairs = source.several and target.several and not connection.to_all
                count = len(source.ports) * (1 if in_pairs else len(target.ports))
                limit = self.graph.limits.connections
                if self.graph.connections + count > limit:
                    self.graph.is_wired = False
                    self._problem(f"the model has more than {limit:,} connections", source.text, RAISE_IT)
                    return
                for one, other in self._pairs(source, target, in_pairs, connection.to_all):
                    self.graph.connect(one, other, delay, source.text.position)

    def _pairs(self, source: End, target: End, in_pairs: bool, to_all: bool) -> Iterator[tuple[str, str]]:
        if not in_pairs:
            # What all of a group say to all is not for themselves; '->' still connects each to itself.
            spare_self = to_all and not source.own and not target.own
            for one in source.ports:
                owner = one.rpartition(".")[0] if spare_self else None
                yield from ((one, other) for other in target.ports if other.rpartition(".")[0] != owner)
        elif len(source.ports) == len(target.ports):
            yield from zip(source.ports, target.ports, strict=True)
        else:
            self.graph.is_wired = False
            self._problem(
                f"{self._label(source.text)} stands for {_ports(source)}, {self._label(target.text)} for "
                f"{_ports(target)}",
                target.text,
                "with several on both sides, '->' connects the first to the first and so on, so both need as many",
                "to connect all to all, write '=>'",
            )

    def _label(self, text: Text) -> str:
        return f"{self.path}.{text.text}" if self.path else text.text

    def _problem(self, message: str, text: Text, *hints: str) -> None:
        self.problems.add(message, text.position, *hints, scope=self.path)

    def _delay(self, connection: ConnectionText, names: dict[str, object]) -> int | None:
        if connection.delay is None:
            return None
        label = f"{self._label(connection.sources[0])} -> {self._label(connection.destinations[0])}: delay"
        value = self.values.of(connection.delay, names, label, self.path)
        if value is self.values.missing:
            return None
        try:
            seconds = Parameter(float, unit="s", min=0.0).convert(value)
            return to_nanoseconds(seconds if seconds is not None else 0.0)
        except (ParameterError, ValueError) as error:
            self.problems.add(f"{label}: {error}", connection.delay.position, scope=self.path)
            return None

    def _endpoint(self, text: Text, wanted: str, names: dict[str, object]) -> End | None:
        """The port paths behind one end of a connection, as seen from inside the composite."""
        match = _ENDPOINT.match(text.text)
        if match is None:
            self._problem(
                f"{text.text!r} is not a port that can be connected here",
                text,
                "write 'actor.port', 'array[*].port', 'array[0].port', 'array[1..3].port' or the name of an own port",
            )
            return None
        name, index, port = match.groups()
        if name is None:
            own = self._own(port, wanted, text)
            return None if own is None else End(text, own, own=True)
        child = self.children.get(name)
        if child is None:
            if name not in self.composite.actors:  # otherwise its own problem is told already
                gone = self.composite.removed.get(name)
                self._problem(
                    f"{self.composite.name} has no actor {name!r}{did_you_mean(name, list(self.composite.actors))}",
                    text,
                    f"valid actors: {', '.join(self.composite.actors) or 'none'}",
                    *((f"it is removed at {gone.file}:{gone.line}:{gone.column}",) if gone is not None else ()),
                )
            return None
        has_port = self._has_port(name, child, port, wanted, text)
        found = self._instances(name, index, child, port, text, names)
        if not has_port or found is None:
            return None
        paths, several = found
        ports = [f"{instance}.{port}" for instance in paths]
        if missing := [path for path in ports if path not in self.graph.ports]:
            if child.ports_are_known:  # instances of one entry may differ in the ports of their own
                self._problem(f"{child.kind} has no {wanted} port {missing[0]}, but others of its array have", text)
            return None
        return End(text, ports, several)

    def _own(self, port: str, wanted: str, text: Text) -> list[str] | None:
        # Seen from inside, an own input is where tokens come from, an own output where they go.
        inputs, outputs = self.composite.inputs, self.composite.outputs
        own, other = (inputs, outputs) if wanted == "output" else (outputs, inputs)
        if port in own and self.path:
            return [f"{self.path}.{port}"]
        where = self.composite.name
        kind, ends = ("input", "from") if wanted == "output" else ("output", "to")
        hints = [f"own {kind} ports: {', '.join(own) or 'none'}"]
        if port in other:
            message = f"{port!r} is an {'output' if kind == 'input' else 'input'} of {where}: inside of it, tokens "
            message += "go there, none come from it" if ends == "from" else "come from it, none go there"
        elif port in self.children:
            child = self.children[port]
            message = f"{self._label(text)} is an actor, not a port"
            index = "[*]" if child.array else ""
            hints = [f"{wanted} ports: {', '.join(f'{port}{index}.{each}' for each in child.ports(wanted)) or 'none'}"]
        else:
            message = f"{where} has no {kind} port {port!r} of its own{did_you_mean(port, list(own))}"
            hints.append("a port of an actor is written 'actor.port'")
        self._problem(message, text, *hints)
        return None

    def _instances(
        self, name: str, index: str | None, child: Child, port: str, text: Text, names: dict[str, object]
    ) -> tuple[list[str], bool] | None:
        """The paths of the instances that an endpoint names, and whether it may name several."""
        label = f"{self.path}.{name}" if self.path else name
        if not child.array:
            if index is None:
                return child.paths, False
            self._problem(f"{label} is a single actor, it has no [{index}]", text, f"write {name}.{port}")
            return None
        if child.count is None:
            return None  # the count is wrong, and told so
        if index == "*":
            return child.paths, True
        if index is None:
            self._problem(
                f"{label} is an array of {child.count}: say which",
                text,
                f"write {name}[*].{port} for all, or {name}[0].{port} for the first",
            )
            return None

        def value(expression: str) -> object:
            at = within(text, expression)
            found = self.values.of(Scalar(expression, expression, True, at), names, label, self.path)
            if found is self.values.missing:
                raise _ToldError
            return found

        try:
            indices, several = resolve(index, label, child.count, value)
        except _ToldError:
            return None
        except BadIndexError as error:
            forms = ", ".join(f"{name}[{each}]" for each in ("*", "0", "-1", "1..3", "1..", "0, 2", "${...}"))
            self._problem(str(error), text, *((f"valid are {forms}",) if "no index" in str(error) else ()))
            return None
        return [child.paths[each] for each in indices], several

    def _has_port(self, name: str, child: Child, port: str, wanted: str, text: Text) -> bool:
        """Whether the child's type has the port, in the direction that the connection needs."""
        path = f"{self.path}.{name}" if self.path else name
        valid = child.ports(wanted)
        if port in valid:
            return True
        if not child.ports_are_known:
            return child.count == 0  # or else why it could not be made is told
        if port in child.ports("input" if wanted == "output" else "output"):
            direction, ends = ("an input", "come from it") if wanted == "output" else ("an output", "go to it")
            message = f"{path}.{port} is {direction} of {child.kind}, nothing can {ends}"
        else:
            message = f"{path}: {child.kind} has no {wanted} port {port!r}{did_you_mean(port, valid)}"
        hints = [f"valid {wanted} ports: {', '.join(valid) or 'none'}"]
        if self.composite.extends is not None:  # its type may be said far from the connection
            at = self.composite.actors[name].type.position
            hints.append(f"{path} is a {child.kind} since {at.file}:{at.line}:{at.column}")
        self._problem(message, text, *hints)
        return False


class _ToldError(Exception):
    """An expression that could not be evaluated, for a reason that has been told."""


def _ports(end: End) -> str:
    return counted(len(end.ports), "port")
