"""The YAML files of Epicycle: models, disturbances to add to them, and studies of them."""

from __future__ import annotations

from functools import partial
from importlib import import_module
from pathlib import Path

from epicycle.actors import did_you_mean, irregular

from ..text.problems import Position, Problems


def model_folders() -> list[Path]:
    """The folders of packaged models."""
    return [Path(entry) for entry in import_module("epicycle.models").__path__]


def packaged_files(kind: str) -> dict[str, Path]:
    """The packaged models, disturbances or studies by name; ``kind`` is the singular."""
    folders = [folder / _FOLDERS[kind] for folder in model_folders()]
    return {path.stem: path for folder in folders for path in sorted(folder.glob("*.yaml"))}


_FOLDERS = {"model": "", "disturbance": "disturbances", "study": "studies"}
packaged_models = partial(packaged_files, "model")
packaged_disturbances = partial(packaged_files, "disturbance")
packaged_studies = partial(packaged_files, "study")


def is_path(name: str) -> bool:
    """Whether the name of a model, disturbance or study is a path, not the name of a packaged one."""
    return name.endswith((".yaml", ".yml")) or "/" in name or "\\" in name


def unreadable(path: Path | None) -> str | None:
    """Why a file cannot be read, such as ``is a folder, not a file``; empty if it can be, None if there is none."""
    if path is None:
        return None
    try:
        kind = irregular(path)
    except (FileNotFoundError, NotADirectoryError):
        return None
    except (OSError, ValueError) as error:  # endless links, too long a name, a NUL in it
        return f"cannot be read: {getattr(error, 'strerror', None) or error}"
    return f"is {kind}" if kind else ""


def packaged_ones(kind: str) -> str:
    """What could be named instead of a model, disturbance or study that does not exist."""
    kinds = "studies" if kind == "study" else f"{kind}s"
    return f"packaged {kinds}: {', '.join(packaged_files(kind)) or 'none'}; a path to a file ends in .yaml"


def find(name: str, kind: str, problems: Problems, position: Position | None = None) -> Path | None:
    """The file that a name means: a path if it looks like one, otherwise the packaged file with that name."""
    if is_path(name):
        return Path(name)
    known = packaged_files(kind)
    if name not in known:
        problems.add(
            f"there is no packaged {kind} {name!r}{did_you_mean(name, list(known))}", position, packaged_ones(kind)
        )
    return known.get(name)
