"""Trial: a model that is run repeatedly, each time with different aspects, for ``epicycle.aspects.testing``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from epicycle.aspects.testing import Woven

from ..model.build.load import load_model
from ..model.build.model import Model
from .engine import Record, Simulation


class Trial:
    """Runs a model with aspects in addition to its own, and returns the records of the event log.

    ``model`` is a loaded or built model, or what ``load_model`` takes, with its ``options``; ``until`` is the stop time
    (s), ``seed`` the seed of all runs.  The run without further aspects is made only once.

    >>> assert_silent_at_zero(Noise(deviation=0), Trial("mm1", until=50.0))
    """

    def __init__(
        self, model: Model | str | Path, *, until: float | None = None, seed: int | None = None, **options: Any
    ) -> None:
        self.model = model if isinstance(model, Model) else load_model(model, **options)
        self.until = until
        self.seed = seed
        self._plain: list[Record] | None = None

    def __call__(self, *woven: Woven) -> list[Record]:
        """The records of a run with these aspects, declared after those of the model and in this order."""
        if woven:
            return self._run(woven)
        if self._plain is None:
            self._plain = self._run(())
        return self._plain

    def _run(self, woven: tuple[Woven, ...]) -> list[Record]:
        names = []
        try:
            for each in woven:
                names.append(self.model.weave(each.name, each.aspect, at=each.at).name)
            simulation = Simulation(self.model, seed=self.seed, keep_log=True)
            simulation.run(until=self.until)
            return simulation.log.records
        finally:
            for name in names:
                self.model.unweave(name)
