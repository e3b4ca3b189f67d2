"""What if: a run that takes another course from a tag on, beside the one that it took."""

from __future__ import annotations

import copy
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar

from epicycle.actors import (
    EpicycleError,
    ParameterError,
    Tag,
    counted,
    declared_parameters,
    did_you_mean,
    to_nanoseconds,
)
from epicycle.aspects import ClockAspect, ExecutionAspect, JoinPoint, PortAspect

from ..desk import difference
from ..execution.engine import Interventions, Simulation
from ..execution.results import plain as plain_value
from ..model.build.model import Model
from ..model.graph.acts import Act
from ..model.graph.woven import WovenAspect
from ..model.language.settings import settings_of
from ..model.text.document import plain
from ..model.text.patterns import PatternError, select
from ..model.text.problems import Problems
from ..show.view import differing
from ..show.view.pages import Page, Watch, recorded
from ..study.run_spec import OpenedRun, opened, seconds, spec_of
from ..support.shown import short
from ..support.tables import Table
from .answer import Answer, listed
from .monitored import aspect_named

AS_IT_WAS, INSTEAD = "as it was", "what if"
_FEW = 8  # actors in a sentence

_FAILED = "failed"  # what ended a run in an error
_LET_THROUGH = re.compile(r"(?P<aspect>[^@#]+)(?:@(?P<place>[^#]+))?(?:#(?P<number>[1-9]\d{0,8}))?")
_TAG = re.compile(r"\(?\s*(?P<time>[^,()]+?)\s*(?:,\s*(?:microstep\s+)?(?P<microstep>\d{1,9})\s*)?\)?")


@dataclass(frozen=True)
class Changes:
    """What is other from a tag on: ``change`` are parameters, ``remove`` aspects, ``lose`` ports.

    ``let_through`` are aspects, ``ASPECT@PLACE`` or ``ASPECT@PLACE#N``: what each does next does not happen, or the
    N-th that it does there.
    """

    change: Iterable[str] | Mapping[str, object] = ()
    remove: Sequence[str] = ()
    let_through: Sequence[str] = ()
    lose: Sequence[str] = ()


def what_if(
    model: Model,
    at: Tag,
    changes: Changes,
    *,
    seed: int | None,
    until: float | None,
    progress: bool = True,
    watch: Watch | None = None,
) -> WhatIf:
    """Run a model as it is, and with changes from a tag on; raises ``EpicycleError``.

    ``watch`` gives what is called with the time of each run now and then, in place of a bar.
    """
    other, acts, words = forked(model, at, changes, seed=seed, until=until, watch=watch)
    page = recorded(
        [OpenedRun(each, seed, until) for each in (model, other)],
        names=[AS_IT_WAS, INSTEAD],
        acts=[None, acts],
        progress=progress,
        watch=watch,
    )
    if any(isinstance(each, KeyboardInterrupt) for each in page.errors):
        raise KeyboardInterrupt
    found = WhatIf(model, at, words, page)
    if found.before.stopped == _FAILED:
        raise page.errors[0]
    if found.first is not None and found.first.at < at:
        raise EpicycleError(
            f"two runs of {model.name} differ at {found.first.at}, before {at}: "
            "something depends on more than model and seed"
        )
    return found


def forked(
    model: Model,
    at: Tag,
    changes: Changes,
    *,
    seed: int | None = None,
    until: float | None = None,
    watch: Watch | None = None,
) -> tuple[Model, Interventions, list[str]]:
    """What makes the run with changes from a tag on: a model, the rules for acts of aspects; and the changes in words.

    Raises ``EpicycleError``.
    """
    other, words, always = copy.copy(model), list[str](), set[str]()

    def weave(aspect: _Changed | _Lost, places: Mapping[str, Any]) -> None:
        name = f"what_if_{len(always) + 1}"
        while any(woven.name == name for woven in other.aspects):
            name += "_"
        aspect.at_tag = at
        always.add(name)
        other.enlist([WovenAspect(name=name, aspect=aspect, **places)])

    for path, value in _parameters(model, changes.change).items():
        if path in model.graph.ports and (edges := model.graph.incoming(path)):
            raise EpicycleError(
                f"{path} gets its values over a connection, from {edges[0].source}: it cannot be changed"
            )
        changed = _Changed()
        changed.value = value
        weave(changed, {"parameters": [path]})
        words.append(f"{path} is {short(value)}")
    for name in changes.remove:
        _check_removable(model, name)
        words.append(f"{name} is removed")
    for port in changes.lose:
        ports = _selected("lose", port, list(model.graph.ports), f"{model.name} has no port")
        weave(_Lost(), {"ports": ports})
        words.append(f"the next token at {port} is lost")
    acts = _next_acts(model, at, changes.let_through, seed, until, watch)
    words += [f"{act.name.aspect} lets token {act.name.token} at {act.name.place} through" for act in acts]
    rules = Interventions(
        model.exactly,
        without=frozenset(act.name for act in acts),
        ends=dict.fromkeys(changes.remove, at),
        always=frozenset(always),
    )
    return other, rules, words


