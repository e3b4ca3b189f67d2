"""show what a model offers"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from ..printing import columns, console, tell, tell_json
from .options import DONE, MODEL, command, load, option

if TYPE_CHECKING:
    from ..build.model import Model


@command(
    "show what a model offers: parameters, metrics, figures, disturbances",
    *MODEL,
    option("--json", action="store_true", help="print one JSON object"),
    imports=("build",),
)
def show(options: argparse.Namespace) -> int:
    """Show the parameters of a model with their types, units, values and docs, the files that it reads, its metrics
    and monitors, recorded ports, figures and aspects, and the packaged disturbances that fit it."""
    from ..shown import in_time
    from ..text.files import noting
    from ..text.patterns import folded

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

    from ..shown import in_words, short

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

    from ..build.load import load_model
    from ..catalogue.packaged import packaged_disturbances
    from ..catalogue.reference import first_sentence
    from ..language.disturbance import load_disturbance
    from ..text.problems import Problems
    from .options import own_types

    for name in packaged_disturbances():
        disturbance = load_disturbance(name, Problems())
        try:
            load_model(options.model, set=options.set, disturb=name, types=own_types(options))
        except EpicycleError:  # it is for models of another kind
            continue
        yield name, first_sentence(disturbance.text.doc) if disturbance is not None else ""
