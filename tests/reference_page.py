"""``docs/reference.md``: everything that a model may name, as Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from epicycle.actors import Configurable
from epicycle.runner.model.catalogue.figure import Figure
from epicycle.runner.model.catalogue.metrics import TAKES, MetricSpec
from epicycle.runner.model.catalogue.reference import TypeReference, describe
from epicycle.runner.model.catalogue.types import Catalogue
from epicycle.runner.model.language.schema import RECORDS
from epicycle.runner.model.temporal import Requirement
from epicycle.runner.show.reference import by_group, described, facts, parameter_row, parts_described, sections

INTRODUCTION = """\
# Reference

Everything that a model may name, as declared in the code. `make reference` generates this file; `epicycle list`
and `epicycle describe` print the same for everything installed, including types from other packages.
"""


METRICS = """\
## Metrics

One number per run: `name: {of: port, take: ..., ...}`. Metrics that count *tokens* weigh each token equally; those that
count *time* weigh each value by its duration. For a state, such as the size of a queue, use the mean over time.
"""


def markdown(
    catalogue: Catalogue, figures: Mapping[str, type[Figure]], study_figures: Mapping[str, type[Configurable]]
) -> str:
    lines = [INTRODUCTION]
    every = [each for types in (catalogue.actors, catalogue.aspects, figures, study_figures) for each in types.values()]
    actors, aspects = described(catalogue.actors), described(catalogue.aspects)
    for title, references in (("Actors", actors), ("Aspects", aspects)):
        lines.append(f"## {title}\n")
        for (group, about), members in by_group(references):
            lines.append(f"**{group[0].upper()}{group[1:]}.** {about}.\n")
            table = [f"| [{each.name}](#{each.name.lower()}) | {_cell(each.summary)} |" for each in members]
            lines.append("\n".join(["| | |", "| --- | --- |", *table]) + "\n")
        lines += [block for each in references for block in _markdown(each)]
    for base, known in parts_described(every).items():
        about = f"## {base}\n\nThe value of a parameter, such as `{{type: {known[0].name}, ...}}`.\n" if known else ""
        lines += [about, *(block for each in known for block in _markdown(each))]
    lines += _metrics()
    for title, types in (("Figures", figures), ("Figures of studies", study_figures)):
        lines.append(f"## {title}\n")
        lines += [block for each in described(types) for block in _markdown(each)]
    lines.append("## Keys\n")
    for title, construct in RECORDS.items():
        rows = [[key, each.doc.replace("<", "\\<")] for key, each in construct.keys.items()]
        lines += [f"### {title}\n", _rows(("key", "what it is"), rows)]
    return "\n".join(lines).rstrip("\n") + "\n"


def _metrics() -> list[str]:
    """What a metric can take, and its other options."""
    takes = [
        [name, each.over, each.doc, ", ".join(f"`{option}`" for option in each.options), each.unit]
        for name, each in TAKES.items()
    ]
    options = [parameter_row(each) for each in describe("metric", MetricSpec).parameters if each.name != "take"]
    return [
        METRICS,
        _rows(("take", "counts", "what it is", "options", "unit"), takes),
        _rows(("option", "type", "unit", "default", "what it is"), options),
        "## Monitors\n\nWhat a model file, or `Model.monitor`, says of a property that runs are to have.\n",
        _rows(
            ("key", "type", "unit", "default", "what it is"),
            [parameter_row(each) for each in describe("monitor", Requirement).parameters],
        ),
    ]


def _rows(heading: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    cells = [[_cell(each) for each in (f"`{name}`", *others)] for name, *others in rows]
    return "\n".join(f"| {' | '.join(row)} |" for row in (heading, ["---"] * len(heading), *cells)) + "\n"


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def _markdown(reference: TypeReference) -> list[str]:
    """One type under its own heading."""
    tables = [_rows(heading, rows) for heading, rows in sections(reference)]
    return [f"### {reference.name}\n", f"{reference.doc}\n", *tables, *(f"{line}\n" for line in facts(reference))]
