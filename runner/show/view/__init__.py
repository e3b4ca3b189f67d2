"""Files that show a run: a page, for one or two side by side, and recordings for other viewers."""

from .drawing import drawn
from .mcap_file import require_mcap, write_mcap
from .page import PARTS, data_of, metrics, page_of, part, script, write_page
from .recording import Recording, ViewError
from .rerun_file import require_rerun, write_rerun

__all__ = [
    "PARTS",
    "Recording",
    "ViewError",
    "data_of",
    "drawn",
    "metrics",
    "page_of",
    "part",
    "require_mcap",
    "require_rerun",
    "script",
    "write_mcap",
    "write_page",
    "write_rerun",
]
