"""Layout: the positions of all boxes, ports, wires and badges of an outline; all lengths in points.

The order of composites is laid out from the outside in (a composite's ports are sorted by what is outside it, and its
inside follows), their size from the inside out.  Tokens enter and leave a composite only through its ports, so each
composite is one flat drawing with a frame around it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from weakref import WeakValueDictionary

from ..canvas import text_width
from .layers import Cell, Net, Pin, Run, layer, order
from .outlines import START, Box, Link, Outline, Port, label
from .places import Trunk, place, tracks

NAME, KIND, PORT, BADGE = 9.0, 7.5, 7.0, 6.5  # font sizes in points
ROW = 14.0  # distance between ports of an actor
HEADER, TITLE = 28.0, 20.0  # heights of the names of an actor and a composite
BADGE_HEIGHT, BADGE_GAP = 12.0, 3.0
LINE = 10.0  # from one line of a text to the next
HEAD = 9.0  # space for an arrowhead
PADDING, TRACK = 10.0, 9.0  # beside and between the tracks of a channel
MARGIN = 12.0

Point = tuple[float, float]
Piece = tuple[Point, Point]
Line = tuple[Point, ...]


@dataclass(frozen=True)
class PlacedPort:
    """A port on the edge of a box."""

    port: Port
    side: str
    x: float
    y: float
    is_joined: bool


@dataclass(frozen=True)
class PlacedBox:
    """A box; ``level`` is how many composites it is in."""

    box: Box
    x: float
    y: float
    width: float
    height: float
    level: int
    ports: tuple[PlacedPort, ...]


@dataclass(frozen=True)
class Wire:
    """A tree of lines from one port to others; ``level`` is how many composites it is in."""

    source: str
    targets: tuple[str, ...]
    lines: tuple[Line, ...]
    heads: tuple[Point, ...]
    dots: tuple[Point, ...]
    level: int


@dataclass(frozen=True)
class Badge:
    """A badge on a line: an aspect where it is attached, or a connection's label with its delay (``aspect`` is "")."""

    text: str
    aspect: str
    x: float
    y: float  # of its centre
    delay: int | None = None  # ns
    place: str = ""  # where the aspect is attached: path of a port, actor or composite

    @property
    def width(self) -> float:
        return badge_width(self.text)

    @property
    def height(self) -> float:
        return badge_height(self.text)


@dataclass(frozen=True)
class Words:
    """A line of text; ``y`` is its height; ``x`` is its start, middle or end, depending on ``align``."""

    text: str
    x: float
    y: float
    size: float
    bold: bool = False
    is_soft: bool = False
    align: str = "left"

    @property
    def width(self) -> float:
        return text_width(self.text, self.size, self.bold)


@dataclass
class Drawing:
    """Everything with its position; the origin is at the top left."""

    outline: Outline
    scope: Scope = field(compare=False)
    width: float = 0.0
    height: float = 0.0
    boxes: list[PlacedBox] = field(default_factory=list)
    wires: list[Wire] = field(default_factory=list)
    badges: list[Badge] = field(default_factory=list)
    words: list[Words] = field(default_factory=list)
    cut: int = 0  # wires shown by names at their ends


def draw(outline: Outline) -> Drawing:
    """Lay out an outline; composites that are as in a drawing that somebody still has are laid out no second time."""
    scope = Scope(outline.root, (), ())
    drawing = Drawing(outline, scope, scope.width + 2 * MARGIN, scope.height + 2 * MARGIN)
    scope.put(drawing, MARGIN, MARGIN, 0)
    return drawing


_scopes: WeakValueDictionary[str, Scope] = WeakValueDictionary()  # open composites, by all that they depend on


def badge_width(words: str) -> float:
    return max(text_width(line, BADGE) for line in words.split("\n")) + 8.0


def badge_height(words: str) -> float:
    return BADGE_HEIGHT + LINE * words.count("\n")


