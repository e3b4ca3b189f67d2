"""From a results folder to its report: figures are drawn, runs repeated for them, and the page is written."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from epicycle.actors import EpicycleError, abridged

from ...study import Replay, StudyResults, plan_of_folder, ranked, repeat, replace_file
from ...text import ModelError, Problems, describe, raised_at
from ..drawing import FigureError
from ..folder import MAX_NAME
from ..pen import FORMATS, style
from .data import Data
from .declared import figures_of_study
from .figure import RunKey, SignalFigure, StudyFigure
from .page import Picture, report_page

Extracts = dict[str, dict[RunKey, Any]]  # by figure and run


@dataclass
class Report:
    """What was written, and what could not be."""

    files: list[Path] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    verdicts: Counter[str] = field(default_factory=Counter)


def write_report(
    results: StudyResults, folder: Path, *, jobs: int, tell: Callable[[int, int], None] = lambda done, total: None
) -> Report:
    """Write ``report.html``, ``figures/`` and, if the study has claims, ``claims.json`` into a folder.

    ``tell`` is told how many of the runs that figures need are repeated.
    What keeps a figure from being drawn is a problem of the report, and stands in its place.  Raises ``ModelError`` for
    figures that the study cannot have.
    """
    report = Report()
    data = Data(results)
    problems = Problems()
    figures = figures_of_study(data.plan, problems)
    problems.raise_if_any()
    extracts, failure = _extracts(data, figures, jobs, tell)
    pictures = []
    place = folder / "figures"
    place.mkdir(parents=True, exist_ok=True)
    for name, figure in figures.items():
        picture = _picture(name, figure, data, extracts.get(name, {}), failure, place, report)
        if picture.problem:
            report.problems.append(f"figure {name}: {picture.problem}")
        pictures.append(picture)
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
        replace_file(path, text.encode())
        report.files.append(path)
    report.verdicts = Counter(each.verdict for each in judgements)
    return report


def _picture(
    name: str,
    figure: StudyFigure,
    data: Data,
    extracts: Mapping[RunKey, Any],
    failure: str,
    folder: Path,
    report: Report,
) -> Picture:
    """Draw one figure, or find out why it cannot be drawn."""
    paths = [folder / f"{abridged(name, MAX_NAME)}.{ending}" for ending in FORMATS]
    for path in paths:
        path.unlink(missing_ok=True)  # of an earlier report
    if isinstance(figure, SignalFigure) and failure:
        return Picture(name, figure.doc, "", None, failure)
    if not any(condition.good for condition in figure.conditions(data)):
        return Picture(name, figure.doc, "", None, "none of the runs that it shows is there")
    try:
        for extract in extracts.values():
            if isinstance(extract, EpicycleError):
                raise extract
        with style():
            caption = figure.draw(data, extracts, paths)
    except EpicycleError as error:
        return Picture(name, figure.doc, "", None, str(error))
    except Exception as error:  # of a class of a user's
        return Picture(name, figure.doc, "", None, str(FigureError(name, describe(error), raised_at(error))))
    report.files += paths
    return Picture(name, figure.doc, caption, paths[FORMATS.index("svg")].read_bytes())


def _extracts(
    data: Data, figures: Mapping[str, StudyFigure], jobs: int, tell: Callable[[int, int], None]
) -> tuple[Extracts, str]:
    """What figures need of runs that are repeated; or why these cannot be."""
    readers: dict[RunKey, list[tuple[str, SignalFigure]]] = {}
    for name, figure in figures.items():
        if isinstance(figure, SignalFigure):
            for run in figure.runs_of(data):
                readers.setdefault(run, []).append((name, figure))
    if not readers:
        return {}, ""
    rows = {(row["condition"], row["replication"]): row for row in data.rows}
    replays = [Replay(*run, rows[run]["seed"], rows[run]["digest"], tuple(wanted)) for run, wanted in readers.items()]
    found: Extracts = {name: {} for name in figures}
    try:
        plan_of_folder(data.results.folder)  # which says so if the model has changed
        done = repeat(data.plan, replays, jobs, lambda number: tell(number, len(replays)))
        for replay, extracts in done:
            for name, extract in extracts.items():
                found[name][replay.condition, replay.replication] = extract
    except EpicycleError as error:
        reason = "its model cannot be loaded any more" if isinstance(error, ModelError) else str(error)
        return {}, reason
    return found, ""
