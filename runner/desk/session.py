"""The texts that somebody has open, and what is known of them: only what has changed is read again."""

from __future__ import annotations

from pathlib import Path

from .knowledge import Knowledge
from .reading import read


class Session:
    """Open texts by their resolved paths."""

    def __init__(self, types: tuple[type, ...] = ()) -> None:
        self.types = types
        self.texts: dict[Path, str] = {}
        self.known: dict[Path, Knowledge] = {}  # perhaps of texts that have changed since
        self._current = set[Path]()

    def change(self, path: Path, text: str | None) -> list[Path]:
        """Open a text, change it, or close it (None); the open files to which that makes a difference."""
        path = path.resolve()
        if text is None:
            self.texts.pop(path, None)
            self.known.pop(path, None)
            self._current.discard(path)
        else:
            self.texts[path] = text
        stale = {path, *(each for each in self._current if path in _files(self.known[each]))}
        self._current -= stale
        return [each for each in stale if each in self.texts]

    def knowledge(self, path: Path) -> Knowledge:
        """What is known of an open file, or of one on disk."""
        path = path.resolve()
        if path not in self._current:
            before = self.known[path].reading if path in self.known else None
            self.known[path] = Knowledge(read(path, self.texts, self.types, before=before))
            self._current.add(path)
        return self.known[path]

    def around(self, path: Path) -> Knowledge:
        """What is known of a file, as part of an open model that includes it, if there is one."""
        path = path.resolve()
        for each in self.texts:
            if each != path and path in _files(known := self.knowledge(each)):
                return Knowledge(known.reading, path)
        return self.knowledge(path)


def _files(known: Knowledge) -> set[Path]:
    return {path.resolve() for path, _ in known.reading.files.values()} | {known.reading.path.resolve()}
