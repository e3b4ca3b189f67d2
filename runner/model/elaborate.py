"""From declarations to a checked model: parameters resolved, composites unfolded, actors made, ports wired."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any

from epicycle.actors import (
    Actor,
    OutputPort,
    Parameter,
    ParameterError,
    declared_parameters,
    declared_ports,
    to_nanoseconds,
    type_name,
    unknown_parameter,
)

from .catalogue import actor_types, aspect_types
from .checks import check
from .declarations import CompositeText, ConnectionText, MetricText, ModelText, PartText, Text
from .document import Entry, Node, Scalar
from .graph import ModelGraph
from .patterns import PatternError, select
from .problems import Position, Problems, did_you_mean, nearest
from .settings import Setting
from .values import Values
from .weave import WovenAspect, select_ports

MAX_COUNT = 100_000
MAX_ACTORS = 200_000
MAX_DEPTH = 50
_ENDPOINT = re.compile(r"(?:([A-Za-z_]\w*)(?:\[(\*|\d{1,9})\])?\.)?([A-Za-z_]\w*)\Z")


@dataclass
class Metric:
    """A number taken from what some ports send: ``take`` is a reduction over all their tokens."""

    name: str
    ports: list[OutputPort[Any]]
    take: str
    unit: str
    doc: str


@dataclass
class Model:
    """A model that can be run."""

    name: str
    doc: str
    graph: ModelGraph
    parameters: dict[str, object]
    aspects: list[WovenAspect] = field(default_factory=list)
    stop: int | None = None  # ns
    stop_when: list[OutputPort[Any]] = field(default_factory=list)
    seed: int = 0
    record: dict[str, OutputPort[Any]] = field(default_factory=dict)
    metrics: list[Metric] = field(default_factory=list)
    figures: dict[str, tuple[str, dict[str, object], Position]] = field(default_factory=dict)


@dataclass
class _Child:
    """A name inside a composite: the instances behind it."""

    paths: list[str]
    array: bool
    composite: CompositeText | None
    actor_type: type[Actor] | None


class Elaborator:
    """Unfolds one model; problems are collected, and the model is good only if there are none."""

    def __init__(
        self,
        text: ModelText,
        composites: dict[str, CompositeText],
        settings: list[Setting],
        problems: Problems,
    ) -> None:
        self.text = text
        self.composites = composites
        self.settings = settings
        self.problems = problems
        self.graph = ModelGraph()
        self.values = Values(problems)
        self.settable: dict[str, None] = {}
        self.aspects: list[WovenAspect] = []
        # Aspects are woven when all ports exist: (name, scope, declaration, names).
        self._to_weave: list[tuple[str, str, PartText, dict[str, object]]] = []

    def model(self) -> Model:
        """The whole model."""
        root = self.text.root
        names = self._parameters("", root, {}, {}, None)
        self._body("", root, names, (root.name,))
        for setting in self.settings:
            if not setting.used:
                self.problems.add(
                    f"{setting.path!r} sets no parameter{did_you_mean(setting.path, list(self.settable))}",
                    setting.position,
                )
        for name, scope, part, scope_names in self._to_weave:
            self._aspect(name, scope, part, scope_names)
        # Wiring is only worth checking when every actor could be made.
        if not len(self.problems):
            check(self.graph, self.problems)
        model = Model(root.name, root.doc, self.graph, names, self.aspects)
        self._run(model, names)
        for metric in self.text.metrics:
            self._metric(model, metric)
        for name, part in self.text.figures.items():
            values = {key: self.values.of(entry.value, names) for key, entry in part.values.items()}
            model.figures[name] = (part.type.text, values, part.type.position)
        return model

    # -- parameters -----------------------------------------------------------------------------------------------

    def _parameters(
        self,
        path: str,
        composite: CompositeText,
        given: dict[str, Entry],
        outer: dict[str, object],
        position: Position | None,
    ) -> dict[str, object]:
        """The values of a composite's parameters: set from outside, else given, else the default."""
        names: dict[str, object] = {}
        label = path or composite.name
        for key, entry in given.items():
            if key not in composite.parameters:
                self.problems.add(
                    f"{label}: {composite.name} has no parameter {key!r}"
                    f"{did_you_mean(key, list(composite.parameters))}",
                    entry.key.position,
                    f"valid parameters: {', '.join(composite.parameters) or 'none'}",
                )
        for name, declared in composite.parameters.items():
            full = f"{path}.{name}" if path else name
            node, scope = declared.value, names
            if name in given:
                node, scope = given[name].value, outer
            if (setting := self._setting(full)) is not None:
                node, scope = setting.node, {}
            if node is None:
                self.problems.add(
                    f"{label}: {composite.name} needs a value for {name!r}",
                    position or declared.position,
                    *((declared.doc,) if declared.doc else ()),
                )
                names[name] = self.values.missing
                continue
            value = self.values.of(node, scope)
            names[name] = self.values.declared(full, declared, value, node.position)
        return names

    def _setting(self, full: str) -> Setting | None:
        """The last setting for a parameter, all that match marked as used."""
        self.settable[full] = None
        found = None
        for setting in self.settings:
            if setting.matches(full):
                setting.used = True
                found = setting
        return found

    def _configuration(
        self, label: str, cls: type, given: dict[str, Entry], names: dict[str, object], position: Position, path: str
    ) -> dict[str, object] | None:
        """Converted values for a Configurable class; None if some are wrong."""
        declared = declared_parameters(cls)
        before = len(self.problems)
        result: dict[str, object] = {}
        for key, entry in given.items():
            if key not in declared:
                self.problems.add(
                    f"{label}: {unknown_parameter(cls, key)}",
                    entry.key.position,
                    f"valid parameters: {', '.join(declared) or 'none'}",
                )
        for name, parameter in declared.items():
            node = given[name].value if name in given else None
            scope = names
            if path and (setting := self._setting(f"{path}.{name}")) is not None:
                node, scope = setting.node, {}
            if node is None:
                if parameter.required:
                    self.problems.add(
                        f"{label}: {cls.__name__} needs a value for {name!r}",
                        position,
                        *((f"{name}: {parameter.doc}",) if parameter.doc else ()),
                    )
                continue
            value = self.values.of(node, scope)
            if value is self.values.missing:
                continue
            try:
                result[name] = parameter.convert(value)
            except ParameterError as error:
                self.problems.add(f"{label}.{name}: {error}", node.position)
        return None if len(self.problems) > before else result

    # -- the inside of a composite --------------------------------------------------------------------------------

    def _body(self, path: str, composite: CompositeText, names: dict[str, object], within: tuple[str, ...]) -> None:
        """Make a composite's actors and connect them."""
        children: dict[str, _Child] = {}
        for name, part in composite.actors.items():
            child = self._actor(f"{path}.{name}" if path else name, part, names, within)
            if child is not None:
                children[name] = child
        for connection in composite.connections:
            self._connection(path, composite, children, connection, names)
        for name, part in composite.aspects.items():
            self._to_weave.append((f"{path}.{name}" if path else name, path, part, names))

    def _actor(
        self, path: str, part: PartText, names: dict[str, object], within: tuple[str, ...]
    ) -> _Child | None:
        """Make the instances of one entry of ``actors``."""
        inner = self.composites.get(part.type.text)
        actor_type = actor_types().get(part.type.text)
        if inner is None and actor_type is None:
            known = [*self.composites, *actor_types()]
            self.problems.add(
                f"{path}: there is no actor type {part.type.text!r}{did_you_mean(part.type.text, known)}",
                part.type.position,
                f"valid types: {', '.join(sorted(known))}",
            )
            return None
        if part.type.text in within or len(within) > MAX_DEPTH:
            self.problems.add(
                f"{path}: composite {part.type.text} contains itself: {' -> '.join([*within[1:], part.type.text])}",
                part.type.position,
            )
            return None
        count = self._count(path, part, names)
        if count is None:
            return None
        child = _Child([], part.count is not None, inner, actor_type)
        if part.count is not None and count == 0:
            self.graph.empty_arrays.add(path)
        for index in range(count):
            instance = f"{path}[{index}]" if part.count is not None else path
            scope = {**names, "index": index} if part.count is not None else names
            child.paths.append(instance)
            if inner is not None:
                self._composite(instance, inner, part, scope, within)
            elif actor_type is not None and not self._make(instance, actor_type, part, scope):
                break  # the other instances would repeat the same messages
        return child

    def _count(self, path: str, part: PartText, names: dict[str, object]) -> int | None:
        if part.count is None:
            return 1
        value = self.values.of(part.count, names)
        if value is self.values.missing:
            return None
        try:
            count = Parameter(int, min=0, max=MAX_COUNT).convert(value)
        except ParameterError as error:
            self.problems.add(f"{path}: count: {error}", part.count.position)
            return None
        assert count is not None
        if len(self.graph.actors) + count > MAX_ACTORS:
            self.problems.add(f"the model has more than {MAX_ACTORS:,} actors", part.count.position)
            return None
        return count

    def _composite(
        self,
        path: str,
        composite: CompositeText,
        part: PartText,
        names: dict[str, object],
        within: tuple[str, ...],
    ) -> None:
        before = len(self.problems)
        inside = self._parameters(path, composite, part.values, names, part.position)
        if "index" in names:
            inside.setdefault("index", names["index"])
        for direction, ports in (("input", composite.inputs), ("output", composite.outputs)):
            for name in ports:
                self.graph.add_composite_port(f"{path}.{name}", direction, part.position)
        if len(self.problems) == before:
            self._body(path, composite, inside, (*within, composite.name))

    def _make(self, path: str, actor_type: type[Actor], part: PartText, names: dict[str, object]) -> bool:
        values = self._configuration(path, actor_type, part.values, names, part.position, path)
        if values is None:
            return False
        self.graph.add_actor(actor_type(path, **values), part.position)
        return True

    # -- connections ----------------------------------------------------------------------------------------------

    def _connection(
        self,
        path: str,
        composite: CompositeText,
        children: dict[str, _Child],
        connection: ConnectionText,
        names: dict[str, object],
    ) -> None:
        delay = self._delay(connection, names)
        sources = [self._endpoint(path, composite, children, text, "output") for text in connection.sources]
        targets = [self._endpoint(path, composite, children, text, "input") for text in connection.destinations]
        for source_text, source in zip(connection.sources, sources, strict=True):
            for target_text, target in zip(connection.destinations, targets, strict=True):
                if source is None or target is None:
                    continue
                if "[*]" in source_text.text and "[*]" in target_text.text:
                    if len(source) != len(target):
                        self.problems.add(
                            f"{source_text.text} has {len(source)} instances, {target_text.text} has {len(target)}",
                            target_text.position,
                            "[*] on both sides connects equal indices, so both need the same count",
                        )
                        continue
                    pairs = list(zip(source, target, strict=True))
                else:
                    pairs = [(one, other) for one in source for other in target]
                for one, other in pairs:
                    self.graph.connect(one, other, delay, source_text.position)

    def _delay(self, connection: ConnectionText, names: dict[str, object]) -> int | None:
        if connection.delay is None:
            return None
        value = self.values.of(connection.delay, names)
        if value is self.values.missing:
            return None
        try:
            seconds = Parameter(float, unit="s", min=0.0).convert(value)
            return to_nanoseconds(seconds if seconds is not None else 0.0)
        except (ParameterError, ValueError) as error:
            self.problems.add(f"delay: {error}", connection.delay.position)
            return None

    def _endpoint(
        self, path: str, composite: CompositeText, children: dict[str, _Child], text: Text, wanted: str
    ) -> list[str] | None:
        """The port paths behind one end of a connection, as seen from inside a composite."""
        prefix = f"{path}." if path else ""
        match = _ENDPOINT.match(text.text)
        if match is None:
            self.problems.add(
                f"{text.text!r} is not a port of this composite",
                text.position,
                "write 'actor.port', 'array[*].port' or the name of an own port",
            )
            return None
        name, index, port = match.groups()
        if name is None:
            # Seen from inside, an own input is where tokens come from, an own output where they go.
            own = composite.inputs if wanted == "output" else composite.outputs
            if port in own and path:
                return [f"{prefix}{port}"]
            valid = [f"{child}.<port>" for child in children] + list(own)
            self.problems.add(
                f"{port!r} is not an own {'input' if wanted == 'output' else 'output'} port"
                f"{did_you_mean(port, list(own))}",
                text.position,
                f"valid here: {', '.join(valid)}",
            )
            return None
        child = children.get(name)
        if child is None:
            if name not in composite.actors:  # otherwise its own problem is told already
                self.problems.add(
                    f"{path or composite.name} has no actor {name!r}{did_you_mean(name, list(children))}",
                    text.position,
                    f"valid actors: {', '.join(composite.actors) or 'none'}",
                )
            return None
        paths = self._instances(name, index, child, text)
        if paths is None or not self._has_port(prefix + name, child, port, wanted, text):
            return None
        return [f"{instance}.{port}" for instance in paths]

    def _instances(self, name: str, index: str | None, child: _Child, text: Text) -> list[str] | None:
        if not child.array:
            if index is not None:
                self.problems.add(f"{name} is not an array", text.position, f"write {name}.port without index")
                return None
            return child.paths
        if index == "*":
            return child.paths
        if index is None:
            self.problems.add(
                f"{name} is an array of {len(child.paths)}", text.position, f"write {name}[*] or {name}[0]"
            )
            return None
        if int(index) >= len(child.paths):
            self.problems.add(f"{name} has {len(child.paths)} instances, there is no {name}[{index}]", text.position)
            return None
        return [child.paths[int(index)]]

    def _has_port(self, path: str, child: _Child, port: str, wanted: str, text: Text) -> bool:
        """Whether the child's type has the port, in the direction that the connection needs."""
        if child.composite is not None:
            kind = child.composite.name
            inputs, outputs = list(child.composite.inputs), list(child.composite.outputs)
        else:
            assert child.actor_type is not None
            kind = child.actor_type.__name__
            ports = port_directions(child.actor_type)
            inputs = [each for each, direction in ports.items() if direction == "input"]
            outputs = [each for each, direction in ports.items() if direction == "output"]
        valid, other = (outputs, inputs) if wanted == "output" else (inputs, outputs)
        if port in valid:
            return True
        if port in other:
            direction = "an input" if wanted == "output" else "an output"
            message = f"{path}.{port} is {direction} of {kind} and cannot be {'from' if wanted == 'output' else 'to'}"
        else:
            message = f"{path}: {kind} has no {wanted} port {port!r}{did_you_mean(port, valid)}"
        self.problems.add(message, text.position, f"valid {wanted} ports: {', '.join(valid) or 'none'}")
        return False

    # -- aspects, run, metrics ------------------------------------------------------------------------------------

    def _aspect(self, name: str, scope: str, part: PartText, names: dict[str, object]) -> None:
        cls = aspect_types().get(part.type.text)
        if cls is None:
            self.problems.add(
                f"aspect {name}: there is no aspect type {part.type.text!r}"
                f"{did_you_mean(part.type.text, list(aspect_types()))}",
                part.type.position,
                f"valid types: {', '.join(sorted(aspect_types()))}",
            )
            return
        values = self._configuration(f"aspect {name}", cls, part.values, names, part.position, name)
        if not part.at:
            self.problems.add(
                f"aspect {name} does not say where it stands", part.position, "add 'at:' with ports or patterns"
            )
        ports = select_ports(self.graph, name, cls, scope, part.at, self.problems)
        enabled = True
        if part.enabled is not None:
            enabled = bool(self.values.of(part.enabled, names))
        if values is not None and enabled:
            self.aspects.append(WovenAspect(name, cls(**values), ports))

    def _run(self, model: Model, names: dict[str, object]) -> None:
        for key, entry in self.text.run.items():
            if key == "record":
                for text in _texts(entry.value):
                    for path in self._outputs(text, "record"):
                        sources = self.graph.source_of(path)
                        model.record.update({path: source for source in sources})
            elif key == "stop_when":
                for text in _texts(entry.value):
                    for path in self._outputs(text, "stop_when"):
                        model.stop_when.extend(self.graph.source_of(path))
            else:
                value = self.values.of(entry.value, names)
                if value is self.values.missing:
                    continue
                parameter: Parameter[Any] = (
                    Parameter(float, unit="s", min=0.0) if key == "stop" else Parameter(int, min=0, max=2**63)
                )
                try:
                    converted = parameter.convert(value)
                    if key == "stop":
                        model.stop = to_nanoseconds(converted)
                    else:
                        model.seed = converted
                except (ParameterError, ValueError) as error:
                    self.problems.add(f"{key}: {error}", entry.value.position)

    def _outputs(self, text: Text, what: str) -> list[str]:
        """The output ports that a pattern selects, composites' included."""
        outputs = [path for path in self.graph.ports.nodes if self.graph.direction(path) == "output"]
        try:
            found = select(text.text, outputs)
        except PatternError as error:
            self.problems.add(f"{what}: {text.text!r} is no pattern: {error}", text.position)
            return []
        base = text.text.split("[")[0]
        if not found and base not in self.graph.empty_arrays:
            close = nearest(text.text, outputs)
            self.problems.add(
                f"{what}: {text.text!r} matches no output port" + (f", did you mean {close!r}?" if close else ""),
                text.position,
            )
        return found

    def _metric(self, model: Model, metric: MetricText) -> None:
        ports = [
            port
            for path in self._outputs(metric.port, f"metric {metric.name}")
            for port in self.graph.source_of(path)
        ]
        if metric.take in ("min", "max", "sum", "mean"):
            for port in ports:
                if port.type not in (float, int, bool):
                    self.problems.add(
                        f"metric {metric.name}: {port.path} sends {type_name(port.type)}, of which there is no "
                        f"{metric.take}",
                        metric.port.position,
                    )
        model.metrics.append(Metric(metric.name, ports, metric.take, metric.unit, metric.doc))


def port_directions(actor_type: type[Actor]) -> dict[str, str]:
    """The ports of an actor type and their directions."""
    return {name: port.direction for name, port in declared_ports(actor_type).items()}


def _texts(node: Node) -> list[Text]:
    items = getattr(node, "items", (node,))
    return [Text(item.text, item.position) for item in items if isinstance(item, Scalar)]
