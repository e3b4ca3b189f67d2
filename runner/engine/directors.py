"""The directors of a run, of composites with their own time, and of refinements; and their borders."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, cast

from ..graph import Clock, ModelGraph, is_within
from .director import Director
from .local_time import Border, LocalDirector, Passage
from .refinement import Conductor, Refinement

if TYPE_CHECKING:
    from epicycle.actors import Actor, StateMachine

    from .execution import Execution


class Directors:
    """The directors of a run ``of`` each composite that has one, with the passages at its ports.

    ``executions`` are those of the actors whose firings are deferred or whose errors are caught; their maker adds them.
    """

    def __init__(self, graph: ModelGraph, actors: dict[str, Actor], director: Director) -> None:
        self.graph = graph
        self.actors = actors
        self.director = director
        self.executions: dict[str, Execution] = {}
        self.of: dict[str, Director | LocalDirector | Refinement] = {}
        self.conductors: dict[str, Conductor] = {}
        self.passages: dict[str, Passage] = {}
        self.borders: dict[str, Border] = {}
        self.refinements: dict[str, Refinement] = {}
        for composite, clock in graph.clocks.items():
            self._add_director(composite, clock)

    def over(self, path: str) -> Director | LocalDirector | Refinement:
        """The director of an actor or composite, with its time."""
        return self.of[self.graph.director_of(path)]

    def _add_director(self, composite: str, clock: Clock) -> None:
        """The options of a composite's own director."""
        outside = self.base(self.graph.director_of(composite)) if composite else self.director
        for paths in self.graph.borders(composite):
            self.passages.update({path: Passage(path, outside) for path in paths})
        if self.graph.refires(composite):
            self._add_border(composite, outside)
        is_refired = composite in self.graph.modal or self.graph.refinement_of(composite) == composite != ""
        if is_refired and self.graph.rules[composite].are_ptolemys:
            self._let_refire(composite)
        self.of[composite] = self._made_director(composite, clock)
        if composite in self.graph.modal:
            machine = cast("StateMachine", self.actors[self.graph.modal[composite].machine])
            conductor = Conductor(composite, machine, self.director, self.of[composite])
            self.conductors[composite] = conductor
            conductor.is_refired = self.graph.rules[composite].are_ptolemys
            if machine.is_preemptive or conductor.is_refired:
                for path in self.graph.borders(composite)[0]:
                    self.passages[path].beside = conductor

    def _add_border(self, composite: str, outside: Director | Refinement) -> None:
        """Let a composite fire again as long as tokens wait at its inputs."""
        border = self.borders[composite] = Border(composite, self.graph.end_of(composite), self.director, outside)
        for paths, passages in zip(
            self.graph.borders(composite), (border.inputs_before, border.outputs_behind), strict=True
        ):
            passages += (self.passages[path] for path in paths)
            for passage in passages:
                passage.border = border
        around = composite
        while around and border.poster is None:
            around = around.rpartition(".")[0]
            border.poster = self.director.posters.get(around)
        border.nesting = 0 if border.poster is None else border.poster.nesting + 1
        if composite not in self.graph.modal:  # whose parts are posted one by one
            self.director.posters[composite] = border

    def _let_refire(self, composite: str) -> None:
        """Let a composite with modes, or a refinement, take one token of each channel per firing, as in Ptolemy."""
        inputs, outputs = self.graph.borders(composite)
        for path in (*inputs, *outputs):
            self.passages[path].is_refired = True
        for path in outputs if composite in self.graph.modal else ():
            self.passages[path].holds_one = True

    def _made_director(self, composite: str, clock: Clock) -> Director | LocalDirector | Refinement:
        if not composite or self.graph.refinement_of(composite) != composite:
            base = self.base(composite)
            return base if clock.is_global else LocalDirector(base, clock)
        modal, _, mode = composite.rpartition(".")
        conductor = self.conductors[modal]
        inside = Refinement(composite, self.of[modal], self.director, conductor)
        self.refinements[composite] = conductor.refinements[mode] = inside
        conductor.insides[mode] = partial(self._begin_anew, composite)
        for path in self.graph.borders(composite)[0]:
            self.passages[path].gate = inside
        return inside

    def base(self, composite: str) -> Director | Refinement:
        """Whose time a composite's clock counts from."""
        refinement = self.graph.refinement_of(composite)
        return self.refinements[refinement] if refinement else self.director

    def catches(self, path: str) -> bool:
        """Whether an actor is in a refinement for whose errors there are transitions."""
        refinement = self.refinements.get(self.graph.refinement_of(path))
        return refinement is not None and refinement.conductor.machine.catches

    def _begin_anew(self, refinement: str) -> None:
        """Restart the contents of a refinement."""
        for path, passage in self.passages.items():
            if is_within(path, refinement):
                passage.clear()
        for path, actor in self.actors.items():
            if is_within(path, refinement):
                execution = self.executions.get(path)
                if execution is not None:
                    execution.kill()
                else:
                    actor.halt()
                actor.restart()

    def post(self, before: str, path: str) -> None:
        """At the start, between the initialization of two actors: post the composites that are complete."""
        around = before if self.borders else ""
        while around:
            around = around.rpartition(".")[0]
            if around in self.borders and not is_within(path, around):
                self.borders[around].post()
