"""Converts actors to expressions over the tokens of one tag or over blocks of tokens."""

from __future__ import annotations

import re
from itertools import pairwise
from typing import TYPE_CHECKING

from .actors import plain
from .names import Names
from .scope import is_text
from .special import Special
from .syntax import ExpressionError
from .translate import names_of, translated

if TYPE_CHECKING:
    from .actors import Actor
    from .parts import Changing


def expression(actor: Actor) -> None:
    """An Expression, whose inputs are ports added in the model."""
    said = actor.said("expression")
    actor.told.add("expression")
    text = (said.value if said is not None else "") or ""
    names = Names(("output", "gives", "hold"), in_expressions=True)
    held = _held(actor)
    for name in [port.name for port in actor.entity.ports.values() if port.flag("input")] + list(held):
        if not _is_port_parameter(actor, name) or name in held:
            actor.ports[name] = names.of(name)
    for name, ours in names.renamed().items():
        actor.notes.note(f"{actor.path}.{name} is renamed {ours}")
    try:
        tree = actor.scope.tree(text)
        changing, actor.reads = actor.changing(tree)
        held |= {name: _first_value(actor, each) for name, each in actor.reads.items()}
        actor.ports |= {name: name for name in actor.reads}
        known = {**changing, **actor.ports, "time": "time", "iteration": "iteration"}
        ours = translated(tree, known, actor.scope, {*actor.whole, "iteration"}, actor.arrays)
    except ExpressionError as error:
        actor.notes.error(f"{actor.path}: expression: {error}")
        return
    if held:
        named = {name: value for name, value in held.items() if name in names_of(tree) or name in actor.reads}
        actor.values |= {"type": "HoldingExpression", "held": {actor.ports[name]: each for name, each in named.items()}}
        if "iteration" in names_of(tree):
            actor.notes.error(f"{actor.path}: expression: 'iteration' has no counterpart if inputs hold a value")
    elif "iteration" in names_of(tree):
        actor.values["iteration"] = True
    actor.values["expression"] = _with_all(
        ours, [each for port, each in actor.ports.items() if actor.widths.get(port, 0)]
    )


def _is_port_parameter(actor: Actor, name: str) -> bool:
    said = actor.entity.properties.get(name)
    return said is not None and said.java.endswith("PortParameter")


def _held(actor: Actor) -> dict[str, object]:
    """The initial values of inputs that have one: linked PortParameters, and ports with a default."""
    found: dict[str, object] = {}
    said = {name: each for name, each in actor.entity.properties.items() if _is_port_parameter(actor, name)}
    said = {name: each for name, each in said.items() if actor.widths.get(name, 0)}
    for port in actor.entity.ports.values():
        default = port.properties.get("defaultValue")
        if default is not None and (default.value or "").strip() and port.flag("input"):
            said[port.name] = default
    for name, each in said.items():
        try:
            found[name] = plain(actor.scope.value_of(each))
        except (ExpressionError, ValueError) as error:
            actor.notes.error(f"{actor.path}.{name} = {each.value!r}: {error}")
    return found


def _of_variables(actor: Actor, name: str) -> str | None:
    """A parameter in terms of variables to be connected to the actor; None if it does not change."""
    said = actor.said(name)
    try:
        if said is None or is_text(said):
            return None
        tree = actor.scope.tree(said.value or "")
        names, reads = actor.changing(tree)
        actor.reads |= reads
        return translated(tree, names, actor.scope) if reads else None
    except ExpressionError:
        return None


def _first_value(actor: Actor, changing: Changing) -> object:
    """The value of a variable before its first change."""
    scope = actor.scope
    while scope.entity is not changing.owner and scope.around is not None:
        scope = scope.around
    try:
        return plain(scope(changing.name))
    except (KeyError, ValueError):
        return 0


def _with_all(text: str, ports: list[str]) -> str:
    """The expression extended to name all ports, because a name that it does not use would not be a port."""
    left = [each for each in ports if not re.search(rf"(?<!\w){each}(?!\w)", text)]
    return f"[{text}, {', '.join(left)}][0]" if left else text


def formula(template: str, **defaults: object) -> Special:
    """An Expression for a computing actor: ``{name}`` is a parameter, or the port of that name.

    If such a port is linked, it holds its latest token, and the value of the parameter before the first.
    """

    def convert(actor: Actor) -> None:
        said: dict[str, str] = {}
        held: dict[str, object] = {}
        for name in re.findall(r"\{(\w+)\}", template):
            value = actor.get(name, defaults.get(name))
            if actor.widths.get(name, 0):
                said[name] = name
                if value is not None:
                    held[name] = plain(value)
            elif (changing := _of_variables(actor, name)) is not None:
                said[name] = f"({changing})"
                held |= {each: _first_value(actor, variable) for each, variable in actor.reads.items()}
            else:
                said[name] = f"({value!r})" if isinstance(value, (int, float)) and value < 0 else repr(value)
        if held:
            actor.values |= {"type": "HoldingExpression", "held": held}
        actor.values["expression"] = re.sub(r"\{(\w+)\}", lambda match: said[match[1]], template)

    return convert


def array_extract(actor: Actor) -> None:
    """ArrayExtract, with zeros before and after."""
    part = "input[{sourcePosition}:{sourcePosition} + {extractLength}]"
    is_whole = not any(actor.widths.get(name, 0) for name in ("destinationPosition", "outputArrayLength"))
    length = None if actor.widths.get("extractLength", 0) else actor.get("extractLength", 1)
    if not is_whole or actor.get("destinationPosition", 0) != 0 or actor.get("outputArrayLength", 1) != length:
        zero = "[input[0] * 0]"
        part = f"({zero} * {{destinationPosition}} + {part} + {zero} * {{outputArrayLength}})[:{{outputArrayLength}}]"
    positions = {"sourcePosition": 0, "extractLength": 1, "destinationPosition": 0, "outputArrayLength": 1}
    formula(part, **positions)(actor)


