"""Writes an outline as Mermaid text, which GitHub, GitLab and many editors render."""

from __future__ import annotations

import re
from collections.abc import Iterator

from .outlines import FINAL, MODE, START, Box, Link, Outline, Port, label, shared

RESERVED = {"call", "class", "classDef", "click", "default", "direction", "end"}
RESERVED |= {"flowchart", "graph", "href", "linkStyle", "style", "subgraph"}
CLOSED, SHARED = "closed", "shared"
SHAPES = {"": "[{}]", CLOSED: "[[{}]]", SHARED: "{{{{{}}}}}", START: '((" "))', MODE: "({})", FINAL: "((({})))"}


def mermaid(outline: Outline) -> str:
    """A flowchart: composites as subgraphs with their ports, delayed connections dotted, aspects in guillemets.

    A medium or processor that several places share is a hexagon, with dotted lines to these.
    """
    return "\n".join(_Writer(outline).lines()) + "\n"


class _Writer:
    def __init__(self, outline: Outline) -> None:
        self.outline = outline
        self.names: dict[str, str] = {}  # of boxes, and of the ports of open composites, by path
        self.marked: list[str] = []  # where aspects are attached
        self.boxes: dict[str, Box] = {  # by the paths of their ports
            port.path: box for box in outline.root.walk() for port in (*box.inputs, *box.outputs)
        }

    def lines(self) -> Iterator[str]:
        yield "---"
        yield f"title: {_quoted(self.outline.model.name)}"
        yield "---"
        yield "flowchart LR"
        yield from self.inside(self.outline.root, "    ")
        yield from self.media("    ")
        if self.marked:
            yield "    classDef aspect stroke:#D55E00,stroke-width:3px"
            yield f"    class {','.join(self.marked)} aspect"

    def media(self, indent: str) -> Iterator[str]:
        """What several places share, and where these are."""
        groups: dict[tuple[str, ...], dict[str, None]] = {}
        for woven in self.outline.model.aspects:
            if key := shared(woven):
                places = filter(None, map(self.shown, [*woven.ports, *woven.actors]))
                groups.setdefault(key, {}).update(dict.fromkeys(places))
        for (kind, *rest), nodes in groups.items():
            if len(nodes) > 1:
                name = self.name(f"shared {rest[-1]}")
                yield indent + name + SHAPES[SHARED].format(_quoted(f"«{rest[-1]}»\n{kind}"))
                yield f"{indent}{name} -.- {' & '.join(nodes)}"

    def shown(self, path: str) -> str:
        """The node of a port or actor, or of the closed composite around it."""
        while path:
            if path in self.boxes:
                return self.node(path)
            if path in self.names:
                return self.names[path]
            path = path.rpartition(".")[0]
        return ""

    def inside(self, box: Box, indent: str) -> Iterator[str]:
        """The boxes inside a composite, then their connections."""
        for port in (*box.inputs, *box.outputs):
            if box.path:
                yield f"{indent}{self.name(port.path)}([{_quoted(_with_aspects(port))}])"
                self.marked += [self.name(port.path)] if port.aspects else []
        for child in box.children:
            own = " (own director)" if child.has_director else ""
            if child.is_open:
                title = _quoted(f"{child.name}: {child.kind}{own}")
                yield f"{indent}subgraph {self.name(child.path)}[{title}]"
                yield from self.inside(child, indent + "    ")
                yield f"{indent}end"
                continue
            aspects = "".join(f"\n«{name}»" for name in child.aspects)
            title = _quoted(f"{child.name}\n{child.kind}{own}{aspects}".rstrip())
            yield indent + self.name(child.path) + SHAPES[CLOSED if child.is_closed else child.shape].format(title)
            has_aspects = child.aspects or any(port.aspects for port in (*child.inputs, *child.outputs))
            self.marked += [self.name(child.path)] if has_aspects else []
        for link in box.links:
            yield indent + self.link(link)

    def link(self, link: Link) -> str:
        """A connection, labelled with what its ends do not show."""
        ends = (self.end(link.source, "outputs"), self.end(link.target, "inputs"))
        words = ", ".join(part for part in (" to ".join(filter(None, ends)), label(link)) if part)
        arrow = "-->" if link.delay is None else "-.->"
        between = f"{arrow}|{_quoted(words)}|" if words else arrow
        return f"{self.node(link.source)} {between} {self.node(link.target)}"

    def end(self, path: str, side: str) -> str:
        """The label of one end: the name of the port if the box has several, and aspects."""
        box = self.boxes[path]
        ports: list[Port] = [] if box.is_open else getattr(box, side)
        return "".join(_with_aspects(port, named=len(ports) > 1) for port in ports if port.path == path)

    def node(self, port: str) -> str:
        """The node at which a connection ends: a port of an open composite, otherwise the box."""
        return self.name(port if self.boxes[port].is_open else self.boxes[port].path)

    def name(self, path: str) -> str:
        """A unique Mermaid name for a path."""
        if path not in self.names:
            plain = re.sub(r"\W+", "_", path, flags=re.ASCII).strip("_")
            plain = f"{plain}_" if plain in RESERVED else plain
            name, number = plain, 2
            while name in self.names.values():
                name, number = f"{plain}_{number}", number + 1
            self.names[path] = name
        return self.names[path]


def _with_aspects(port: Port, *, named: bool = True) -> str:
    return " ".join([port.name] * named + [f"«{name}»" for name in port.aspects])


def _quoted(words: str) -> str:
    """Words in which nothing is markup but the end of a line."""
    return '"' + words.replace('"', "#quot;").replace("<", "#lt;").replace("\n", "<br/>") + '"'
