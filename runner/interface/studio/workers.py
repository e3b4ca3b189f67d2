"""Processes that answer questions: started when needed, replaced when they die or take too long."""

from __future__ import annotations

import asyncio
import itertools
import json
import sys
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from typing import Any

Message = dict[str, Any]
Tell = Callable[[Message], Awaitable[None]]
LONGEST = 64 << 20  # bytes of an answer
START = 60.0  # s that a process may take until it listens


class Workers:
    """One process at a time; of the questions that wait, only the latest of each kind is asked.

    With ``stops``, a question ends the one that is being answered.
    """

    def __init__(self, name: str, arguments: Sequence[str], patience: float, *, stops: bool = False) -> None:
        self.name = name
        self.arguments = [*arguments]
        self.patience = patience  # s
        self.stops = stops
        self._numbers = itertools.count()
        self._process: asyncio.subprocess.Process | None = None
        self._turn = asyncio.Lock()
        self._latest: dict[str, int] = {}

    async def ask(self, question: Message, tell: Tell) -> Message:
        """The answer; what comes before it goes to ``tell``.  A process that fails gives an answer that says so."""
        number = next(self._numbers)
        kind = str(question["ask"])
        self._latest[kind] = number
        if self.stops and self._process is not None:
            await self._send({"ask": "stop"})  # a run looks whether anything waits
        async with self._turn:
            if self._latest[kind] != number:
                return {"stale": True}
            try:
                await asyncio.wait_for(self._start(), START)
                return await asyncio.wait_for(self._answer(number, question, tell), self.patience)
            except TimeoutError:
                self.stop()
                return {"error": f"the {self.name} took longer than {self.patience:g} s, and was ended"}
            except (OSError, ValueError, EOFError):
                self.stop()
                return {"error": f"the {self.name} has died; it starts again with the next change"}

    async def _answer(self, number: int, question: Message, tell: Tell) -> Message:
        await self._send({**question, "id": number})
        assert self._process is not None
        assert self._process.stdout is not None
        while line := await self._process.stdout.readline():
            said: Message = json.loads(line)
            if said.pop("id") != number:
                continue  # of a question that nobody waits for
            if said.pop("done", False):
                return said
            await tell(said)
        raise EOFError

    async def _start(self) -> None:
        """Start the process, unless it runs; the time that it takes until it listens is not that of a question."""
        if self._process is not None and self._process.returncode is None:
            return
        self._process = await asyncio.create_subprocess_exec(
            sys.executable,
            "-m",
            "epicycle.runner.interface.studio.worker",
            *self.arguments,
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            limit=LONGEST,
        )
        assert self._process.stdout is not None
        if not await self._process.stdout.readline():
            raise EOFError

    async def _send(self, question: Message) -> None:
        assert self._process is not None
        assert self._process.stdin is not None
        with suppress(ConnectionError):
            self._process.stdin.write(json.dumps(question).encode() + b"\n")
            await self._process.stdin.drain()

    def stop(self) -> None:
        """End the process; the next question starts another one."""
        if self._process is not None and self._process.returncode is None:
            with suppress(ProcessLookupError):
                self._process.kill()
        self._process = None
