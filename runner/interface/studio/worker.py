"""What answers questions about a text, and makes runs, in a process of its own.

What an editor asks about the text, and changes of it, are those of the Language Server Protocol.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Any

from cattrs.errors import BaseValidationError
from lsprotocol import types as lsp
from lsprotocol.converters import get_converter

from epicycle.actors import EpicycleError, Tag

from ...desk import Knowledge, controls, editing, edits_between
from ...desk.answers import ANSWERS, Answers, uri_of
from ...model.build.model import Model
from ...model.text.document import MAX_BYTES
from ...model.text.files import opened
from ...search.what_if import Changes, what_if
from ...show.view.drawing import drawn
from ...show.view.page import data_of, metrics
from ...show.view.pages import recorded
from ...show.view.recording import Recording
from ...study.run import processes
from ...study.run_spec import OpenedRun, RunSpec, named
from ...support.apart import bound, is_hastened, say
from ..calls.changes import classes

MEMORY = 4 << 30  # bytes that a worker may take
MOST = 100_000  # firings that a run shows
BEAT = 0.2  # s between two messages of a run

Message = dict[str, Any]
_DATA = get_converter()  # of the Language Server Protocol, as JSON has it


class StaleError(Exception):
    """A newer question waits."""


class Worker(processes.Worker):
    """Everything that a process knows: the text under work, and the limits of runs."""

    def __init__(
        self, path: Path, seconds: float, events: int, files: Sequence[str], say: Callable[[Message], None] = say
    ) -> None:
        self.path = path
        self.seconds = seconds
        self.events = events
        self.files = tuple(files)
        self.answers = Answers(tuple(classes(self.files)))
        self.ended = ""  # why the latest run was ended
        self.say = say

    @classmethod
    def limited(cls, *given: Any) -> Worker:
        """One that takes no more memory than a model needs."""
        bound(MEMORY)
        return cls(*given)

    def make(self, asked: Message) -> Message:
        """The answer to a question; what is wrong with it is said in words."""
        try:
            return self._answer(asked)
        except StaleError:
            return {"stale": True}
        except EpicycleError as error:
            return {"error": str(error)}
        except (KeyError, TypeError, ValueError, AttributeError, IndexError, BaseValidationError) as error:
            return {"error": f"this question cannot be read ({type(error).__name__})"}
        except MemoryError:
            return {"error": "there is not enough memory"}

    def _answer(self, asked: Message) -> Message:
        text = asked["text"]
        if not isinstance(text, str) or len(text) > MAX_BYTES:
            raise EpicycleError(f"a text has at most {MAX_BYTES // 1_000_000} MB")
        if self.answers.texts.get(self.path) != text:
            self.answers.change(self.path, text)
        if (ask := str(asked["ask"])) not in ASKED:
            raise EpicycleError("there is no such question")
        return ASKED[ask](self, asked)

    @property
    def knowledge(self) -> Knowledge:
        return self.answers.knowledge(self.path)

    # -- the text -------------------------------------------------------------------------------------------------

    def read(self, asked: Message) -> Message:
        """Problems at once, then the graph of what is valid so far, and what can be set."""
        knowledge = self.knowledge
        reading = knowledge.reading
        self.say({"problems": _DATA.unstructure(self.answers.problems(knowledge)), "valid": reading.is_valid})
        reading = controls.so_far(reading, self.answers.texts)
        model, known = reading.loading.model, knowledge if reading is knowledge.reading else Knowledge(reading)
        if model is None:
            return {"graph": None, "parameters": [], "aspects": []}
        return {
            "graph": drawn(model),
            "name": model.name,
            "endless": bool(model.endless) and reading.is_valid,
            "parameters": controls.parameters(known),
            "aspects": list(controls.aspects(known)),
        }

    def language(self, asked: Message) -> Message:
        """What the page's editor asks about the text."""
        about = {**asked["params"], "textDocument": {"uri": uri_of(self.path)}}
        kind: Any = lsp.METHOD_TO_TYPES[asked["ask"]][2]
        return {"result": _DATA.unstructure(self.answers.ask(asked["ask"], _DATA.structure(about, kind)))}

    def types(self, asked: Message) -> Message:
        return {"types": controls.types(self.knowledge)}

    def fields(self, asked: Message) -> Message:
        """The parameters of an actor in the graph, or of an aspect."""
        path = str(asked["path"])
        scope, _, name = path.rpartition(".")
        graph = self.knowledge.graph
        if scope and (graph is None or scope not in graph.components):
            raise EpicycleError(f"there is no {path}")
        owner = graph.components[scope].kind if graph is not None and scope else ""
        name = name.partition("[")[0]
        return {"owner": owner, "name": name, "fields": controls.fields(self.knowledge, owner, "actors", name)}

    def edit(self, asked: Message) -> Message:
        """A change of the model: the changes of the text that make it."""
        what, given = str(asked["what"]), _listed(asked["given"], str, bool, dict)
        if what not in editing.CHANGES:
            raise EpicycleError("there is no such change")
        if what in ("connect", "disconnect"):
            given = controls.local_ends(self.knowledge, *map(str, given))
        elif what == "swap":
            given = [*map(str, given), self.knowledge]
        before = self.answers.texts[self.path]
        edits = edits_between(self.path, before, editing.change(before, what, *given))
        return {"edits": [_DATA.unstructure(self.answers.text_edit(self.knowledge, each)) for each in edits]}

    # -- runs -----------------------------------------------------------------------------------------------------

    @property
    def model(self) -> Model:
        """The model, if it is valid."""
        reading = self.knowledge.reading
        if not reading.is_valid or reading.loading.model is None:
            raise EpicycleError("the model is not valid")
        return reading.loading.model

    def run(self, asked: Message) -> Message:
        """Run the model, if it is valid, within the limits; metrics are sent on the way."""
        started = time.monotonic()
        page = recorded(
            [OpenedRun(self.model, None, None)], most=MOST, progress=False, watch=partial(self._watch, tells=True)
        )
        [recording] = page.recordings
        results = recording.finished("the studio")
        return {
            "digest": results.digest,
            "stopped": results.stopped,
            "seconds": time.monotonic() - started,
            "failed": "".join(str(each) for each in page.errors if isinstance(each, EpicycleError)),
            "ended": self.ended,
            "view": data_of([recording]),
        }

    def _watch(self, recording: Recording | None, *, tells: bool = False) -> Callable[[float], None]:
        """What ends a run at the limits, or if nobody waits for it; it may tell how far the run has come."""
        started = last = time.monotonic()
        self.ended = ""

        def look(now: float) -> None:
            nonlocal last
            if is_hastened():
                raise StaleError
            if (moment := time.monotonic()) - started > self.seconds:
                self.ended = f"ended after {self.seconds:g} s: a run in the studio takes no longer (--seconds)"
            elif recording is not None and recording.records > self.events:
                self.ended = f"ended after {self.events:,} events: a run in the studio has no more (--events)"
            elif recording is not None and tells and moment - last > BEAT:
                last, stop = moment, recording.model.stop
                share = None if stop is None else now / stop
                self.say({"share": share, "metrics": metrics(recording), "records": recording.records})
            if self.ended:
                raise KeyboardInterrupt

        return look

    def what_if(self, asked: Message) -> Message:
        """Both futures of the model's run, as data of a page, if they differ."""
        time_, microstep = asked["at"]
        until = asked.get("until")
        changes = Changes(*(_listed(asked.get(each.name, []), str) for each in fields(Changes)))
        model = named(self.model, RunSpec(str(self.path), types=self.files))
        try:
            with opened(self.answers.texts):
                found = what_if(
                    model,
                    Tag(int(time_), int(microstep)),
                    changes,
                    seed=None,
                    until=None if until is None else float(until),
                    progress=False,
                    watch=self._watch,
                )
        except KeyboardInterrupt:
            return {"error": self.ended}
        page = found.page()
        view = None if found.is_same else data_of(page.recordings, names=page.names, story=page.story)
        return {"sentence": found.sentence, "view": view}


def _listed(given: Any, *kinds: type) -> list[Any]:
    if not isinstance(given, list) or not all(isinstance(each, kinds) for each in given):
        raise EpicycleError("this change cannot be read")
    return given


ASKED: Mapping[str, Callable[[Worker, Message], Message]] = {
    **dict.fromkeys(ANSWERS, Worker.language),
    "read": Worker.read,
    "types": Worker.types,
    "fields": Worker.fields,
    "edit": Worker.edit,
    "run": Worker.run,
    "what_if": Worker.what_if,
}
