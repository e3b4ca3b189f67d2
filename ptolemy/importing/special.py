"""Conversions of actors that a row of the table cannot express."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from epicycle import actors
from epicycle.actors import declared_parameters

from ..generators import LAWS
from .actors import Actor
from .names import Names
from .syntax import ExpressionError, names_of, parse
from .translation import Meaning, named
from .writing import plain

Special = Callable[[Actor], None]


def _ramp(actor: Actor) -> None:
    """A Ramp with a float start, if its step or start may become a number that is not whole."""
    init = actor.get("init", 0)
    ports = [name for name in ("init", "step") if actor.widths.get(name, 0)]
    if type(init) is int and any(actor.kinds.get(name) is not int for name in ports):
        actor.values["init"] = float(init)
    else:
        actor.told.discard("init")


def _set_variable(actor: Actor) -> None:
    """A SetVariable, which starts with the value set in the model."""
    if actor.get("delayed", True) is False:
        actor.values["delayed"] = False
    try:
        value = None if actor.scope.around is None else actor.scope.around(actor.text("variableName"))
    except (KeyError, ExpressionError):
        return
    if value is not None:
        actor.values["value"] = plain(value)


def _chosen_input(actor: Actor) -> None:
    """A ConfigurationSelect, which passes on one of its inputs."""
    is_true = actor.get("selector", False) is True
    actor.part.unwired.add("falseInput" if is_true else "trueInput")


def _fields(direction: str) -> Special:
    """The ports of a RecordAssembler, RecordDisassembler or RecordUpdater are the fields."""

    def convert(actor: Actor) -> None:
        known = Names(actor.row.ports)
        for port in actor.part.entity.ports.values():
            if port.flag(direction) and port.name not in actor.row.ports and actor.widths.get(port.name, 0):
                actor.ports[port.name] = known.of(port.name)
        actor.values["fields"] = [*actor.ports.values()]
        for name, ours in known.renamed().items():
            actor.notes.note(f"{actor.path}.{name} is renamed {ours}")

    return convert


def _expression(actor: Actor) -> None:
    """An Expression, whose inputs are ports added in the model."""
    entity = actor.part.entity
    actor.told.add("expression")
    names = Names(("output", "gives", "hold"), in_expressions=True)
    parameters = [name for name, said in entity.properties.items() if said.kind.endswith("PortParameter")]
    # Inputs with an initial value: linked PortParameters, and ports with a default.
    held = {name: entity.properties[name] for name in parameters if actor.widths.get(name, 0)}
    for port in entity.ports.values():
        if port.flag("input") and port.word("defaultValue"):
            held[port.name] = port.properties["defaultValue"]
    ports = [port.name for port in entity.ports.values() if port.flag("input") and port.name not in parameters]
    actor.ports |= {name: names.of(name) for name in dict.fromkeys([*ports, *held])}
    for name, ours in names.renamed().items():
        actor.notes.note(f"{actor.path}.{name} is renamed {ours}")
    known: dict[str, Meaning] = {name: named(ours, actor.kinds.get(name)) for name, ours in actor.ports.items()}
    known |= {"time": named("time"), "iteration": named("iteration", int)}
    try:
        tree = parse(entity.text("expression") or "")
        used = names_of(tree)
        said = actor.following(actor.scope.meaning(tree, known))
        for name in held.keys() & used:
            actor.held[actor.ports[name]] = plain(actor.scope.value_of(held[name]))
        if "iteration" in used and actor.held:
            raise ExpressionError("'iteration' has no counterpart if inputs hold a value")
    except (ExpressionError, ValueError) as error:
        actor.notes.error(f"{actor.path}: expression: {error}")
        return
    actor.values |= {"iteration": True} if "iteration" in used else {}
    actor.expression(said)


# -- random numbers ---------------------------------------------------------------------------------------------------


def _law(actor: Actor) -> None:
    """The distribution of a random actor, of which ports may change the parameters."""
    said = dict(actor.row.settings["law"])
    found: dict[str, Any] = {"type": said.pop("type")}
    actor.values["type"] = "Random"
    for ours, text in said.items():
        value = actor.value(text)
        fed = [name for name in names_of(parse(text)) if actor.widths.get(name, 0)]
        if fed and fed != [text]:
            actor.notes.error(f"{actor.path}.{fed[0]}: a distribution that changes during the run has no counterpart")
        elif fed:
            actor.values["type"] = "VaryingRandom"
            actor.values.setdefault("varying", []).append(ours)
            actor.ports[text] = ours
            value = actor.held.pop(text, None)
        parameter = declared_parameters(getattr(actors, found["type"]))[ours]
        if value is not None and (parameter.required or parameter.default != value):
            found[ours] = value
    actor.values["distribution"] = found
    _generator(actor)


def java_hash(text: str) -> int:
    """The hash of a text in Java."""
    found = 0
    for character in text:
        found = (31 * found + ord(character)) % 2**32
    return found - 2**32 if found >= 2**31 else found


def _generator(actor: Actor) -> None:
    """The numbers of Java's generators, if the model fixes them by its own seed or the shared one."""
    root = actor.part.root
    own, shared = actor.get("privateSeed"), actor.get("seed")
    for each in root.with_property("seed") if shared is None else ():  # the value set at one holds for all
        if each.row is not None and each.row.type in ("VaryingRandom", "PoissonClock"):
            shared = shared or each.value(each.entity.properties["seed"], actor.notes)
    kind = "DRand" if ".colt." in actor.part.entity.java else "JavaRandom"
    law = actor.values.get("distribution", {}).get("type", "Exponential")  # which a PoissonClock draws
    if (made := actor.text("generatorClass", "DRand")) != "DRand":
        actor.notes.note(f"{actor.path}.generatorClass = {made!r} has no counterpart; the numbers will differ")
    elif law not in LAWS and (own or shared):
        actor.notes.note(f"{actor.path}: the numbers of its {law} distribution will differ")
    elif isinstance(own, int) and not isinstance(own, bool):
        actor.values["generator"] = {"type": kind, "seed": own}
    elif isinstance(shared, int) and shared:
        actor.values["generator"] = {"type": kind, "seed": shared + java_hash(f".{root.entity.name}.{actor.path}")}


