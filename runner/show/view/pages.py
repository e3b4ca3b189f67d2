"""Runs as a page."""

from __future__ import annotations

import html
import tempfile
import webbrowser
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

from epicycle.actors import EpicycleError, abridged

from ...execution.engine import ActorError, Interventions, LoopError
from ...model.build.figures import figures_of
from ...model.text.problems import Problems
from ...study.run_spec import OpenedRun
from ...support.bars import SOON
from ...support.files import replace_file
from ...support.printing import complain
from ..outcome import MAX_NAME
from ..watching import watched
from .page import page_of
from .recording import MOST, Recording, ViewError

Watch = Callable[[Recording | None], Callable[[float], None]]  # for a run that is recorded, or for one that is not


@dataclass(eq=False, repr=False)
class Page:
    """A page that shows one run or two, in a notebook, a browser or a file; it needs no network.

    A run that failed or was interrupted is shown up to that point; ``errors`` give the reasons.
    """

    recordings: Sequence[Recording]
    names: Sequence[str] = ()
    errors: Sequence[EpicycleError | KeyboardInterrupt] = ()
    story: Sequence[str] = ()  # sentences about both runs

    def save(self, path: str | Path) -> Path:
        """Write it to a file (.html)."""
        replace_file(Path(path), page_of(self.recordings, names=self.names, story=self.story), ViewError)
        return Path(path)

    def open(self) -> Path:
        """Open it in the browser; returns the file, which stays until the computer clears its temporary files."""
        name = abridged(self.recordings[0].model.name, MAX_NAME)
        path = self.save(Path(tempfile.mkdtemp(prefix="epicycle-"), f"{name}.html"))
        webbrowser.open(path.as_uri())
        return path

    def __repr__(self) -> str:
        return f"<Page of {' and '.join(self.names or [self.recordings[0].model.name])}>"

    def _repr_html_(self) -> str:
        whole = html.escape(page_of(self.recordings, names=self.names, story=self.story))
        look = "width: 100%; height: 80vh; border: 0"
        return f'<iframe sandbox="allow-scripts" srcdoc="{whole}" style="{look}"></iframe>'


def recorded(
    runs: Sequence[OpenedRun],
    *,
    names: Sequence[str] = (),
    acts: Sequence[Interventions | None] = (),
    most: int = MOST,
    progress: bool = True,
    watch: Watch | None = None,
) -> Page:
    """The page of these runs.

    ``acts`` say which acts of aspects happen in each, ``most`` how many firings are kept of it; ``watch`` gives what is
    called with the time of a run now and then, in place of a bar.
    """
    recordings, errors = [], list[EpicycleError | KeyboardInterrupt]()
    for number, (model, seed, until, *_) in enumerate(runs):
        problems = Problems()
        figures = figures_of(model, problems)
        problems.raise_if_any()
        if until is None and model.endless and watch is None:
            complain(
                f"{model.endless}\n   help: end it with Ctrl-C, which keeps what was recorded, or give a stop time"
            )
        own_acts = acts[number] if acts else None
        recording = Recording(model, figures, seed=seed, most=most, is_compared=len(runs) > 1, acts=own_acts)
        recordings.append(recording)
        look = nullcontext(watch(recording)) if watch else nullcontext()
        with watched(model, until, SOON) if progress else look as report:
            try:
                recording.run(until=until, progress=report)
            except (ActorError, LoopError) as error:  # what led to the error is the very thing to look at
                errors.append(error)
            except KeyboardInterrupt as error:  # the records are kept, and nothing else is started
                errors.append(error)
                break
    return Page(recordings, names if len(recordings) > 1 else (), errors)
