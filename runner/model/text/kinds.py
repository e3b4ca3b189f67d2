"""Kinds of problems: each has a code that stays the same, whatever its messages say.

A problem is of the kind that the pass of loading looks for (``Problems.looking_for``), unless the place that reports it
names another one.  A ``Fault`` in a value names its kind by a word (``OF_FAULTS``).
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of problem: its code, what it is in a few words and in a paragraph, and a model that has it."""

    code: str
    title: str
    doc: str
    example: str


KINDS: dict[str, Kind] = {}


def _kind(code: str, title: str, doc: str, example: str = "") -> Kind:
    return KINDS.setdefault(code, Kind(code, title, " ".join(doc.split()), example.strip("\n")))


# A model without mistakes, of which examples change a line.
_SOUND = {
    "model": "model: example",
    "actors": "actors:\n  clock: {type: Clock, period: 1 s}\n  gain: {type: Scale, factor: 2}",
    "connections": "connections:\n  - clock.output -> gain.input",
    "run": "run: {stop: 10 s}",
}


def _with(**sections: str) -> str:
    """The model with other sections."""
    return "\n".join(each for each in (_SOUND | sections).values() if each)


OTHER = _kind(
    "E0001",
    "anything else",
    """Something is wrong that no other kind covers, such as a call of a Python program that cannot be made.""",
)

# -- the text ---------------------------------------------------------------------------------------------------------

SYNTAX = _kind(
    "E0101",
    "the text is not YAML",
    """The file cannot be parsed, so nothing else in it is checked. Often a bracket or a quote is not closed, or the
    indentation is wrong. Epicycle reads YAML 1.2 without tags that make objects and without merge keys.""",
    _with(connections="connections: [clock.output -> gain.input"),
)
KEY = _kind(
    "E0102",
    "a key that cannot stand there",
    """A key is a text, and stands in a mapping once. Write a number or a truth value as a key in quotes.""",
    _with(run="run: {stop: 10 s, stop: 20 s}"),
)
FILE = _kind(
    "E0103",
    "a file that cannot be used",
    """A file that is named on the command line, under `include` or under `extends` is missing, cannot be read, is of
    another sort, or lies outside the folder of the model.""",
    _with(model="model: example\ninclude: robots.yaml"),
)
SIZE = _kind(
    "E0104",
    "more than a model may have",
    """A limit protects against mistakes such as a million actors. If it is intended, raise it by `--max-actors`.""",
    _with(actors="actors:\n  clock: {type: Clock, period: 1 s}\n  gain: {type: Scale, factor: 2}\n"
          "  many: {type: Clock, period: 1 s, count: 20000}"),
)  # fmt: skip

COMMA = _kind(
    "E0105",
    "a comma that ends a value",
    """Within `{ }` and `[ ]`, YAML ends a value at a comma, even in the middle of a call or a sentence: quote the
    value.""",
    _with(run="run: {stop: 10 s}\nmetrics:\n  high: {of: gain.output, take: share, when: max(value, 2) > 3}"),
)

# -- keys and their values --------------------------------------------------------------------------------------------

UNKNOWN_KEY = _kind(
    "E0201",
    "an unknown key",
    """A mapping of the language has a key that it does not know. The help lists the valid ones; a key that is nearly
    right is read as the one that it means, so that nothing else is reported because of it.""",
    _with(run="run: {stp: 10 s}"),
)
MISSING_KEY = _kind(
    "E0202",
    "a missing key",
    """A mapping lacks a key that it must have, such as the `type` of an actor or the `of` of a metric.""",
    _with(connections="connections:\n  - {from: clock.output}"),
)
FORM = _kind(
    "E0203",
    "a value of the wrong form",
    """Where a list, a mapping, a name, a text, or a truth value belongs, there is something else.""",
    _with(connections="connections: clock.output -> gain.input"),
)
NAME = _kind(
    "E0204",
    "a name that cannot be used",
    """A name has letters, digits and underscores, and no digit first. Names that are used at the same place differ: an
    actor is not called like a port beside it.""",
    _with(
        actors="actors:\n  clock: {type: Clock, period: 1 s}\n  gain: {type: Scale, factor: 2}\n  2nd: {type: Const}"
    ),
)

# -- types and parameters ---------------------------------------------------------------------------------------------

