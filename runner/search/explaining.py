"""Explain: which acts of aspects break a property in a run, and how the break follows from them."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from epicycle.actors import EpicycleError, did_you_mean, to_seconds

from ..build.model import Model
from ..engine import Interventions, Simulation
from ..graph.acts import Act, ActName
from ..graph.model_graph import ModelGraph
from ..results import Results, Verdict, canonical, plain
from .minimal import minimal
from .monitored import property_of
from .tried import NUMBER, Tried

RUNS = 500  # that a search makes at most by default
LIMIT, INTERRUPT = "limit", "interrupt"  # what ended a search too soon


@dataclass(frozen=True)
class Effect:
    """What one act of a smallest set does: the robustness of the property without it, and with it alone.

    ``act`` is the act in the run of the set, ``whole`` the one of that name in the whole run.  They may differ, because
    acts are counted, and the run takes another course without the others.
    """

    act: Act
    whole: Act
    without: float | None = None
    alone: float | None = None

    @property
    def has_moved(self) -> bool:
        """Whether the act of that name is another one in the whole run."""
        return (self.act.time, self.act.source, self.act.token) != (
            self.whole.time,
            self.whole.source,
            self.whole.token,
        )


@dataclass(frozen=True)
class Step:
    """The first send of a port that is another one without an act; one of the tokens is None if nothing was sent."""

    port: str
    time: float  # s
    token: Any
    instead: Any


@dataclass(frozen=True)
class Explanation:
    """A smallest set of acts that breaks a property in a run.

    With these acts and no others it is broken, and without any single one of them it holds: ``effects``, in the order
    in which they happen.  There are none if it is broken without any act.  ``steps`` lead from the first act to a port
    that the property asks for.  If the search was ended before that, by ``LIMIT`` or ``INTERRUPT``, the set breaks the
    property, but need not be minimal.  With ``only``, acts of other aspects, the ``others``, happen in all runs.
    """

    model: str
    seed: int
    monitor: str
    source: str  # its property
    verdict: Verdict  # of the run as it was
    verdict_of_set: Verdict
    verdict_of_none: Verdict
    acts: int  # that may be in the set: those of the run up to when it broke
    effects: list[Effect]
    steps: list[Step] = field(default_factory=list)
    runs: int = 0  # that were made now
    limit: int = RUNS
    ended: str = ""
    only: tuple[str, ...] = ()
    others: frozenset[ActName] = frozenset()
    also: tuple[str, ...] = ()  # other monitors that are broken in the whole run

    @property
    def names(self) -> list[ActName]:
        """The acts of the set."""
        return [each.act.name for each in self.effects]


_NONE = type(None)
_SHAPE = [(bool, _NONE), (*NUMBER, _NONE), [(int,)]]  # of an outcome


class _LimitError(Exception):
    """There are as many runs as a search may make."""


class _Runs:
    """Runs of a model in which some acts happen and, of those that are looked at, no others."""

    def __init__(self, model: Model, seed: int | None, until: float | None, limit: int) -> None:
        self.model = model
        self.monitor = ""
        self.seed = seed
        self.until = until
        self.limit = limit
        self.number = 0
        self.tried = Tried(model, {}, _SHAPE)
        self.others: frozenset[ActName] = frozenset()  # which happen in all runs
        self.order: list[ActName] = []  # of the acts by name, to which the outcomes refer
        self.best: frozenset[ActName] | None = None  # the smallest set so far
        self.looks_ahead = False
        self._asked: dict[frozenset[ActName], list[Any]] = {}

    def results(self, exactly: Collection[ActName] | None, *, keep_log: bool = False) -> Results:
        """What comes of the run with these acts; with None, with all."""
        self.number += 1
        acts = Interventions(None if exactly is None else self.others.union(exactly))
        return Simulation(self.model, seed=self.seed, acts=acts, keep_log=keep_log).run(until=self.until)

    def _outcome(self, names: frozenset[ActName]) -> list[Any]:
        """Whether the property holds, its robustness, and if it is broken the places of acts that are not to blame."""

        def found() -> list[Any]:
            results = self.results(names)
            verdict = results.monitors[self.monitor]
            if verdict.holds is not False:
                return [verdict.holds, verdict.robustness, []]
            acting = {act.name for act in self.up_to(verdict, results.acts)}
            idle = [place for place, name in enumerate(self.order) if name in names and name not in acting]
            return [verdict.holds, verdict.robustness, idle]

        if names not in self._asked:
            # A digest, as there may be thousands of names.
            key = hashlib.sha256("; ".join(map(str, sorted(names))).encode()).hexdigest()[:32]
            self._asked[names] = self.tried.outcome(key, found)
        return self._asked[names]

    def breaks(self, names: frozenset[ActName]) -> bool:
        """Whether the property is broken with these acts; raises ``_LimitError``."""
        # Runs that are known count too, so that a search that was killed comes to the same.
        if names not in self._asked and len(self._asked) >= self.limit:
            raise _LimitError
        is_broken = self._outcome(names)[0] is False
        if is_broken and (self.best is None or len(names) < len(self.best)):
            self.best = names
        return is_broken

    def up_to(self, verdict: Verdict, acts: Iterable[Act]) -> list[Act]:
        """The acts that may have broken a property: not later ones, unless it looks ahead."""
        return [act for act in acts if self.looks_ahead or verdict.time is None or to_seconds(act.time) <= verdict.time]

    def active(self, names: frozenset[ActName]) -> frozenset[ActName]:
        """The acts of a set that breaks the property which happen, and before it is broken."""
        return names.difference(self.order[place] for place in self._outcome(names)[2])

    def effect(self, names: frozenset[ActName], name: ActName) -> tuple[float | None, float | None]:
        """The robustness without an act of a set, and with it alone."""
        without, alone = (self._outcome(each)[1] for each in (names - {name}, frozenset([name])))
        return without, alone

    @property
    def asked(self) -> int:
        """How many sets were tried, now or before."""
        return len(self._asked)


def explain(
    model: Model,
    monitors: Sequence[str],
    *,
    seed: int | None = None,
    until: float | None = None,
    limit: int = RUNS,
    only: Collection[str] = (),
    folder: Path | None = None,
    tell: Callable[[int, int], None] | None = None,
) -> Explanation:
    """Find a smallest set of acts that breaks the monitor of a model that is broken first in a run.

    With ``only``, of the acts of these aspects; those of others happen as in the whole run.  At most ``limit`` sets are
    tried.  After that, or an interrupt, the smallest set so far is the answer.  In a ``folder``, every run is noted; a
    search that ended continues there.  ``tell`` is called with how many sets were tried, and how many acts the smallest
    one has.  Raises ``EpicycleError`` if the run does not break it.
    """
    sources = {monitor: property_of(model, monitor) for monitor in monitors}
    chosen = _chosen(model, only)
    runs = _Runs(model, seed, until, limit)
    whole = runs.results(model.exactly)
    monitor, *also = _broken(model.name, {each: whole.monitors[each] for each in monitors})
    runs.monitor, verdict, source = monitor, whole.monitors[monitor], sources[monitor]
    about = {
        "model": model.name,
        "seed": whole.seed,
        "until": until,
        "property": source,
        "digest": whole.digest,
        "only": sorted(chosen),
    }
    runs.tried = Tried(model, about, _SHAPE, folder)
    acts = {act.name: act for act in whole.acts}
    mine = [name for name in acts if not chosen or name.aspect in chosen]
    runs.order, runs.others = sorted(mine), frozenset(acts).difference(mine)

    def breaks(names: frozenset[ActName]) -> bool:
        found = runs.breaks(names)
        if tell is not None:
            tell(runs.asked, len(mine) if runs.best is None else len(runs.best))
        return found

    none: frozenset[ActName] = frozenset()
    before = [act.name for act in runs.up_to(verdict, whole.acts) if act.name not in runs.others]
    candidates, ended, effects = mine, "", dict[ActName, tuple[float | None, float | None]]()
    try:
        if not breaks(none):
            candidates = before
            if not breaks(frozenset(before)):
                candidates, runs.looks_ahead = mine, True
                if not breaks(frozenset(mine)):
                    raise EpicycleError(
                        f"monitor {monitor} holds where all {len(mine):,} acts of this run happen and no others: what "
                        "broke it left nothing in the event log"
                    )
            names = frozenset(minimal(candidates, breaks, runs.active))
            effects = {name: runs.effect(names, name) for name in names}
    except (_LimitError, KeyboardInterrupt) as end:
        ended = LIMIT if isinstance(end, _LimitError) else INTERRUPT
    best = frozenset(mine) if runs.best is None else runs.best
    with_set, with_none = runs.results(best, keep_log=True), runs.results(none)
    if ended:  # perhaps before the acts were left out that are not to blame
        acting = best.intersection(act.name for act in runs.up_to(with_set.monitors[monitor], with_set.acts))
        fewer = runs.results(acting, keep_log=True)
        if fewer.monitors[monitor].holds is False:
            best, with_set = acting, fewer
    there = {act.name: act for act in with_set.acts if act.name in best}
    # An act that is not noted in the run of the set is reported as it was.
    there |= {name: acts[name] for name in runs.order if name in best and name not in there}
    steps = []
    if there and not ended:
        ports = next(each.ports for each in model.output.monitors if each.name == monitor)
        rest = runs.results(best - {next(iter(there))}, keep_log=True)
        steps = _steps(model.graph, ports, with_set, rest)
    return Explanation(
        model.name,
        whole.seed,
        monitor,
        source,
        verdict,
        with_set.monitors[monitor],
        with_none.monitors[monitor],
        len(candidates),
        [Effect(act, acts[name], *effects.get(name, ())) for name, act in there.items()],
        steps,
        runs.number,
        limit,
        ended,
        tuple(sorted(chosen)),
        runs.others,
        tuple(also),
    )


def _broken(model: str, verdicts: Mapping[str, Verdict]) -> list[str]:
    """The monitors that are broken, in the order in which they are; raises ``EpicycleError`` if none is."""
    times = {
        name: math.inf if each.time is None else each.time for name, each in verdicts.items() if each.holds is False
    }
    if times:
        return sorted(times, key=lambda name: times[name])
    states = []
    for name, verdict in verdicts.items():
        reason = f" ({verdict.missing})" if verdict.missing else ""
        states.append(
            f"monitor {name} {'holds' if verdict.holds else 'cannot be judged'} in this run of {model}{reason}"
        )
    raise EpicycleError(f"{' and '.join(states)}: there is nothing to explain")


def _chosen(model: Model, only: Collection[str]) -> frozenset[str]:
    """The aspects whose acts are looked at, where not all are; raises ``EpicycleError``."""
    known = [woven.name for woven in model.aspects]
    for name in only:
        if name not in known:
            raise EpicycleError(
                f"{model.name} has no aspect {name!r}{did_you_mean(name, known)}\n"
                f"   help: its aspects: {', '.join(known) or 'none'}"
            )
    return frozenset(only)


def _steps(graph: ModelGraph, ports: Collection[str], ours: Results, theirs: Results) -> list[Step]:
    """The way of a difference between two runs, backwards from a port by the sources that differed first."""
    differing = _differing(ours, theirs)
    found: list[Step] = []
    sources = {source.path for port in ports for source in graph.source_of(port)}
    while sources := {each for each in sources if each in differing and differing[each].port not in _ports(found)}:
        step = min((differing[each] for each in sources), key=lambda each: (each.time, each.port))
        if found and step.time > found[-1].time:
            break
        found.append(step)
        inputs = graph.actors[graph.owner(step.port)].inputs.values()
        sources = {wire.source.path for port in inputs for wire in graph.wires_to(port)}
    return found[::-1]


def _ports(steps: Collection[Step]) -> set[str]:
    return {each.port for each in steps}


def _differing(ours: Results, theirs: Results) -> dict[str, Step]:
    """The first send of each port that is not the same in both runs."""
    sends = [_sends(each) for each in (ours, theirs)]
    found = {}
    for port in dict.fromkeys([*sends[0], *sends[1]]):
        first, second = (each.get(port, []) for each in sends)
        place = next((n for n, (a, b) in enumerate(zip(first, second, strict=False)) if a[:3] != b[:3]), None)
        if place is None and len(first) == len(second):
            continue
        place = min(len(first), len(second)) if place is None else place
        one, other = (each[place] if place < len(each) else None for each in (first, second))
        time = min(each[0] for each in (one, other) if each is not None)
        tokens = [None if each is None or each[0] > time else plain(each[3]) for each in (one, other)]
        found[port] = Step(port, to_seconds(time), *tokens)
    return found


def _sends(results: Results) -> dict[str, list[tuple[int, int, bytes, Any]]]:
    found: dict[str, list[tuple[int, int, bytes, Any]]] = {}
    for record in results.log.records:
        if record.event == "send":
            send = (record.tag.time, record.tag.microstep, canonical(record.value), record.value)
            found.setdefault(f"{record.actor}.{record.port}", []).append(send)
    return found
