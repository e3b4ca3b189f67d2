"""What every search answers with: a sentence for people, facts for programs, and files."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any, ClassVar

from epicycle.actors import EpicycleError

from ..study.judge.study_results import StudyResults, open_study
from ..study.provenance import version_of
from ..support.shown import finite, listed
from ..support.tables import Tabled

__all__ = ["Answer", "StudyAnswer", "listed"]


class Answer(Tabled):
    """What a search found; ``NAME`` is that of its file of facts."""

    NAME: ClassVar[str]
    folder: Path | None = None  # where its runs are noted

    @property
    def sentence(self) -> str:
        """What came of the search, in words."""
        return " ".join(self._sentences())

    def _sentences(self) -> Iterable[str]:
        raise NotImplementedError

    def facts(self) -> dict[str, Any]:
        """Everything that was found, for programs."""
        found: dict[str, Any] = finite(self._facts())
        return {**found, "sentence": self.sentence, "version": version_of("epicycle")}

    def _facts(self) -> dict[str, Any]:
        raise NotImplementedError

    def save(self, folder: str | Path | None = None) -> list[Path]:
        """Write the facts as JSON, by default to the folder of its runs; the files."""
        path = self.place(folder) / f"{self.NAME}.json"
        path.write_text(json.dumps(self.facts(), indent=2) + "\n", encoding="utf-8")
        return [path]

    def place(self, folder: str | Path | None) -> Path:
        """The folder to write to, which is made if it is not there."""
        if (found := self.folder if folder is None else Path(folder)) is None:
            raise EpicycleError("there is no folder to save it in: name one")
        found.mkdir(parents=True, exist_ok=True)
        return found

    def _caption(self) -> str:
        return self.sentence


class StudyAnswer(Answer):
    """One whose runs are in its folder, as those of a study are."""

    @property
    def results(self) -> StudyResults:
        """All runs, by what was set."""
        assert self.folder is not None
        return open_study(self.folder)

    def save(self, folder: str | Path | None = None) -> list[Path]:
        """Write the facts as JSON; the table of the runs is there."""
        return [self.results.path, *super().save(folder)]
