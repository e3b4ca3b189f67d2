"""Converts parameters that change during a run: those set by a SetVariable, and PortParameters of composites.

Each becomes a ``Variable`` among the actors of the composite that declares it; parameters that follow it get an aspect
``Replace``.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from .entities import Property, director_of, is_text
from .notes import Notes
from .parts import Part
from .scope import Scope
from .syntax import ExpressionError
from .translation import Code, Meaning, named, replaced
from .writing import Flow, plain

_FIRST = -1000  # a priority: a new value takes effect for all firings at that microstep


@dataclass(eq=False)
class Changing:
    """One parameter that changes."""

    owner: Part
    name: str
    stand_in: str  # what stands for it in expressions until the names of actors are known
    delayed: bool = True
    is_port: bool = False  # whether its values come from a port of a composite
    actor: str = ""  # our name of the Variable
    setters: list[str] = field(default_factory=list)  # its sources, as seen from the owner
    readers: list[tuple[str, str]] = field(default_factory=list)  # places where parameters follow it, and how
    inputs: list[str] = field(default_factory=list)  # that it is connected to

    def named(self) -> str:
        """Our name of the Variable."""
        self.actor = self.actor or self.owner.names.fresh(f"{self.name}_variable")
        return self.actor

    def first(self) -> object:
        """Its value before the first change."""
        try:
            return plain(self.owner.scope(self.name))
        except (KeyError, ValueError, ExpressionError):
            return 0


class Variables:
    """All parameters of a model that change."""

    def __init__(self, model: Part, notes: Notes) -> None:
        self._model, self._notes = model, notes
        self._found: dict[tuple[int, str], Changing] = {}
        self._set_by: dict[int, Changing] = {}
        for part in model.everything():
            if part.entity.kind == "SetVariable" and part.outer is not None:
                self._add_set(part, part.outer)
            elif part.parts and director_of(part.entity) is not None:  # a transparent composite never reads such a port
                for name, said in part.entity.properties.items():
                    path = f"{part.entity.name}.{name}"
                    if said.kind == "PortParameter" and part.outer is not None and part.outer.entity.links.get(path):
                        self.add_port(part, name)
        for key, each in list(self._found.items()):
            if each.owner.role == "machine":  # it would hold the Variable, and has no actors
                path = f"{each.owner.entity.name}.{each.name}"
                notes.error(f"{path} changes during the run, and a state machine cannot hold it")
                del self._found[key]
                del model.scope.changes[key]

    def _add_set(self, part: Part, around: Part) -> None:
        name = part.entity.word("variableName")
        if not name:
            return
        child, _, inner = name.rpartition(".")
        if child and (not inner or (found := around.parts.get(child)) is None or found.parts):
            self._notes.note(f"{part.path} sets {name}, which is not a parameter of an actor beside it")
        home, owner = around.scope.home(name), around
        while home is not None and owner.scope is not home and owner.outer is not None:
            owner = owner.outer
        changing = self._add(owner if home is not None else around, name)
        changing.delayed = part.entity.word("delayed", "true") != "false"
        self._set_by[id(part)] = changing

    def _add(self, owner: Part, name: str) -> Changing:
        key = id(owner.entity), name
        if key not in self._found:
            self._found[key] = Changing(owner, name, f"changing {len(self._found)}")
            self._model.scope.changes[key] = Code(ast.Name(self._found[key].stand_in))
        return self._found[key]

    def add_port(self, owner: Part, name: str) -> None:
        """Make a composite follow one of its parameters, whose values arrive at an input of that name."""
        changing = self._add(owner, name)
        changing.delayed, changing.is_port = False, True
        if name not in owner.variable_ports:
            owner.variable_ports.append(name)

    def names_of(self, owner: Part) -> set[str]:
        """The changing parameters that a composite declares."""
        return {each.name for each in self._found.values() if each.owner is owner}

    # -- what reads and sets them ------------------------------------------------------------------------------------

    def in_(self, said: Meaning) -> list[Changing]:
        """The changing parameters in an expression."""
        if not isinstance(said, Code):
            return []
        names = {node.id for node in ast.walk(said.node) if isinstance(node, ast.Name)}
        return [each for each in self._found.values() if each.stand_in in names]

    def changes(self, said: Property, scope: Scope) -> bool:
        """Whether an attribute changes during the run."""
        try:
            return bool(self._found) and not is_text(said) and bool(self.in_(scope.meaning_of(said)))
        except ExpressionError:
            return False  # it is reported where its value is needed

    def text(self, said: Meaning, ending: str = "") -> str:
        """An expression over the names of variables, each with an ending."""
        names: Mapping[str, Code] = {each.stand_in: named(f"{each.named()}{ending}") for each in self.in_(said)}
        assert isinstance(said, Code)
        return ast.unparse(replaced(said.node, names))

    def follow(self, part: Part, ours: str, name: str, said: Property | None) -> None:
        """Make a parameter of an actor follow the variables in its expression, or the variable that it is itself."""
        around = part.around
        changing = self._found.get((id(around.entity), f"{part.entity.name}.{name}"))
        expression = "" if changing is None else f"{changing.named()}.value"
        if changing is None and said is not None and self.changes(said, part.scope):
            meaning = part.scope.meaning_of(said)
            changing, expression = self.in_(meaning)[-1], self.text(meaning, ".value")
        if changing is not None:
            path = f"{around.at}{around.names.of(part.entity.name)}.{ours}"
            changing.readers.append((path.removeprefix(changing.owner.at), expression))

    def lead_to(self, changing: Changing, around: Part, port: str) -> None:
        """Connect a variable to the input of an actor, through the composites between."""
        for here in self._way(changing, around):
            name = here.names.fresh(f"{changing.name}_is")
            here.added[0].append(name)
            here.added[2].append(f"{name} -> {port}")
            port = f"{here.name}.{name}"
        changing.inputs.append(port)

    def lead_from(self, part: Part, *, has_value: bool) -> None:
        """Connect a SetVariable to its variable, through the composites between."""
        changing = self._set_by.get(id(part))
        if changing is None:
            return
        end = f"{part.name}.variable"
        if has_value:  # it sends the value of the variable
            path = f"{part.around.at}{part.name}.value".removeprefix(changing.owner.at)
            changing.readers.append((path, f"{changing.named()}.value"))
        for here in self._way(changing, part.around):
            port = here.names.fresh(f"{changing.name}_set")
            here.added[1].append(port)
            here.added[2].append(f"{end} -> {port}")
            end = f"{here.name}.{port}"
        changing.setters.append(end)

    def _way(self, changing: Changing, here: Part) -> Iterator[Part]:
        """The composites from one to the owner of a variable."""
        while here is not changing.owner and here.outer is not None:
            if here.role == "machine":
                self._notes.error(f"{here.path}: {changing.name}, a variable outside, cannot be used in a refinement")
                return
            yield here
            here = here.outer

    def write(self, part: Part, actors: dict[str, Flow], connections: list[object]) -> dict[str, Flow]:
        """Add the variables of a composite to its actors; returns the aspects that follow them."""
        aspects: dict[str, Flow] = {}
        for each in self._found.values():
            if each.owner is not part or not (each.setters or each.is_port):
                continue
            name = each.named()
            actors[name] = Flow(
                {"type": "Variable", "priority": _FIRST, **({} if each.delayed else {"delayed": False})}
            )
            sources = [part.ports.of(each.name)] if each.is_port else each.setters
            connections += [f"{source} -> {name}.input" for source in sources]
            connections += [f"{name}.value -> {port}" for port in each.inputs]
            for path, expression in each.readers:
                aspect = part.names.fresh(f"{each.name}_in_{path.replace('.', '_')}")
                aspects[aspect] = Flow({"type": "Replace", "to": expression, "at": path})
        return aspects
