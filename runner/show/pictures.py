"""Pictures of results, to show in a notebook or write to a file; and saving results."""

from __future__ import annotations

import base64
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, overload

from epicycle.actors import EpicycleError, did_you_mean

from ..execution.results import Results, write_log
from ..model.build.figures import made_figure
from ..model.catalogue.figure import Figure
from ..model.catalogue.types import figure_types
from ..model.text.patterns import select
from ..model.text.problems import Problems
from ..study.judge.study_results import StudyResults
from ..study.session import available_cores
from ..support.html import Html, tag
from ..support.printing import complain
from .canvas import draw as draw_figure
from .figures import TimeSeries
from .outcome import check_folder, draw_figures, write_folder
from .report import write_report


class Saving(Protocol):
    """What saves itself: a picture, a comparison, what a search found."""

    def save(self, path: Any, /) -> Path | list[Path]:
        """Write it; the files."""
        ...


@dataclass(eq=False, repr=False)
class Picture:
    """A picture, drawn when it is shown or saved; a notebook shows it as SVG."""

    name: str
    _write: Callable[[Path], object]

    def save(self, path: str | Path) -> Path:
        """Write it to a file, whose suffix decides the format: .svg, .png or .pdf."""
        self._write(Path(path))
        return Path(path)

    def svg(self) -> bytes:
        """The picture as SVG."""
        with tempfile.TemporaryDirectory() as folder:
            return self.save(Path(folder, "picture.svg")).read_bytes()

    def __repr__(self) -> str:
        return f"<Picture {self.name}>"

    def _repr_html_(self) -> str:
        data = base64.b64encode(self.svg()).decode()  # of an image, whose content cannot reach the page around it
        return tag("img", src=f"data:image/svg+xml;base64,{data}", alt=self.name, style="max-width: 100%")


class Pictures(dict[str, Picture]):
    """Pictures by name."""

    def __missing__(self, name: str) -> Picture:
        raise EpicycleError(f"there is no figure {name!r}{did_you_mean(name, self)}")

    def __repr__(self) -> str:
        return f"<Pictures {', '.join(self)}>"

    def _repr_html_(self) -> str:
        return tag("div", [Html(each._repr_html_()) for each in self.values()])


@overload
def plot(results: Results | StudyResults, figure: None = None) -> Pictures: ...
@overload
def plot(results: Results | StudyResults, figure: str | Figure) -> Picture: ...
def plot(results: Results | StudyResults, figure: str | Figure | None = None) -> Picture | Pictures:
    """The figures that a model declares for its runs, or a study for its table; with a name, only that figure.

    For a run, ``figure`` may also be a pattern of recorded signals, which are drawn over time, or a ``Figure``.
    """
    if isinstance(results, StudyResults):
        if isinstance(figure, Figure):
            raise EpicycleError(f"{type(figure).__name__} is a figure of a run, not of a study")
        pictures = _of_study(results)
        return pictures if figure is None else pictures[figure]
    if isinstance(figure, Figure):
        return _of_run(type(figure).__name__, figure, results)
    if figure is not None and figure not in results.figures and select(figure, results.signals):
        return _of_run(figure, TimeSeries(signals=figure), results)
    found = {name: _of_run(name, each, results) for name, each in _figures(results).items()}
    if figure is None:
        return Pictures(found)
    if figure not in found:
        known = [*found, *results.signals]
        told = f"{results.model} has no figure and no recorded signal {figure!r}{did_you_mean(figure, known)}"
        raise EpicycleError(f"{told}\n   help: it has {', '.join(known) or 'none'}")
    return found[figure]


def _figures(results: Results) -> dict[str, Figure]:
    """The figures that the model of a run declares."""
    problems, known = Problems(), figure_types()
    found = {name: made_figure(name, known, declared, problems) for name, declared in results.figures.items()}
    problems.raise_if_any()
    return {name: figure for name, figure in found.items() if figure}


def _of_run(name: str, figure: Figure, results: Results) -> Picture:
    return Picture(name, lambda path: draw_figure(name, figure, results, path))


def _of_study(results: StudyResults) -> Pictures:
    """All figures of a study, as its report draws them."""
    found: dict[str, dict[str, bytes]] = {}
    with tempfile.TemporaryDirectory() as folder:
        written = write_report(results, Path(folder), jobs=available_cores())
        for path in written.files:
            if path.parent.name == "figures":
                found.setdefault(path.stem, {})[path.suffix] = path.read_bytes()
    for problem in written.problems:
        complain(f"error: {problem}")
    return Pictures({name: Picture(name, _copying(name, kinds)) for name, kinds in found.items()})


def _copying(name: str, kinds: dict[str, bytes]) -> Callable[[Path], object]:
    def write(path: Path) -> None:
        if path.suffix not in kinds:
            raise EpicycleError(f"figure {name} cannot be written to {path}: its name must end in {', '.join(kinds)}")
        path.write_bytes(kinds[path.suffix])

    return write


def save(what: Results | StudyResults | Saving, path: str | Path) -> list[Path]:
    """Write to disk; returns the files written.

    A run goes to a folder with manifest, signals, figures and, if it was kept, the log; a study to a folder with its
    report; the metrics of a comparison's runs to a file (.csv); a picture to a file (.svg, .png, .pdf); what a search
    found to a folder.
    """
    place = Path(path)
    if not isinstance(what, (Results, StudyResults)):
        written = what.save(place)
        return [written] if isinstance(written, Path) else written
    if isinstance(what, StudyResults):
        return write_report(what, place, jobs=available_cores()).files
    given = ["epicycle.save", what.model]
    if replaced := check_folder(place, what.model, given):
        complain(replaced)
    written = write_folder(place, what, given)
    if what.log.records:
        written.append(place / "log.parquet")
        write_log(what.log.records, written[-1])
    drawn, failed = draw_figures(place, what, _figures(what))
    for error in failed:
        raise error
    return [*drawn, *written]
