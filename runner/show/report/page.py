"""The page of a report, section by section."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from epicycle.actors import counted

from ...html import Content, Html, note, page, tag, wide_table
from ...language import Factor
from ...study import Judgement, Recommendation, mean
from . import answers
from .data import Condition, Data, estimated, shown

MAX_ROWS = 400  # of one table
MAX_FAILURES = 50  # that are told one by one
MAX_PIVOT = 10  # levels of a factor that are columns


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
    sections: list[tuple[str, Sequence[Content]]] = [
        ("The study", [*_what(data), *_provenance(data)]),
        ("Runs", list(_runs(data))),
        ("Figures", [_picture(number, each) for number, each in enumerate(pictures, start=1)]),
        ("Means", list(_means(data))),
        ("Claims", list(answers.claims(data, judgements))),
        ("Guideline", list(answers.guideline(data, recommendations))),
    ]
    anchors = {heading: heading.split()[-1].lower() for heading, content in sections if content}
    title = study.name.replace("_", " ")
    return page(
        f"{title}: report",
        Path(__file__).with_suffix(".css").read_text(encoding="utf-8"),
        tag("h1", title),
        tag("p", study.doc, class_="lead") if study.doc else None,
        tag("nav", [tag("a", heading, href=f"#{anchor}") for heading, anchor in anchors.items()]),
        [
            tag("section", tag("h2", heading), content, id=anchors[heading])
            for heading, content in sections
            if heading in anchors
        ],
    )


def _at_most(data: Data) -> str:
    """What stands before numbers of runs of a study that ends when it knows enough."""
    return "" if data.plan.study.until is None else "at most "


# -- what was asked, and of what --------------------------------------------------------------------------------------


def _what(data: Data) -> Iterable[Html]:
    plan, names = data.plan, data.names
    model = tag("code", plan.study.model.replace("\\", "/").rpartition("/")[2])
    number = f"{counted(plan.conditions, 'condition')} of {_at_most(data)}{counted(plan.replications, 'replication')}"
    yield tag("p", "Model ", model, f": {number}.")
    varied = [name for dimension in plan.study.dimensions for name in dimension.columns]
    rows = [[tag("code", name), _levels(data, name), names.unit(name), names.doc(name)] for name in varied]
    if rows:
        yield wide_table(["varied", "levels", "unit", ""], rows, class_="words")
    if fixed := [f"{each.path} = {getattr(each.node, 'text', '...')}" for each in plan.study.fixed]:
        yield tag("p", "Set in all runs: ", [[tag("code", each), " "] for each in fixed])
    yield tag("p", _seeds(data))


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


def _provenance(data: Data) -> Iterable[Html]:
    manifest = data.results.manifest
    versions, machine = manifest.get("versions", {}), manifest.get("machine", {})
    cores = counted(machine["cores"], "core") if machine.get("cores") else ""
    facts = {
        "date": manifest.get("date"),
        "Epicycle": versions.get("epicycle") or "not installed, run from its folder",
        "git revision": manifest.get("git"),
        "made with": ", ".join(f"{name} {found}" for name, found in versions.items() if found and name != "epicycle"),
        "machine": f"{machine.get('system', '')}, {cores}",
        "SHA-256 of the table": data.results.digest(),
        "repeat a run": f"epicycle replay {data.results.folder.as_posix()} RUN",
    }
    yield tag("h3", "Made with")
    yield wide_table(["", ""], [[name, tag("code", value)] for name, value in facts.items() if value], class_="facts")


# -- runs -------------------------------------------------------------------------------------------------------------


def _runs(data: Data) -> Iterable[Html]:
    counts, plan, beyond = data.results.counts(), data.plan, data.results.beyond()
    over = counts.total() - beyond
    missing = plan.size - over if plan.study.until is None else 0
    more = f", and {beyond:,} more of replications beyond those asked for." if beyond else "."
    yield tag("p", f"{over:,} of {_at_most(data)}{counted(plan.size, 'run')} are over{more}")
    rows = [[status, f"{number:,}"] for status, number in sorted(counts.items(), key=lambda each: each[0] != "ok")]
    if missing:
        yield tag("p", f"The study is not finished: {counted(missing, 'run')} are missing.", class_="problem")
        rows.append(["missing", f"{missing:,}"])
    yield wide_table(["status", "runs"], rows)
    if failures := [row for row in data.rows if row["status"] != "ok"]:
        yield from _failures(data, failures)


def _failures(data: Data, failures: list[dict[str, Any]]) -> Iterable[Html]:
    folder = data.results.folder.as_posix()
    rows = [
        [
            row["status"],
            data.names.place(data.conditions[row["condition"]].values),
            str(row["seed"]),
            row["error"],
            tag("code", f"epicycle replay {folder} {row['run'][:12]}"),
        ]
        for row in failures[:MAX_FAILURES]
    ]
    yield tag("h3", "Runs without a result")
    yield note("They are in none of the numbers of this report.")
    yield wide_table(["status", "condition", "seed", "what happened", "repeat it"], rows, class_="words")
    if more := len(failures) - len(rows):
        yield note(f"... and {more:,} more: epicycle status {folder}")


# -- figures ----------------------------------------------------------------------------------------------------------


def _picture(number: int, picture: Picture) -> Html:
    what = picture.doc or picture.name.replace("_", " ").capitalize()
    what = what if what.rstrip()[-1:] in ".!?" else f"{what.rstrip()}."
    caption: list[Content] = [tag("b", f"Figure {number}. "), what]
    if picture.svg is None:
        shown = tag("p", f"This figure could not be drawn: {picture.problem}", class_="problem")
    else:
        source = f"data:image/svg+xml;base64,{base64.b64encode(picture.svg).decode()}"
        shown = tag("img", src=source, alt=what)
        caption += [" ", tag("span", picture.caption, class_="note")]
    return tag("figure", shown, tag("figcaption", caption), id=f"figure-{picture.name}")


# -- means ------------------------------------------------------------------------------------------------------------


def _means(data: Data) -> Iterable[Html]:
    """A table for each metric with the levels of the last factor as columns, or one table with a row a condition."""
    metrics, factors = data.results.metrics, data.results.factors
    if not data.conditions or not metrics:
        return
    yield note(
        "Mean with its 95 % interval (Student). Where a number of runs stands below, only so many of those that are "
        "over have a number."
    )
    columns = data.levels(factors[-1]) if factors else []
    is_grid = all(len(each.columns) == 1 for each in data.plan.study.dimensions)
    if is_grid and len(factors) > 1 and 2 <= len(columns) <= MAX_PIVOT:
        for metric in metrics:
            yield tag("h3", data.names.axis(metric), " ", _source(data, metric))
            yield from _pivot(data, metric)
    else:
        yield from _flat(data)
        yield wide_table(["metric", ""], [[tag("code", each), _source(data, each)] for each in metrics], class_="words")


def _source(data: Data, metric: str) -> Html:
    """What a metric is, or how it is made."""
    source = data.results.manifest["metrics"][metric]
    doc = data.names.doc(metric)
    return tag("small", doc) if doc or source == metric else tag("code", source)


def _pivot(data: Data, metric: str) -> Iterable[Html]:
    *rows, column = data.results.factors
    levels, names = data.levels(column), data.names
    found: dict[tuple[Factor, ...], dict[Factor, Condition]] = {}
    for condition in data.conditions.values():
        place = tuple(condition.values[name] for name in rows)
        found.setdefault(place, {})[condition.values[column]] = condition
    head = [*map(names.axis, rows), *(f"{names.words(column)} {names.level(column, level)}" for level in levels)]
    body = (
        [*map(shown, place), *(_cell(across.get(level), metric) for level in levels)]
        for place, across in islice(found.items(), MAX_ROWS)
    )
    yield wide_table(head, body, names=len(rows))
    yield from _more(len(found))


def _flat(data: Data) -> Iterable[Html]:
    factors, metrics = data.results.factors, data.results.metrics
    head = [*map(data.names.axis, (*factors, *metrics)), "runs"]
    body = [
        [
            *(shown(each.values[name]) for name in factors),
            *(_cell(each, metric) for metric in metrics),
            f"{len(each.rows):,}",
        ]
        for each in islice(data.conditions.values(), MAX_ROWS)
    ]
    yield wide_table(head, body, names=len(factors))
    yield from _more(len(data.conditions))


def _more(rows: int) -> Iterable[Html]:
    if rows > MAX_ROWS:
        yield note(f"... and {counted(rows - MAX_ROWS, 'row')} more; table.parquet has all.")


def _cell(condition: Condition | None, metric: str) -> Content:
    """A mean with its interval, and the number of runs behind it if that is not all that are over."""
    if condition is None:
        return ""
    values = condition.numbers(metric)
    few = tag("small", f"{len(values)} of {len(condition.rows)}") if len(values) < len(condition.rows) else None
    return [estimated(mean(values)), few]
