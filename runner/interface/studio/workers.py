"""Processes that answer questions: started when needed, replaced when they die or take too long."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from functools import partial
from typing import Any

from epicycle.actors import EpicycleError

from ...support.apart import DEAD, DONE, LATE, Outcome, Process

Message = dict[str, Any]
Tell = Callable[[Message], Coroutine[Any, Any, None]]
START = 60.0  # s that a process may take until it listens


class Workers:
    """One process at a time, in which ``make`` makes what answers; of the questions that wait, only the latest of each
    kind is asked.

    With ``stops``, a question ends the one that is being answered.
    """

    def __init__(self, name: str, patience: float, make: Callable[[], Any], *, stops: bool = False) -> None:
        self.name = name
        self.patience = patience  # s
        self.stops = stops
        self._make = partial(Process, make)
        self._process: Process | None = None
        self._turn = asyncio.Lock()
        self._latest: dict[str, Message] = {}

    async def ask(self, question: Message, tell: Tell) -> Message:
        """The answer; what comes before it goes to ``tell``.  A process that fails gives an answer that says so."""
        self._latest[str(question["ask"])] = question
        if self.stops and self._process is not None:
            self._process.hasten()
        # The turn ends with the answer, even if nobody waits for it any longer.
        return await asyncio.shield(asyncio.create_task(self._in_turn(question, tell)))

    async def _in_turn(self, question: Message, tell: Tell) -> Message:
        loop = asyncio.get_running_loop()
        async with self._turn:
            if self._latest.get(str(question["ask"])) is not question:
                return {"stale": True}
            what, found = await asyncio.to_thread(
                self._outcome, question, lambda said: asyncio.run_coroutine_threadsafe(tell(said), loop)
            )
        if what == DONE:
            answer: Message = found
            return answer
        self.stop()
        if what == LATE:
            return {"error": f"the {self.name} took longer than {self.patience:g} s, and was ended"}
        return {"error": f"the {self.name} has died; it starts again with the next change"}

    def _outcome(self, question: Message, told: Callable[[Message], object]) -> Outcome:
        """What comes of a question to the process, which is started unless it runs."""
        if self._process is None or self._process.is_over:
            self._process = self._make()
        try:
            outcome = self._process.begin(START)
            if outcome[0] == DONE:
                outcome = self._process.call("answer", question, limit=self.patience, told=told)
        except EpicycleError:
            return DEAD, None
        return outcome

    def close(self) -> None:
        """End the process; nothing is asked any more."""
        self._latest.clear()
        self.stop()

    def stop(self) -> None:
        """End the process; the next question starts another one."""
        if self._process is not None:
            self._process.end()
        self._process = None
