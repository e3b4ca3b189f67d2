"""Files for other viewers, read back with these viewers' own libraries."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import jsonschema
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from epicycle.actors import Actor, InputPort, OutputPort
from epicycle.runner import load_model
from epicycle.runner.execution.results import Results
from epicycle.runner.model.build.figures import figures_of
from epicycle.runner.model.build.model import Model
from epicycle.runner.model.catalogue.packaged import packaged_models
from epicycle.runner.model.text.problems import Problems
from epicycle.runner.show.space import ellipses
from epicycle.runner.show.view.export import TRAIL
from epicycle.runner.show.view.mcap_file import write_mcap
from epicycle.runner.show.view.recording import STRETCH, Recording, ViewError

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


@dataclass(frozen=True)
class Pose:
    """A token with all that makes viewers stumble."""

    matrix: Any
    mode: str | None
    mixed: Any
    limit: float
    rest: tuple[Any, ...] = ()
    is_on: bool = True


SENT = [
    Pose(np.eye(2), None, 1.5, math.inf),
    Pose(np.full((2, 2), 2.0), "slow \ud800", "high", 4.0, is_on=False),
    Pose(np.zeros((2, 2)), "fast", [1, "x"], math.nan),
]


class Varied(Actor):
    """Sends these poses at its first three firings, each twice."""

    trigger: InputPort[Any] = InputPort(Any)
    pose = OutputPort(Any)
    number = OutputPort(float)

    def initialize(self) -> None:
        self.sent = 0

    def fire(self) -> None:
        for _ in range(2):
            self.pose.send(SENT[self.sent])
        self.number.send(self.sent / 4)
        self.sent += 1


VARIED = """
model: varied
actors:
  clock: {type: Clock, period: 1 ns, offset: 100000.000000001 s}
  it: {type: Varied}
