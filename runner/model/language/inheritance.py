"""``extends``: a composite class, or a model, that inherits from another one and changes it.

The declarations of a class change those of its base, name by name:

- a parameter or port of the base stays; keys that the class gives again (a default, a bound, a type) replace the old;
- an actor or aspect keeps its values except those given again, also with another ``type``, which must have them;
``name: null`` removes it, with the base's connections and pointcuts to it;
- connections are added; ``remove: a.out -> b.in`` removes one of the base's.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

from epicycle.actors import UnitError, did_you_mean

from ..text.document import Entry
from ..text.limits import NORMAL, RAISE_IT, Limits
from ..text.problems import POISON, Poison, Position, Problems
from ..text.reading import Text
from .models import CompositeText, ModelText
from .parts import PartText
from .places import ConnectionText
from .ports import PortText

MAX_BASES = 50


def inherit(
    composites: Mapping[str, CompositeText], actor_types: Collection[str], problems: Problems, limits: Limits = NORMAL
) -> dict[str, CompositeText | Poison]:
    """The classes with what they inherit; poison, if a base is missing."""
    whole: dict[str, CompositeText | Poison] = {}
    inherited = 0
    for name, text in composites.items():
        # From the class up to the first finished base, then back down: no recursion, however long the chain.
        way: list[CompositeText] = []
        found: CompositeText | Poison | None = None
        while (found := whole.get(name)) is None:
            way.append(text := composites[name])
            if text.extends is None:
                found = whole[name] = way.pop()
                break
            if text.extends is POISON or not _is_sound(way, composites, actor_types, problems):
                found = POISON
                break
            name = text.extends.text
        for text in reversed(way):
            if found is not POISON:
                inherited += _size(found)
                if inherited > limits.inherited:
                    most = f"{limits.inherited:,} actors, aspects, connections, ports and parameters"
                    at = text.extends.position if text.extends else text.position
                    problems.stop(f"{text.name}: the classes inherit more than {most}", at, RAISE_IT)
                found = _Heir(found, text, problems).composite()
            whole[text.name] = found
    return {name: whole[name] for name in composites}


def extended(base: ModelText, text: ModelText, problems: Problems) -> ModelText:
    """A model with what it inherits from another one; metrics, monitors and figures are whole ones, by name."""
    root = _Heir(base.root, text.root, problems).composite()
    run = {key: each for key, each in vars(text.run).items() if each is not None}
    return replace(
        text,
        root=replace(root, written=(*base.root.written, *text.root.written)),
        run=replace(base.run, **run),
        metrics={**base.metrics, **text.metrics},
        monitors={**base.monitors, **text.monitors},
        exactly=base.exactly if text.exactly is None else text.exactly,
        figures={**base.figures, **text.figures},
    )


def _size(text: CompositeText) -> int:
    """How much can be inherited from a class."""
    parts = (text.actors, text.aspects, text.connections, text.inputs, text.outputs, text.parameters)
    return sum(map(len, parts))


def _is_sound(
    way: list[CompositeText], composites: Mapping[str, CompositeText], actor_types: Collection[str], problems: Problems
) -> bool:
    """Whether the last class of the chain extends one that exists and is not already in the chain."""
    last, names = way[-1], [text.name for text in way]
    assert last.extends
    base = last.extends
    if base.text not in composites:
        known = [name for name in composites if name != last.name]
        message = f"there is no composite {base.text!r} to extend{did_you_mean(base.text, known)}"
        hint = f"composites: {', '.join(known) or 'none'}"
        if base.text in actor_types:
            message, hint = f"{base.text} is an actor type, and only composites can be extended", "use it as an actor"
        problems.add(f"{last.name}: {message}", base.position, hint)
    elif base.text in names:
        loop = [(text.name, text.extends) for text in way[names.index(base.text) :] if text.extends]
        problems.add(
            f"{base.text} extends itself: {' -> '.join([*(name for name, _ in loop), base.text])}",
            loop[0][1].position,
            *(f"{name} extends {extended.text} at {extended.position}" for name, extended in loop),
        )
    elif len(way) > MAX_BASES:
        problems.add(f"{names[0]} has a chain of more than {MAX_BASES} bases", base.position)
    else:
        return True
    return False


class _Heir:
    """Puts one class on top of its base."""

    def __init__(self, base: CompositeText, text: CompositeText, problems: Problems) -> None:
        self.base = base
        self.text = text
        self.problems = problems

    def composite(self) -> CompositeText:
        base, text = self.base, self.text
        removed = {name: part.position for name, part in text.actors.items() if part.removes}
        parameters = dict(base.parameters)
        for name, parameter in text.parameters.items():
            old = base.parameters.get(name)
            given = {key: getattr(parameter, key) for key in parameter.given}
            said = {**given, "given": (*(old.given if old else ()), *parameter.given)}
            found = parameter if old is None else replace(old, position=parameter.position, **said)
            if POISON in (parameter.value, None if old is None else old.value):
                found = replace(found, value=POISON)
            else:
                try:
                    found.bounds()
                except UnitError as error:
                    self._problem(f"parameter {name!r}: {error}", parameter.position)
                    found = replace(found, value=POISON)
            parameters[name] = found
        result = replace(
            text,
            doc=text.doc or base.doc,
            parameters=parameters,
            inputs=self._ports("input"),
            outputs=self._ports("output"),
            director=base.director if text.director is None else text.director,
            machine=self._machine(),
            refinements={**base.refinements, **text.refinements},
            actors=self._parts("actor", base.actors, text.actors),
            aspects=self._parts("aspect", self._still_aimed(removed), text.aspects),
            connections=self._connections(removed),
            removed={**{name: at for name, at in base.removed.items() if name not in text.actors}, **removed},
        )
        for name, part in result.actors.items():
            is_port = name in result.inputs or name in result.outputs
            # If both are new, it was reported when the class was read.
            if is_port and (name in text.actors) != (name in text.inputs or name in text.outputs):
                self._problem(f"{name!r} is the name of both an actor and a port", part.position, "rename one")
        return result

    def _machine(self) -> PartText | None:
        old, new = self.base.machine, self.text.machine
        return new or old if old is None or new is None else replace(new, values={**old.values, **new.values})

    def _problem(self, message: str, position: Position, *hints: str) -> None:
        self.problems.add(f"{self.text.name}: {message}", position, *hints)

    def _ports(self, direction: str) -> dict[str, PortText]:
        other = "output" if direction == "input" else "input"
        ports = dict(self.base.ports(direction))
        for name, port in self.text.ports(direction).items():
            old, crossed = ports.get(name), self.base.ports(other).get(name)
            if crossed is not None:
                message = f"{name!r} is an {other} of {self.base.name} and cannot become an {direction}"
                self._problem(message, port.position, f"{self.base.name} declares it at {crossed.position}")
                continue
            ports[name] = port if old is None else replace(port, type=port.type or old.type, doc=port.doc or old.doc)
        return ports

    def _parts(self, kind: str, old: dict[str, PartText], new: dict[str, PartText]) -> dict[str, PartText]:
        """Actors or aspects, those of the base in their order, then new ones."""
        parts = dict(old)
        for name, part in new.items():
            before = old.get(name)
            if before is None and (part.removes or not part.type.text):
                what = "to remove" if part.removes else "to change"
                near = did_you_mean(name, list(old))
                self._problem(
                    f"{self.base.name} has no {kind} {name!r} {what}{near}",
                    part.position,
                    f"its {kind}s: {', '.join(old) or 'none'}" + ("" if part.removes else "; a new one needs a type"),
                )
            elif part.removes:
                del parts[name]
            elif before is None:
                parts[name] = part
            else:
                same = part.type.text in ("", before.type.text)
                parts[name] = replace(
                    part,
                    type=part.type if part.type.text else before.type,
                    values={**_without(before.values, part.inherit), **part.values},
                    kept=before.kept if same else frozenset(before.values.keys() - part.values.keys()),
                    inherit=part.inherit or before.inherit,
                    count=part.count or before.count,
                    priority=part.priority or before.priority,
                    at=part.at or before.at,
                    enabled=part.enabled or before.enabled,
                    tags=part.tags or before.tags,
                )
        return parts

    def _still_aimed(self, removed: Collection[str]) -> dict[str, PartText]:
        """The base's aspects without the pointcuts at removed actors, and without those that lose all of them."""
        aspects = {}
        for name, part in self.base.aspects.items():
            at = tuple(each for each in part.at if not each or each.head not in removed)
            if at or not part.at or name in self.text.aspects:
                aspects[name] = replace(part, at=at)
        return aspects

    def _connections(self, removed: Collection[str]) -> tuple[ConnectionText | Poison, ...]:
        """The connections of the base that are left, and those that the class adds."""
        removals = [each for each in self.text.connections if each and each.removes]
        known = {pair for each in self.base.connections if each for pair in _pairs(each)}
        written = [f"{source} -> {end}" for source, end in sorted(known)]
        for removal in removals:
            for source, end in (pair for pair in _pairs(removal) if pair not in known):
                wanted = f"{source} -> {end}"
                message = f"{self.base.name} has no connection {wanted!r} to remove{did_you_mean(wanted, written)}"
                self._problem(message, removal.position, f"write both ends as {self.base.name} does")
        cut = {pair for each in removals for pair in _pairs(each)}
        kept = [each for old in self.base.connections for each in (_kept(old, cut, removed) if old else [old])]
        return (*kept, *(each for each in self.text.connections if not (each and each.removes)))


def _without(values: Mapping[str, Entry], inherit: Collection[Text]) -> dict[str, Entry]:
    """Values of the base, but for those that come from around the part now."""
    named = {each.text for each in inherit}
    return {name: entry for name, entry in values.items() if name not in named}


def _kept(
    connection: ConnectionText, cut: Collection[tuple[str, str]], removed: Collection[str]
) -> list[ConnectionText]:
    """What is left of a connection, in parts if only some of its pairs are removed."""
    left = []
    for source in connection.sources:
        ends = [end for end in connection.destinations if (source.text, end.text) not in cut]
        ends = [end for end in ends if source.actor not in removed and end.actor not in removed]
        if ends:
            left.append(replace(connection, sources=(source,), destinations=tuple(ends)))
    return [connection] if sum(map(len, map(_pairs, left))) == len(_pairs(connection)) else left


def _pairs(connection: ConnectionText) -> list[tuple[str, str]]:
    return [(source.text, end.text) for source in connection.sources for end in connection.destinations]
