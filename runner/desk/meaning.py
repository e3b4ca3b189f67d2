"""What stands at a place means: its description, where it is declared, and where it is used."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from epicycle.actors import bounds_text, declared_ports, type_name

from ..model.catalogue.packaged import packaged_models
from ..model.catalogue.reference import as_written, shown
from ..model.text.patterns import in_general
from ..model.text.problems import Position
from ..support.shown import short
from .knowledge import Knowledge, Known, as_parameter, owner_of
from .names import MODEL, Name, Use
from .places import Keys, Place, place_at, scalars, value_of
from .schema import allowed, described, language

_PORT = re.compile(r"(?<![\w.])(?P<actor>[A-Za-z_]\w*)(?:\[[^\]]*\])?\.(?P<port>\w*)\Z")


def definition(knowledge: Knowledge, offset: int) -> list[Position]:
    """Where what stands at a place in the file is declared."""
    if uses := _uses(knowledge, offset):
        return [each.position for each in uses if each.declares]
    for at, path in links(knowledge):
        if knowledge.covers(at, offset):
            return [Position(str(path), 1, 1, 0, "")]
    return []


def links(knowledge: Knowledge) -> Iterator[tuple[Position, Path]]:
    """Where the file names another one, which it includes, extends or runs, and that file's path."""
    root, folder = knowledge.reading.nodes.get(knowledge.file), Path(knowledge.file).parent
    read = {path.resolve() for path, _ in knowledge.reading.files.values()}
    is_study = value_of(root, "study") is not None  # whose model is not read with it
    for key in ("model",) if is_study else ("include", "extends"):
        for each in scalars(value_of(root, key)):
            path = packaged_models().get(each.text, folder / each.text)
            if path.is_file() and (is_study or path.resolve() in read):
                yield each.position, path


def references(knowledge: Knowledge, offset: int) -> list[Position]:
    """Where what stands at a place stands elsewhere, its declaration included."""
    return [each.position for each in _uses(knowledge, offset)]


def _uses(knowledge: Knowledge, offset: int) -> list[Use]:
    use = knowledge.use_at(offset)
    names = use.names if use is not None else ()
    return list({each.position: each for name in names for each in knowledge.names.of(name)}.values())


# -- descriptions -----------------------------------------------------------------------------------------------------


def hover(knowledge: Knowledge, offset: int) -> str:
    """What stands at a place, in Markdown; empty if that is nothing."""
    use = knowledge.use_at(offset)
    names = sorted(use.names, key=str) if use is not None else []
    parts = [_of_name(knowledge, name) for name in names]
    place = place_at(knowledge.text, offset)
    if place is not None and not any(each.kind in ("actor", "port") for each in names):
        parts += _of_port(knowledge, place)
        parts += _of_place(knowledge, place)
    return "\n\n".join(dict.fromkeys(each for each in parts if each))


def _of_name(knowledge: Knowledge, name: Name) -> str:
    names = knowledge.names
    inside = f" of {name.owner}" if name.owner != MODEL else ""
    if name.kind in ("actor", "aspect"):
        types = names.types_of(name.owner, name.name)
        said = [f"**{name.name}**: {name.kind}{inside}, {' or '.join(f'`{each}`' for each in types)}"]
        said += [knowledge.of_type(each, f"{name.kind}s") for each in types]
        if name.kind == "aspect" and (made := knowledge.made(name.owner, "aspects", name.name)) is not None:
            said.append("at " + ", ".join(dict.fromkeys(f"`{in_general(place)}`" for place in made.places)))
        return "\n\n".join(said)
    if name.kind == "port":
        direction = "input" if name.name in names.declared(name.owner, "inputs") else "output"
        return next(_ports(knowledge.own_ports(name.owner, direction), name.name, f"{direction}{inside}"), "")
    if name.kind == "parameter":
        return _of_parameter(knowledge, name)
    if name.kind == "composite":
        ports = ", ".join((*names.declared(name.name, "inputs"), "→", *names.declared(name.name, "outputs")))
        return f"**{name.name}**: composite, {ports}\n\n{knowledge.of_type(name.name, 'actors')}".rstrip()
    model = knowledge.reading.loading.model
    metrics = model.output.metrics if model is not None else []
    takes = next((f": {each.takes}" for each in metrics if each.name == name.name and name.kind == "metric"), "")
    return f"**{name.name}**: {name.kind}{takes}"


def _of_parameter(knowledge: Knowledge, name: Name) -> str:
    model = knowledge.reading.loading.model
    found = knowledge.composite_parameters(name.owner).get(name.name)
    text = f"**{name.name}**: parameter" + (f" of {name.owner}" if name.owner != MODEL else "")
    if name.owner == MODEL and model is not None and name.name in model.parameters:
        found, value = model.declared[name.name], model.parameters[name.name]
        at = found.position
        origin = f"from `{found.source}`" if "value" not in found.given and found.source else f"line {at.line}"
        text += f" = `{short(value)}` ({origin})"
    if found is None:
        return text
    said = as_parameter(found)
    unit = f"in {said.unit}" if said.unit not in ("", "1") else ""
    bounds = bounds_text(said.min, said.above, said.max, "{:g}".format).strip()
    limits = [unit, bounds, f"one of {', '.join(said.choices)}" if said.choices else ""]
    return "\n\n".join(filter(None, (text, ", ".join(filter(None, limits)), said.doc)))


def _of_port(knowledge: Knowledge, place: Place) -> Iterator[str]:
    """A port that an actor has by its type."""
    start = _PORT.search(place.before)
    rest = re.match(r"\w*", place.whole[len(place.before) :])
    if start is None or rest is None:
        return
    for direction in ("input", "output"):
        ports = knowledge.ports_of(owner_of(place.keys)[0], start["actor"], direction)
        yield from _ports(ports, start["port"] + rest[0], f"{direction} of {start['actor']}")


def _ports(ports: Iterable[Known], name: str, what: str) -> Iterator[str]:
    """The ports that have a name, in words."""
    for each in ports:
        if each.text == name:
            yield f"**{name}**: {', '.join(filter(None, (what, each.what)))}: {each.doc}".removesuffix(": ")


def _of_place(knowledge: Knowledge, place: Place) -> Iterator[str]:
    """What the language says of the value at a place, or of a key there, and which value it has."""
    keys: Keys = (*place.keys, place.whole) if place.is_key else place.keys
    schemas = allowed(language(knowledge.reading.types), place.around[0], keys)
    yield described(schemas)
    for each in schemas:
        chosen = zip(each.get("enum", ()), each.get("enumDescriptions", ()), strict=False)
        yield from (f"`{value}`: {words}" for value, words in chosen if value == place.whole)
    owner, inner = owner_of(keys)
    if len(inner) < 3 or inner[0] not in ("actors", "aspects"):
        return
    section, part, key = str(inner[0]), str(inner[1]), inner[2]
    if key == "type":
        for kind in knowledge.names.types_of(owner, part):
            yield f"`{kind}`: {knowledge.of_type(kind, section)}"
            if (cls := knowledge.type_called(kind, section)) is not None and section == "actors":
                for port in declared_ports(cls).values():
                    yield f"- {port.direction} `{port.name}` ({type_name(port.type)}): {port.doc}".rstrip(": ")
    elif section == "actors" and isinstance(key, str):
        made = knowledge.made(owner, section, part)
        if made is not None and hasattr(made, key):
            unit = knowledge.unit_of(owner, inner)
            yield f"value of `{made.path}`: `{shown(as_written(getattr(made, key)))}` {unit}".rstrip()
