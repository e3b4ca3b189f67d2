"""What people see: of a run summary, figures, results folder; of what is installed, the reference."""

from ..catalogue import Figure
from .drawing import FigureError, draw
from .figures import Histogram, TimeSeries, Trajectories
from .folder import check_folder, draw_figures, write_folder
from .reference import aspects_at, described, detail, markdown, overview, parts_described, weaving
from .summary import summary_object, summary_table

__all__ = [
    "Figure",
    "FigureError",
    "Histogram",
    "TimeSeries",
    "Trajectories",
    "aspects_at",
    "check_folder",
    "described",
    "detail",
    "draw",
    "draw_figures",
    "markdown",
    "overview",
    "parts_described",
    "summary_object",
    "summary_table",
    "weaving",
    "write_folder",
]