# -- checks -----------------------------------------------------------------------------------------------------------


def _test(*, strict: bool) -> Special:
    """A Test or NonStrictTest: expected values, on one channel or on several together."""

    def convert(actor: Actor) -> None:
        actor.told.add("correctValues")
        said, written, why = actor.said("correctValues"), None, "is in training mode and checks nothing"
        if _shared(actor, "trainingMode") is not True:
            try:
                values = [True] if said is None else actor.scope.value_of(said)
                written = plain(_without_nan(values if isinstance(values, list) else [values]))
            except (ExpressionError, ValueError) as error:
                why = f"checks nothing: correctValues: {error}"
        if not isinstance(written, list):
            actor.notes.note(f"{actor.path} {why}")
            actor.values = {"type": "Recorder"}
            actor.told |= actor.row.parameters.keys()
            return
        width = actor.widths.get("input", 1)
        if strict and width == 1:  # an array holds the values of all channels, here of one
            written = [each[0] if type(each) is list and len(each) == 1 else each for each in written]
        elif strict and written and all(type(each) is list for each in written):
            actor.values["together"] = True
        complete = _shared(actor, "requireAllCorrectValues")
        actor.values = {"values": written, **actor.values}
        actor.values |= {"complete": complete} if isinstance(complete, bool) else {}

    return convert


def _without_nan(value: Any) -> Any:
    """Expected values with None for NaN, which any number matches."""
    if isinstance(value, (list, dict)):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        found = {key: _without_nan(each) for key, each in items}
        return found if isinstance(value, dict) else [*found.values()]
    return None if isinstance(value, float) and math.isnan(value) else value


def _shared(actor: Actor, name: str) -> object:
    """A parameter that all actors of a class share: the last one in the file sets it for all."""
    actor.told.add(name)
    for each in reversed(actor.part.root.with_property(name)):
        if each.entity.java == actor.part.entity.java:
            return actor.part.value(each.entity.properties[name], actor.notes)
    return None


SPECIAL: Mapping[str, Special] = {
    "ramp": _ramp,
    "set_variable": _set_variable,
    "chosen_input": _chosen_input,
    "input_fields": _fields("input"),
    "output_fields": _fields("output"),
    "expression": _expression,
    "law": _law,
    "generator": _generator,
    "strict_test": _test(strict=True),
    "non_strict_test": _test(strict=False),
}
