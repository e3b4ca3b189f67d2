"""A search for a run that breaks a property: what ``epicycle.falsify`` and the command do."""

from __future__ import annotations

import json
import re
import shlex
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from epicycle.actors import EpicycleError, abridged, counted

from ..bars import bar
from ..engine import Interventions, Simulation
from ..graph.acts import ActName
from ..language.dimensions import split_number
from ..language.disturbance import EXACTLY
from ..language.settings import Setting
from ..provenance import version_of
from ..results import Verdict
from ..search import Asked, FaultSpace, Findings, Interval, Run
from ..search import falsify as search
from ..shown import finite, short
from ..study import OK, StudyResults, open_study
from ..tables import Table, Tabled
from ..text.document import Node, Scalar, plain
from .run_spec import Changes, RunSpec, seconds
from .studying import as_settings

SHOWN = 5  # runs in the table
_VALUES = 10  # of a list, in a sentence
_BARE = re.compile(r"[A-Za-z0-9_.+ -]+")  # a text that needs no quotes in YAML, where it is not a number


class Falsified(Tabled):
    """What a search for a run that breaks a property has found.

    ``broken`` is that run, or None, which does not show that there is none; ``verdict`` is its verdict, ``command``
    makes it again, and ``explain`` asks which acts of aspects broke it, if there were any.  ``sentence`` says it all,
    ``covered`` what was tried, and ``results`` has all runs as a study has them.
    """

    def __init__(self, findings: Findings, asked: Asked, folder: Path) -> None:
        self.findings = findings
        self.folder = folder
        self.broken: Run | None = findings.broken
        self.verdict: Verdict | None = None
        self.command: list[str] = []
        self.explain: list[str] = []
        self._asked = asked
        if self.broken is not None:
            self._repeat(self.broken)

    @property
    def results(self) -> StudyResults:
        """All runs, by what was set."""
        return open_study(self.folder)

    def _repeat(self, run: Run) -> None:
        """Make a run once more, for the verdict and the acts in it."""
        asked = self._asked
        self.command = self.command_of(run)
        model = asked.load(run.level.settings)
        name = run.broken[0]
        if asked.monitor is not None and name not in {each.name for each in model.output.monitors}:
            model.monitor(name, asked.monitor)
        results = Simulation(model, seed=run.seed, acts=Interventions(model.exactly)).run()
        if results.digest != run.digest:
            raise EpicycleError(
                f"run {run.number} (seed {run.seed}) does not repeat: its digest is {results.digest[:16]}..., but was "
                f"{(run.digest or '')[:16]}...; something has changed since"
            )
        self.verdict = results.monitors[name]
        if results.acts:
            self.explain = ["epicycle", "explain", *self.command[2:], "--monitor", asked.monitor or name]

    def command_of(self, run: Run) -> list[str]:
        """The command that makes one of the runs again."""
        asked = self._asked
        own = [f"{path}={value}" for path, value in _settings(run)]
        changes: Changes = {"set": [*asked.set, *own], "disturb": asked.disturb}
        changes |= {"aspects": asked.aspects, "without_aspects": asked.without}
        return RunSpec.of(asked.model, run.seed, asked.until, changes, asked.types).command()

    @property
    def covered(self) -> str:
        """What was tried."""
        return ", ".join(_covered(self.findings))

    @property
    def sentence(self) -> str:
        """What came of the search, in words."""
        found = self.findings
        names = self.broken.broken if self.broken is not None else tuple(found.monitors)
        what = _list([f"{name} ({found.monitors[name]})" for name in names], "or" if self.broken is None else "and")
        if self.broken is None:
            always = "it always holds" if len(names) == 1 else "they always hold"
            told = f"No run broke {what}, which does not prove that {always}."
        else:
            remark = "" if self.verdict is None else self.verdict.remark
            told = f"Run {self.broken.number}, with {_said(self.broken)}, breaks {what}{remark and ': '}{remark}."
        return " ".join([told, f"Tried: {self.covered}.", *self._reservations()])

    def _reservations(self) -> Iterator[str]:
        """What the search could not do."""
        runs = self.findings.runs
        if failed := self.findings.failed:
            yield (
                f"{counted(len(failed), 'run')} failed, and nothing is known of the property there: 'epicycle status "
                f"{self.folder}' shows them."
            )
        if self.findings.unguided:
            yield (
                "All values were chosen at random: the library that guides a search is not installed "
                "(pip install 'epicycle[falsify]')."
            )
        if missing := self.findings.not_judged:
            yield f"In {counted(len(missing), 'run')} the property could not be judged."
        if len(runs) > 1 and len({each.digest for each in runs if each.status == OK}) == 1:
            yield "All runs were the same: nothing in the model depends on the seed or on what was varied."

    def facts(self) -> dict[str, Any]:
        """Everything that was found, for programs."""
        found = self.findings
        names = self.broken.broken if self.broken is not None else tuple(found.monitors)
        monitor = names[0] if self.broken is not None or len(names) == 1 else None
        return {
            "model": found.model,
            "monitor": monitor,
            "property": None if monitor is None else found.monitors[monitor],
            "monitors": found.monitors,
            "broken": [] if self.broken is None else list(self.broken.broken),
            "found": self.broken is not None,
            "run": None if self.broken is None else _facts(self.broken),
            "verdict": None if self.verdict is None else finite(asdict(self.verdict)),
            "command": self.command,
            "explain": self.explain,
            "runs": len(found.runs),
            "failed": len(found.failed),
            "not_judged": len(found.not_judged),
            "least": None if found.least is None else _facts(found.least),
            "guided": found.guided,
            "covered": self.covered,
            "folder": str(self.folder),
            "version": version_of("epicycle"),
        }

    def __repr__(self) -> str:
        return f"<Falsified: {self.sentence}>"

    def _caption(self) -> str:
        return self.sentence

    def _tables(self) -> list[Table]:
        commands = [("repeat it", shlex.join(self.command)), ("explain it", shlex.join(self.explain))]
        known = [each for each in self.findings.runs if each.robustness is not None]
        least = sorted(known, key=lambda each: (each.robustness or 0.0, each.number))[:SHOWN]
        head = ("run", *self.findings.space.columns, "seed", "robustness")
        runs = [
            (str(each.number), *(value for _, value in _words(each)), str(each.seed), short(each.robustness))
            for each in least
        ]
        return [Table(("to", "command"), [each for each in commands if each[1]]), Table(head, runs)]