def blocks(template: str, number: str = "1", *, items: bool = True, **defaults: object) -> Special:
    """A BlockExpression: ``{name}`` is a parameter, ``number`` the length of a block or the parameter with it."""

    def convert(actor: Actor) -> None:
        found = {name: actor.get(name, value) for name, value in defaults.items()}
        if not all(isinstance(each, int) for each in found.values()):
            actor.notes.error(f"{actor.path}: its parameters are not whole numbers")
            return
        count = found[number] if number in found else int(number)
        actor.values |= {"number": count, "expression": template.format(**found)}
        if items:
            actor.values["items"] = True

    return convert


def up_sample(actor: Actor) -> None:
    """UpSample, whose default phase is the last."""
    factor = actor.get("factor", 2)
    phase = actor.get("phase", factor - 1)
    zero = "[block[0] * 0]"
    actor.values |= {"expression": f"{zero} * {phase} + block + {zero} * {factor - 1 - phase}", "items": True}


def chop(actor: Actor) -> None:
    """Chop: a part of each block, extended by earlier tokens or zeros where needed."""
    read, write = actor.get("numberToRead", 128), actor.get("numberToWrite", 64)
    offset, uses_past = actor.get("offset", 0), actor.get("usePastInputs", True) is not False
    front, part, zero = "", "block", "[block[0] * 0]"
    if offset > 0:
        front = "past + " if uses_past else f"{zero} * {offset} + "
        if uses_past:
            actor.values["past"] = [0] * offset
    elif offset < 0:
        part = f"block[{-offset}:]"
    behind = write - (read + offset)
    text = f"{front}{part}" + (f" + {zero} * {behind}" if behind > 0 else "")
    text = f"({text})[:{write}]" if behind < 0 else text
    actor.values |= {"number": read, "expression": text, "items": True}


def delay_line(actor: Actor) -> None:
    """DelayLine: the latest token first."""
    initial = [plain(each) for each in actor.get("initialValues", [0, 0, 0, 0])]
    actor.values |= {"past": initial[-2::-1], "expression": "block + past[::-1]"}


def sample_delay(actor: Actor) -> None:
    """SampleDelay: the initial outputs are sent one by one, with the first tokens."""
    actor.values |= {"past": [plain(each) for each in actor.get("initialOutputs", [0])], "expression": "past[0]"}


def repeat(actor: Actor) -> None:
    """Repeat, for single tokens or for blocks."""
    if (size := actor.get("blockSize", 1)) == 1:
        return
    if actor.widths.get("numberOfTimes", 0):
        actor.notes.error(f"{actor.path}.blockSize = {size!r} has no counterpart if the number comes from a port")
    times = actor.get("numberOfTimes", 2)
    actor.values = {"type": "BlockExpression", "number": size, "expression": f"block * {times}", "items": True}


def extreme_of_array(function: str) -> Special:
    """ArrayMinimum or ArrayMaximum, which may also send the index: of equal elements, that of the first."""

    def convert(actor: Actor) -> None:
        best = f"{function}(input)"
        if not actor.widths.get("index", 0):
            actor.values["expression"] = best
            return
        place = f"[k for k in range(len(input)) if input[k] == {best}][0]"
        found = f"a -> a on input do output = {best}; index = {place}"
        actor.values = {"type": "StateMachine", "modes": ["a"], "transitions": [found]}

    return convert


def quantizer(actor: Actor) -> None:
    """Quantizer: the nearest level, the lower one of two; without levels, steps from 0."""
    levels = [float(each) for each in actor.get("levels", [-1.0, 1.0]) or ()]
    step = float(actor.get("delta", 1.0))
    if not levels:
        actor.values["expression"] = f"{step!r} * floor(input / {step!r})"
        return
    parts = [f"{low!r} if input <= {(low + high) / 2.0!r} else " for low, high in pairwise(levels)]
    actor.values["expression"] = "".join(parts) + (repr(levels[-1]) if parts else f"input * 0.0 + {levels[-1]!r}")


def decibel(actor: Actor) -> None:
    """DB: of an amplitude or a power, and at least its ``min``."""
    factor = 10.0 if actor.get("inputIsPower", False) is True else 20.0
    least = float(actor.get("min", -100.0))
    actor.values["expression"] = f"max({factor} * log(input, 10), {least!r}) if input > 0 else {least!r}"


def array_sort(actor: Actor) -> None:
    """ArraySort, ascending or descending, with or without duplicates."""
    text = "sorted(input)"
    if actor.get("allowDuplicates", True) is False:
        text = f"[{text}[k] for k in range(len(input)) if k == 0 or {text}[k] != {text}[k - 1]]"
    actor.values["expression"] = text if actor.get("ascending", True) is not False else f"{text}[::-1]"


def math_function(actor: Actor) -> None:
    """MathFunction, whose modulo has two operands."""
    word = actor.text("function", "exp")
    if word == "modulo":
        actor.values = {
            "type": "Expression",
            "expression": "firstOperand - secondOperand * int(firstOperand / secondOperand)",
        }
        actor.ports |= {"firstOperand": "firstOperand", "secondOperand": "secondOperand"}
        return
    actor.ports |= {"firstOperand": "input"}
    actor.values["function"] = word


def rounding(actor: Actor) -> None:
    """Round, where halves go up, and truncation is a separate function."""
    words = {"ceil": "ceil(input)", "floor": "floor(input)", "round": "floor(input + 0.5)", "truncate": "int(input)"}
    word = actor.text("function", "round")
    actor.values["expression"] = words.get(word, words["round"])
