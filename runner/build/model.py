"""Model: what is loaded or built, and then run."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from html import escape
from importlib import import_module
from pathlib import Path
from typing import Unpack

from epicycle.actors import EpicycleError, Stop, Tag, counted, declared_parameters, visible

from ..catalogue import Measure, MetricOptions, TakeName, take_fault
from ..collection import without_collection
from ..graph import (
    ActName,
    Metric,
    ModelGraph,
    Monitor,
    Watched,
    WovenAspect,
    check_processors,
    firing_order,
    is_within,
)
from ..language import Locals, MetricText, MonitorText, ParameterText, Values, nanoseconds
from ..shown import short
from ..tables import Table, Tabled
from ..temporal import Requirement, RequirementOptions
from ..text import NAME, NAMES_HAVE, Position, Problem, Problems, Text, call_site, within
from ..text import Mapping as MappingNode
from .checks import check
from .composite_aspect import check_nesting, detours
from .draft import Draft
from .named import Port, director_of, raising
from .origin import Origin
from .scope import Composite, Scope
from .watch import Watching, checked_seed
from .weave_all import arranged

DeclaredFigure = tuple[str, dict[str, object], MappingNode]  # type, values, as written


_SHOWN = ("unit", "to", "doc", "label")  # options of a metric that is computed from others


class Model(Scope, Tabled):
    """A model graph that can be run, made by ``load_model`` or built in Python.

    >>> model = Model("two_clocks", stop=10.0, seed=1)
    >>> clocks = [model.add(Clock(f"clock[{i}]", period=i + 1)) for i in range(2)]
    >>> merge = model.add(Merge("merge"))
    >>> model.connect("clock[*].output -> merge.input", delay="100 ms")
    >>> model.metric("ticks", of=merge.output, take="count")
    >>> Simulation(model).run().metrics
    {'ticks': 15}

    ``stop`` is in seconds or a text with a unit.  Ports are named by their paths, those of composites included.
    ``like`` is the name of a dialect for its director.
    A model that was loaded can be changed in the same way.  Its ``parameters`` record how it was made: actors have
    already taken their values from them, so set them with ``load_model(..., set=...)``, not here.

    A simulation freezes the graph: a later change makes another graph, for later simulations.
    """

    def __init__(
        self,
        name: str,
        *,
        doc: str = "",
        stop: float | str | None = None,
        seed: int = 0,
        parameters: Mapping[str, object] | None = None,
        like: str | None = None,
    ) -> None:
        super().__init__(self, "")
        self.name = name
        self.doc = doc
        self.draft = Draft()
        with raising() as problems:
            found = director_of(name, {"like": like}, call_site(), problems)
        self.draft.graph.dialects |= {"": found["like"]} if found else {}
        self.parameters: dict[str, object] = dict(parameters or {})
        self.declared: dict[str, ParameterText] = {}  # what its file declares of the parameters
        self.aspects: list[WovenAspect] = []
        self.stop_time: int | None = None  # ns
        self.stop_ports: list[str] = []
        self._stop_position: Position | None = None
        self.seed = checked_seed(seed)
        self.recorded: list[str] = []
        self.metrics: list[Metric] = []
        self.monitors: list[Monitor] = []
        self.exactly: frozenset[ActName] | None = None  # the only acts of aspects that happen
        self.figures: dict[str, DeclaredFigure] = {}
        self.warnings: tuple[Problem, ...] = ()  # what is odd but not wrong
        self.is_checked = False  # since the last change
        self.origin: Origin | None = None  # what it was made from, if that is all there is to it
        self._scopes: dict[str, Composite] = {}
        self._order: dict[str, int] | None = None  # worked out since then
        self.stop = stop

    @property
    def graph(self) -> ModelGraph:
        """All actors, composites, ports and connections."""
        return self.draft.graph

    @property
    def stop(self) -> float | None:
        """When the run ends, in seconds; None if only an empty agenda or a port ends it.

        It can be set as ``"500 ms"``.
        """
        return None if self.stop_time is None else self.stop_time / 1e9

    @stop.setter
    def stop(self, stop: float | str | None) -> None:
        self.stop_time = None if stop is None else nanoseconds(stop)

    @property
    def endless(self) -> str:
        """Why a run never ends unless it is interrupted, in words; empty if that is unknown."""
        if self.stop_time is not None or self.stop_ports:
            return ""
        actors = self.graph.actors.values()
        clock = next((actor.path for actor in actors if actor.is_endless), "")
        if not clock or any(isinstance(actor, Stop) for actor in actors):
            return ""
        return f"{self.name} never ends: {clock} ticks for ever, and the model sets neither stop nor stop_when"

    def local_tag(self, actor: str, tag: Tag) -> Tag:
        """A tag of the event log, as the actor or composite of that path sees it: in its director's time."""
        return self.graph.clocks[self.graph.director_of(actor)].tag(tag)

    def position_of(self, path: str) -> Position | None:
        """Where an actor, a composite, ``aspect NAME`` or ``stop_when`` is declared, if that is known."""
        return self._stop_position if path == "stop_when" else self.graph.positions.get(path)

    # -- what disturbs it -----------------------------------------------------------------------------------------

    def disturb(
        self, disturbance: str | Path, *, set: Mapping[str, object] | None = None, types: Iterable[type] = ()
    ) -> list[WovenAspect]:
        """Weave the aspects of a packaged disturbance, or of a YAML file, around the model.

        ``set`` gives the disturbance's own parameters their values; ``types`` are your own aspect classes that it may
        name.  A disturbance that sets parameters of the model must be loaded together with it: ``load_model(...,
        disturb=...)``.  Raises ``ModelError``.
        """
        from .disturbance import disturb

        draft, found, acts = disturb(self, str(disturbance), set or {}, types, call_site())
        self.adopt(draft, found)
        if acts is not None:
            self.exactly = (self.exactly or frozenset()) | acts
        return found

    # -- what is watched ------------------------------------------------------------------------------------------

    def record(self, *ports: str | Port) -> None:
        """Record what output ports send; give ports, or patterns over the ports that exist now."""
        self._watch(ports, lambda watching, text: watching.record(text))

    def stop_when(self, *ports: str | Port) -> None:
        """End the run, after the current tag, when one of these output ports sends something true."""
        self._watch(ports, lambda watching, text: watching.stop_when(text))

    def metric(
        self,
        name: str,
        *,
        of: str | Port | Iterable[str | Port] = (),
        take: TakeName = "last",
        formula: str = "",
        **options: Unpack[MetricOptions],
    ) -> None:
        """A number in the results; docs/language.md lists what can be taken, and the options.

        ``of`` is a port, a pattern, or several; or ``formula`` is an expression over metrics that are there (``from``
        in a file), with no more than ``unit``, ``to``, ``doc`` and ``label``.

        >>> model.metric("in_queue", of="server.size", take="time_mean", initial=0, after="100 s", interval=0.95)
        >>> model.metric("ratio", formula="delivered / sent")
        """
        position = call_site()
        problems = Problems()
        if not NAME.match(name):
            problems.add(f"{name!r} is not a name", position, NAMES_HAVE)
        if any(metric.name == name for metric in self.metrics):
            problems.add(f"there is already a metric {name!r}", position, "give this another name")
        if fault := take_fault(name, take):
            problems.add(fault.message, position, *fault.help)
        problems.raise_if_any()
        ports = list(of) if isinstance(of, Iterable) and not isinstance(of, str) else [of]
        if bool(ports) == bool(formula):
            problems.add(f"metric {name}: give either 'of' or 'formula'", position)
        if formula and (
            wrong := [*(["take"] if take != "last" else []), *(each for each in options if each not in _SHOWN)]
        ):
            problems.add(f"metric {name}: {wrong[0]!r} cannot be used with 'formula'", position)
        problems.raise_if_any()
        with raising() as problems:
            watching = Watching(self.draft, Values(problems), problems)
            texts = (each if isinstance(each, str) else each.path for each in ports)
            of_ports = tuple(Text(each, within(position, each)) for each in texts)
            source = Text(formula, within(position, formula)) if formula else None
            given: dict[str, object] = {"take": take, **options}
            entries = watching.options(Measure, f"metric {name}", given, position)
            watching.metric(MetricText(name, of_ports, source, entries, position), Locals(), given)
            watching.check_formulas(each.name for each in self.metrics)
        self._add(watching.found)

    def monitor(self, name: str, property: str, **options: Unpack[RequirementOptions]) -> None:
        """A property that every run must have; docs/language.md describes how to write one.

        >>> model.monitor("safe", "always clearance.distance >= 2 m", stop=True)
        """
        position = call_site()
        with raising() as problems:
            if not NAME.match(name):
                problems.add(f"{name!r} is not a name", position, NAMES_HAVE)
            watching = Watching(self.draft, Values(problems), problems)
            for metric in (name, f"{name}_robustness"):
                if any(each.name == metric for each in self.metrics):
                    problems.add(f"there is already a metric {metric!r}", position, "give the monitor another name")
            given: dict[str, object] = {"property": property, **options}
            entries = watching.options(Requirement, f"monitor {name}", given, position)
            watching.monitor(MonitorText(name, entries, position), Locals(), given)
        self._add(watching.found)

    def outputs(self, pattern: str, what: str, position: Position, problems: Problems) -> list[str]:
        """The output ports that a pattern selects; what is wrong with it is added to ``problems`` as ``what``'s."""
        return Watching(self.draft, Values(problems), problems).select(Text(pattern, position), what)

    def _watch(self, ports: Iterable[str | Port], ask: Callable[[Watching, Text], None]) -> None:
        """Add what is to be watched, with the rules of a model file."""
        position = call_site()
        with raising() as problems:
            watching = Watching(self.draft, Values(problems), problems, self.recorded)
            for port in ports:
                path = port if isinstance(port, str) else port.path
                ask(watching, Text(path, within(position, path)))
        self._add(watching.found)

    # -- the whole ------------------------------------------------------------------------------------------------

    def check(self) -> None:
        """Check the model as a whole; raises ``ModelError`` with everything that is wrong.

        A ``Simulation`` does this first.
        """
        if not self.is_checked:
            problems = Problems()
            if check_nesting(self.aspects, self.graph, problems):
                self.edit().graph.detours = detours(self.graph, self.aspects)
            check(self.draft, problems)
            check_processors(self.aspects, self.graph, problems)
            problems.raise_if_any()
            self.warnings = problems.warnings
            self.is_checked = True
        self.graph.freeze()

    def order(self) -> dict[str, int]:
        """Engine: the firing order of a checked model; the same for all its runs."""
        if self._order is None:
            with without_collection():
                self._order = firing_order(self.graph)
        return self._order

    # -- changes: their arguments have been checked --------------------------------------------------

    def edit(self) -> Draft:
        """The draft, for changes: what was checked before may no longer hold."""
        if self.graph.is_frozen:
            self.draft = self.draft.copy()
        self.is_checked = False
        self.origin = None
        self._order = None
        return self.draft

    def adopt(self, draft: Draft, aspects: Iterable[WovenAspect], watched: Watched | None = None) -> None:
        """Continue with a draft made from the present one, with further aspects."""
        self.draft = draft
        self.edit()
        self.enlist(aspects)
        if watched is not None:
            self.stop_time, self.seed = watched.stop_time, watched.seed
            self._add(watched)

    def enlist(self, aspects: Iterable[WovenAspect]) -> None:
        """Add these aspects to the model."""
        self.origin = None
        self.aspects = arranged([*self.aspects, *aspects], self.graph)

    def _add(self, watched: Watched) -> None:
        self._stop_position = watched.stop_position or self._stop_position
        self.recorded = [*self.recorded, *watched.recorded]
        self.stop_ports = [*self.stop_ports, *watched.stop_ports]
        self.metrics = [*self.metrics, *watched.metrics]
        self.monitors = [*self.monitors, *watched.monitors]

    def scope(self, path: str) -> Composite:
        return self._scopes.setdefault(path, Composite(self, path))

    def forget(self, path: str) -> None:
        """Remove an actor or composite, and everything that attaches to it or watches it."""
        self.edit().graph.remove(path)
        self.aspects = [
            woven.without(path)
            for woven in self.aspects
            if not is_within(woven.name, path) and not (woven.model and is_within(woven.model.path, path))
        ]
        self.recorded = [port for port in self.recorded if not is_within(port, path)]
        self.stop_ports = [port for port in self.stop_ports if not is_within(port, path)]
        left = [each.without(path) for each in self.monitors]
        gone = {each.name for each, kept in zip(self.monitors, left, strict=True) if kept is None}
        self.monitors = [each for each in left if each is not None]
        self.metrics = [metric.without(path) for metric in self.metrics if metric.monitor not in gone]

    # -- for people -----------------------------------------------------------------------------------------------

    def __repr__(self) -> str:
        return f"<Model {self._caption()}>"

    @property
    def extent(self) -> str:
        """Its size in words."""
        graph = self.graph
        parts = [(len(graph.actors), "actor"), (graph.connections, "connection"), (len(self.aspects), "aspect")]
        return ", ".join(counted(number, noun) for number, noun in parts)

    def _repr_html_(self) -> str:
        """The drawing of the model and its contents; drawing is looked up, because it is a layer above models."""
        try:
            picture = import_module("...calls.picturing", __name__).draw(self)._repr_html_()
        except EpicycleError:  # it may be incomplete
            return super()._repr_html_()
        summary = f"<summary>{escape(visible(self._caption()))}</summary>"
        return f"{picture}<details>{summary}{super()._repr_html_()}</details>"

    def _caption(self) -> str:
        return f"{self.name}: {self.extent}" + ("" if self.stop is None else f", stops at {self.stop:g} s")

    def _tables(self) -> list[Table]:
        actors = []
        for path, actor in self.graph.actors.items():
            values = [(name, getattr(actor, name)) for name in declared_parameters(type(actor))]
            given = (f"{name}={short(value)}" for name, value in values if value is not None)
            actors.append((path, type(actor).__name__, ", ".join(given)))
        connections = [
            (hop.source, hop.destination, "" if hop.delay is None else f"{hop.delay / 1e9:g} s")
            for hop in self.graph.hops
        ]
        aspects = [(woven.name, repr(woven.aspect), ", ".join(woven.places)) for woven in self.aspects]
        parameters = [(name, short(value)) for name, value in self.parameters.items()]
        return [
            Table(("parameter", "value"), parameters),
            Table(("actor", "type", "parameters"), actors),
            Table(("from", "to", "delay"), connections),
            Table(("aspect", "", "at"), aspects),
        ]
