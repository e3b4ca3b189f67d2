"""The commands that run nothing: they check, draw, compare and describe models and types."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...support.declare.commands import arguments, declared
from ...support.printing import columns, complain, console, tell, tell_json
from ..calls import differing, picturing, running, studying
from .listing import LIKE, known_types
from .options import BAD_INPUT, DONE, FAILED, JSON, command, load, of_call, option, own_types, taken

if TYPE_CHECKING:
    from epicycle.actors import Configurable

    from ...model.build.model import Model
    from ...study.plan.plan import Plan

# -- models -----------------------------------------------------------------------------------------------------------


@command(
    "check a model or a study",
    taken(running.load),
    option("--strict", action="store_true", help="treat warnings as errors"),
    JSON,
    imports=("model.build",),
)
def validate(options: argparse.Namespace) -> int:
    """Check a model, or a study with everything it varies, without running it.

    --json prints every problem with its code, which docs/problems.md explains, and the change that would remove it.
    """
    from epicycle.actors import EpicycleError, counted

    if options.json:
        return _validate_for_programs(options)
    if _is_study(options.model):
        plan = _plan(options)
        runs = f"{counted(plan.replications, 'replication')}, {counted(plan.size, 'run')}"
        tell(f"{options.model} is valid: {counted(plan.conditions, 'condition')} of {runs}")
        return DONE
    model = load(options, strict=options.strict)
    if model.endless:
        told = f"{model.endless}\n   help: write 'run: {{stop: 60 s}}', or run it with --until"
        if options.strict:
            raise EpicycleError(told)
        complain(f"warning: {told}")
    tell(f"{options.model} is valid: {model.extent}")
    return DONE


def _validate_for_programs(options: argparse.Namespace) -> int:
    """Print what is wrong as JSON."""
    from ...desk import Knowledge, read, report
    from ...model.text.problems import ModelError

    if _is_study(options.model):
        try:
            _plan(options)
            found = report()
        except ModelError as error:
            found = report(error.problems, error.more)
    else:
        given = arguments(running.load, options)
        reading = read(given.pop("model"), **{**given, "types": own_types(options)})
        found = report(reading.problems, reading.more, Knowledge(reading))
    is_good = found["valid"] and not (options.strict and found["problems"])
    tell_json({**found, "valid": is_good}, indent=2)
    return DONE if is_good else BAD_INPUT


def _is_study(name: str) -> bool:
    """Whether a packaged study has that name, or the file declares a study."""
    from ...model.catalogue.packaged import is_path, packaged_models, packaged_studies
    from ...model.language.study import is_study

    if is_path(name):
        return is_study(Path(name))
    return name in packaged_studies() and name not in packaged_models()


def _plan(options: argparse.Namespace) -> Plan:
    """The plan of a study that is valid: its model has been loaded at every level that it varies."""
    from epicycle.actors import EpicycleError

    for each in declared(running.load):
        if each.name not in ("model", "set", "types") and hasattr(options, each.name):
            raise EpicycleError(f"{each.flag} is for models: a study states in its file what it changes")
    given = arguments(running.load, options)
    plan, _ = studying.plan_of(options.model, set=given.get("set", ()), types=given.get("types", ()))
    return plan


@command(
    "draw the model graph",
    taken(running.load),
    option(
        "-o",
        dest="out",
        metavar="FILE",
        type=Path,
        help="write to FILE (.svg, .png or .pdf; .mmd or .md for Mermaid); without it, Mermaid text is printed",
    ),
    taken(picturing.draw),
    imports=("model.build", "show.graph"),
)
def graph(options: argparse.Namespace) -> int:
    """Draw the model graph: actors, composites, ports, connections with their delays, and aspects."""
    from ...show.graph import check_graph_path, mermaid, write_graph

    if options.out is not None:
        check_graph_path(options.out)
    given = arguments(picturing.draw, options)
    drawn = picturing.outlined(load(options), **given)
    if options.out is None:
        tell(mermaid(drawn).rstrip("\n"))
    else:
        write_graph(drawn, options.out)
        tell(f"wrote {options.out}")
    if drawn.note and "depth" not in given:
        complain(f"note: {drawn.note}")
    return DONE


@of_call(differing.diff, JSON, imports=("model.build",))
def diff(options: argparse.Namespace) -> int:
    found = differing.diff(**arguments(differing.diff, options))
    if options.json:
        tell_json(found.to_dict(), indent=2)
    else:
        tell(str(found))
    return FAILED if found else DONE


# -- descriptions -----------------------------------------------------------------------------------------------------


@command(
    "describe a model or a type: what it offers, and where aspects are attached",
    option("model", metavar="MODEL or TYPE", help="a packaged model, a path to a YAML file, or a type"),
    taken(running.load, without={"model"}),
    LIKE,
    option(
        "--aspects", dest="weaving", action="store_true", help="show which aspects are attached to the ports of a model"
    ),
    option("--json", action="store_true", help="print one JSON object"),
    imports=("model.build",),
)
def describe(options: argparse.Namespace) -> int:
    """Describe a model: its parameters with their types, units, values and docs, the files that it reads, its metrics
    and monitors, recorded ports, figures and aspects, and the packaged disturbances that fit it; or, with --aspects,
    the aspects at its ports, in the order in which a token meets them.

    Describe a type of actors, aspects, their parts or figures: its ports and parameters; or a file from elsewhere, such
    as the variables of an FMU (*.fmu), or the topics of a recording of ROS 2.
    """
    from epicycle.actors import EpicycleError

    from ...model.catalogue.packaged import is_path, packaged_models

    if (said := _from_elsewhere(Path(options.model))) is not None:
        tell(said)
        return DONE
    changed = [each for each in arguments(running.load, options) if each not in ("model", "types")]
    if is_path(options.model) or options.model in packaged_models():
        if options.like is not None:
            raise EpicycleError("--like is for types: the directors in a model name their dialects themselves")
        return _weaving(options) if options.weaving else _describe_model(options)
    if options.weaving or changed:
        raise EpicycleError(f"{options.model} is no model, and --aspects and changes are for models")
    return _describe_type(options)


def _from_elsewhere(path: Path) -> str | None:
    """What an installed package says of a file that is no model; it offers a function for the ending of its name."""
    kind = "folder" if (path / "metadata.yaml").is_file() else path.suffix.lower().lstrip(".")
    if kind not in ("", "yaml", "yml"):
        for point in entry_points(group="epicycle.described", name=kind):
            said: str = point.load()(path)
            return said
    return None


def _weaving(options: argparse.Namespace) -> int:
    from ...show.reference import aspects_at, weaving

    model = load(options)
    if options.json:
        tell_json(aspects_at(model), indent=2)
    else:
        console().print(weaving(model))
    return DONE


def _describe_type(options: argparse.Namespace) -> int:
    """What has that name: an actor or aspect, or a class that stands in a parameter, and figures."""
    from dataclasses import asdict, replace

    from epicycle.actors import EpicycleError, did_you_mean

    from ...model.catalogue.packaged import packaged_models
    from ...model.catalogue.reference import describe, parts_of
    from ...model.catalogue.types import figure_types, load_all
    from ...show.reference import detail, parts_described
    from ...show.report import study_figure_types

    known, name = known_types(options), options.model
    types = {**known.actors, **known.aspects}
    others: dict[str, Mapping[str, type[Configurable]]] = {}
    if name not in types:
        loaded, _ = load_all(types)
        others = {base.__name__.lower(): found for base, found in parts_of(loaded.values()).items()}
    others |= {"figure": figure_types(), "figure of studies": study_figure_types()}
    classes = [types[name]] if name in types else []
    references = [describe(name, each) for each in classes]
    for kind, found in others.items():
        if name in found:
            classes.append(found[name])
            references.append(replace(describe(name, found[name]), kind=kind))
    if not classes:
        variants = [each for found in others.values() for each in found]
        near = did_you_mean(name, [*types, *packaged_models(), *variants])
        raise EpicycleError(
            f"there is no type or packaged model {name!r}{near}\n"
            "   help: 'epicycle list models', 'epicycle list actors' and 'epicycle list aspects' list them\n"
            "   help: for your own types, add '--types FILE.py'"
        )
    if options.json:
        told = [
            {**asdict(each), "parts": {base: [*map(asdict, known)] for base, known in parts_described([cls]).items()}}
            for each, cls in zip(references, classes, strict=True)
        ]
        tell_json({**told[0], "also": told[1:]}, indent=2)
        return DONE
    for number, (reference, cls) in enumerate(zip(references, classes, strict=True)):
        if number:
            tell("")
        console().print(detail(reference, parts_described([cls])))
    return DONE


def _describe_model(options: argparse.Namespace) -> int:
    from ...model.text.files import noting
    from ...model.text.patterns import folded
    from ...support.shown import in_time

    with noting() as noted:
        model = load(options)
    found = {
        "parameters": list(_parameters(model)),
        "metrics": list(_metrics(model)),
        "monitors": list(_monitors(model)),
        "figures": [{"figure": name, "type": kind} for name, (kind, *_) in model.figures.items()],
        "aspects": [
            {"aspect": each.name, "type": each.kind, "at": ", ".join(folded(each.places))} for each in model.aspects
        ],
        "disturbances": [{"disturbance": name, "what it is": doc} for name, doc in _disturbances(options)],
    }
    about: dict[str, Any] = {"model": model.name, "doc": model.doc, "extent": model.extent, "stop": model.stop}
    about |= {"records": model.output.recorded, "reads": list(noted.files)}
    if options.json:
        tell_json({**about, **found}, indent=2)
        return DONE
    tell(f"{model.name}: {model.doc}" if model.doc else model.name)
    tell(f"{model.extent}" + ("" if model.stop is None else f", stops at {in_time(model.stop)}"))
    for rows in filter(None, found.values()):
        tell("")
        head = [key for key in rows[0] if key != "stands for"]  # it takes room
        console().print(columns(head, ([str(row[key]) for key in head] for row in rows), whole=(head[0], "unit")))
    for what in ("records", "reads"):
        if about[what]:
            tell(f"\n{what}: {', '.join(folded(about[what]))}")
    return DONE


def _parameters(model: Model) -> Iterator[dict[str, str]]:
    """The declaration of each parameter and its value, which is the default unless it is set."""
    from epicycle.actors import bounds_text

    from ...support.shown import in_words, short

    for name, value in model.parameters.items():
        said = model.declared[name]
        kinds = {bool: "true or false", str: "text", int: "number", float: "number", list: "list", tuple: "list"}
        kind = f"one of {', '.join(said.choices)}" if said.choices else kinds.get(type(value), "any value")
        low, above, high = said.bounds()
        kind += bounds_text(low, above, high, lambda bound: f"{bound:g}")
        unit = "" if said.unit == "1" else said.unit
        told = in_words(value) if isinstance(value, (bool, float)) else short(value)
        yield {
            "parameter": name,
            "type": kind,
            "unit": unit,
            "value": told,
            "stands for": said.source,
            "what it is": said.doc,
        }


def _metrics(model: Model) -> Iterator[dict[str, str]]:
    for each in model.output.metrics:
        if each.monitor:
            continue
        takes, unit = each.takes, "" if each.unit == "1" else each.unit
        yield {"metric": each.name, "takes": takes, "unit": unit, "what it is": each.measure.doc}


def _monitors(model: Model) -> Iterator[dict[str, str]]:
    for each in model.output.monitors:
        said = each.requirement
        yield {"monitor": each.name, "property": said.property, "unit": said.unit, "what it is": said.doc}


def _disturbances(options: argparse.Namespace) -> Iterator[tuple[str, str]]:
    """The packaged disturbances that the model can be loaded with."""
    from epicycle.actors import EpicycleError

    from ...model.catalogue.packaged import packaged_disturbances
    from ...model.catalogue.reference import first_sentence
    from ...model.language.disturbance import load_disturbance
    from ...model.text.problems import Problems

    given = arguments(running.load, options)
    given.pop("aspects", None), given.pop("without_aspects", None)
    for name in packaged_disturbances():
        disturbance = load_disturbance(name, Problems())
        try:
            running.load(**{**given, "disturb": [*given.get("disturb", ()), name]})
        except EpicycleError:  # it is for models of another kind
            continue
        yield name, first_sentence(disturbance.root.doc) if disturbance else ""
