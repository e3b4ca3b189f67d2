"""Connections: from the names in a composite's ``connections`` to edges between ports."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product

from epicycle.actors import Actor, FaultError, counted, declared_ports, has_own_ports, nearest, paths

from ..graph.model_graph import ModelGraph
from ..graph.nodes import Edge
from ..language.models import CompositeText
from ..language.places import ConnectionText, Endpoint
from ..language.values import Locals, Values
from ..text.document import Scalar
from ..text.kinds import CONNECTION, SIZE, UNKNOWN_PORT, Kind
from ..text.limits import RAISE_IT
from ..text.problems import NONE, POISON, Near, Poison
from ..text.reading import split, within

_NUMBER = re.compile(r"-?\d{1,9}", re.ASCII)
_EXPRESSION = re.compile(r"\$\{.*\}", re.DOTALL)
MAX_INDICES = 1_000_000


def indices_of(text: str, array: str, count: int, value: Callable[[str], object]) -> tuple[list[int], bool]:
    """The indices that a text selects in an array of that name and ``count``, and whether it may select several.

    ``*`` is all, ``2`` one, ``-1`` the last, ``0..3`` a range with both ends, ``1..`` and ``..-2`` ranges up to an end
    of the array, ``1.., 0`` several in that order, and ``${...}`` a number, or a list of numbers, that ``value`` finds.
    In an empty array every index selects nothing, so that a model stays right when a count becomes zero.  Raises
    ``FaultError``.
    """
    items = [text[start:end].strip() for start, end in split(text, ",")]
    found: list[int] = []
    if len(items) * count > MAX_INDICES:
        raise FaultError(f"too many instances: {len(items):,} times up to {count:,}")
    several = len(items) > 1
    for item in items:
        ends = [item[start:end].strip() for start, end in split(item, "..")]
        if item == "*" or len(ends) == 2:
            several = True
            found += range(count) if item == "*" else _range(ends[0], ends[1], item, array, count, value)
            continue
        number = _number(item, array, value)
        numbers: list[object] = number if isinstance(number, list) else [number]
        several = several or isinstance(number, list)
        for each in numbers if count else ():
            index = _whole(each, item)
            place = index + count if index < 0 and _NUMBER.fullmatch(item) else index
            if not 0 <= place < count:
                raise FaultError(_missing(array, index, count))
            found.append(place)
    return found, several


def _range(left: str, right: str, item: str, array: str, count: int, value: Callable[[str], object]) -> range:
    """Both ends included; an end that is omitted or counted from the end stays within the array."""
    start, end = (
        _whole(_number(each, array, value), item) if each else default for each, default in ((left, 0), (right, -1))
    )
    from_end = [not each or bool(_NUMBER.fullmatch(each) and each.startswith("-")) for each in (left, right)]
    if not count:
        return range(0)
    if left.startswith("-") and from_end[0]:
        start = max(start + count, 0)
    if from_end[1]:
        end += count
    is_written = all(_NUMBER.fullmatch(each) for each in (left, right))
    if end < start and (any(from_end) or (end == start - 1 and not is_written)):
        return range(0)
    if end < start:
        raise FaultError(f"{array}[{item}]: the range {start}..{end} runs backwards")
    for bound in (start, end):
        if not 0 <= bound < count:
            raise FaultError(_missing(array, bound, count))
    return range(start, end + 1)


def _missing(array: str, index: int, count: int) -> str:
    return f"there is no {array}[{index}]: the array has {counted(count, 'instance')}, up to {array}[{count - 1}]"


def _number(text: str, array: str, value: Callable[[str], object]) -> object:
    if _NUMBER.fullmatch(text):
        return int(text)
    if _EXPRESSION.fullmatch(text):
        return value(text)
    name = paths.name(array)
    forms = ", ".join(f"{name}[{each}]" for each in ("*", "0", "-1", "1..3", "1..", "0, 2", "${...}"))
    raise FaultError(f"{text!r} is not an array index", help=[f"valid forms: {forms}"])


def _whole(value: object, item: str) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not float(value).is_integer():
        raise FaultError(f"{item} is {value!r}, but an index is a whole number")
    return int(value)


@dataclass(frozen=True)
class End:
    """The ports behind one end of a connection, and the text that names them."""

    text: Endpoint
    ports: list[str]
    several: bool = False  # whether it may select any number of ports
    own: bool = False  # whether it is a port of the composite itself


@dataclass
class Member:
    """A name inside a composite: the instances behind it, and their number."""

    kind: str  # the name of its type
    paths: list[str]
    array: bool
    count: int | Poison
    inputs: list[str] = field(default_factory=list)
    outputs: list[str] = field(default_factory=list)
    is_known: bool = True  # whether it has no other ports: an instance that could not be made may have had some
    is_open: bool = False  # whether its parameters determine further ports

    def ports(self, direction: str) -> list[str]:
        return self.inputs if direction == "input" else self.outputs


def member_of_actors(
    actor_type: type[Actor], paths: list[str], array: bool, count: int | Poison, graph: ModelGraph
) -> Member:
    """Actors of one name, some of which perhaps could not be made."""
    member = Member(actor_type.__name__, paths, array, count, is_open=has_own_ports(actor_type))
    if member.is_open:
        actors = [graph.actors[path] for path in paths if path in graph.actors]
        member.inputs = list(dict.fromkeys(name for actor in actors for name in actor.inputs))
        member.outputs = list(dict.fromkeys(name for actor in actors for name in actor.outputs))
        member.is_known = len(actors) == count != 0
    else:
        for name, port in declared_ports(actor_type).items():
            member.ports(port.direction).append(name)
    return member


def make(edges: Sequence[Edge | Poison], graph: ModelGraph) -> None:
    """Add the edges of one connection to the graph."""
    first = graph.next_order  # which distinguishes the connection from all others
    for edge in edges:
        if edge is POISON:
            graph.is_wired = False
        else:
            shared = None if edge.shared is None else first
            graph.connect(edge.source, edge.destination, edge.delay, edge.position, shared)


@dataclass(frozen=True)
class Wiring:
    """Finds the ports that a connection inside a composite names."""

    graph: ModelGraph
    values: Values
    path: str
    name: str
    inputs: Collection[str]
    outputs: Collection[str]
    names: Collection[str]  # of all actors
    members: Mapping[str, Member]  # those of which anything is known
    text: CompositeText | None = None  # as a file declares it

    def resolve(self, connection: ConnectionText, names: dict[str, object]) -> list[Edge | Poison]:
        """Its edges: every source to every destination; if both select several, the first to the first and so on."""
        delay = self._delay(connection, names)
        sources = [self._endpoint(text, "output", names) for text in connection.sources]
        targets = [self._endpoint(text, "input", names) for text in connection.destinations]
        edges: list[Edge | Poison] = [POISON] if POISON in (*sources, *targets) else []
        limit, shared = self.graph.limits.connections, 0 if connection.shared else None
        for source, target in product((each for each in sources if each), (each for each in targets if each)):
            in_pairs = source.several and target.several and not connection.to_all
            count = len(source.ports) * (1 if in_pairs else len(target.ports))
            if self.graph.connections + len(edges) + count > limit:
                message = f"the model has more than {limit:,} connections"
                return [*edges, self._problem(message, source.text, RAISE_IT, kind=SIZE)]
            if in_pairs and len(source.ports) != len(target.ports):
                one, other = paths.join(self.path, source.text.text), paths.join(self.path, target.text.text)
                wrong = self._problem(
                    f"{one} selects {_ports(source)}, but {other} selects {_ports(target)}",
                    target.text,
                    "'->' connects the first port to the first and so on, so both sides need the same number of ports",
                    "to connect all to all, write '=>'",
                )
                edges.append(wrong)
                continue
            pairs = zip(source.ports, target.ports, strict=True) if in_pairs else product(source.ports, target.ports)
            # '=>' within a group does not connect an actor to itself; '->' still does.
            spare_self = connection.to_all and not source.own and not target.own
            for one, other in pairs:
                if not (spare_self and paths.parent(one) == paths.parent(other)):
                    edges.append(Edge(one, other, delay, source.text.position, 0, shared=shared))
        return edges

    def check_ports(self, name: str, member: Member, connections: Iterable[ConnectionText | Poison]) -> None:
        """Check that a child of another type that it may have would have the ports that connections name."""
        for each in connections:
            if each:
                for ends, wanted in ((each.sources, "output"), (each.destinations, "input")):
                    for text in ends:
                        if text.actor == name:
                            self._has_port(name, member, text.port, wanted, text)

    def _problem(self, message: str, text: Endpoint, *hints: str, kind: Kind = CONNECTION, near: Near = NONE) -> Poison:
        return self.values.problems.add(message, text.position, *hints, scope=self.path, kind=kind, near=near)

    def _delay(self, connection: ConnectionText, names: dict[str, object]) -> int | None:
        if connection.delay is None:
            return None
        ends = (paths.join(self.path, each[0].text) for each in (connection.sources, connection.destinations))
        label = f"{' -> '.join(ends)}: delay"
        delay = self.values.value(connection.delay, Locals(self.path, names), label)
        return None if delay is POISON else delay

    def _endpoint(self, text: Endpoint, wanted: str, names: dict[str, object]) -> End | Poison:
        """The port paths behind one end of a connection, as seen from inside the composite."""
        name, index, port = text.actor, text.index, text.port
        if not name:
            own = self._own(port, wanted, text)
            return End(text, own, own=True) if own else POISON
        member = self.members.get(name)
        if member is None:
            if name not in self.names:  # otherwise its own problem has been reported
                gone = None if self.text is None else self.text.removed.get(name)
                message = f"{self.name} has no actor {name!r}"
                hints = [f"valid actors: {', '.join(self.names) or 'none'}"]
                hints += [f"it is removed at {gone}"] if gone is not None else []
                self._problem(message, text, *hints, kind=UNKNOWN_PORT, near=(name, self.names))
            return POISON
        has_port = self._has_port(name, member, port, wanted, text)
        found = self._instances(name, index, member, port, text, names)
        if not has_port or found is POISON:
            return POISON
        paths, several = found
        ports = [f"{instance}.{port}" for instance in paths]
        if missing := [path for path in ports if path not in self.graph.ports]:
            if member.is_known:  # instances of one entry may differ in their own ports
                self._problem(f"{member.kind} has no {wanted} port {missing[0]}, unlike others in its array", text)
            return POISON
        return End(text, ports, several)

    def _own(self, port: str, wanted: str, text: Endpoint) -> list[str] | Poison:
        # Seen from inside, tokens come from an own input and go to an own output.
        own, other = (self.inputs, self.outputs) if wanted == "output" else (self.outputs, self.inputs)
        if port in own and self.path:
            return [f"{self.path}.{port}"]
        kind, ends = ("input", "from") if wanted == "output" else ("output", "to")
        hints, near = [f"its own {kind} ports: {', '.join(own) or 'none'}"], NONE
        if port in other:
            message = f"{port!r} is an {'output' if kind == 'input' else 'input'} of {self.name}: inside it, tokens "
            message += "go to it and cannot come from it" if ends == "from" else "come from it and cannot go to it"
        elif port in self.members:
            member = self.members[port]
            message = f"{paths.join(self.path, text.text)} is an actor, not a port"
            index = "[*]" if member.array else ""
            hints = [f"{wanted} ports: {', '.join(f'{port}{index}.{each}' for each in member.ports(wanted)) or 'none'}"]
        else:
            message, near = f"{self.name} has no {kind} port {port!r} of its own", (port, own)
            hints.append("a port of an actor is written 'actor.port'")
        return self._problem(message, text, *hints, kind=UNKNOWN_PORT, near=near)

    def _instances(
        self, name: str, index: str | None, member: Member, port: str, text: Endpoint, names: dict[str, object]
    ) -> tuple[list[str], bool] | Poison:
        """The paths of the instances that an endpoint names, and whether it may name several."""
        label = paths.join(self.path, name)
        if not member.array:
            if index is None:
                return member.paths, False
            return self._problem(f"{label} is a single actor, so it has no [{index}]", text, f"write {name}.{port}")
        if member.count is POISON:
            return POISON
        if index == "*":
            return member.paths, True
        if index is None:
            hint = f"write {name}[*].{port} for all, or {name}[0].{port} for the first"
            return self._problem(f"{label} is an array of {member.count}: give an index", text, hint)

        def value(expression: str) -> object:
            at = within(text.position, expression)
            found = self.values.of(Scalar(expression, expression, True, at), Locals(self.path, names), label)
            if found is POISON:
                raise FaultError.several(())  # which has been reported
            return found

        try:
            indices, several = indices_of(index, label, member.count, value)
        except FaultError as error:
            for fault in error.faults:
                self._problem(fault.message, text, *fault.help)
            return POISON
        return [member.paths[each] for each in indices], several

    def _has_port(self, name: str, member: Member, port: str, wanted: str, text: Endpoint) -> bool:
        """Check that the child's type has the port, in the direction that the connection needs."""
        path = paths.join(self.path, name)
        valid = member.ports(wanted)
        if port in valid:
            return True
        if not member.is_known:
            return member.count == 0  # otherwise the reason why it could not be made is reported
        near = NONE
        if port in member.ports("input" if wanted == "output" else "output"):
            direction, ends = ("an input", "come from it") if wanted == "output" else ("an output", "go to it")
            message = f"{path}.{port} is {direction} of {member.kind}, so nothing can {ends}"
        else:
            message, near = f"{path}: {member.kind} has no {wanted} port {port!r}", (port, valid)
        hints = [f"valid {wanted} ports: {', '.join(valid) or 'none'}"]
        if member.is_open and near != NONE and nearest(port, valid) is None:
            hints.append(f"its parameters determine further ports; 'epicycle describe {member.kind}' says how")
        if self.text is not None and self.text.extends is not None:
            at = self.text.actors[name].type.position  # which may be far from the connection
            hints.append(f"{path} is declared as a {member.kind} at {at}")
        self._problem(message, text, *hints, kind=UNKNOWN_PORT, near=near)
        return False


def _ports(end: End) -> str:
    return counted(len(end.ports), "port")
