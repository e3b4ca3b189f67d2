"""Why a run breaks a property: what ``epicycle.explain`` and the command do."""

from __future__ import annotations

import copy
import json
import shlex
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Unpack

import yaml

from epicycle.actors import EpicycleError, counted, to_seconds

from ..build.model import Model
from ..graph.acts import Act
from ..provenance import version_of
from ..results import Verdict
from ..search import INTERRUPT, RUNS, Effect, Explanation, monitors_named
from ..search import explain as search
from ..shown import finite, short
from ..tables import Table, Tabled
from .run_spec import Changes, RunSpec, seconds
from .running import loaded
from .viewing import Page, recorded

_SHOWN = 60  # characters of a token
_ROWS = 50  # acts in the table
_TIMES = 10  # of acts that did the same, in the sentence
_MOVED = 3  # acts that were others in the whole run, in the sentence


class Explained(Tabled):
    """Which acts of aspects break a property in a run: a smallest set, what each does, and the way to the break.

    ``explanation`` holds the facts, ``sentence`` says them; ``save`` writes a disturbance with these acts alone, the
    facts as JSON, and a page with both runs.  ``command`` is what made the run.
    """

    def __init__(self, explanation: Explanation, model: Model, until: float | None, command: Sequence[str]) -> None:
        self.explanation = explanation
        self.command = list(command)
        self._model = model
        self._until = until

    @property
    def sentence(self) -> str:
        """What is to be known, in words."""
        found = self.explanation
        broken = f"{found.monitor} ({found.source}) is broken" + _at(found.verdict_of_set)
        if not found.effects:
            if found.others:
                said = [
                    f"{broken} without any act of {_either(found.only)}: other aspects or the model itself break it."
                ]
            else:
                said = [f"{broken} without any act of an aspect: the model breaks it by itself."]
            return " ".join([*said, *self._also()])
        if _at(found.verdict) != _at(found.verdict_of_set):
            broken += f" (in the whole run{_at(found.verdict)})"
        number = len(found.effects)
        what = "; ".join(f"{text} at {times}" for text, times in _grouped(found.effects))
        of_them = f" of {_either(found.only)}" if found.only else ""
        said = [
            f"{counted(number, 'act')} of {found.acts:,}{of_them} {'suffices' if number == 1 else 'suffice'}: {what}.",
            f"With {'it' if number == 1 else 'these'} alone, {broken}.",
            self._minimal(number),
            *_moved(found.effects),
        ]
        if found.others:
            said.append(f"The acts of other aspects ({len(found.others):,}) happened as well.")
        return " ".join([*said, *self._also()])

    def _also(self) -> list[str]:
        also = self.explanation.also
        return [f"Also broken in the whole run: {', '.join(also)}."] if also else []

    def _minimal(self, number: int) -> str:
        found = self.explanation
        if not found.ended:
            return f"Without {'it' if number == 1 else 'any single one of them'}, it holds."
        if found.ended == INTERRUPT:
            return "The search was interrupted: the set may not be minimal."
        return f"The search ended at its limit of {counted(found.limit, 'run')}: the set may not be minimal."

    def disturbance(self) -> str:
        """A disturbance file in which these acts happen, and no others."""
        happening = [*self.explanation.names, *sorted(self.explanation.others)]
        names = [{"aspect": name.aspect, "at": name.place, "token": name.token} for name in happening]
        head = {"disturbance": "explanation", "doc": f"{self.sentence} Run: {shlex.join(self.command)} --disturb FILE"}
        said: str = yaml.safe_dump(head, sort_keys=False, allow_unicode=True, width=110)
        if not names:
            return said + "exactly: []\n"
        return said + "exactly:\n" + "".join(f"  - {_flow(each)}\n" for each in names)

    def facts(self) -> dict[str, Any]:
        """Everything that was found, for programs."""
        found = finite(asdict(self.explanation) | {"others": sorted(self.explanation.others)})
        assert isinstance(found, dict)
        return {**found, "command": self.command, "sentence": self.sentence, "version": version_of("epicycle")}

    def page(self, *, progress: bool = True) -> Page:
        """A page with the run of these acts beside the one without any."""
        models, found = [copy.copy(self._model) for _ in range(2)], self.explanation
        models[0].exactly, models[1].exactly = found.others.union(found.names), found.others
        names = [f"{counted(len(found.effects), 'act')}", "no act"]
        return recorded(models, seed=self.explanation.seed, until=self._until, names=names, progress=progress)

    def save(self, folder: str | Path, *, page: bool = True) -> list[Path]:
        """Write explanation.yaml (a disturbance), explanation.json and, unless refused, explanation.html."""
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        written = [folder / "explanation.yaml", folder / "explanation.json"]
        written[0].write_text(self.disturbance(), encoding="utf-8")
        written[1].write_text(json.dumps(self.facts(), indent=2) + "\n", encoding="utf-8")
        if page and self.explanation.effects:
            written.append(self.page().save(folder / "explanation.html"))
        return written

    def __repr__(self) -> str:
        return f"<Explained: {self.sentence}>"

    def _caption(self) -> str:
        return self.sentence

    def _tables(self) -> list[Table]:
        found = self.explanation.effects
        moved = any(each.has_moved for each in found)
        effects = [
            (
                str(each.act.name),
                _when(each.act),
                *([_before(each)] if moved else []),
                ", ".join(each.act.events),
                each.act.source,
                *([] if self.explanation.ended else [short(each.without), short(each.alone)]),
            )
            for each in found[:_ROWS]
        ]
        heading = ("act", "time", *(["in the whole run"] if moved else []), "what it did", "token from")
        if not self.explanation.ended:
            heading += ("robustness without it", "with it alone")
        if len(found) > _ROWS:
            effects.append((f"and {len(found) - _ROWS:,} more", *[""] * (len(heading) - 1)))
        steps = [
            (f"{each.time:.9g} s", each.port, _token(each.token), _token(each.instead))
            for each in self.explanation.steps
        ]
        return [Table(heading, effects), Table(("time", "first difference at", "with the acts", "without"), steps)]


