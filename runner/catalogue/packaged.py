"""What comes with Epicycle in YAML: models, disturbances to be added to them, and studies of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from importlib import import_module
from pathlib import Path

from epicycle.actors import irregular

from ..text import Problems, did_you_mean


def model_folders() -> list[Path]:
    """The folders of packaged models.

    A namespace package's ``__path__`` is read, because ``importlib.resources`` fails on it in an editable install.
    """
    package = import_module("epicycle.models")
    return [Path(entry) for entry in package.__path__ if Path(entry).is_dir()]


def packaged_models() -> dict[str, Path]:
    return _yaml_files(model_folders())


def packaged_disturbances() -> dict[str, Path]:
    return _yaml_files([folder / "disturbances" for folder in model_folders()])


def packaged_studies() -> dict[str, Path]:
    return _yaml_files([folder / "studies" for folder in model_folders()])


def _yaml_files(folders: list[Path]) -> dict[str, Path]:
    return {path.stem: path for folder in folders for path in sorted(folder.glob("*.yaml"))}


def is_path(name: str) -> bool:
    """Whether the name of a model, disturbance or study is a path, and not that of a packaged one."""
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


def packaged_ones(kind: str, packaged: Iterable[str]) -> str:
    """What could be named in place of a model, disturbance or study that there is not."""
    kinds = "studies" if kind == "study" else f"{kind}s"
    return f"packaged {kinds}: {', '.join(packaged) or 'none'}; a path to a file ends in .yaml"


def find(name: str, kind: str, packaged_files: Callable[[], dict[str, Path]], problems: Problems) -> Path | None:
    """The file that a name means: a path if it looks like one, otherwise what is packaged under it."""
    if is_path(name):
        return Path(name)
    packaged = packaged_files()
    if name not in packaged:
        problems.add(
            f"there is no packaged {kind} {name!r}{did_you_mean(name, list(packaged))}",
            None,
            packaged_ones(kind, packaged),
        )
    return packaged.get(name)