connections: [clock.output -> it.trigger]
run: {stop: 100000.000000003 s, record: ["it.*"]}
"""


def recorded(model: Model, **given: Any) -> Recording:
    recording = Recording(model, figures_of(model, Problems()), **given)
    recording.run()
    return recording


def results_of(recording: Recording) -> Results:
    assert recording.results is not None
    return recording.results


@pytest.fixture(scope="module")
def wifi() -> Recording:
    return recorded(load_model("collision_avoidance", disturb=["wifi_burst"]))


@pytest.fixture
def varied(tmp_path: Path) -> Recording:
    path = tmp_path / "varied.yaml"
    path.write_text(VARIED, encoding="utf-8")
    return recorded(load_model(path, types=[Varied]))


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


# -- MCAP -------------------------------------------------------------------------------------------------------------


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
    model = load_model("mm1")
    for write in (mcap, rerun):
        with pytest.raises(ViewError) as caught:
            write(Recording(model, {}), tmp_path)
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


# -- rerun ------------------------------------------------------------------------------------------------------------


class Rerun:
    """A recording of rerun: its columns by entity, rows in the order of tags."""

    def __init__(self, path: Path) -> None:
        reader = pytest.importorskip("rerun.chunk").RrdReader(str(path))
        self.stores = [(each.kind, each.recording_id) for each in reader.recordings()]
        self.blueprints = len(reader.blueprints())
        self.static: dict[str, dict[str, Any]] = {}
        self.entities: dict[str, dict[str, list[Any]]] = {}
        for chunk in reader.store().stream().to_chunks():
            batch = chunk.to_record_batch()
            names = [name for name in batch.schema.names if not name.startswith("rerun.controls")]
            columns = {name: batch.column(name) for name in names}
            if "time" in columns:
                columns["time"] = columns["time"].cast("int64")
            found = (self.static if chunk.is_static else self.entities).setdefault(chunk.entity_path, {})
            for name, column in columns.items():
                found.setdefault(name, []).extend(column.to_pylist())

    def column(self, entity: str, name: str) -> list[Any]:
        """The values of a component of which there is one at a time."""
        return [each and each[0] for each in self.entities[entity][name]]


def rerun(recording: Recording, folder: Path) -> Rerun:
    pytest.importorskip("rerun")
    from epicycle.runner.show.view.rerun_file import write_rerun

    write_rerun(recording, folder / "run.rrd")
    return Rerun(folder / "run.rrd")


def test_rerun_has_signals_firings_and_acts(wifi: Recording, tmp_path: Path) -> None:
    file, results = rerun(wifi, tmp_path), results_of(wifi)
    assert file.stores == [("recording", results.digest)]
    assert file.blueprints == 1
    state = results["main.state"]
    for place in (0, 1):
        entity = rf"/signals/main/state/position\[{place}\]"
        assert file.entities[entity]["time"] == [tag.time for tag in state.tags]
        assert file.column(entity, "Scalars:scalars") == state["position"][:, place].tolist()
    assert set(file.column("/signals/main/plan/robot", "StateChange:state")) == {"main"}
    counts = [len(each["tag"]) for entity, each in file.entities.items() if entity.startswith("/firings/")]
    assert sum(counts) == wifi.firings
    assert file.column("/firings/clock", "Scalars:scalars")[:3] == [1.0, 2.0, 3.0]
    drops = file.column("/aspects/wifi_loss", "TextLog:text")
    assert len(drops) == results.aspects["wifi_loss"]["dropped"]
    assert drops[0].startswith('observer[1].peer_measurement: dropped {"robot": "observer[0]", ')
    (about,) = file.static["/about"]["TextDocument:text"]
    assert f"| digest | {results.digest} |" in about[0]


def test_rerun_has_a_place_for_each_microstep(wifi: Recording, tmp_path: Path) -> None:
    file = rerun(wifi, tmp_path)
    columns, tags, _ = wifi.kept()
    fired: dict[str, list[Any]] = {}
    for tag, actor in zip(columns["firing_tag"], columns["firing_actor"], strict=True):
        fired.setdefault(list(wifi.places)[actor], []).append(tags[tag])
    placed = {}
    for actor, found in fired.items():
        entity = "/firings/" + actor.replace(".", "/").replace("[", r"\[").replace("]", r"\]")
        assert file.entities[entity]["time"] == [tag.time for tag in found]
        placed |= dict(zip(found, file.entities[entity]["tag"], strict=True))
    assert len(set(placed.values())) == len(placed) > 1000
    assert sorted(placed, key=placed.__getitem__) == sorted(placed)
    # What stands in space at an instant stands there after its last microstep.
    body = file.entities["/space/body/main/state"]
    assert all(place >= 0 for place in body["tag"])
    last = {tag.time: placed[tag] for tag in sorted(placed)}
    assert [place >= last[time] for time, place in zip(body["time"], body["tag"], strict=True)] == [True] * 50


def test_rerun_has_tokens_of_any_kind_and_whole_nanoseconds(varied: Recording, tmp_path: Path) -> None:
    file = rerun(varied, tmp_path)
    mode = file.entities["/signals/it/pose/mode"]
    assert mode["time"] == [100_000_000_000_000 + ns for ns in (1, 1, 2, 2, 3, 3)]
    assert file.column("/signals/it/pose/mode", "StateChange:state")[::2] == [None, "slow ?", "fast"]
    assert file.column("/signals/it/pose/is_on", "StateChange:state")[::2] == ["true", "false", "true"]
    assert file.column(r"/signals/it/pose/matrix\[1\]\[1\]", "Scalars:scalars")[::2] == [1.0, 2.0, 0.0]
    limit = file.column("/signals/it/pose/limit", "Scalars:scalars")[::2]
    assert limit[:2] == [math.inf, 4.0]
    assert math.isnan(limit[2])
    assert file.column("/signals/it/number", "Scalars:scalars") == [0.0, 0.25, 0.5]


def test_rerun_has_what_figures_place_in_space(wifi: Recording, tmp_path: Path) -> None:
    file, results = rerun(wifi, tmp_path), results_of(wifi)
    body = file.entities["/space/body/main/state"]["Points3D:positions"]
    expected = [[*place, 0.0] for place in results["main.state"]["position"].tolist()]
    assert np.array(body)[:, 0] == pytest.approx(np.array(expected), rel=1e-6)
    assert file.static["/space/body/main/state"]["Points3D:labels"] == [["main"]]
    trail = file.entities["/space/trail/main/state"]["LineStrips3D:strips"]
    assert [len(each[0]) if each else 0 for each in trail] == [0, *range(2, 51)]
    disc = file.entities["/space/ellipse/main/estimate"]
    sizes = np.array(disc["Ellipsoids3D:half_sizes"])[:, 0, :2]
    assert sizes == pytest.approx(ellipses(results["main.estimate"])[:, 2:4], rel=1e-6)
    plan = file.entities["/space/tube/main/plan"]["Cylinders3D:radii"]
    assert np.array(plan) == pytest.approx(np.array([[0.2 + 0.4 * step for step in range(12)]] * 50))
    assert file.entities["/space/body/obstacle/state"]["Cylinders3D:radii"] == [[2.0]] * 50
    assert len(file.entities["/space/goal/goal"]["Points3D:positions"]) == 1


def test_equal_runs_are_equal_recordings_of_rerun(wifi: Recording, tmp_path: Path) -> None:
    one = rerun(wifi, tmp_path)
    other = rerun(recorded(load_model("collision_avoidance", disturb=["wifi_burst"])), tmp_path)
    assert one.entities == other.entities
    assert one.static == other.static
    assert one.stores == other.stores
