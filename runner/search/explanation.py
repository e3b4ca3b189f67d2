"""What was found of why a run breaks a property: a smallest set of faults, what each does, and the way to the break."""

from __future__ import annotations

import copy
import shlex
from collections.abc import Iterable, Sequence
from dataclasses import InitVar, asdict, dataclass, field
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from epicycle.actors import counted, to_seconds

from ..execution.results import Verdict
from ..model.build.model import Model
from ..model.graph.acts import Act, ActName
from ..support.shown import short
from ..support.tables import Table
from .answer import Answer, listed

if TYPE_CHECKING:
    from ..show.view.pages import Page

RUNS = 500  # that a search makes at most by default
LIMIT, INTERRUPT = "limit", "interrupt"  # what ended a search too soon
_SHOWN = 60  # characters of a token
_ROWS = 50  # faults in the table
_TIMES = 10  # of faults that did the same, in the sentence
_MOVED = 3  # faults that were others in the whole run, in the sentence


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
        told = attrgetter("time", "source", "token")
        return bool(told(self.act) != told(self.whole))


@dataclass(frozen=True)
class Step:
    """The first send of a port that is another one without an act; one of the tokens is None if nothing was sent."""

    port: str
    time: float  # s
    token: Any
    instead: Any


@dataclass(repr=False)
class Explanation(Answer):
    """A smallest set of faults that breaks a property in a run.

    With these acts and no others it is broken, and without any single one of them it holds: ``effects``, in the order
    in which they happen.  There are none if it is broken without any act.  ``steps`` lead from the first act to a port
    that the property asks for.  If the search was ended before that, by ``LIMIT`` or ``INTERRUPT``, the set breaks the
    property, but need not be minimal.  With ``only``, acts of other aspects, the ``others``, happen in all runs.
    """

    NAME = "explanation"

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
    until: float | None = None
    command: Sequence[str] = ()  # that makes the run
    program: InitVar[Model] = None  # which is run for the page

    def __post_init__(self, program: Model) -> None:
        self._program = program

    @property
    def names(self) -> list[ActName]:
        """The acts of the set."""
        return [each.act.name for each in self.effects]

    def _sentences(self) -> list[str]:
        broken = f"{self.monitor} ({self.source}) is broken" + _at(self.verdict_of_set)
        chosen = listed(self.only, "or")
        if not self.effects:
            if self.others:
                said = [f"{broken} without any fault of {chosen}: other aspects or the model itself break it."]
            else:
                said = [f"{broken} without any fault of an aspect: the model breaks it by itself."]
            return [*said, *self._also()]
        if _at(self.verdict) != _at(self.verdict_of_set):
            broken += f" (in the whole run{_at(self.verdict)})"
        number = len(self.effects)
        what = "; ".join(f"{text} at {times}" for text, times in _grouped(self.effects))
        of_them = f" of {chosen}" if self.only else ""
        said = [
            f"{counted(number, 'fault')} of {self.acts:,}{of_them} {'suffices' if number == 1 else 'suffice'}: {what}.",
            f"With {'it' if number == 1 else 'these'} alone, {broken}.",
            self._minimal(number),
            *_moved(self.effects),
        ]
        if self.others:
            said.append(f"The faults of other aspects ({len(self.others):,}) happened as well.")
        return [*said, *self._also()]

    def _also(self) -> list[str]:
        also = self.also
        return [f"Also broken in the whole run: {', '.join(also)}."] if also else []

    def _minimal(self, number: int) -> str:
        if not self.ended:
            return f"Without {'it' if number == 1 else 'any single one of them'}, it holds."
        if self.ended == INTERRUPT:
            return "The search was interrupted: the set may not be minimal."
        return f"The search ended at its limit of {counted(self.limit, 'run')}: the set may not be minimal."

    def disturbance(self) -> str:
        """A disturbance file in which these acts happen, and no others."""
        happening = [*self.names, *sorted(self.others)]
        names = [{"aspect": name.aspect, "at": name.place, "token": name.token} for name in happening]
        head = {"disturbance": "explanation", "doc": f"{self.sentence} Run: {shlex.join(self.command)} --disturb FILE"}
        said: str = yaml.safe_dump(head, sort_keys=False, allow_unicode=True, width=110)
        if not names:
            return said + "exactly: []\n"
        return said + "exactly:\n" + "".join(f"  - {_flow(each)}\n" for each in names)

    def _facts(self) -> dict[str, Any]:
        return asdict(self) | {"others": sorted(self.others), "command": list(self.command)}

    def page(self, *, progress: bool = True) -> Page:
        """A page with the run of these acts beside the one without any."""
        from ..show.view.pages import recorded
        from ..study.run_spec import OpenedRun

        models = [copy.copy(self._program) for _ in range(2)]
        models[0].exactly, models[1].exactly = self.others.union(self.names), self.others
        names = [f"{counted(len(self.effects), 'fault')}", "no fault"]
        runs = [OpenedRun(model, self.seed, self.until) for model in models]
        return recorded(runs, names=names, progress=progress)

    @property
    def is_interrupted(self) -> bool:
        """Whether the search ended by an interrupt."""
        return self.ended == INTERRUPT

    def save(self, folder: str | Path | None = None, *, page: bool = True) -> list[Path]:
        """Write explanation.yaml (a disturbance), explanation.json and, unless refused, explanation.html."""
        [facts] = super().save(folder)
        disturbance = facts.with_suffix(".yaml")
        disturbance.write_text(self.disturbance(), encoding="utf-8")
        has_page = page and self.effects and not self.is_interrupted
        return [disturbance, facts, *([self.page().save(facts.with_suffix(".html"))] if has_page else [])]

    def _tables(self) -> list[Table]:
        found = self.effects
        moved = any(each.has_moved for each in found)
        effects = [
            (
                str(each.act.name),
                _when(each.act),
                *([_before(each)] if moved else []),
                ", ".join(each.act.events),
                each.act.source,
                *([] if self.ended else [short(each.without), short(each.alone)]),
            )
            for each in found[:_ROWS]
        ]
        heading = ("fault", "time", *(["in the whole run"] if moved else []), "what it did", "token from")
        if not self.ended:
            heading += ("robustness without it", "with it alone")
        if len(found) > _ROWS:
            effects.append((f"and {len(found) - _ROWS:,} more", *[""] * (len(heading) - 1)))
        steps = [(f"{each.time:.9g} s", each.port, _token(each.token), _token(each.instead)) for each in self.steps]
        return [Table(heading, effects), Table(("time", "first difference at", "with the faults", "without"), steps)]


