"""The page of a report, section by section."""

from __future__ import annotations

import base64
from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

from epicycle.actors import counted

from ...model.language.dimensions import Factor
from ...model.text.document import plain
from ...study.inference import with_interval
from ...study.judge.claims import REPRODUCED, UNDECIDED, ClaimVerdict
from ...study.judge.guideline import Recommendation
from ...support.html import Content, Html, note, page, tag, wide_table
from ..sheet import tips_of
from .claims import claims, class_of, guideline
from .data import Condition, Data, shown
from .indices import indices

MAX_ROWS = 400  # of one table
MAX_NARROW = 400  # points; a wider picture is scrolled on the screen of a telephone
MAX_FAILURES = 50  # that are listed one by one
MAX_PIVOT = 10  # levels of a factor that become columns


class Picture(NamedTuple):
    """A figure on the page: drawn, with its caption, or the reason why it is not."""

    name: str
    doc: str
    svg: bytes | None
    said: str


def report_page(
    data: Data,
    pictures: Sequence[Picture],
    judgements: Sequence[ClaimVerdict],
    recommendations: Sequence[Recommendation],
) -> str:
    study = data.plan.study
    figures = [_picture(number, each) for number, each in enumerate(pictures, start=1)]
    sections: list[tuple[str, list[Html]]] = [  # answers first, then numbers, then their origin
        ("Claims", list(claims(data.names, judgements))),
        ("Guideline", list(guideline(data, recommendations))),
        ("Sensitivity", list(indices(data))),
        ("Figures", [tag("div", figures, class_="figures")] if figures else []),
        ("Means", list(_means(data))),
        ("Study", list(_what(data))),
        ("Runs", list(_runs(data))),
        ("Provenance", list(_provenance(data))),
    ]
    filled = [(heading, heading.lower(), content) for heading, content in sections if content]
    title = study.name.replace("_", " ")
    return page(
        f"{title}: report",
        _beside("css"),
        tag("h1", title),
        tag("p", study.doc, class_="lead") if study.doc else None,
        list(_in_short(data, judgements)),
        tag("nav", [tag("a", heading, href=f"#{anchor}") for heading, anchor, _ in filled]),
        [tag("section", tag("h2", heading), content, id=anchor) for heading, anchor, content in filled],
        tag("dialog", tag("button", "close", type="button", class_="close"), tag("div", "", class_="stage")),
        script=_beside("js"),
    )


def _beside(ending: str) -> str:
    """The text of the file beside this module with this ending."""
    return Path(__file__).with_suffix(f".{ending}").read_text(encoding="utf-8")


def _in_short(data: Data, judgements: Sequence[ClaimVerdict]) -> Iterable[Html]:
    """What a reader should know first: the verdicts of the claims, and what is missing or failed."""
    verdicts = Counter(each.verdict for each in judgements)
    if verdicts:
        order = {REPRODUCED: 0, UNDECIDED: 1}
        found = sorted(verdicts.items(), key=lambda each: order.get(each[0], len(order)))
        said = [[tag("b", f"{number} {verdict}", class_=class_of(verdict)), " "] for verdict, number in found]
        yield tag("p", f"{counted(verdicts.total(), 'claim')}: ", said, class_="short")
    counts, plan = data.results.counts(), data.plan
    over = counts.total() - data.results.beyond()
    missing = plan.size - over if plan.study.until is None else 0
    if missing:
        yield tag("p", f"The study is not finished: {counted(missing, 'run')} missing.", class_="problem")
    if bad := counts.total() - counts["ok"]:
        link = tag("a", f"{counted(bad, 'run')} without a result", href="#runs")
        yield tag("p", link, ", which no number includes.", class_="problem")


def _at_most(data: Data) -> str:
    """The words before a number of runs if the study ends once it is precise enough."""
    return "" if data.plan.study.until is None else "at most "


# -- the study and its runs -------------------------------------------------------------------------------------------


def _what(data: Data) -> Iterable[Html]:
    plan, names = data.plan, data.names
    model = tag("code", plan.study.model.replace("\\", "/").rpartition("/")[2])
    number = f"{counted(plan.conditions, 'condition')} of {_at_most(data)}{counted(plan.replications, 'replication')}"
    yield tag("p", "Model ", model, f": {number}.")
    varied = [name for dimension in plan.study.dimensions for name in dimension.columns]
    rows = [[tag("code", name), _levels(data, name), names.unit(name), names.doc(name)] for name in varied]
    if rows:
        yield wide_table(["varied", "levels", "unit", ""], rows, class_="words")
    fixed = [f"{each.path} = {getattr(each.node, 'text', shown(str(plain(each.node))))}" for each in plan.study.fixed]
    if fixed:
        yield tag("p", "Set in all runs: ", [[tag("code", each), " "] for each in fixed])
    yield tag("p", _seeds(data))


def _levels(data: Data, factor: str) -> str:
    dimension = next(each for each in data.plan.study.dimensions if factor in each.columns)
    if dimension.design is not None:
        values = sorted(float(dimension.level(index).values[factor] or 0) for index in range(dimension.size))
        return f"{shown(values[0])} to {shown(values[-1])}, {dimension.size:,} points"
    if dimension.size > 2 * MAX_PIVOT:
        ends = [shown(dimension.level(index).values[factor]) for index in (0, dimension.size - 1)]
        return f"{ends[0]} to {ends[1]}, {dimension.size:,} levels"
    return ", ".join(dict.fromkeys(shown(dimension.level(index).values[factor]) for index in range(dimension.size)))


