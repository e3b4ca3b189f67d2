"""Modal models and state machines: states, transitions with guards and actions, refinements."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import reduce
from typing import Any

from .document import Entity, Property, is_variable
from .limits import Notes
from .parts import Part, about_properties
from .syntax import ExpressionError, Tree, conjuncts, names_of, parse
from .table import WORDS
from .translation import Meaning, Value, code_of, named
from .writing import Flow, Lines, Names, plain, seconds

_PRESENT, _OURS = "_isPresent", "_is_present"
_ACTION = re.compile(r"""(?:"[^"]*"|'[^']*'|[^;"'])+""")  # up to a semicolon outside of texts
_RESERVED = ("mode", "trigger", "time", "mode_time", "error", "machine")
_WORD = re.compile(r"(?<![\w.])(on|after|when|do)(?![\w.])")
_LAST_WITH_HISTORY = (9, 0)  # up to this version, transitions kept history by default
_FLAGS = {"preemptive": "preemptive", "immediate": "immediate", "nondeterministic": "nondeterministic",
          "defaultTransition": "else", "error": "error"}  # fmt: skip
Refine = Callable[[Part, str], Flow]  # writes the refinement of a mode


class Machine:
    """One state machine that is being imported, with or without refinements.

    In Ptolemy, the name of an input, with or without ``_isPresent``, refers to its last channel, or to the one whose
    number follows.  Here, each channel is a separate port.
    """

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
        self._variables: dict[str, str] = {}  # ours
        self._asked: set[str] = set()  # our names
        self._sent: set[str] = set()
        self._ends = self._found_ends()
        for transition in controller.relations.values():
            for name, _ in self._parted(transition, "setActions"):
                if name not in self.outputs and self._scope.home(name) is not None:
                    self._variables[name] = part.ports.of(name)
        self._known = {"time": "time"}  # the names that guards and actions may use, and ours
        for name, channels in (self.inputs | (self.outputs if self._is_modal else {})).items():
            for each, ours in ((name, channels[-1]), *((f"{name}_{n}", ours) for n, ours in enumerate(channels))):
                self._known |= {each: ours, f"{each}{_PRESENT}": f"{ours}{_OURS}"}
        self._known |= self._variables

    def _found_ends(self) -> dict[str, dict[str, str]]:
        """The states at the ends of each transition."""
        found: dict[str, dict[str, str]] = {name: {} for name in self._controller.relations}
        for port, links in self._controller.links.items():
            state, _, end = port.rpartition(".")
            for link in links:
                if state in self._controller.entities and link.relation in found:
                    found[link.relation][end] = state
        return found

    def _tell(self, text: str) -> None:
        self._notes.note(f"{self._part.path}: {text}")

    def _refuse(self, text: str) -> None:
        self._notes.error(f"{self._part.path}{text}")

    # -- writing --------------------------------------------------------------------------------------------------

    def head(self) -> dict[str, Any]:
        """The sections of a composite with modes that stand before these."""
        ports = {"inputs": self.inputs, "outputs": self.outputs}
        return {key: [ours for names in said.values() for ours in names] for key, said in ports.items() if said}

    def written(self, refine: Refine) -> dict[str, Any]:
        """The sections for modes and transitions; tells what has no counterpart."""
        states = list(self._controller.entities.values())
        said = self._controller.word("initialStateName")  # in files of former versions
        marked = [each.name for each in states if self._flag(each, "isInitialState")]
        initial = marked[-1] if marked else said if said in self._controller.entities else None
        finals = [each.strip() for each in self._controller.word("finalStateNames").split(",")]
        modes: dict[str, Any] = {}
        for state in states:
            mode = self._refinement(state, refine)
            mode |= {"final": True} if state.name in finals or self._flag(state, "isFinalState") else {}
            modes[self._names.of(state.name)] = Flow(mode) if mode else None
        transitions = [*map(self._transition, self._controller.relations.values())]
        first = None if initial is None else self._names.of(initial)
        found = {
            "variables": Flow({ours: self._initial(name) for name, ours in self._variables.items()}),
            "modes": Flow(modes) if any(modes.values()) else list(modes),
            "initial": first if first in modes and first != next(iter(modes)) else None,
            "transitions": Lines(each for each in transitions if each is not None),
        }
        if not modes:
            self._refuse(" has no states")
        for name, ours in {**self._part.ports.renamed(), **self._names.renamed()}.items():
            self._tell(f"{name} is renamed {ours}")
        for owner in {id(each): each for each in (self._part.entity, self._controller)}.values():
            about_properties(owner, self._part.path, self._notes, WORDS["attributes of machines without effect"])
        return {key: value for key, value in found.items() if value or key == "modes"}

    def _initial(self, name: str) -> object:
        """The value with which a variable begins; refused if a refinement uses the variable."""
        pattern = re.compile(rf"(?<![\w.]){re.escape(name)}(?!\w)")
        for owner in (each for child in self._refinements.values() for each in child.entity.everything()):
            for said in owner.properties.values():
                if is_variable(said) and pattern.search(said.value or ""):
                    self._refuse(f": {owner.name}.{said.name} in a refinement uses {name}, which a transition sets")
        try:
            value = plain(self._scope(name))
        except (ExpressionError, ValueError) as error:
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
        name = state.word("refinementName")
        if not name or not self._is_modal:
            return {}
        child = self._part.parts.get(name)
        if child is None:
            self._refuse(f": there is no refinement named {name!r}")
            return {}
        found = refine(child, self._names.of(state.name))
        return {"refinement": found["type"] if len(found) == 1 else found}

    # -- transitions ----------------------------------------------------------------------------------------------

    def _transition(self, transition: Property) -> Any:
        ends = self._ends[transition.name]
        source, target = ends.get("outgoingPort"), ends.get("incomingPort")
        if source is None or target is None:
            self._tell(f"the transition {transition.name} is left out: it needs a state at each end")
            return None
        flags = [ours for name, ours in _FLAGS.items() if self._flag(transition, name)]
        is_refined = self._is_modal and self._controller.entities[target].word("refinementName")
        if is_refined and self._has_history(transition):
            flags.append("history")
        if self._flag(transition, "termination"):
            self._refuse(f".{transition.name}: termination transitions have no counterpart")
        if transition.word("refinementName"):
            self._refuse(f".{transition.name}: a refinement of a transition has no counterpart")
        try:
            said = self._guard(transition)
            actions = [*self._actions(transition, "outputActions"), *self._actions(transition, "setActions")]
        except (ExpressionError, ValueError) as error:
            self._refuse(f".{transition.name}: {error}")
            return None
        said |= {"do": "; ".join(actions)} if actions else {}
        return _line(self._names.of(source), self._names.of(target), flags, said)

    def _has_history(self, transition: Property) -> bool:
        for name, keeps in (("history", True), ("reset", False)):
            if name in transition.properties:
                return self._flag(transition, name) is keeps
        return self._version <= _LAST_WITH_HISTORY

    # -- guards and actions --------------------------------------------------------------------------------------

    def _meaning(self, tree: Tree) -> Meaning:
        self._asked |= {self._known[each].removesuffix(_OURS) for each in names_of(tree) & self._known.keys()}
        return self._scope.meaning(tree, {each: named(ours) for each, ours in self._known.items()}, during_run=False)

    def _said(self, tree: Tree) -> str:
        """An expression over these names."""
        return code_of(self._meaning(tree)).text

    def _guard(self, transition: Property) -> dict[str, str]:
        """``on``, ``after`` and ``when`` of a guard."""
        text = (transition.text("guardExpression") or "true").strip() or "true"
        said, rest = dict[str, str](), list[Tree]()
        for part in conjuncts(parse(self._scope.filled(text))):
            called = part.parts[0].said if part.form == "call" and len(part.parts) == 2 else ""
            if part.form == "name" and part.said.endswith(_PRESENT) and part.said in self._known and "on" not in said:
                said["on"] = self._said(part).removesuffix(_OURS)
            elif called == "timeout" and "after" not in said:
                time = self._meaning(part.parts[1])
                said["after"] = str(seconds(time.value)) if isinstance(time, Value) else time.text
            elif part != Tree("value", (), said=True):
                rest.append(part)
        if rest:
            said["when"] = self._said(reduce(lambda one, other: Tree("&&", (one, other)), rest))
        return said

    @staticmethod
    def _parted(transition: Property, name: str) -> list[tuple[str, str]]:
        """The target and the expression of each action of a kind."""
        parts = (part.partition("=") for part in _ACTION.findall(transition.text(name) or "") if part.strip())
        return [(target.strip(), text.strip()) for target, _, text in parts]

    def _actions(self, transition: Property, name: str) -> list[str]:
        """The actions of a kind."""
        said = []
        for target, text in self._parted(transition, name):
            ours = [self._variables[target]] if target in self._variables else self.outputs.get(target, ())
            if ours:
                value = self._said(parse(self._scope.filled(text)))
                self._sent |= {*ours}
                said += [f"{each} = {value}" for each in ours]
            elif "(" in target:
                raise ExpressionError(f"{target} = ...: an action for one channel has no counterpart")
            else:
                left_out = f"{transition.name}: {target} = {text} is left out"
                self._tell(f"{left_out}: {target} is neither an output nor a variable")
        return said

    def unnamed(self) -> set[str]:
        """Our ports that no guard or action names."""
        for name, channels in self.inputs.items():
            if self._asked.isdisjoint(channels):
                self._tell(f"{name} is left out: nothing reads it")
        asked, sent = ({each for some in ports.values() for each in some} for ports in (self.inputs, self.outputs))
        return (asked - self._asked) | (sent - self._sent)


def _line(source: str, target: str, flags: list[str], said: dict[str, str]) -> Any:
    """A transition on one line, or as a mapping where the line would be ambiguous."""
    if any(map(_WORD.search, said.values())):
        return Flow({"from": source, "to": target, **dict.fromkeys(flags, True), **said})
    clauses = [f"{key} {said[key]}" for key in ("on", "after", "when", "do") if key in said]
    return " ".join([f"{source} -> {target}", *flags, *clauses])
