"""Finds what reaches a port across the borders of composites, and actors that never fire because nothing does."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from epicycle.actors import InputPort, declared_ports

from ..dialect import known_types
from .budget import spend
from .directors import fires_whole
from .entities import director_of
from .notes import Notes
from .parts import Net, Part
from .syntax import ExpressionError
from .table import Row
from .tables import WORDS, table
from .translation import Array, Kind, kind_of

MAX_ROUNDS = 200


class Reach:
    """Counts the actors that send into a net, and those that it reaches: 0, 1, or 2 for several."""

    def __init__(self) -> None:
        self._found: dict[tuple[int, bool], int] = {}

    def count(self, net: Net, *, senders: bool) -> int:
        """The senders to a net, or its receivers."""
        key = id(net), senders
        if key not in self._found:
            self._found[key] = 0  # while it is being counted
            self._found[key] = min(sum(self._beyond(net, senders=senders)), 2)
        return self._found[key]

    def _beyond(self, net: Net, *, senders: bool) -> Iterator[int]:
        for end in net.ends:
            part = end.part
            if part.is_idle or end.is_source is not senders:
                continue
            is_leaf = not end.is_own and (part.role == "machine" or not (part.parts or part.entity.relations))
            if is_leaf or (end.is_own and part.outer is not None and part.outer.role == "machine"):
                yield 1  # refinements are joined to their machine by name
                continue
            for channel, each in (part.outside if end.is_own else part.inside).get(end.port, ()):
                if channel == end.channel:
                    yield self.count(each, senders=senders)

    def feeds(self, part: Part, port: str) -> bool:
        """Whether anything sends to a port of a part."""
        nets = part.outside.get(port, ())
        is_triggered = f"{part.entity.name}.{port}" in part.around.triggers
        return is_triggered or any(self.count(net, senders=True) for _, net in nets)


def trigger(model: Part) -> None:
    """Note which inputs of composites start iterations of their directors, and what fires in each of these."""
    for part in model.everything():
        director = director_of(part.entity) if part is not model else None
        if director is None or not fires_whole(director):
            continue
        links = part.entity.links
        inputs = [name for name, port in part.entity.ports.items() if port.flag("input") and links.get(name)]
        for name, child in part.parts.items() if inputs else ():
            if child.row is not None and "trigger" in child.row.ports and not links.get(f"{name}.trigger"):
                part.triggers[f"{name}.trigger"] = inputs[0]


# -- actors that never fire -------------------------------------------------------------------------------------------


def leave_out_idle(model: Part, notes: Notes) -> None:
    """Leave out the actors that can never fire, and those that then never receive anything."""
    actors = [
        (each, each.row) for each in model.everything() if each.row is not None and not each.row.is_view and each.outer
    ]
    for _ in range(MAX_ROUNDS):
        reach = Reach()
        spend(len(actors))
        idle = [
            (each, port) for each, row in actors if not each.is_idle and (port := _lacks(each, row, reach)) is not None
        ]
        for part, port in idle:
            part.is_idle = True
            notes.note(f"{part.path} is left out: it never fires because nothing sends to its {port}")
        if not idle:
            return


def _lacks(part: Part, row: Row, reach: Reach) -> str | None:
    """The input for lack of which an actor never fires; None if it may."""
    kind = known_types().actors.get(row.type)
    if kind is None:
        return None
    needs = row.settings.get("needs", "").split()
    if needs and not any(reach.feeds(part, name) for name in needs):
        return " and ".join(sorted(needs))
    names = dict.fromkeys([*row.ports, *part.entity.ports, *row.parameters, *part.entity.properties])
    inputs = [name for name in names if (face := part.face(name)) is not None and face.direction == "input"]
    if not kind.is_source and not any(reach.feeds(part, name) for name in inputs):
        return inputs[0] if inputs else "inputs"
    declared = declared_ports(kind)
    several = Counter(said.ours for said in row.ports.values())
    single = [(name, declared.get(said.ours)) for name, said in row.ports.items() if several[said.ours] == 1]
    required = [name for name, port in single if isinstance(port, InputPort) and port.required]
    return next((name for name in [*_waits_for(part, row), *required] if not reach.feeds(part, name)), None)


def _waits_for(part: Part, row: Row) -> list[str]:
    """The linked inputs added in the model to an actor that waits for a token at each of them."""
    if row.type not in ("Expression", "RecordAssembler") or row.settings.get("set", {}).get("apart"):
        return []
    added = [port for name, port in part.entity.ports.items() if name not in row.ports and port.flag("input")]
    has_value = part.entity.properties
    return [each.name for each in added if each.name in part.linked and each.name not in has_value
            and "defaultValue" not in each.properties]  # fmt: skip


# -- kinds of tokens --------------------------------------------------------------------------------------------------


def kinds_at(part: Part, row: Row) -> dict[str, Kind]:
    """The kinds of what the ports of an actor receive, judging by the actors connected to it.

    In Ptolemy, the quotient of whole numbers has no fraction, and arrays are added item by item.
    """
    found: dict[str, Kind] = {}
    for port in (*row.ports, *part.entity.ports):
        ends = [
            end for _, net in part.outside.get(port, ()) for end in net.ends if end.is_source and not end.part.is_idle
        ]
        kinds = {None if end.is_own else _sent(end.part) for end in ends if (end.part, end.port) != (part, port)}
        if len(kinds) == 1 and (kind := kinds.pop()) is not None:
            found[port] = kind
    return found


def _sent(part: Part) -> Kind:
    """The kind of everything that an actor sends; None if it is not known."""
    names = table("words")["what is sent"].get(part.entity.kind)
    if names is None:
        return Array(None) if part.entity.kind in WORDS["senders of arrays"] else None
    kinds: set[Kind] = set()
    for name in names:
        said = part.entity.properties.get(name)
        try:
            value = 0 if said is None else part.scope.value_of(said)
        except ExpressionError:
            return None
        kinds |= {kind_of(each) for each in (value if name == "values" and isinstance(value, list) else [value])}
    return (kinds or {int}).pop() if len(kinds) < 2 else None