UNKNOWN_TYPE = _kind(
    "E0301",
    "an unknown type",
    """There is no type of actors, aspects, figures or parts with that name, neither installed nor among the composites
    of the model. `epicycle list actors` lists them; `--types FILE.py` adds your own.""",
    _with(actors="actors:\n  clock: {type: Clok, period: 1 s}\n  gain: {type: Scale, factor: 2}"),
)
UNKNOWN_PARAMETER = _kind(
    "E0302",
    "an unknown parameter",
    """A type or a composite has no parameter with that name. `epicycle describe TYPE` lists its parameters.""",
    _with(actors="actors:\n  clock: {type: Clock, perod: 1 s}\n  gain: {type: Scale, factor: 2}"),
)
MISSING_PARAMETER = _kind(
    "E0303",
    "a missing parameter",
    """A parameter without a default has no value.""",
    _with(actors="actors:\n  clock: {type: Clock}\n  gain: {type: Scale, factor: 2}"),
)
VALUE = _kind(
    "E0304",
    "a value that does not fit",
    """A value is of another type than its parameter, out of bounds, or at odds with other values.""",
    _with(actors="actors:\n  clock: {type: Clock, period: -1 s}\n  gain: {type: Scale, factor: 2}"),
)
UNIT = _kind(
    "E0305",
    "a wrong unit",
    """A unit is unknown, or does not measure what the parameter measures. A number without a unit is in the unit of its
    parameter.""",
    _with(actors="actors:\n  clock: {type: Clock, period: 1 m}\n  gain: {type: Scale, factor: 2}"),
)
CHOICE = _kind(
    "E0306",
    "none of the choices",
    """A parameter takes one of a few texts, and this is none of them.""",
    _with(model="model: example\nparameters:\n  mode: {value: fast, choices: [fast, slow]}\n"
               "  other: {value: quick, choices: [fast, slow]}",
               actors="actors:\n  clock: {type: Clock, period: \"${1 if mode == 'fast' else 2}\"}\n"
               "  gain: {type: Scale, factor: \"${1 if other == 'fast' else 2}\"}"),
)  # fmt: skip
EXPRESSION = _kind(
    "E0307",
    "a wrong expression",
    """What stands in `${...}`, in a formula or in a condition cannot be read, or names something that is not there. A
    composite knows only its own parameters.""",
    _with(actors="actors:\n  clock: {type: Clock, period: '${cycle}'}\n  gain: {type: Scale, factor: 2}"),
)
UNUSED = _kind(
    "E0308",
    "a parameter that nothing uses",
    """A model or a composite declares a parameter that none of its values names, usually because one of them is
    misspelled.""",
    _with(model="model: example\nparameters: {cycle: 1 s}"),
)
TAKEN = _kind(
    "E0309",
    "a parameter that cannot be taken over",
    """A part inherits a parameter that it does not have, or that nothing around it has; or a parameter chooses the type
    of an actor and has no choices.""",
    _with(actors="actors:\n  clock: {type: Clock, period: 1 s, inherit: period}\n  gain: {type: Scale, factor: 2}"),
)

# -- connections ------------------------------------------------------------------------------------------------------

UNKNOWN_PORT = _kind(
    "E0401",
    "an end of a connection that is not there",
    """A connection names an actor or a port that does not exist, or an input where an output belongs.""",
    _with(connections="connections:\n  - clock.output -> gain.inptu"),
)
CONNECTION = _kind(
    "E0402",
    "a connection that cannot be made",
    """The two ends do not fit: an index is missing or out of range, both sides select different numbers of ports, or a
    port that takes one connection gets several.""",
    _with(actors="actors:\n  clock: {type: Clock, period: 1 s, count: 2}\n  gain: {type: Scale, factor: 2, count: 3}",
          connections="connections:\n  - clock[*].output -> gain[*].input"),
)  # fmt: skip
PORT_TYPE = _kind(
    "E0403",
    "ports of different types",
    """A port sends what the port at the other end does not take.""",
    _with(actors="actors:\n  clock: {type: Clock, period: 1 s}\n  gain: {type: Scale, factor: 2}\n"
          "  robot: {type: CircularMotion}",
          connections="connections:\n  - clock.output -> robot.trigger\n  - robot.state -> gain.input"),
)  # fmt: skip
UNCONNECTED = _kind(
    "E0404",
    "an input without a connection",
    """An actor needs tokens at a port that nothing is connected to.""",
    _with(connections=""),
)
LOOP = _kind(
    "E0405",
    "a loop without delay",
    """Tokens would run in a circle within one tag, so there is no order in which the actors could fire. Give one of the
    connections a delay.""",
    _with(actors="actors:\n  clock: {type: Clock, period: 1 s}\n  sum: {type: AddSubtract}\n"
          "  gain: {type: Scale, factor: 2}",
          connections="connections:\n  - clock.output -> sum.plus\n  - sum.output -> gain.input\n"
          "  - gain.output -> sum.minus"),
)  # fmt: skip
DIRECTOR = _kind(
    "E0406",
    "a director that cannot be",
    """Directors of one model follow rules that one run cannot follow together, or a composite without a director of its
    own has a priority.""",
    _with(model="model: example\ncomposites:\n  Pair:\n    actors: {clock: {type: Clock, period: 1 s}}",
          actors="actors:\n  clock: {type: Clock, period: 1 s}\n  gain: {type: Scale, factor: 2}\n"
          "  pair: {type: Pair, priority: 1}"),
)  # fmt: skip

