"""What every drawing of a model graph must have."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, pairwise

import networkx as nx

from epicycle.runner.show.graph.layout import Drawing, Line, PlacedBox

Rectangle = tuple[float, float, float, float]  # left, top, right, bottom


def meet(one: Rectangle, other: Rectangle, by: float = 0.01) -> bool:
    """Whether two rectangles have more than an edge in common."""
    return (
        one[0] + by < other[2] and other[0] + by < one[2] and one[1] + by < other[3] and other[1] + by < one[3]
    )  # fmt: skip


def outside(inner: Rectangle, outer: Rectangle) -> bool:
    """Whether a rectangle reaches out of another one."""
    return inner[0] < outer[0] or inner[1] < outer[1] or inner[2] > outer[2] or inner[3] > outer[3]


def area(box: PlacedBox) -> Rectangle:
    return box.x, box.y, box.x + box.width, box.y + box.height


def strokes(lines: tuple[Line, ...]) -> Iterator[Rectangle]:
    """The straight pieces of lines, as rectangles without width."""
    for line in lines:
        for (x, y), (u, v) in pairwise(line):
            yield min(x, u), min(y, v), max(x, u), max(y, v)


def words_of(drawing: Drawing) -> list[tuple[str, Rectangle]]:
    """The places of all texts, badges included."""
    found = []
    for each in drawing.words:
        left = each.x - {"left": 0.0, "center": 0.5, "right": 1.0}[each.align] * each.width
        found.append((each.text, (left, each.y - 0.75 * each.size, left + each.width, each.y + 0.2 * each.size)))
    return found + [(each.text, (each.x, each.y - 6.0, each.x + each.width, each.y + 6.0)) for each in drawing.badges]


def check(drawing: Drawing) -> None:
    """Assert everything that makes a drawing right."""
    boxes = {placed.box.path: placed for placed in drawing.boxes}
    sheet = (0.0, 0.0, drawing.width, drawing.height)
    ports = {port.port.path: port for placed in drawing.boxes for port in placed.ports}
    assert set(boxes) == {box.path for box in drawing.outline.root.walk()}

    for placed in drawing.boxes:
        around = boxes.get(placed.box.path.rpartition(".")[0])
        left, top, right, bottom = area(around) if around else sheet
        assert not outside(area(placed), (left + 4, top + 4, right - 4, bottom - 4))
        for port in placed.ports:  # inputs on the left edge, outputs on the right one
            assert port.x == (placed.x if port.port in placed.box.inputs else placed.x + placed.width)
            assert placed.y < port.y < placed.y + placed.height
        for one, other in combinations([boxes[child.path] for child in placed.box.children], 2):
            assert not meet(area(one), area(other)), (one.box.path, other.box.path)
    for one, other in combinations([boxes[child.path] for child in drawing.outline.root.children], 2):
        assert not meet(area(one), area(other)), (one.box.path, other.box.path)

    # Each connection is drawn, from its port to its port, and nothing is drawn that is no connection.
    scopes = [drawing.outline.root, *(box for box in drawing.outline.root.walk() if box.is_open)]
    links = {(link.source, link.target) for scope in scopes for link in scope.links}
    assert {(wire.source, target) for wire in drawing.wires for target in wire.targets} == links
    for wire in drawing.wires:
        graph: nx.Graph[tuple[float, float]] = nx.Graph()
        for line in wire.lines:
            for (x, y), (u, v) in pairwise(line):
                assert x == u or y == v, "a line that is neither horizontal nor vertical"
                graph.add_edge((x, y), (u, v))
        start = (ports[wire.source].x, ports[wire.source].y)
        ends = {(ports[target].x, ports[target].y) for target in wire.targets}
        assert nx.is_connected(graph)
        assert nx.is_tree(graph)
        assert {point for point, degree in graph.degree if degree == 1} == {start, *ends}
        assert set(wire.heads) == ends

    # Lines keep out of boxes that they do not belong to, and do not lie on each other without a common port.
    for wire in drawing.wires:
        for stroke in strokes(wire.lines):
            for placed in drawing.boxes:
                if placed.level >= wire.level:
                    left, top, right, bottom = area(placed)
                    assert not meet(stroke, (left + 1, top + 1, right - 1, bottom - 1), 0.0), (wire, placed.box.path)
    for one_wire, other_wire in combinations(drawing.wires, 2):
        if {one_wire.source, *one_wire.targets} & {other_wire.source, *other_wire.targets}:
            continue
        for a in strokes(one_wire.lines):
            for b in strokes(other_wire.lines):
                if a[0] == a[2] == b[0] == b[2]:
                    assert min(a[3], b[3]) <= max(a[1], b[1]), (one_wire, other_wire)
                if a[1] == a[3] == b[1] == b[3]:
                    assert min(a[2], b[2]) <= max(a[0], b[0]), (one_wire, other_wire)

    # Text can be read: it lies on no other text, on no edge of a box, and on no line but that of its own badge.
    texts = words_of(drawing)
    for (one_text, one_area), (other_text, other_area) in combinations(texts, 2):
        assert not meet(one_area, other_area), (one_text, other_text)
    for text, place in texts:
        for left, top, right, bottom in map(area, drawing.boxes):
            for edge in ((left, top, left, bottom), (right, top, right, bottom), (left, top, right, top)):
                assert not meet(place, edge, 0.0), text
    for text, place in texts[: len(drawing.words)]:
        for wire in drawing.wires:
            assert not any(meet(place, stroke, 0.0) for stroke in strokes(wire.lines)), (text, wire)
    for badge, (_, place) in zip(drawing.badges, texts[len(drawing.words) :], strict=True):
        for wire in drawing.wires:
            for stroke in strokes(wire.lines):
                assert not meet(place, stroke, 0.0) or stroke[1] == stroke[3] == badge.y, (badge, wire)
