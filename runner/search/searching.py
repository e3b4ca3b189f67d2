"""A search for what its goal says, with what is seen of it on the way."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from epicycle.actors import EpicycleError

from ..study.inference import with_interval
from ..support.shown import short
from .calibrating import calibrate
from .calibration import Calibration
from .falsification import Falsification, Run
from .falsifying import falsify
from .optimising import optimise
from .optimum import Optimum
from .spec import Break, Goal, Match, SearchSpec

Show = Callable[[float, float | None, str], None]


def found(
    spec: SearchSpec, goal: Goal, out: Path | None, *, jobs: int | None, timeout: float | None, show: Show | None
) -> Falsification | Optimum | Calibration:
    """What a search finds; ``show`` is told how far it has come.

    It is kept in ``out``, by default in the folder of results of the model, or of the study.
    """
    show = show or _nobody
    if isinstance(goal, Break):

        def tell_runs(runs: int, least: Run | None) -> None:
            known = "" if least is None else f", least robustness {short(least.robustness)}"
            show(float(runs), float(goal.runs), f"{runs:,} runs{known}")

        return falsify(spec, goal, out, jobs=jobs, timeout=timeout, tell=tell_runs)
    if isinstance(goal, Match):
        if timeout is not None:
            raise EpicycleError("--run-timeout is not for --match, which needs every run")
        return calibrate(spec, goal, out, jobs=jobs, tell=lambda runs: show(float(runs), None, f"{runs:,} runs"))

    def tell_best(optimum: Optimum) -> None:
        known = "" if optimum.value is None else f", best {with_interval(optimum.value)}"
        show(float(len(optimum.tested)), float(goal.points), f"{len(optimum.tested):,} points{known}")

    return optimise(spec, goal, out, jobs=jobs, timeout=timeout, tell=tell_best)


def _nobody(done: float, total: float | None, words: str) -> None:
    """Nobody looks."""
