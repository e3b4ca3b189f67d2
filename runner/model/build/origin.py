"""What a loaded model was made from, so that what was computed with it is not taken for what another one gives."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..catalogue.code import code_of
from ..language.settings import Setting
from ..text.document import plain
from ..text.files import Noted


@dataclass(frozen=True)
class Origin:
    """The files that were read, the settings, the changes of aspects, and the caller's own types."""

    noted: Noted
    settings: Sequence[Setting]
    changes: Sequence[str]
    types: Sequence[type]
    spec: Any = None  # how it was named, if that is known
    state: Any = None  # what a program might have set since

    def facts(self) -> dict[str, Any]:
        """Everything that a run depends on beside its seed and Epicycle, as plain data without names of folders."""
        modules = dict.fromkeys(
            each.__module__ for each in self.types if each.__module__.partition(".")[0] != "epicycle"
        )
        files = (getattr(sys.modules.get(name), "__file__", None) for name in modules)
        code = code_of(Path(file) for file in files if file is not None)
        return {
            "files": sorted(_by_name([*self.noted.files.items(), *code.items()])),
            "packages": sorted(self.noted.packages.items()),
            "settings": [[each.path, plain(each.node)] for each in self.settings],
            "changes": list(self.changes),
            "types": sorted(f"{each.__module__}.{each.__qualname__}" for each in self.types),
        }


def _by_name(files: Iterable[tuple[str, str]]) -> set[tuple[str, str]]:
    return {(name.replace("\\", "/").rpartition("/")[2], digest) for name, digest in files}
