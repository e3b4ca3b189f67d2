"""Finding and reading model files and the files that they include."""

from __future__ import annotations

from pathlib import Path

from epicycle.actors import irregular

from ..catalogue.packaged import find, is_path, model_folders, packaged_files, packaged_ones, unreadable
from ..text.document import Mapping, plain, read
from ..text.kinds import CLASS, FILE
from ..text.problems import Problems
from ..text.reading import Text
from .inheritance import extended
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
        near = said.text, list(known)
        problems.add(f"{who}there is no {kind} {said.text!r}", said.position, packaged_ones(kind), near=near)
    else:
        problems.add(f"{who}the {kind} {said.text!r} {reason}", said.position)
    return None


def read_model(name: str, problems: Problems) -> tuple[ModelText, dict[str, CompositeText]]:
    """What a model's file declares, and the composite classes of it and of everything it includes."""
    with problems.looking_for(FILE):
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
        found = _bases(text, path, problems)
        with problems.looking_for(CLASS):
            for base, _ in found[1:]:
                text = extended(base, text, problems)
        return text, _composites(found, problems)


def _bases(text: ModelText, path: Path, problems: Problems) -> list[tuple[ModelText, Path]]:
    """A model and those that it extends, directly and further on, with their files."""
    found, seen = [(text, path)], {path.resolve()}
    while (said := text.extends) is not None:
        if is_path(said.text) and not _is_below(path.parent / said.text, path.parent):
            hint = "a model extends a packaged one, or a file in or below its folder"
            problems.add(f"{text.root.name}: {said.text!r} cannot be extended", said.position, hint)
            break
        if (base := named_file(said, path.parent, "model", problems, f"{text.root.name}: ")) is None:
            break
        if base.resolve() in seen or len(seen) > MAX_INCLUDES:
            problems.add(f"{text.root.name}: the models extend each other in a circle", said.position)
            break
        seen.add(base.resolve())
        node = read(base, problems, str(path.parent / said.text) if is_path(said.text) else None)
        whole = None if node is None else model_of(node, problems)
        if not whole:
            break
        text, path = whole, base
        found.append((text, path))
    return found


def _is_below(path: Path, folder: Path) -> bool:
    try:
        return path.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError, ValueError):  # endless links, too long, or a NUL in it
        return False


def read_library(file: str | Path, problems: Problems) -> dict[str, CompositeText]:
    """The composite classes of a file, at its path or among the packaged ones, and of everything it includes."""
    path = Path(file)
    with problems.looking_for(FILE):
        candidates = (path, *(folder / path for folder in model_folders()))
        path = next((each for each in candidates if each.is_file()), path)
        node, text = read(path, problems), None
        if node is not None:
            is_model = isinstance(node, Mapping) and "model" in node.entries
            text = (model_of if is_model else library_of)(node, problems)
        return _composites([(problems.whole(text), path)], problems)


def _composites(files: list[tuple[ModelText, Path]], problems: Problems) -> dict[str, CompositeText]:
    """The composite classes of files and of what they include."""
    composites: dict[str, CompositeText] = {}
    homes: dict[str, Path] = {}
    seen: dict[Path, None] = {path.resolve(): None for _, path in files}
    # Included files must lie in or below the model's folder: a model cannot read other files.
    waiting = [(text, path, path.parent.resolve()) for text, path in files]
    while waiting:
        current, where, root = waiting.pop(0)
        for name, composite in current.composites.items():
            if name in composites and (homes[name] == root or not _is_copy(composite, composites[name])):
                first = composites[name].position
                hint = f"the first definition is at {first.file}:{first.line}"
                problems.add(f"composite {name!r} is defined twice", composite.position, hint, kind=CLASS)
            composites.setdefault(name, composite)
            homes.setdefault(name, root)
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
                kind = f"is {irregular(target)}" if target.exists() else "does not exist"
                near = include.text, () if target.exists() else names
                problems.add(f"the included file {include.text!r} {kind}", include.position, near=near)
                continue
            node = read(target, problems, str(where.parent / include.text))
            inner = library_of(node, problems) if node is not None else None
            if inner:
                waiting.append((inner, target, root))
    return composites


def _is_copy(one: CompositeText, other: CompositeText) -> bool:
    """Whether two files say the same: a model and the one that it extends may each have a copy of a class."""
    return [each and plain(each) for each in one.written] == [each and plain(each) for each in other.written]


def _beside(target: Path, where: Path) -> list[Path]:
    """The YAML files in the folder where an included file was expected."""
    folder = where.parent / target.parent.relative_to(where.parent.resolve())
    return sorted(folder.glob("*.yaml")) if folder.is_dir() else []