def tag_of(given: float | str | Tag) -> Tag:
    """A tag from a time (s, or with a unit), or from a tag as traces and pages show it; raises ``EpicycleError``."""
    if isinstance(given, Tag):
        return given
    found = _TAG.fullmatch(given) if isinstance(given, str) else None
    if isinstance(given, str) and found is None:
        raise EpicycleError(f"at {given!r}: expected a time, such as '3.2 s', or a tag: '(3.2 s, 1)'")
    time = seconds("at", given if found is None else found["time"])
    assert time is not None
    return Tag(to_nanoseconds(float(time)), int(found["microstep"] or 0) if found is not None else 0)


# -- parameters -------------------------------------------------------------------------------------------------------


def _parameters(model: Model, change: Iterable[str] | Mapping[str, object]) -> dict[str, Any]:
    """New values of parameters of actors, by path.

    A model that can be loaded again is loaded with the changes, and the values of its actors are compared: so they may
    be of parameters of the model, too.
    """
    problems = Problems()
    settings = settings_of(change, problems, "--change")
    problems.raise_if_any()
    if not settings:
        return {}
    spec = spec_of(model, None, None)
    if spec is None or spec.study:
        return _given(model, {each.path: plain(each.node) for each in settings})
    changed = opened(spec, more=settings).model
    found = {}
    for each in difference(model, changed).changes:
        if each.section in ("parameters", "figures"):
            continue
        actor = changed.graph.actors.get(each.path)
        declared = {} if actor is None else declared_parameters(type(actor))
        if each.section != "actors" or each.fact not in declared:
            raise EpicycleError(
                f"{', '.join(each.path for each in settings)} cannot change during a run: it changes more than "
                f"parameters of actors: {each.section} {str(each)[2:]}\n"
                "   help: compare it from the start, with epicycle compare"
            )
        found[f"{each.path}.{each.fact}"] = declared[each.fact].value_in(actor)
    return found


def _given(model: Model, values: Mapping[str, object]) -> dict[str, Any]:
    """The same for a model that a program has made, where values are those of actors."""
    graph, found = model.graph, {}
    known = [f"{path}.{name}" for path, actor in graph.actors.items() for name in declared_parameters(type(actor))]
    for pattern, value in values.items():
        for path in _selected("change", pattern, known, f"{model.name} has no parameter of an actor"):
            owner, _, name = path.rpartition(".")
            try:
                found[path] = declared_parameters(type(graph.actors[owner]))[name].convert(value)
            except ParameterError as error:
                raise EpicycleError(f"{path}: {error}") from None
    return found


def _selected(what: str, pattern: str, known: Sequence[str], unknown: str) -> list[str]:
    try:
        found = select(pattern, known)
    except PatternError as error:
        raise EpicycleError(f"{what} {pattern}: {error}") from None
    if not found:
        raise EpicycleError(f"{unknown} {pattern!r}{did_you_mean(pattern, known)}")
    return found


# -- aspects and tokens -----------------------------------------------------------------------------------------------


def _check_removable(model: Model, name: str) -> None:
    """Refuse an aspect that does more than to act on what passes it."""
    aspect = aspect_named(model, name).aspect
    is_self_acting = isinstance(aspect, ExecutionAspect) and type(aspect).begin is not ExecutionAspect.begin
    if isinstance(aspect, ClockAspect) or is_self_acting:
        kind = type(aspect).__name__
        raise EpicycleError(
            f"{name} cannot be removed during a run: a {kind} decides at its start what it does\n"
            f"   help: compare with a run without it from the start: epicycle view MODEL --without {name}"
        )


def _next_acts(
    model: Model, at: Tag, names: Sequence[str], seed: int | None, until: float | None, watch: Watch | None
) -> list[Act]:
    """What aspects do next, at a tag or after it; a name that is given twice means the next two acts."""
    wanted = []
    for each in names:
        if (said := _LET_THROUGH.fullmatch(each)) is None:
            raise EpicycleError(f"let through {each!r}: expected an aspect, such as lossy, lossy@gain.input or lossy#2")
        aspect_named(model, said["aspect"])
        wanted.append((said["aspect"], said["place"] or "", int(said["number"] or 1)))
    if not wanted:
        return []
    simulation = Simulation(model, seed=seed, acts=Interventions(model.exactly))
    noted = simulation.run(until=until, progress=watch(None) if watch else None).acts
    found: list[Act] = []
    for aspect, place, number in wanted:
        # An act at a single connection is also one at the port where this ends.
        mine = [
            act
            for act in noted
            if act.name.aspect == aspect and place in ("", act.name.place, act.name.place.rpartition(" -> ")[2])
        ]
        # Times are compared as they are shown, so that one can be copied.
        later = [act for act in mine if float(f"{act.time / 1e9:.9g}") >= at.seconds]
        left = sorted((act for act in later if act not in found), key=lambda act: act.time)
        if len(left) < number:
            last = f": the last time is {max(act.time for act in mine) / 1e9:.9g} s" if mine else ""
            where = f" at {place}" if place else ""
            times = counted(len(later), "time")
            raise EpicycleError(f"{aspect} acts {times}{where} at {at.seconds:.9g} s or later{last}")
        found.append(left[number - 1])
    return found


