"""The end of a process that a model may have filled with threads of its own."""

from __future__ import annotations

import os
import sys
import threading
import time
from contextlib import suppress

PATIENCE = 1.0  # s that threads have to come to their end


def leave(code: int) -> int:
    """``code``, to be handed on; if a thread of the run would keep Python from ending, the process ends all the same.

    Python waits for threads when it ends, and tells those of executors to end; so it is watched from a daemon thread.
    """
    if _others():
        threading.Thread(target=_end, args=(code,), daemon=True).start()
    return code


def _end(code: int) -> None:
    time.sleep(PATIENCE)
    if not (left := _others()):
        return
    names = ", ".join(each.name for each in left[:3]) + (", ..." if len(left) > 3 else "")
    with suppress(OSError, ValueError):  # there may be nobody any more who would read it
        print(f"threads that the run has started are still at work, and are ended: {names}", file=sys.stderr)
    for stream in (sys.stdout, sys.stderr):
        with suppress(AttributeError, OSError, ValueError):
            stream.flush()
    os._exit(code)


def _others() -> list[threading.Thread]:
    """The threads for which Python would wait."""
    return [each for each in threading.enumerate() if each is not threading.main_thread() and not each.daemon]
