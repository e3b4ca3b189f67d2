"""The end of a process that a model may have filled with threads of its own."""

from __future__ import annotations

import os
import sys
import threading
import time
from contextlib import suppress

from .printing import complain

PATIENCE = 1.0  # s that threads have to come to their end


def leave(code: int) -> int:
    """``code``, to be handed on; but if an actor's thread would keep Python from ending, the process ends here."""
    until = time.monotonic() + PATIENCE
    for each in _others():
        each.join(max(0.0, until - time.monotonic()))
    if not (left := _others()):
        return code
    names = ", ".join(each.name for each in left[:3]) + (", ..." if len(left) > 3 else "")
    with suppress(OSError, ValueError):  # there may be nobody any more who would read it
        complain(f"threads that the run has started are still at work, and are ended: {names}")
    for stream in (sys.stdout, sys.stderr):
        with suppress(AttributeError, OSError, ValueError):
            stream.flush()
    os._exit(code)


def _others() -> list[threading.Thread]:
    """The threads for which Python would wait."""
    own = (threading.main_thread(), threading.current_thread())
    return [each for each in threading.enumerate() if each not in own and not each.daemon and each.is_alive()]
