"""Fitting parameters to measured signals: what ``epicycle.calibrate`` and the command do."""

from __future__ import annotations

import csv
import json
import math
import shlex
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from epicycle.actors import counted, to_seconds

from ..bars import bar
from ..language.dimensions import number_node
from ..provenance import version_of
from ..search import Calibration, Fitted, Match, Task
from ..search import calibrate as search
from ..shown import finite, rounded
from ..tables import Table, Tabled
from ..text.program import call_site
from .falsifying import as_ranges
from .studying import as_settings

_ENOUGH = 10  # residuals, of which a correlation can be told


class Calibrated(Tabled):
    """Parameters that were fitted to measured signals, with their intervals and what is left of the measured values.

    ``best`` are their values by their paths, in the units of their ranges.  ``sentence`` says what is to be known,
    ``save`` writes parameters.yaml (for ``--overrides``), calibration.json and residuals.csv.
    """

    def __init__(self, calibration: Calibration, task: Task) -> None:
        self.calibration = calibration
        nodes = ((each.path, number_node(each.value, each.unit, call_site())) for each in calibration.parameters)
        self.best = {path: node.value for path, node in nodes}
        self._task = task

    @property
    def sentence(self) -> str:
        """What came of the fit, in words."""
        return " ".join(self._sentences())

    def _sentences(self) -> Iterator[str]:
        found = self.calibration
        values = ", ".join(f"{each.path}={_value(each)}" for each in found.parameters)
        number = counted(len([time for each in found.matches for time in each.times]), "measured value")
        yield f"{values} fit {number} best (95 % intervals)."
        for each in found.parameters:
            if math.isinf(each.error):
                yield f"These data do not tell {each.path}: other values fit as well."
            elif each.at_end:
                yield f"{each.path} is at the end of its range: the best may lie beyond, and its interval says little."
        for one, other, likeness in found.pairs:
            yield f"The data hardly tell {one} and {other} apart (correlation {likeness:.2f})."
        for match in found.matches:
            noise = 2.0 / math.sqrt(len(match.times))
            if len(match.times) >= _ENOUGH and abs(match.correlation) > noise and _is_rough(match):
                yield (
                    f"The residuals of {match.signal} are no independent errors (correlation of neighbours "
                    f"{match.correlation:.2f}): something is not in the model, and the intervals are too narrow."
                )
        if found.agreeing < found.starts and all(math.isfinite(each.error) for each in found.parameters):
            yield f"Only {found.agreeing} of {found.starts} starts ended there: there may be lower minima."

    def facts(self) -> dict[str, Any]:
        """Everything that was found, for programs."""
        found = self.calibration
        matches = [
            {"signal": each.signal, "count": len(each.times), "rms": each.rms, "correlation": each.correlation}
            for each in found.matches
        ]
        facts = finite(
            {
                "model": found.model,
                "seed": found.seed,
                "parameters": [asdict(each) for each in found.parameters],
                "matches": matches,
                "correlated": [list(each) for each in found.pairs],
                "starts": found.starts,
                "agreeing": found.agreeing,
                "sentence": self.sentence,
                "version": version_of("epicycle"),
            }
        )
        assert isinstance(facts, dict)
        return facts

    def save(self, folder: str | Path) -> list[Path]:
        """Write parameters.yaml, calibration.json and residuals.csv."""
        place = Path(folder)
        place.mkdir(parents=True, exist_ok=True)
        written = [place / name for name in ("parameters.yaml", "calibration.json", "residuals.csv")]
        lines = [f"{json.dumps(path)}: {json.dumps(value)}\n" for path, value in self.best.items()]
        written[0].write_text("".join(lines), encoding="utf-8")
        written[1].write_text(json.dumps(self.facts(), indent=2) + "\n", encoding="utf-8")
        with written[2].open("w", encoding="utf-8", newline="") as file:
            rows = csv.writer(file, lineterminator="\n")
            rows.writerow(("signal", "time", "measured", "modelled", "residual"))
            for each in self.calibration.matches:
                columns = (map(to_seconds, each.times), each.measured, each.modelled, each.residuals)
                rows.writerows((each.signal, *row) for row in zip(*columns, strict=True))
        return written

    def __repr__(self) -> str:
        return f"<Calibrated: {self.sentence}>"

    def _caption(self) -> str:
        return self.sentence

    def _tables(self) -> list[Table]:
        words = [word for path, value in self.best.items() for word in ("--set", f"{path}={value}")]
        fits = [
            (each.signal, str(len(each.times)), f"{each.rms:.4g}", f"{max(map(abs, each.residuals)):.4g}")
            for each in self.calibration.matches
        ]
        return [
            Table(("set it by",), [(shlex.join(words),)]),
            Table(("signal", "values", "residuals (root mean square)", "largest"), fits),
        ]


def calibrate(
    model: str | Path,
    *,
    match: str | Iterable[str] | Mapping[str, str | Path],
    vary: Iterable[str] | Mapping[str, object],
    linear: bool = False,
    seed: int | None = None,
    out: str | Path | None = None,
    set: Iterable[str] | Mapping[str, object] = (),
    disturb: str | Path | Iterable[str | Path] = (),
    types: Iterable[str | Path] = (),
) -> Calibrated:
    """Fit parameters of a model so that its signals match measured ones, by least squares.

    ``match`` gives a file (.csv, .parquet) with the columns ``time`` and ``value`` for each output port, ``vary`` the
    ranges.  A token lasts until the next one, or with ``linear`` changes linearly to it.  Each run is noted in the
    folder ``out``, if there is one, so that a search that was killed continues there.

    >>> epicycle.calibrate("pid_loop", match={"plant.output": "step.csv"}, vary={"plant.time_constant": "0.5 s..5 s"})
    """
    matched = [match] if isinstance(match, str) else match
    task = Task(
        str(model),
        [f"{signal}={file}" for signal, file in matched.items()] if isinstance(matched, Mapping) else [*matched],
        [*(as_ranges(vary) if isinstance(vary, Mapping) else vary)],
        linear,
        seed,
        as_settings(set),
        [str(each) for each in ([disturb] if isinstance(disturb, (str, Path)) else disturb)],
        [Path(each) for each in types],
    )
    return calibrated(task, out)


def calibrated(task: Task, out: str | Path | None) -> Calibrated:
    """The same for what a command asks for."""
    with bar("calibrate") as show:

        def tell(runs: int) -> None:
            if show is not None:
                show(float(runs), None, f"{runs:,} runs")

        return Calibrated(search(task, None if out is None else Path(out), tell), task)


def _value(each: Fitted) -> str:
    """A value with its interval, to the digits that this tells."""
    unit = f" {each.unit}" if each.unit else ""
    if not math.isfinite(each.error):
        return f"{each.value:.4g}{unit}"
    width = each.high - each.low
    return f"{rounded(each.value, width)} ± {rounded(width / 2, width)}{unit}" if width else f"{each.value:.9g}{unit}"


def _is_rough(each: Match) -> bool:
    """Whether the residuals are more than what rounding and the end of the search leave."""
    return each.rms > 1e-6 * max(map(abs, each.measured))
