"""The report of a study: figures, tables, claims, on one page."""

from .declared import check_figures, figures_of_study, study_figure_types
from .figure import SignalFigure, StudyFigure
from .write import Report, write_report

__all__ = [
    "Report",
    "SignalFigure",
    "StudyFigure",
    "check_figures",
    "figures_of_study",
    "study_figure_types",
    "write_report",
]
