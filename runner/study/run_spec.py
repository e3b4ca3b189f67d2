"""RunSpec: how a run is made, as its manifest holds it, and the run made again."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Self

from epicycle.actors import EpicycleError, convert, read_regular

from ..model.build.load import load_model
from ..model.build.model import Model
from ..model.catalogue.types import types_of_file
from ..model.language.settings import Setting
from ..model.text.document import plain
from ..model.text.limits import NORMAL
from ..model.text.program import call_site, node_of
from ..support.shapes import fits

if TYPE_CHECKING:
    from .plan.plan import Plan

FLAGS: Final = {
    "set": "--set", "overrides": "--overrides", "disturb": "--disturb", "aspects": "--aspect",
    "without_aspects": "--without", "types": "--types", "max_actors": "--max-actors", "seed": "--seed",
    "until": "--until",
}  # fmt: skip

_MALFORMED: Final = (OSError, ValueError, LookupError, TypeError, RecursionError)


def as_settings(said: Iterable[str | Setting] | Mapping[str, object], *, are_ranges: bool = False) -> list[str]:
    """What the command line says of values by path, ``path=value``; ranges and lists may be texts."""
    site = call_site()
    if isinstance(said, Mapping):
        said = [
            f"{path}={value}" if are_ranges and isinstance(value, str) else Setting(path, node_of(value, site), site)
            for path, value in said.items()
        ]
    return [f"{each.path}={json.dumps(plain(each.node))}" if isinstance(each, Setting) else each for each in said]


@dataclass(frozen=True)
class RunSpec:
    """How a run is made: by a model, with all that changes it, or as the run of that name in a study's folder.

    ``types`` are files; classes that a program defines cannot be named.
    """

    model: str = ""
    set: tuple[str, ...] = ()
    overrides: tuple[str, ...] = ()
    disturb: tuple[str, ...] = ()
    aspects: tuple[str, ...] = ()
    without_aspects: tuple[str, ...] = ()
    types: tuple[str, ...] = ()
    max_actors: int | None = None
    seed: int | None = None
    until: float | str | None = None
    study: str = ""
    run: str = ""

    @classmethod
    def of(
        cls,
        model: str | Path,
        seed: int | None,
        until: float | str | None,
        changes: Mapping[str, Any],
    ) -> Self:
        """That of a call."""

        def texts(name: str) -> tuple[str, ...]:
            given = changes.get(name, ())
            each_of = [given] if isinstance(given, (str, Path)) else given
            return tuple(str(each) for each in each_of if not isinstance(each, type))

        many: Any = {name: texts(name) for name in ("overrides", "disturb", "aspects", "without_aspects", "types")}
        many["set"] = tuple(as_settings(changes.get("set", ())))
        return cls(str(model), max_actors=changes.get("max_actors"), seed=seed, until=until, **many)

    def load(self, more: Iterable[Setting] = ()) -> Model:
        """The model, with further settings."""
        return load_model(
            self.model,
            set=(*self.set, *more),
            overrides=self.overrides,
            disturb=self.disturb,
            aspects=self.aspects,
            without_aspects=self.without_aspects,
            types=[each for file in self.types for each in types_of_file(Path(file))],
            max_actors=NORMAL.actors if self.max_actors is None else self.max_actors,
        )

    def command(self) -> list[str]:
        """The command that makes the run."""
        words = ["epicycle", "run", str(Path(self.study) / self.run) if self.study else self.model]
        for name, flag in FLAGS.items():
            said = getattr(self, name)
            each_of = said if isinstance(said, tuple) else () if said is None else (said,)
            words += [word for each in each_of for word in (flag, str(each))]
        return words

    def plain(self) -> dict[str, Any]:
        """What is said, as JSON."""
        return {name: said for name, said in asdict(self).items() if said not in (None, "", ())}

    @classmethod
    def of_plain(cls, said: object) -> RunSpec:
        """The same from JSON; raises ``ValueError``."""
        if not isinstance(said, dict) or bool(said.get("model")) == bool(said.get("study") and said.get("run")):
            raise ValueError("'run' names neither a model nor a run of a study")
        shapes: dict[Any, Any] = {"": str, (): [str], None: int}  # by defaults
        known = {each.name: shapes[each.default] for each in fields(cls)} | {"until": (str, float, int)}
        for name, value in said.items():
            if not fits(value, known.get(name, ())):
                raise ValueError(f"'run' cannot have {name!r}: {json.dumps(value)[:60]}")
        made: dict[str, Any] = {name: tuple(each) if isinstance(each, list) else each for name, each in said.items()}
        return cls(**made)

    def changed(self, other: RunSpec) -> RunSpec:
        """With what another one says about changes, types, seed and stop time on top."""
        more: dict[str, Any] = {}
        for name in FLAGS:
            mine, said = getattr(self, name), getattr(other, name)
            if name == "types":
                more[name] = said or mine
            else:
                more[name] = mine + said if isinstance(said, tuple) else mine if said is None else said
        return replace(self, **more)


class OpenedRun(NamedTuple):
    """A run to be made: its model and what else is needed, and the ``digest`` that it had before, if it is the same."""

    model: Model
    seed: int | None
    until: float | None
    digest: str = ""
    plan: Plan | None = None  # of the study that it is a run of


def spec_of(model: Model, seed: int | None, until: float | None) -> RunSpec | None:
    """How a run of a model is made; None for one that a program has made or changed."""
    if model.origin is None or model.origin.spec is None or model.origin.state != _state(model):
        return None
    spec: RunSpec = model.origin.spec
    if spec.study:
        return spec
    has_moved = until is not None and until != seconds("until", spec.until)
    return replace(spec, seed=spec.seed if seed is None else seed, until=until if has_moved else spec.until)


def named(model: Model, spec: RunSpec) -> Model:
    """A model that is known to be made like this."""
    assert model.origin is not None
    model.origin = replace(model.origin, spec=spec, state=_state(model))
    return model


def _state(model: Model) -> tuple[object, ...]:
    return model.stop, model.output.seed, model.exactly


def is_reference(name: str | Path) -> bool:
    """Whether a name is that of a results folder or of a run in a study's folder, not of a model."""
    path = Path(name)
    return path.is_dir() or (len(path.parts) > 1 and not path.exists() and _is_study(path.parent))