class Scope:
    """The inside of one open composite, or of the model, with its ports in the order in which they stand."""

    def __init__(self, box: Box, inputs: Sequence[Port], outputs: Sequence[Port]) -> None:
        self.box = box
        self.top = TITLE + MARGIN if box.path else 0.0  # where the inside starts
        self.inner: dict[Box, Scope] = {}
        self.ends: dict[Pin, Port] = {}
        self.pins: dict[str, Pin] = {}  # by the paths of their ports
        frame = []
        for kind, side, ports in (("entry", "right", inputs), ("exit", "left", outputs)):
            for port in ports:
                frame.append(Cell(kind, width=text_width(port.name, PORT) + 8.0, height=ROW))
                self._pin(frame[-1], side, port, ROW - 3.0)
        self.cells = {child: Cell("box") for child in box.children}
        for child, cell in self.cells.items():
            for side, ports in (("left", child.inputs), ("right", child.outputs)):
                for port in ports:
                    self._pin(cell, side, port)
        self.nets = self._nets()
        self.layers, self.runs = layer([*frame, *self.cells.values()], list(self.nets))
        self.flags = {
            pin: text for net, link in self.nets.items() if net.is_cut for pin, text in self._flags(net, link)
        }
        order(self.layers, self.runs, frame)
        for child, cell in self.cells.items():
            self._measure(child, cell)
        self.height = place(self.layers, self.runs)
        self.width = self._columns()
        if box.path:
            self.height += TITLE + 2 * MARGIN
            self.width = max(self.width, text_width(f"{box.name}: {box.kind}", NAME, bold=True) + 2 * MARGIN)

    def _pin(self, cell: Cell, side: str, port: Port, offset: float = 0.0) -> None:
        pin = self.pins[port.path] = cell.pin(side)
        pin.offset = offset
        self.ends[pin] = port

    def _nets(self) -> dict[Net, Link]:
        """The nets: all links that leave one port with one label, represented by the first of them."""
        groups: dict[tuple[str, str], list[Link]] = {}
        for link in self.box.links:
            groups.setdefault((link.source, label(link)), []).append(link)
        nets = {}
        for (source, words), links in groups.items():
            size = (badge_width(words) + 8.0, badge_height(words)) if words else None
            nets[Net(self.pins[source], [self.pins[link.target] for link in links], size)] = links[0]
        return nets

    def _flags(self, net: Net, link: Link) -> Iterator[tuple[Pin, str]]:
        """What stands at the ends of a net that has no line."""
        targets = [self._name(pin) for pin in net.targets]
        beyond = targets[0] if len(targets) == 1 else f"{len(targets)} inputs"
        yield net.source, f"{label(link)} \u2192 {beyond}".strip()
        for pin in net.targets:
            yield pin, f"{self._name(net.source)} \u2192"

    def _name(self, pin: Pin) -> str:
        return self.ends[pin].path.removeprefix(f"{self.box.path}.")

    def _badges(self, pin: Pin) -> list[tuple[str, str]]:
        """The texts beside a port, and the aspects that they are."""
        flag = self.flags.get(pin)
        return [*((aspect, aspect) for aspect in self.ends[pin].aspects), *([] if flag is None else [(flag, "")])]

    def _badges_width(self, pin: Pin) -> float:
        return sum(badge_width(text) + BADGE_GAP for text, _ in self._badges(pin))

    def _measure(self, child: Box, cell: Cell) -> None:
        """Set the size of a box and the positions of its ports; an open composite is laid out to do so."""
        if child.is_open:
            inputs, outputs = [self.ends[pin] for pin in cell.left], [self.ends[pin] for pin in cell.right]
            key = repr((child, inputs, outputs))  # everything it depends on
            scope = self.inner[child] = _scopes.get(key) or Scope(child, inputs, outputs)
            _scopes[key] = scope
            cell.width, cell.height = scope.width, scope.height
            for pin in (*cell.left, *cell.right):
                inside = scope.pins[self.ends[pin].path]
                pin.offset = scope.top + inside.y
            return
        widths = []
        for pins in (cell.left, cell.right):
            widths.append(max((text_width(self.ends[pin].name, PORT) for pin in pins), default=0.0))
            for row, pin in enumerate(pins):
                pin.offset = HEADER + ROW * row + ROW / 2
        rows = max(len(cell.left), len(cell.right))
        hidden = max((badge_width(name) for name in child.aspects), default=0.0)
        names = max(
            text_width(child.name, NAME, bold=True), *(text_width(each, KIND) for each in child.kind.split("\n"))
        )
        names += 16.0 if child.is_closed else 0.0  # beside the symbol of a closed one
        cell.width = max(names + 16.0, sum(widths) + 12.0 + (10.0 if all(widths) else 0.0), hidden + 16.0, 44.0)
        cell.height = HEADER + ROW * rows + 3.0 + (BADGE_HEIGHT + BADGE_GAP) * len(child.aspects)
        if child.shape:
            self._measure_mode(child, cell, names, rows)

    def _measure_mode(self, child: Box, cell: Cell, names: float, rows: int) -> None:
        """The same for a mode, whose arrows end anywhere at its sides."""
        if child.shape == START:
            cell.width = cell.height = 8.0
        else:
            cell.width, cell.height = names + 20.0, max(HEADER + LINE * child.kind.count("\n") + 6.0, ROW * rows + 6.0)
        for pins in (cell.left, cell.right):
            for row, pin in enumerate(pins):
                pin.offset = round(cell.height * (row + 0.5) / len(pins))

    def _columns(self) -> float:
        """Set the positions of the layers and of the tracks between them; returns the total width."""
        self.spans: list[tuple[float, float]] = []
        self.trunks: dict[Run, list[Trunk]] = {}
        x = 0.0 if self.layers[0] or not self.box.path else MARGIN
        for cells, runs in zip(self.layers, [*self.runs, []], strict=True):
            before = max((self._margin(cell, cell.left) for cell in cells), default=0.0)
            after = max((self._margin(cell, cell.right) for cell in cells), default=0.0)
            room = max((cell.width for cell in cells), default=0.0)
            for cell in cells:  # boxes are centred in their layer
                cell.x = x + before + (room - cell.width) // 2
            self.spans.append((x, x + before + room + after))
            x = self.spans[-1][1]
            trunks, count = tracks(runs)
            for trunk in trunks:
                trunk.x = x + PADDING + TRACK * trunk.track
                for run in trunk.runs:
                    self.trunks.setdefault(run, []).append(trunk)
            if runs:
                x += 2 * PADDING + TRACK * max(count - 1, 0)
        return x if self.layers[-1] or not self.box.path else x + MARGIN

    def _margin(self, cell: Cell, pins: list[Pin]) -> float:
        """The space that a box needs on one side for badges and arrowheads."""
        if cell.kind != "box":
            return 0.0
        arrow = HEAD if pins is cell.left else 4.0
        return max((self._badges_width(pin) + arrow for pin in pins), default=0.0)

    def _point(self, pin: Pin) -> Point:
        cell, is_left = pin.cell, pin in pin.cell.left
        if cell.kind == "pass":
            x = self.spans[cell.layer][0 if is_left else 1]
        elif cell.kind == "box":
            x = cell.x if is_left else cell.x + cell.width
        else:
            x = 0.0 if cell.kind == "entry" else self.width
        return x, pin.y

    def put(self, drawing: Drawing, x: float, y: float, level: int) -> None:
        """Add everything to a drawing, with the top left corner of this scope at (x, y)."""
        top = y + self.top
        linked = [*self.box.links, *(link for child in self.inner for link in child.links)]
        joined = {end for link in linked for end in (link.source, link.target)}
        for child, cell in self.cells.items():
            left, upper = x + cell.x, top + cell.y
            ports = []
            for side, pins in (("left", cell.left), ("right", cell.right)):
                for pin in pins:
                    port, at = self.ends[pin], upper + pin.offset
                    edge = left if side == "left" else left + cell.width
                    ports.append(PlacedPort(port, side, edge, at, port.path in joined))
                    start = (
                        edge - HEAD - self._badges_width(pin) + BADGE_GAP if side == "left" else edge + 4.0 + BADGE_GAP
                    )
                    for text, aspect in self._badges(pin):
                        drawing.badges.append(Badge(text, aspect, start, at, place=port.path))
                        start += badge_width(text) + BADGE_GAP
                    drawing.words.append(_port_name(ports[-1], child.is_open))
            drawing.words += self._names(child, left, upper, cell)
            hidden = upper + cell.height - BADGE_GAP - BADGE_HEIGHT / 2
            for name in reversed(child.aspects):
                middle = left + (cell.width - badge_width(name)) / 2
                drawing.badges.append(Badge(name, name, middle, hidden, place=child.path))
                hidden -= BADGE_HEIGHT + BADGE_GAP
            drawing.boxes.append(PlacedBox(child, left, upper, cell.width, cell.height, level, tuple(ports)))
            if child in self.inner:
                self.inner[child].put(drawing, left, upper, level + 1)
        for net, link in self.nets.items():
            drawing.wires.append(self._wire(net, x, top, level))
            drawing.cut += net.is_cut
            if net.labelled is not None:
                cell = net.labelled
                begin, end = self.spans[cell.layer]
                start = begin if cell.layer > net.source.cell.layer else end - cell.width
                at = top + cell.y + cell.height / 2
                drawing.badges.append(Badge(label(link), "", x + start + 4.0, at, delay=link.delay))

    def _names(self, box: Box, x: float, y: float, cell: Cell) -> list[Words]:
        """The name and type of a box: on one line above the inside of a composite, otherwise on two."""
        if box.is_open:
            name = Words(box.name, x + MARGIN, y + 14.0, NAME, bold=True)
            return [name, Words(f": {box.kind}", name.x + name.width, name.y, NAME, is_soft=True)]
        middle, lines = x + cell.width / 2, box.kind.split("\n")
        if box.shape:
            y += (cell.height - LINE * len(lines) - (16.0 if box.kind else 9.0)) / 2
        return [
            Words(box.name, middle, y + 12.0, NAME, bold=True, align="center"),
            *(
                Words(line, middle, y + 22.5 + LINE * number, KIND, is_soft=True, align="center")
                for number, line in enumerate(lines)
            ),
        ]

    def _wire(self, net: Net, x: float, y: float, level: int) -> Wire:
        pieces: list[Piece] = []
        if net.is_cut:
            ends = [(net.source, 4.0), *((pin, -HEAD) for pin in net.targets)]
            pieces = [((at, height), (at + stub, height)) for pin, stub in ends for at, height in [self._point(pin)]]
        for span, runs in zip(self.spans, self.runs, strict=False):
            for run in (each for each in runs if each.net is net):
                pieces += self._pieces(run)
                # A pass is drawn with the run on its right.
                passes = (self._point(pin)[1] for pin in run.left if pin.cell.kind == "pass")
                pieces += [((span[0], height), (span[1], height)) for height in passes]
        lines, dots = trace([((x + a, y + b), (x + c, y + d)) for (a, b), (c, d) in pieces])
        heads = tuple((x + a, y + b) for a, b in map(self._point, net.targets))
        targets = tuple(self.ends[pin].path for pin in net.targets)
        return Wire(self.ends[net.source].path, targets, lines, heads, dots, level)

    def _pieces(self, run: Run) -> list[Piece]:
        """The straight pieces of a run: its trunk, and a line from each pin to it."""
        left, right = [self._point(pin) for pin in run.left], [self._point(pin) for pin in run.right]
        trunks = self.trunks.get(run, [])
        if not trunks:
            return [(left[0], right[0])]
        # A trunk may be longer than this run needs: runs to one port share it.
        tracks = [trunk.x for trunk in trunks]
        stops = [[height for _, height in left], [height for _, height in right]]
        stops[1:1] = [trunk.right for trunk in trunks[:-1]]  # where a divided trunk changes to its second track
        pieces: list[Piece] = [((x, height), (tracks[0], height)) for x, height in left]
        for x, (before, after) in zip(tracks, pairwise(stops), strict=True):
            pieces.append(((x, min(before + after)), (x, max(before + after))))
        pieces += [
            ((x, level), (beyond, level)) for (x, beyond), (level, *_) in zip(pairwise(tracks), stops[1:], strict=False)
        ]
        pieces += [((tracks[-1], height), (x, height)) for x, height in right]
        return [piece for piece in pieces if piece[0] != piece[1]]


