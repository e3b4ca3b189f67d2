"""Connections: from the names that stand in a composite's ``connections`` to edges between ports."""

from __future__ import annotations

import re
from dataclasses import dataclass

from epicycle.actors import Actor, Parameter, ParameterError, declared_ports, to_nanoseconds

from .declarations import CompositeText, ConnectionText, Text
from .graph import ModelGraph
from .problems import Problems, did_you_mean
from .values import Values

_ENDPOINT = re.compile(r"(?:([A-Za-z_]\w*)(?:\[(\*|\d{1,9})\])?\.)?([A-Za-z_]\w*)\Z", re.ASCII)


@dataclass
class Child:
    """A name inside a composite: the instances behind it; ``count`` is None if how many is not known."""

    paths: list[str]
    array: bool
    composite: CompositeText | None
    actor_type: type[Actor] | None
    count: int | None

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
        return [name for name, port in declared_ports(self.actor_type).items() if port.direction == direction]


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
        """Every source to every destination; ``[*]`` on both sides connects equal indices."""
        delay = self._delay(connection, names)
        sources = [(text, self._endpoint(text, "output")) for text in connection.sources]
        targets = [(text, self._endpoint(text, "input")) for text in connection.destinations]
        for source_text, source in sources:
            for target_text, target in targets:
                if source is None or target is None:
                    self.graph.is_wired = False
                    continue
                if "[*]" not in source_text.text or "[*]" not in target_text.text:
                    pairs = [(one, other) for one in source for other in target]
                elif len(source) == len(target):
                    pairs = list(zip(source, target, strict=True))
                else:
                    self._problem(
                        f"{self._label(source_text)} stands for {len(source)} ports, "
                        f"{self._label(target_text)} for {len(target)}",
                        target_text,
                        "[*] on both sides connects equal indices, so both arrays need the same count",
                    )
                    continue
                for one, other in pairs:
                    self.graph.connect(one, other, delay, source_text.position)

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

    def _endpoint(self, text: Text, wanted: str) -> list[str] | None:
        """The port paths behind one end of a connection, as seen from inside the composite."""
        match = _ENDPOINT.match(text.text)
        if match is None:
            self._problem(
                f"{text.text!r} is not a port that can be connected here",
                text,
                "write 'actor.port', 'array[*].port', 'array[0].port' or the name of an own port",
            )
            return None
        name, index, port = match.groups()
        if name is None:
            return self._own(port, wanted, text)
        child = self.children.get(name)
        if child is None:
            if name not in self.composite.actors:  # otherwise its own problem is told already
                self._problem(
                    f"{self.composite.name} has no actor {name!r}{did_you_mean(name, list(self.composite.actors))}",
                    text,
                    f"valid actors: {', '.join(self.composite.actors) or 'none'}",
                )
            return None
        has_port = self._has_port(name, child, port, wanted, text)
        paths = self._instances(name, index, child, port, text)
        return [f"{instance}.{port}" for instance in paths] if has_port and paths is not None else None

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

    def _instances(self, name: str, index: str | None, child: Child, port: str, text: Text) -> list[str] | None:
        label = f"{self.path}.{name}" if self.path else name
        if not child.array:
            if index is None:
                return child.paths
            self._problem(f"{label} is a single actor, it has no [{index}]", text, f"write {name}.{port}")
            return None
        if child.count is None:
            return None  # the count is wrong, and told so
        if index == "*":
            return child.paths
        if index is None:
            self._problem(
                f"{label} is an array of {child.count}: say which",
                text,
                f"write {name}[*].{port} for all, or {name}[0].{port} for the first",
            )
        elif int(index) < child.count:
            return [child.paths[int(index)]]
        else:
            last = f", the last is {name}[{child.count - 1}]" if child.count else ""
            self._problem(f"there is no {label}[{index}]: the array has {child.count}{last}", text)
        return None

    def _has_port(self, name: str, child: Child, port: str, wanted: str, text: Text) -> bool:
        """Whether the child's type has the port, in the direction that the connection needs."""
        path = f"{self.path}.{name}" if self.path else name
        valid = child.ports(wanted)
        if port in valid:
            return True
        if port in child.ports("input" if wanted == "output" else "output"):
            direction, ends = ("an input", "come from it") if wanted == "output" else ("an output", "go to it")
            message = f"{path}.{port} is {direction} of {child.kind}, nothing can {ends}"
        else:
            message = f"{path}: {child.kind} has no {wanted} port {port!r}{did_you_mean(port, valid)}"
        self._problem(message, text, f"valid {wanted} ports: {', '.join(valid) or 'none'}")
        return False
