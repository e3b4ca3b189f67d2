"""Why a run breaks a property: what ``epicycle.explain`` and the command do."""

from __future__ import annotations

import copy
import json
import shlex
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Unpack

import yaml

from epicycle.actors import counted, to_seconds

from ..build import Model
from ..provenance import version_of
from ..results import Verdict
from ..search import Effect, Explanation, monitor_named
from ..search import explain as search
from ..shown import finite, short
from ..tables import Table, Tabled
from .running import Changes, as_command, loaded, seconds
from .viewing import Page, recorded

_SHOWN = 60  # characters of a token


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
            return f"{broken} without any act of an aspect: the model breaks it by itself."
        number = len(found.effects)
        what = "; ".join(f"{text} at {times}" for text, times in _grouped(found.effects))
        single = "Without it" if number == 1 else "Without any single one of them"
        verb = "suffices" if number == 1 else "suffice"
        return (
            f"{counted(number, 'act')} of {found.acts} {verb}: {what}. With {'it' if number == 1 else 'these'} alone, "
            f"{broken}. {single}, it holds."
        )

    def disturbance(self) -> str:
        """A disturbance file in which these acts happen, and no others."""
        names = [{"aspect": name.aspect, "at": name.place, "token": name.token} for name in self.explanation.names]
        head = {"disturbance": "explanation", "doc": f"{self.sentence} Run: {shlex.join(self.command)} --disturb FILE"}
        said: str = yaml.safe_dump(head, sort_keys=False, allow_unicode=True, width=110)
        if not names:
            return said + "exactly: []\n"
        return said + "exactly:\n" + "".join(f"  - {_flow(each)}\n" for each in names)

    def facts(self) -> dict[str, Any]:
        """Everything that was found, for programs."""
        found = finite(asdict(self.explanation))
        assert isinstance(found, dict)
        return {**found, "command": self.command, "sentence": self.sentence, "version": version_of("epicycle")}

    def page(self, *, progress: bool = True) -> Page:
        """A page with the run of these acts beside the one without any."""
        models = [copy.copy(self._model) for _ in range(2)]
        models[0].exactly, models[1].exactly = frozenset(self.explanation.names), frozenset()
        names = [f"{counted(len(self.explanation.effects), 'act')}", "no act"]
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
        effects = [
            (
                str(each.act.name),
                f"{to_seconds(each.act.time):.9g} s",
                ", ".join(each.act.events),
                each.act.source,
                short(each.without),
                short(each.alone),
            )
            for each in self.explanation.effects
        ]
        steps = [
            (f"{each.time:.9g} s", each.port, _token(each.token), _token(each.instead))
            for each in self.explanation.steps
        ]
        heading = ("act", "time", "what it did", "token from", "robustness without it", "with it alone")
        return [Table(heading, effects), Table(("time", "first difference at", "with the acts", "without"), steps)]


def explain(
    model: Model | str | Path,
    monitor: str,
    *,
    seed: int | None = None,
    until: float | str | None = None,
    out: str | Path | None = None,
    progress: Callable[[int, int], None] | None = None,
    **changes: Unpack[Changes],
) -> Explained:
    """Find a smallest set of acts of aspects that breaks a monitor in a run, or a property that is given as a text.

    ``set``, ``disturb`` and the other options of ``load`` change the model first.  Each run that was made is noted in
    the folder ``out``, if there is one, so that a search that was killed continues there.  Raises ``EpicycleError`` if
    the run does not break the property.

    >>> epicycle.explain("collision_avoidance", "always clearance.distance >= 4 m", seed=3, set={"disturbance": 0.5})
    """
    made = loaded(model, changes)
    seed = made.seed if seed is None else seed
    if isinstance(model, Model):
        made, command = copy.copy(made), ["epicycle", "run", made.name, "--seed", str(seed)]
    else:
        command = as_command(model, seed, until, changes)
    return explained(made, monitor, seed, seconds("until", until), command, out, progress, flag="")


def explained(
    made: Model,
    monitor: str,
    seed: int,
    until: float | None,
    command: Sequence[str],
    out: str | Path | None,
    progress: Callable[[int, int], None] | None,
    *,
    flag: str = "--monitor",
) -> Explained:
    """The same for a model that may be changed, and was made by a command."""
    monitor = monitor_named(made, monitor, flag=flag)
    found = search(made, monitor, seed=seed, until=until, folder=None if out is None else Path(out), tell=progress)
    return Explained(found, made, until, command)


def _grouped(effects: Iterable[Effect]) -> list[tuple[str, str]]:
    """What the acts did, in words, and when: those that did the same together."""
    times: dict[str, list[str]] = {}
    for each in effects:
        name, act = each.act.name, each.act
        came = "" if act.source == name.place or not act.source else f" a token of {act.source}"
        what = f"{name.aspect} {' and '.join(dict.fromkeys(act.events))}{came} at {name.place}"
        times.setdefault(what, []).append(f"{to_seconds(act.time):.9g} s")
    return [
        (what, " and ".join([", ".join(each[:-1]), each[-1]] if len(each) > 1 else each))
        for what, each in times.items()
    ]


def _at(verdict: Verdict) -> str:
    return "" if verdict.time is None else f" at {verdict.time:.9g} s"


def _token(token: Any) -> str:
    return "nothing" if token is None else short(token)[:_SHOWN]


def _flow(names: dict[str, Any]) -> str:
    line: str = yaml.safe_dump(names, default_flow_style=True, sort_keys=False, width=1_000)
    return line.strip()
