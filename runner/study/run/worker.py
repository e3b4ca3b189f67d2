"""The process in which runs are made: ``python -m epicycle.runner.study.run.worker``.

It is apart from whoever wants the runs, who thereby outlives those that hang or kill their process, and can end them.
It takes what makes a bench, and then one request after the other from standard input; it answers on what was standard
output, and ends with its input.
"""

from __future__ import annotations

import os
import pickle
import queue
import signal
import threading
from typing import Any, BinaryIO

from epicycle.actors import EpicycleError

from ...collection import seldom_collecting
from .processes import BEGUN, DONE, RAISED, READY


def main() -> None:
    """Serve whoever has started this process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who waits for it decides what an interrupt means
    requests, replies = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDWR)
    for each in (0, 1):  # an actor that prints would break into the answers
        os.dup2(nothing, each)
    given: queue.SimpleQueue[Any] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(requests, given), daemon=True).start()

    def tell(what: str, told: object = None) -> None:
        replies.write(pickle.dumps((what, told)))
        replies.flush()

    try:
        with seldom_collecting():
            begin, arguments = given.get()
            bench = begin(*arguments)
            tell(READY)
            while True:
                request = given.get()
                bench.prepare(request)
                tell(BEGUN)
                tell(DONE, bench.make(request))
    except BrokenPipeError:
        os._exit(1)
    except EpicycleError as error:
        tell(RAISED, error)
    except Exception as error:
        tell(RAISED, EpicycleError(f"{type(error).__name__}: {error}"))


def _listen(requests: BinaryIO, given: queue.SimpleQueue[Any]) -> None:
    """Take what comes; when who wants the runs has ended, however that was, end in the middle of a run."""
    try:
        while True:
            given.put(pickle.load(requests))
    except (EOFError, OSError):
        os._exit(1)


if __name__ == "__main__":
    main()