def _grouped(effects: Iterable[Effect]) -> list[tuple[str, str]]:
    """What the acts did, in words, and when: those that did the same together."""
    times: dict[str, list[str]] = {}
    for each in effects:
        name, act = each.act.name, each.act
        came = "" if act.source == name.place or not act.source else f" a token of {act.source}"
        what = f"{name.aspect} {' and '.join(dict.fromkeys(act.events))}{came} at {name.place}"
        times.setdefault(what, []).append(_when(act))
    return [(what, listed(each, most=_TIMES)) for what, each in times.items()]


def _moved(effects: Iterable[Effect]) -> list[str]:
    """A sentence about acts that are others in the whole run than in that of the set, if there are any."""
    moved = [f"{each.act.name}: {_before(each)}" for each in effects if each.has_moved]
    if not moved:
        return []
    more = f"; and {len(moved) - _MOVED:,} more" if len(moved) > _MOVED else ""
    what = "One fault is" if len(moved) == 1 else f"{len(moved):,} faults are"
    return [f"{what} not the same in the whole run, which takes another course: {'; '.join(moved[:_MOVED])}{more}."]


def _before(effect: Effect) -> str:
    """The act of that name in the whole run, where it is another."""
    if not effect.has_moved:
        return "the same"
    told = [] if effect.whole.time == effect.act.time else [f"at {_when(effect.whole)}"]
    if effect.whole.source != effect.act.source:
        told.append(f"a token of {effect.whole.source}")
    elif effect.whole.token != effect.act.token:
        told.append("another token")
    return ", ".join(told)


def _when(act: Act) -> str:
    return f"{to_seconds(act.time):.9g} s"


def _at(verdict: Verdict) -> str:
    return "" if verdict.time is None else f" at {verdict.time:.9g} s"


def _token(token: Any) -> str:
    return "nothing" if token is None else short(token)[:_SHOWN]


def _flow(names: dict[str, Any]) -> str:
    line: str = yaml.safe_dump(names, default_flow_style=True, sort_keys=False, width=1_000)
    return line.strip()
