"""Runs the cases of the board, and tells which published values they meet.

A source is a file beside this one: ``title``, ``source``, what is ``undecided``, and ``cases``.  A case is made in one
of these ways, or in those of ``falsifying.py``:

- ``study: NAME``: replications.  A true or false is a share with Wilson's interval, a number a mean with Student's.
- ``run: NAME``: one long run, whose metrics have intervals by batch means.
- ``rare: NAME`` with ``monitor``, ``guide``, ``runs``: importance splitting.
- ``check: NAME``: one run, in which all monitors must hold.
- ``beside: NAME``: runs whose data Stone Soup gets, too.
- ``program: NAME``: an example of SimPy, which must print what it prints there.

``published`` has a list for each parameter that is varied and for each metric.  Every seed is fixed; the figures are
those of Epicycle's own statistics, so that they are the same on every machine.
"""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

import yaml

import epicycle
from epicycle.runner import Simulation
from epicycle.runner.study.inference import average
from epicycle.runner.support.shown import rounded

from . import programs, stone_soup
from .falsifying import replays, searches

HERE = Path(__file__).parent
ROOT = HERE.parent.parent
SOURCES = ("stochastic", "simpy", "queues", "superdense", "falsification", "searches", "tracking")
FOUND = HERE.parent / "TRUTH.json"
RESULTS = Path("results/truth")
LEAST, MOST = 90.0, 99.0  # % of 95 % intervals that should hold the published value


@dataclass(frozen=True)
class Line:
    """A published value beside ours."""

    case: str
    asked: str
    published: str
    ours: str
    is_met: bool
    command: str
    is_interval: bool = True
    numbers: tuple[float, ...] = ()  # what was published, ours, and its interval, for a plot


@cache
def source(name: str) -> Mapping[str, Any]:
    """What the file of a source says."""
    found: Mapping[str, Any] = yaml.safe_load((HERE / f"{name}.yaml").read_text(encoding="utf-8"))
    return found


def lines_of(name: str, jobs: int | None = None) -> list[Line]:
    """All cases of a source, made now unless they have been made before."""
    kinds = {
        "study": _of_study,
        "run": _of_run,
        "rare": _of_rare,
        "check": _of_check,
        "program": _of_program,
        "beside": _beside,
        "replay": _of_replay,
        "search": _of_search,
    }
    lines: list[Line] = []
    for case in source(name)["cases"]:
        kind = next(each for each in kinds if each in case)
        print(f"{name}: {kind} {case[kind]}", file=sys.stderr, flush=True)
        lines += kinds[kind](name, case, jobs)
    return lines


def _of_study(name: str, case: Mapping[str, Any], jobs: int | None) -> Iterator[Line]:
    file = HERE / name / "studies" / f"{case['study']}.yaml"
    results = epicycle.study(file, out=ROOT / RESULTS / name / case["study"], jobs=jobs, show_progress=False)
    if failed := results.failures():
        raise SystemExit(f"{file}: {len(failed)} runs failed: {failed[0]}")
    table = results.table().to_pylist()
    for values, published in _published(case, results.factors):
        rows = [row for row in table if all(row[key] == value for key, value in values.items())]
        for metric, value in published.items():
            numbers = [float(row[metric]) for row in rows if row[metric] is not None]
            is_share = metric in case.get("shares", ()) or set(numbers) <= {0.0, 1.0}
            found = average(numbers, is_share=is_share)
            command = f"epicycle study {file.relative_to(ROOT)}"
            yield _line(case["study"], values, metric, (value, found.value, found.low, found.high), command)


def _of_run(name: str, case: Mapping[str, Any], jobs: int | None) -> Iterator[Line]:
    file = HERE / name / f"{case['run']}.yaml"
    for values, published in _published(case):
        settings = {**case.get("set", {}), **values}
        found = Simulation(epicycle.load(file, set=settings)).run()
        for metric, value in published.items():
            interval = found.intervals[metric]
            command = f"epicycle run {file.relative_to(ROOT)}{_sets(settings)}"
            numbers = value, found.metrics[metric], interval.low, interval.high
            yield _line(case["run"], values, metric, numbers, command)


