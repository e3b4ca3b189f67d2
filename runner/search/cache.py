"""What has been tried: a file that grows by a line for each try, so that a search that was killed continues."""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from epicycle.actors import counted, read_regular

from ..model.build.model import Model
from ..study.provenance import version_of
from ..study.run.manifest import checksum
from ..support.files import replace_file
from ..support.shapes import fits

_LOGGER = logging.getLogger("epicycle")
NUMBER = (int, float)


class EvaluationCache:
    """Outcomes by a text that says what was tried; ``about`` is what they depend on besides the model.

    They are kept in a file of the ``folder`` whose name depends on all that the outcomes depend on; without a folder,
    in memory alone.  Of a model that a program made or changed, nobody can say whether it is the same: then everything
    is tried again.  ``shape`` is that of an outcome.
    """

    def __init__(self, model: Model, about: Mapping[str, Any], shape: Any, folder: Path | None = None) -> None:
        self._known: dict[str, Any] = {}
        self._path: Path | None = None
        if folder is None:
            return
        made_of = None if model.origin is None else model.origin.facts()
        self._head = json.dumps({**about, "epicycle": version_of("epicycle"), "model": made_of}, sort_keys=True)
        self._path = folder / f"tried-{checksum(self._head.encode())[:12]}.jsonl"
        if made_of is not None:
            self._read(self._path, shape)
        folder.mkdir(parents=True, exist_ok=True)
        whole = [self._head, *(self._line(key, outcome) for key, outcome in self._known.items())]
        replace_file(self._path, "\n".join(whole) + "\n")

    def _read(self, path: Path, shape: Any) -> None:
        """Take what is known from the file; what was not written like this is tried again."""
        try:
            lines = read_regular(path).decode("utf-8", errors="replace").split("\n")
        except FileNotFoundError:
            return
        if lines[0] != self._head:
            _LOGGER.warning("%s is damaged: everything is tried again", path)
            return
        damaged = 0
        for line in lines[1:-1]:  # what follows the last end of a line is of a process that was killed
            try:
                key, outcome, check = json.loads(line)
                is_whole = isinstance(key, str) and fits(outcome, shape) and check == self._check(key, outcome)
            except (ValueError, TypeError, RecursionError):
                is_whole = False
            if is_whole:
                self._known[key] = outcome
            else:
                damaged += 1
        if damaged:
            _LOGGER.warning("%s has %s: what they told is tried again", path, counted(damaged, "damaged line"))

    def _line(self, key: str, outcome: Any) -> str:
        return json.dumps([key, outcome, self._check(key, outcome)])

    def _check(self, key: str, outcome: Any) -> str:
        return checksum(json.dumps([self._head, key, outcome]).encode())

    def __contains__(self, key: str) -> bool:
        return key in self._known

    def outcome(self, key: str, found: Callable[[], Any]) -> Any:
        """What came of a try, which is made if it is not known."""
        if key not in self._known:
            self._known[key] = outcome = found()
            if self._path is not None:
                with self._path.open("a", encoding="utf-8") as file:
                    file.write(self._line(key, outcome) + "\n")
        return self._known[key]
