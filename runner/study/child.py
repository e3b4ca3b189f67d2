"""The process that makes the runs on a machine of a Dask cluster; ``python -m epicycle.runner.study.child FOLDER``.

It is apart from the Dask worker, which thereby outlives runs that hang or kill their process, and can end them.  It
takes a parcel and then tasks from standard input, answers on what was standard output, and ends with its input.
"""

from __future__ import annotations

import os
import pickle
import queue
import sys
import threading
from pathlib import Path
from typing import Any, BinaryIO

from ..text import ModelError, noting
from .executor import SENT, WorkerError
from .one_run import Runner
from .parcel import unpack
from .schedule import Task
from .store import Row

READY, UNFIT, BEGUN, OVER = "ready", "unfit", "begun", "over"  # what it tells


def main() -> None:
    """Serve whoever has started this process."""
    requests, replies = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDWR)
    for each in (0, 1):  # an actor that prints would break into the answers
        os.dup2(nothing, each)
    given: queue.SimpleQueue[Any] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(requests, given), daemon=True).start()
    root = Path(sys.argv[1]).resolve()

    def tell(what: str, told: object = None) -> None:
        pickle.dump((what, told), replies)
        replies.flush()

    try:
        bench = _Bench(given.get(), root)
        tell(READY)
        while True:
            task = given.get()
            bench.prepare(task)
            tell(BEGUN)
            tell(OVER, bench.row(task))
    except WorkerError as error:
        tell(UNFIT, str(error))
    except BrokenPipeError:
        os._exit(1)


class _Bench:
    """A runner among files that lie elsewhere than in the study's place."""

    def __init__(self, parcel: bytes, root: Path) -> None:
        self._root = str(root)
        try:
            self._plan = unpack(parcel, root)
        except ModelError as error:
            raise WorkerError(
                f"cannot read the study, which is right here:\n{self._named(str(error))}\n{SENT}"
            ) from error
        self._runner = Runner(self._plan)

    def prepare(self, task: Task) -> None:
        """Load the model; raises ``WorkerError`` if this reads anything else than it does at the study's place."""
        with noting() as noted:
            self._runner.prepare(task)
        if noted.files and (unlike := self._plan.unlike(noted)):
            raise WorkerError(f"has another {self._named(unlike[0])} than this machine\n{SENT}")

    def row(self, task: Task) -> tuple[Row, str | None]:
        """The row of a run; and why its model could not be loaded, if that was so."""
        why_not = self._runner.why_not(task)
        row = self._runner.row(task)
        if row["error"] is not None:
            row["error"] = self._named(row["error"])
        return row, None if why_not is None else self._named(why_not)

    def _named(self, text: str) -> str:
        """The names of files as they are at the study's place."""
        return text.replace(self._root, "")


def _listen(requests: BinaryIO, given: queue.SimpleQueue[Any]) -> None:
    """Take what comes; when the Dask worker has ended, however that was, end in the middle of a run."""
    try:
        while True:
            given.put(pickle.load(requests))
    except (EOFError, OSError):
        os._exit(1)


if __name__ == "__main__":
    main()
