"""Runs on the machines of a Dask cluster; their rows come back and are written here."""

from __future__ import annotations

import asyncio
import json
import logging
import time
from collections.abc import AsyncIterator, Callable
from concurrent.futures import CancelledError
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import astuple
from operator import call
from pkgutil import resolve_name
from typing import Any

from epicycle.actors import EpicycleError

from ...support.apart import DONE, Outcome, WorkerError
from .backlog import Task
from .making import Recorder
from .parcel import SENT, ParcelOnWorker, pack

CONNECT = 10.0  # s for a scheduler to answer
PATIENCE = 60.0  # s without any worker
_ANSWER = 30.0  # s for a busy scheduler to answer
_LOOK = 0.5  # s between two checks
_BATCH = 0.5  # s that a batch of runs should take: enough time to bring the next
_LARGEST = 100  # runs of a batch


def distributed_module() -> Any:
    """Dask's scheduler and workers; raises ``EpicycleError`` if they are not installed."""
    try:
        import dask

        # Its log is set up on import. What a user needs to know comes as an exception.
        with dask.config.set({"logging": {"distributed": "critical", "distributed.client": "critical"}}):
            import distributed
    except ImportError as error:
        raise EpicycleError("this needs dask: pip install 'epicycle[dask]'") from error
    return distributed


