"""Two futures of a run side by side: where they part, and what follows."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any, ClassVar

from epicycle.actors import Tag, counted

from ..execution.results import Verdict, plain
from ..model.build.model import Model
from ..show.view.differing import affected, difference, first_firing
from ..show.view.pages import Page
from ..support.shown import short
from ..support.tables import Table
from .answer import Answer, listed

AS_IT_WAS, INSTEAD = "as it was", "what if"
_FEW = 8  # actors in a sentence


class WhatIf(Answer):
    """A run as it was, and the run with changes from a tag on: ``before`` and ``after`` are their results.

    ``first`` is the first firing that changes; ``record`` the first difference of the logs, in words; ``affected`` are
    the actors that do anything else, with the times (s) at which they begin to; ``error`` has ended the other future.
    """

    NAME: ClassVar[str] = "what_if"

    def __init__(self, model: Model, at: Tag, changes: list[str], page: Page) -> None:
        self.model, self.at, self.changes, self._page = model.name, at, changes, page
        before, after = (each.results for each in page.recordings)
        assert before is not None
        assert after is not None
        self.before, self.after = before, after
        self.first = first_firing(page.recordings)
        record = difference(page.recordings)
        self.record: list[str] = [] if record is None else record["texts"]
        self.affected = {actor: tag.seconds for actor, tag in affected(page.recordings).items()}
        self.error = str(page.errors[0]) if page.errors else ""
        self._actors = len(model.graph.actors)

    @property
    def is_same(self) -> bool:
        """Whether nothing has changed: the logs are equal, bit for bit."""
        return self.before.digest == self.after.digest

    def _sentences(self) -> list[str]:
        what = f" {listed(self.changes)}." if self.changes else " nothing is changed."
        said = [f"From {self.at.seconds:.9g} s on,{what}"]
        if self.is_same:
            reason = (
                "Both futures have the same log"
                if not self.changes
                else "It makes no difference: both futures have the same log; what an actor reads only at its start "
                "does not change later"
            )
            return [*said, f"{reason}."]
        if self.first is not None:
            said.append(f"The first firing that changes is {self.first.actor} at {self.first.tag}.")
        names = [*self.affected][:_FEW]
        more = f" and {len(self.affected) - _FEW:,} more" if len(self.affected) > _FEW else ""
        whom = f": {', '.join(names)}{more}" if names else ""
        do = "does" if len(self.affected) == 1 else "do"
        said.append(f"{len(self.affected):,} of {counted(self._actors, 'actor')} {do} something else{whom}.")
        for name, verdict in self.before.monitors.items():
            if (other := self.after.monitors[name]).holds != verdict.holds:
                said.append(f"Monitor {name}: {_verdict(verdict)} as it was, {_verdict(other)} instead.")
        if self.error:
            said.append(f"The other future ends in an error: {self.error}")
        return said

    def _facts(self) -> dict[str, Any]:
        both, first = {AS_IT_WAS: self.before, INSTEAD: self.after}, self.first
        return {
            "model": self.model,
            "seed": self.before.seed,
            "at": {"time": self.at.seconds, "microstep": self.at.microstep},
            "changes": self.changes,
            "same": self.is_same,
            "first_firing": first
            and {"actor": first.actor, "time": first.time, "microstep": first.at.microstep, "does": first.does},
            "first_difference": dict(zip(both, self.record, strict=False)),
            "affected": self.affected,
            "digests": {name: each.digest for name, each in both.items()},
            "stopped": {name: each.stopped for name, each in both.items()},
            "metrics": {name: plain(each.metrics) for name, each in both.items()},
            "monitors": {
                name: {key: asdict(verdict) for key, verdict in each.monitors.items()} for name, each in both.items()
            },
            "error": self.error,
        }

    def page(self) -> Page:
        """A page with both futures; the first firing that changes is marked."""
        self._page.story = self._sentences()
        return self._page

    def save(self, folder: str | Path | None = None, *, page: bool = True) -> list[Path]:
        """Write what_if.json and, unless refused, what_if.html."""
        [facts] = super().save(folder)
        return [facts, *([self.page().save(facts.with_suffix(".html"))] if page else [])]

    def _tables(self) -> list[Table]:
        units = {name: "" if unit == "1" else unit for name, unit in self.before.units.items()}
        metrics = [
            (name, each.shown(short), self.after.outcomes[name].shown(short), units.get(name, ""))
            for name, each in self.before.outcomes.items()
        ]
        verdicts = [
            (name, _verdict(each), _verdict(self.after.monitors[name])) for name, each in self.before.monitors.items()
        ]
        rows = [("first difference", *self.record)] if self.record else []
        if self.first is not None:
            rows.insert(0, (f"{self.first.actor} at {self.first.tag}", *self.first.does))
        return [
            Table(("", AS_IT_WAS, INSTEAD), rows),
            Table(("metric", AS_IT_WAS, INSTEAD, "unit"), metrics),
            Table(("monitor", AS_IT_WAS, INSTEAD), verdicts),
        ]


def _verdict(verdict: Verdict) -> str:
    if verdict.holds is None:
        return "cannot be judged"
    if verdict.holds:
        return "holds"
    return "broken" if verdict.time is None else f"broken at {verdict.time:.9g} s"
