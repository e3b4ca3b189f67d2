"""Output for people: a run's summary, figures and results folder, and the reference of what is installed."""

from ..model.catalogue.figure import Figure
from .canvas import FigureError, draw
from .figures import Histogram, TimeSeries
from .outcome import check_folder, draw_figures, summary_object, summary_table, write_folder
from .reference import aspects_at, described, detail, overview, parts_described, weaving
from .sheet import Sheet
from .trajectories import Trajectories

__all__ = [
    "Figure",
    "FigureError",
    "Histogram",
    "Sheet",
    "TimeSeries",
    "Trajectories",
    "aspects_at",
    "check_folder",
    "described",
    "detail",
    "draw",
    "draw_figures",
    "overview",
    "parts_described",
    "summary_object",
    "summary_table",
    "weaving",
    "write_folder",
]
