"""What differs between two models: their actors, connections, values and aspects, not their texts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import groupby
from typing import Any

from epicycle.actors import counted, declared_parameters, paths, plain, type_name

from ..model.build.model import Model
from ..model.catalogue.reference import as_written, shown
from ..model.graph.outputs import Metric
from ..model.text.document import plain as plain_node
from ..model.text.patterns import in_general
from ..support.shown import in_time

Facts = dict[str, Any]  # by what they are of
Contents = dict[str, dict[str, Facts]]  # by section and path
_SIGNS = {"added": "+", "removed": "-", "changed": "~"}


@dataclass(frozen=True)
class Change:
    """Something that one model has and the other has not, or whose ``fact`` has another value."""

    section: str
    path: str
    what: str  # added, removed or changed
    fact: str
    before: Any
    after: Any

    def __str__(self) -> str:
        sign = _SIGNS[self.what]
        if self.what == "changed":
            name = f"{self.path}.{self.fact}" if self.fact else self.path
            return f"{sign} {name}: {shown(self.before)} -> {shown(self.after)}"
        facts = self.after if self.what == "added" else self.before
        said = [f"{key} {shown(value)}".lstrip() for key, value in facts.items() if value not in (None, [], {}, "")]
        return f"{sign} {self.path}" + (f": {', '.join(said)}" if said else "")


@dataclass(frozen=True)
class Difference:
    """The changes that lead from one model to another; false if there are none."""

    names: tuple[str, str]
    changes: tuple[Change, ...]

    def __bool__(self) -> bool:
        return bool(self.changes)

    def to_dict(self) -> dict[str, Any]:
        """The same as plain data."""
        return {"models": list(self.names), "same": not self, "changes": [asdict(each) for each in self.changes]}

    def __str__(self) -> str:
        """The changes by section; those of replicas once, with their number."""
        if not self:
            return f"{self.names[0]} and {self.names[1]} are the same model"
        lines = []
        for section, changes in groupby(self.changes, key=lambda each: each.section):
            lines.append(section)
            alike: dict[str, list[Change]] = {}
            for each in changes:
                alike.setdefault(in_general(str(each)), []).append(each)
            lines += (f"  {each[0]}" if len(each) == 1 else f"  {text} ({len(each)})" for text, each in alike.items())
        added, removed, changed = (sum(each.what == what for each in self.changes) for what in _SIGNS)
        lines.append(f"{counted(added, 'part')} added, {removed} removed, {counted(changed, 'value')} changed")
        return "\n".join(lines)


def difference(one: Model, other: Model) -> Difference:
    """What has changed from one model to the other."""
    before, after = contents(one), contents(other)
    return Difference((one.name, other.name), tuple(_changes(before, after)))


def _changes(before: Contents, after: Contents) -> Iterator[Change]:
    for section in before:
        old, new = before[section], after[section]
        for path in dict.fromkeys((*old, *new)):
            if path not in old:
                yield Change(section, path, "added", "", None, new[path])
            elif path not in new:
                yield Change(section, path, "removed", "", old[path], None)
            else:
                for fact in dict.fromkeys((*old[path], *new[path])):
                    values = old[path].get(fact), new[path].get(fact)
                    if values[0] != values[1]:
                        yield Change(section, path, "changed", fact, *values)


def contents(model: Model) -> Contents:
    """Everything that a model consists of, with the values that its parameters have."""
    graph, output = model.graph, model.output
    run = {
        "stop": None if model.stop is None else in_time(model.stop),
        "stop_when": list(output.stop_ports),
        "seed": output.seed,
        "record": sorted(output.recorded),
    }
    return {
        "model": {"model": {"name": model.name}},
        "parameters": {name: {"": _plain(value)} for name, value in model.parameters.items()},
        "directors": {
            path or "model": {
                "like": each.dialect.name,
                "start": in_time(each.clock.start / 1e9),
                "rate": str(each.clock.rate),
            }
            for path, each in graph.domains.items()
        },
        "actors": {
            path or "model": {
                "type": each.kind,
                **({"priority": each.priority} if each.priority else {}),
                **({"tags": list(each.tags)} if each.tags else {}),
                **_values(graph.actors.get(path)),
            }
            for path, each in graph.components.items()
        },
        "ports": {
            path: {"direction": graph.direction(path), "type": type_name(graph.type_of(path))}
            for path in graph.ports
            if graph.components[paths.parent(path)].kind
        },
        "connections": _connections(model),
        "aspects": {
            each.name: {"type": each.kind, "at": sorted(each.places), **_values(each.aspect)} for each in model.aspects
        },
        "run": {"run": run},
        "metrics": {each.name: _metric(each) for each in output.metrics if not each.monitor},
        "monitors": {each.name: _values(each.requirement) for each in output.monitors},
        "figures": {
            name: {"type": kind, **{key: plain_node(each.value) for key, each in written.entries.items()}}
            for name, (kind, _, written) in model.figures.items()
        },
    }


def _connections(model: Model) -> dict[str, Facts]:
    """The connections by their ends; there may be several between two ports."""
    found: dict[str, Facts] = {}
    for edge in model.graph.edges:
        delay = None if edge.delay is None else in_time(edge.delay / 1e9)
        facts = found.setdefault(str(edge), {"delay": delay})
        if facts["delay"] != delay:
            facts["delay"] = f"{facts['delay'] or 'none'}, {delay or 'none'}"
    return found


def _metric(metric: Metric) -> Facts:
    found = _values(metric.measure)
    return {**found, "from": metric.formula.source} if metric.formula is not None else {"of": metric.ports, **found}


def _values(part: Any) -> Facts:
    """The values of all parameters of a part that has some."""
    declared = declared_parameters(type(part))
    found = {name: _plain(parameter.value_in(part)) for name, parameter in declared.items()}
    return {name: value for name, value in found.items() if value is not None}


def _plain(value: object) -> Any:
    """A value as a model file would write it; what no file can say by its description."""
    written = as_written(plain(value))
    return repr(value) if isinstance(written, str) and written == f"<{type(value).__name__}>" else written
