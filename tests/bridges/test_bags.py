"""Recordings of ROS 2: sources of models, under disturbances, and a program in lockstep with them."""

from __future__ import annotations

import resource
import subprocess
import sys
import time
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rosbags")
reading = pytest.importorskip("mcap.reader")

import epicycle  # noqa: E402
from epicycle.bridges import Bag, bag, bags, lockstep  # noqa: E402
from epicycle.runner import ActorError, Model, Simulation  # noqa: E402
from epicycle.runner.recorded import RecordingError  # noqa: E402
from tests.bridges.made_bags import START, made  # noqa: E402


class Tracker:
    """Integrates the speed, and believes the position when there is one; as somebody would have written it."""

    def __init__(self) -> None:
        self.x = 0.0
        self.latest: float | None = None
        self.heard: list[str] = []

    def on_message(self, topic: str, message: Any) -> dict[str, float] | None:
        self.heard.append(topic)
        if topic == "/robot/numbers":
            return None
        stamp = message.header.stamp.sec + message.header.stamp.nanosec * 1e-9
        if topic == "/robot/gps":
            self.x += 0.5 * (message.point.x - self.x)
        else:
            if self.latest is not None:
                self.x += message.twist.linear.x * (stamp - self.latest)
            self.latest = stamp
        return {"x": self.x, "error": abs(self.x - (stamp - START * 1e-9))}


OUTPUTS = {"x": "number", "error": "number"}


