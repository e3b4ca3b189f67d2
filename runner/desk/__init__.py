"""The desk: what an editor asks about a model while somebody writes it.

Functions of a text and a place in it, on top of the passes that load a model: ``reading`` gives what is wrong and what
is known so far, ``completion`` what may be written, ``meaning`` what stands there, ``changes`` fixes and new names;
``editing`` are changes of the model as changes of its text, and ``controls`` what one may set.  ``answers`` are all of
these as the Language Server Protocol has them; ``comparing`` finds what differs between two models.

What is not offered here needs packages of the extras ``editor`` and ``studio``.
"""

from .changes import edits_between, report
from .comparing import Difference, difference
from .knowledge import Knowledge
from .reading import Reading, read

__all__ = [
    "Difference",
    "Knowledge",
    "Reading",
    "difference",
    "edits_between",
    "read",
    "report",
]
