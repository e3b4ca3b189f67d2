"""Files that show a run: a page, for one or two side by side, and recordings for other viewers."""

from .mcap_file import require_mcap, write_mcap
from .page import page_of, write_page
from .recording import Recording
from .rerun_file import require_rerun, write_rerun
from .writing import ViewError

__all__ = [
    "Recording",
    "ViewError",
    "page_of",
    "require_mcap",
    "require_rerun",
    "write_mcap",
    "write_page",
    "write_rerun",
]
