"""Converts parameters that change during a run: those set by a SetVariable, and PortParameters of composites.

Each becomes a ``Variable`` among the actors of the composite that declares it; parameters that follow it get an aspect
``Replace``.
"""

from __future__ import annotations

from .actors import Actor, plain
from .entities import Entity
from .modes import is_machine
from .parts import Changing, Converting, Level, Part
from .scope import Scope
from .syntax import ExpressionError, Tree
from .translate import names_of, translated
from .writing import Flow

_FIRST = -1000  # a priority: a new value takes effect for all firings at that microstep


class Variables:
    """All parameters of a model that change."""

    def __init__(self, conversion: Converting) -> None:
        self._conversion = conversion
        self._found: dict[tuple[int, str], Changing] = {}
        for entity in conversion.model.everything():
            if entity.java.endswith(".SetVariable"):
                self._set_by(entity)
            elif entity.entities:
                for name, said in entity.properties.items():
                    if said.java.endswith(".PortParameter") and conversion.is_linked(entity, name):
                        self._found[id(entity), name] = Changing(entity, name, delayed=False, is_port=True)
        for key, each in list(self._found.items()):
            if is_machine(each.owner):  # it would hold the Variable, and has no actors
                conversion.notes.error(
                    f"{each.owner.name}.{each.name} changes during the run, and a state machine cannot hold it"
                )
                del self._found[key]

    def _set_by(self, entity: Entity) -> None:
        scope = self._conversion.scope_of(entity)
        name = (entity.text("variableName") or "").strip().strip('"')
        around = self._conversion.container_of(entity)
        if not name or around is None:
            return
        child, _, inner = name.rpartition(".")
        if child and (not inner or (found_child := around.entities.get(child)) is None or found_child.entities):
            path = self._conversion.path_of(around, entity)
            self._conversion.notes.note(f"{path} sets {name}, which is not a parameter of an actor beside it")
        home = None if scope.around is None else scope.around.home(name)
        owner = around if home is None or not isinstance(home.entity, Entity) else home.entity
        found = self._found.setdefault((id(owner), name), Changing(owner, name))
        found.delayed = (entity.text("delayed") or "true").strip() != "false"

    def has_port(self, entity: Entity, port: str) -> bool:
        """Whether a port of a composite delivers values of a parameter."""
        found = self._found.get((id(entity), port))
        return found is not None and found.is_port

    def hand(self, refinement: Entity, name: str) -> None:
        """Make a refinement follow a variable of its machine, which arrives at an input of that name at each entry."""
        self._found[id(refinement), name] = Changing(refinement, name, delayed=False, is_port=True)

    def of(self, owner: Entity) -> list[Changing]:
        """The changing parameters that a composite declares."""
        return [each for each in self._found.values() if each.owner is owner]

    def find(self, scope: Scope, name: str) -> Changing | None:
        """The changing parameter that a name refers to, if it is one."""
        around: Scope | None = scope
        while around is not None:
            if (found := self._found.get((id(around.entity), name))) is not None:
                return found
            if around.own(name) is not None:
                return None
            around = around.around
        return None

    def said(self, text: str, scope: Scope) -> tuple[str, Changing] | None:
        """An expression over what its variables send, and one of these variables; None if it has none."""
        if not self._found:
            return None
        try:
            tree = scope.tree(text)
            names, found = self._names(tree, scope, 0)
            return (translated(tree, names, scope), found[-1]) if found else None
        except ExpressionError:
            return None

    def names_in(self, tree: Tree, scope: Scope) -> tuple[dict[str, str], dict[str, Changing]]:
        """The names in an expression that change, with our names for the variables, and these variables."""
        if not self._found:
            return {}, {}
        names, found = self._names(tree, scope, 0)
        ours = {name: text.replace(".value", "") for name, text in names.items()}
        read = {id(each) for each in found if each.owner.entities}
        return ours, {self.actor_of(each): each for each in self._found.values() if id(each) in read}

    def lead_to(self, changing: Changing, level: Level, port: str) -> None:
        """Connect a variable to the input of an actor, through the composites between."""
        here = level
        while here.entity is not changing.owner and here.outer is not None:
            name = here.names.fresh(f"{changing.name}_is")
            here.added_inputs.append(name)
            here.added_connections.append(f"{name} -> {port}")
            port = f"{here.at.rstrip('.').rpartition('.')[2]}.{name}"
            here = here.outer
        changing.inputs.append(port)

    def _names(self, tree: Tree, scope: Scope, depth: int) -> tuple[dict[str, str], list[Changing]]:
        names: dict[str, str] = {}
        some: list[Changing] = []
        for name in sorted(names_of(tree)) if depth < 20 else ():
            found = self.find(scope, name)
            if found is not None:
                names[name] = f"{self.actor_of(found)}.value"
                some.append(found)
                continue
            home = scope.home(name)
            said = None if home is None else home.own(name)
            if home is None or said is None or not (said.value or "").strip():
                continue
            try:
                inner = home.tree(said.value or "")
                deeper, changing = self._names(inner, home, depth + 1)
                if changing:
                    names[name] = f"({translated(inner, deeper, home)})"
                    some += changing
            except ExpressionError:
                continue
        return names, some

    def actor_of(self, changing: Changing) -> str:
        """Our name of the Variable."""
        if not changing.actor:
            level = self._conversion.levels[id(changing.owner)]
            changing.actor = level.names.fresh(f"{changing.name}_variable")
        return changing.actor

    def follow(self, actor: Actor, level: Level, ours: str, text: str, name: str) -> None:
        """Make a parameter of an actor follow the variables in its expression, or the variable that it is itself."""
        found = self.said(text, actor.scope) if text else None
        own = self._found.get((id(level.entity), f"{actor.entity.name}.{name}"))
        if own is not None:
            found = f"{self.actor_of(own)}.value", own
        if found is not None:
            expression, changing = found
            owner = self._conversion.levels[id(changing.owner)]
            path = f"{level.at}{level.names.of(actor.entity.name)}.{ours}"
            changing.readers.append((path.removeprefix(owner.at), expression))

    def note_setter(self, entity: Entity, level: Level, part: Part) -> None:
        """Connect a SetVariable to its variable, through the composites between."""
        name = (entity.text("variableName") or "").strip().strip('"')
        changing = self.find(self._conversion.scope_of(level.entity), name)
        if changing is None:
            return
        end, here = f"{part.name}.variable", level
        if "value" in part.entry:  # it sends the value of the variable
            owner = self._conversion.levels[id(changing.owner)]
            path = f"{level.at}{part.name}.value".removeprefix(owner.at)
            changing.readers.append((path, f"{self.actor_of(changing)}.value"))
        while here.entity is not changing.owner and here.outer is not None:
            port = here.names.fresh(f"{changing.name}_set")
            here.added_outputs.append(port)
            here.added_connections.append(f"{end} -> {port}")
            end = f"{here.at.rstrip('.').rpartition('.')[2]}.{port}"
            here = here.outer
        changing.setters.append(end)

    def add(self, level: Level, actors: dict[str, Flow], connections: list[object]) -> dict[str, Flow]:
        """Add the variables of a composite to its actors; returns the aspects that follow them."""
        aspects: dict[str, Flow] = {}
        for each in self.of(level.entity):
            if not each.setters and not each.is_port:
                continue
            name = self.actor_of(each)
            actors[name] = Flow(
                {"type": "Variable", "priority": _FIRST, **({} if each.delayed else {"delayed": False})}
            )
            sources = [level.ports.of(each.name)] if each.is_port else each.setters
            connections += [f"{source} -> {name}.input" for source in sources]
            setters = {source.partition(".")[0] for source in sources if not each.delayed and not each.is_port}
            for port in each.inputs:
                if setters & self._behind(level, port.partition(".")[0]):  # it is read on the path to where it is set
                    connections.append(Flow({"from": f"{name}.value", "to": port, "delay": "0 s"}))
                else:
                    connections.append(f"{name}.value -> {port}")
            for path, expression in each.readers:
                aspect = level.names.fresh(f"{each.name}_in_{path.replace('.', '_')}")
                aspects[aspect] = Flow({"type": "Replace", "to": expression, "at": path})
        return aspects

    def _behind(self, level: Level, name: str) -> set[str]:
        """All parts of a composite that tokens from a given part can reach, including itself, by our names."""
        ways: dict[str, set[str]] = {}
        for net in self._conversion.nets_of(level.entity):
            ends = {end.actor: self._conversion.end(level, end) for end in net.ends if end.actor}
            receivers = {found[0].partition(".")[0] for found in ends.values() if found is not None and not found[1]}
            for found in ends.values():
                if found is not None and found[1]:
                    ways.setdefault(found[0].partition(".")[0], set()).update(receivers)
        reached, waiting = {name}, [name]
        while waiting:
            for each in ways.get(waiting.pop(), set()) - reached:
                reached.add(each)
                waiting.append(each)
        return reached


def set_variable(actor: Actor) -> None:
    """A SetVariable, which starts with the value set in the model."""
    name = actor.text("variableName")
    actor.told.add("delayed")
    if actor.get("delayed", True) is False:
        actor.values["delayed"] = False
    try:
        around = actor.scope.around
        value = None if around is None else around(name)
    except (KeyError, ExpressionError):
        value = None
    if value is not None:
        actor.values["value"] = plain(value)
