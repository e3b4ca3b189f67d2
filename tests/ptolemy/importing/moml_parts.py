"""MoML in few words, as tests write it."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

from epicycle.ptolemy.importing import Imported, import_moml
from epicycle.runner.execution.engine import Simulation
from epicycle.runner.model.build.load import load_model

HEAD = """<?xml version="1.0" standalone="no"?>
<!DOCTYPE entity PUBLIC "-//UC Berkeley//DTD MoML 1//EN"
    "http://ptolemy.eecs.berkeley.edu/xml/dtd/MoML_1.dtd">
"""
LIB, DE, MODAL = "ptolemy.actor.lib.", "ptolemy.domains.de.lib.", "ptolemy.domains.modal."
COMPOSITE, DIRECTOR = "ptolemy.actor.TypedCompositeActor", "ptolemy.domains.de.kernel.DEDirector"
PARAMETER, TEXT = "ptolemy.data.expr.Parameter", "ptolemy.data.expr.StringParameter"


def prop(name: str, value: object = None, java: str = PARAMETER, inner: str = "") -> str:
    """A property; without a value one that is only there."""
    said = "" if value is None else f" value={quoteattr(str(value))}"
    return f"<property name={quoteattr(name)} class={quoteattr(java)}{said}>{inner}</property>\n"


def entity(name: str, java: str, *inner: str, **parameters: object) -> str:
    """An actor, by its class in the library unless that has dots."""
    full = java if "." in java else f"{LIB}{java}"
    said = "".join(prop(key, value) for key, value in parameters.items())
    return f"<entity name={quoteattr(name)} class={quoteattr(full)}>\n{said}{''.join(inner)}</entity>\n"


def port(name: str, *flags: str, inner: str = "") -> str:
    """A port: ``input``, ``output``, ``multiport``."""
    said = "".join(f'<property name="{flag}"/>' for flag in flags)
    return f'<port name={quoteattr(name)} class="ptolemy.actor.TypedIOPort">{said}{inner}</port>\n'


def wires(*nets: str) -> str:
    """Relations: ``"a.output b.input c.input"``, each with the ports that it joins."""
    made = "".join(
        f'<relation name="r{number}" class="ptolemy.actor.TypedIORelation"/>\n' for number in range(len(nets))
    )
    links = (f'<link port="{each}" relation="r{number}"/>\n' for number, net in enumerate(nets) for each in net.split())
    return made + "".join(links)


def composite(name: str, *inner: str, director: bool = False) -> str:
    """A composite, opaque if it has a director."""
    own = prop("DE Director", java=DIRECTOR) if director else ""
    return entity(name, COMPOSITE, own, *inner)


def model(*inner: str, stop: object = 10, name: str = "m", **parameters: object) -> str:
    """A model with a DE director."""
    director = prop("DE Director", java=DIRECTOR, inner=prop("stopTime", stop))
    return HEAD + entity(name, COMPOSITE, director, *inner, **parameters)


def imported(tmp_path: Path, text: str) -> Imported:
    """What becomes of a text, which has to load."""
    file = tmp_path / "m.xml"
    file.write_text(text, encoding="utf-8")
    return import_moml(file, load_model)


def written(tmp_path: Path, text: str) -> str:
    """The model in YAML, without the lines at its head."""
    lines = imported(tmp_path, text).text.splitlines(keepends=True)
    return "".join(line for line in lines if not line.startswith("#"))


def notes(tmp_path: Path, text: str) -> list[str]:
    """The lines for what has no counterpart."""
    return list(imported(tmp_path, text).notes[:-1])


def run(tmp_path: Path, text: str) -> Simulation:
    """The run of an imported model."""
    file = tmp_path / "m.yaml"
    file.write_text(imported(tmp_path, text).text, encoding="utf-8")
    simulation = Simulation(load_model(file), keep_log=True)
    simulation.run()
    return simulation


def sent(tmp_path: Path, text: str) -> list[tuple[float, int, str, int, Any]]:
    """What is sent, but by checks: time, microstep, port, channel, value."""
    file = tmp_path / "m.yaml"
    file.write_text(imported(tmp_path, text).text, encoding="utf-8")
    model = load_model(file)
    checks = {path for path, actor in model.graph.actors.items() if type(actor).__name__ == "Test"}
    records = Simulation(model, keep_log=True).run().log.records
    return [
        (each.tag.seconds, each.tag.microstep, f"{each.actor}.{each.port}", each.channel or 0, each.value)
        for each in records
        if each.event == "send" and each.actor not in checks
    ]


def recorded(tmp_path: Path, text: str, path: str = "Recorder") -> list[tuple[float, int, Any]]:
    """What a Recorder has heard, with time and microstep."""
    sink = run(tmp_path, text)[path]
    return [(tag.seconds, tag.microstep, token) for tag, token in zip(sink.tags, sink.tokens, strict=True)]
