"""The texts that somebody has open, and what is known of them: only what has changed is read again."""

from __future__ import annotations

from pathlib import Path

from .knowledge import Knowledge
from .reading import Reading, read


class Session:
    """Open texts by their resolved paths."""

    def __init__(self, types: tuple[type, ...] = ()) -> None:
        self.types = types
        self.texts: dict[Path, str] = {}
        self._known: dict[Path, Knowledge] = {}
        self.readings: dict[Path, Reading] = {}  # the latest ones, perhaps of texts that have changed since

    def change(self, path: Path, text: str | None) -> list[Path]:
        """Open a text, change it, or close it (None); the open files to which that makes a difference."""
        path = path.resolve()
        if text is None:
            self.texts.pop(path, None)
            self.readings.pop(path, None)
        else:
            self.texts[path] = text
        stale = [each for each, known in self._known.items() if path in _files(known)]
        for each in {path, *stale}:
            self._known.pop(each, None)
        return [each for each in dict.fromkeys((path, *stale)) if each in self.texts]

    def knowledge(self, path: Path) -> Knowledge:
        """What is known of an open file, or of one on disk."""
        path = path.resolve()
        if path not in self._known:
            before = self.readings.get(path)
            reading = self.readings[path] = read(path, self.texts, self.types, before=before)
            self._known[path] = Knowledge(reading)
        return self._known[path]

    def around(self, path: Path) -> Knowledge:
        """What is known of a file, as part of an open model that includes it, if there is one."""
        path = path.resolve()
        for each in self.texts:
            if each != path and path in _files(known := self.knowledge(each)):
                return Knowledge(known.reading, path)
        return self.knowledge(path)


def _files(known: Knowledge) -> set[Path]:
    return {path.resolve() for path, _ in known.reading.files.values()} | {known.reading.path.resolve()}
