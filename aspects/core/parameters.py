"""Parameters of aspects: laws, durations, execution times, and selections of parts of the model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, ClassVar, Generic, TypeAlias, TypeVar

from epicycle.actors import (
    REQUIRED,
    Configurable,
    Distribution,
    MappingParameter,
    Parameter,
    ParameterError,
    Stream,
)

from .kinds import Job

T = TypeVar("T")
Duration: TypeAlias = float | Distribution
FiringTime: TypeAlias = Duration | Mapping[str, Duration]  # by input port


class LawParameter(Parameter[str | Distribution]):
    """A distribution, or the name of a common one: ``normal``, or ``{type: Triangular, low: -1}``."""

    def __init__(self, familiar: Iterable[str], default: Any = REQUIRED, *, doc: str = "") -> None:
        super().__init__(str, default, doc=doc)
        self.forms = (Parameter(str, choices=tuple(familiar)), Parameter(Distribution))

    def describe_type(self) -> str:
        return f"{', '.join(self.forms[0].choices)}, or distribution"

    def convert(self, value: object) -> str | Distribution | None:
        converted: str | Distribution | None = self.forms[isinstance(value, (Mapping, Configurable))].convert(value)
        return converted


def law(value: str | Distribution, familiar: Mapping[str, Distribution]) -> Distribution:
    """The law given by a ``LawParameter`` with these names."""
    return familiar[value] if isinstance(value, str) else value


class DurationParameter(Parameter[Duration]):
    """``2 s``, or ``{type: Exponential, mean: 2 s}``."""

    def __init__(self, default: Any = REQUIRED, *, doc: str = "") -> None:
        super().__init__(float, default, min=0.0, unit="s", doc=doc)
        self._of_law = Parameter(Distribution, unit="s")
        self.forms = (Parameter(float, min=0.0, unit="s"), self._of_law)

    def describe_type(self) -> str:
        return "time or distribution"

    def _expected(self) -> str:
        return "a time in s >= 0, or a distribution"

    def convert(self, value: object) -> Duration | None:
        if isinstance(value, (Mapping, Configurable)):
            return self._of_law.convert(value)
        if isinstance(value, str) and not any(letter.isdigit() for letter in value):
            raise ParameterError(f"{value!r} is neither a time in s nor a distribution {{type: ..., ...}}")
        return super().convert(value)


def drawn(duration: Duration, random: Stream) -> float:
    """A time in seconds; random numbers are drawn only for a distribution, and negative ones count as 0."""
    return max(0.0, float(duration.draw(random))) if isinstance(duration, Distribution) else duration


class FiringTimeParameter(DurationParameter):
    """The duration of a firing: a single one, or one for each input port that costs time, ``{trigger: 60 ms}``.

    A single duration applies to firings with work for the actor: a wake-up, or a token at a port that triggers it.
    Tokens that it only stores cost no time.  With durations by port, a firing takes the longest of those of the ports
    at which tokens came; other ports, and wake-ups, cost no time.
    """

    def __init__(self, default: Any = REQUIRED, *, doc: str = "") -> None:
        super().__init__(default, doc=doc)
        self._by_port = MappingParameter(DurationParameter())
        self.forms = (*self.forms, self._by_port)

    def describe_type(self) -> str:
        return "time, distribution, or {port: time}"

    def _expected(self) -> str:
        return "a time in s >= 0, a distribution, or a mapping of input ports to these"

    def convert(self, value: object) -> FiringTime | None:  # type: ignore[override]
        if isinstance(value, Mapping) and value and "type" not in value:
            by_port: Mapping[str, Duration] | None = self._by_port.convert(value)
            return by_port
        return super().convert(value)


def time_needed(time: FiringTime, job: Job, random: Stream) -> float | None:
    """The duration of a firing (s); None if it has no work that takes time."""
    if not isinstance(time, Mapping):
        return drawn(time, random) if job.is_triggered else None
    come = {port.name for port in job.arrivals}
    return max((drawn(time[port], random) for port in sorted(come & time.keys())), default=None)


class SelectionParameter(Parameter[T], Generic[T]):
    """A parameter whose value holds patterns; ``point.selected`` gives what they select.

    A pattern that selects nothing is an error in the model.
    """

    selects: ClassVar[str]  # in words
    is_single = False  # whether at most one path may be selected

    def __init__(self, default: Any = REQUIRED, *, doc: str = "") -> None:
        super().__init__(str, default, shape=(None,), doc=doc)  # type: ignore[arg-type]

    def patterns(self, value: T) -> tuple[str, ...]:
        """The patterns in a value."""
        raise NotImplementedError


class PortsParameter(SelectionParameter[tuple[str, ...]]):
    """Output ports whose latest tokens the aspect reads: one or several patterns; with ``single`` exactly one port."""

    selects = "output port"

    def __init__(self, default: Any = REQUIRED, *, single: bool = False, doc: str = "") -> None:
        super().__init__(default, doc=doc)
        self.is_single = single

    def patterns(self, value: tuple[str, ...]) -> tuple[str, ...]:
        return value


class ByActorParameter(SelectionParameter[Mapping[str, T]], Generic[T]):
    """Values for some actors: ``{robot.planner: 20 ms, "robot[*]": 1 ms}``; an actor gets the last value that applies
    to it.

    A composite means all the actors in it.
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
        """The value for an actor, None if there is none; ``selection`` is what the patterns select."""
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