# -- composite classes ------------------------------------------------------------------------------------------------

CLASS = _kind(
    "E0501",
    "a class that cannot be",
    """A composite class, or a model that extends another, contradicts its base, contains itself, or is there twice.""",
    _with(model="model: example\ncomposites:\n  Fast: {extends: Slow}"),
)
MODE = _kind(
    "E0502",
    "modes that do not fit",
    """A transition, a refinement or a port of a composite with modes names something that its other parts do not
    have.""",
    _with(model="model: example\ncomposites:\n  Lamp:\n    modes: {off: , on: }\n    actors: {}"),
)

# -- aspects ----------------------------------------------------------------------------------------------------------

NO_PLACE = _kind(
    "E0601",
    "an aspect without a place",
    """A pointcut selects nothing, or an aspect has none.""",
    _with(connections="connections:\n  - clock.output -> gain.input\n"
          "aspects:\n  loss: {type: PacketLoss, probability: 0.1, at: gian.input}"),
)  # fmt: skip
ASPECT = _kind(
    "E0602",
    "an aspect that cannot attach there",
    """An aspect attaches to ports, actors or parameters of another sort, or is at odds with another aspect at the same
    place.""",
    _with(connections="connections:\n  - clock.output -> gain.input\n"
          "aspects:\n  loss: {type: PacketLoss, probability: 0.1, at: clock.output}"),
)  # fmt: skip

# -- what is watched --------------------------------------------------------------------------------------------------

OUTPUT = _kind(
    "E0701",
    "an output that cannot be had",
    """What `run` or a metric names is not there, sends nothing that can be recorded or measured, or depends on
    itself.""",
    _with(run="run: {stop: 10 s, record: gain.outptu}"),
)
MONITOR = _kind(
    "E0702",
    "a property that cannot be judged",
    """The property of a monitor cannot be read, or names ports that are not there.""",
    _with(run="run: {stop: 10 s}\nmonitors:\n  small: always gian.output < 5"),
)
FIGURE = _kind(
    "E0703",
    "a figure that cannot be drawn",
    """A figure shows a signal that the run does not record.""",
    _with(run="run: {stop: 10 s}\nfigures:\n  signal: {type: TimeSeries, signals: gain.output}"),
)

# -- what comes from outside ------------------------------------------------------------------------------------------

OUTSIDE = _kind(
    "E0801",
    "a change that cannot be made",
    """A setting, a disturbance, or another change from the command line or a file names something that the model does
    not have.""",
    "# epicycle validate example.yaml --set gian.factor=3\n" + _with(),
)
OF_STUDY = _kind(
    "E0802",
    "a wrong study",
    """A study varies, measures or asks something that its model does not have.""",
    "study: example\nmodel: mm1\nreplications: 2\nvary: {load: [0.5, 0.5]}",
)
CODE = _kind(
    "E0901",
    "code that failed",
    """The code of a type of your own raised an exception while the model was loaded.""",
)

# -- warnings ---------------------------------------------------------------------------------------------------------

IDLE = _kind(
    "W0401",
    "an actor that never fires",
    """No source leads to the actor, so it waits for ever.""",
    _with(actors="actors:\n  clock: {type: Clock, period: 1 s}\n  gain: {type: Scale, factor: 2}\n"
          "  merge: {type: Merge}\n  late: {type: TimeDelay, delay: 1 s}",
          connections="connections:\n  - clock.output -> gain.input\n  - merge.output -> late.input\n"
          "  - late.output -> merge.input"),
)  # fmt: skip
ODD = _kind(
    "W0501",
    "something odd about a class",
    """A composite has the name of an installed type, has an input that nothing reads, or is too large to be checked
    without an instance.""",
    _with(model="model: example\ncomposites:\n  Clock:\n    outputs: [output]\n"
          "    actors: {clock: {type: PoissonClock, mean_interval: 1 s}}\n    connections: [clock.output -> output]",
          actors="actors:\n  clock: {type: Clock}\n  gain: {type: Scale, factor: 2}"),
)  # fmt: skip

# What a fault calls its kind.
OF_FAULTS = {
    "unit": UNIT,
    "choice": CHOICE,
    "expression": EXPRESSION,
    "type": UNKNOWN_TYPE,
    "parameter": UNKNOWN_PARAMETER,
}
