"""What calibrating a model has found: parameters with their intervals, and what is left of the measured values."""

from __future__ import annotations

import csv
import json
import math
import shlex
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from epicycle.actors import counted, to_seconds

from ..model.language.dimensions import number_node
from ..model.text.program import call_site
from ..support.shown import rounded
from ..support.tables import Table
from .answer import Answer

_ENOUGH = 10  # residuals, of which a correlation can be told
_SMALL = 1e-6  # of a signal: residuals that rounding and the end of the search leave


@dataclass(frozen=True)
class Fitted:
    """A parameter with its value, standard error and 95 % interval, in its unit; infinite if unknown."""

    path: str
    unit: str
    value: float
    error: float
    low: float
    high: float
    at_end: bool  # of its range


@dataclass(frozen=True)
class Matched:
    """A measured signal, and what the model sends at the same times."""

    signal: str
    times: list[int]  # ns
    measured: list[float]
    modelled: list[float]

    @property
    def residuals(self) -> list[float]:
        """What was measured less what the model sends."""
        return [one - other for one, other in zip(self.measured, self.modelled, strict=True)]

    @property
    def rms(self) -> float:
        """The root of the mean square of the residuals."""
        return math.sqrt(math.fsum(each * each for each in self.residuals) / len(self.times))

    @property
    def correlation(self) -> float:
        """How alike neighbouring residuals are, from -1 to 1: about 0 if nothing but independent errors is left."""
        squares = math.fsum(each * each for each in self.residuals)
        return math.fsum(one * other for one, other in pairwise(self.residuals)) / squares if squares else 0.0


@dataclass(repr=False)
class Calibration(Answer):
    """Parameters that were fitted to measured signals, with their intervals and the fit of each signal.

    ``best`` are their values by their paths, in the units of their ranges.  ``sentence`` says what is to be known,
    ``save`` writes parameters.yaml (for ``--overrides``), calibration.json and residuals.csv.
    """

    NAME = "calibration"

    model: str
    seed: int
    parameters: list[Fitted]
    matches: list[Matched]
    pairs: list[tuple[str, str, float]]  # of parameters that the data hardly tell apart, with their correlation
    starts: int
    agreeing: int  # starts that ended there

    @property
    def best(self) -> dict[str, object]:
        """The values of the parameters, by their paths."""
        nodes = ((each.path, number_node(each.value, each.unit, call_site())) for each in self.parameters)
        return {path: node.value for path, node in nodes}

    def _sentences(self) -> Iterator[str]:
        values = ", ".join(f"{each.path}={_value(each)}" for each in self.parameters)
        number = counted(len([time for each in self.matches for time in each.times]), "measured value")
        yield f"{values} fit {number} best (95 % intervals)."
        for each in self.parameters:
            if math.isinf(each.error):
                yield f"These data do not tell {each.path}: other values fit as well."
            elif each.at_end:
                yield f"{each.path} is at the end of its range: the best may lie beyond, and its interval says little."
        for one, other, likeness in self.pairs:
            yield f"The data hardly tell {one} and {other} apart (correlation {likeness:.2f})."
        for match in self.matches:
            noise = 2.0 / math.sqrt(len(match.times))
            is_rough = match.rms > _SMALL * max(map(abs, match.measured))
            if len(match.times) >= _ENOUGH and abs(match.correlation) > noise and is_rough:
                yield (
                    f"The residuals of {match.signal} are no independent errors (correlation of neighbours "
                    f"{match.correlation:.2f}): something is not in the model, and the intervals are too narrow."
                )
        if self.agreeing < self.starts and all(math.isfinite(each.error) for each in self.parameters):
            yield f"Only {self.agreeing} of {self.starts} starts ended there: there may be lower minima."

    def _facts(self) -> dict[str, Any]:
        matches = [
            {"signal": each.signal, "count": len(each.times), "rms": each.rms, "correlation": each.correlation}
            for each in self.matches
        ]
        return {
            "model": self.model,
            "seed": self.seed,
            "parameters": [asdict(each) for each in self.parameters],
            "matches": matches,
            "correlated": [list(each) for each in self.pairs],
            "starts": self.starts,
            "agreeing": self.agreeing,
        }

    def save(self, folder: str | Path | None = None) -> list[Path]:
        """Write parameters.yaml, calibration.json and residuals.csv."""
        [facts] = super().save(folder)
        parameters, residuals = facts.with_name("parameters.yaml"), facts.with_name("residuals.csv")
        lines = [f"{json.dumps(path)}: {json.dumps(value)}\n" for path, value in self.best.items()]
        parameters.write_text("".join(lines), encoding="utf-8")
        with residuals.open("w", encoding="utf-8", newline="") as file:
            rows = csv.writer(file, lineterminator="\n")
            rows.writerow(("signal", "time", "measured", "modelled", "residual"))
            for each in self.matches:
                columns = (map(to_seconds, each.times), each.measured, each.modelled, each.residuals)
                rows.writerows((each.signal, *row) for row in zip(*columns, strict=True))
        return [parameters, facts, residuals]

    def _tables(self) -> list[Table]:
        words = [word for path, value in self.best.items() for word in ("--set", f"{path}={value}")]
        fits = [
            (each.signal, str(len(each.times)), f"{each.rms:.4g}", f"{max(map(abs, each.residuals)):.4g}")
            for each in self.matches
        ]
        return [
            Table(("set it by",), [(shlex.join(words),)]),
            Table(("signal", "values", "residuals (root mean square)", "largest"), fits),
        ]


def _value(each: Fitted) -> str:
    """A value with its interval, to the digits that this tells."""
    unit = f" {each.unit}" if each.unit else ""
    if not math.isfinite(each.error):
        return f"{each.value:.4g}{unit}"
    width = each.high - each.low
    return f"{rounded(each.value, width)} ± {rounded(width / 2, width)}{unit}" if width else f"{each.value:.9g}{unit}"
