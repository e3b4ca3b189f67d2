"""Finding and reading models: a path, or the name of a packaged model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

from epicycle.actors import counted_in_si, irregular, plain

from ..collection import without_collection
from ..text import NORMAL, Limits, Problems, call_site, did_you_mean, node_of, read
from ..text import Mapping as MappingNode
from .catalogue import installed
from .checks import check
from .declarations import CompositeText, DeclarationReader, ModelText
from .disturbance import add_disturbances, load_disturbances
from .draft import Draft
from .graph import ModelGraph
from .inheritance import inherit
from .model import Figure, Model
from .packaged import find, model_folders, packaged_models
from .settings import Setting, Settings, change_aspect, parse_setting, read_overrides, settings_in, without
from .settle import Settler
from .unfold import Known, TooLargeError, Unfolded, Unfolding
from .untried import try_classes
from .usage import check_usage
from .values import Values
from .watch import Watching
from .weave_all import weave_all
from .woven import check_processors

MAX_INCLUDES = 200


def find_model(name: str, problems: Problems) -> Path | None:
    """The file of a model: a path if it looks like one, otherwise a packaged model's name."""
    return find(name, "model", packaged_models, problems)


def find_library(path: Path) -> Path:
    """The file of a library of composites: as given, or else among the packaged ones."""
    packaged = [folder / path for folder in model_folders()]
    return next((each for each in (path, *packaged) if each.is_file()), path)


def load_model(
    name: str | Path,
    *,
    set: Iterable[str | Setting] | Mapping[str, object] = (),
    overrides: str | Path | Iterable[str | Path] = (),
    aspects: Iterable[str] = (),
    without_aspects: Iterable[str] = (),
    disturb: str | Path | Iterable[str | Path] = (),
    types: Iterable[type] = (),
    max_actors: int = NORMAL.actors,
) -> Model:
    """Read, change and check a model; raises ``ModelError`` with all that is wrong.

    ``set`` gives parameters their values, as texts like ``"observer[*].sensor.range=5 m"`` or as a mapping
    ``{"observer[*].sensor.range": 5}``; ``overrides`` names a YAML file of such settings, or several; of all that fit
    a parameter the last one wins, and ``set`` wins over files.  ``disturb`` names packaged disturbances, or files of
    aspects, which are added to the model's one after the other; ``without_aspects`` and ``aspects`` count after that,
    and all settings win over what a disturbance sets.  ``types`` are actor and aspect classes of your own that the
    model may name beside the installed ones.  ``max_actors`` is how many actors and composites are not taken for a
    mistake, and a fifth of how many connections.  What is odd but not wrong is in ``Model.warnings``.
    """
    problems, limits = Problems(), Limits(max_actors)
    settings = [each for file in _several(overrides) for each in read_overrides(Path(file), problems)]
    settings += _settings(set, problems)
    with without_collection():
        # What the files say.
        text, path, reader = _read_model(str(name), problems)
        declared = included_composites(text, path, reader, problems)
        catalogue = installed().with_types(types)
        disturbances = load_disturbances(map(str, _several(disturb)), declared, problems)
        composites, broken = inherit(declared, catalogue.actors, problems, limits)
        check_usage(text, declared, composites, catalogue.actors, problems)
        # What is changed from outside; what disturbances set comes first, for the last one wins.
        settings = add_disturbances(text, disturbances, problems) + settings
        for change in without_aspects:
            without(text, change, problems)
        for change in aspects:
            change_aspect(text, change, problems)
        # What comes of it.
        known = Known(composites, catalogue, broken)
        settler = Settler(Settings(settings, limits), problems)
        model = build(text, known, settler, limits)
        if model.figures:
            from ..show import figures_of  # here, for what is shown stands on what is run, and this on models

            figures_of(model, problems)
        problems.raise_if_any()
        model.warnings = problems.warnings
        model.is_checked = True
        return model


def build(text: ModelText, known: Known, settler: Settler, limits: Limits) -> Model:
    """The model that declarations stand for, in passes; it is good only if there are no problems then."""
    problems, values, root = settler.problems, settler.values, text.root
    model = Model(root.name, doc=root.doc)
    _check_names(known, problems)
    values.of_model = root.parameters
    names = settler.parameters("", root, {}, {}, None)
    made = Unfolded(Draft(ModelGraph(limits)), limits.actors)
    try:
        Unfolding(known, settler, made).body("", root, names)
    except TooLargeError:
        pass
    else:
        woven = weave_all(made, known, settler)
        settler.check_unused(made.draft)
        check(made.draft, problems)
        check_processors(woven, made.draft.graph, problems)
        model.adopt(made.draft, woven, Watching(made.draft, values, problems).read(text, names))
        model.parameters = {name: _shown(value, root.parameters[name].unit) for name, value in names.items()}
        model.declared = {name: (text.unit, text.doc) for name, text in root.parameters.items()}
        model.figures = _figures(text, values, names)
    try_classes(known, made.classes, values, limits, problems)
    return model


def _check_names(known: Known, problems: Problems) -> None:
    for name in sorted(known.composites.keys() & known.catalogue.actors.keys()):
        problems.add(
            f"composite {name!r} has the name of an actor type", known.composites[name].position, "give it another name"
        )


def _figures(text: ModelText, values: Values, names: dict[str, object]) -> dict[str, Figure]:
    """The type of each figure, its values, and these as they are written."""
    found = {}
    for name, part in text.figures.items():
        given = {key: values.of(entry.value, names, f"figure {name}.{key}") for key, entry in part.values.items()}
        if values.missing not in given.values():
            in_si = {key: counted_in_si(value) for key, value in given.items()}
            found[name] = (part.type.text, in_si, MappingNode(part.values, part.type.position))
    return found


def _shown(value: object, unit: str) -> object:
    """The value of a parameter of the model, as a plain number in the unit that it declares."""
    return plain(value) if unit else counted_in_si(value)


def _read_model(name: str, problems: Problems) -> tuple[ModelText, Path, DeclarationReader]:
    """The declarations of a model's file, which file that is, and what reads those of the files that it includes."""
    path = find_model(name, problems)
    if path is None:
        problems.raise_if_any()
        raise AssertionError("a model that is not found is a problem")
    node = read(path, problems)
    if node is None:
        problems.raise_if_any()
        raise AssertionError("a file that cannot be read is a problem")
    if isinstance(node, MappingNode) and "study" in node.entries:
        problems.add(f"{name} is a study, not a model", None, f"run it: epicycle study {name}")
        problems.raise_if_any()
    if isinstance(node, MappingNode) and "disturbance" in node.entries and "model" not in node.entries:
        problems.add(f"{name} is a disturbance, not a model", None, f"add it to a model: MODEL --disturb {name}")
        problems.raise_if_any()
    reader = DeclarationReader(problems)
    text = reader.model(node)
    if text is None:
        problems.raise_if_any()
        raise AssertionError("a model that is no mapping is a problem")
    return text, path, reader


def _several(given: str | Path | Iterable[str | Path]) -> list[str | Path]:
    return [given] if isinstance(given, (str, Path)) else list(given)


def _settings(given: Iterable[str | Setting] | Mapping[str, object], problems: Problems) -> list[Setting]:
    if not isinstance(given, Mapping):
        read = (parse_setting(each, problems) if isinstance(each, str) else replace(each) for each in given)
        return [setting for setting in read if setting is not None]
    node = node_of(given, call_site())
    assert isinstance(node, MappingNode)
    return settings_in(node, problems)


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
