"""Searches over runs, and variants compared: each a call, whose answer is printed and saved."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from ...search.spec import GOALS, Break, Goal, Match
from ...support.declare.commands import add_options, arguments, declared
from ...support.printing import complain, tell, tell_json
from ..calls import running, searching, studying
from ..calls import what_if as calls_what_if
from .options import (
    BROKEN,
    DONE,
    FAILED,
    INTERRUPTED,
    JSON,
    command,
    of_call,
    open_run,
    option,
    several,
    taken,
)

if TYPE_CHECKING:
    from ...search.comparing import Comparison

# -- search -----------------------------------------------------------------------------------------------------------


def _goals(parser: argparse.ArgumentParser) -> None:
    """The goals, of which one is chosen, and what each of them takes."""
    chosen, known = parser.add_mutually_exclusive_group(required=True), set[str]()
    for goal in GOALS:
        first, *others = (each.name for each in declared(goal))
        add_options(chosen, goal, without=others, dest={first: goal.__name__})
        add_options(parser, goal, without={first, *known})
        known.update(others)


def _goal(options: argparse.Namespace) -> Goal:
    """The goal that the options name; raises ``EpicycleError`` for options of another one."""
    from epicycle.actors import EpicycleError

    takers: dict[tuple[str, str], list[type[Goal]]] = {}  # by the name and the flag of what they take
    for goal in GOALS:
        for each in [*declared(goal)][1:]:
            takers.setdefault((each.name, each.flag), []).append(goal)
    [kind] = [goal for goal in GOALS if hasattr(options, goal.__name__)]
    given: Any = {}
    for (name, flag), goals in takers.items():
        if hasattr(options, name):
            if kind not in goals:
                raise EpicycleError(f"{flag} is for {' and '.join(next(declared(goal)).flag for goal in goals)}")
            given[name] = getattr(options, name)
    chosen: Any = getattr(options, kind.__name__) or None
    return kind(chosen, **given)


@of_call(searching.search, JSON, first=(_goals,), imports=("search.falsifying", "search.optimising"))
def search(options: argparse.Namespace) -> int:
    """Search for what the goal says; the exit code is 3 if a broken run was found, and 1 if nothing was that counts."""
    goal = _goal(options)
    given = arguments(searching.search, options)

    def code(found: Any) -> int:
        if isinstance(goal, Break):
            return BROKEN if found.broken is not None else FAILED if found.failed else DONE
        return DONE if isinstance(goal, Match) or found.best is not None else FAILED

    return answer(options, lambda: searching.search(goal=goal, command=options.given, **given), code)


# -- one run ----------------------------------------------------------------------------------------------------------


@of_call(
    searching.explain,
    option("--no-page", action="store_true", help="write no page with both runs"),
    JSON,
    imports=("search.explaining",),
)
def explain(options: argparse.Namespace) -> int:
    """Find faults; an interrupted search has an answer, too."""
    found = _about(options, searching.explain, flag="--monitor")
    return answer(
        options,
        found,
        lambda found: INTERRUPTED if found.is_interrupted else DONE,
        page=not options.no_page,
    )


@of_call(
    calls_what_if.what_if,
    option("--no-page", action="store_true", help="write no page with both futures"),
    JSON,
    imports=("search.what_if",),
)
def what_if(options: argparse.Namespace) -> int:
    """Change a run from a tag on."""
    given = arguments(calls_what_if.what_if, options)
    return answer(options, lambda: calls_what_if.what_if(**given), lambda _: DONE, page=not options.no_page)


@of_call(searching.rare, JSON, imports=("search.splitting",))
def rare(options: argparse.Namespace) -> int:
    """Estimate a probability."""
    return answer(options, _about(options, searching.rare), lambda _: DONE)


def _about(options: argparse.Namespace, call: Callable[..., Any], **more: Any) -> Callable[[], Any]:
    """A call about the run that the options name, which is opened at once."""
    run = open_run(options, call, options.model)
    changes = {each.name for each in declared(running.load)}
    given = {name: value for name, value in arguments(call, options).items() if name not in changes}
    given |= {"seed": run.seed, "until": run.until, **more}
    return lambda: call(run.model, **given)


def answer(options: argparse.Namespace, search: Callable[[], Any], code: Callable[[Any], int], **saving: Any) -> int:
    """Make a search, tell what it found and the files that have it, and give its exit code."""
    from ...study.run.store import WriteError
    from ...support.apart import WorkerError

    try:
        found = search()
    except KeyboardInterrupt:
        complain("interrupted; finished runs are kept: the same command continues")
        return INTERRUPTED
    except (WorkerError, WriteError) as error:
        complain(f"error: {error}")
        return FAILED
    paths = found.save(**saving)
    if options.json:
        tell_json(found.facts())
        return code(found)
    tell(str(found))
    for path in paths:
        tell(f"wrote {path}")
    return code(found)


# -- variants ---------------------------------------------------------------------------------------------------------

_VARIED = {"set", "overrides", "aspects", "without_aspects", "max_actors", "types"}


@command(
    "compare variants of a model in pairs of runs",
    taken(running.load, without={"disturb"}),
    several(
        "--disturb",
        metavar="NAME or FILE",
        help="add a variant with this disturbance, a packaged one or a YAML file; 'none' is the unchanged model; "
        "may be repeated",
    ),
    several(
        "--vary",
        metavar="PATH=VALUE,...",
        help="add a variant with this parameter, such as load=0.9, or several: load=0.9,servers=2; may be repeated",
    ),
    taken(studying.compare, without={"model"}),
    option("--page", action="store_true", help="write a page with the first runs of the first two variants"),
    JSON,
    imports=("search.comparing",),
)
def compare(options: argparse.Namespace) -> int:
    """Run variants of a model with the same seeds and compare their metrics with those of the first variant: the mean
    difference over pairs of runs, its 95 % interval, and the p-value of Student's paired test, corrected by Holm's
    method.  A single variant is compared with the unchanged model."""
    from ...model.language.settings import parse_settings
    from ...model.text.problems import Problems

    common = {name: value for name, value in arguments(running.load, options).items() if name in _VARIED}
    variants = {name: common if name == "none" else {**common, "disturb": name} for name in options.disturb}
    problems = Problems()
    varied = {each: parse_settings(each, problems, "--vary") for each in options.vary}
    problems.raise_if_any()
    own = common.get("set", [])
    variants |= {each: {**common, "set": [*own, *settings]} for each, settings in varied.items()}
    if len(variants) == 1:
        variants = {"none": common, **variants}
    given = arguments(studying.compare, options)
    models = {name: running.load(options.model, **changes) for name, changes in variants.items()}

    def code(found: Comparison) -> int:
        for (name, seed), error in found.failures.items():
            complain(f"error: {name}, seed {seed}: {error}")
        return FAILED if found.failures else DONE

    return answer(options, lambda: studying.compare(**given, variants=models), code, page=options.page)