def _seeds(data: Data) -> str:
    study = data.plan.study
    if not study.paired:
        return f"Every run has its own seed, derived from {study.seed}, its condition and its replication."
    last = study.seed + max(data.plan.replications, 1 + max((row["replication"] for row in data.rows), default=0)) - 1
    return (
        f"Seeds {study.seed} to {last}: replication r has the same seed in every condition, so differences between "
        "conditions are seen in pairs of runs."
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
        "repeat a run": f"epicycle run {data.results.folder.as_posix()}/RUN",
    }
    yield wide_table(["", ""], [[name, tag("code", value)] for name, value in facts.items() if value], class_="facts")


def _runs(data: Data) -> Iterable[Html]:
    counts, plan, beyond = data.results.counts(), data.plan, data.results.beyond()
    over = counts.total() - beyond
    missing = plan.size - over if plan.study.until is None else 0
    more = f", and {beyond:,} more from replications beyond those requested." if beyond else "."
    yield tag("p", f"{over:,} of {_at_most(data)}{counted(plan.size, 'run')} are finished{more}")
    rows = [[status, f"{number:,}"] for status, number in sorted(counts.items(), key=lambda each: each[0] != "ok")]
    if missing:
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
            tag("pre", row["error"]),
            tag("code", f"epicycle run {folder}/{row['run'][:12]}"),
        ]
        for row in failures[:MAX_FAILURES]
    ]
    yield tag("h3", "Runs without a result")
    yield note("No number in this report includes them.")
    yield wide_table(["status", "condition", "seed", "what happened", "repeat it"], rows, class_="words")
    if more := len(failures) - len(rows):
        yield note(f"... and {more:,} more: epicycle status {folder}")


def _picture(number: int, picture: Picture) -> Html:
    what = picture.doc or picture.name.replace("_", " ").capitalize()
    what = what if what.rstrip()[-1:] in ".!?" else f"{what.rstrip()}."
    caption: list[Content] = [tag("b", f"Figure {number}. "), what]
    if picture.svg is None:
        shown = tag("p", f"This figure could not be drawn: {picture.said}", class_="problem")
    else:
        shown = _shown(picture.svg, what)
        caption += [" ", tag("span", picture.said, class_="note")]
        caption.insert(0, tag("button", "enlarge", type="button", class_="enlarge", aria_label=f"enlarge: {what}"))
    return tag("figure", shown, tag("figcaption", caption), id=f"figure-{picture.name}")


def _shown(svg: bytes, what: str) -> Html:
    """A picture that can be enlarged, with tips over it; as an image, it cannot run anything."""
    image = {"src": f"data:image/svg+xml;base64,{base64.b64encode(svg).decode()}", "alt": what}
    over, kind = None, "frame wide"
    if (found := tips_of(svg)) is not None:
        image |= {"width": f"{found.width:.0f}", "height": f"{found.height:.0f}"}
        dots = [tag("circle", tag("title", tip.text), cx=f"{tip.x:g}", cy=f"{tip.y:g}", r="4") for tip in found.tips]
        view = {"viewBox": f"0 0 {found.width:g} {found.height:g}"}
        over = tag("svg", dots, class_="tips", aria_hidden="true", **view)
        kind = "frame wide" if found.width > MAX_NARROW else "frame"
    return tag("div", tag("div", tag("img", **image), over, class_=kind, tabindex="0"), class_="scroll")


def _means(data: Data) -> Iterable[Html]:
    """A table for each metric with the levels of the last factor as columns, or one with a row per condition."""
    metrics, factors = data.results.metrics, data.results.factors
    if not data.conditions or not metrics:
        return
    yield note(
        "Mean with its 95 % interval (Student; of what is true or false, Wilson). A number of runs below it says how "
        "many of the finished runs have a value."
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
    """The description of a metric, or its declaration."""
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
        [*map(shown, place), *(_cell(data, across.get(level), metric) for level in levels)]
        for place, across in found.items()
    )
    return _long_table(head, body, len(rows), len(found))


def _flat(data: Data) -> Iterable[Html]:
    factors, metrics = data.results.factors, data.results.metrics
    body = (
        [
            *(shown(each.values[name]) for name in factors),
            *(_cell(data, each, metric) for metric in metrics),
            f"{len(each.rows):,}",
        ]
        for each in data.conditions.values()
    )
    head = [*map(data.names.axis, (*factors, *metrics)), "runs"]
    return _long_table(head, body, len(factors), len(data.conditions))


def _long_table(head: list[str], rows: Iterable[list[Content]], names: int, count: int) -> Iterable[Html]:
    yield wide_table(head, islice(rows, MAX_ROWS), names=names)
    if count > MAX_ROWS:
        yield note(f"... and {counted(count - MAX_ROWS, 'row')} more; table.parquet has them all.")


def _cell(data: Data, condition: Condition | None, metric: str) -> Content:
    """A mean with its interval, and the number of runs behind it if some have no value."""
    if condition is None:
        return ""
    found, runs = data.average(condition, metric), len(condition.rows)
    return [with_interval(found), tag("small", f"{found.count} of {runs}") if found.count < runs else None]
