"""Models that are large, deep or extreme on purpose: what a mutation of a small good model does not come to.

A recipe makes a model of two small integers; what it makes is good, or refused with a message, soon and in little
memory, and so is its run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import yaml

from epicycle.actors import InputPort, declared_parameters, declared_ports
from epicycle.runner.model.catalogue.types import Catalogue, CatalogueError

END = """\
  c: {type: Clock, period: 0.1}
  r: {type: Recorder}
connections: [c.output -> r.input]
run: {stop: 1}
"""
EXTREME = [
    0, -1, 1, 10**6, 10**9, 10**18, 10**30, -(10**18), 1e-12, 1e-9, 1e-300, 1e300, -1e300, 4.6e9, float("inf"),
    -float("inf"), float("nan"), "1e308 km", "1 ns", "1e9 s", [], [[]], [1e300] * 3, [0] * 50_000, "x" * 9_000, True,
]  # fmt: skip
SIZES = [0, 1, 2, 11, 39, 101, 400, 1_500]
SEGMENTS = ["*", "**", "s[*]", "g", "s", "s[7]", "output", "input", "factor"]


def deep(one: int, other: int) -> str:
    """Lists in lists in lists, by expressions that go on where others end."""
    each, number = 1 + one % 45, 1 + other % 60
    lines = [f"  a{n}: '${{{'[' * each}{f'a{n - 1}' if n else '1'}{']' * each}}}'" for n in range(number)]
    last = f"a{number - 1}"
    uses = (
        last,
        f"sorted([{last}, {last}])",
        f"{last} == [{last}]",
        f"str({last})",
        f"{last} < {last}",
        f"[{last}] * 9",
    )
    used = uses[(one + other) % len(uses)]
    text = "\n".join(lines)
    return f"model: m\nparameters:\n{text}\nactors:\n  v: {{type: Const, value: '${{{used}}}'}}\n" + END.replace(
        "c.output ->", "'c.output, v.output ->"
    ).replace("r.input]", "r.input']")


def unused(one: int, other: int) -> str:
    """Classes that nothing uses, each with others inside of it or taken over."""
    number, size = SIZES[one % len(SIZES)], SIZES[other % len(SIZES)]
    held = ("type: Clock, period: 1", "type: Base", "type: Const, value: '${range(3000)}'", "type: Merge")[one // 8 % 4]
    base = f"  Base:\n    actors: {{a: {{type: Clock, period: 1, count: {size}}}}}\n"
    if other // 8 % 2:
        base = "  Base:\n    actors:\n" + "".join(f"      a{n}: {{type: Clock, period: 1}}\n" for n in range(1 + size))
        classes = [f"  C{n}: {{extends: Base}}\n" for n in range(number)]
    else:
        classes = [f"  C{n}: {{actors: {{s: {{{held}, count: {1 + size % 40}}}}}}}\n" for n in range(number)]
    return f"model: m\ncomposites:\n{base}{''.join(classes)}actors:\n{END}"


def patterns(one: int, other: int) -> str:
    """Many patterns over many paths."""
    actors, number = 2 * SIZES[one % len(SIZES)], SIZES[other % len(SIZES)]
    made = [".".join(_digits(one * 7 + other + n, SEGMENTS)) for n in range(number)]
    if one % 2:
        made = [f"**.s[{n % (actors + 1)}].{('output', 'input', 'factor')[one // 2 % 3]}" for n in range(number)]
    where = (one // 8 + other // 8) % 4
    quoted = ", ".join(f'"{each}"' for each in made)
    inside = f"  G:\n    inputs: [in]\n    actors: {{s: {{type: Scale, factor: 2, count: {actors}}}}}\n"
    text = f"model: m\ncomposites:\n{inside}    connections: ['in -> s[*].input']\nactors:\n  g: {{type: G}}\n"
    text += END.replace("-> r", "-> g.in, r").replace("[c.", "['c.").replace("input]", "input']")
    if where == 0:
        return text.replace("stop: 1", f"stop: 1, record: [{quoted}]")
    if where == 1:
        return text + f"aspects: {{l: {{type: PacketLoss, probability: 0.5, at: [{quoted}]}}}}\n"
    if where == 2:
        return (
            text
            + "aspects:\n"
            + "".join(
                f'  l{n}: {{type: {("PacketLoss", "ExecutionTime")[n % 2]}, at: "{each}"}}\n'
                for n, each in enumerate(made)
            )
        )
    return text + "metrics:\n" + "".join(f'  m{n}: {{of: "{each}", take: count}}\n' for n, each in enumerate(made))


def multiplied(one: int, other: int) -> str:
    """Tokens that become more and more within a tag, or on their way."""
    stages, times = SIZES[one % 6], EXTREME[other % 9]
    after = ("0 s", "1 ns", "0.3 s")[one // 6 % 3]
    chain = f"  p: {{type: Repeat, times: {times}, count: {1 + stages}}}\n"
    ways = "'c.output -> p[0].input', 'p[..-2].output -> p[1..].input', 'p[-1].output -> r.input'"
    copies = max(1, min(1_000, int(times))) if one % 2 else 1
    stack = [
        f"  d{n}: {{type: Duplicate, probability: 1, copies: {copies}, spacing: {after}, at: r.input}}\n"
        for n in range(stages)
    ]
    aspects = "aspects:\n" + "".join(stack) if stages and other // 9 % 2 else ""
    return (
        f"model: m\nactors:\n{chain if not aspects else ''}"
        + (END.replace("c.output -> r.input", ways) if not aspects else END)
        + aspects
    )


def extreme(one: int, other: int, catalogue: Catalogue) -> str:
    """One actor or aspect, with a value for one of its parameters that nobody would give."""
    names = (*catalogue.actors, *catalogue.aspects)
    name = names[one % len(names)]
    try:
        cls: type = catalogue.actors[name] if name in catalogue.actors else catalogue.aspects[name]
    except CatalogueError:
        return END
    declared = declared_parameters(cls)
    given: dict[str, object] = {key: 1 for key, parameter in declared.items() if parameter.required}
    if declared:
        key = tuple(declared)[one // len(names) % len(declared)]
        given[key] = EXTREME[other % len(EXTREME)]
    if name in catalogue.aspects:
        model: dict[str, object] = {
            "aspects": {"x": {"type": name, **given, "at": ("c", "r.input", "c.output")[other % 3]}}
        }
        extra, wires = {}, []
    else:
        model, extra = {}, {"x": {"type": name, **given}}
        ports = [port for port in declared_ports(cls).values() if isinstance(port, InputPort)]
        wires = [f"c.output -> x.{port.name}" for port in ports]
    return yaml.safe_dump(
        {
            "model": "m",
            "actors": {"c": {"type": "Clock", "period": 0.1}, "r": {"type": "Recorder"}, **extra},
            "connections": ["c.output -> r.input", *wires],
            **model,
            "run": {"stop": 1},
        },
        sort_keys=False,
    )


RECIPES: list[Callable[[int, int], str]] = [deep, unused, patterns, multiplied]


def cooked(kind: int, one: int, other: int, catalogue: Catalogue) -> str:
    """The model of one recipe; every other one is of an extreme parameter, for there are so many of these."""
    return extreme(one, other, catalogue) if kind % 2 else RECIPES[kind // 2 % len(RECIPES)](one, other)


def _digits(number: int, letters: list[str]) -> Iterable[str]:
    """A number written in letters."""
    while True:
        yield letters[number % len(letters)]
        number //= len(letters)
        if not number:
            return
