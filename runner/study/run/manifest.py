"""The manifest of a study's results folder: what it holds, and how we know that it is what was written."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from epicycle.actors import EpicycleError, read_regular

from ...language import MAX_REPLICATIONS, MAX_STUDY_SEED

if TYPE_CHECKING:
    import pyarrow as pa

FORMAT = 4


class StoreError(EpicycleError):
    """A results folder that cannot be used."""


class DamagedError(StoreError):
    """A file of a results folder that does not hold any more what was written."""


# What a plan is made of again, and how it looks: a type, some of the values, a list or mapping of these (of two of the
# same, if there are two), a record, or (in a tuple) one of several.
_KINDS = frozenset({"bool", "int", "float", "text"})
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
    "columns": {str: {"unit": str, "doc": str}},
    "model": {str: str},
    "sources": {str: str},
    "level_sources": [{str: {str: str}}],
    "versions": {str: (None, str)},
    "machine": {str: (None, str, int)},
    "git": (None, str),
    "date": str,
}


def _fits(value: Any, shape: Any) -> bool:
    if isinstance(shape, tuple):
        return any(_fits(value, each) for each in shape)
    if isinstance(shape, list):
        if not isinstance(value, list) or (len(shape) > 1 and len(value) != len(shape)):
            return False
        return all(_fits(each, shape[0]) for each in value)
    if isinstance(shape, dict):
        if not isinstance(value, dict) or (str not in shape and value.keys() != shape.keys()):
            return False
        return all(_fits(each, shape.get(str) or shape[name]) for name, each in value.items())
    if isinstance(shape, range):
        return type(value) is int and value in shape  # of anything else it would ask every number
    if isinstance(shape, frozenset):
        return type(value) is str and value in shape
    return value is None if shape is None else type(value) is shape


def columns_of_rows(factors: Mapping[str, str], metrics: Iterable[str]) -> dict[str, str]:
    """The columns of a row, and what they hold."""
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
    """By which bytes are known again; of 2^64 kinds of damage one stays unseen."""
    return hashlib.sha256(data).hexdigest()[:16]


def manifest_text(manifest: Mapping[str, Any]) -> str:
    """The contents of ``manifest.json``."""
    return json.dumps({**manifest, "checksum": _checksum_of(manifest)}, indent=1) + "\n"


def _checksum_of(manifest: Mapping[str, Any]) -> str:
    return checksum(json.dumps({**manifest, "checksum": ""}, sort_keys=True).encode())


def read_manifest(folder: Path) -> dict[str, Any]:
    """What a results folder says of itself; raises ``StoreError``, and ``DamagedError`` for what we did not write."""
    path = folder / "manifest.json"
    if not folder.is_dir():
        raise StoreError(f"there is no folder {folder}")
    try:
        manifest = json.loads(read_regular(path))
    except FileNotFoundError:
        raise StoreError(f"{folder} holds no results of a study: it has no manifest.json") from None
    except OSError as error:
        raise DamagedError(f"{path} cannot be read: {error.strerror}{_help(folder)}") from error
    except (ValueError, RecursionError) as error:
        reason = "it is nested too deep" if isinstance(error, RecursionError) else error
        raise DamagedError(f"{path} is damaged: {reason}{_help(folder)}") from error
    if not isinstance(manifest, dict) or not manifest.keys() & {"level_sources", "checksum"}:
        raise StoreError(f"{folder} holds other results, not those of a study")
    if "checksum" in manifest and manifest["checksum"] != _checksum_of(manifest):
        raise DamagedError(f"{path} is damaged: it is not what was written{_help(folder)}")
    if (found := manifest.get("format")) != FORMAT:
        raise StoreError(
            f"{folder} has format {found}, this Epicycle reads format {FORMAT}\n"
            f"   help: its table.parquet can be read with pandas; make its runs anew in another folder"
        )
    if missing := [name for name in (*_SHAPE, "checksum") if name not in manifest]:
        raise DamagedError(f"{path} is damaged: it has no {', '.join(map(repr, missing))}{_help(folder)}")
    if unlike := [name for name, shape in _SHAPE.items() if not _fits(manifest[name], shape)]:
        found = ", ".join(map(repr, unlike))
        raise DamagedError(f"{path} is damaged: {found} cannot be what was written{_help(folder)}")
    return manifest


def _help(folder: Path) -> str:
    return f"\n   help: 'epicycle study STUDY --out {folder}' writes it anew, and keeps the runs that are there"
