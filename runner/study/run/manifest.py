"""The manifest of a study's results folder: its contents, and how we know that they are intact."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from epicycle.actors import EpicycleError, read_regular

from ...model.language.study import MAX_REPLICATIONS, MAX_STUDY_SEED
from ...support.shapes import fits

if TYPE_CHECKING:
    import pyarrow as pa

FORMAT = 4
OF_SESSION = ("versions", "machine", "git", "date", "checksum")  # entries that do not say what the study is


class StoreError(EpicycleError):
    """A results folder that cannot be used."""


class DamagedError(StoreError):
    """A file of a results folder that no longer holds what was written."""


# The entries from which a plan is restored, and their shapes.
_KINDS = frozenset({"bool", "int", "float", "text"})
_COLUMN = {"unit": str, "doc": str}
_COLUMNS = ({**_COLUMN, "label": str, "is_share": bool}, {**_COLUMN, "label": str}, _COLUMN)
_SHAPE: dict[str, Any] = {
    "epicycle": str,
    "study": str,
    "file": str,
    "text": str,
    "set": [str],
    "types": [str],
    "replications": range(1, MAX_REPLICATIONS + 1),
    "seed": range(MAX_STUDY_SEED + 1),
    "lender": (None, [str, str]),
    "factors": {str: _KINDS},
    "metrics": {str: str},
    "columns": {str: _COLUMNS},
    "model": {str: str},
    "sources": {str: str},
    "level_sources": [{str: {str: str}}],
    "versions": {str: (None, str)},
    "machine": {str: (None, str, int)},
    "git": (None, str),
    "date": str,
}
# Entries that not every folder has.
_MORE: dict[str, Any] = {
    "search": {"runs": range(1, MAX_REPLICATIONS + 1), "command": [str]},
    "changed": {"aspects": [str], "without": [str], "stop": (None, int, float)},
    "code": {str: str},
    "seal": (None, str),
}


def columns_of_rows(factors: Mapping[str, str], metrics: Iterable[str]) -> dict[str, str]:
    """The columns of a row, and their types."""
    return {
        **{"run": "text", "condition": "text", "replication": "int"},
        **factors,
        **{"seed": "int", "status": "text"},
        **dict.fromkeys(metrics, "float"),
        **{"events": "int", "digest": "text", "error": "text", "wall_time": "float"},
    }


def schema_of(manifest: Mapping[str, Any]) -> pa.Schema:
    """The columns of a part."""
    import pyarrow as pa

    kinds = {"bool": pa.bool_(), "int": pa.int64(), "float": pa.float64(), "text": pa.string()}
    columns = columns_of_rows(manifest["factors"], manifest["metrics"])
    return pa.schema([(name, kinds[kind]) for name, kind in columns.items()])


def checksum(data: bytes) -> str:
    """Identifies bytes; it misses one in 2^64 kinds of damage."""
    return hashlib.sha256(data).hexdigest()[:16]


def manifest_text(manifest: Mapping[str, Any]) -> str:
    """The contents of ``manifest.json``."""
    return json.dumps({**manifest, "checksum": _checksum_of(manifest)}, indent=1) + "\n"


def _checksum_of(manifest: Mapping[str, Any]) -> str:
    return checksum(json.dumps({**manifest, "checksum": ""}, sort_keys=True).encode())


def read_manifest(folder: Path) -> dict[str, Any]:
    """The manifest of a results folder; raises ``StoreError``, and ``DamagedError`` for what we did not write."""
    path = folder / "manifest.json"

    def damaged(what: object) -> DamagedError:
        told = f"'epicycle study STUDY --out {folder}' rewrites it and keeps the existing runs"
        return DamagedError(f"{path} {what}\n   help: {told}")

    if not folder.is_dir():
        raise StoreError(f"there is no folder {folder}")
    try:
        manifest = json.loads(read_regular(path))
    except FileNotFoundError:
        raise StoreError(f"{folder} holds no results of a study: it has no manifest.json") from None
    except OSError as error:
        raise damaged(f"cannot be read: {error.strerror}") from error
    except RecursionError as error:
        raise damaged("is damaged: it is nested too deep") from error
    except ValueError as error:
        raise damaged(f"is damaged: {error}") from error
    if not isinstance(manifest, dict) or not manifest.keys() & {"level_sources", "checksum"}:
        raise StoreError(f"{folder} holds other results, not those of a study")
    if "checksum" in manifest and manifest["checksum"] != _checksum_of(manifest):
        raise damaged("is damaged: it does not match its checksum")
    if (found := manifest.get("format")) != FORMAT:
        raise StoreError(
            f"{folder} has format {found}, but this Epicycle reads format {FORMAT}\n"
            f"   help: pandas can read its table.parquet; to continue, repeat its runs in another folder"
        )
    if missing := [repr(name) for name in (*_SHAPE, "checksum") if name not in manifest]:
        raise damaged(f"is damaged: it has no {', '.join(missing)}")
    shapes = _SHAPE | {name: shape for name, shape in _MORE.items() if name in manifest}
    if unlike := [repr(name) for name, shape in shapes.items() if not fits(manifest[name], shape)]:
        raise damaged(f"is damaged: {', '.join(unlike)} cannot have been written like this")
    return manifest