@pytest.fixture(params=["mcap", "sqlite3", "file"])
def walk(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    kind = request.param
    path = made(tmp_path / "walk", "mcap" if kind == "file" else kind)
    return path / "walk.mcap" if kind == "file" else path


def test_messages_are_sources_with_stamps_and_headers(walk: Path) -> None:
    model = Model("replay")
    source = model.add(Bag("bag", file=walk))
    model.record(*source.outputs.values())
    results = Simulation(model).run()
    speed, place, numbers = (results[f"bag.robot_{name}"] for name in ("twist", "gps", "numbers"))
    assert len(speed) == 50
    assert list(place.times) == [0.5 * number for number in range(10)]
    assert place.values[3].header.frame_id == "map"
    assert place.values[3].header.stamp == {"sec": 1_700_000_001, "nanosec": 500_000_000}
    assert place.values[3].point.x == 1.5
    assert numbers.values[0].data.tolist() == [1.0, 2.0]
    assert Simulation(model).run().digest == results.digest


def test_a_model_in_a_file_names_a_bag_in_its_folder(walk: Path) -> None:
    file = walk.parent / "model.yaml"
    name = f"{walk.name}/metadata.yaml" if walk.is_dir() else walk.name
    file.write_text(
        f"model: m\nactors:\n  bag: {{type: Bag, file: {name}, topics: /robot/gps}}\nrun: {{record: bag.robot_gps}}\n"
    )
    assert len(epicycle.run(file)["bag.robot_gps"]) == 10


def test_a_program_hears_messages_in_lockstep(walk: Path) -> None:
    results = epicycle.run(lockstep(walk, Tracker, outputs=OUTPUTS))
    assert results["node.error"].values.max() < 1e-6
    again = epicycle.run(lockstep(walk, Tracker(), outputs=OUTPUTS))
    assert again.digest == results.digest


def test_a_function_is_a_program_too(walk: Path) -> None:
    model = lockstep(walk, lambda topic, message: message.point.x, outputs=["x"], topics=["/robot/gps"])
    assert list(epicycle.run(model)["node.x"].values) == [number * 0.5 for number in range(10)]


def test_explain_finds_the_smallest_set_of_lost_messages(walk: Path, tmp_path: Path) -> None:
    lost = tmp_path / "lost.yaml"
    lost.write_text("disturbance: lost\naspects: {lost: {type: PacketLoss, probability: 0.4, at: nowhere}}\n")
    model = lockstep(walk, Tracker, outputs=OUTPUTS, disturb=lost, at="/robot/twist")
    model.monitor("close", "always node.error <= 0.08")  # a position comes when two speeds in a row are missing
    found = epicycle.explain(model, seed=1)
    assert len(found.effects) == 2
    assert found.sentence.startswith("2 faults of ")
    assert "lost dropped a token of bag.robot_twist at node.robot_twist at " in found.sentence


def test_topics_that_are_not_there_are_named(walk: Path) -> None:
    with pytest.raises(RecordingError) as caught:
        lockstep(walk, Tracker, outputs=OUTPUTS, disturb="wifi_burst", at="/robot/gsp")
    assert str(caught.value) == (
        "'/robot/gsp' matches no topic, did you mean '/robot/gps'?; topics: /robot/twist, /robot/gps, /robot/numbers"
    )
    with pytest.raises(epicycle.EpicycleError) as other:
        lockstep(walk, Tracker, outputs=OUTPUTS, topics=["/robot/gsp"])
    assert str(other.value) == (
        f"topics: {walk.name} has no topic '/robot/gsp', did you mean '/robot/gps'?; topics: /robot/twist, "
        "/robot/gps, /robot/numbers"
    )


def test_what_a_program_says_must_be_its_outputs(walk: Path) -> None:
    for said, reason in (
        (3.0, "returns 3.0, not a mapping of outputs to values; outputs: x, error"),
        ({"eror": 3.0}, "returns a value for 'eror', which is no output, did you mean 'error'?; outputs: x, error"),
    ):
        with pytest.raises(ActorError) as caught:
            epicycle.run(lockstep(walk, lambda topic, message, said=said: said, outputs=OUTPUTS))
        line = str(caught.value).splitlines()[0]
        assert line == f"node failed in fire() at (0 s, 1): on_message('/robot/twist', ...) {reason}"
    with pytest.raises(ActorError) as caught:
        epicycle.run(lockstep(walk, lambda topic, message: message.point.x, outputs=["x"]))
    assert str(caught.value).splitlines()[0] == (
        "node failed in fire() at (0 s, 1): AttributeError: the message has no field 'point'; fields: header, twist"
    )


def test_what_is_no_recording_is_reported(tmp_path: Path) -> None:
    broken = tmp_path / "broken.mcap"
    broken.write_bytes(b"\x89MCAP0\r\n" + b"x" * 50)
    for path, reason in (
        (tmp_path / "none.mcap", "cannot be read: there is no such file"),
        (tmp_path / "a.txt", "is not a recording of ROS 2: a folder with metadata.yaml, or a file *.mcap"),
    ):
        with pytest.raises(RecordingError) as caught:
            bag(path)
        assert str(caught.value) == f"{path} {reason}"
    for path in (broken, tmp_path):
        with pytest.raises(RecordingError) as caught:
            bag(path)
        assert str(caught.value).startswith(f"{path} is not a recording of ROS 2: ")


def test_damaged_content_is_named(walk: Path) -> None:
    file = bag(walk)
    file.topics["/robot/numbers"] = "geometry_msgs/msg/TwistStamped"
    with pytest.raises(RecordingError) as caught:
        list(file.messages(["/robot/numbers"]))
    assert str(caught.value).startswith(
        f"{walk} is not a recording of ROS 2: a message of /robot/numbers at {START + 4_900_000_001} ns is not a "
        "geometry_msgs/msg/TwistStamped: "
    )


def test_stamps_that_are_not_in_order_are_reported(tmp_path: Path) -> None:
    from mcap.writer import Writer

    path = tmp_path / "mixed.mcap"
    with path.open("wb") as file:
        writer = Writer(file, use_chunking=False)
        writer.start(profile="ros2")
        schema = writer.register_schema("std_msgs/msg/Float64", "ros2msg", b"float64 data\n")
        channel = writer.register_channel("/x", "cdr", schema)
        for moment in (5, 3):
            writer.add_message(channel, moment, b"\x00\x01\x00\x00" + bytes(8), moment)
        writer.finish()
    with pytest.raises(ActorError) as caught:
        epicycle.run(lockstep(path, lambda topic, message: message.data, outputs=["y"]))
    assert str(caught.value).splitlines()[0] == (
        f"bag failed in fire() at (0 s, 1): {path} is not a recording of ROS 2: Unindexed MCAP messages are not in "
        "timestamp order. Use an indexed file, after a message of /x at 5 ns"
    )
    with pytest.raises(epicycle.EpicycleError) as refused:
        lockstep(path, lambda topic, message: message.data, outputs=["x"])
    assert str(refused.value) == "output 'x' has the name of the topic /x: choose another one"


def test_without_the_package_the_message_says_what_to_install(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text("model: m\nactors: {bag: {type: Bag, file: a.mcap}}\n")
    program = (
        "import sys; sys.modules['rosbags'] = None\nimport epicycle\n"
        "try:\n    epicycle.load('m.yaml')\nexcept epicycle.EpicycleError as error:\n    print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=tmp_path)
    needs = "Bag needs the package rosbags, which is not installed: pip install 'epicycle[ros]'"
    assert done.stdout.splitlines()[0] == (
        "m.yaml:2:22: error: bag: actor 'Bag' of the package 'epicycle' cannot be loaded: EpicycleError: " + needs
    )


@pytest.mark.parametrize("kind", ["mcap", "sqlite3"])
def test_a_folder_passes_a_disturbance(kind: str, tmp_path: Path) -> None:
    source, out = made(tmp_path / "walk", kind), tmp_path / "out"
    for _ in range(2):  # the second one replaces the first
        done = epicycle.disturb(source, "wifi_burst", out, at="/robot/*", seed=3)
    assert "51 messages" not in repr(done)
    before, after = list(bag(source).raw()), list(bag(out).raw())
    assert 0 < len(after) < len(before)
    assert bag(out).topics == bag(source).topics
    assert {data for _, _, data in after} <= {data for _, _, data in before}
    assert [time for time, *_ in after] == sorted(time for time, *_ in after)
    assert sorted(path.suffix for path in out.iterdir()) == [".db3" if kind == "sqlite3" else ".mcap", ".yaml"]
    if kind == "mcap":
        with (out / "out.mcap").open("rb") as file:
            assert sum(1 for _ in reading.make_reader(file).iter_messages()) == len(after)


@pytest.mark.parametrize("kind", ["mcap", "sqlite3", "file"])
def test_aspects_alter_fields_of_a_recording(kind: str, tmp_path: Path) -> None:
    made(tmp_path / "walk", "mcap" if kind == "file" else kind)
    ending = "walk.mcap" if kind == "file" else ""
    source, out = tmp_path / "walk" / ending, tmp_path / f"out{Path(ending).suffix}"
    bias = tmp_path / "bias.yaml"
    bias.write_text("disturbance: bias\naspects: {bias: {type: Bias, by: 0.5, fields: twist.linear.x, at: nowhere}}\n")
    epicycle.disturb(source, bias, out, at="/robot/twist", seed=1)
    before, after = list(bag(source).messages()), list(bag(out).messages())
    assert [each[:2] for each in after] == [each[:2] for each in before]
    for (_, topic, old), (_, _, new) in zip(before, after, strict=True):
        if topic == "/robot/twist":
            assert (old.twist.linear.x, new.twist.linear.x) == (1.0, 1.5)
            assert new.header == old.header
            new.twist.linear["x"] = 1.0
        assert repr(new) == repr(old)
    untouched = [[data for _, topic, data in bag(path).raw() if topic != "/robot/twist"] for path in (source, out)]
    assert untouched[0] == untouched[1]


def test_all_numbers_but_stamps_are_altered(tmp_path: Path) -> None:
    source, bias = made(tmp_path / "walk"), tmp_path / "bias.yaml"
    bias.write_text("disturbance: bias\naspects: {bias: {type: Bias, by: 0.5, at: nowhere}}\n")
    epicycle.disturb(source, bias, tmp_path / "out", at="/robot/*", seed=1)
    found = {
        topic: (message, old)
        for (_, topic, message), (*_, old) in zip(bag(tmp_path / "out").messages(), bag(source).messages(), strict=True)
    }
    place, old = found["/robot/gps"]
    assert (place.header, place.point) == (old.header, {"x": old.point.x + 0.5, "y": 0.5, "z": 0.5})
    numbers, _ = found["/robot/numbers"]
    assert numbers.data.tolist() == [1.5, 2.5]
    assert numbers.layout.data_offset == 0  # 0.5, to even


def test_what_an_aspect_makes_must_fit_the_type(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source, missing = made(tmp_path / "walk"), tmp_path / "missing.yaml"
    missing.write_text("disturbance: d\naspects: {it: {type: Bias, by: 1, fields: twist.lineal.x, at: nowhere}}\n")
    with pytest.raises(ActorError) as caught:
        epicycle.disturb(source, missing, tmp_path / "out", at="/robot/twist")
    assert str(caught.value).splitlines()[0] == (
        "aspect it failed in pass_token() at recording.robot_twist at (0 s, 1): Fields has no field 'lineal'; its "
        "fields: linear, angular"
    )
    assert not (tmp_path / "out").exists()
    file = bag(source)
    numbers = dict(file.messages(["/robot/numbers"]).__next__()[2])
    for value, reason in (
        ({"layout": {"dim": [], "data_offset": float("nan")}}, "nan is no uint32"),
        ({"layout": 3}, "'int' object is not subscriptable"),
    ):
        with pytest.raises(RecordingError) as refused:
            file.written("/robot/numbers", numbers | value)
        assert str(refused.value).endswith(
            f"cannot be a std_msgs/msg/Float64MultiArray of /robot/numbers in {source}: {reason}"
        )


@pytest.mark.parametrize(
    ("name", "values", "wanted"),
    [
        ("uint8", [255.4, -3.0, 7.5], [255, 0, 8]),
        ("int8", [300, -300, 5], [127, -128, 5]),
        ("int64", [1e30, -1e30, 0.0], [2**63 - 1024, -(2**63), 0]),
        ("uint64", 2**64 - 1, 2**64 - 1),
        ("uint64", [-1, 5], [0, 5]),
        ("byte", 7, 7),
        ("bool", True, True),
        ("float32", 0.1, float(np.float32(0.1))),
    ],
)
def test_numbers_beyond_a_range_become_its_ends(name: str, values: Any, wanted: Any) -> None:
    assert bags._in_range(name, values).tolist() == wanted


@pytest.mark.slow
def test_a_million_messages(tmp_path: Path) -> None:
    from mcap.writer import Writer

    source = tmp_path / "large.mcap"
    with source.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        schema = writer.register_schema("std_msgs/msg/Float64", "ros2msg", b"float64 data\n")
        channel = writer.register_channel("/x", "cdr", schema)
        for number in range(1_000_000):
            writer.add_message(channel, number * 1000, b"\x00\x01\x00\x00" + bytes(8), number * 1000, number)
        writer.finish()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    lost = tmp_path / "lost.yaml"
    lost.write_text("disturbance: lost\naspects: {lost: {type: PacketLoss, probability: 0.1, at: topic.x}}\n")
    begin = time.process_time()
    done = epicycle.disturb(source, lost, tmp_path / "out.mcap", seed=1)
    assert time.process_time() - begin < 150  # 60 s on an idle machine
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000  # kB
    with (tmp_path / "out.mcap").open("rb") as file:
        reader = reading.make_reader(file)
        summary = reader.get_summary()
        found = [message.sequence for _, _, message in islice(reader.iter_messages(), 10_000)]
    assert summary.statistics.message_count == done.delivered["/x"]
    assert 890_000 < summary.statistics.message_count < 910_000
    assert found == sorted(found)


@pytest.mark.parametrize(
    ("kind", "field"),
    [("a/msg/X(print('run'))", "x"), ("a/msg/X", "x: print('run')"), ('a/msg/X"', "x"), ("a/msg/X\n", "x")],
)
def test_names_in_a_recording_are_never_code(
    kind: str, field: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Whatever the library's grammar admits."""
    types = {kind: ([], [(field, (1, ("int32", 0)))])}
    monkeypatch.setattr(bags, "get_types_from_msg", lambda text, name: types)
    with pytest.raises(RecordingError, match=r"a type of messages, or a field, has a name that is none$"):
        _ = bag(made(tmp_path / "recorded")).store
    assert capsys.readouterr().out == ""
