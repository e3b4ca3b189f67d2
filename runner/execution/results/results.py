"""The results of a run: signals, metrics, counts and the log."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from importlib import import_module
from itertools import islice
from typing import TYPE_CHECKING, Any

from epicycle.actors import EpicycleError, counted, did_you_mean, to_seconds

from ...model.graph.acts import Act
from ...support.shown import in_time, short
from ...support.tables import Table, Tabled, pandas_module
from .encoding import cell, leaves
from .log import EventLog
from .outcome import Interval, Outcome
from .signal import Signal, SignalError
from .verdict import Verdict

if TYPE_CHECKING:
    import pandas


STOP_TIME = "stop time"  # what ended a run that came to its stop time
COLUMNS = ("time", "time_ns", "microstep", "signal", "field", "type", "value", "text")  # of recorded signals


@dataclass(repr=False)
class Results(Tabled):
    """The outcome of one run: ``metrics``, recorded ``signals``, counts and figures of ``aspects``, the ``log``
    and its ``digest``.  ``outcomes`` say more about each metric: its interval, or why it has no value.

    >>> results = Simulation(model, seed=7).run()
    >>> results.metrics["mean_wait"], results["server.output"].values
    """

    model: str
    seed: int
    parameters: dict[str, object]
    metrics: dict[str, Any]
    aspects: dict[str, dict[str, float | None]]  # counts of events, and what aspects report
    signals: dict[str, Signal]
    log: EventLog
    end: float  # s, the last tag
    stopped: str  # why the run ended
    until: float  # s, the time that the run covers: the stop time if it came to that, else the last tag
    firings: int
    wall_time: float  # s
    units: dict[str, str] = field(default_factory=dict)  # of the metrics
    outcomes: dict[str, Outcome] = field(default_factory=dict)  # of the metrics
    monitors: dict[str, Verdict] = field(default_factory=dict)
    acts: list[Act] = field(default_factory=list)  # of aspects, if they were to be noted
    figures: dict[str, Any] = field(default_factory=dict)  # as the model declares them
    program: Any = field(default=None, compare=False)  # the model that was run

    @property
    def intervals(self) -> dict[str, Interval]:
        """The confidence intervals of the metrics that have one."""
        return {name: each.interval for name, each in self.outcomes.items() if each.interval is not None}

    @property
    def events(self) -> int:
        """The number of records in the event log."""
        return self.log.count

    @property
    def digest(self) -> str:
        """SHA-256 of the event log."""
        return self.log.digest

    def __getitem__(self, name: str) -> Signal:
        """A recorded signal; raises ``SignalError``."""
        if name not in self.signals:
            known = list(self.signals)
            raise SignalError(
                f"{name!r} was not recorded{did_you_mean(name, known)}; recorded: {', '.join(known) or 'nothing'}"
            )
        return self.signals[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.signals)

    def __contains__(self, name: object) -> bool:
        return name in self.signals

    def what_if(self, at: Any, **changed: Any) -> Any:
        """The run with something changed from a tag on, beside this one: an ``epicycle.WhatIf``.

        ``at`` and the rest are as for ``epicycle.what_if``, which is looked up, because it is a layer above results.
        Raises ``EpicycleError`` if model and seed do not make this run again.

        >>> results.what_if("12 s", let_through="wifi_loss").first
        """
        call = import_module("....interface.calls.what_if", __name__).what_if
        until = self.until if self.stopped == STOP_TIME else None
        found = call(self.program, at, seed=self.seed, until=until, **changed)
        if found.before.digest != self.digest:
            raise EpicycleError(
                f"{self!r} cannot be made again by its model and seed: the model was changed after it, or the run was "
                "changed on its way"
            )
        return found

    def table(self) -> dict[str, list[Any]]:
        """All recorded signals in long form, the columns of ``signals.parquet``: a row for each leaf of each token.

        ``time`` is in s, ``time_ns`` is the same in whole ns, ``field`` is the place in the token, and ``type`` is the
        type of the leaf.  ``value`` is a number, or 0 or 1 for false or true; ``text`` is anything else, and the digits
        of an int that no float equals.
        """
        rows = (
            (to_seconds(tag.time), *tag, name, place, *(("float", leaf, None) if type(leaf) is float else cell(leaf)))
            for name, signal in self.signals.items()
            for tag, token in zip(signal.tags, signal.tokens, strict=True)
            for place, leaf in leaves(token)
        )
        table: dict[str, list[Any]] = {name: [] for name in COLUMNS}
        while some := list(islice(rows, 10_000)):
            for column, values in zip(table.values(), zip(*some, strict=True), strict=True):
                column.extend(values)
        return table

    def to_pandas(self) -> pandas.DataFrame:
        """All recorded signals in long form, as in ``table``."""
        frame: pandas.DataFrame = pandas_module().DataFrame(self.table())
        return frame

    def frame(self, name: str) -> pandas.DataFrame:
        """One signal, as ``Signal.to_pandas`` returns it."""
        return self[name].to_pandas()

    def __repr__(self) -> str:
        return (
            f"<Results of {self.model}, seed {self.seed}: {in_time(self.until)}, ended by {self.stopped}, "
            f"{counted(self.events, 'event')}, digest {self.digest[:16]}...>"
        )

    def _caption(self) -> str:
        return f"{self.model}, seed {self.seed}: {in_time(self.until)} of model time, ended by {self.stopped}"

    def _tables(self) -> list[Table]:
        units = {name: unit for name, unit in self.units.items() if unit != "1"}
        figures = [
            (name, what, "-" if figure is None else f"{figure:,}" if isinstance(figure, int) else short(figure))
            for name, found in self.aspects.items()
            for what, figure in found.items()
        ]
        run = [
            ("events", f"{self.events:,}"),
            ("firings", f"{self.firings:,}"),
            ("wall time", f"{self.wall_time:.3f} s"),
            ("digest", f"{self.digest[:16]}..."),
        ]
        return [
            Table(
                ("metric", "value", "unit", ""),
                [
                    (name, found.shown(short), units.get(name, ""), "; ".join(found.remarks))
                    for name, found in self.outcomes.items()
                ],
            ),
            Table(("aspect", "figure", "value"), figures),
            Table(("signal", "tokens"), [(name, f"{len(signal):,}") for name, signal in self.signals.items()]),
            Table(("run", ""), run),
        ]
