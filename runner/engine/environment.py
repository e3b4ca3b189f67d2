"""The environment: SimPy's part of a run."""

from __future__ import annotations

from typing import Any

import simpy


class Environment(simpy.Environment):
    """SimPy's part of a run: time, and the events of processes and resources.

    The director's own instants are not SimPy events: these would take a tenth of the time of a run, and tell the
    director only what it knows.
    """

    @property
    def queue(self) -> list[Any]:
        """SimPy's own events, the next one first; its time need not be whole."""
        return self._queue
