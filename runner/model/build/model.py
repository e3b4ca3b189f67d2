"""Model: what is loaded or built, and then run."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from html import escape
from importlib import import_module
from pathlib import Path
from typing import Unpack

from epicycle.actors import EpicycleError, Stop, counted, declared_parameters, visible

from ...support.shown import short
from ...support.tables import Table, Tabled
from ..catalogue.dialect import Dialect
from ..catalogue.metrics import MetricOptions, MetricSpec, TakeName, take_fault
from ..graph.woven import WovenAspect
from ..language.fields import nanoseconds
from ..language.metrics import WatchText
from ..language.values import Locals
from ..temporal import Requirement, RequirementOptions
from ..text.document import Mapping as MappingNode
from ..text.document import Scalar
from ..text.problems import Position, Problems
from ..text.program import call_site
from ..text.reading import NAME, NAMES_HAVE, Text, within
from .building import Building
from .named import Named, Port, director_of, raising
from .outputs import OutputReader, checked_seed
from .resolve import ParameterResolver
from .scope import Scope

DeclaredFigure = tuple[str, dict[str, object], MappingNode]  # type, values, as written


_SHOWN = ("unit", "to", "doc", "label")  # options of a metric that is computed from others


class Model(Building, Scope, Tabled):
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
        Building.__init__(self, name)
        Scope.__init__(self, self, "")
        self.doc = doc
        with raising() as problems:
            found = director_of(name, {"like": like}, call_site(), problems)
        self.graph.domains[""].dialect = found.get("like", Dialect)
        self.parameters |= parameters or {}
        self.figures: dict[str, DeclaredFigure] = {}
        self.output.seed = checked_seed(seed)
        self.stop = stop

    @property
    def stop(self) -> float | None:
        """When the run ends, in seconds; None if only an empty agenda or a port ends it.

        It can be set as ``"500 ms"``.
        """
        return None if self.output.stop_time is None else self.output.stop_time / 1e9

    @stop.setter
    def stop(self, stop: float | str | None) -> None:
        self.output = replace(self.output, stop_time=None if stop is None else nanoseconds(stop))

    @property
    def endless(self) -> str:
        """Why a run never ends unless it is interrupted, in words; empty if that is unknown."""
        if self.output.stop_time is not None or self.output.stop_ports:
            return ""
        actors = self.graph.actors.values()
        clock = next((actor.path for actor in actors if actor.is_endless), "")
        if not clock or any(isinstance(actor, Stop) for actor in actors):
            return ""
        return f"{self.name} never ends: {clock} ticks for ever, and the model sets neither stop nor stop_when"

    # -- what disturbs it -----------------------------------------------------------------------------------------

    def disturb(
        self,
        disturbance: str | Path,
        *,
        at: Iterable[str] | None = None,
        set: Mapping[str, object] | None = None,
        types: Iterable[type] = (),
    ) -> list[WovenAspect]:
        """Weave the aspects of a packaged disturbance, or of a YAML file, around the model.

        ``set`` gives the disturbance's own parameters their values; ``types`` are your own aspect classes that it may
        name.  ``at`` are ports in place of those that it names: then only aspects that alter, delay or lose tokens
        are woven.  A disturbance that sets parameters of the model must be loaded together with it: ``load_model(...,
        disturb=...)``.  Raises ``ModelError``.
        """
        from .disturbance import disturb

        places: dict[str, list[str]] = {"input": [], "output": []}
        ports, position = self.graph.ports, call_site()
        with raising() as problems:
            for path in at or ():
                if path in ports:
                    places[ports[path].direction].append(path)
                else:
                    problems.add(f"there is no port {path!r}", position, near=(path, ports))
        woven, _ = disturb(self, [str(disturbance)], set or {}, types, only_ports=at is not None, at=places)
        return woven

    # -- what is watched ------------------------------------------------------------------------------------------

    def record(self, *ports: str | Port) -> None:
        """Record what output ports send; give ports, or patterns over the ports that exist now."""
        self._watch(ports, lambda reader, text: reader.record(text))

    def stop_when(self, *ports: str | Port) -> None:
        """End the run, after the current tag, when one of these output ports sends something true."""
        self._watch(ports, lambda reader, text: reader.stop_when(text))

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
        if any(metric.name == name for metric in self.output.metrics):
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
            reader = OutputReader(self.graph, ParameterResolver(problems), self.output)
            named = Named(self.graph, self.path, position, problems)
            of_ports = tuple(text for each in ports if (text := named.watched(each)) is not None)
            source = Scalar(formula, formula, False, within(position, formula)) if formula else None
            given: dict[str, object] = {"take": take, **options}
            entries = reader.options(MetricSpec, f"metric {name}", given, position)
            reader.metric(WatchText(name, entries, position, of_ports, source), Locals(), given)
            reader.check_formulas()
        self.output = reader.found

    def monitor(self, name: str, property: str, **options: Unpack[RequirementOptions]) -> None:
        """A property that every run must have; docs/language.md describes how to write one.

        >>> model.monitor("safe", "always clearance.distance >= 2 m", stop=True)
        """
        position = call_site()
        with raising() as problems:
            if not NAME.match(name):
                problems.add(f"{name!r} is not a name", position, NAMES_HAVE)
            for metric in (name, f"{name}_robustness"):
                if any(each.name == metric for each in self.output.metrics):
                    problems.add(f"there is already a metric {metric!r}", position, "give the monitor another name")
            problems.raise_if_any()
            reader = OutputReader(self.graph, ParameterResolver(problems), self.output)
            given: dict[str, object] = {"property": property, **options}
            entries = reader.options(Requirement, f"monitor {name}", given, position)
            reader.monitor(WatchText(name, entries, position), Locals(), given)
        self.output = reader.found

    def outputs(self, pattern: str, what: str, position: Position, problems: Problems) -> list[str]:
        """The output ports that a pattern selects; what is wrong with it is added to ``problems`` as ``what``'s."""
        return OutputReader(self.graph, ParameterResolver(problems)).select(Text(pattern, position), what)

    def _watch(self, ports: Iterable[str | Port], ask: Callable[[OutputReader, Text], None]) -> None:
        """Add what is to be watched, with the rules of a model file."""
        position = call_site()
        with raising() as problems:
            reader = OutputReader(self.graph, ParameterResolver(problems), self.output)
            named = Named(self.graph, self.path, position, problems)
            for port in ports:
                if (text := named.watched(port)) is not None:
                    ask(reader, text)
        self.output = reader.found

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
            picture = import_module("....interface.calls.picturing", __name__).draw(self)._repr_html_()
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
            (edge.source, edge.destination, "" if edge.delay is None else f"{edge.delay / 1e9:g} s")
            for edge in self.graph.edges
        ]
        aspects = [(woven.name, repr(woven.aspect), ", ".join(woven.places)) for woven in self.aspects]
        parameters = [(name, short(value)) for name, value in self.parameters.items()]
        return [
            Table(("parameter", "value"), parameters),
            Table(("actor", "type", "parameters"), actors),
            Table(("from", "to", "delay"), connections),
            Table(("aspect", "", "at"), aspects),
        ]