def falsify(
    model: str | Path,
    monitor: str | None = None,
    *,
    vary: Iterable[str] | Mapping[str, object] = (),
    acts: int = 0,
    runs: int = 500,
    seed: int = 0,
    out: str | Path | None = None,
    jobs: int | None = None,
    run_timeout: float | None = None,
    set: Iterable[str] | Mapping[str, object] = (),
    disturb: str | Path | Iterable[str | Path] = (),
    aspects: Iterable[str] = (),
    without_aspects: Iterable[str] = (),
    until: float | str | None = None,
    types: Iterable[str | Path] = (),
    progress: bool = True,
) -> Falsified:
    """Look for a run that breaks a monitor of a model, or a property that is given as a text.

    Without ``monitor``, a run that breaks any of the model's is looked for.  What is in ``vary`` is searched:
    ``{"load": "0.5..0.9", "policy": ["fifo", "lifo"]}``.  Run number n has the seed ``seed + n - 1``.  With ``acts``,
    all runs have the same seed, and sets of at most so many single acts of aspects (losses, delays, failures) are
    searched, of those that happen in the run of that seed.  All runs are kept in a folder (default:
    results/MODEL/falsification), where a search that was killed continues.  That nothing is found does not show that
    the property holds.

    >>> epicycle.falsify("mm1", "always server.size < 40", vary={"load": "0.5..0.9"}, runs=100).sentence
    """
    ranges = vary if not isinstance(vary, Mapping) else [*as_ranges(vary)]
    given = [disturb] if isinstance(disturb, (str, Path)) else disturb
    asked = Asked(
        str(model),
        monitor,
        tuple(ranges),
        runs,
        seed,
        tuple(as_settings(set)),
        tuple(map(str, given)),
        tuple(map(Path, types)),
        acts=acts,
        aspects=tuple(aspects),
        without=tuple(without_aspects),
        until=seconds("until", until),
    )
    return falsified(asked, out, jobs=jobs, timeout=run_timeout, progress=progress)


