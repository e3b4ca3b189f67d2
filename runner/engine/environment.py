"""The environment: SimPy's part of a run."""

from __future__ import annotations

from typing import Any

import simpy


class Environment(simpy.Environment):
    """SimPy's part of a run: time, and the events of processes and resources.

    The director's own instants are no SimPy events: it would make and handle one for each, for a tenth of the time of
    a run, only to be told what it knows.
    """

    @property
    def queue(self) -> list[Any]:
        """SimPy's own events, of which the first is the next one; its time need not be whole."""
        return self._queue
