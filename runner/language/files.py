"""Finding and reading model files and the files that they include."""

from __future__ import annotations

from pathlib import Path

from epicycle.actors import irregular

from ..catalogue import find, is_path, model_folders, packaged_files, packaged_ones, unreadable
from ..text import Mapping, Problems, Text, did_you_mean, read
from .models import CompositeText, ModelText, library_of, model_of

MAX_INCLUDES = 200


def named_file(said: Text, folder: Path, kind: str, problems: Problems, who: str = "") -> Path | None:
    """The file that a name in a file means: relative to its folder, or packaged; None, and a problem, if there is none.

    ``who`` begins the message.
    """
    known = packaged_files(kind)
    path = folder / said.text if is_path(said.text) else known.get(said.text)
    if (reason := unreadable(path)) == "":
        return path
    if reason is None:
        guess = did_you_mean(said.text, list(known))
        problems.add(f"{who}there is no {kind} {said.text!r}{guess}", said.position, packaged_ones(kind))
    else:
        problems.add(f"{who}the {kind} {said.text!r} {reason}", said.position)
    return None


def read_model(name: str, problems: Problems) -> tuple[ModelText, dict[str, CompositeText]]:
    """What a model's file declares, and the composite classes of it and of everything it includes."""
    path, text = find(name, "model", problems), None
    node = None if path is None else read(path, problems)
    if isinstance(node, Mapping) and "study" in node.entries:
        problems.add(f"{name} is a study, not a model", None, f"run it: epicycle study {name}")
    elif isinstance(node, Mapping) and "disturbance" in node.entries and "model" not in node.entries:
        problems.add(f"{name} is a disturbance, not a model", None, f"add it to a model: MODEL --disturb {name}")
    elif node is not None:
        text = model_of(node, problems)
    if path is None or not text:
        return problems.whole(None)
    return text, _composites(text, path, problems)


def read_library(file: str | Path, problems: Problems) -> dict[str, CompositeText]:
    """The composite classes of a file, at its path or among the packaged ones, and of everything it includes."""
    path = Path(file)
    candidates = (path, *(folder / path for folder in model_folders()))
    path = next((each for each in candidates if each.is_file()), path)
    node, text = read(path, problems), None
    if node is not None:
        is_model = isinstance(node, Mapping) and "model" in node.entries
        text = (model_of if is_model else library_of)(node, problems)
    return _composites(problems.whole(text), path, problems)


def _composites(text: ModelText, path: Path, problems: Problems) -> dict[str, CompositeText]:
    # Included files must lie in or below the model's folder: a model cannot read other files.
    root = path.parent.resolve()
    composites: dict[str, CompositeText] = {}
    seen: dict[Path, None] = {path.resolve(): None}
    waiting = [(text, path)]
    while waiting:
        current, where = waiting.pop(0)
        for name, composite in current.composites.items():
            if name in composites:
                first = composites[name].position
                hint = f"the first definition is at {first.file}:{first.line}"
                problems.add(f"composite {name!r} is defined twice", composite.position, hint)
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
                hint = "included files are .yaml files in or below the model's folder"
                problems.add(f"{include.text!r} cannot be included", include.position, hint)
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
            inner = library_of(node, problems) if node is not None else None
            if inner:
                waiting.append((inner, target))
    return composites


def _beside(target: Path, where: Path) -> list[Path]:
    """The YAML files in the folder where an included file was expected."""
    folder = where.parent / target.parent.relative_to(where.parent.resolve())
    return sorted(folder.glob("*.yaml")) if folder.is_dir() else []
