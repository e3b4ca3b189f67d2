"""The desk: what an editor asks about a model while somebody writes it.

Functions of a text and a place in it, on top of the passes that load a model: ``read`` gives what is wrong and what is
known so far, ``complete`` what may be written, ``hover``, ``definition``, ``references`` and ``symbols`` what stands
there, ``fix`` and ``rename`` changes of the text; ``editing`` are changes of the model as changes of its text,
and ``controls`` what one may set.
"""

from . import controls, editing
from .changes import Edit, RenameError, apply, fix, fix_all, rename, texts_after
from .comparing import Change, Difference, contents, difference
from .completion import Suggestion, complete
from .editing import Splice, splices
from .kinds_page import page
from .knowledge import Knowledge
from .meaning import Symbol, definition, hover, links, path_of, references, symbols
from .parts import EditError
from .places import lines_of
from .positions import Positions
from .problem_data import as_data, of_problems, report
from .reading import Reading, read
from .session import Session

__all__ = [
    "Change",
    "Difference",
    "Edit",
    "EditError",
    "Knowledge",
    "Positions",
    "Reading",
    "RenameError",
    "Session",
    "Splice",
    "Suggestion",
    "Symbol",
    "apply",
    "as_data",
    "complete",
    "contents",
    "controls",
    "definition",
    "difference",
    "editing",
    "fix",
    "fix_all",
    "hover",
    "lines_of",
    "links",
    "of_problems",
    "page",
    "path_of",
    "read",
    "references",
    "rename",
    "report",
    "splices",
    "symbols",
    "texts_after",
]
