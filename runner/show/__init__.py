"""What people see of a run: summary, figures, results folder."""

from .drawing import figures_of
from .figures import Figure, Trajectories
from .folder import write_folder
from .summary import summary_object, summary_table

__all__ = ["Figure", "Trajectories", "figures_of", "summary_object", "summary_table", "write_folder"]