def _of_rare(name: str, case: Mapping[str, Any], jobs: int | None) -> Iterator[Line]:
    file, monitor, guide, runs = HERE / name / f"{case['rare']}.yaml", case["monitor"], case["guide"], case["runs"]
    for values, published in _published(case):
        folder = ROOT / RESULTS / name / "_".join([case["rare"], monitor, *map(str, values.values())])
        found = epicycle.rare(file, monitor, guide=guide, runs=runs, set=values, out=folder, jobs=jobs, progress=False)
        low, high = found.interval or (0.0, 1.0)
        command = (
            f"epicycle rare {file.relative_to(ROOT)} --monitor {monitor} --guide {shlex.quote(guide)} --runs {runs}"
        )
        for metric, value in published.items():
            yield _line(case["rare"], values, metric, (value, found.probability, low, high), command + _sets(values))


def _of_check(name: str, case: Mapping[str, Any], jobs: int | None) -> Iterator[Line]:
    file = HERE / name / f"{case['check']}.yaml"
    model = epicycle.load(file)
    found = Simulation(model).run()
    asked = "; ".join(each.metrics[0].measure.doc for each in model.output.monitors)
    broken = [name for name, verdict in found.monitors.items() if verdict.holds is not True]
    ours = f"{', '.join(broken)} broken" if broken else "holds"
    command = f"epicycle run {file.relative_to(ROOT)} --check"
    yield Line(case["check"], asked, case["published"], ours, not broken, command, is_interval=False)


def _of_program(name: str, case: Mapping[str, Any], jobs: int | None) -> Iterator[Line]:
    wanted, found = programs.published(case["program"]), programs.printed(case["program"])
    pairs = enumerate(zip(found, wanted, strict=False), start=1)
    ours = next((f"line {number} is {here!r}, not {there!r}" for number, (here, there) in pairs if here != there), "")
    if not ours and len(found) != len(wanted):
        ours = f"{len(found)} lines instead of {len(wanted)}"
    command = f"python -m benchmarks.truth.programs {case['program']}"
    told = ours or "the same lines"
    yield Line(case["program"], case["asked"], f"{len(wanted)} lines", told, not ours, command, is_interval=False)


def _beside(name: str, case: Mapping[str, Any], jobs: int | None) -> Iterator[Line]:
    file = HERE / name / f"{case['beside']}.yaml"
    command = f"epicycle run {file.relative_to(ROOT)}"
    for each in stone_soup.compared(file, case["of"], case["runs"]):
        yield Line(case["beside"], each.asked, each.theirs, each.ours, each.is_met, command, False, each.numbers)


def _of_replay(name: str, case: Mapping[str, Any], jobs: int | None) -> Iterator[Line]:
    file = HERE / name / f"{case['replay']}.yaml"
    for *told, command in replays(file, case):
        yield Line(case["replay"], *told, f"epicycle run {file.relative_to(ROOT)}{command}", is_interval=False)


def _of_search(name: str, case: Mapping[str, Any], jobs: int | None) -> Iterator[Line]:
    file = HERE / "falsification" / f"{case['search']}.yaml"
    for *told, command in searches(file, case, ROOT / RESULTS / name, jobs):
        yield Line(case["search"], *told, f"epicycle search {file.relative_to(ROOT)}{command}", is_interval=False)


def _published(
    case: Mapping[str, Any], factors: Sequence[str] | None = None
) -> Iterator[tuple[dict[str, Any], dict[str, float]]]:
    """What is published under each condition: the values of its parameters, and of its metrics."""
    columns: dict[str, list[Any]] = case["published"]
    metrics = set(case.get("metrics", ())) or {key for key in columns if key not in (factors or [_first(columns)])}
    for place in range(len(next(iter(columns.values())))):
        row = {key: column[place] for key, column in columns.items()}
        yield (
            {key: value for key, value in row.items() if key not in metrics},
            {key: float(value) for key, value in row.items() if key in metrics and value is not None},
        )


