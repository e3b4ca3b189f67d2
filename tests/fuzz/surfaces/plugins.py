"""Plug-ins: files of ``--types`` that declare something odd, and installed packages whose entry points are."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.fuzz.surfaces.case import MODEL, Case, Surface, chosen, spoiled, write

_BASES = ("Actor", "CommunicationAspect", "Aspect", "object", "int", "Actor, Aspect", "Nope", "Clock", "Model", "")
_KINDS = ("float", "int", "str", "bool", "list[float]", "np.ndarray", "dict", "object", "None", "float | None", "Actor",
          "tuple[int, str]", "'float'", "3", "Literal['a', 'b']", "complex", "type", "Any", "bytes")  # fmt: skip
_DEFAULTS = ("1.0", "None", "'a'", "[1, 2]", "float('nan')", "float('inf')", "-1", "object()", "{}", "10**400", "...",
             "lambda: 1", "np.zeros(3)", "b'a'", "1j")  # fmt: skip
_OPTIONS = ("", "unit='m'", "unit='nope'", "min=3, max=1", "doc='</script>'", "shape=(3,)", "shape=(None,)",
    "shape='a'",
            "choices=['a']", "choices=[]", "doc=3", "unit=3", "min='a'", "nope=1")  # fmt: skip
_NAMES = ("x", "output", "input", "fire", "context", "random", "_hidden", "path", "é", "__init__", "wake_at", "class_")
_LINES = (
    "raise ValueError('of the plug-in')", "raise SystemExit(7)", "import nope", "from epicycle.actors import Nope",
    "1 / 0",
    "Thing.fire = 3", "Thing.__name__ = 'a b'", "Thing.__doc__ = 3", "del Thing", "Thing = 3",
    "Thing.__module__ = 'os'",
    "def broken(:", "x = " + "(" * 300 + ")" * 300, "\tx = 1", "__all__ = 3", "class Other(Thing): pass",
)  # fmt: skip
_POINTS = (
    "[epicycle.actors]\nThing = plug:Thing\n", "[epicycle.actors]\nThing = plug:Nope\n", "[epicycle.actors]\n= plug\n",
    "[epicycle.aspects]\nThing = plug:Thing\n", "[epicycle.models]\nm = plug\n",
    "[epicycle.actors]\nClock = plug:Thing\n",
    "[epicycle.actors]\nThing = os:system\n", "[epicycle.actors]\nThing = plug:Thing.a.b\n",
    "[epicycle.figures]\nf = plug:f\n",
)  # fmt: skip


def _source(random: np.random.Generator) -> str:
    lines = ["import numpy as np", "from typing import Any, Literal"]
    lines += ["from epicycle.actors import Actor, Clock, InputPort, OutputPort, Parameter"]
    lines += ["from epicycle.aspects import Aspect, CommunicationAspect", "", ""]
    lines += [
        f"class Thing({chosen(random, _BASES)}):",
        f'    "{chosen(random, ("", "A thing.", "<b>", "a: b" * 99))}"',
    ]
    for _ in range(int(random.integers(4))):
        name, kind = chosen(random, _NAMES), chosen(random, _KINDS)
        declared = chosen(random, ("Parameter", "InputPort", "OutputPort"))
        more = f", {chosen(random, _DEFAULTS)}, {chosen(random, _OPTIONS)}" if declared == "Parameter" else ""
        lines.append(f"    {name} = {declared}({kind}{more})")
    if random.random() < 0.5:
        body = chosen(
            random, ("pass", "self.output.send(1)", "raise KeyError('x')", "return self.nope", "self.wake_at(-1)")
        )
        lines += ["    is_source = True", "    def fire(self):", f"        {body}"]
    if random.random() < 0.4:
        lines.append(str(chosen(random, _LINES)))
    return "\n".join(lines) + "\n"


def _make(random: np.random.Generator, home: Path, folder: Path) -> Case:
    number = int(random.integers(10**9))
    source = _source(random)
    data = source.encode("utf-8", "backslashreplace")
    if random.random() < 0.2:
        data = spoiled(data, random)
    if random.random() < 0.3:
        package = write(
            folder, "plug-1.0.dist-info/METADATA", "Metadata-Version: 2.1\nName: plug\nVersion: 1.0\n"
        ).parent
        points = spoiled(str(chosen(random, _POINTS)).encode(), random)
        (package / "entry_points.txt").write_bytes(points.replace(b"plug", f"plug_{number}".encode()))
        (folder / f"plug_{number}.py").write_bytes(data)
        arguments = chosen(
            random,
            (
                ("list", "actors"),
                ("list", "aspects"),
                ("list", "models"),
                ("describe", "Thing"),
                ("run", home / "m.yaml"),
            ),
        )
        return Case(arguments, path=folder, code=folder)
    file = folder / f"types_{number}.py"
    file.write_bytes(data)
    changed = MODEL.replace("{type: Scale, factor: 2}", "{type: Thing}")
    model = write(folder, "m.yaml", changed)
    commands = (("list", "actors"), ("describe", "Thing"), ("validate", model), ("run", model), ("list", "schema"))
    return Case((*chosen(random, commands), "--types", file), code=folder)


SURFACE = Surface("plug-ins", lambda home: write(home, "m.yaml", MODEL) and None, _make)
