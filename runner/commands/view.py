"""show a run in a browser"""

from __future__ import annotations

import argparse
import json
import shlex
import webbrowser
from contextlib import redirect_stderr
from copy import copy
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

from ..printing import complain, tell
from .options import CHANGES, DONE, SEED, command, load, option
from .run import run

if TYPE_CHECKING:
    from ..show.view import Recording


@command(
    "show a run in a browser: space, graph, signals, and what caused what",
    option(
        "model", metavar="MODEL or RESULTS", nargs="+", help="one or two models, or folders that runs were written to"
    ),
    *CHANGES,
    SEED,
    option("--until", metavar="TIME", help="stop time, such as 30 or '500 ms' (default: the model's)"),
    option(
        "-o", "--out", metavar="FILE", type=Path, help="the page (default: results/MODEL/view.html, which is opened)"
    ),
    imports=("calls.running", "show"),
)
def view(options: argparse.Namespace) -> int:
    """Run a model and write a page that shows the run: it needs no network, and any browser opens it.

    For a folder of results the run is made again, as its manifest says.  Two runs are shown side by side, with the
    first difference between them.
    """
    from epicycle.actors import EpicycleError

    from ..calls import seconds, watched
    from ..engine import ActorError, LoopError
    from ..show.view import write_page

    if len(options.model) > 2:
        raise EpicycleError(f"a page shows one run or two, not {len(options.model)}: {', '.join(options.model)}")
    path = options.out
    if path is not None and not path.parent.is_dir():
        raise EpicycleError(f"--out {path} cannot be written: there is no folder {path.parent}")
    if path is not None and path.is_dir():
        raise EpicycleError(f"--out {path} cannot be written: it is a folder")
    names = [Path(each).name.removesuffix(".yaml") for each in options.model]
    recordings: list[Recording] = []
    error: EpicycleError | None = None
    for each in options.model:
        one = copy(options)
        one.model = each
        digest = _as_before(one) if Path(each).is_dir() else ""
        recordings.append(_recording(one, is_compared=len(options.model) > 1))
        try:
            with watched(recordings[-1].model, seconds("--until", one.until)) as report:
                results = recordings[-1].run(until=seconds("--until", one.until), progress=report)
        except (ActorError, LoopError) as failure:  # what led to it is just what one wants to see
            error = failure
            continue
        if digest and results.digest != digest:
            complain(f"{each} was made by another version of the model or of Epicycle: the run is no longer the same")
    if path is None:
        path = Path("results") / recordings[0].model.name / "view.html"
        path.parent.mkdir(parents=True, exist_ok=True)
    write_page(recordings, path, names=names if len(names) > 1 else [])
    tell(f"wrote {path}")
    if error is not None:
        raise error
    if options.out is None:
        webbrowser.open(path.resolve().as_uri())
    return DONE


def _recording(options: argparse.Namespace, *, is_compared: bool) -> Recording:
    from ..build import figures_of
    from ..show.view import Recording
    from ..text import Problems

    problems = Problems()
    model = load(options)
    figures = figures_of(model, problems)
    problems.raise_if_any()
    if options.until is None and model.endless:
        complain(f"{model.endless}\n   help: end it with Ctrl-C, which keeps what was recorded, or run it with --until")
    return Recording(model, figures, seed=options.seed, is_compared=is_compared)


def _as_before(options: argparse.Namespace) -> str:
    """Make options those of the run of which a folder holds the results; the digest of that run.

    What is said beside the folder counts on top.
    """
    from epicycle.actors import EpicycleError, read_regular

    path = Path(options.model) / "manifest.json"
    try:
        manifest = json.loads(read_regular(path))
        before, digest = [str(each) for each in manifest["command"]], str(manifest["digest"])
    except FileNotFoundError:
        raise EpicycleError(f"{options.model} holds no results of a run: there is no manifest.json in it") from None
    except (OSError, ValueError, LookupError, TypeError, RecursionError) as error:
        raise EpicycleError(f"{path} is no manifest of a run: {error}") from None
    if before[1:2] != ["run"]:
        raise EpicycleError(f"{options.model} holds results of 'epicycle {' '.join(before[1:2])}', not of a run")
    known = argparse.ArgumentParser(exit_on_error=False)
    for add in run.options:
        add(known)
    try:
        with redirect_stderr(StringIO()):
            given, _ = known.parse_known_args(before[2:])
    except (argparse.ArgumentError, SystemExit):
        raise EpicycleError(f"{path} names a command that this version does not know: {shlex.join(before)}") from None
    if given.types and not options.types:  # code, which nobody but the caller asks for
        files = " ".join(f"--types {shlex.quote(file)}" for file in given.types)
        raise EpicycleError(f"the run in {options.model} used types of its own\n   help: add {files}")
    is_same = True
    for name in ("set", "overrides", "disturb", "aspect", "without"):
        is_same &= not getattr(options, name)
        setattr(options, name, [*getattr(given, name), *getattr(options, name)])
    for name in ("seed", "until", "max_actors"):
        is_same &= getattr(options, name) is None
        if getattr(options, name) is None:
            setattr(options, name, getattr(given, name))
    options.model = given.model
    return digest if is_same else ""
