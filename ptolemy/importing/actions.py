"""Converts guards and actions of a state machine to the model language."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence

from .entities import Relation
from .scope import Scope
from .syntax import ExpressionError, Tree, conjuncts, names_of, parse
from .translation import code_of, named
from .writing import seconds

QUOTED = re.compile(r"'[^']*'|\"[^\"]*\"")
_PRESENT, _OURS = "_isPresent", "_is_present"
_TARGET = re.compile(r"(?P<name>[^()]+?)\s*(\((?P<channel>[^()]*)\))?")
Channels = Mapping[str, Sequence[str]]  # our ports for the channels of a port


class Words:
    """The names of a state machine, and the guards and actions that use them.

    In Ptolemy, the name of an input, with or without ``_isPresent``, refers to its last channel, or to the one whose
    number follows.  Here, each channel is a separate port.
    """

    def __init__(self, scope: Scope, heard: Channels, outputs: Channels, tell: Callable[[str], None]) -> None:
        self.variables: dict[str, str] = {}  # ours
        self._scope, self._heard, self._outputs, self._tell = scope, heard, outputs, tell
        self._asked: set[str] = set()  # our names
        self._sent: set[str] = set()

    def _names(self) -> dict[str, str]:
        """The names that guards and actions may use, and our names for them."""
        found: dict[str, str] = {}
        for name, channels in self._heard.items():
            for each, ours in ((name, channels[-1]), *((f"{name}_{n}", ours) for n, ours in enumerate(channels))):
                found |= {each: ours, f"{each}{_PRESENT}": f"{ours}{_OURS}"}
        return {**found, **self.variables, "time": "time"}

    def _said(self, tree: Tree) -> str:
        """An expression over these names."""
        names = self._names()
        self._asked |= {names[each].removesuffix(_OURS) for each in names_of(tree) if each in names}
        known = {name: named(ours) for name, ours in names.items()}
        return code_of(self._scope.meaning(tree, known, during_run=False)).text

    def guard(self, transition: Relation) -> dict[str, str]:
        """``on``, ``after``, ``when`` and ``probability`` of a guard."""
        text = (transition.text("guardExpression") or "true").strip() or "true"
        said, rest, names = dict[str, str](), list[Tree](), self._names()
        for part in conjuncts(parse(self._scope.filled(text))):
            called = part.parts[0].said if part.form == "call" and len(part.parts) == 2 else ""
            if part.form == "name" and part.said.endswith(_PRESENT) and part.said in names and "on" not in said:
                said["on"] = self._said(part).removesuffix(_OURS)
            elif called == "timeout" and "after" not in said:
                time = self._said(part.parts[1])
                said["after"] = str(seconds(float(time))) if re.fullmatch(r"[\d.e+-]+", time) else time
            elif called == "probability" and "probability" not in said:
                said["probability"] = self._said(part.parts[1])
            elif part != Tree("value", (), said=True):
                rest.append(part)
        if rest:
            whole = rest[0]
            for part in rest[1:]:
                whole = Tree("&&", (whole, part))
            said["when"] = self._said(whole)
        return said

    @staticmethod
    def targets(transition: Relation, name: str) -> list[str]:
        """The targets of actions of a kind."""
        parts = (part.partition("=") for part in _split(transition.text(name) or ""))
        return [target.strip() for target, equals, _ in parts if equals and target.strip()]

    def actions(self, transition: Relation, name: str) -> list[str]:
        """The actions of a kind."""
        said = []
        for part in filter(str.strip, _split(transition.text(name) or "")):
            target, equals, text = (each.strip() for each in part.partition("="))
            match = _TARGET.fullmatch(target)
            port, channel = (target, None) if match is None else (match["name"], match["channel"])
            left_out = f"{transition.name}: {target} = {text} is left out"
            if not (equals and target):
                self._tell(f"{transition.name}: the action {part.strip()!r} is not an assignment and is left out")
            elif port not in self._outputs and port not in self.variables:
                self._tell(f"{left_out}: {port} is neither an output nor a variable")
            elif not (ours := self._destinations(target, port, channel)):
                self._tell(f"{left_out}: {port} has no such channel")
            else:
                value = self._said(parse(self._scope.filled(text)))
                self._sent |= {*ours}
                said += [f"{each} = {value}" for each in ours]
        return said

    def _destinations(self, target: str, port: str, channel: str | None) -> Sequence[str]:
        """Our outputs for an output of the file: for all of its channels, or for one."""
        if port not in self._outputs:
            return [self.variables[port]]
        if channel is None:
            return self._outputs[port]
        number = self._scope.value(channel)
        if type(number) is not int or number < 0:
            raise ExpressionError(f"{target} = ...: {channel.strip()} is not a channel")
        return self._outputs[port][number : number + 1]

    def unnamed(self) -> set[str]:
        """Our ports that no guard or action names."""
        inputs = {name: channels for name, channels in self._heard.items() if name not in self._outputs}
        for name, channels in inputs.items():
            if self._asked.isdisjoint(channels):
                self._tell(f"{name} is left out: nothing reads it")
        asked, sent = ({each for channels in ports.values() for each in channels} for ports in (inputs, self._outputs))
        return (asked - self._asked) | (sent - self._sent)


def _split(text: str) -> list[str]:
    """The actions separated by semicolons, except semicolons in texts and brackets."""
    masked = QUOTED.sub(lambda match: "_" * len(match[0]), text)
    depth, start, found = 0, 0, []
    for place, character in enumerate(masked):
        depth += (character in "([{") - (character in ")]}")
        if character == ";" and depth <= 0:
            found.append(text[start:place])
            start = place + 1
    return [*found, text[start:]]
