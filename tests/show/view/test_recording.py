"""What a page holds of a run: every firing and what caused it, or whole stretches of a run that is too long."""

from __future__ import annotations

import webbrowser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from epicycle.runner import load_model
from epicycle.runner.execution.engine import Firing, Simulation, Tracer
from epicycle.runner.model.build.figures import figures_of
from epicycle.runner.model.build.model import Model
from epicycle.runner.model.text.problems import Problems
from epicycle.runner.show.view.pages import Page
from epicycle.runner.show.view.recording import MISSING, NOTHING, STRETCH, Recording


def recorded(model: Model, until: float | None = None, **given: Any) -> Recording:
    recording = Recording(model, figures_of(model, Problems()), **given)
    recording.run(until=until)
    return recording


def test_a_recorded_run_has_the_bits_of_any_other() -> None:
    model = load_model("mm1")
    recording = recorded(model, 300.0, seed=3)
    results = Simulation(model, seed=3).run(until=300.0)
    assert recording.results is not None
    assert recording.results.digest == results.digest
    assert (recording.firings, recording.records) == (results.firings, results.events)


def test_columns_say_what_a_tracer_is_told() -> None:
    model = load_model("switched_network")
    told: list[Firing] = []
    Simulation(model, tracer=Tracer(model.graph.actors, told.append)).run(until=1.5)
    recording = recorded(model, until=1.5)
    columns, tags, texts = recording.kept()
    places, ports = list(recording.places), list(recording.ports)

    def port(number: int) -> str:
        place, name = ports[number]
        return f"{places[place]}.{name}"

    assert [
        (tags[tag], places[actor]) for tag, actor in zip(columns["firing_tag"], columns["firing_actor"], strict=True)
    ] == [(firing.tag, firing.actor) for firing in told]
    arrivals = [(number, each) for number, firing in enumerate(told) for each in firing.arrivals]
    assert list(columns["arrival_firing"]) == [number for number, _ in arrivals]
    for row, (number, each) in enumerate(arrivals):
        record = columns["arrival_record"][row]
        assert port(columns["arrival_port"][row]) == f"{told[number].actor}.{each.port}"
        assert port(columns["record_port"][record]) == each.source
        assert tags[columns["record_tag"][record]] == each.sent
    asked = [None if tag == NOTHING else tags[tag] for tag in columns["wake_tag"]]
    assert asked == [wake for firing in told for wake in firing.wakes]
    sent = [len(firing.records) for firing in told]
    assert np.bincount([each for each in columns["record_firing"] if each >= 0], minlength=len(told)).tolist() == sent
    assert all(texts)


def test_acts_are_about_the_send_that_they_concern() -> None:
    model = load_model("collision_avoidance", disturb=["wifi_burst"])
    recording = recorded(model)
    columns, tags, texts = recording.kept()
    events = list(recording.events)
    drops = [row for row, event in enumerate(columns["record_event"]) if events[event] == "dropped"]
    assert len(drops) > 100
    for row in drops:
        about = columns["record_about"][row]
        assert events[columns["record_event"][about]] == "send"
        assert texts[columns["record_text"][about]] == texts[columns["record_text"][row]]
        assert tags[columns["record_tag"][about]] <= tags[columns["record_tag"][row]]


DISTURBED = """
model: disturbed
actors:
  clock: {type: Clock, period: 1 s, values: [1.0, 2.0, 3.0]}
  scale: {type: Scale, factor: 2.0}
  sink: {type: Recorder}
connections: [clock.output -> scale.input, scale.output -> sink.input]
aspects:
  noise: {type: Noise, deviation: 0.1, at: scale.output}
  gone: {type: MeasurementFailure, probability: 0.4, at: scale.output}
run: {stop: 100 s, seed: 2}
"""


def test_acts_at_outputs_are_about_the_send_that_follows_if_one_does(tmp_path: Path) -> None:
    path = tmp_path / "disturbed.yaml"
    path.write_text(DISTURBED, encoding="utf-8")
    recording = recorded(load_model(path))
    columns, _, _ = recording.kept()
    events, firings = list(recording.events), columns["record_firing"]
    found: dict[int, dict[str, int]] = {}
    for row, event in enumerate(columns["record_event"]):
        if columns["record_aspect"][row] != NOTHING or columns["record_about"][row] == NOTHING:
            found.setdefault(firings[row], {})[events[event]] = row
    of_scale = [each for each in found.values() if "replaced" in each]
    assert len(of_scale) == 101
    about = columns["record_about"]
    assert [each.get("send", NOTHING) for each in of_scale] == [about[each["replaced"]] for each in of_scale]
    lost = [each for each in of_scale if "failed" in each]
    assert 20 < len(lost) < 60
    assert all("send" not in each and about[each["failed"]] == NOTHING for each in lost)


@pytest.mark.slow
def test_a_long_run_is_thinned_to_stretches_that_are_whole() -> None:
    model = load_model("mm1")
    whole, thinned = recorded(model, 8_000.0), recorded(model, 8_000.0, most=8 * STRETCH)
    columns, _, _ = thinned.kept()
    kept = len(columns["firing_tag"])
    gaps = thinned.gaps()
    assert thinned.firings == whole.firings > 40 * STRETCH
    assert 4 * STRETCH <= kept <= 8 * STRETCH
    assert kept + sum(count for _, count in gaps) == whole.firings
    assert all(at % STRETCH == 0 for at, _ in gaps[:-1])
    # What was kept is numbered anew, and what caused it is either kept or told to be missing.
    of_whole = whole.kept()
    assert (0, 0) not in gaps
    starts = np.cumsum([0, *(STRETCH + count for _, count in gaps)])[: len(gaps)]
    for stretch, start in enumerate(starts[:4]):
        own = columns["firing_actor"][stretch * STRETCH : (stretch + 1) * STRETCH]
        assert own == of_whole.columns["firing_actor"][start : start + STRETCH]
    missing = sum(record == MISSING for record in columns["arrival_record"])
    assert 0 < missing < kept / 20
    senders = [columns["record_firing"][record] for record in columns["arrival_record"] if record >= 0]
    takers = [
        firing
        for firing, record in zip(columns["arrival_firing"], columns["arrival_record"], strict=True)
        if record >= 0
    ]
    assert all(sender <= taker for sender, taker in zip(senders, takers, strict=True))


def test_signals_that_figures_show_in_space_are_recorded_for_the_page_alone() -> None:
    model = load_model("collision_avoidance")
    before = list(model.output.recorded)
    recording = recorded(model)
    assert recording.results is not None
    assert {"main.plan", "observer[2].measurement"} <= recording.results.signals.keys()
    assert model.output.recorded == before
    assert "main.plan" not in before


def test_a_page_of_a_model_with_a_long_name_opens(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened = list[str]()
    monkeypatch.setattr(webbrowser, "open", opened.append)
    text = f"model: {'m' * 300}\nactors: {{clock: {{type: Clock, period: 1 s}}}}\nrun: {{stop: 1 s}}\n"
    (tmp_path / "long.yaml").write_text(text)
    path = Page([recorded(load_model(tmp_path / "long.yaml"))]).open()
    assert opened == [path.as_uri()]
    assert path.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
