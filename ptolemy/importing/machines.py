"""Modal models and state machines: states, transitions with guards and actions, refinements."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any

from .actions import QUOTED, Words
from .entities import Entity, Property, Relation, is_variable
from .leftovers import about_property
from .names import Names
from .notes import Notes
from .parts import Part
from .syntax import ExpressionError
from .tables import WORDS
from .writing import Flow, plain

_RESERVED = ("mode", "trigger", "time", "mode_time", "error", "machine")
_WORD = re.compile(r"(?<![\w.])(on|after|when|do)(?![\w.])")
_LAST_WITH_HISTORY = (9, 0)  # up to this version, transitions kept history by default
_FLAGS = {"preemptive": "preemptive", "immediate": "immediate", "nondeterministic": "nondeterministic",
          "defaultTransition": "else", "error": "error"}  # fmt: skip
Refine = Callable[[Part, str], Flow]  # writes the refinement of a mode


class Machine:
    """One state machine that is being imported, with or without refinements."""

    def __init__(self, part: Part, notes: Notes, version: tuple[int, int]) -> None:
        controller = part.controller
        assert controller is not None
        self._part, self._notes, self._version, self._controller = part, notes, version, controller
        own = part if part.entity is controller else part.parts[controller.name]
        self._scope = own.scope
        self._refinements = {name: each for name, each in part.parts.items() if own is not part and each is not own}
        self._is_modal = own is not part
        self._names = Names()  # of states
        if part.around.role != "machine":
            part.ports = Names(_RESERVED, in_expressions=True)
        owner = part if part.entity.ports else own
        ports = {**controller.ports, **owner.entity.ports}
        outputs = [name for name, port in ports.items() if port.flag("output")]
        inputs = [name for name, port in ports.items() if port.flag("input") and name not in outputs]
        self.inputs, self.outputs = (
            {name: [part.port_name(name, each) for each in range(owner.count(name))] for name in names}
            for names in (inputs, outputs)
        )
        heard = self.inputs | (self.outputs if self._is_modal else {})  # ports to which refinements send, too
        self.words = Words(self._scope, heard, self.outputs, self._tell)
        self._ends = self._found_ends()
        self._find_variables()

    def _found_ends(self) -> dict[str, dict[str, str]]:
        """The states at the ends of each transition."""
        found: dict[str, dict[str, str]] = {name: {} for name in self._controller.relations}
        for port, links in self._controller.links.items():
            state, _, end = port.rpartition(".")
            for link in links:
                if state in self._controller.entities and link.relation in found:
                    found[link.relation][end] = state
        return found

    def _find_variables(self) -> None:
        taken = {ours for names in (*self.inputs.values(), *self.outputs.values()) for ours in names}
        variables = self.words.variables
        for transition in self._controller.relations.values():
            for name in self.words.targets(transition, "setActions"):
                is_plain = "." not in name and "(" not in name and name not in self.outputs
                if is_plain and self._scope.home(name) is not None:
                    variables[name] = self._part.ports.of(name)
                elif (inner := self._inner_of(name)) is not None:
                    ours = self._part.ports.of(inner[1])
                    if ours not in taken | {said for each, said in variables.items() if each != name}:
                        variables[name] = ours  # otherwise two refinements, or a port, would share the name

    def _inner_of(self, name: str) -> tuple[Part, str] | None:
        """The refinement and its parameter that an action sets; None if it sets no such parameter."""
        refinement, _, inner = name.partition(".")
        child = self._refinements.get(refinement)
        is_one = child is not None and inner in child.entity.properties and child.role != "machine"
        return (child, inner) if child is not None and is_one else None

    def handed(self) -> Iterator[tuple[Part, str]]:
        """The refinements that follow a variable, which arrives at an input of that name at each entry."""
        for name in self.words.variables:
            inner = self._inner_of(name)
            if inner is not None:
                yield inner
                continue
            for child in self._refinements.values():
                if child.role != "machine" and self._readers(child, name):
                    yield child, name

    def _readers(self, child: Part, name: str) -> list[tuple[Entity, Property]]:
        """The parameters in a refinement that are computed from a variable."""
        pattern = re.compile(rf"(?<![\w.]){re.escape(name)}(?!\w)")
        found = ((each, said) for each in child.entity.everything() for said in each.properties.values())
        return [(each, said) for each, said in found if is_variable(said) and pattern.search(said.value or "")]

    def _tell(self, text: str) -> None:
        self._notes.note(f"{self._part.path}: {text}")

    def _refuse(self, text: str) -> None:
        self._notes.error(f"{self._part.path}{text}")

    def tell_rest(self) -> None:
        """Report attributes without a counterpart."""
        for owner in {id(each): each for each in (self._part.entity, self._controller)}.values():
            for name, said in owner.properties.items():
                path = f"{self._part.path}.{name}"
                about_property(said, path, self._notes, WORDS["attributes of machines without effect"])

    # -- writing --------------------------------------------------------------------------------------------------

    def head(self) -> dict[str, Any]:
        """The sections of a composite with modes that stand before these."""
        ports = {"inputs": self.inputs, "outputs": self.outputs}
        found: dict[str, Any] = {"doc": " ".join(self._part.entity.doc.split())}
        found |= {key: [ours for names in said.values() for ours in names] for key, said in ports.items()}
        return {key: value for key, value in found.items() if value}

    def written(self, refine: Refine) -> dict[str, Any]:
        """The sections for modes and transitions."""
        modes: dict[str, Any] = {}
        states = list(self._controller.entities.values())
        said = self._controller.word("initialStateName")  # in files of former versions
        marked = [each.name for each in states if self._flag(each, "isInitialState")]
        initial = marked[-1] if marked else said if said in self._controller.entities else None
        named = [each.strip() for each in self._controller.word("finalStateNames").split(",")]
        finals = {each.name for each in states if self._flag(each, "isFinalState") or each.name in named}
        reached = self._reachable(initial or next(iter(self._controller.entities), ""), finals)
        for state in states:
            if state.name not in reached:
                self._tell(f"{state.name} is left out: no transition leads there")
                continue
            mode = self._refinement(state, refine) | ({"final": True} if state.name in finals else {})
            modes[self._names.of(state.name)] = Flow(mode) if mode else None
        transitions = []
        for name, each in self._controller.relations.items():
            source = self._ends[name].get("outgoingPort")
            if source in finals & reached:
                self._tell(f"the transition {name} is left out: nothing leaves a final state")
            elif source is None or source in reached:
                transitions.append(self._transition(each))
        first = None if initial is None else self._names.of(initial)
        found = {
            "variables": Flow({ours: self._initial(name) for name, ours in self.words.variables.items()}),
            "modes": modes if any(modes.values()) else list(modes),
            "initial": first if first in modes and first != next(iter(modes)) else None,
            "transitions": [each for each in transitions if each is not None],
        }
        if not modes:
            self._refuse(" has no states")
        for name in self.words.variables:
            for child in self._refinements.values():
                for owner, said_ in self._readers(child, name) if child.role == "machine" else ():
                    self._tell(f"{owner.name}.{said_.name} uses the initial value of {name} throughout")
        for name, ours in {**self._part.ports.renamed(), **self._names.renamed()}.items():
            self._tell(f"{name} is renamed {ours}")
        return {key: value for key, value in found.items() if value or key == "modes"}

    def _reachable(self, initial: str, finals: set[str]) -> set[str]:
        """The states that may be entered; Ptolemy allows others."""
        found, waiting = {initial}, [initial]
        while waiting:
            here = waiting.pop()
            for ends in self._ends.values() if here not in finals else ():
                target = ends.get("incomingPort")
                if ends.get("outgoingPort") == here and target is not None and target not in found:
                    found.add(target)
                    waiting.append(target)
        return found

    def _initial(self, name: str) -> object:
        """The value with which a variable begins."""
        inner = self._inner_of(name)
        try:
            value = plain(self._scope(name) if inner is None else inner[0].scope(inner[1]))
        except (ExpressionError, KeyError, ValueError) as error:
            self._refuse(f".{name}: {error}")
            return 0
        return 0 if value is None else value

    def _flag(self, owner: Property, name: str) -> bool:
        said = (owner.text(name) or "").strip()
        try:
            return said not in ("", "false") and self._scope.value(said) is True
        except ExpressionError as error:
            self._tell(f"{owner.name}.{name} = {said!r}: {error}")
            return False

    def _refinement(self, state: Entity, refine: Refine) -> dict[str, Any]:
        """The class of a refinement, whose ports keep the names that they have outside."""
        names = [each.strip() for each in (state.text("refinementName") or "").split(",") if each.strip()]
        if len(names) > 1:
            self._tell(f"{state.name} has {len(names)} refinements; only {names[0]} is kept")
        if not names or not self._is_modal:
            return {}
        child = self._part.parts.get(names[0])
        if child is None:
            self._refuse(f": there is no refinement named {names[0]!r}")
            return {}
        found = refine(child, self._names.of(state.name))
        return {"refinement": found["type"] if len(found) == 1 else found}

    # -- transitions ----------------------------------------------------------------------------------------------

    def _transition(self, transition: Relation) -> Any:
        ends = self._ends[transition.name]
        source, target = ends.get("outgoingPort"), ends.get("incomingPort")
        if source is None or target is None:
            self._tell(f"the transition {transition.name} is left out: it needs a state at each end")
            return None
        flags = [ours for name, ours in _FLAGS.items() if self._flag(transition, name)]
        if (
            self._is_modal
            and self._controller.entities[target].word("refinementName")
            and self._has_history(transition)
        ):
            flags.append("history")
        if self._flag(transition, "termination"):
            self._refuse(f".{transition.name}: termination transitions have no counterpart")
        if transition.word("refinementName"):
            self._refuse(f".{transition.name}: a refinement of a transition has no counterpart")
        try:
            said = self.words.guard(transition)
            actions = [*self.words.actions(transition, "outputActions"), *self.words.actions(transition, "setActions")]
        except ExpressionError as error:
            self._refuse(f".{transition.name}: {error}")
            return None
        said |= {"do": "; ".join(actions)} if actions else {}
        return _line(self._names.of(source), self._names.of(target), flags, said)

    def _has_history(self, transition: Relation) -> bool:
        for name, keeps in (("history", True), ("reset", False)):
            if name in transition.properties:
                return self._flag(transition, name) is keeps
        return self._version <= _LAST_WITH_HISTORY


def _line(source: str, target: str, flags: list[str], said: dict[str, str]) -> Any:
    """A transition on one line, or as a mapping where the line would be ambiguous."""
    if " " in said.get("probability", "") or any(_WORD.search(QUOTED.sub("", each)) for each in said.values()):
        return Flow({"from": source, "to": target, **dict.fromkeys(flags, True), **said})
    if "probability" in said:
        flags = [*flags, f"probability {said['probability']}"]
    clauses = [f"{key} {said[key]}" for key in ("on", "after", "when", "do") if key in said]
    return " ".join([f"{source} -> {target}", *flags, *clauses])
