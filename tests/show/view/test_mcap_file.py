"""MCAP files, read back with the library of these."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import jsonschema
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from epicycle.runner import load_model
from epicycle.runner.model.build.figures import figures_of
from epicycle.runner.model.catalogue.packaged import packaged_models
from epicycle.runner.model.text.problems import Problems
from epicycle.runner.show.space import ellipses
from epicycle.runner.show.view.export import TRAIL
from epicycle.runner.show.view.mcap_file import write_mcap
from epicycle.runner.show.view.recording import STRETCH, Recording, ViewError

from .exported import recorded, results_of
from .test_page import SHORT

CIRCLING = """
model: circling
actors:
  clock: {type: Clock, period: PERIOD}
  body: {type: CircularMotion, start: [5, 0], speed: 2, turn_rate: 0.4}
connections: [clock.output -> body.trigger]
run: {stop: 20 s, record: body.state}
figures:
  way: {type: Trajectories, robots: body.state, goal: [0, 5]}
  again: {type: Trajectories, robots: body.state, goal: [0, 5]}
"""


def circling(folder: Path, period: str) -> Recording:
    path = folder / "circling.yaml"
    path.write_text(CIRCLING.replace("PERIOD", period), encoding="utf-8")
    return recorded(load_model(path))


class Message(NamedTuple):
    time: int
    schema: str
    data: Any


class Mcap:
    """An MCAP file: its messages by topic, its schemas, what it says of the run."""

    def __init__(self, path: Path) -> None:
        self.topics: dict[str, list[Message]] = {}
        self.schemas: dict[str, Any] = {}
        latest, decoders = 0, DecoderFactory()
        with path.open("rb") as file:
            reader = make_reader(file, validate_crcs=True)
            for schema, channel, message in reader.iter_messages(log_time_order=False):
                assert schema is not None
                assert message.log_time == message.publish_time >= latest
                latest = message.log_time
                if schema.name.startswith("epicycle."):
                    assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
                    self.schemas[schema.name] = json.loads(schema.data)
                    data = json.loads(message.data)
                else:
                    assert (schema.encoding, channel.message_encoding) == ("protobuf", "protobuf")
                    decode = decoders.decoder_for("protobuf", schema)
                    assert decode is not None
                    data = decode(message.data)
                self.topics.setdefault(channel.topic, []).append(Message(message.log_time, schema.name, data))
            (self.about,) = (each.metadata for each in reader.iter_metadata() if each.name == "run")

    def __getitem__(self, topic: str) -> list[Message]:
        return self.topics[topic]

    def entities(self, topic: str) -> Iterator[tuple[int, Any]]:
        for time, schema, data in self.topics[topic]:
            assert schema == "foxglove.SceneUpdate"
            (entity,) = data.entities
            yield time, entity


def mcap(recording: Recording, folder: Path) -> Mcap:
    write_mcap(recording, folder / "run.mcap")
    return Mcap(folder / "run.mcap")


def xy(vector: Any) -> tuple[float, float]:
    assert vector.z == 0.0
    return vector.x, vector.y


def test_mcap_has_a_message_for_each_token_firing_and_act(wifi: Recording, tmp_path: Path) -> None:
    file, results = mcap(wifi, tmp_path), results_of(wifi)
    for name, signal in results.signals.items():
        messages = file["/signals/" + name.replace(".", "/")]
        assert [(each.time, each.data["microstep"]) for each in messages] == signal.tags
    state = [each.data["value"]["position"] for each in file["/signals/main/state"]]
    assert state == results["main.state"]["position"].tolist()
    matrix = [each.data["value"]["covariance"] for each in file["/signals/main/estimate"]]
    assert matrix == results["main.estimate"]["covariance"].reshape(-1, 16).tolist()

    columns, _, _ = wifi.kept()
    fired = Counter(list(wifi.places)[actor] for actor in columns["firing_actor"])
    assert {actor: len(file["/firings/" + actor.replace(".", "/")]) for actor in fired} == fired
    assert file["/firings/clock"][7].data == {"microstep": 1, "count": 8}
    assert sum(map(len, (each for topic, each in file.topics.items() if topic.startswith("/firings/")))) == wifi.firings

    drops = file["/aspects/wifi_loss"]
    assert len(drops) == results.aspects["wifi_loss"]["dropped"]
    assert {each.schema for each in drops} == {"foxglove.Log"}
    first = drops[0].data
    assert first.message.startswith('observer[1].peer_measurement: dropped {"robot": "observer[0]", ')
    assert (first.timestamp.ToNanoseconds(), first.Level.Name(first.level), first.name) == (0, "INFO", "wifi_loss")
    assert (file.about["model"], file.about["digest"]) == ("collision_avoidance", results.digest)
    assert (file.about["setting observers"], file.about["metric arrival_time"]) == ("3", "4.8")
    assert "left out" not in file.about


@pytest.mark.slow
@pytest.mark.parametrize("name", packaged_models())
def test_messages_are_as_their_schemas_say(name: str, tmp_path: Path) -> None:
    model = load_model(name)
    recording = Recording(model, figures_of(model, Problems()))
    recording.run(until=SHORT.get(name))
    file = mcap(recording, tmp_path)
    own = {each for each in file.schemas if each.startswith("epicycle.")} - {"epicycle.Firing"}
    assert own == {f"epicycle.{each}" for each, signal in results_of(recording).signals.items() if len(signal)}
    for messages in (each for each in file.topics.values() if each[0].schema in file.schemas):
        check = jsonschema.Draft202012Validator(strict(file.schemas[messages[0].schema])).validate
        for message in messages[:: 1 + len(messages) // 20]:
            check(message.data)


def strict(schema: Any) -> Any:
    """A schema that takes nothing but what it names; it must itself be one that Lichtblick can read."""
    if schema["type"] == "object":
        inner = {name: strict(each) for name, each in schema["properties"].items()}
        return {"type": "object", "properties": inner, "additionalProperties": False}
    if schema["type"] == "array":
        assert schema["items"]["type"] != "array"
        return {"type": "array", "items": strict(schema["items"])}
    assert schema["type"] in ("boolean", "number", "integer", "string")
    return schema


def test_mcap_has_tokens_of_any_kind_and_whole_nanoseconds(varied: Recording, tmp_path: Path) -> None:
    file = mcap(varied, tmp_path)
    messages = file["/signals/it/pose"]
    assert [each.time for each in messages] == [100_000_000_000_000 + ns for ns in (1, 1, 2, 2, 3, 3)]
    assert [each.data["value"] for each in messages[::2]] == [
        {"matrix": [1, 0, 0, 1], "mode": None, "mixed": "1.5", "limit": None, "rest": [], "is_on": True},
        {"matrix": [2, 2, 2, 2], "mode": "slow \ud800", "mixed": "high", "limit": 4, "rest": [], "is_on": False},
        {"matrix": [0, 0, 0, 0], "mode": "fast", "mixed": '[1, "x"]', "limit": None, "rest": [], "is_on": True},
    ]
    kinds = strict(file.schemas["epicycle.it.pose"])["properties"]["value"]["properties"]
    numbers = {"type": "array", "items": {"type": "number"}}
    assert kinds == {
        "matrix": numbers,
        "mode": {"type": "string"},
        "mixed": {"type": "string"},
        "limit": {"type": "number"},
        "rest": numbers,
        "is_on": {"type": "boolean"},
    }
    assert [each.data["value"] for each in file["/signals/it/number"]] == [0.0, 0.25, 0.5]
    whole = {name: file.schemas[f"epicycle.it.{name}"]["properties"] for name in ("number", "count")}
    assert {name: {key: each["type"] for key, each in said.items()} for name, said in whole.items()} == {
        "number": {"microstep": "integer", "value": "number"},
        "count": {"microstep": "integer", "value": "integer"},
    }


def test_scenes_show_what_figures_place_in_space(wifi: Recording, tmp_path: Path) -> None:
    file, results = mcap(wifi, tmp_path), results_of(wifi)
    bodies = list(file.entities("/space/body/main/state"))
    places = [xy(entity.spheres[0].pose.position) for _, entity in bodies]
    assert places == list(map(tuple, results["main.state"]["position"].tolist()))
    assert {entity.texts[0].text for _, entity in bodies} == {"main"}
    frames = [each.data for each in file["/frames/main/state"]]
    assert [xy(each.translation) for each in frames] == places
    assert {(each.parent_frame_id, each.child_frame_id) for each in frames} == {("world", "main")}

    *_, (_, trail) = file.entities("/space/trail/main/state")
    assert [xy(point) for point in trail.lines[0].points] == places

    *_, (_, obstacle) = file.entities("/space/body/obstacle/state")
    assert obstacle.cylinders[0].size.x == 4.0  # a safe distance of 2 m

    expected = ellipses(results["main.estimate"])
    for (_, entity), (x, y, along, across, angle) in zip(
        file.entities("/space/ellipse/main/estimate"), expected.tolist(), strict=True
    ):
        (disc,) = entity.cylinders
        assert xy(disc.pose.position) == (x, y)
        assert (disc.size.x, disc.size.y) == (2 * along, 2 * across)
        turn = disc.pose.orientation
        assert 2 * math.atan2(turn.z, turn.w) == pytest.approx(angle)

    (_, plan), *_ = file.entities("/space/tube/main/plan")
    assert len(plan.lines[0].points) == len(plan.cylinders) == 12
    (_, sight), *_ = file.entities("/space/line/main/measurement")
    assert xy(sight.lines[0].points[0]) == places[0]
    ((time, goal),) = file.entities("/space/goal/goal")
    assert (time, goal.texts[0].text) == (0, "goal")


def test_a_line_of_sight_ends_when_nothing_more_is_seen(tmp_path: Path) -> None:
    recording = recorded(load_model("collision_avoidance", set=["measurement_failure=0.5"]))
    file = mcap(recording, tmp_path)
    seen = [time for time, _ in results_of(recording)["main.measurement"].tags]
    gaps = [(one, other) for one, other in pairwise(seen) if other - one > 160_000_000]
    lines = [(time, len(entity.lines)) for time, entity in file.entities("/space/line/main/measurement")]
    assert [time for time, count in lines if count == 1] == seen
    blank = [time for time, count in lines if count == 0]
    assert blank
    assert blank[: len(gaps)] == [one + 160_000_000 for one, _ in gaps]
    assert blank[-1] <= results_of(recording).end * 1e9


@pytest.mark.slow
def test_a_trail_is_drawn_anew_some_times_and_the_body_draws_the_rest(tmp_path: Path) -> None:
    recording = circling(tmp_path, "0.01")
    file, places = mcap(recording, tmp_path), results_of(recording)["body.state"]["position"].tolist()
    assert len(places) == 2001
    trails = dict(file.entities("/space/trail/body/state"))
    assert TRAIL * 0.9 < len(trails) <= TRAIL + 1
    end: tuple[float, float] | None = None
    for (time, body), place in zip(file.entities("/space/body/body/state"), places, strict=True):
        if time in trails:
            end = tuple(place)
            assert not body.lines
            drawn = [xy(point) for line in trails[time].lines for point in line.points]
            assert drawn[-1:] in ([end], [])
        else:
            (line,) = body.lines
            assert [xy(point) for point in line.points] == [end, tuple(place)]


def test_equal_runs_are_equal_mcap_files(wifi: Recording, tmp_path: Path) -> None:
    write_mcap(wifi, tmp_path / "one")
    write_mcap(recorded(load_model("collision_avoidance", disturb=["wifi_burst"])), tmp_path / "other")
    assert (tmp_path / "one").read_bytes() == (tmp_path / "other").read_bytes()
    assert sorted(each.name for each in tmp_path.iterdir()) == ["one", "other"]


def test_a_thinned_run_says_what_is_left_out(tmp_path: Path) -> None:
    recording = recorded(load_model("mm1"), most=4 * STRETCH)
    file = mcap(recording, tmp_path)
    kept = sum(len(each) for topic, each in file.topics.items() if topic.startswith("/firings/"))
    assert kept <= 4 * STRETCH < recording.firings
    assert file.about["left out"] == f"{recording.firings - kept:,} of {recording.firings:,} firings"


def test_a_run_that_was_not_made_has_no_file(tmp_path: Path) -> None:
    with pytest.raises(ViewError) as caught:
        mcap(Recording(load_model("mm1"), {}), tmp_path)
    assert str(caught.value) == "a file needs a run that has been made: call Recording.run first"


def test_more_channels_than_a_file_has_are_said(
    varied: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("epicycle.runner.show.view.mcap_file.MOST", 3)
    with pytest.raises(ViewError) as caught:
        write_mcap(varied, tmp_path / "run.mcap")
    message = "an MCAP file holds at most 3 channels, and the run has more signals and actors"
    assert str(caught.value) == message
    assert not list(tmp_path.glob("*.mcap"))
