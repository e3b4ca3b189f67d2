"""What the words of a row of the table cannot say of an actor."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .actors import Actor

Special = Callable[["Actor"], None]


def finite_stop(actor: Actor) -> None:
    """A stop time, unless it is never."""
    stop = actor.get("stopTime", math.inf)
    if not isinstance(stop, (int, float)) or math.isinf(stop) or stop >= 1e300:
        return
    actor.told.discard("stopTime")


def old_clock(actor: Actor) -> None:
    """The former Clock makes one cycle more than it says."""
    finite_stop(actor)
    count = actor.get("numberOfCycles", -1)
    if isinstance(count, (int, float)) and count > 0:
        actor.values["cycles"] = int(count) + 1


def sequential_clock(actor: Actor) -> None:
    """The clock of former versions, which counts its cycles from its first tick."""
    offsets = actor.get("offsets", [0.0, 1.0])
    actor.told.discard("offsets")
    if offsets and offsets[0]:
        actor.notes.note(
            f"{actor.path}.offsets: the first is {offsets[0]}, from which cycles count there, and here from 0"
        )


def _has_local_time(actor: Actor) -> bool:
    """Whether there may be a time of its own where it is."""
    around, found = actor.scope.around, False
    while around is not None and around.around is not None:
        found = found or any(each.java.endswith("Director") for each in around.entity.properties.values())
        around = around.around
    return found


def global_time(actor: Actor) -> None:
    """The time of the model."""
    if _has_local_time(actor):
        actor.notes.note(f"{actor.path} sends the time of the model, here that of the composite")


def local_time(actor: Actor) -> None:
    """The time where it is, unless it shall be that of the model."""
    if actor.get("useLocalTime", True) is False:
        global_time(actor)


def wall_clock(actor: Actor) -> None:
    """What it sends is the time since the run began, of which no model tells."""
    actor.notes.note(f"{actor.path} sends how long the run has taken, in s: here 0.0")


def depths(actor: Actor) -> None:
    """What it sends names all that Ptolemy's director knows."""
    actor.notes.note(f"{actor.path} sends the depths of all actors and ports there: here an empty text")


def ramp(actor: Actor) -> None:
    """A Ramp of numbers that are not whole, where such may come for its step or its beginning."""
    ports = [name for name in ("init", "step") if actor.widths.get(name, 0)]
    init = actor.get("init", 0)
    actor.told.discard("init")
    if any(name not in actor.whole for name in ports) and type(init) is int:
        actor.told.add("init")
        actor.values["init"] = float(init)


def chosen_input(actor: Actor) -> None:
    """A ConfigurationSelect, of whose inputs one passes."""
    names = ("trueInput", "falseInput")
    chosen, other = names if actor.get("selector", False) is True else names[::-1]
    actor.ports[chosen] = "input"
    actor.unwired.add(other)


def positive(*names: str) -> Special:
    """Parameters that stand for no limit if they are 0 or less."""

    def convert(actor: Actor) -> None:
        for name in names:
            value = actor.get(name, 0)
            if isinstance(value, (int, float)) and value > 0:
                actor.told.discard(name)

    return convert


def single_event(actor: Actor) -> None:
    """One that is not in the future never comes."""
    time = actor.get("time", 0.0)
    if isinstance(time, (int, float)) and time < 0:
        actor.notes.note(f"{actor.path}.time = {time}: it sends nothing, here at the end of the run or after it")
        actor.values["time"] = "1e8 s"
    else:
        actor.told.discard("time")


def text_value(actor: Actor) -> None:
    """The value of a StringConst is a text as it stands."""
    actor.values["value"] = actor.text("value").replace("${", "$${")


_OF_PATTERNS = frozenset("\\^$.|?*+()[]{}")


