"""The commands that run nothing: they check or draw models, and list what models may use."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..printing import complain, console, tell, tell_json, tell_json_text
from .options import CHANGES, DONE, JSON, MODEL, TYPES, command, load, option, own_types, whole

if TYPE_CHECKING:
    from ..catalogue.types import Catalogue

# -- models -----------------------------------------------------------------------------------------------------------


@command(
    "check a model or a study",
    *MODEL,
    option("--strict", action="store_true", help="treat warnings as errors"),
    imports=("build",),
)
def validate(options: argparse.Namespace) -> int:
    """Check a model, or a study with everything it varies, without running it."""
    from epicycle.actors import EpicycleError

    if _is_study(options.model):
        return _validate_study(options)
    model = load(options, strict=options.strict)
    if model.endless:
        told = f"{model.endless}\n   help: write 'run: {{stop: 60 s}}', or run it with --until"
        if options.strict:
            raise EpicycleError(told)
        complain(f"warning: {told}")
    tell(f"{options.model} is valid: {model.extent}")
    return DONE


def _is_study(name: str) -> bool:
    """Whether a packaged study has that name, or the file declares a study."""
    from ..catalogue.packaged import is_path, packaged_models, packaged_studies
    from ..language.study import is_study

    if is_path(name):
        return is_study(Path(name))
    return name in packaged_studies() and name not in packaged_models()


def _validate_study(options: argparse.Namespace) -> int:
    """Load the model at every level that the study varies."""
    from epicycle.actors import EpicycleError, counted

    from ..language.study import read_study
    from ..show.report import check_figures
    from ..study import Plan

    for name in ("overrides", "disturb", "aspect", "without"):
        if getattr(options, name):
            raise EpicycleError(f"--{name} is for models: a study states in its file what it changes")
    plan = Plan.made(read_study(options.model, set=options.set, types=map(Path, options.types)))
    check_figures(plan)
    tell(
        f"{options.model} is valid: {counted(plan.conditions, 'condition')} of "
        f"{counted(plan.replications, 'replication')}, {counted(plan.size, 'run')}"
    )
    return DONE


@command(
    "draw the model graph",
    *MODEL,
    option(
        "-o",
        dest="out",
        metavar="FILE",
        type=Path,
        help="write to FILE (.svg, .png or .pdf; .mmd or .md for Mermaid); without it, Mermaid text is printed",
    ),
    option(
        "--depth",
        metavar="N",
        type=whole(0),
        help="open composites N levels deep, 0 for none (default: as deep as the drawing stays readable)",
    ),
    option("--expand", action="store_true", help="draw every instance of an array, even if they are alike"),
    option("--machine", metavar="PATH", help="draw the modes of this machine or composite as a statechart"),
    imports=("build", "show.graph"),
)
def graph(options: argparse.Namespace) -> int:
    """Draw the model graph: actors, composites, ports, connections with their delays, and aspects."""
    from ..show.graph import check_graph_path, mermaid, outline, statechart, write_graph

    if options.out is not None:
        check_graph_path(options.out)
    if options.machine is not None:
        chart = statechart(load(options), options.machine)
        return _write(mermaid(chart), lambda path: write_graph(chart, path), options.out)
    drawn = outline(load(options), depth=options.depth, expand=options.expand)
    _write(mermaid(drawn), lambda path: write_graph(drawn, path), options.out)
    if drawn.note and options.depth is None:
        complain(f"note: {drawn.note}")
    return DONE


def _write(text: str, write: Callable[[Path], None], path: Path | None) -> int:
    if path is None:
        tell(text.rstrip("\n"))
    else:
        write(path)
        tell(f"wrote {path}")
    return DONE


@command("list the packaged models, disturbances and studies", imports=("build",))
def models(options: argparse.Namespace) -> int:
    """List the models that come with Epicycle, the disturbances for --disturb, and the studies."""
    from ..build.load import load_model
    from ..catalogue.packaged import packaged_disturbances, packaged_models, packaged_studies
    from ..language.disturbance import load_disturbance
    from ..language.study import read_study
    from ..text.problems import Problems

    def tell_of(name: str, doc: str) -> None:
        tell(f"{name}: {doc.partition('. ')[0]}" if doc else name)

    for name, path in packaged_models().items():
        tell_of(name, load_model(path).doc)
    tell("\ndisturbances, added with --disturb:")
    problems = Problems()
    for name in packaged_disturbances():
        disturbance = load_disturbance(name, problems)
        problems.raise_if_any()
        tell_of(name, disturbance.text.doc if disturbance is not None else "")
    tell("\nstudies, run with epicycle study:")
    for name in packaged_studies():
        tell_of(name, read_study(name).doc)
    return DONE


# -- types ------------------------------------------------------------------------------------------------------------


LIKE = option("--like", metavar="NAME", help="the types of models with 'director: {like: NAME}'")


def _known_types(options: argparse.Namespace) -> Catalogue:
    """The types that a model may name, under the dialect that is asked for."""
    from epicycle.actors import EpicycleError, ParameterError

    from ..catalogue.like import LIKE as DIALECT
    from ..catalogue.types import installed

    known = installed().with_types(own_types(options))
    try:
        dialect = DIALECT.convert(options.like)
    except ParameterError as error:
        raise EpicycleError(f"--like {error}") from None
    return known if dialect is None else known.like(dialect)


@command(
    "list the actors, or describe one",
    option("name", metavar="NAME", nargs="?", help="an actor type"),
    LIKE,
    TYPES,
    JSON,
    imports=("show",),
)
def actors(options: argparse.Namespace) -> int:
    """List the actors that a model may use, or describe one: its ports and parameters."""
    known = _known_types(options)
    return _print_reference(known.actors, known.aspects, "actor", options.name, options.json)


@command(
    "list the aspects, describe one, or show where they are attached in a model",
    option(
        "model",
        metavar="NAME or MODEL",
        nargs="?",
        help="an aspect type, a packaged model, or a path to a YAML file",
    ),
    LIKE,
    *CHANGES,
    JSON,
    imports=("show",),
)
def aspects(options: argparse.Namespace) -> int:
    """List the aspects that a model may use, describe one, or show which aspects are attached to the ports of a model,
    in the order in which a token meets them."""
    from epicycle.actors import EpicycleError

    from ..catalogue.packaged import is_path, packaged_models

    known = _known_types(options)
    name, packaged = options.model, packaged_models()
    if name is None or name in known.aspects or not (name in packaged or is_path(name)):
        if options.set or options.overrides or options.disturb or options.aspect or options.without:
            raise EpicycleError("--set, --overrides, --disturb, --aspect and --without change a model: name one")
        return _print_reference(known.aspects, known.actors, "aspect", name, options.json, also=packaged)
    from ..show import aspects_at, weaving

    if options.like is not None:
        raise EpicycleError("--like is for the list of types: the directors in a model name their dialects themselves")
    model = load(options)
    if options.json:
        tell_json(aspects_at(model), indent=2)
    else:
        console().print(weaving(model))
    return DONE


def _print_reference(
    types: Mapping[str, type[Any]],
    others: Mapping[str, type[Any]],
    kind: str,
    name: str | None,
    as_json: bool,
    *,
    also: Iterable[str] = (),
) -> int:
    """The list of all types, or the description of one.

    ``others`` are the types of the other kind, ``also`` further names that could have been meant.
    """
    from dataclasses import asdict, replace

    from epicycle.actors import EpicycleError, did_you_mean

    from ..catalogue.reference import describe, parts_of
    from ..catalogue.types import load_all
    from ..show import described, detail, overview, parts_described

    if name is None:
        loaded, errors = load_all(types)
        for error in errors:
            complain(f"warning: {error}")
        references = described(loaded)
        if as_json:
            tell_json([asdict(each) for each in references], indent=2)
        else:
            console().print(overview(references))
        return DONE
    loaded, _ = ({}, []) if name in types or name in others else load_all(types)
    of_bases = parts_of(loaded.values())
    kinds = {base.__name__: known for base, known in of_bases.items() if name in known}
    variants = [each for known in of_bases.values() for each in known]
    if kinds:
        ((base, known),) = kinds.items()
        reference, parts = replace(describe(name, known[name]), kind=base.lower()), parts_described([known[name]])
    elif name not in types:
        if name in others:
            other = "aspect" if kind == "actor" else "actor"
            raise EpicycleError(
                f"{name} is an {other}, not an {kind}\n   help: 'epicycle {other}s {name}' describes it"
            )
        what = f"{kind} type or packaged model" if also else f"{kind} type"
        raise EpicycleError(
            f"there is no {what} {name!r}{did_you_mean(name, [*types, *also, *variants])}\n"
            f"   help: 'epicycle {kind}s' lists them\n"
            f"   help: for your own types, add '--types FILE.py'"
        )
    else:
        (reference,) = described({name: types[name]})
        parts = parts_described([types[name]])
    if as_json:
        tell_json({**asdict(reference), "parts": {k: [asdict(each) for each in v] for k, v in parts.items()}}, indent=2)
    else:
        console().print(detail(reference, parts))
    return DONE


@command(
    "write a JSON Schema of model files, for editors",
    option("-o", "--out", metavar="FILE", type=Path, help="write to FILE (default: standard output)"),
    LIKE,
    TYPES,
    imports=("show.report",),
)
def schema(options: argparse.Namespace) -> int:
    """Write a JSON Schema of model files, made from the installed actors and aspects. An editor with a YAML language
    server completes and checks a model whose first line is '# yaml-language-server: $schema=FILE'."""
    from ..catalogue.types import figure_types, load_all
    from ..language.schema import json_schema, schema_text
    from ..show.report import study_figure_types

    catalogue, errors = _known_types(options).loaded()
    figures, wrong = load_all(figure_types())
    of_studies, wrong_too = load_all(study_figure_types())
    for error in (*errors, *wrong, *wrong_too):
        complain(f"warning: {error}")
    text = schema_text(json_schema(catalogue, figures, of_studies))
    if options.out is None:
        tell_json_text(text)
    else:
        options.out.write_text(text, encoding="utf-8")
        tell(f"wrote {options.out}")
    return DONE
