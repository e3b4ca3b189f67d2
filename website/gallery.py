"""The gallery: each packaged model is run once and drawn, and gets a page with its results."""

from __future__ import annotations

import contextlib
import html
import io
import re
from pathlib import Path
from typing import NamedTuple

from epicycle.runner import Model, Results, load_model
from epicycle.runner.interface.cli import main
from epicycle.runner.model.build.figures import figures_of
from epicycle.runner.model.catalogue.packaged import packaged_models
from epicycle.runner.model.text.problems import Problems
from epicycle.runner.show.outcome import draw_figures, shown
from epicycle.runner.show.view.pages import Page
from epicycle.runner.show.view.recording import Recording

UNTIL = {"mg1": 1000.0, "mm1": 1000.0, "switched_network": 0.2}  # s; as much as a page can show in full

_INDEX = """# Gallery

Every model that comes with Epicycle, run when this site was built. Each has a page with its figures and numbers, and
the [live page](../view.md) of its run: play it, scrub through it, click on anything.

<div class="gallery">
{cards}
</div>
"""

_CARD = """<a href="{name}.html"><img src="{name}/{picture}" alt=""><strong>{name}</strong><span>{doc}</span></a>"""

_PAGE = """# {name}

{doc}

[Open the live page]({name}/view.html){{ .md-button .md-button--primary }}

{pictures}

## Numbers

{numbers}

{end}

## Graph

![The graph of {name}]({name}/graph.svg){{ .wide }}

## Try it

```sh
epicycle run {name}{options}
epicycle view {name}{options}
```

??? note "The model, {file}"

    ```yaml
{source}
    ```
"""


class Exhibit(NamedTuple):
    """The page of a model."""

    name: str
    doc: str
    page: str  # Markdown
    picture: str  # the name of a file in the folder of that name


def exhibits(folder: Path) -> list[Exhibit]:
    """Run every packaged model; its drawings are in a folder for each."""
    return [_exhibit(name, path, folder / name) for name, path in sorted(packaged_models().items())]


def index(shown: list[Exhibit]) -> str:
    """The gallery's first page, as Markdown."""
    cards = (_CARD.format(name=each.name, picture=each.picture, doc=html.escape(each.doc)) for each in shown)
    return _INDEX.format(cards="\n".join(cards))


def _exhibit(name: str, path: Path, folder: Path) -> Exhibit:
    folder.mkdir(parents=True, exist_ok=True)
    model, problems, until = load_model(name), Problems(), UNTIL.get(name)
    figures = figures_of(model, problems)
    problems.raise_if_any()
    recording = Recording(model, figures)
    results = recording.run(until=until)
    Page([recording]).save(folder / "view.html")
    drawn, failed = draw_figures(folder, results, figures)
    if failed:
        raise failed[0]
    with contextlib.redirect_stdout(io.StringIO()):
        main(["graph", name, "-o", str(folder / "graph.svg")])
    doc = " ".join(model.doc.split())
    page = _PAGE.format(
        name=name,
        doc=html.escape(doc, quote=False),
        pictures="\n".join(f"![{_words(each.stem)}]({name}/{each.name}){{ .wide }}" for each in drawn),
        numbers=_numbers(model, results),
        end=f"Seed {results.seed}, {results.end:g} s of model time, {results.events:,} events.",
        options=f" --until {until:g}" if until else "",
        file=path.name,
        source="\n".join(f"    {line}".rstrip() for line in path.read_text(encoding="utf-8").splitlines()),
    )
    return Exhibit(name, doc, page, drawn[0].name if drawn else "graph.svg")


def _numbers(model: Model, results: Results) -> str:
    rows = []
    for metric in model.output.metrics:
        unit = "" if metric.unit == "1" else metric.unit
        rows.append((metric.name, results.outcomes[metric.name].shown(shown), unit, metric.measure.doc))
    for name, figures in results.aspects.items():
        rows += [(f"{name}: {what}", shown(figure), "", "") for what, figure in figures.items()]
    if not rows:
        return "This model declares no metrics."
    lines = ("| " + " | ".join(_cell(cell) for cell in row) + " |" for row in rows)
    return "\n".join(["| metric | value | unit | |", "|---|--:|---|---|", *lines])


def _cell(text: str) -> str:
    return html.escape(re.sub(r"\s+", " ", text), quote=False).replace("|", "\\|")


def _words(name: str) -> str:
    return name.replace("_", " ")
