"""What a loaded model was made from, so that what was computed with it is not taken for what another one gives."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from epicycle.actors import read_regular

from ..catalogue import files_of_types
from ..language import Setting
from ..text import Noted, plain


@dataclass(frozen=True)
class Origin:
    """The files that were read, the settings, the changes of aspects, and the caller's own types."""

    noted: Noted
    settings: Sequence[Setting]
    changes: Sequence[str]
    types: Sequence[type]

    def facts(self) -> dict[str, Any]:
        """Everything that a run depends on beside its seed and Epicycle, as plain data without names of folders."""
        code = {str(path): _digest(read_regular(path)) for path in files_of_types(self.types)}
        return {
            "files": sorted(_by_name([*self.noted.files.items(), *code.items()])),
            "packages": sorted(self.noted.packages.items()),
            "settings": [[each.path, plain(each.node)] for each in self.settings],
            "changes": list(self.changes),
            "types": sorted(f"{each.__module__}.{each.__qualname__}" for each in self.types),
        }


def _by_name(files: Iterable[tuple[str, str]]) -> set[tuple[str, str]]:
    return {(name.replace("\\", "/").rpartition("/")[2], digest) for name, digest in files}


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
