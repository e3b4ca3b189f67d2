"""Finding and reading the files of models, and those that they include."""

from __future__ import annotations

from pathlib import Path

from epicycle.actors import irregular

from ..catalogue import find, model_folders, packaged_models
from ..text import Mapping, Problems, did_you_mean, read
from .declarations import CompositeText, ModelText
from .models import DeclarationReader

MAX_INCLUDES = 200


def find_model(name: str, problems: Problems) -> Path | None:
    """The file of a model: a path if it looks like one, otherwise a packaged model's name."""
    return find(name, "model", packaged_models, problems)


def find_library(path: Path) -> Path:
    """The file of a library of composites: as given, or else among the packaged ones."""
    packaged = [folder / path for folder in model_folders()]
    return next((each for each in (path, *packaged) if each.is_file()), path)


def read_model(name: str, problems: Problems) -> tuple[ModelText, Path, DeclarationReader]:
    """The declarations of a model's file, which file that is, and what reads those of the files that it includes."""
    path = find_model(name, problems)
    if path is None:
        problems.raise_if_any()
        raise AssertionError("a model that is not found is a problem")
    node = read(path, problems)
    if node is None:
        problems.raise_if_any()
        raise AssertionError("a file that cannot be read is a problem")
    if isinstance(node, Mapping) and "study" in node.entries:
        problems.add(f"{name} is a study, not a model", None, f"run it: epicycle study {name}")
        problems.raise_if_any()
    if isinstance(node, Mapping) and "disturbance" in node.entries and "model" not in node.entries:
        problems.add(f"{name} is a disturbance, not a model", None, f"add it to a model: MODEL --disturb {name}")
        problems.raise_if_any()
    reader = DeclarationReader(problems)
    text = reader.model(node)
    if text is None:
        problems.raise_if_any()
        raise AssertionError("a model that is no mapping is a problem")
    return text, path, reader


def included_composites(
    text: ModelText, path: Path, reader: DeclarationReader, problems: Problems
) -> dict[str, CompositeText]:
    """The composite classes of a model and of all that it includes."""
    # Included files must lie in or below the model's folder: a model cannot make us read other files.
    root = path.parent.resolve()
    composites: dict[str, CompositeText] = {}
    seen: dict[Path, None] = {path.resolve(): None}
    waiting = [(text, path)]
    while waiting:
        current, where = waiting.pop(0)
        for name, composite in current.composites.items():
            if name in composites:
                first = composites[name].position
                problems.add(
                    f"composite {name!r} is defined twice",
                    composite.position,
                    f"the first definition is at {first.file}:{first.line}",
                )
            composites.setdefault(name, composite)
        for include in current.include:
            try:
                target = (where.parent / include.text).resolve()
                exists = target.is_file()
            except (OSError, RuntimeError, ValueError) as error:  # endless links, too long, or a NUL in it
                reason = getattr(error, "strerror", None) or error
                problems.add(f"{include.text!r} cannot be included: {reason}", include.position)
                continue
            if not target.is_relative_to(root) or target.suffix not in (".yaml", ".yml"):
                problems.add(
                    f"{include.text!r} cannot be included",
                    include.position,
                    "included files are .yaml files in or below the model's folder",
                )
                continue
            if target in seen:
                continue
            seen[target] = None
            if len(seen) > MAX_INCLUDES:
                problems.add(f"more than {MAX_INCLUDES} files are included", include.position)
                return composites
            if not exists:
                names = [str(path.relative_to(where.parent)) for path in _beside(target, where)]
                kind = f"does not exist{did_you_mean(include.text, names)}"
                if target.exists():
                    kind = f"is {irregular(target)}"
                problems.add(f"the included file {include.text!r} {kind}", include.position)
                continue
            node = read(target, problems, str(where.parent / include.text))
            inner = reader.included(node) if node is not None else None
            if inner is not None:
                waiting.append((inner, target))
    return composites


def _beside(target: Path, where: Path) -> list[Path]:
    """The YAML files of the folder in which an included file was to be."""
    folder = where.parent / target.parent.relative_to(where.parent.resolve())
    return sorted(folder.glob("*.yaml")) if folder.is_dir() else []
