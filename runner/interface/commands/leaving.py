"""The end of a process in which a model may have started threads."""

from __future__ import annotations

import os
import sys
import threading
import time
from contextlib import suppress

PATIENCE = 1.0  # s that threads have to finish


def leave(code: int) -> int:
    """Return ``code``; if a thread of the run would keep Python from ending, end the process anyway.

    At its end, Python waits for threads and asks those of executors to stop, so a daemon thread watches it.
    """
    if _others():
        threading.Thread(target=_end, args=(code,), daemon=True).start()
    return code


def _end(code: int) -> None:
    time.sleep(PATIENCE)
    if not (left := _others()):
        return
    names = ", ".join(each.name for each in left[:3]) + (", ..." if len(left) > 3 else "")
    with suppress(OSError, ValueError):  # the reader may be gone
        print(f"threads that the run started are still running and are ended: {names}", file=sys.stderr)
    for stream in (sys.stdout, sys.stderr):
        with suppress(AttributeError, OSError, ValueError):
            stream.flush()
    os._exit(code)


def _others() -> list[threading.Thread]:
    """The threads that Python would wait for."""
    return [each for each in threading.enumerate() if each is not threading.main_thread() and not each.daemon]
