"""Modal models and state machines: states, transitions with guards and actions, refinements."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any

from .actors import is_decoration, is_layout, plain
from .directors import director_of, said_of
from .entities import Entity, Property, Relation, kind
from .names import Names
from .parts import Converting, Level, Part, give_priority
from .scope import is_variable
from .syntax import ExpressionError
from .words import QUOTED, Words
from .writing import Flow

MACHINES = frozenset({"FSMActor", "ModalController", "InterfaceAutomaton", "FSMActorModal"})
_RESERVED = ("mode", "trigger", "time", "mode_time", "error", "machine")
_WORD = re.compile(r"(?<![\w.])(on|after|when|do)(?![\w.])")
_LAST_WITH_HISTORY = (9, 0)  # up to this version, transitions kept history by default
_FLAGS = {"preemptive": "preemptive", "immediate": "immediate", "nondeterministic": "nondeterministic",
          "defaultTransition": "else", "error": "error"}  # fmt: skip


def controller_of(entity: Entity) -> Entity | None:
    """The state machine of an entity: the entity itself, or the one inside a modal model; None without one."""
    if kind(entity) in MACHINES:
        return entity
    director = director_of(entity)
    if director is not None and (named := (director.text("controllerName") or "").strip().strip('"')):
        found = entity.entities.get(named)
        return found if found is not None and kind(found) in MACHINES else None
    return next(
        (each for each in entity.entities.values() if kind(each) in MACHINES and each.name == "_Controller"), None
    )


def is_machine(entity: Entity) -> bool:
    """Whether it is a state machine, with or without refinements."""
    return controller_of(entity) is not None


@dataclass
class _Machine:
    """One machine that is being imported."""

    conversion: Converting
    entity: Entity  # the modal model, or the state machine itself
    controller: Entity
    path: str
    at: str
    outer: Level
    ports: Names  # of ports and variables
    states: Names = field(default_factory=Names)
    variables: dict[str, str] = field(default_factory=dict)  # ours

    def __post_init__(self) -> None:
        self.scope = self.conversion.scope_of(self.controller)
        owner = self.entity if self.entity.ports else self.controller
        said = {**self.controller.ports, **owner.ports}
        self.inputs = {
            name: self._channels(owner, name)
            for name, port in said.items()
            if port.flag("input") and not port.flag("output")
        }
        self.outputs = {name: self._channels(owner, name) for name, port in said.items() if port.flag("output")}
        heard = {} if self.entity is self.controller else self.outputs  # ports to which refinements send
        self.words = Words(self.scope, {**self.inputs, **heard}, self.outputs, self.variables, self.tell)
        taken = {ours for names in (*self.inputs.values(), *self.outputs.values()) for ours in names}
        for transition in self.controller.relations.values():
            for name in self.words.targets(transition, "setActions"):
                if (
                    "." not in name
                    and "(" not in name
                    and name not in self.outputs
                    and self.scope.find(name) is not None
                ):
                    self.variables[name] = self.ports.of(name)
                elif (inner := self._inner_of(name)) is not None:
                    ours = self.ports.of(inner[1])
                    others = {said for each, said in self.variables.items() if each != name}
                    if ours not in taken | others:
                        self.variables[name] = ours  # otherwise two refinements, or a port, would share the name
        self._hand()

    def _channels(self, owner: Entity, name: str) -> list[str]:
        """Our names for a port: each channel is a separate port."""
        conversion = self.conversion
        return [conversion.port_name(self.ports, name, channel) for channel in range(conversion.channels(owner, name))]

    def _inner_of(self, name: str) -> tuple[Entity, str] | None:
        """The refinement and its parameter that an action sets; None if it sets no such parameter."""
        refinement, _, inner = name.partition(".")
        child = self.entity.entities.get(refinement) if self.entity is not self.controller else None
        if child is None or inner not in child.properties or controller_of(child) is not None:
            return None
        return child, inner

    def _hand(self) -> None:
        """Make the refinements follow the variables that they use."""
        for name in self.variables:
            inner = self._inner_of(name)
            if inner is not None:
                self.conversion.hand(*inner)
                continue
            for child in self._refinements():
                if controller_of(child) is None and self._readers(child, name):
                    self.conversion.hand(child, name)

    def _refinements(self) -> list[Entity]:
        if self.entity is self.controller:
            return []
        return [each for each in self.entity.entities.values() if each is not self.controller]

    def _readers(self, child: Entity, name: str) -> list[tuple[Entity, Property]]:
        """The parameters in a refinement that are computed from a variable."""
        pattern = re.compile(rf"(?<![\w.]){re.escape(name)}(?!\w)")
        return [
            (each, said)
            for each in child.everything()
            for said in each.properties.values()
            if is_variable(said) and pattern.search(said.value or "")
        ]

    def tell(self, text: str) -> None:
        self.conversion.notes.note(f"{self.path}: {text}")

    # -- writing --------------------------------------------------------------------------------------------------

    def written(self) -> dict[str, Any]:
        """The sections for modes and transitions."""
        modes: dict[str, Any] = {}
        initial, finals = self._initial_state(), self._final_states()
        lost = self._unreachable(initial, finals)
        for state in self._states():
            if state.name in lost:
                self.tell(f"{state.name} is left out: no transition leads there")
                continue
            said: dict[str, Any] = {}
            refinements = [each.strip() for each in (state.text("refinementName") or "").split(",") if each.strip()]
            if len(refinements) > 1:
                self.tell(f"{state.name} has {len(refinements)} refinements; only {refinements[0]} is kept")
            if refinements and self.entity is not self.controller:
                said |= self._refinement(refinements[0], self.states.of(state.name))
            if state.name in finals:
                said["final"] = True
            modes[self.states.of(state.name)] = Flow(said) if said else None
        leaving = [each for each in self.controller.relations.values() if self._ends(each.name)[0] not in lost]
        ending = [each for each in leaving if self._ends(each.name)[0] in finals]
        for each in ending:
            self.tell(f"the transition {each.name} is left out: nothing leaves a final state")
        found_ones = [self._transition(each) for each in leaving if each not in ending]
        transitions = [each for each in found_ones if each is not None]
        found: dict[str, Any] = {}
        if self.variables:
            found["variables"] = Flow({ours: plain(self._initial(name)) for name, ours in self.variables.items()})
        found["modes"] = modes if any(modes.values()) else list(modes)
        first = self.states.of(initial) if initial is not None else None
        if first is not None and first in modes and first != next(iter(modes)):
            found["initial"] = first
        if transitions:
            found["transitions"] = transitions
        if not modes:
            self.conversion.notes.error(f"{self.path} has no states")
        self._tell_readers()
        for name, ours in {**self.ports.renamed(), **self.states.renamed()}.items():
            self.tell(f"{name} is renamed {ours}")
        return found

    def _tell_readers(self) -> None:
        """Report parameters in refinements that are computed from variables and should change with them."""
        for name in self.variables:
            for child in self._refinements():
                if controller_of(child) is not None:
                    for each, said in self._readers(child, name):
                        self.tell(f"{each.name}.{said.name} uses the initial value of {name} throughout")

    def _states(self) -> list[Entity]:
        return list(self.controller.entities.values())

    def _initial_state(self) -> str | None:
        """The last state marked as initial, or the one that the machine names, as in files of former versions."""
        said = (self.controller.text("initialStateName") or "").strip().strip('"')
        named = said if said in self.controller.entities else None
        return next((each.name for each in reversed(self._states()) if self._flag(each, "isInitialState")), named)

    def _final_states(self) -> frozenset[str]:
        named = [each.strip() for each in (self.controller.text("finalStateNames") or "").strip('" ').split(",")]
        return frozenset(each.name for each in self._states() if self._flag(each, "isFinalState") or each.name in named)

    def _unreachable(self, initial: str | None, finals: frozenset[str]) -> frozenset[str]:
        """The states that are never entered; Ptolemy allows them."""
        names = [each.name for each in self._states()]
        ways = [self._ends(each) for each in self.controller.relations]
        waiting = [initial or name for name in names[:1]]
        reached = set(waiting)
        while waiting:
            here = waiting.pop()
            for source, target in ways if here not in finals else ():
                if source == here and target is not None and target not in reached:
                    reached.add(target)
                    waiting.append(target)
        return frozenset(names) - reached

    def _initial(self, name: str) -> object:
        inner = self._inner_of(name)
        try:
            value = self.scope(name) if inner is None else self.conversion.scope_of(inner[0])(inner[1])
        except (ExpressionError, KeyError) as error:
            self.conversion.notes.error(f"{self.path}.{name}: {error}")
            return 0
        return 0 if value is None else value

    def _flag(self, owner: Property, name: str) -> bool:
        said = (owner.text(name) or "").strip()
        if said in ("", "false"):
            return False
        try:
            return self.scope.value(said) is True
        except ExpressionError as error:
            self.tell(f"{owner.name}.{name} = {said!r}: {error}")
            return False

    def _refinement(self, name: str, mode: str) -> dict[str, Any]:
        """The class of a refinement, whose ports keep the names that they have outside."""
        child = self.entity.entities.get(name)
        if child is None:
            self.conversion.notes.error(f"{self.path}: there is no refinement named {name!r}")
            return {}
        found = refinement_of(self, child, f"{self.path}.{name}", mode)
        return {"refinement": found["type"] if len(found) == 1 else found}

    # -- transitions ----------------------------------------------------------------------------------------------

    def _transition(self, transition: Relation) -> Any:
        source, target = self._ends(transition.name)
        if source is None or target is None:
            self.tell(f"the transition {transition.name} is left out: it needs a state at each end")
            return None
        flags = [ours for name, ours in _FLAGS.items() if self._flag(transition, name)]
        if self._has_history(transition) and self._leads_to_refinement(target):
            flags.append("history")
        if self._flag(transition, "termination"):
            self.conversion.notes.error(f"{self.path}.{transition.name}: termination transitions have no counterpart")
        if (transition.text("refinementName") or "").strip():
            self.conversion.notes.error(
                f"{self.path}.{transition.name}: a refinement of a transition has no counterpart"
            )
        try:
            said = self.words.guard(transition)
            actions = [*self.words.actions(transition, "outputActions"), *self.words.actions(transition, "setActions")]
        except ExpressionError as error:
            self.conversion.notes.error(f"{self.path}.{transition.name}: {error}")
            return None
        if actions:
            said["do"] = "; ".join(actions)
        return _line(self.states.of(source), self.states.of(target), flags, said)

    def _ends(self, name: str) -> tuple[str | None, str | None]:
        """The source and target states of a transition."""
        source = target = None
        for port, links in self.controller.links.items():
            state, _, end = port.rpartition(".")
            for link in links:
                if link.relation == name and state in self.controller.entities:
                    if end == "outgoingPort":
                        source = state
                    elif end == "incomingPort":
                        target = state
        return source, target

    def _has_history(self, transition: Relation) -> bool:
        if "history" in transition.properties:
            return self._flag(transition, "history")
        if "reset" in transition.properties:
            return not self._flag(transition, "reset")
        return self.conversion.version <= _LAST_WITH_HISTORY

    def _leads_to_refinement(self, state: str) -> bool:
        found = self.controller.entities.get(state)
        return (
            self.entity is not self.controller
            and found is not None
            and bool((found.text("refinementName") or "").strip())
        )


def _line(source: str, target: str, flags: list[str], said: dict[str, str]) -> Any:
    """A transition on one line, or as a mapping where the line would be ambiguous."""
    if " " in said.get("probability", "") or any(_WORD.search(QUOTED.sub("", each)) for each in said.values()):
        return Flow({"from": source, "to": target, **dict.fromkeys(flags, True), **said})
    if "probability" in said:
        flags = [*flags, f"probability {said['probability']}"]
    clauses = [f"{key} {said[key]}" for key in ("on", "after", "when", "do") if key in said]
    return " ".join([f"{source} -> {target}", *flags, *clauses])


# -- as parts of a model ------------------------------------------------------------------------------------------


def machine_part(conversion: Converting, child: Entity, level: Level, name: str) -> Part:
    """A state machine as an actor, a modal model as a composite with modes."""
    controller = controller_of(child)
    assert controller is not None
    path = level.told(child.name)
    ports = Names(_RESERVED, in_expressions=True)
    machine = _Machine(conversion, child, controller, path, f"{level.at}{name}.", level, ports)
    _tell_rest(conversion, child, path, machine)
    channels: dict[str, list[str | None]] = {
        name: [*ours] for name, ours in {**machine.inputs, **machine.outputs}.items()
    }
    if child is controller:
        entry = Flow({"type": "StateMachine", **machine.written()})
        channels = machine.words.wired()
    else:
        entry = conversion.instance(child, _class(machine), {})
    give_priority(entry, child, conversion.scope_of(child), conversion.notes)
    first = {name: ours[0] for name, ours in {**machine.inputs, **machine.outputs}.items()}
    return Part(name, entry, ports=first, channels=channels)


def _class(machine: _Machine) -> dict[str, Any]:
    said = machine.written()
    found: dict[str, Any] = {}
    if machine.entity.doc:
        found["doc"] = " ".join(machine.entity.doc.split())
    if machine.inputs:
        found["inputs"] = [ours for names in machine.inputs.values() for ours in names]
    if machine.outputs:
        found["outputs"] = [ours for names in machine.outputs.values() for ours in names]
    return {**found, **said}


def refinement_of(around: _Machine, child: Entity, path: str, mode: str) -> Flow:
    """The refinement of a mode: a composite, possibly with its own modes."""
    conversion, controller, at = around.conversion, controller_of(child), f"{around.at}{mode}."
    if controller is not None:
        machine = _Machine(conversion, child, controller, path, at, around.outer, around.ports)
        _tell_rest(conversion, child, path, machine)
        return conversion.instance(child, _class(machine), {})
    level = conversion.level(child, path, at, around.outer)
    level.ports = around.ports
    body = conversion.body(level)
    if (director := director_of(child)) is not None:
        said = said_of(director, level.told(director.name), level.scope, conversion.notes, of_model=False)
        for key in said:
            conversion.notes.note(f"{path}: {key} of the director of a refinement has no counterpart")
    return conversion.instance(child, body, conversion.parameters(level))


def _tell_rest(conversion: Converting, child: Entity, path: str, machine: _Machine) -> None:
    """Report attributes without a counterpart."""
    known = {
        "initialStateName",
        "finalStateNames",
        "directorClass",
        "resetOnEachRun",
        "seed",
        "_priority",
        "stateDependentCausality",
    }
    for owner in {id(each): each for each in (child, machine.controller)}.values():
        for name, said in owner.properties.items():
            if (
                name in known
                or is_layout(said)
                or is_decoration(said)
                or is_variable(said)
                or kind(said).endswith("Director")
            ):
                continue
            if said.value is not None or said.java:
                conversion.notes.note(f"{path}.{name}, a {kind(said) or 'property'}, has no counterpart")
