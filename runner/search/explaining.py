"""Explain: which acts of aspects break a property in a run, and how the break follows from them."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from itertools import chain, islice, zip_longest
from pathlib import Path
from typing import Any, NamedTuple

from epicycle.actors import EpicycleError, paths, to_seconds

from ..execution.engine import Interventions, Simulation
from ..execution.results import Results, Verdict, canonical, plain
from ..model.build.model import Model
from ..model.graph.acts import Act, ActName
from ..model.graph.model_graph import ModelGraph
from ..model.temporal import looks_ahead
from ..study.run.processes import Worker
from .cache import NUMBER, EvaluationCache
from .evaluator import Evaluator
from .explanation import INTERRUPT, LIMIT, RUNS, Effect, Explanation, Step
from .minimal import minimal, parts
from .monitored import aspect_named, property_of

_NONE = type(None)
_ALIKE = (None, None)
_SHAPE = [(bool, _NONE), (*NUMBER, _NONE), [(int,)]]  # of an outcome
Acts = frozenset[ActName]
Sends = dict[str, list[tuple[int, int, bytes, Any]]]  # by port: time (ns), microstep, and the token in both forms


class _LimitError(Exception):
    """There are as many runs as a search may make."""


class _Run(NamedTuple):
    """What is kept of a run: verdicts by monitor; its acts, if one is broken; and with its log, what ports sent."""

    verdicts: dict[str, Verdict]
    acts: list[Act]
    sends: Sends


class _Worker(Worker):
    """Makes runs of a model in which some acts happen, and no others."""

    def __init__(self, model: Model, seed: int | None, until: float | None) -> None:
        self._model, self._seed, self._until = model, seed, until

    def results(self, exactly: Collection[ActName] | None, *, keep_log: bool = False) -> Results:
        """What comes of the run with these acts; with None, with all."""
        acts = Interventions(None if exactly is None else frozenset(exactly))
        return Simulation(self._model, seed=self._seed, acts=acts, keep_log=keep_log).run(until=self._until)

    def make(self, request: tuple[Acts, bool]) -> _Run:
        """The run with these acts, with its log or not."""
        exactly, keep_log = request
        results = self.results(exactly, keep_log=keep_log)
        is_asked = keep_log or any(each.holds is False for each in results.monitors.values())
        return _Run(results.monitors, results.acts if is_asked else [], _sends(results) if keep_log else {})


def _up_to(verdict: Verdict, acts: Iterable[Act], looks_ahead: bool) -> list[Act]:
    """The acts that may have broken a property: not later ones, unless it looks ahead."""
    return [act for act in acts if looks_ahead or verdict.time is None or to_seconds(act.time) <= verdict.time]


class _Sets:
    """Sets of acts that a search asks about, each once and as many as its limit; the ``others`` happen in all runs."""

    def __init__(
        self,
        evaluator: Evaluator,
        cache: EvaluationCache,
        monitor: str,
        acts: Iterable[ActName],
        others: Acts,
        limit: int,
    ) -> None:
        self._evaluator, self._cache, self._monitor = evaluator, cache, monitor
        self._order = sorted(acts)  # to which the outcomes refer
        self._others, self._limit = others, limit
        self._asked: dict[Acts, list[Any]] = {}
        self._verdicts: dict[Acts, Verdict] = {}  # of the sets whose runs were made now
        self.best: Acts | None = None  # the smallest set so far
        self.looks_ahead = False
        self.made = 0  # runs that were made now

    def run(self, names: Acts, keep_log: bool = False) -> _Run:
        """The run with these acts."""
        made: _Run = self._evaluator.make(*self._request(names, keep_log))
        return made

    def _request(self, names: Acts, keep_log: bool = False) -> tuple[object, object]:
        return (names, keep_log), (self._others | names, keep_log)

    def _outcome(self, names: Acts) -> list[Any]:
        """Whether the property holds, its robustness, and if it is broken the places of acts that are not to blame."""

        def found() -> list[Any]:
            self.made += 1
            run = self.run(names)
            verdict, idle = run.verdicts[self._monitor], list[int]()
            self._verdicts[names] = verdict
            if verdict.holds is False:
                acting = {act.name for act in _up_to(verdict, run.acts, self.looks_ahead)}
                idle = [place for place, each in enumerate(self._order) if each in names and each not in acting]
            return [verdict.holds, verdict.robustness, idle]

        if names not in self._asked:
            self._asked[names] = self._cache.outcome(_key(names), found)
        return self._asked[names]

    def expect(self, sets: Iterable[Acts], answer: Sequence[ActName] = ()) -> None:
        """Say what will probably be asked next; and if there is an answer then, what is asked about this."""
        names = frozenset(answer)
        about = (each for name in answer for each in (names - {name}, frozenset([name])))
        new = (each for each in chain(sets, about) if each not in self._asked and _key(each) not in self._cache)
        some = islice(new, max(self._limit - len(self._asked), 0))
        last = (self._request(each, True) for each in (names, names.difference(answer[:1])) if answer)
        self._evaluator.expect(chain(map(self._request, some), last))

    def verdict(self, names: Acts) -> Verdict:
        """The whole verdict on a set."""
        return self._verdicts.get(names) or self.run(names).verdicts[self._monitor]

    def breaks(self, names: Acts) -> bool:
        """Whether the property is broken with these acts; raises ``_LimitError``."""
        # Runs that are known count too, so that a search that was killed comes to the same.
        if names not in self._asked and len(self._asked) >= self._limit:
            raise _LimitError
        is_broken = self._outcome(names)[0] is False
        if is_broken and (self.best is None or len(names) < len(self.best)):
            self.best = names
        return is_broken

    def active(self, names: Acts) -> Acts:
        """The acts of a set that breaks the property which happen, and before it is broken."""
        return names.difference(self._order[place] for place in self._outcome(names)[2])

    def effect(self, names: Acts, name: ActName) -> tuple[float | None, float | None]:
        """The robustness without an act of a set, and with it alone."""
        without, alone = (self._outcome(each)[1] for each in (names - {name}, frozenset([name])))
        return without, alone

    @property
    def asked(self) -> int:
        """How many sets were tried, now or before."""
        return len(self._asked)


def _key(names: Iterable[ActName]) -> str:
    """A digest, as there may be thousands of names."""
    return hashlib.sha256("; ".join(map(str, sorted(names))).encode()).hexdigest()[:32]


def explain(
    model: Model,
    monitors: Sequence[str],
    *,
    seed: int | None = None,
    until: float | None = None,
    limit: int = RUNS,
    only: Collection[str] = (),
    folder: Path | None = None,
    jobs: int | None = None,
    tell: Callable[[int, int], None] | None = None,
    command: Sequence[str] = (),
) -> Explanation:
    """Find a smallest set of acts that breaks the monitor of a model that is broken first in a run.

    With ``only``, of the acts of these aspects; those of others happen as in the whole run.  At most ``limit`` sets are
    tried.  After that, or an interrupt, the smallest set so far is the answer.  In a ``folder``, every run is noted; a
    search that ended continues there.  ``tell`` is called with how many sets were tried, and how many acts the smallest
    one has.  Raises ``EpicycleError`` if the run does not break it.
    """
    sources = {monitor: property_of(model, monitor) for monitor in monitors}
    chosen = frozenset(aspect_named(model, name).name for name in only)  # of which the acts are looked at; if none, all
    none, ended, effects, steps = Acts(), "", dict[ActName, tuple[float | None, float | None]](), list[Step]()
    with Evaluator.of_model(_Worker, model, seed, until, jobs=jobs) as evaluator:
        if not chosen:  # so that nothing happens in this run, which is asked for whatever comes of the whole one
            evaluator.expect([((none, False), (none, False))])
        whole = _Worker(model, seed, until).results(model.exactly)
        monitor, *also = _broken(model.name, {each: whole.monitors[each] for each in monitors})
        verdict, source = whole.monitors[monitor], sources[monitor]
        asked = next(each for each in model.output.monitors if each.name == monitor)
        about = {
            "model": model.name,
            "seed": whole.seed,
            "until": until,
            "property": source,
            "digest": whole.digest,
            "only": sorted(chosen),
        }
        acts = {act.name: act for act in whole.acts}
        candidates = mine = [name for name in acts if not chosen or name.aspect in chosen]
        others = frozenset(acts).difference(mine)
        before = [act.name for act in _up_to(verdict, whole.acts, False) if act.name not in others]
        cache = EvaluationCache(model, about, _SHAPE, folder)
        sets = _Sets(evaluator, cache, monitor, mine, others, limit)

        def breaks(names: Acts) -> bool:
            found = sets.breaks(names)
            if tell is not None:
                tell(sets.asked, len(mine) if sets.best is None else len(sets.best))
            return found

        try:
            # Acts before the break seldom suffice for a property that is about what comes later.
            late = [mine] if any(looks_ahead(part.tree) for part in asked.parts) else []
            probably = mine if late else before
            sets.expect(map(frozenset, chain((none, before, *late), parts(probably))), probably)
            if not breaks(none):
                candidates = before
                if not breaks(frozenset(before)):
                    candidates, sets.looks_ahead = mine, True
                    if not breaks(frozenset(mine)):
                        raise EpicycleError(
                            f"monitor {monitor} holds where all {len(mine):,} faults of this run happen and no others: "
                            "what broke it left nothing in the event log"
                        )
                answer = minimal(candidates, breaks, sets.active, sets.expect)
                sets.expect((), answer)
                names = frozenset(answer)
                effects = {name: sets.effect(names, name) for name in answer}
        except (_LimitError, KeyboardInterrupt) as end:
            ended = LIMIT if isinstance(end, _LimitError) else INTERRUPT
            sets.expect(())
        best = frozenset(mine) if sets.best is None else sets.best
        with_set, verdict_of_none = sets.run(best, keep_log=True), sets.verdict(none)
        if ended:  # perhaps before the acts were left out that are not to blame
            to_blame = _up_to(with_set.verdicts[monitor], with_set.acts, sets.looks_ahead)
            acting = best.intersection(act.name for act in to_blame)
            fewer = sets.run(acting, keep_log=True)
            if fewer.verdicts[monitor].holds is False:
                best, with_set = acting, fewer
        there = {act.name: act for act in with_set.acts if act.name in best}
        # An act that is not noted in the run of the set is reported as it was.
        there |= {name: acts[name] for name in sorted(best) if name not in there}
        if there and not ended:
            rest = sets.run(best - {next(iter(there))}, keep_log=True)
            steps = _steps(model.graph, asked.ports, with_set.sends, rest.sends)
    return Explanation(
        model.name,
        whole.seed,
        monitor,
        source,
        verdict,
        with_set.verdicts[monitor],
        verdict_of_none,
        len(candidates),
        [Effect(act, acts[name], *effects.get(name, ())) for name, act in there.items()],
        steps,
        sets.made,
        limit,
        ended,
        tuple(sorted(chosen)),
        others,
        tuple(also),
        until,
        tuple(command),
        model,
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
        states.append(f"monitor {name} {verdict.said} in this run of {model}{reason}")
    raise EpicycleError(f"{' and '.join(states)}: there is nothing to explain")


def _steps(graph: ModelGraph, ports: Collection[str], ours: Sends, theirs: Sends) -> list[Step]:
    """The way of a difference between two runs, backwards from a port by the sources that differed first."""
    differing = _differing(ours, theirs)
    found: list[Step] = []
    sources = {source.path for port in ports for source in graph.source_of(port)}
    while sources := (sources & differing.keys()) - {each.port for each in found}:
        step = min((differing[each] for each in sources), key=lambda each: (each.time, each.port))
        if found and step.time > found[-1].time:
            break
        found.append(step)
        inputs = graph.actors[paths.parent(step.port)].inputs.values()
        sources = {wire.source.path for port in inputs for wire in graph.wires_to(port)}
    return found[::-1]


def _differing(ours: Sends, theirs: Sends) -> dict[str, Step]:
    """The first send of each port that is not the same in both runs."""
    found = {}
    for port in dict.fromkeys([*ours, *theirs]):
        pairs = zip_longest(ours.get(port, []), theirs.get(port, []))
        one, other = next((pair for pair in pairs if (pair[0] and pair[0][:3]) != (pair[1] and pair[1][:3])), _ALIKE)
        if one is other:
            continue
        time = min(each[0] for each in (one, other) if each is not None)
        tokens = [None if each is None or each[0] > time else each[3] for each in (one, other)]
        found[port] = Step(port, to_seconds(time), *tokens)
    return found


def _sends(results: Results) -> Sends:
    found: Sends = {}
    for record in results.log.records:
        if record.event == "send":
            # Tokens as plain data, which every process can read.
            send = (record.tag.time, record.tag.microstep, canonical(record.value), plain(record.value))
            found.setdefault(f"{record.actor}.{record.port}", []).append(send)
    return found