def _first(columns: Mapping[str, Any]) -> str:
    return next(iter(columns))


def _sets(settings: Mapping[str, Any]) -> str:
    return "".join(f" --set {shlex.quote(f'{key}={value}')}" for key, value in settings.items())


def _digits(value: float, low: float, high: float) -> list[str]:
    """A number and its interval, to as many digits as that deserves."""
    width = high - low
    return [f"{each:.2g}" if value < 1e-3 else rounded(each, width) for each in (value, low, high)]


def _line(
    case: str, values: Mapping[str, Any], metric: str, numbers: tuple[float, float, float, float], command: str
) -> Line:
    condition = ", ".join(f"{key}={each}" for key, each in values.items())
    published, _, low, high = numbers
    told, is_met = [f"{published:.6g}", *_digits(*numbers[1:])], low <= published <= high
    ours, drawn = f"{told[1]} ({told[2]} to {told[3]})", tuple(float(each.replace(",", "")) for each in told)
    return Line(f"{case} {condition}".strip(), metric, told[0], ours, is_met, command, numbers=drawn)


# -- the page -----------------------------------------------------------------------------------------------------


def section(said: Mapping[str, Any], lines: Sequence[Line], picture: str = "") -> str:
    """The table of a source, misses first, after its picture."""
    head = "| case | what | published | ours (95 % interval) | met | repeat with |\n|---|---|---|---|---|---|"
    rows = [
        f"| {line.case} | {line.asked} | {line.published} | {line.ours} | {'yes' if line.is_met else '**no**'} | "
        f"`{line.command}` |"
        for line in sorted(lines, key=lambda line: line.is_met)
    ]
    told = [f"## {said['title']}", said["source"], f"{sum(line.is_met for line in lines)} of {len(lines)} are met."]
    if "undecided" in said:
        told.append(f"Not compared: {said['undecided']}")
    told += ["\n".join(f"- {note}" for note in said["misses"])] if "misses" in said else []
    told += [f"![What is published, and ours]({picture}){{ .wide }}"] if picture else []
    return "\n\n".join([*told, "\n".join([head, *rows])])


def as_text(found: Mapping[str, Sequence[Line]]) -> str:
    """The lines of all sources as JSON, from which the page of the site is made."""
    return json.dumps({name: [asdict(line) for line in lines] for name, lines in found.items()}, indent=1) + "\n"


def of_text(text: str) -> dict[str, list[Line]]:
    """The lines in a JSON text."""
    found = json.loads(text)
    return {
        name: [Line(**{**each, "numbers": tuple(each["numbers"])}) for each in lines] for name, lines in found.items()
    }


def page(found: Mapping[str, Sequence[Line]], pictures: Mapping[str, str] = MappingProxyType({})) -> str:
    """The whole page, with pictures of some of the sources."""
    lines = [line for each in found.values() for line in each]
    intervals = [line for line in lines if line.is_interval]
    covered = 100.0 * sum(line.is_met for line in intervals) / len(intervals)
    verdict = "as it should be" if LEAST <= covered <= MOST else "not as it should be"
    head = (
        "# The truth board\n\nWhat others have published, beside what Epicycle finds. Written by `make truth`; the "
        "models are in `benchmarks/truth`.\n\n"
        f"{len(lines)} values are compared. Of {len(intervals)} intervals of 95 %, {covered:.1f} % hold the published "
        f"value, which is {verdict} ({LEAST:g} to {MOST:g} %)."
    )
    return (
        "\n\n".join([head, *(section(source(name), each, pictures.get(name, "")) for name, each in found.items())])
        + "\n"
    )