class Cluster:
    """The workers of a Dask scheduler.

    Without an address, it starts a scheduler on this machine, with ``jobs`` processes at a time.
    """

    def __init__(self, recorder: Recorder, jobs: int, scheduler: str | None) -> None:
        self._distributed = distributed_module()
        self._recorder = recorder
        self._backlog = recorder.backlog
        self._jobs = jobs
        self._scheduler = scheduler
        self._parcel: Any = None  # a future: Dask brings it to the workers, and makes it again if it is lost
        self._checked: set[str] = set()  # workers
        self._running: dict[asyncio.Future[list[Outcome]], list[Task]] = {}
        self._wanted = 1  # batches submitted at a time
        self._seconds = _BATCH  # estimated s of a run
        self._looked = 0.0
        self._seen = time.monotonic()  # when there were last workers

    def run(self, tell: Callable[[], None]) -> None:
        """Make all runs; ``tell`` is called now and then.  Raises ``WriteError`` and ``WorkerError``."""
        if (first := self._batch()) is not None:
            asyncio.run(self._run(first, tell))

    async def _run(self, first: list[Task], tell: Callable[[], None]) -> None:
        async with self._client() as client:
            try:
                await self._look(client)
                kind = client.submit(resolve_name, _name(ParcelOnWorker), pure=False)
                self._parcel = client.submit(call, kind, pack(self._backlog.plan), pure=False)
                self._begin(client, first)
                self._fill(client)
                while self._running:
                    over, _ = await asyncio.wait(self._running, timeout=_LOOK, return_when=asyncio.FIRST_COMPLETED)
                    for each in over:
                        self._end(each, self._running.pop(each))
                    self._fill(client)
                    await self._look(client)
                    tell()
            finally:
                for each in self._running:
                    each.cancel()

    # -- the cluster ----------------------------------------------------------------------------------------------

    @asynccontextmanager
    async def _client(self) -> AsyncIterator[Any]:
        module, scheduler = self._distributed, self._scheduler
        async with AsyncExitStack() as stack:
            if scheduler is None:
                # In this process: runs have their own processes, wherever Dask's worker is.
                local = module.LocalCluster(
                    processes=False,
                    n_workers=1,
                    threads_per_worker=self._jobs,
                    memory_limit=0,
                    dashboard_address="127.0.0.1:0",
                    scheduler_kwargs={"dashboard": False},
                    silence_logs=logging.CRITICAL,
                    asynchronous=True,
                )
                scheduler = await stack.enter_async_context(local)
            client = module.Client(scheduler, timeout=CONNECT, asynchronous=True, set_as_default=False)
            stack.push_async_callback(client.close)
            try:
                await asyncio.wait_for(client, CONNECT + 1.0)
            except (OSError, ValueError) as error:
                raise WorkerError(
                    f"no scheduler answers at {self._scheduler}\n"
                    "   help: 'dask scheduler' starts one and prints its address"
                ) from error
            yield client

    async def _look(self, client: Any) -> None:
        """Check the workers now and then; raises ``WorkerError`` if one cannot work, or there are none for long."""
        now = time.monotonic()
        if now - self._looked < _LOOK:
            return
        self._looked = now
        threads: dict[str, int] = await self._asked(client.nthreads())
        if new := sorted(threads.keys() - self._checked):
            await self._check(client, new)
        self._checked = {*threads}
        # More than the workers take: the rest waits at the scheduler for the first free worker.
        self._wanted = 2 * sum(threads.values()) + 4
        if threads:
            self._seen = time.monotonic()
        elif now - self._seen > PATIENCE:
            raise WorkerError(
                f"the scheduler {self._scheduler} has had no workers for {PATIENCE:g} s\n"
                f"   help: 'dask worker {self._scheduler}' starts one"
            )

    async def _check(self, client: Any, workers: list[str]) -> None:
        """Raise ``WorkerError`` if a new worker does not know parcels, which say the rest."""
        question = client.run(resolve_name, _name(ParcelOnWorker), workers=workers, on_error="return")
        for address, there in (await self._asked(question)).items():
            if isinstance(there, ImportError | AttributeError):
                raise WorkerError(f"the Dask worker {address} {_without(there)}")

    async def _asked(self, question: Any) -> Any:
        """The scheduler's answer; raises ``WorkerError`` if there is none."""
        try:
            return await asyncio.wait_for(question, _ANSWER)
        except Exception as error:  # many kinds, all for the same reason
            raise self._lost() from error

    def _lost(self) -> WorkerError:
        return WorkerError(
            f"the scheduler{'' if self._scheduler is None else f' {self._scheduler}'} no longer answers\n"
            f"   help: finished runs are kept; 'epicycle study {self._recorder.store.folder}' continues"
        )

    # -- runs -----------------------------------------------------------------------------------------------------

    def _batch(self) -> list[Task] | None:
        """The next runs; one that may have killed its process comes alone."""
        share = (self._backlog.total - self._backlog.over) // (2 * self._wanted)
        most = max(1, min(_LARGEST, int(_BATCH / self._seconds), share))
        batch: list[Task] = []
        while len(batch) < most and (task := self._backlog.next()) is not None:
            batch.append(task)
            if task.attempt > 1:
                break
        return batch or None

    def _fill(self, client: Any) -> None:
        """Submit as many batches as wanted."""
        while len(self._running) < self._wanted and (batch := self._batch()):
            self._begin(client, batch)

    def _begin(self, client: Any, batch: list[Task]) -> None:
        """Send a batch.  The scheduler sees only types of Python itself, so it need not have Epicycle."""
        given = {"timeout": self._recorder.timeout, "tasks": [astuple(each) for each in batch]}
        future = client.submit(call, self._parcel, json.dumps(given), pure=False)
        self._running[asyncio.ensure_future(future.result())] = batch

    def _end(self, over: asyncio.Future[list[Outcome]], batch: list[Task]) -> None:
        """A batch has finished, or has killed its workers."""
        try:
            outcomes = over.result()
        except self._distributed.KilledWorker:
            for task in batch:  # another run of the batch may be to blame: each is made alone now
                self._recorder.again(task, "the Dask workers that made it ended one after another")
            return
        except (CancelledError, asyncio.CancelledError, self._distributed.core.CommClosedError) as error:
            raise self._lost() from error
        except WorkerError:
            raise
        except (ImportError, AttributeError) as error:  # from a worker that has just joined
            raise WorkerError(f"a Dask worker {_without(error)}") from error
        except Exception as error:
            raise WorkerError(f"the Dask workers cannot make runs: {type(error).__name__}: {error}") from error
        for task, (what, told) in zip(batch, outcomes, strict=True):
            if what == DONE:
                told, why_not = told
                if why_not is not None and self._is_right_here(task):
                    raise WorkerError(
                        f"a Dask worker cannot load the model, although this machine can:\n{why_not}\n{SENT}"
                    )
                self._seconds += 0.2 * (told["wall_time"] - self._seconds)
            self._recorder.settle(task, (what, told))

    def _is_right_here(self, task: Task) -> bool:
        """Whether this machine can load the model of a run."""
        plan = self._backlog.plan
        try:
            plan.load(plan.condition(task.condition))
        except EpicycleError:
            return False
        return True


def _name(function: Callable[..., object]) -> str:
    """The name by which ``resolve_name`` finds a function."""
    return f"{function.__module__}:{function.__name__}"


def _without(error: Exception) -> str:
    return f"does not have this version of Epicycle: {error}\n   help: install it there"
