"""Conversions of actors that a row of the table cannot express."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .actors import Actor

Special = Callable[["Actor"], None]


def finite_stop(actor: Actor) -> None:
    """A stop time, if it is finite."""
    stop = actor.get("stopTime", math.inf)
    if not isinstance(stop, (int, float)) or math.isinf(stop) or stop >= 1e300:
        return
    actor.told.discard("stopTime")


def old_clock(actor: Actor) -> None:
    """The former Clock makes one cycle more than it states."""
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
            f"{actor.path}.offsets: in Ptolemy, cycles count from the first offset, {offsets[0]}; here, from 0"
        )


def _has_local_time(actor: Actor) -> bool:
    """Whether the time where it is may differ from the time of the model."""
    around, found = actor.scope.around, False
    while around is not None and around.around is not None:
        found = found or any(each.java.endswith("Director") for each in around.entity.properties.values())
        around = around.around
    return found


def global_time(actor: Actor) -> None:
    """The time of the model."""
    if _has_local_time(actor):
        actor.notes.note(f"{actor.path}: in Ptolemy, it sends the time of the model; here, that of its composite")


def local_time(actor: Actor) -> None:
    """The local time, unless it is set to send that of the model."""
    if actor.get("useLocalTime", True) is False:
        global_time(actor)


def wall_clock(actor: Actor) -> None:
    """It sends the real time since the run began, which a model cannot know."""
    actor.notes.note(f"{actor.path}: in Ptolemy, it sends the real time since the start of the run, in s; here, 0.0")


def depths(actor: Actor) -> None:
    """It sends a table of everything that Ptolemy's director has scheduled."""
    actor.notes.note(f"{actor.path}: in Ptolemy, it sends the depths of all actors and ports; here, an empty text")


def ramp(actor: Actor) -> None:
    """A Ramp with a float start, if its step or start may become a number that is not whole."""
    ports = [name for name in ("init", "step") if actor.widths.get(name, 0)]
    init = actor.get("init", 0)
    actor.told.discard("init")
    if any(name not in actor.whole for name in ports) and type(init) is int:
        actor.told.add("init")
        actor.values["init"] = float(init)


def chosen_input(actor: Actor) -> None:
    """A ConfigurationSelect, which passes on one of its inputs."""
    names = ("trueInput", "falseInput")
    chosen, other = names if actor.get("selector", False) is True else names[::-1]
    actor.ports[chosen] = "input"
    actor.unwired.add(other)


def positive(*names: str) -> Special:
    """Parameters that mean no limit if they are 0 or less."""

    def convert(actor: Actor) -> None:
        for name in names:
            value = actor.get(name, 0)
            if isinstance(value, (int, float)) and value > 0:
                actor.told.discard(name)

    return convert


def single_event(actor: Actor) -> None:
    """An event in the past never comes."""
    time = actor.get("time", 0.0)
    if isinstance(time, (int, float)) and time < 0:
        actor.notes.note(f"{actor.path}.time = {time}: in Ptolemy, it sends nothing; here, it sends at 1e8 s")
        actor.values["time"] = "1e8 s"
    else:
        actor.told.discard("time")


def text_value(actor: Actor) -> None:
    """The value of a StringConst is a text, used as written."""
    actor.values["value"] = actor.text("value").replace("${", "$${")


_OF_PATTERNS = frozenset("\\^$.|?*+()[]{}")


def plain_pattern(*names: str) -> Special:
    """Patterns that match themselves: regular expressions have no counterpart."""

    def convert(actor: Actor) -> None:
        for name in names:
            text = actor.text(name)
            actor.told.discard(name)
            if actor.widths.get(name, 0) and name == "pattern":
                actor.notes.error(f"{actor.path}.{name}: regular expressions from a port have no counterpart")
            elif _OF_PATTERNS & set(text):
                actor.notes.error(f"{actor.path}.{name} = {text!r}: regular expressions have no counterpart")

    return convert


def replaced(actor: Actor) -> None:
    """StringReplace for all matches, or for the first."""
    plain_pattern("pattern", "replacement")(actor)
    actor.told.add("regularExpression")
    actor.values["function"] = "replace" if actor.get("replaceAll", True) is not False else "replace first"


def index_of(actor: Actor) -> None:
    """StringIndexOf, searching from the start."""
    if actor.widths.get("startIndex", 0) or actor.get("startIndex", 0) != 0:
        actor.notes.error(f"{actor.path}.startIndex: a search that does not start at 0 has no counterpart")
    if actor.get("searchForwards", True) is False:
        actor.notes.error(f"{actor.path}.searchForwards = false has no counterpart")


def record_updater(actor: Actor) -> None:
    """A RecordUpdater, whose other inputs are fields."""
    names = [port.name for port in actor.entity.ports.values() if port.flag("input") and port.name != "input"]
    actor.ports |= {name: name for name in names}
    actor.values |= {"fields": names, "onto": "input"}


def choice(name: str, ours: str, default: str, words: Mapping[str, str]) -> Special:
    """A parameter with a choice of words, in lower or upper case."""
    known = {word.lower(): each for word, each in words.items()}

    def convert(actor: Actor) -> None:
        word = actor.text(name, default)
        if word.lower() not in known:
            actor.notes.error(f"{actor.path}.{name} = {word!r} has no counterpart")
        else:
            actor.values[ours] = known[word.lower()]

    return convert


def sequence(actor: Actor) -> None:
    """A Sequence that repeats never holds its last value."""
    if actor.get("repeat", False) is True:
        actor.told.add("holdLastOutput")
    actor.told.discard("repeat")


def execution_time(actor: Actor) -> None:
    """It sends the real time that a computation took, which a model cannot know."""
    actor.notes.note(f"{actor.path}: in Ptolemy, it sends the real time of a computation, in ms; here, 0")


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
    """The quantum of a QuantizedSampler, whose sign does not matter."""
    actor.values["by"] = abs(actor.get("quantum", 1.0))


def limiter(actor: Actor) -> None:
    """Keep only finite limits."""
    for name, ours in (("top", "high"), ("bottom", "low")):
        value = actor.get(name, 1.0 if name == "top" else 0.0)
        if isinstance(value, (int, float)) and not math.isinf(value) and abs(value) < 1.7e308:
            actor.values[ours] = value


def pid(actor: Actor) -> None:
    """PID, whose input is the error: the gains change their sign."""
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
                actor.notes.note(f"{actor.path}.{name} = {value!r} has no counterpart")

    return convert
