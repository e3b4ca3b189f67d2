"""Names, values and sections as the model language has them: YAML as a person would write it."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from keyword import iskeyword
from typing import Any

import yaml

from epicycle.actors.expression import CONSTANTS, FUNCTIONS

_STRANGE = re.compile(r"[^A-Za-z0-9_]+")
_WORDS = re.compile(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")
_TAKEN = {"index", "time", "mode_time", "token", *CONSTANTS, *FUNCTIONS}


def snake(name: str) -> str:
    """``trueOutput`` as ``true_output``."""
    return _WORDS.sub("_", name).lower()


class Names:
    """The names of one namespace: each name of the file has a unique name of ours."""

    def __init__(self, taken: Iterable[str] = (), *, in_expressions: bool = False) -> None:
        self._of: dict[str, str] = {}
        self._taken = set(taken)
        self._next: dict[str, int] = {}  # the number to try first, by name
        self._in_expressions = in_expressions  # in which keywords and functions cannot be names

    def of(self, name: str) -> str:
        """Our name for a name of the file."""
        if name not in self._of:
            self._of[name] = self.fresh(name)
        return self._of[name]

    def fresh(self, name: str) -> str:
        """A similar name that is still unused."""
        base = _STRANGE.sub("_", name.strip()).strip("_") if _STRANGE.search(name) else name
        if not base or not base[0].isalpha():
            base = f"_{base}" if base[:1] != "_" else base
        if self._in_expressions and (iskeyword(base) or base in _TAKEN):
            base += "_"
        found, number = base, self._next.get(base, 2)
        while found in self._taken:
            found, number = f"{base}_{number}", number + 1
        self._next[base] = number
        self._taken.add(found)
        return found

    def renamed(self) -> dict[str, str]:
        """The names that could not be kept."""
        return {name: ours for name, ours in self._of.items() if name != ours}


# -- YAML -------------------------------------------------------------------------------------------------------------


_WIDTH = 140  # of what is on one line, with quotes around all texts
_MAP, _SEQ = "tag:yaml.org,2002:map", "tag:yaml.org,2002:seq"


class Flow(dict[str, object]):
    """A mapping that is written on one line if it fits, as lists are."""


class Lines(list[object]):
    """A list that is written with a line for each item."""


def plain(value: Any) -> object:
    """A value of Ptolemy's in its YAML form."""
    if isinstance(value, list):
        return [plain(each) for each in value]
    if isinstance(value, dict):
        return Flow({name: plain(each) for name, each in value.items()})
    return value.replace("${", "$${") if isinstance(value, str) else value


def seconds(value: Any) -> object:
    """A time in s, in the form in which models state it; raises ``ValueError``."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError(f"{value!r} is not a time")
    if math.isinf(value):
        return float(value)
    number = int(value) if float(value).is_integer() and abs(value) < 1e15 else value
    return f"{number!r} s"


class _Dumper(yaml.SafeDumper):
    def ignore_aliases(self, data: object) -> bool:
        return True

    def increase_indent(self, flow: bool = False, indentless: bool = False) -> None:
        super().increase_indent(flow, False)

    def mapping(self, said: Flow) -> yaml.Node:
        return self.represent_mapping(_MAP, said, flow_style=len(str(said)) < _WIDTH)

    def sequence(self, said: list[object]) -> yaml.Node:
        return self.represent_sequence(_SEQ, said, flow_style=not isinstance(said, Lines) and len(str(said)) < _WIDTH)


_Dumper.add_representer(Flow, _Dumper.mapping)
for _kind in (list, Lines):
    _Dumper.add_representer(_kind, _Dumper.sequence)
# Models take what looks like a number of YAML 1.2 for one; a quantity, such as "1 s", is not like that.
_Dumper.add_implicit_resolver("tag:yaml.org,2002:float", re.compile(r"[-+.\d]\S*\Z"), [*"-+.0123456789"])


def document(sections: Mapping[str, object]) -> str:
    """The text of a model."""
    return yaml.dump(sections, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=math.inf)
