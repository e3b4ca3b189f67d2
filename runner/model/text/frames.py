"""Lists and mappings that are still open while a YAML text is read, and values in brackets that a comma has cut."""

import dataclasses
from dataclasses import dataclass, field

from yaml.events import CollectionStartEvent

from .kinds import COMMA
from .nodes import Entry, Node, Scalar
from .problems import Fix, Position, Problems
from .scalars import quoted, short


@dataclass(slots=True)
class Frame:
    """A list or mapping that is still open."""

    event: CollectionStartEvent
    position: Position
    is_mapping: bool
    items: list[Node] = field(default_factory=list)
    entries: dict[str, Entry] = field(default_factory=dict)
    has_key: bool = False
    key: Scalar | None = None  # None with has_key: a key that was refused, its value is dropped
    rest: Scalar | None = None  # what may belong to the value before, if it is a key without a value
    cut: dict[str | int, Scalar] = field(default_factory=dict)  # values that a comma has cut, whole, by key or number
    weight: int = 1  # nodes within, this one included
    height: int = 1  # levels within, this one included

    # -- commas within brackets -----------------------------------------------------------------------------------

    def last(self) -> tuple[str | int, Node | None]:
        """The latest value, with its key or number."""
        if not self.is_mapping:
            return len(self.items) - 1, self.items[-1] if self.items else None
        key = next(reversed(self.entries), None)
        return ("", None) if key is None else (key, self.entries[key].value)

    def rest_of(self, node: Node) -> Scalar | None:
        """What stands behind a comma in brackets, if it seems to belong to the value before."""
        if not self.event.flow_style or not isinstance(node, Scalar) or not node.plain:
            return None
        _, before = self.last()
        if not isinstance(before, Scalar) or not isinstance(before.value, str) or not (before.plain or self.cut):
            return None
        is_open = before.text.count("(") > before.text.count(")")
        is_no_name = self.is_mapping and " " in node.text
        return node if is_open or is_no_name else None

    def join(self, rest: Scalar) -> None:
        """Put what stands behind a comma back to the value before, so that nothing else is said of it."""
        place, before = self.last()
        assert isinstance(before, Scalar)
        at, end, text = before.position, rest.position, f"{before.text}, {rest.text}"
        if at.line == end.line:
            at = dataclasses.replace(at, length=end.column + end.length - at.column)
            text = at.source[at.column - 1 : at.column - 1 + at.length]
        whole = self.cut[place] = Scalar(text, text, False, at)
        if isinstance(place, int):
            self.items[place] = whole
        else:
            self.entries[place] = Entry(self.entries[place].key, whole)

    def report(self, problems: Problems) -> None:
        """Report the values that a comma has cut."""
        for value in self.cut.values():
            brackets, right = "{ }" if self.is_mapping else "[ ]", quoted(value.text)
            fix = Fix(value.position, right) if value.text in value.position.source else None
            message = f"a comma within {brackets} ends a value: {short(value.text)!r} must be quoted"
            problems.add(message, value.position, f"write {right}", kind=COMMA, fix=fix)
