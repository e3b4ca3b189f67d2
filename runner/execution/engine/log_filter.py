"""LogFilter: which records of the event log to keep."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from epicycle.actors import did_you_mean

from ...model.build.model import Model
from ...model.text.patterns import PatternError, select
from ..results import LogError

_SHOWN = 12  # names in a message


class LogFilter:
    """Which records to keep: those that match, in each column of ``wanted``, one of its patterns.

    The columns are ``event``, ``actor``, ``port`` (its name alone) and ``aspect``; the pattern ``*`` for an aspect
    matches all acts of aspects, and no sends.  Counts and digest are those of the whole log.  Raises ``LogError``.

    >>> Simulation(model, keep_log=LogFilter({"aspect": ["packet_loss"], "actor": ["observer[*].controller"]}))
    """

    COLUMNS = ("event", "actor", "port", "aspect")

    def __init__(self, wanted: Mapping[str, Sequence[str]]) -> None:
        for column in wanted:
            if column not in self.COLUMNS:
                raise LogError(
                    f"the log has no column {column!r} to filter by{did_you_mean(column, self.COLUMNS)}; "
                    f"columns: {', '.join(self.COLUMNS)}"
                )
        self._wanted = {column: tuple(patterns) for column, patterns in wanted.items()}

    @classmethod
    def of(cls, texts: Iterable[str]) -> LogFilter:
        """The filter described by texts such as ``aspect=packet_loss``."""
        wanted: dict[str, list[str]] = {}
        for text in texts:
            column, sign, pattern = text.partition("=")
            if not (sign and pattern.strip()):
                raise LogError(f"{text!r} is not a filter of the log: write COLUMN=PATTERN, such as aspect=packet_loss")
            wanted.setdefault(column.strip(), []).append(pattern.strip())
        return cls(wanted)

    def keeps(self, event: str, actor: str, port: str, aspect: str) -> bool:
        """Whether to keep a record."""
        names = {"event": event, "actor": actor, "port": port, "aspect": aspect}
        return all(any(_fits(each, names[column]) for each in patterns) for column, patterns in self._wanted.items())

    def check(self, model: Model) -> None:
        """Raise ``LogError`` if a pattern matches nothing that the log of a model may hold."""
        ports = model.graph.ports
        aspects = [woven.aspect for woven in model.aspects]
        valid = {
            "actor": list(dict.fromkeys(path.rpartition(".")[0] for path in ports)),
            "port": list(dict.fromkeys(path.rpartition(".")[2] for path in ports)),
            "aspect": [woven.name for woven in model.aspects],
            "event": list(dict.fromkeys(["send", *(event for aspect in aspects for event in aspect.events)])),
        }
        for column, patterns in self._wanted.items():
            names = valid[column]
            for pattern in patterns:
                if not any(_fits(pattern, name) for name in names):
                    known = ", ".join(names[:_SHOWN]) + (", ..." if len(names) > _SHOWN else "")
                    raise LogError(
                        f"{column}={pattern} matches no {column} of the model{did_you_mean(pattern, names)}; "
                        f"{column}s: {known or 'none'}"
                    )

    def __repr__(self) -> str:
        return f"LogFilter({dict(self._wanted)!r})"


def _fits(pattern: str, name: str) -> bool:
    if pattern == name:
        return True
    try:
        return name != "" and select(pattern, [name]) == [name]
    except PatternError as error:
        raise LogError(f"{pattern!r} is not a pattern: {error}") from None
