"""What a Dask worker does for a study: it hands runs to processes of its own, and ends those that hang."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from .backlog import Task
from .parcel import Guest
from .processes import Outcome, Processes, UnwantedError, WorkerError

_SOON = 0.05  # s
_IDLE = 20.0  # s after which processes without work are ended: their study is over


@dataclass
class _House:
    """The processes of one study on this worker, how many batches they are at, and what ends them."""

    processes: Processes
    batches: int = 0
    timer: threading.Timer | None = None


_houses: dict[str, _House] = {}  # by study
_guard = threading.Lock()


def parcel_key(study: str, address: str) -> str:
    """The name under which the worker at an address has the parcel of a study."""
    return f"{study}-parcel-{address}"


def make(batch: str) -> list[Outcome]:
    """Make runs, on a Dask worker; raises ``WorkerError`` if it cannot.

    What it gives are plain values, which a scheduler that knows nothing of Epicycle passes on.
    """
    from distributed import get_worker

    worker = get_worker()
    key = worker.get_current_task()

    def is_wanted() -> bool:
        state = worker.state.tasks.get(key)
        return state is not None and state.state not in ("cancelled", "released")

    given = json.loads(batch)
    try:
        parcel = _parcel(worker, given["study"], is_wanted)
        with _at_work(given["study"], parcel, worker.local_directory) as processes:
            return [processes.make(Task(*each), given["timeout"], is_wanted) for each in given["tasks"]]
    except UnwantedError:
        return []  # nobody will look at it
    except WorkerError as error:
        raise WorkerError(f"the Dask worker {worker.address} {error}") from None


def _parcel(worker: Any, study: str, is_wanted: Callable[[], bool]) -> bytes:
    """The parcel, which comes soon after a worker that has just come."""
    while (found := worker.data.get(parcel_key(study, worker.address))) is None:
        if not is_wanted():
            raise UnwantedError
        time.sleep(_SOON)
    parcel: bytes = found
    return parcel


@contextmanager
def _at_work(study: str, parcel: bytes, place: str) -> Iterator[Processes]:
    """The processes of a study; they are ended when there has been no work for a while."""
    with _guard:
        if (house := _houses.get(study)) is None:
            house = _houses[study] = _House(Processes(Guest, parcel, place=place))
        if house.timer is not None:
            house.timer.cancel()
        house.batches += 1
    try:
        yield house.processes
    finally:
        with _guard:
            house.batches -= 1
            if not house.batches:
                house.timer = threading.Timer(_IDLE, _close, (study,))
                house.timer.daemon = True
                house.timer.start()


def _close(study: str) -> None:
    with _guard:
        if (house := _houses.get(study)) is None or house.batches:
            return  # work has just come
        del _houses[study]
    house.processes.end()
