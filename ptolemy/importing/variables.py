"""Converts parameters that change during a run: those set by a SetVariable, and PortParameters of composites.

Each becomes a ``Variable`` among the actors of the composite that declares it; parameters that follow it get an aspect
``Replace``.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping
from dataclasses import dataclass, field

from .document import Property, director_of, is_text
from .limits import Notes
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
    readers: list[tuple[str, str]] = field(default_factory=list)  # places where parameters follow it, and how
    inputs: dict[str, None] = field(default_factory=dict)  # that it is connected to

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
        for part in model.everything():
            if part.entity.kind == "SetVariable" and part.outer is not None:
                self._add_set(part, part.outer)
            elif part.outer is not None and (part.role == "machine" or director_of(part.entity) is not None):
                # A transparent composite never reads such a port.
                for name, said in part.entity.properties.items():
                    path = f"{part.entity.name}.{name}"
                    if said.kind != "PortParameter" or not part.outer.entity.links.get(path):
                        continue
                    if part.role == "machine":  # it would hold the Variable, and has no actors
                        notes.error(f"{path} changes during the run, and a state machine cannot hold it")
                    else:
                        self._add(part, name).is_port = True
                        part.variable_ports.append(name)

    def _add_set(self, part: Part, around: Part) -> None:
        name = part.entity.word("variableName")
        child, _, inner = name.rpartition(".")
        if child and (not inner or (found := around.parts.get(child)) is None or found.parts):
            self._notes.note(f"{part.path} sets {name}, which is not a parameter of an actor beside it")
        if (home := around.scope.home(name)) is not None and home is not around.scope:
            self._notes.error(f"{part.path} sets {name} of a composite around it, which has no counterpart")
        elif name:
            self._add(around, name).delayed = part.entity.word("delayed", "true") != "false"

    def _add(self, owner: Part, name: str) -> Changing:
        key = id(owner.entity), name
        if key not in self._found:
            self._found[key] = Changing(owner, name, f"changing {len(self._found)}")
            self._model.scope.changes[key] = Code(ast.Name(self._found[key].stand_in))
        return self._found[key]

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

    def write(self, part: Part, actors: dict[str, Flow], connections: list[object]) -> dict[str, Flow]:
        """Add the variables of a composite to its actors; returns the aspects that follow them."""
        aspects: dict[str, Flow] = {}
        setters = [child for child in part.parts.values() if child.entity.kind == "SetVariable" and child.entry]
        for each in self._found.values():
            mine = [child for child in setters if child.entity.word("variableName") == each.name]
            if each.owner is not part or not (mine or each.is_port):
                continue
            name = each.named()
            for child in mine:
                if child.entry and "value" in child.entry:  # it sends the value of the variable
                    each.readers.append((f"{child.name}.value", f"{name}.value"))
            is_now = each.is_port or not each.delayed
            actors[name] = Flow({"type": "Variable", "priority": _FIRST, **({"delayed": False} if is_now else {})})
            sources = [part.ports.of(each.name)] if each.is_port else [f"{child.name}.variable" for child in mine]
            connections += [f"{source} -> {name}.input" for source in sources]
            connections += [f"{name}.value -> {port}" for port in each.inputs]
            for path, expression in each.readers:
                aspect = part.names.fresh(f"{each.name}_in_{path.replace('.', '_')}")
                aspects[aspect] = Flow({"type": "Replace", "to": expression, "at": path})
        return aspects
