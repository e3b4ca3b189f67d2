"""With this folder on PYTHONPATH, and EPICYCLE_CORE=python, logs are digested in their form up to version 0.1."""

from __future__ import annotations

import hashlib
from typing import Any

from epicycle.runner.results import canonical, log


class OldForm:
    """Each record: time and microstep, its names, its value."""

    def __init__(self) -> None:
        self.count = self.at_tag = 0
        self._tag: Any = None
        self._hash = hashlib.sha256()

    def add(self, *record: Any) -> bytes:
        """Append a record, given by names, tag and value."""
        names, when, value = record[-3:]
        tag = (when.time, when.microstep)
        self._hash.update(canonical(tag[0]) + canonical(tag[1]) + names + canonical(value))
        self.count += 1
        self.at_tag = self.at_tag + 1 if tag == self._tag else 1
        self._tag = tag
        return b""

    def hexdigest(self) -> str:
        """The digest so far."""
        return self._hash.hexdigest()


log.RecordHash = OldForm  # type: ignore[misc, assignment]