def explain(
    model: Model | str | Path,
    monitor: str | None = None,
    *,
    seed: int | None = None,
    until: float | str | None = None,
    runs: int = RUNS,
    only: Iterable[str] = (),
    out: str | Path | None = None,
    progress: Callable[[int, int], None] | None = None,
    **changes: Unpack[Changes],
) -> Explained:
    """Find a smallest set of acts of aspects that breaks a monitor in a run, or a property that is given as a text.

    Without ``monitor``, the monitor of the model is explained that is broken first.
    ``set``, ``disturb`` and the other options of ``load`` change the model first.  ``only`` names the aspects whose
    acts are looked at; those of others happen as in the whole run.  At most ``runs`` sets are tried; after that, or an
    interrupt, the answer is the smallest set so far, which may not be minimal.  Each run that was made is noted in the
    folder ``out``, if there is one, where a search that ended continues.  ``progress`` is called with the number of
    sets that were tried, and of acts in the smallest one.  Raises ``EpicycleError`` if the run does not break the
    property.

    >>> epicycle.explain("collision_avoidance", "always clearance.distance >= 4 m", seed=3, set={"disturbance": 0.5})
    """
    made = loaded(model, changes)
    seed = made.output.seed if seed is None else seed
    if isinstance(model, Model):
        made, command = copy.copy(made), ["epicycle", "run", made.name, "--seed", str(seed)]
    else:
        command = RunSpec.of(model, seed, until, changes).command()
    if runs < 1:
        raise EpicycleError(f"runs: {runs} is not a whole number of at least 1")
    names = [only] if isinstance(only, str) else [*only]
    stop = seconds("until", until)
    return explained(made, monitor, seed, stop, command, out, progress, limit=runs, only=names, flag="")


def explained(
    made: Model,
    monitor: str | None,
    seed: int,
    until: float | None,
    command: Sequence[str],
    out: str | Path | None,
    progress: Callable[[int, int], None] | None,
    *,
    limit: int,
    only: Collection[str] = (),
    flag: str = "--monitor",
) -> Explained:
    """The same for a model that may be changed, and was made by a command."""
    monitors = monitors_named(made, monitor, flag=flag)
    folder = None if out is None else Path(out)
    found = search(made, monitors, seed=seed, until=until, limit=limit, only=only, folder=folder, tell=progress)
    return Explained(found, made, until, command)


def _grouped(effects: Iterable[Effect]) -> list[tuple[str, str]]:
    """What the acts did, in words, and when: those that did the same together."""
    times: dict[str, list[str]] = {}
    for each in effects:
        name, act = each.act.name, each.act
        came = "" if act.source == name.place or not act.source else f" a token of {act.source}"
        what = f"{name.aspect} {' and '.join(dict.fromkeys(act.events))}{came} at {name.place}"
        times.setdefault(what, []).append(_when(act))
    return [(what, _listed(each, _TIMES)) for what, each in times.items()]


def _moved(effects: Iterable[Effect]) -> list[str]:
    """A sentence about acts that are others in the whole run than in that of the set, if there are any."""
    moved = [f"{each.act.name}: {_before(each)}" for each in effects if each.has_moved]
    if not moved:
        return []
    more = f"; and {len(moved) - _MOVED:,} more" if len(moved) > _MOVED else ""
    what = "One act is" if len(moved) == 1 else f"{len(moved):,} acts are"
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


def _listed(texts: Sequence[str], most: int) -> str:
    """Texts as a list in a sentence, of which as many are shown as ``most``."""
    if len(texts) > most:
        texts = [*texts[:most], f"{len(texts) - most:,} more"]
    return " and ".join([", ".join(texts[:-1]), texts[-1]] if len(texts) > 1 else texts)


def _either(names: Sequence[str]) -> str:
    return _listed(names, len(names)).replace(" and ", " or ")


def _when(act: Act) -> str:
    return f"{to_seconds(act.time):.9g} s"


def _at(verdict: Verdict) -> str:
    return "" if verdict.time is None else f" at {verdict.time:.9g} s"


def _token(token: Any) -> str:
    return "nothing" if token is None else short(token)[:_SHOWN]


def _flow(names: dict[str, Any]) -> str:
    line: str = yaml.safe_dump(names, default_flow_style=True, sort_keys=False, width=1_000)
    return line.strip()
