"""The directors of a run, of composites with their own time, and of refinements; and their borders."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, cast

from epicycle.actors import paths

from ...model.graph.clock import Clock
from ...model.graph.model_graph import ModelGraph
from .director import Director
from .local_time import BoundaryPort, LocalDirector
from .refinement import ModeDirector, Outer, Refinement

if TYPE_CHECKING:
    from epicycle.actors import Actor, StateMachine

    from .execution import Execution


def director_of(graph: ModelGraph) -> type[Director]:
    """The class of the director of a run: that of a dialect in the model, if one has its own."""
    found = (each.director() for each in dict.fromkeys(domain.dialect for domain in graph.domains.values()))
    return next((kind for kind in found if kind is not None), Director)


class Directors:
    """The directors of a run ``of`` each composite that has one, with its boundary ports.

    A director may come with a subclass (``Director.composites``), which makes other boundary ports and mode directors.

    ``executions`` are those of the actors whose firings are deferred or whose errors are caught; their maker adds them.
    """

    def __init__(self, graph: ModelGraph, actors: dict[str, Actor], director: Director) -> None:
        self.graph = graph
        self.actors = actors
        self.director = director
        self.executions: dict[str, Execution] = {}
        self.of: dict[str, Director | LocalDirector | Refinement] = {}
        self.mode_directors: dict[str, ModeDirector] = {}
        self.boundary_ports: dict[str, BoundaryPort] = {}
        self.refinements: dict[str, Refinement] = {}
        for composite, domain in graph.domains.items():
            self._add_director(composite, domain.clock)

    def over(self, path: str) -> Director | LocalDirector | Refinement:
        """The director of an actor or composite, with its time."""
        return self.of[self.graph.director_of(path)]

    def _add_director(self, composite: str, clock: Clock) -> None:
        """The options of a composite's own director."""
        outside = self.base(self.graph.director_of(composite)) if composite else self.director
        for ports in self.graph.borders(composite):
            self.boundary_ports.update({path: self.boundary_port(path, outside) for path in ports})
        self.prepare(composite, outside)
        self.of[composite] = self._made_director(composite, clock)
        if path := self.graph.domains[composite].machine:
            machine = cast("StateMachine", self.actors[path])
            mode_director = self.mode_directors[composite] = self.mode_director(composite, machine)
            if mode_director.hears_inputs:
                for path in self.graph.borders(composite)[0]:
                    self.boundary_ports[path].beside = mode_director

    def boundary_port(self, path: str, outside: Director | Refinement) -> BoundaryPort:
        """What a port of a composite with a director becomes in a run."""
        return BoundaryPort(path, outside)

    def prepare(self, composite: str, outside: Director | Refinement) -> None:
        """Called when a composite has its boundary ports, and not yet its director."""

    def mode_director(self, composite: str, machine: StateMachine) -> ModeDirector:
        """The mode director of a composite with modes."""
        return ModeDirector(composite, machine, self.director, self.of[composite])

    def refinement(self, path: str, outside: Outer, mode_director: ModeDirector) -> Refinement:
        """The director of a refinement."""
        return Refinement(path, outside, self.director, mode_director)

    def resumption(self, composite: str) -> Callable[[], None] | None:
        """What to call when an actor under this director fires after an aspect outside has deferred that."""
        return None

    def start(self, before: str, path: str) -> None:
        """Called at the start between the initialization of two actors."""

    def _made_director(self, composite: str, clock: Clock) -> Director | LocalDirector | Refinement:
        if not composite or self.graph.refinement_of(composite) != composite:
            base = self.base(composite)
            return base if clock.is_global else LocalDirector(base, clock)
        modal, _, mode = composite.rpartition(".")
        mode_director = self.mode_directors[modal]
        inside = self.refinement(composite, self.of[modal], mode_director)
        self.refinements[composite] = mode_director.refinements[mode] = inside
        mode_director.insides[mode] = partial(self._begin_anew, composite)
        for path in self.graph.borders(composite)[0]:
            self.boundary_ports[path].gate = inside
        return inside

    def base(self, composite: str) -> Director | Refinement:
        """Whose time a composite's clock counts from."""
        refinement = self.graph.refinement_of(composite)
        return self.refinements[refinement] if refinement else self.director

    def catches(self, path: str) -> bool:
        """Whether an actor is in a refinement for whose errors there are transitions."""
        refinement = self.refinements.get(self.graph.refinement_of(path))
        return refinement is not None and refinement.mode_director.machine.catches

    def _begin_anew(self, refinement: str) -> None:
        """Restart the contents of a refinement."""
        for path, boundary_port in self.boundary_ports.items():
            if paths.is_within(path, refinement):
                boundary_port.clear()
        for path, actor in self.actors.items():
            if paths.is_within(path, refinement):
                execution = self.executions.get(path)
                if execution is not None:
                    execution.kill()
                else:
                    actor.halt()
                actor.restart()
