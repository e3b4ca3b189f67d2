"""The summary of a run: a table for people, an object for programs."""

from __future__ import annotations

from typing import Any

from rich.console import Group
from rich.text import Text

from epicycle.actors import shortened, visible

from ..build import Model
from ..graph import extent
from ..printing import columns
from ..results import Results, plain
from ..shown import finite, in_words

WIDEST = 400  # characters of a text in the table


def summary_object(results: Results) -> dict[str, Any]:
    """What ``--json`` prints; NaN and infinities become null, which JSON lacks."""
    result: dict[str, Any] = finite(
        {
            "model": results.model,
            "seed": results.seed,
            "parameters": {name: plain(value) for name, value in results.parameters.items()},
            "metrics": {name: plain(value) for name, value in results.metrics.items()},
            "outcomes": {name: said for name, each in results.outcomes.items() if (said := each.plain())},
            "aspects": results.aspects,
            "stopped": results.stopped,
            "end": results.end,
            "events": results.events,
            "wall_time": round(results.wall_time, 6),
            "digest": results.digest,
        }
    )
    return result


def summary_table(model: Model, results: Results) -> Group:
    """What a person sees at the end of a run."""
    head = Text.assemble(
        (visible(results.model), "bold"),
        f"  seed {results.seed}, {results.end:g} s of model time, ended by {visible(results.stopped)}",
    )
    rows = []
    for metric in model.metrics:
        found = results.outcomes[metric.name]
        said = "; ".join([metric.measure.doc, *found.remarks] if metric.measure.doc else found.remarks)
        unit = "" if metric.unit == "1" else metric.unit
        rows.append((metric.name, found.shown(shown), unit, said))
    for name, figures in results.aspects.items():
        woven = next(each for each in model.aspects if each.name == name)
        for what, figure in figures.items():
            where = f"by {woven.kind} at {extent([woven])}"
            rows.append((f"{name}: {what}", shown(figure), woven.aspect.reports.get(what, ""), where))
    rows += [
        ("events", f"{results.events}", "", "sends and acts of aspects in the event log"),
        ("firings", f"{results.firings}", "", "of actors"),
        ("wall time", f"{results.wall_time:.3f}", "s", "of initialisation and run"),
        ("digest", results.digest[:16] + "...", "", "SHA-256 of the event log, shortened"),
    ]
    cells = ([visible(shortened(text, WIDEST)) for text in row] for row in rows)
    table = columns(("metric", "value", "unit", ""), cells)
    table.columns[1].justify, table.columns[3].style = "right", "dim"
    return Group(head, table)


def shown(value: Any) -> str:
    """A metric's value in few characters."""
    return in_words(plain(value), digits=4, nothing="-")