def plain_pattern(*names: str) -> Special:
    """Patterns that stand for themselves: regular expressions have no counterpart."""

    def convert(actor: Actor) -> None:
        for name in names:
            text = actor.text(name)
            actor.told.discard(name)
            if actor.widths.get(name, 0) and name == "pattern":
                actor.notes.error(f"{actor.path}.{name}: regular expressions that come by a port have no counterpart")
            elif _OF_PATTERNS & set(text):
                actor.notes.error(f"{actor.path}.{name} = {text!r}: regular expressions have no counterpart")

    return convert


def replaced(actor: Actor) -> None:
    """StringReplace of all that is found, or of the first."""
    plain_pattern("pattern", "replacement")(actor)
    actor.told.add("regularExpression")
    actor.values["function"] = "replace" if actor.get("replaceAll", True) is not False else "replace first"


def index_of(actor: Actor) -> None:
    """StringIndexOf from the beginning on."""
    if actor.widths.get("startIndex", 0) or actor.get("startIndex", 0) != 0:
        actor.notes.error(f"{actor.path}.startIndex: a search that begins elsewhere has no counterpart")
    if actor.get("searchForwards", True) is False:
        actor.notes.error(f"{actor.path}.searchForwards = false: has no counterpart")


def record_updater(actor: Actor) -> None:
    """A RecordUpdater, whose further inputs are fields."""
    names = [port.name for port in actor.entity.ports.values() if port.flag("input") and port.name != "input"]
    actor.ports |= {name: name for name in names}
    actor.values |= {"fields": names, "onto": "input"}


def choice(name: str, ours: str, default: str, words: Mapping[str, str]) -> Special:
    """A parameter that is one of some words, in small letters or capitals."""
    known = {word.lower(): each for word, each in words.items()}

    def convert(actor: Actor) -> None:
        word = actor.text(name, default)
        if word.lower() not in known:
            actor.notes.error(f"{actor.path}.{name} = {word!r}: has no counterpart")
        else:
            actor.values[ours] = known[word.lower()]

    return convert


def sequence(actor: Actor) -> None:
    """A Sequence that repeats has nothing to hold."""
    if actor.get("repeat", False) is True:
        actor.told.add("holdLastOutput")
    actor.told.discard("repeat")


def execution_time(actor: Actor) -> None:
    """What it sends is how long the computer took, which no model tells."""
    actor.notes.note(f"{actor.path} sends how long a computation took, in ms: here 0")


def fields(direction: str) -> Special:
    """A RecordAssembler or RecordDisassembler: its ports are the fields."""

    def convert(actor: Actor) -> None:
        names = [
            port.name for port in actor.entity.ports.values() if port.flag(direction) and actor.widths.get(port.name)
        ]
        actor.ports |= {name: name for name in names}
        actor.values["fields"] = names

    return convert


def quantum(actor: Actor) -> None:
    """The quantum of a QuantizedSampler, of which the sign does not count."""
    actor.values["by"] = abs(actor.get("quantum", 1.0))


def limiter(actor: Actor) -> None:
    """Only limits that are finite."""
    for name, ours in (("top", "high"), ("bottom", "low")):
        value = actor.get(name, 1.0 if name == "top" else 0.0)
        if isinstance(value, (int, float)) and not math.isinf(value) and abs(value) < 1.7e308:
            actor.values[ours] = value


def pid(actor: Actor) -> None:
    """PID, whose input is the error: the gains have the other sign."""
    for name, ours, default in (("Kp", "proportional", 1.0), ("Ki", "integral", 0.0), ("Kd", "derivative", 0.0)):
        value = actor.get(name, default)
        actor.values[ours] = -value if value else 0.0
    actor.values["integration"] = "trapezoid"


def no_trigger(*names: str) -> Special:
    """Parameters that make no difference at their default, and have no counterpart otherwise."""

    def convert(actor: Actor) -> None:
        for said in names:
            name, _, default = said.partition("=")
            value = actor.get(name, actor.scope.value(default))
            if value != actor.scope.value(default):
                actor.notes.note(f"{actor.path}.{name} = {value!r}: has no counterpart")

    return convert
