"""What has been tried: a file that grows by a line for each try, so that a search that was killed continues."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from epicycle.actors import read_regular


class Tried:
    """Outcomes by a text that says what was tried; ``about`` is what they all depend on.

    They are kept in a file of the ``folder`` whose name depends on ``about``; without a folder, in memory alone.
    """

    def __init__(self, about: Mapping[str, Any], folder: Path | None = None) -> None:
        self._known: dict[str, Any] = {}
        self._path: Path | None = None
        if folder is None:
            return
        head = json.dumps(about, sort_keys=True)
        self._path = folder / f"tried-{hashlib.sha256(head.encode()).hexdigest()[:12]}.jsonl"
        try:
            lines = read_regular(self._path).decode("utf-8", errors="replace").split("\n")
        except FileNotFoundError:
            lines = []
        for line in lines[1:-1] if lines and lines[0] == head else []:
            try:
                key, outcome = json.loads(line)
            except (ValueError, TypeError):  # of a process that was killed while it wrote
                break
            self._known[key] = outcome
        folder.mkdir(parents=True, exist_ok=True)
        aside = self._path.with_name(f".{self._path.name}")
        whole = [head, *(json.dumps(each) for each in self._known.items())]
        aside.write_text("\n".join(whole) + "\n", encoding="utf-8")
        os.replace(aside, self._path)

    def outcome(self, key: str, found: Callable[[], Any]) -> Any:
        """What came of a try, which is made if it is not known."""
        if key not in self._known:
            self._known[key] = outcome = found()
            if self._path is not None:
                with self._path.open("a", encoding="utf-8") as file:
                    file.write(json.dumps([key, outcome]) + "\n")
        return self._known[key]