def opened(said: RunSpec, flag: str = "--until", more: Iterable[Setting] = ()) -> OpenedRun:
    """The run of ``said.model``, which is a model, the results folder of a run, or a study's folder and a run in it.

    What else is said counts on top, and ``more`` settings of a model on top of that.  Code that a folder names is run
    only if ``said`` names it, too.  Raises ``EpicycleError``.
    """
    path, digest, spec = Path(said.model), "", said
    if said.study:
        return _of_study(said)
    if path.is_dir():
        before, digest = _of_folder(path)
        if before.types and not said.types:
            files = " ".join(f"--types {shlex.quote(file)}" for file in before.types)
            raise EpicycleError(f"the run in {path} used types of its own\n   help: to let their code run, add {files}")
        spec = before.changed(said)
        digest = digest if replace(spec, types=before.types) == before else ""
    elif is_reference(path):
        spec = RunSpec(study=str(path.parent), run=path.name).changed(said)
    if spec.study:
        return _of_study(spec)
    return OpenedRun(named(spec.load(more), spec), spec.seed, seconds(flag, spec.until), digest)


def _of_folder(folder: Path) -> tuple[RunSpec, str]:
    """How the run was made of which a folder holds the results, and its digest."""
    path = folder / "manifest.json"
    try:
        manifest = _manifest(path)
        if "study" in manifest:
            raise EpicycleError(_of_many(folder))
        if "run" in manifest:
            return RunSpec.of_plain(manifest["run"]), str(manifest["digest"])
        command = shlex.join(map(str, manifest["command"]))
    except FileNotFoundError:
        raise EpicycleError(f"{folder} holds no results of a run: it has no manifest.json") from None
    except _MALFORMED as error:
        raise EpicycleError(f"{path} is not the manifest of a run: {error}") from None
    raise EpicycleError(
        f"{path} does not say how to make the run again: '{command}' was made by another version, or from a model that "
        "only a program knows"
    )


def _manifest(path: Path) -> dict[str, Any]:
    found = json.loads(read_regular(path))
    if not isinstance(found, dict):
        raise ValueError("it is not a mapping")
    return found


def _is_study(folder: Path) -> bool:
    try:
        return "study" in _manifest(folder / "manifest.json")
    except _MALFORMED:
        return False


def _of_many(folder: Path) -> str:
    from .judge.study_results import open_study

    rows = open_study(folder).table().to_pylist()
    first = f", such as {folder / rows[0]['run'][:12]}" if rows else ""
    return f"{folder} holds the {len(rows):,} runs of a study: name one of them{first}"


def _of_study(spec: RunSpec) -> OpenedRun:
    from .judge.study_results import open_study
    from .session import plan_of_folder

    folder = Path(spec.study)
    if changes := [flag for name, flag in FLAGS.items() if name != "types" and getattr(spec, name) not in (None, ())]:
        raise EpicycleError(
            f"{folder / spec.run} is a run of a study, and is made as it was: without {', '.join(changes)}"
        )
    row = open_study(folder).find(spec.run)
    plan = plan_of_folder(folder, map(Path, spec.types))
    model = plan.load(plan.condition(row["condition"]))
    spec = replace(spec, run=row["run"][:12])
    return OpenedRun(named(model, spec), row["seed"], None, row["digest"] or "", plan)


def seconds(what: str, given: float | str | None) -> float | None:
    """A model time in seconds or with a unit."""
    if given is None:
        return None
    time = convert(given, "s") if isinstance(given, str) else given
    if not 0.0 <= time < 1e9:
        raise EpicycleError(f"{what} {given}: expected a time from 0 s to 1e9 s")
    return time
