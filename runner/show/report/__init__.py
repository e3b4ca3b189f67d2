"""Writes the report of a study: repeats runs for its figures, draws them, and puts everything on one page."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from epicycle.actors import EpicycleError, abridged

from ...model.text.problems import ModelError, Problems
from ...model.text.program import describe, raised_at
from ...study.judge.claims import ranked
from ...study.judge.study_results import StudyResults
from ...study.run.runner import Replay, repeat
from ...study.run.store import write
from ...study.session import plan_of_folder
from ..canvas import FORMATS, FigureError, style
from ..outcome import MAX_NAME
from .data import Data
from .declared import check_figures, figures_of_study, own_study_figures, study_figure_types
from .figure import RunKey, SignalFigure, StudyFigure
from .page import Picture, report_page

__all__ = [
    "Report",
    "SignalFigure",
    "StudyFigure",
    "check_figures",
    "figures_of_study",
    "own_study_figures",
    "study_figure_types",
    "write_report",
]


@dataclass
class Report:
    """The files that were written, and the problems."""

    files: list[Path] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    verdicts: Counter[str] = field(default_factory=Counter)


def write_report(
    results: StudyResults, folder: Path, *, jobs: int, tell: Callable[[int, int], None] = lambda done, total: None
) -> Report:
    """Write ``report.html``, ``figures/`` and, if the study has claims, ``claims.json`` into a folder.

    ``tell`` receives how many of the runs that figures need have been repeated.  If a figure cannot be drawn, the
    reason is a problem of the report and appears in place of the figure.  Raises ``ModelError`` for figures that the
    study cannot have.
    """
    report = Report()
    data = Data(results)
    problems = Problems()
    figures = figures_of_study(data.plan, problems)
    problems.raise_if_any()
    extracts = _extracts(data, figures, jobs, tell)
    pictures = []
    place = folder / "figures"
    place.mkdir(parents=True, exist_ok=True)
    for name, figure in figures.items():
        paths = [place / f"{abridged(name, MAX_NAME)}.{ending}" for ending in FORMATS]
        for path in paths:
            path.unlink(missing_ok=True)  # from an earlier report
        try:
            caption = _draw(name, figure, data, extracts.get(name, {}), paths)
        except EpicycleError as error:
            report.problems.append(f"figure {name}: {error}")
            pictures.append(Picture(name, figure.doc, None, str(error)))
        else:
            report.files += paths
            svg = paths[FORMATS.index("svg")].read_bytes()
            pictures.append(Picture(name, figure.doc, svg, caption))
    judgements, recommendations = results.claims(), results.guideline()
    texts = {}
    if judgements or recommendations:
        found = {
            "study": data.plan.study.name,
            "table": results.digest(),
            "claims": [each.as_dict() for each in judgements],
            "standings": [each.as_dict() for each in ranked(judgements)],
            "guideline": [each.as_dict() for each in recommendations],
        }
        texts["claims.json"] = json.dumps(found, indent=1) + "\n"
    texts["report.html"] = report_page(data, pictures, judgements, recommendations)
    for name, text in texts.items():
        path = folder / name
        write(path, text)
        report.files.append(path)
    report.verdicts = Counter(each.verdict for each in judgements)
    return report


def _draw(name: str, figure: StudyFigure, data: Data, extracts: Mapping[RunKey, Any], paths: list[Path]) -> str:
    """Draw a figure to files; returns its caption.  Raises ``EpicycleError``."""
    for extract in extracts.values():
        if isinstance(extract, EpicycleError):
            raise extract
    if not any(condition.good for condition in data.where(figure.where)):
        raise EpicycleError("none of the runs that it shows has been made")
    try:
        with style():
            return figure.draw(data, extracts, paths)
    except EpicycleError:
        raise
    except Exception as error:  # from a user's class
        raise FigureError(name, describe(error), raised_at(error)) from error


def _extracts(
    data: Data, figures: Mapping[str, StudyFigure], jobs: int, tell: Callable[[int, int], None]
) -> dict[str, dict[RunKey, Any]]:
    """What figures need from repeated runs, by figure and run; an error if the runs cannot be repeated."""
    wanted: dict[str, list[RunKey]] = {}
    readers: dict[RunKey, list[tuple[str, SignalFigure]]] = {}
    for name, figure in figures.items():
        if isinstance(figure, SignalFigure):
            wanted[name] = figure.runs_of(data)
            for run in wanted[name]:
                readers.setdefault(run, []).append((name, figure))
    rows = {(row["condition"], row["replication"]): row for row in data.rows}
    replays = [Replay(*run, rows[run]["seed"], rows[run]["digest"], tuple(each)) for run, each in readers.items()]
    found: dict[str, dict[RunKey, Any]] = {name: {} for name in wanted}
    try:
        if replays:
            plan_of_folder(data.results.folder, data.results.types)  # which raises an error if the model has changed
            for replay, extracts in repeat(data.plan, replays, jobs, lambda number: tell(number, len(replays))):
                for name, extract in extracts.items():
                    found[name][replay.condition, replay.replication] = extract
    except EpicycleError as error:
        why = EpicycleError("its model can no longer be loaded") if isinstance(error, ModelError) else error
        return {name: dict.fromkeys(runs, why) for name, runs in wanted.items()}
    return found