def falsified(
    asked: Asked,
    out: str | Path | None,
    *,
    jobs: int | None = None,
    timeout: float | None = None,
    progress: bool = True,
) -> Falsified:
    """The same for what a command asks for."""
    folder = Path("results") / abridged(Path(asked.model).stem, 60) / "falsification" if out is None else Path(out)
    with bar("falsify") as show:

        def tell(runs: int, least: Run | None) -> None:
            if show is not None and progress:
                known = "" if least is None else f", least robustness {short(least.robustness)}"
                show(float(runs), float(asked.runs), f"{runs:,} runs{known}")

        return Falsified(search(asked, folder, jobs=jobs, timeout=timeout, tell=tell), asked, folder)


def _list(texts: Sequence[str], last: str) -> str:
    """Texts as a list in a sentence."""
    return f" {last} ".join([", ".join(texts[:-1]), texts[-1]] if len(texts) > 1 else texts)


def as_ranges(said: Mapping[str, object]) -> Iterator[str]:
    """What the command line says of ranges and lists by path."""
    for path, value in said.items():
        yield f"{path}={value}" if isinstance(value, str) else as_settings({path: value})[0]


def _settings(run: Run) -> Iterator[tuple[str, str]]:
    """What a run was given, as ``--set`` takes it."""
    return ((setting.path, _text(setting.node)) for setting in run.level.settings)


def _text(node: Node) -> str:
    """A value as YAML, without quotes where it can be."""
    if isinstance(node, Scalar):
        number = split_number(node)
        is_bare = _BARE.fullmatch(node.text) is not None and (number is None or bool(number[1]))
        if is_bare or not isinstance(node.value, str):
            return node.text
    return json.dumps(plain(node))


def _acts(setting: Setting) -> list[ActName]:
    """The acts that a setting lets happen."""
    said: Any = plain(setting.node)
    return [ActName(each["aspect"], each["at"], each["token"]) for each in said]


def _words(run: Run) -> Iterator[tuple[str, str]]:
    """What a run was given, for people."""
    for setting in run.level.settings:
        if setting.path == EXACTLY:
            yield setting.path, "; ".join(map(str, _acts(setting))) or "no act"
        else:
            yield setting.path, _text(setting.node)


def _said(run: Run) -> str:
    given = ", ".join(f"exactly {value}" if path == EXACTLY else f"{path}={value}" for path, value in _words(run))
    return f"{given} and seed {run.seed}" if given else f"seed {run.seed}"


def _facts(run: Run) -> dict[str, Any]:
    said = {"number": run.number, "set": {each.path: plain(each.node) for each in run.level.settings}}
    return {**said, "seed": run.seed, "robustness": finite(run.robustness), "run": run.key}


def _covered(found: Findings) -> Iterator[str]:
    runs = found.runs
    yield counted(len(runs), "run")
    if not runs:
        return
    yield f"seeds {runs[0].seed} to {runs[-1].seed}" if runs[-1].seed > runs[0].seed else f"seed {runs[0].seed}"
    if isinstance(found.space, FaultSpace):
        made = Counter(len(_acts(each.level.settings[0])) for each in runs)
        for size, of_size in enumerate(found.space.sizes()):
            if made[size]:
                yield f"{made[size]:,} of {of_size:,} sets of {counted(size, 'act')}" if size else "no act at all"
    for at, axis in enumerate(found.space.axes):
        nodes = [each.level.settings[at].node for each in runs]
        if isinstance(axis, Interval):
            numbers = [number[0] for each in nodes if (number := split_number(each)) is not None]
            unit = f" {axis.unit}" if axis.unit else ""
            yield f"{axis.path} {min(numbers):f} to {max(numbers):f}{unit}"
        else:
            tried = {each.level.values[axis.path] for each in runs}
            texts = [_text(node) for node in axis.nodes if axis.factor(node) in tried]
            shown = texts[:_VALUES]
            more = f" and {len(texts) - len(shown):,} more" if len(texts) > len(shown) else ""
            yield f"{axis.path} {' or '.join(shown)}{more}"
