"""The model graph as a page draws it: every composite is open, so that each can be closed and opened there."""

from __future__ import annotations

from typing import Any

from ...model.build.model import Model
from ..graph import MOST_BOXES, Drawing, draw, outline

FEW = 8  # instances of an array that are drawn one by one
_latest: dict[str, Drawing] = {}  # by the outline in words; what it consists of is used again while it is here


def drawn(model: Model) -> dict[str, Any]:
    """Boxes with their ports, wires as trees of lines, and badges, all with positions in points."""
    drawing, note = _drawing(model)
    return {
        "note": note,
        "width": round(drawing.width, 1),
        "height": round(drawing.height, 1),
        "boxes": [
            {
                "path": placed.box.path,
                "name": placed.box.name,
                "kind": placed.box.kind,
                "doc": _doc(model, placed.box.path),
                "at": _rounded(placed.x, placed.y, placed.width, placed.height),
                "level": placed.level,
                "composite": placed.box.is_composite,
                "director": placed.box.has_director,
                "count": placed.box.count,
                "members": placed.box.members,
                "ports": [
                    [each.port.path, each.port.name, each.side, *_rounded(each.x, each.y), each.port.is_multi]
                    for each in placed.ports
                ],
            }
            for placed in drawing.boxes
        ],
        "wires": [
            {
                "source": wire.source,
                "targets": wire.targets,
                "heads": [_rounded(*head) for head in wire.heads],
                "lines": [[value for point in line for value in _rounded(*point)] for line in wire.lines],
                "level": wire.level,
            }
            for wire in drawing.wires
        ],
        "badges": [
            [badge.text, badge.aspect, *_rounded(badge.x, badge.y, badge.width), badge.place]
            for badge in drawing.badges
        ],
    }


def _drawing(model: Model) -> tuple[Drawing, str]:
    """The drawing that a page has room for, and what it leaves out: identical instances first, then what is inside, at
    last all but one of a type."""
    everything = len(model.graph.actors) + len(model.graph.composites)
    found = outline(model, most=MOST_BOXES, few=FEW, limit=MOST_BOXES)
    note, many = "", f"{everything:,} boxes are too many to draw"
    if found.size > MOST_BOXES:
        found.root.children, found.root.links, note = [], [], many
    elif any(box.members for box in found.root.children):
        note = f"{many}: what is of one type, with names that are alike, is one box"
    elif found.depth < found.levels:
        note = f"{many}: composites are drawn closed"
    key = repr(found.root)
    if key not in _latest:
        drawing = draw(found)
        _latest.clear()
        _latest[key] = drawing
    return _latest[key], note


def _rounded(*values: float) -> list[float]:
    return [round(value, 1) for value in values]


def _doc(model: Model, path: str) -> str:
    actor = model.graph.actors.get(path)
    return "" if actor is None else (type(actor).__doc__ or "").strip().partition("\n")[0]