def _port_name(port: PlacedPort, is_open: bool) -> Words:
    """The name of a port inside its box; in an open composite, above the line that continues there."""
    y = port.y - 3.0 if is_open else port.y + 0.35 * PORT
    x, align = (port.x + 6.0, "left") if port.side == "left" else (port.x - 6.0, "right")
    return Words(port.port.name, x, y, PORT, is_soft=not port.is_joined, align=align)


def trace(pieces: Sequence[Piece]) -> tuple[tuple[Line, ...], tuple[Point, ...]]:
    """The lines formed by horizontal and vertical pieces, and the points where three or more meet."""
    on: dict[tuple[int, float], set[float]] = {}  # the corners on each horizontal (1) and vertical (0) line
    for piece in pieces:
        for corner in piece:
            for axis in (0, 1):
                on.setdefault((axis, corner[axis]), set()).add(corner[1 - axis])
    near: dict[Point, dict[Point, None]] = {}
    for one, other in pieces:
        axis = 0 if one[0] == other[0] else 1
        low, high = sorted((one[1 - axis], other[1 - axis]))
        stops = sorted(stop for stop in on[axis, one[axis]] if low <= stop <= high)
        corners = [(one[0], stop) if axis == 0 else (stop, one[1]) for stop in stops]
        for a, b in pairwise(corners):
            near.setdefault(a, {})[b] = None
            near.setdefault(b, {})[a] = None
    lines, done = [], set()
    for start in (corner for corner, others in near.items() if len(others) != 2):
        for following in near[start]:
            if (start, following) in done:
                continue
            line, before, here = [start], start, following
            while len(near[here]) == 2:
                (after,) = (other for other in near[here] if other != before)
                if not (before[0] == here[0] == after[0] or before[1] == here[1] == after[1]):
                    line.append(here)
                before, here = here, after
            done.update({(start, following), (here, before)})
            lines.append((*line, here))
    return tuple(lines), tuple(corner for corner, others in near.items() if len(others) > 2)
