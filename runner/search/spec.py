"""What is to be searched for: the goals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from ..support.declare.parameters import COUNT, option, repeated, whole

MAX_RUNS, MAX_POINTS = 1_000_000, 100_000

OBJECTIVE = "a metric, or an expression over metrics and varied parameters, whose mean is to be {}"


@dataclass(frozen=True)
class Break:
    """A run that breaks a monitor of the model or a property; without either, any monitor of the model."""

    monitor: Annotated[
        str | None,
        option(
            "look for a run that breaks a monitor of the model, or a property such as "
            "'always clearance.distance >= 2 m' (default: any monitor of the model's)",
            "NAME or PROPERTY",
            flag="--break",
            bare="",
        ),
    ] = None
    runs: Annotated[int, option("with --break: number of runs at most", "N", whole(1, MAX_RUNS, "1e6"))] = 500
    max_faults: Annotated[
        int,
        option(
            "with --break: search the single faults (losses, delays, failures) in the run of the seed: sets of at "
            "most N",
            "N",
            whole(1, 10),
        ),
    ] = 0


@dataclass(frozen=True)
class Minimise:
    """Parameters for which the mean of a metric or an expression is least, under conditions that all runs meet."""

    objective: Annotated[str, option(OBJECTIVE.format("small"), "METRIC", flag="--minimise")]
    subject_to: Annotated[
        str | Iterable[str],
        repeated("with --minimise, --maximise: a condition that all runs must meet: 'longest_wait < 30'", "CONDITION"),
    ] = ()
    points: Annotated[
        int,
        option("with --minimise, --maximise: number of points that are tried", "N", whole(1, MAX_POINTS, "100,000")),
    ] = 200
    replications: Annotated[
        int | None,
        option("with --minimise, --maximise: runs of each point (default: the study's, or 1)", "N", COUNT),
    ] = None

    @property
    def conditions(self) -> tuple[str, ...]:
        """Those that all runs must meet."""
        return (self.subject_to,) if isinstance(self.subject_to, str) else tuple(self.subject_to)


@dataclass(frozen=True)
class Maximise(Minimise):
    """Parameters for which the mean is greatest."""

    objective: Annotated[str, option(OBJECTIVE.format("large"), "METRIC", flag="--maximise")]


@dataclass(frozen=True)
class Match:
    """Parameters for which output ports send what was measured, by least squares.

    ``signals`` gives a file (.csv, .parquet) with the columns ``time`` and ``value`` for each port.
    """

    signals: Annotated[
        str | Iterable[str] | Mapping[str, str | Path],
        repeated(
            "fit parameters: an output port, and a .csv or .parquet file of what was measured there, with the columns "
            "time (s) and value",
            "SIGNAL=FILE",
            flag="--match",
        ),
    ]
    between: Annotated[
        Literal["hold", "linear"],
        option("with --match: what a signal does between two tokens", choices=("hold", "linear")),
    ] = "hold"

    @property
    def files(self) -> list[str]:
        """The same as ``signal=file``."""
        if isinstance(self.signals, Mapping):
            return [f"{signal}={file}" for signal, file in self.signals.items()]
        return [self.signals] if isinstance(self.signals, str) else [*self.signals]


Goal = Break | Minimise | Match


def results_folder(name: str, kind: str = "") -> Path:
    """Where results of a model or study of that name are kept by default."""
    from epicycle.actors import abridged  # here, because the command line reads what a search is given

    return Path("results") / abridged(name, 60) / kind


GOALS: tuple[type[Break | Minimise | Match], ...] = (Break, Minimise, Maximise, Match)
