"""Parameters with which an aspect selects parts of the model that it looks at, or has to tell apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Generic, TypeVar

from epicycle.actors import REQUIRED, MappingParameter, Parameter, ParameterError

T = TypeVar("T")


class SelectionParameter(Parameter[T], Generic[T]):
    """A parameter whose value holds patterns; ``point.selected`` tells what they select.

    A pattern that selects nothing is a mistake in the model.
    """

    selects: ClassVar[str]  # in a word
    is_single = False  # whether one path at most may be selected

    def __init__(self, default: Any = REQUIRED, *, doc: str = "") -> None:
        super().__init__(str, default, shape=(None,), doc=doc)  # type: ignore[arg-type]

    def patterns(self, value: T) -> tuple[str, ...]:
        """The patterns in a value."""
        raise NotImplementedError


class PortsParameter(SelectionParameter[tuple[str, ...]]):
    """Output ports whose latest tokens the aspect looks at: a pattern or several; with ``single`` exactly one port."""

    selects = "output port"

    def __init__(self, default: Any = REQUIRED, *, single: bool = False, doc: str = "") -> None:
        super().__init__(default, doc=doc)
        self.is_single = single

    def patterns(self, value: tuple[str, ...]) -> tuple[str, ...]:
        return value


class ByActorParameter(SelectionParameter[Mapping[str, T]], Generic[T]):
    """Values for some actors: ``{robot.planner: 20 ms, "robot[*]": 1 ms}``; an actor gets the last that is for it.

    A composite stands for all the actors in it.
    """

    selects = "actor"

    def __init__(self, item: Parameter[T], *, words: str = "numbers", doc: str = "") -> None:
        super().__init__({}, doc=doc)
        self.item = item
        self.words = words  # what the values are, in the plural

    def describe_type(self) -> str:
        return f"mapping from actors to {self.words}"

    def convert(self, value: object) -> Mapping[str, T] | None:
        if not isinstance(value, Mapping) or not all(isinstance(pattern, str) for pattern in value):
            raise ParameterError(f"{value!r} is not a {self.describe_type()}")
        return MappingParameter(self.item).convert(value)

    def patterns(self, value: Mapping[str, T]) -> tuple[str, ...]:
        return tuple(value)

    @staticmethod
    def of(value: Mapping[str, T], selection: Mapping[str, Sequence[str]], actor: str) -> T | None:
        """What is for an actor, None if nothing is; ``selection`` is what the patterns select."""
        for pattern in list(value)[::-1]:
            if any(actor == path or actor.startswith(f"{path}.") for path in selection.get(pattern, ())):
                return value[pattern]
        return None


class GroupsParameter(SelectionParameter[Mapping[str, tuple[str, ...]]]):
    """Groups of actors and composites: ``{left: main, right: ["observer[*]", base]}``."""

    selects = "actor"

    def describe_type(self) -> str:
        return "mapping from names to lists of patterns"

    def convert(self, value: object) -> Mapping[str, tuple[str, ...]] | None:
        if not isinstance(value, Mapping):
            raise ParameterError(f"{value!r} is not a {self.describe_type()}")
        groups: dict[str, tuple[str, ...]] = {}
        for name, members in value.items():
            members = [members] if isinstance(members, str) else members
            if not isinstance(members, (list, tuple)) or not all(isinstance(each, str) for each in members):
                raise ParameterError(f"group {name!r}: {members!r} is not a list of patterns")
            groups[str(name)] = tuple(members)
        return groups

    def patterns(self, value: Mapping[str, tuple[str, ...]]) -> tuple[str, ...]:
        return tuple(pattern for members in value.values() for pattern in members)
