"""Output for people: a run's summary, figures and results folder, and the reference of what is installed."""

from ..model.catalogue.figure import Figure as Figure
from .canvas import FigureError as FigureError
from .sheet import Sheet as Sheet
