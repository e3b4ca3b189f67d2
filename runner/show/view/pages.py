"""Runs as a page."""

from __future__ import annotations

import html
import tempfile
import webbrowser
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

from epicycle.actors import EpicycleError

from ...execution.engine import ActorError, Interventions, LoopError
from ...model.build.figures import figures_of
from ...model.build.model import Model
from ...model.text.problems import Problems
from ...support.bars import SOON
from ...support.printing import complain
from ..watching import watched
from .page import page_of, write_page
from .recording import MOST, Recording

Watch = Callable[[Recording | None], Callable[[float], None]]  # for a run that is recorded, or for one that is not


@dataclass(eq=False, repr=False)
class Page:
    """A page that shows one run or two, in a notebook, a browser or a file; it needs no network.

    A run that failed or was interrupted is shown up to that point; ``errors`` give the reasons.
    """

    recordings: Sequence[Recording]
    names: Sequence[str]
    errors: Sequence[EpicycleError | KeyboardInterrupt]
    story: Sequence[str] = ()  # sentences about both runs

    def save(self, path: str | Path) -> Path:
        """Write it to a file (.html)."""
        write_page(self.recordings, Path(path), names=self.names, story=self.story)
        return Path(path)

    def open(self) -> Path:
        """Open it in the browser; returns the file, which stays until the computer clears its temporary files."""
        path = self.save(Path(tempfile.mkdtemp(prefix="epicycle-"), f"{self.recordings[0].model.name}.html"))
        webbrowser.open(path.as_uri())
        return path

    def __repr__(self) -> str:
        return f"<Page of {' and '.join(self.names or [self.recordings[0].model.name])}>"

    def _repr_html_(self) -> str:
        whole = html.escape(page_of(self.recordings, names=self.names, story=self.story))
        look = "width: 100%; height: 80vh; border: 0"
        return f'<iframe sandbox="allow-scripts" srcdoc="{whole}" style="{look}"></iframe>'


def recorded(
    models: Sequence[Model],
    *,
    seed: int | Sequence[int | None] | None = None,
    until: float | Sequence[float | None] | None = None,
    names: Sequence[str] = (),
    acts: Sequence[Interventions | None] = (),
    most: int = MOST,
    progress: bool = True,
    watch: Watch | None = None,
) -> Page:
    """The page of these models' runs; seeds and stop times apply to all, or are given for each.

    ``acts`` say which acts of aspects happen in each, ``most`` how many firings are kept of it; ``watch`` gives what is
    called with the time of a run now and then, in place of a bar.
    """
    recordings, errors = [], list[EpicycleError | KeyboardInterrupt]()
    for number, model in enumerate(models):
        own_seed = seed[number] if isinstance(seed, Sequence) else seed
        stop = until[number] if isinstance(until, Sequence) else until
        problems = Problems()
        figures = figures_of(model, problems)
        problems.raise_if_any()
        if stop is None and model.endless and watch is None:
            complain(
                f"{model.endless}\n   help: end it with Ctrl-C, which keeps what was recorded, or give a stop time"
            )
        own_acts = acts[number] if acts else None
        recording = Recording(model, figures, seed=own_seed, most=most, is_compared=len(models) > 1, acts=own_acts)
        recordings.append(recording)
        look = nullcontext(watch(recording)) if watch else nullcontext()
        with watched(model, stop, SOON) if progress else look as report:
            try:
                recording.run(until=stop, progress=report)
            except (ActorError, LoopError) as error:  # what led to the error is the very thing to look at
                errors.append(error)
            except KeyboardInterrupt as error:  # the records are kept, and nothing else is started
                errors.append(error)
                break
    return Page(recordings, names if len(recordings) > 1 else [], errors)
