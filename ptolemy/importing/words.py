"""Converts guards and actions of a state machine to the model language."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence

from .actors import seconds
from .entities import Relation
from .scope import Scope
from .syntax import Binary, Call, Const, ExpressionError, Name, Tree
from .translate import names_of, translated

QUOTED = re.compile(r"'[^']*'|\"[^\"]*\"")
_PRESENT, _OURS = "_isPresent", "_is_present"
_TARGET = re.compile(r"(?P<name>[^()]+?)\s*(\((?P<channel>[^()]*)\))?")


class Words:
    """The names of a state machine, and the guards and actions that use them.

    In Ptolemy, the name of an input, with or without ``_isPresent``, refers to its last channel, or to the one whose
    number follows.  Here, each channel is a separate port.
    """

    def __init__(
        self,
        scope: Scope,
        heard: Mapping[str, Sequence[str]],
        outputs: Mapping[str, Sequence[str]],
        variables: Mapping[str, str],
        tell: Callable[[str], None],
    ) -> None:
        self._scope = scope
        self._heard = heard
        self._outputs = outputs
        self._variables = variables
        self._tell = tell
        self._asked: set[str] = set()  # our names
        self._sent: set[str] = set()

    def _names(self) -> dict[str, str]:
        """The names that guards and actions may use, and our names for them."""
        found: dict[str, str] = {}
        for name, channels in self._heard.items():
            said = {name: channels[-1], **{f"{name}_{number}": ours for number, ours in enumerate(channels)}}
            for each, ours in said.items():
                found |= {each: ours, f"{each}{_PRESENT}": f"{ours}{_OURS}"}
        return {**found, **self._variables, "time": "time"}

    def _ask(self, tree: Tree) -> None:
        names = self._names()
        self._asked |= {names[each].removesuffix(_OURS) for each in names_of(tree) if each in names}

    def guard(self, transition: Relation) -> dict[str, str]:
        """``on``, ``after``, ``when`` and ``probability`` of a guard."""
        text = (transition.text("guardExpression") or "").strip()
        if not text or text == "true":
            return {}
        said, rest = dict[str, str](), list[Tree]()
        names = self._names()
        for part in _conjuncts(self._scope.tree(self._scope.filled(text))):
            self._ask(part)
            match part:
                case Name(name) if name.endswith(_PRESENT) and name in names and "on" not in said:
                    said["on"] = names[name].removesuffix(_OURS)
                case Call(Name("timeout"), (argument,)) if "after" not in said:
                    said["after"] = self._time(argument, names)
                case Call(Name("probability"), (argument,)) if "probability" not in said:
                    said["probability"] = translated(argument, names, self._scope)
                case Const(True):
                    pass
                case _:
                    rest.append(part)
        if rest:
            whole = rest[0]
            for part in rest[1:]:
                whole = Binary("&&", whole, part)
            said["when"] = translated(whole, names, self._scope)
        return said

    def _time(self, tree: Tree, names: dict[str, str]) -> str:
        text = translated(tree, names, self._scope)
        try:
            return str(seconds(float(text)))
        except ValueError:
            return text

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
            if not (equals and target):
                self._tell(f"{transition.name}: the action {part.strip()!r} is not an assignment and is left out")
                continue
            left_out = f"{transition.name}: {target} = {text} is left out"
            match = _TARGET.fullmatch(target)
            port = target if match is None else match["name"]
            if port not in self._outputs and port not in self._variables:
                self._tell(f"{left_out}: {port} is neither an output nor a variable")
                continue
            ours = self._destinations(target, port, None if match is None else match["channel"])
            if not ours:
                self._tell(f"{left_out}: {port} has no such channel")
                continue
            tree = self._scope.tree(self._scope.filled(text))
            value = translated(tree, self._names(), self._scope)
            self._ask(tree)
            self._sent |= {*ours}
            said += [f"{each} = {value}" for each in ours]
        return said

    def _destinations(self, target: str, port: str, channel: str | None) -> list[str]:
        """Our outputs for an output of the file: for all of its channels, or for one."""
        if port not in self._outputs:
            return [self._variables[port]]
        if channel is None:
            return [*self._outputs[port]]
        number = self._scope.value(channel)
        if type(number) is not int or number < 0:
            raise ExpressionError(f"{target} = ...: {channel.strip()} is not a channel")
        return [*self._outputs[port][number : number + 1]]

    def wired(self) -> dict[str, list[str | None]]:
        """Our ports for the channels of each port of the file; None for those that no guard or action names."""
        inputs = {name: channels for name, channels in self._heard.items() if name not in self._outputs}
        for name, channels in inputs.items():
            if self._asked.isdisjoint(channels):
                self._tell(f"{name} is left out: nothing reads it")
        known = {**dict.fromkeys(inputs, self._asked), **dict.fromkeys(self._outputs, self._sent)}
        return {
            name: [each if each in known[name] else None for each in channels]
            for name, channels in {**inputs, **self._outputs}.items()
        }


def _conjuncts(tree: Tree) -> list[Tree]:
    found, waiting = [], [tree]
    while waiting:
        each = waiting.pop()
        if isinstance(each, Binary) and each.sign in ("&&", "&"):
            waiting += [each.right, each.left]
        else:
            found.append(each)
    return found


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
