"""What there is: models, actors and aspects that a model may use, and the schema of model files."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ...support.printing import complain, console, tell, tell_json, tell_json_text
from .options import DONE, TYPES, command, option, own_types

if TYPE_CHECKING:
    from ...model.catalogue.types import Catalogue

LIKE = option("--like", metavar="NAME", help="the types of models with 'director: {like: NAME}'")


@command(
    "list what there is: models, actors, aspects, or the schema of model files",
    option(
        "what",
        choices=("models", "actors", "aspects", "schema"),
        help="packaged models, disturbances and studies; types of actors or aspects that a model may use; or a JSON "
        "Schema of model files",
    ),
    LIKE,
    TYPES,
    option("--json", action="store_true", help="print JSON"),
    option("-o", "--out", metavar="FILE", type=Path, help="write the schema to FILE (default: standard output)"),
    imports=("model.build",),
)
def list_(options: argparse.Namespace) -> int:
    """List what models may use.

    The schema is made from the installed actors and aspects.  An editor with a YAML language server completes and
    checks a model whose first line is '# yaml-language-server: $schema=FILE'.
    """
    from epicycle.actors import EpicycleError

    if options.out is not None and options.what != "schema":
        raise EpicycleError("--out is for 'epicycle list schema'")
    if options.what == "schema":
        return _schema(options)
    if options.what == "models":
        return _models(options)
    return _types(options)


def _models(options: argparse.Namespace) -> int:
    """The models that come with Epicycle, the disturbances for --disturb, and the studies."""
    from ...model.build.load import load_model
    from ...model.catalogue.packaged import packaged_disturbances, packaged_models, packaged_studies
    from ...model.catalogue.reference import first_sentence
    from ...model.language.disturbance import load_disturbance
    from ...model.language.study import read_study
    from ...model.text.problems import Problems
    from ...show.reference import overview

    problems = Problems()
    disturbances = {name: load_disturbance(name, problems) for name in packaged_disturbances()}
    problems.raise_if_any()
    found = {
        "models": {name: load_model(path).doc for name, path in packaged_models().items()},
        "disturbances": {name: each.root.doc if each else "" for name, each in disturbances.items()},
        "studies": {name: read_study(name).doc for name in packaged_studies()},
    }
    if options.json:
        tell_json(found, indent=2)
        return DONE
    about = {"models": "", "disturbances": "added with --disturb", "studies": "run with epicycle study"}
    said = {kind: {name: first_sentence(doc) for name, doc in docs.items()} for kind, docs in found.items()}
    console().print(overview({(kind, about[kind]): docs for kind, docs in said.items()}))
    return DONE


def _types(options: argparse.Namespace) -> int:
    from dataclasses import asdict

    from ...model.catalogue.types import load_all
    from ...show.reference import by_group, described, overview

    known = known_types(options)
    loaded, errors = load_all(known.actors if options.what == "actors" else known.aspects)
    for error in errors:
        complain(f"warning: {error}")
    references = described(loaded)
    if options.json:
        tell_json([asdict(each) for each in references], indent=2)
    else:
        groups = {group: {each.name: each.summary for each in members} for group, members in by_group(references)}
        console().print(overview(groups))
    return DONE


def _schema(options: argparse.Namespace) -> int:
    from ...model.catalogue.types import figure_types, load_all
    from ...model.language.schema import json_schema, schema_text
    from ...show.report import study_figure_types

    catalogue, errors = known_types(options).loaded()
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


def known_types(options: argparse.Namespace) -> Catalogue:
    """The types that a model may name, under the dialect that is asked for."""
    from epicycle.actors import EpicycleError, ParameterError

    from ...model.catalogue.like import LIKE as DIALECT
    from ...model.catalogue.types import installed

    known = installed().with_types(own_types(options))
    try:
        dialect = DIALECT.convert(options.like)
    except ParameterError as error:
        raise EpicycleError(f"--like {error}") from None
    return known if dialect is None else known.like(dialect)
