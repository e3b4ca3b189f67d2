"""The page of a report, section by section."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from epicycle.actors import counted

from ...language import Factor
from ...study import Judgement, Recommendation, mean
from . import answers
from .data import Condition, Data, shown
from .html import Content, Html, page, table, tag, with_class
from .numbers import estimated
from .of_table import numbers

MAX_ROWS = 400  # of one table
MAX_FAILURES = 50  # that are told one by one
MAX_PIVOT = 10  # levels of a factor that are columns

STYLE = """
:root { --ink: #1b1b1b; --soft: #5c5c5c; --line: #d5d5d5; --back: #f6f6f4; }
* { box-sizing: border-box; }
body { font: 16px/1.5 Georgia, 'Times New Roman', serif; color: var(--ink); background: white;
  max-width: 62rem; margin: 0 auto; padding: 2rem 1.2rem 4rem; }
h1, h2, h3, th, nav, .label { font-family: system-ui, 'Helvetica Neue', Arial, sans-serif; }
h1 { font-size: 1.9rem; line-height: 1.2; margin: 0 0 .5rem; }
h2 { font-size: 1.3rem; margin: 2.6rem 0 .7rem; padding-bottom: .2rem; border-bottom: 1px solid var(--line); }
h3 { font-size: 1.02rem; margin: 1.6rem 0 .4rem; }
p { margin: .5rem 0; max-width: 46rem; }
.lead { font-size: 1.1rem; }
nav { font-size: .9rem; margin: 1.2rem 0; }
nav a { margin-right: 1.1rem; color: #0b4f94; text-decoration: none; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: .88rem; margin: .6rem 0 1rem; font-variant-numeric: tabular-nums; }
th, td { padding: .22rem .65rem; text-align: right; border-bottom: 1px solid #ececec; white-space: nowrap; }
thead th { border-bottom: 1px solid #888; vertical-align: bottom; font-weight: 600; }
tbody th { font-weight: 400; text-align: left; }
tbody tr:last-child > * { border-bottom: 1px solid #888; }
table.facts td, table.words td { text-align: left; white-space: normal; }
table.words th { white-space: normal; }
small, .note { color: var(--soft); font-size: .82rem; }
td small { display: block; line-height: 1.1; }
figure { margin: 1.6rem 0 2rem; break-inside: avoid; }
figure img { display: block; max-width: 100%; height: auto; }
summary { cursor: pointer; font: .9rem system-ui, sans-serif; margin: .25rem 0; }
figcaption { font-size: .9rem; max-width: 46rem; margin-top: .5rem; }
code { font: .85em ui-monospace, Consolas, monospace; background: var(--back); padding: .05em .3em;
  overflow-wrap: anywhere; }
.problem { border-left: 3px solid #a00000; padding: .3rem .9rem; background: #fbf2f1; }
.reproduced { color: #00633f; } .not-reproduced { color: #a00000; } .undecided { color: #6b5200; }
.best { font-weight: 700; }
@media print {
  body { font-size: 10.5pt; max-width: none; padding: 0; }
  nav { display: none; } .scroll { overflow: visible; } h2, h3 { break-after: avoid; }
  table { font-size: 8pt; } tr { break-inside: avoid; } thead { display: table-header-group; }
}
"""


@dataclass(frozen=True)
class Picture:
    """A figure as it stands on the page: drawn, or the reason why it is not."""

    name: str
    doc: str
    caption: str
    svg: bytes | None
    problem: str = ""


def report_page(
    data: Data,
    pictures: Sequence[Picture],
    judgements: Sequence[Judgement],
    recommendations: Sequence[Recommendation],
) -> str:
    """The whole document."""
    study = data.plan.study
    sections = [
        ("study", "The study", [_what(data), _provenance(data)]),
        ("runs", "Runs", _runs(data)),
        ("figures", "Figures", [_picture(number, each) for number, each in enumerate(pictures, start=1)]),
        ("means", "Means", list(_means(data))),
        ("claims", "Claims", list(answers.claims(data, judgements))),
        ("guideline", "Guideline", list(answers.guideline(data, recommendations))),
    ]
    sections = [each for each in sections if each[2]]
    title = study.name.replace("_", " ")
    return page(
        f"{title}: report",
        STYLE,
        tag("h1", title),
        tag("p", study.doc, class_="lead") if study.doc else None,
        tag("nav", [tag("a", heading, href=f"#{anchor}") for anchor, heading, _ in sections]),
        [tag("section", tag("h2", heading), content, id=anchor) for anchor, heading, content in sections],
    )


# -- what was asked, and of what --------------------------------------------------------------------------------------


def _what(data: Data) -> Content:
    plan, names = data.plan, data.names
    rows = []
    for dimension in plan.study.dimensions:
        for name in dimension.columns:
            rows.append([tag("code", name), _levels(data, name), names.unit(name), names.doc(name)])
    fixed = [
        f"{setting.path} = {setting.node.text if hasattr(setting.node, 'text') else '...'}"
        for setting in plan.study.fixed
    ]
    most = "" if plan.study.until is None else "at most "
    return [
        tag(
            "p",
            "Model ",
            tag("code", _file(plan.study.model)),
            f": {counted(plan.conditions, 'condition')} of {most}{counted(plan.replications, 'replication')}.",
        ),
        _scrolled(table(["varied", "levels", "unit", ""], rows), "words") if rows else None,
        tag("p", "Set in all runs: ", [[tag("code", each), " "] for each in fixed]) if fixed else None,
        tag("p", _seeds(data)),
    ]


def _levels(data: Data, factor: str) -> str:
    dimension = next(each for each in data.plan.study.dimensions if factor in each.columns)
    if dimension.size > 2 * MAX_PIVOT:
        ends = [shown(dimension.level(index).values[factor]) for index in (0, dimension.size - 1)]
        return f"{ends[0]} to {ends[1]}, {dimension.size:,} levels"
    return ", ".join(dict.fromkeys(shown(dimension.level(index).values[factor]) for index in range(dimension.size)))


def _seeds(data: Data) -> str:
    study = data.plan.study
    if not study.paired:
        return f"Every run has a seed of its own, made of {study.seed}, its condition and its replication."
    last = study.seed + max(data.plan.replications, 1 + max((row["replication"] for row in data.rows), default=0)) - 1
    return (
        f"Seeds {study.seed} to {last}: replication r has the same one in every condition, so that differences "
        "between conditions are seen in pairs of runs."
    )


def _provenance(data: Data) -> Content:
    manifest = data.results.manifest
    versions, machine = manifest.get("versions", {}), manifest.get("machine", {})
    facts = {
        "date": manifest.get("date"),
        "Epicycle": versions.get("epicycle") or "not installed, run from its folder",
        "git revision": manifest.get("git"),
        "made with": ", ".join(f"{name} {found}" for name, found in versions.items() if found and name != "epicycle"),
        "machine": ", ".join(
            part
            for part in (
                str(machine.get("system", "")),
                counted(machine["cores"], "core") if machine.get("cores") else "",
            )
        ),
        "SHA-256 of the table": data.results.digest(),
        "repeat a run": f"epicycle replay {data.results.folder.as_posix()} RUN",
    }
    rows = [[name, tag("code", value)] for name, value in facts.items() if value]
    return [tag("h3", "Made with"), _scrolled(table(["", ""], rows), "facts")]


def _file(model: str) -> str:
    return model.replace("\\", "/").rpartition("/")[2]


# -- runs -------------------------------------------------------------------------------------------------------------


def _runs(data: Data) -> Content:
    counts = data.results.counts()
    over, plan = counts.total(), data.plan
    most = "" if plan.study.until is None else "at most "
    beyond = data.results.beyond()
    missing = plan.size - (over - beyond)
    rows = [[status, f"{number:,}"] for status, number in sorted(counts.items(), key=lambda each: each[0] != "ok")]
    if missing and plan.study.until is None:
        rows.append(["missing", f"{missing:,}"])
    failures = [row for row in data.rows if row["status"] != "ok"]
    return [
        tag(
            "p",
            f"{over - beyond:,} of {most}{counted(plan.size, 'run')} are over"
            + (f", and {beyond:,} more of replications beyond those asked for." if beyond else "."),
        ),
        tag("p", f"The study is not finished: {counted(missing, 'run')} are missing.", class_="problem")
        if missing and plan.study.until is None
        else None,
        _scrolled(table(["status", "runs"], rows)),
        _failures(data, failures) if failures else None,
    ]


def _failures(data: Data, failures: list[dict[str, Any]]) -> Content:
    rows = [
        [
            row["status"],
            data.names.place(data.conditions[row["condition"]].values),
            str(row["seed"]),
            row["error"],
            tag("code", f"epicycle replay {data.results.folder.as_posix()} {row['run'][:12]}"),
        ]
        for row in failures[:MAX_FAILURES]
    ]
    more = len(failures) - len(rows)
    return [
        tag("h3", "Runs without a result"),
        tag("p", "They are in none of the numbers of this report.", class_="note"),
        _scrolled(table(["status", "condition", "seed", "what happened", "repeat it"], rows), "words"),
        tag("p", f"... and {more:,} more: epicycle status {data.results.folder.as_posix()}", class_="note")
        if more
        else None,
    ]


# -- figures ----------------------------------------------------------------------------------------------------------


def _picture(number: int, picture: Picture) -> Html:
    what = picture.doc or picture.name.replace("_", " ").capitalize()
    what = what if what.rstrip()[-1:] in ".!?" else f"{what.rstrip()}."
    if picture.svg is None:
        return tag(
            "figure",
            tag("p", f"This figure could not be drawn: {picture.problem}", class_="problem"),
            tag("figcaption", tag("b", f"Figure {number}. "), what),
            id=f"figure-{picture.name}",
        )
    source = f"data:image/svg+xml;base64,{base64.b64encode(picture.svg).decode()}"
    return tag(
        "figure",
        tag("img", src=source, alt=what),
        tag("figcaption", tag("b", f"Figure {number}. "), what, " ", tag("span", picture.caption, class_="note")),
        id=f"figure-{picture.name}",
    )


# -- means ------------------------------------------------------------------------------------------------------------


def _means(data: Data) -> Iterable[Html]:
    """A table for each metric with the levels of the last factor as columns, or one table with a row a condition."""
    if not data.conditions or not data.results.metrics:
        return
    yield tag(
        "p",
        "Mean with its 95 % interval (Student). Where a number of runs stands below, only so many of those that are "
        "over have a number.",
        class_="note",
    )
    factors = data.results.factors
    columns = data.levels(factors[-1]) if factors else []
    is_grid = all(len(each.columns) == 1 for each in data.plan.study.dimensions)
    if is_grid and len(factors) > 1 and 2 <= len(columns) <= MAX_PIVOT:
        for metric in data.results.metrics:
            yield tag("h3", data.names.axis(metric), " ", _source(data, metric))
            yield from _pivot(data, metric, factors[:-1], factors[-1], columns)
    else:
        yield from _flat(data)


def _source(data: Data, metric: str) -> Html:
    """What a metric is, or how it is made."""
    source = data.results.manifest["metrics"][metric]
    doc = data.names.doc(metric)
    return tag("small", doc) if doc or source == metric else tag("code", source)


def _pivot(data: Data, metric: str, rows: list[str], column: str, levels: list[Factor]) -> Iterable[Html]:
    found: dict[tuple[Factor, ...], dict[Factor, Condition]] = {}
    for condition in data.conditions.values():
        place = tuple(condition.values[name] for name in rows)
        found.setdefault(place, {})[condition.values[column]] = condition
    shown_rows = list(found.items())[:MAX_ROWS]
    head = [data.names.axis(name) for name in rows]
    head += [f"{data.names.words(column)} {data.names.level(column, level)}" for level in levels]
    yield _scrolled(
        table(
            head,
            [
                [*map(shown, place), *(_cell(across.get(level), metric) for level in levels)]
                for place, across in shown_rows
            ],
            names=len(rows),
        )
    )
    yield from _more(len(found) - len(shown_rows))


def _flat(data: Data) -> Iterable[Html]:
    factors, metrics = data.results.factors, data.results.metrics
    conditions = list(data.conditions.values())
    head = [data.names.axis(name) for name in (*factors, *metrics)]
    yield _scrolled(
        table(
            [*head, "runs"],
            [
                [
                    *(shown(each.values[name]) for name in factors),
                    *(_cell(each, metric) for metric in metrics),
                    f"{len(each.rows):,}",
                ]
                for each in conditions[:MAX_ROWS]
            ],
            names=len(factors),
        )
    )
    yield from _more(len(conditions) - MAX_ROWS)
    rows = [[tag("code", metric), _source(data, metric)] for metric in metrics]
    yield _scrolled(table(["metric", ""], rows), "words")


def _more(number: int) -> Iterable[Html]:
    if number > 0:
        yield tag("p", f"... and {counted(number, 'row')} more; table.parquet has all.", class_="note")


def _cell(condition: Condition | None, metric: str) -> Content:
    """A mean with its interval, and the number of runs behind it if that is not all that are over."""
    if condition is None:
        return ""
    values = numbers(condition, metric)
    few = tag("small", f"{len(values)} of {len(condition.rows)}") if len(values) < len(condition.rows) else None
    return [estimated(mean(values)), few]


def _scrolled(content: Html, class_: str | None = None) -> Html:
    return tag("div", with_class(content, class_) if class_ else content, class_="scroll")