class _Changed(PortAspect):
    """Gives a parameter another value from a tag on."""

    in_model_time: ClassVar[bool] = True
    at_tag: Tag
    value: Any

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        point.forward(self.value if point.tag >= self.at_tag else token)


class _Lost(PortAspect):
    """Loses the first token from a tag on, at one of its places."""

    in_model_time: ClassVar[bool] = True
    events: ClassVar[tuple[str, ...]] = ("dropped",)
    at_tag: Tag

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        if point.tag < self.at_tag or "is over" in point.shared:
            point.forward(token)
        else:
            point.shared["is over"] = True
            point.act("dropped", token)


# -- what came of it ---------------------------------------------------------------------------------------------------


class WhatIf(Answer):
    """A run as it was, and the run with changes from a tag on: ``before`` and ``after`` are their results.

    ``first`` is the first firing that changes; ``record`` the first difference of the logs, in words; ``affected`` are
    the actors that do anything else, with the times (s) at which they begin to; ``error`` has ended the other future.
    """

    NAME: ClassVar[str] = "what_if"

    def __init__(self, model: Model, at: Tag, changes: list[str], page: Page) -> None:
        self.model, self.at, self.changes, self._page = model.name, at, changes, page
        before, after = (each.results for each in page.recordings)
        assert before is not None
        assert after is not None
        self.before, self.after = before, after
        changed = differing.changed(page.recordings)
        self.first = changed[0] if changed else None
        record = differing.difference(page.recordings)
        self.record: list[str] = [] if record is None else record["texts"]
        self.affected = {each.actor: each.time for each in changed}
        self.error = str(page.errors[0]) if page.errors else ""
        self._actors = len(model.graph.actors)

    @property
    def is_same(self) -> bool:
        """Whether nothing has changed: the logs are equal, bit for bit."""
        return self.before.digest == self.after.digest

    def _sentences(self) -> list[str]:
        what = f" {listed(self.changes)}." if self.changes else " nothing is changed."
        said = [f"From {self.at.seconds:.9g} s on,{what}"]
        if self.is_same:
            reason = (
                "Both futures have the same log"
                if not self.changes
                else "It makes no difference: both futures have the same log; what an actor reads only at its start "
                "does not change later"
            )
            return [*said, f"{reason}."]
        if self.first is not None:
            said.append(f"The first firing that changes is {self.first.actor} at {self.first.tag}.")
        whom = f": {listed([*self.affected], most=_FEW)}" if self.affected else ""
        do = "does" if len(self.affected) == 1 else "do"
        said.append(f"{len(self.affected):,} of {counted(self._actors, 'actor')} {do} something else{whom}.")
        for name, verdict in self.before.monitors.items():
            if (other := self.after.monitors[name]).holds != verdict.holds:
                said.append(f"Monitor {name}: {verdict.said} as it was, {other.said} instead.")
        if self.error:
            said.append(f"The other future ends in an error: {self.error}")
        return said

    def _facts(self) -> dict[str, Any]:
        both, first = {AS_IT_WAS: self.before, INSTEAD: self.after}, self.first
        return {
            "model": self.model,
            "seed": self.before.seed,
            "at": {"time": self.at.seconds, "microstep": self.at.microstep},
            "changes": self.changes,
            "same": self.is_same,
            "first_firing": first
            and {"actor": first.actor, "time": first.time, "microstep": first.at.microstep, "does": first.does},
            "first_difference": dict(zip(both, self.record, strict=False)),
            "affected": self.affected,
            "digests": {name: each.digest for name, each in both.items()},
            "stopped": {name: each.stopped for name, each in both.items()},
            "metrics": {name: plain_value(each.metrics) for name, each in both.items()},
            "monitors": {
                name: {key: asdict(verdict) for key, verdict in each.monitors.items()} for name, each in both.items()
            },
            "error": self.error,
        }

    def page(self) -> Page:
        """A page with both futures; the first firing that changes is marked."""
        self._page.story = self._sentences()
        return self._page

    def save(self, folder: str | Path | None = None, *, page: bool = True) -> list[Path]:
        """Write what_if.json and, unless refused, what_if.html."""
        [facts] = super().save(folder)
        return [facts, *([self.page().save(facts.with_suffix(".html"))] if page else [])]

    def _tables(self) -> list[Table]:
        units = {name: "" if unit == "1" else unit for name, unit in self.before.units.items()}
        metrics = [
            (name, each.shown(short), self.after.outcomes[name].shown(short), units.get(name, ""))
            for name, each in self.before.outcomes.items()
        ]
        verdicts = [(name, each.said, self.after.monitors[name].said) for name, each in self.before.monitors.items()]
        rows = [("first difference", *self.record)] if self.record else []
        if self.first is not None:
            rows.insert(0, (f"{self.first.actor} at {self.first.tag}", *self.first.does))
        return [
            Table(("", AS_IT_WAS, INSTEAD), rows),
            Table(("metric", AS_IT_WAS, INSTEAD, "unit"), metrics),
            Table(("monitor", AS_IT_WAS, INSTEAD), verdicts),
        ]
