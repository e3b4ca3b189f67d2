"""Turns composites with their own firing rules into plain ones: ThreadedComposite and Case."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import count

from .actors import face_of, is_layout
from .entities import ABSTRACT_COMPOSITE, Entity, Link, Port, Property, Relation, kind
from .notes import Notes
from .operators import java_text
from .relations import PortFace
from .scope import Scope
from .syntax import ExpressionError
from .table import counterpart_of

_PARAMETER = "ptolemy.data.expr.Parameter"
_LIBRARY = "ptolemy.actor.lib."
_OF_THREADS = ("delay", "synchronizeToRealTime", "UNDEFINED")


def plain_composites(model: Entity, notes: Notes) -> None:
    """Express with wires and actors what such composites do."""
    _Rewriting(notes).inside(model, Scope(model))


class _Rewriting:
    def __init__(self, notes: Notes) -> None:
        self._notes = notes
        self._orders = count(4_000_000)  # after all links of the file

    def inside(self, composite: Entity, scope: Scope) -> None:
        for child in composite.entities.values():
            inner = scope.inside(child)
            if kind(child) == "ThreadedComposite" and child.entities:
                names = [path.partition(".")[2] for path in composite.links if path.startswith(f"{child.name}.")]
                self._threaded(child, inner, dict.fromkeys([*names, *child.ports]))
            elif child.java.endswith(".hoc.Case") and child.entities:
                self._case(child, inner, is_fed=bool(composite.links.get(f"{child.name}.control")))
            self.inside(child, inner)

    def _wire(self, composite: Entity, *ports: str) -> None:
        """Join ports of a composite, with all their channels."""
        name = f"relation of {' '.join(ports)}"
        composite.relations[name] = Relation(name)
        for port in ports:
            composite.links.setdefault(port, []).append(Link(port, name, 0, next(self._orders)))

    def _actor(self, composite: Entity, name: str, java: str, **parameters: str) -> str:
        while name in composite.entities:
            name += "_"
        made = composite.entities[name] = Entity(name, f"{_LIBRARY}{java}", line=composite.line)
        made.properties = {key: Property(key, _PARAMETER, value) for key, value in parameters.items()}
        return name

    # -- threads ----------------------------------------------------------------------------------------------------

    def _threaded(self, child: Entity, scope: Scope, ports: Iterable[str]) -> None:
        """The inner actor fires at once; its outputs leave after the delay."""
        inner = next(iter(child.entities.values()))
        try:
            said = child.properties.get("delay")
            delay = 0.0 if said is None or said.value == "UNDEFINED" else float(scope.value_of(said))
        except (ExpressionError, TypeError, ValueError) as error:
            self._notes.error(f"{child.name}.delay: {error}")
            return
        if (said is not None and said.value == "UNDEFINED") or delay < 0:
            self._notes.note(
                f"{child.name}: in Ptolemy, it sends when its thread has finished; here, at the next microstep"
            )
        for name, said in list(child.properties.items()):
            if name not in _OF_THREADS and not is_layout(said) and not said.java.endswith("Director"):
                inner.properties.setdefault(name, said)  # the inner actor takes over its parameters
        for name in [
            *_OF_THREADS,
            *(name for name, said in child.properties.items() if said.java.endswith("Director")),
        ]:
            child.properties.pop(name, None)
        for name in ports:
            face = self._mirrored(child, inner, name)
            if face is None:
                continue
            if face.direction == "input":
                self._wire(child, name, f"{inner.name}.{name}")
            else:
                late = self._actor(child, f"{name}_delay", "TimeDelay", delay=repr(max(delay, 0.0)))
                self._wire(child, f"{inner.name}.{name}", f"{late}.input")
                self._wire(child, f"{late}.output", name)
        child.java = ABSTRACT_COMPOSITE

    def _mirrored(self, child: Entity, inner: Entity, name: str) -> PortFace | None:
        """The face of a port of the inner actor, which is given to the composite, too."""
        face = face_of(counterpart_of(inner.java), inner, name) or face_of(None, child, name)
        if face is not None:
            port = child.ports.setdefault(name, Port(name))
            for flag in (face.direction, *(["multiport"] if face.multi else [])):
                port.properties.setdefault(flag, Property(flag, value="true"))
        return face

    # -- cases ------------------------------------------------------------------------------------------------------

    def _case(self, child: Entity, scope: Scope, *, is_fed: bool) -> None:
        """Inputs go to the refinement with the name that ``control`` gives."""
        said = child.properties.pop("control", None)
        try:
            first = java_text(True if said is None else scope.value_of(said))
        except (ExpressionError, TypeError) as error:
            self._notes.error(f"{child.name}.control: {error}")
            return
        cases = dict(child.entities)
        default = "default" if "default" in cases else next(reversed(cases))
        chosen = first if first in cases else default
        order = [chosen, *(name for name in cases if name not in (chosen, default)), default]
        order = list(dict.fromkeys(order)) if is_fed else [chosen]
        for name in [each for each in child.properties if child.properties[each].java.endswith("Director")]:
            del child.properties[name]
        child.entities = {name: cases[name] for name in cases if name in order}
        ports = {name: port for name, port in child.ports.items() if name != "control"}
        which = self._which(child, order, default) if is_fed else ""
        for name, port in ports.items():
            ends = [f"{each}.{name}" for each in order if name in cases[each].ports]
            if port.flag("output"):
                self._wire(child, *ends, name)
            elif not is_fed:
                self._wire(child, name, *ends)
            else:
                switch = self._actor(child, f"{name}_switch", "Switch")
                self._wire(child, name, f"{switch}.input")
                self._wire(child, f"{which}.output", f"{switch}.control")
                for end in ends:
                    self._wire(child, f"{switch}.output", end)
        child.java = ABSTRACT_COMPOSITE

    def _which(self, child: Entity, order: list[str], default: str) -> str:
        """Add an Expression that computes the number of the refinement."""
        text = str(order.index(default))
        for number, name in enumerate(order):
            if name != default:
                is_literal = name in ("true", "false") or name.lstrip("-").isdigit()
                text = f"control == {name if is_literal else repr(name)} ? {number} : ({text})"
        which = self._actor(child, "which", "Expression", expression=text)
        flags = {"input": Property("input", value="true")}
        child.entities[which].ports["control"] = Port("control", properties=dict(flags))
        child.ports["control"] = Port("control", properties=dict(flags))
        self._wire(child, "control", f"{which}.control")
        return which
