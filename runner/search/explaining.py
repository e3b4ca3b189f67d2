"""Explain: which acts of aspects break a property in a run, and how the break follows from them."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from epicycle.actors import EpicycleError, to_seconds

from ..build import Model
from ..engine import Acts, Simulation
from ..graph import Act, ActName, ModelGraph
from ..results import Results, Verdict, canonical, plain
from .minimal import minimal
from .monitored import property_of
from .tried import NUMBER, Tried


@dataclass(frozen=True)
class Effect:
    """What one act of a smallest set does: the robustness of the property without it, and with it alone."""

    act: Act
    without: float | None
    alone: float | None


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
    that the property asks for.
    """

    model: str
    seed: int
    monitor: str
    source: str  # its property
    verdict: Verdict  # of the run as it was
    verdict_of_set: Verdict
    verdict_of_none: Verdict
    acts: int  # of the run up to when it broke
    effects: list[Effect]
    steps: list[Step] = field(default_factory=list)
    runs: int = 0

    @property
    def names(self) -> list[ActName]:
        """The acts of the set."""
        return [each.act.name for each in self.effects]


_NONE = type(None)
_SHAPE = [(bool, _NONE), (*NUMBER, _NONE)]  # of an outcome: whether the property holds, and its robustness


class _Runs:
    """Runs of a model in which some acts happen and no others."""

    def __init__(self, model: Model, monitor: str, seed: int | None, until: float | None) -> None:
        self.model = model
        self.monitor = monitor
        self.seed = seed
        self.until = until
        self.number = 0
        self.tried = Tried(model, {}, _SHAPE)

    def results(self, exactly: Collection[ActName] | None, *, keep_log: bool = False) -> Results:
        """What comes of the run with these acts; with None, with all."""
        self.number += 1
        simulation = Simulation(self.model, seed=self.seed, acts=Acts(exactly), keep_log=keep_log)
        return simulation.run(until=self.until)

    def _outcome(self, names: Collection[ActName]) -> list[Any]:
        def found() -> list[Any]:
            verdict = self.results(names).monitors[self.monitor]
            return [verdict.holds, verdict.robustness]

        outcome: list[Any] = self.tried.outcome("; ".join(map(str, sorted(names))), found)
        return outcome

    def breaks(self, names: Collection[ActName]) -> bool:
        """Whether the property is broken with these acts."""
        return self._outcome(names)[0] is False

    def robustness(self, names: Collection[ActName]) -> float | None:
        """Its robustness with these acts."""
        margin: float | None = self._outcome(names)[1]
        return margin


def explain(
    model: Model,
    monitor: str,
    *,
    seed: int | None = None,
    until: float | None = None,
    folder: Path | None = None,
    tell: Callable[[int, int], None] | None = None,
) -> Explanation:
    """Find a smallest set of acts that breaks a monitor of a model in a run.

    In a ``folder``, every run is noted, and a search that was killed continues there.  ``tell`` is called with how many
    runs were made, and how many acts the last one had.  Raises ``EpicycleError`` if the run does not break it.
    """
    source = property_of(model, monitor)
    runs = _Runs(model, monitor, seed, until)
    whole = runs.results(model.exactly)
    verdict = whole.monitors[monitor]
    if verdict.holds is not False:
        state = "holds" if verdict.holds else "cannot be judged"
        reason = f" ({verdict.missing})" if verdict.missing else ""
        raise EpicycleError(
            f"monitor {monitor} {state} in this run of {model.name}{reason}: there is nothing to explain"
        )

    def breaks(names: frozenset[ActName]) -> bool:
        if tell is not None:
            tell(runs.number, len(names))
        return runs.breaks(names)

    about = {
        "model": model.name,
        "seed": whole.seed,
        "until": until,
        "property": source,
        "digest": whole.digest,
    }
    runs.tried = Tried(model, about, _SHAPE, folder)
    acts = {act.name: act for act in whole.acts}
    # What comes after the break cannot have caused it, unless the property looks ahead.
    before = [name for name, act in acts.items() if verdict.time is None or to_seconds(act.time) <= verdict.time]
    candidates = before if len(before) == len(acts) or runs.breaks(before) else list(acts)
    names = [] if runs.breaks(()) else minimal(candidates, breaks)
    with_set, with_none = runs.results(names, keep_log=True), runs.results((), keep_log=True)
    effects = [
        Effect(acts[name], runs.robustness([each for each in names if each != name]), runs.robustness([name]))
        for name in names
    ]
    ports = next(each.ports for each in model.monitors if each.name == monitor)
    steps = []
    if names:
        rest = runs.results(names[1:], keep_log=True)
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
        effects,
        steps,
        runs.number,
    )


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
