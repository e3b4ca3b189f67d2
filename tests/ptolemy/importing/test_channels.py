"""Channels: publishers and subscribers become connections."""

from __future__ import annotations

from pathlib import Path

import pytest

from epicycle.ptolemy.importing import MomlError
from tests.ptolemy.importing.moml_parts import (
    LIB,
    TEXT,
    composite,
    entity,
    imported,
    model,
    prop,
    recorded,
    wires,
    written,
)


def test_publishers_and_subscribers(tmp_path: Path) -> None:
    actors = entity("Clock", "DiscreteClock") + entity("P", f"{LIB}Publisher", prop("channel", "news", TEXT))
    actors += entity("S", f"{LIB}Subscriber", prop("channel", "news", TEXT)) + entity("Recorder", "Recorder")
    text = model(actors, wires("Clock.output P.input", "S.output Recorder.input"), stop=1)
    assert "connections:\n  - Clock.output -> Recorder.input\n" in written(tmp_path, text)


def test_a_publisher_that_checks(tmp_path: Path) -> None:
    checks = entity("P", f"{LIB}PublisherTest", prop("channel", "$name", TEXT), prop("correctValues", "{1, 1}"))
    actors = entity("Clock", "DiscreteClock") + checks + entity("Recorder", "Recorder")
    actors += entity("S", f"{LIB}Subscriber", prop("channel", "x", TEXT))
    text = model(prop("name", '"x"'), actors, wires("Clock.output P.input", "S.output Recorder.input"), stop=1)
    assert "  P: {type: Test, values: [1, 1], tolerance: 1.0}\n" in written(tmp_path, text)
    assert recorded(tmp_path, text) == [(0.0, 1, 1), (1.0, 1, 1)]


def published(name: str, *said: str) -> str:
    return entity(name, f"{LIB}{name}", prop("channel", "the news", TEXT), *said)


SENDS = composite(
    "Sends", entity("Clock", "DiscreteClock"), published("Publisher"), wires("Clock.output Publisher.input")
)


def hears(*inner: str, director: bool = False) -> str:
    """A model in which what hears is two composites away from what sends."""
    wired = wires("Subscriber.output Recorder.input")
    deep = composite("Deep", published("Subscriber", *inner), entity("Recorder", "Recorder"), wired)
    return model(SENDS, composite("Hears", deep, director=director), stop=1)


def test_a_channel_leads_through_transparent_composites(tmp_path: Path) -> None:
    assert recorded(tmp_path, hears(), "Hears.Deep.Recorder") == [(0.0, 1, 1), (1.0, 1, 1)]


def test_a_channel_ends_at_a_director_unless_it_is_global(tmp_path: Path) -> None:
    with pytest.raises(MomlError) as refused:
        imported(tmp_path, hears(director=True))
    assert str(refused.value) == (
        "m.xml cannot be imported:\n"
        "   - Hears.Deep.Subscriber receives nothing: no Publisher within reach has its channel"
    )
    text = hears(prop("global", "true"), director=True)
    assert recorded(tmp_path, text, "Hears.Deep.Recorder") == [(0.0, 1, 1), (1.0, 1, 1)]


def test_ports_that_publish_and_subscribe(tmp_path: Path) -> None:
    def channel_port(name: str, word: str, flag: str) -> str:
        said = prop("channel", "c", TEXT)
        return f'<port name="{name}" class="ptolemy.actor.{word}Port"><property name="{flag}"/>{said}</port>'

    sends = composite(
        "Sends", channel_port("out", "Publisher", "output"), entity("Clock", "DiscreteClock"), wires("Clock.output out")
    )
    receives = composite(
        "Receives",
        channel_port("in", "Subscriber", "input"),
        entity("Recorder", "Recorder"),
        wires("in Recorder.input"),
    )
    assert recorded(tmp_path, model(sends, receives, stop=1), "Receives.Recorder") == [(0.0, 1, 1), (1.0, 1, 1)]
