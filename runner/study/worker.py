"""A worker of the local executor: a process that makes one run after the other and writes their rows itself."""

from __future__ import annotations

import os
import signal
import sys
import threading
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from ..collection import seldom_collecting
from ..leaving import leave
from .one_run import Runner
from .plan import Plan
from .schedule import Done
from .store import Store, Writer

# What it tells.
READY, BEGUN, OVER, CANNOT_WRITE = "ready", "begun", "over", "cannot write"


def work(folder: str, connection: Connection, lifeline: Connection) -> None:
    """Take tasks from the connection until it says None or closes; end at once when the lifeline closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the study decides what an interrupt means
    threading.Thread(target=_end_with, args=(lifeline,), daemon=True).start()
    sys.stdout = open(os.devnull, "w")  # noqa: SIM115  actors that print would do so thousands of times
    store = Store(Path(folder))
    plan = Plan.of_manifest(store.manifest)
    runner, writer = Runner(plan), Writer(store)
    decides = None if plan.study.until is None else plan.study.until.metric
    connection.send((READY, None))
    try:
        with seldom_collecting():
            while (task := connection.recv()) is not None:
                runner.prepare(task)
                connection.send((BEGUN, None))
                row = runner.row(task)
                writer.add(row)
                connection.send((OVER, Done(row["status"], row[decides] if decides else None)))
        writer.flush()
        leave(0)
    except EOFError:
        return
    except OSError as error:
        _tell(connection, (CANNOT_WRITE, error.strerror or str(error)))


def _tell(connection: Connection, message: tuple[str, Any]) -> None:
    try:
        connection.send(message)
    except OSError:  # nobody listens any more
        return


def _end_with(lifeline: Connection) -> None:
    """End this process when the study's has ended, however that was; even in the middle of a run."""
    try:
        lifeline.recv()
    except (EOFError, OSError):
        os._exit(1)
