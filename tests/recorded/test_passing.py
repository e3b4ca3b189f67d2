"""Recordings that pass disturbances."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import epicycle
from epicycle.actors import EpicycleError
from epicycle.runner.interface.cli import main
from epicycle.runner.recorded.files import McapRecording, opened
from epicycle.runner.recorded.passing import _names

START = 1_700_000_000_000_000_000  # ns
PERIOD = 20_000_000


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def log(rows: list[tuple[str, str, str]], path: str = "in.csv") -> Path:
    with open(path, "w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([("time", "topic", "value"), *rows])
    return Path(path)


def read(path: str | Path) -> list[list[str]]:
    with open(path, newline="") as file:
        return list(csv.reader(file))[1:]


def disturbance(text: str) -> Path:
    path = Path("d.yaml")
    path.write_text(f"disturbance: d\naspects:\n  it: {text}\n")
    return path


ROWS = [
    (f"{1000 + 0.02 * row:.2f}", topic, value)
    for row in range(300)
    for topic, value in (
        ("/robot/plan", json.dumps({"x": row, "time": row * 0.5, "name": "r"})),
        ("/robot/range", str(row / 10)),
        ("/note", 'as it is, with "quotes"'),
    )
]


# -- CSV --------------------------------------------------------------------------------------------------------------


def test_a_trace_decides_over_each_message() -> None:
    """What arrives, and when, follows from the trace alone; other topics stay as they are, byte for byte."""
    Path("t.csv").write_text("lost,delay\n0,0\n1,\n0,50.5\n")
    found = epicycle.disturb(
        log(ROWS), disturbance("{type: TraceReplay, file: t.csv, delay_unit: ms, at: robot.plan}"), "out.csv"
    )
    expected = [(float(row[0]), row) for row in ROWS if row[1] != "/robot/plan"]
    for number, row in enumerate(each for each in ROWS if each[1] == "/robot/plan"):
        if number % 3 == 0:
            expected.append((float(row[0]), row))
        elif number % 3 == 2:
            late = round(float(row[0]) + 0.0505, 4)
            expected.append((late, (f"{late:.4f}", *row[1:])))
    assert sorted(map(tuple, read("out.csv"))) == sorted(row for _, row in expected)
    assert [float(row[0]) for row in read("out.csv")] == sorted(time for time, _ in expected)
    assert found.came == {"/robot/plan": 300, "/robot/range": 300, "/note": 300}
    assert found.delivered == {"/robot/plan": 200, "/robot/range": 300, "/note": 300}
    assert found.aspects == {"it": {"dropped": 100, "delayed": 100}}


def test_without_any_effect_a_recording_stays_as_it_is() -> None:
    source = log([*ROWS, ("1100", "/robot/plan", '{"x" : 1.0,  "y": [NaN, 1e400, 12345678901234567890]}')])
    epicycle.disturb(source, disturbance("{type: Latency, at: '**'}"), "out.csv")
    assert Path("out.csv").read_bytes() == source.read_bytes()


def test_fields_are_altered_and_others_are_not() -> None:
    source = log(ROWS)
    epicycle.disturb(source, disturbance("{type: Bias, by: 2.5}"), "out.csv", at=["/robot/*"])
    for before, after in zip(read(source), read("out.csv"), strict=True):
        if before[1] == "/robot/plan":
            value = json.loads(before[2])
            # A whole number stays one; the time of a measurement is no measurement.
            assert json.loads(after[2]) == {**value, "x": round(value["x"] + 2.5)}
        elif before[1] == "/robot/range":
            assert float(after[2]) == pytest.approx(float(before[2]) + 2.5)
        else:
            assert after == before
    epicycle.disturb(source, disturbance("{type: Bias, by: 2.5, fields: time}"), "out.csv", at="/robot/plan")
    assert json.loads(read("out.csv")[3][2]) == {"x": 1, "time": 3.0, "name": "r"}


def test_equal_seeds_give_equal_files_and_others_do_not() -> None:
    source = log(ROWS)
    files = []
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        epicycle.disturb(source, "wifi_burst", f"{name}.csv", at="/robot/*", seed=seed, set={"bad_share": 0.4})
        files.append(Path(f"{name}.csv").read_bytes())
    assert files[0] == files[1] != files[2]
    assert main(["recording", "apply", str(source), "--with", "wifi_burst", "-o", "d.csv", "--at", "/robot/*",
                 "--seed", "1", "--set", "bad_share=0.4"]) == 0  # fmt: skip
    assert Path("d.csv").read_bytes() == files[0]


def test_one_topic_does_not_depend_on_the_others() -> None:
    """Each has its own stream: without the others, it loses the same messages."""
    log(ROWS)
    log([row for row in ROWS if row[1] == "/robot/plan"], "one.csv")
    file = disturbance("{type: PacketLoss, probability: 0.5, at: robot.*}")
    epicycle.disturb("in.csv", file, "out.csv")
    epicycle.disturb("one.csv", file, "one_out.csv")
    assert [row for row in read("out.csv") if row[1] == "/robot/plan"] == read("one_out.csv")


def test_the_command_tells_what_happened(capsys: pytest.CaptureFixture[str]) -> None:
    log([(row[0], row[1].replace("/plan", "/peer_plan"), row[2]) for row in ROWS])
    assert main(["recording", "apply", "in.csv", "--with", "wifi_burst", "-o", "out.csv"]) == 0
    said = capsys.readouterr().out
    lost = 900 - len(read("out.csv"))
    assert (
        said
        == f"""\
in.csv: 900 messages came, {900 - lost} were delivered, seed 0; not for recordings, and left out: \
set latency (wifi_burst), wifi_loss at *.peer_measurement (wifi_burst), wifi_latency at *.peer_measurement \
(wifi_burst), keeps_off_obstacle: Assert (wifi_burst), keeps_off_robots: Assert (wifi_burst)

topic             came  delivered
/robot/peer_plan  300   {300 - lost}
/robot/range      300   300
/note             300   300

aspect        figure   value
wifi_loss     dropped  {lost}
wifi_latency  delayed  {300 - lost}
wrote out.csv
"""
    )
    assert main(["recording", "apply", "in.csv", "--with", "wifi_burst", "-o", "out.csv", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["delivered"]["/robot/peer_plan"] == 300 - lost


def test_several_disturbances_and_their_parameters() -> None:
    source = log(ROWS)
    Path("lossy.yaml").write_text(
        "disturbance: lossy\nparameters: {share: {value: 0, unit: '1'}}\n"
        "aspects: {lossy: {type: PacketLoss, probability: '${share}', at: '*.plan'}}\n"
    )
    Path("late.yaml").write_text(
        "disturbance: late\nparameters: {by: {value: 0, unit: s}}\n"
        "aspects: {late: {type: Latency, delay: '${by}', at: '*.range'}}\n"
    )
    found = epicycle.disturb(source, ["lossy.yaml", "late.yaml"], "out.csv", set={"share": 1, "by": "5 ms"})
    assert found.aspects == {"lossy": {"dropped": 300}, "late": {"delayed": 300}}
    with pytest.raises(EpicycleError, match=r"'shore' matches no parameter, did you mean 'share'\?"):
        epicycle.disturb(source, ["lossy.yaml", "late.yaml"], "out.csv", set=["shore=1"])


def test_the_only_acts_of_a_disturbance() -> None:
    Path("d.yaml").write_text(
        "disturbance: d\naspects: {lossy: {type: PacketLoss, probability: 1, at: robot.plan}}\n"
        "exactly: [{aspect: lossy, at: robot.plan, token: 2}]\n"
    )
    found = epicycle.disturb(log(ROWS), "d.yaml", "out.csv")
    assert found.delivered["/robot/plan"] == 299
    gone = [row for row in ROWS if list(row) not in read("out.csv")]
    assert [row[0] for row in gone] == ["1000.02"]


def test_names_of_topics() -> None:
    topics = ["/a/b/c", "/a/b.c", "/a_b/c", "/scan", "/", "/recording/x", "1/2", "a b/ü"]
    names = _names(dict(enumerate(topics)))
    assert [f"{each.actor}.{each.port}" for each in names.values()] == [
        "a_b.c", "a_b.c_", "a_b.c__", "topic.scan", "topic._", "recording_.x", "_1._2", "a_b._",
    ]  # fmt: skip
    assert len({each.output for each in names.values()}) == len(topics)


# -- MCAP -------------------------------------------------------------------------------------------------------------


def record(path: str = "in.mcap", rows: int = 300, **options: Any) -> Path:
    writer_module = pytest.importorskip("mcap.writer")
    with open(path, "wb") as file:
        writer = writer_module.Writer(file, **options)
        writer.start(profile="ros2", library="test")
        schema = writer.register_schema("position", "jsonschema", b'{"type": "object"}')
        plan = writer.register_channel("/robot/peer_plan", "json", schema, {"qos": "best effort"})
        scan = writer.register_channel("/robot/scan", "cdr", 0)
        writer.add_metadata("about", {"place": "hall"})
        writer.add_attachment(1, 2, "map.txt", "text/plain", b"here")
        for row in range(rows):
            time = START + row * PERIOD
            writer.add_message(plan, time, json.dumps({"x": row * 1.5}).encode(), time - 7, row)
            writer.add_message(scan, time, bytes([row % 256, 0xFF]), time, row)
        writer.finish()
    return Path(path)


def messages(path: str | Path) -> Iterator[tuple[str, int, int, int, bytes]]:
    reader = pytest.importorskip("mcap.reader")
    with open(path, "rb") as file:
        for _, channel, message in reader.make_reader(file).iter_messages():
            yield channel.topic, message.log_time, message.publish_time, message.sequence, message.data


def test_an_mcap_file_passes_with_all_that_is_in_it() -> None:
    source = record()
    Path("t.csv").write_text("lost,delay\n0,0\n1,\n0,50\n")
    at = "[robot.peer_plan, robot.scan]"
    found = epicycle.disturb(
        source, disturbance(f"{{type: TraceReplay, file: t.csv, delay_unit: ms, at: {at}}}"), "out.mcap"
    )
    expected = []
    for topic, time, published, sequence, data in messages(source):
        if sequence % 3 != 1:
            late = 50_000_000 if sequence % 3 == 2 else 0
            expected.append((topic, time + late, published, sequence, data))
    assert sorted(messages("out.mcap")) == sorted(expected)
    assert found.delivered == {"/robot/peer_plan": 200, "/robot/scan": 200}
    reader = pytest.importorskip("mcap.reader")
    with open("out.mcap", "rb") as file:
        made = reader.make_reader(file)
        assert made.get_header().profile == "ros2"
        assert [(each.name, each.metadata) for each in made.iter_metadata()] == [("about", {"place": "hall"})]
        assert [(each.name, each.data) for each in made.iter_attachments()] == [("map.txt", b"here")]
        summary = made.get_summary()
        plan, scan = summary.channels.values()
        assert (plan.metadata, summary.schemas[plan.schema_id].name) == ({"qos": "best effort"}, "position")
        assert (scan.message_encoding, scan.schema_id) == ("cdr", 0)


def test_fields_of_json_messages_are_altered() -> None:
    epicycle.disturb(record(), disturbance("{type: Corrupt, probability: 1, deviation: 2}"), "out.mcap",
                     at="*plan", seed=3)  # fmt: skip
    before, after = (
        np.array([json.loads(data)["x"] for topic, *_, data in messages(path) if topic.endswith("plan")])
        for path in ("in.mcap", "out.mcap")
    )
    assert (after - before).std() == pytest.approx(2.0, rel=0.2)
    first = Path("out.mcap").read_bytes()
    epicycle.disturb("in.mcap", "d.yaml", "out.mcap", at="*plan", seed=3)
    assert Path("out.mcap").read_bytes() == first


def test_a_recording_can_replace_itself() -> None:
    path = log(ROWS)
    epicycle.disturb(path, disturbance("{type: PacketLoss, probability: 1, at: robot.plan}"), path)
    assert {row[1] for row in read(path)} == {"/robot/range", "/note"}
    assert sorted(each.name for each in Path().iterdir()) == ["d.yaml", "in.csv"]


def test_a_file_is_read_in_pieces() -> None:
    source = record(rows=20_000, chunk_size=10_000)
    with opened(source) as recording:
        assert isinstance(recording, McapRecording)
        found = recording.messages()
        assert [next(found).channel for _ in range(4)] == [1, 2, 1, 2]


# -- what is wrong ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "its first line must be time,topic,value, not empty"),
        ("a,b\n", "its first line must be time,topic,value, not a,b"),
        ("time,topic,value\n1,a\n", "line 2: 2 cells, expected time, topic, value"),
        ("time,topic,value\nsoon,a,1\n", "line 2: 'soon' is not a time in s"),
        ("time,topic,value\nnan,a,1\n", "line 2: 'nan' is not a time in s"),
        ("time,topic,value\n2,a,1\n1,a,1\n", "line 3: time 1 is before that of the row above"),
        ("time,topic,value\n1,a," + "x" * 200_000, "line 2: field larger than field limit (131072)"),
        ("time,topic,value\n1,a," + "x" * 2**21, "line 2 is longer than 1,048,576 characters"),
        ('time,topic,value\n1,a,"x"y\n', "line 2: ',' expected after '\"'"),
        (b"\xff\xfe\x00", "it is not a text in UTF-8"),
        (
            "time,topic,value\n" + "".join(f"1,t{number},1\n" for number in range(10_001)),
            "it has more than 10,000 topics",
        ),
    ],
)
def test_wrong_logs(text: str | bytes, reason: str) -> None:
    Path("in.csv").write_bytes(text if isinstance(text, bytes) else text.encode())
    Path("out.csv").write_text("kept")
    with pytest.raises(EpicycleError) as caught:
        epicycle.disturb("in.csv", "wifi_burst", "out.csv", at="*")
    assert str(caught.value) == f"in.csv is not a recording: {reason}"
    assert Path("out.csv").read_text() == "kept"
    assert not Path(".out.csv").exists()


def test_wrong_mcap_files() -> None:
    whole = record().read_bytes()
    noise = np.random.default_rng(1).integers(0, 256, 100_000, dtype=np.uint8).tobytes()
    middle = len(whole) // 3
    damaged = whole[:middle] + noise[:200] + whole[middle + 200 :]
    for data in (b"", noise, whole[:-50], whole[: len(whole) // 2], damaged):
        Path("in.mcap").write_bytes(data)
        with pytest.raises(EpicycleError) as caught:
            epicycle.disturb("in.mcap", "wifi_burst", "out.mcap")
        assert str(caught.value).startswith("in.mcap is not a recording: ")
        assert not Path("out.mcap").exists()
        assert not Path(".out.mcap").exists()


def test_a_recording_that_lasts_too_long() -> None:
    log([("0", "a", "1"), ("1700000000.5", "b", "1")])
    with pytest.raises(EpicycleError) as caught:
        epicycle.disturb("in.csv", "wifi_burst", "out.csv", at="*")
    assert str(caught.value) == (
        "in.csv cannot be replayed: a message of b comes 1,700,000,000 s after the first one, and a run lasts "
        "1,000,000,000 s at most"
    )


def test_what_is_not_json_although_its_channel_says_so() -> None:
    module = pytest.importorskip("mcap.writer")
    with open("in.mcap", "wb") as file:
        writer = module.Writer(file)
        writer.start()
        channel = writer.register_channel("/a", "json", 0)
        writer.add_message(channel, 5, b"{", 5)
        writer.finish()
    with pytest.raises(EpicycleError) as caught:
        epicycle.disturb("in.mcap", "wifi_burst", "out.mcap", at="/a")
    assert str(caught.value) == "in.mcap is not a recording: a message of /a at 5 ns is not JSON, as its channel says"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ["in.txt", "--with", "wifi_burst", "-o", "o.txt"],
            "in.txt is not a recording: its name must end in .mcap or .csv, or it is a folder",
        ),
        (["none.csv", "--with", "wifi_burst", "-o", "o.csv"], "none.csv cannot be read: No such file or directory"),
        (["in.csv", "--with", "wifi_burst", "-o", "o.mcap"], "o.mcap must be of the same kind as in.csv: .csv"),
        (
            ["in.csv", "--with", "wifi_burst", "--at", "/robot/plam", "-o", "o.csv"],
            "'/robot/plam' matches no topic, did you mean '/robot/plan'?; topics: /robot/plan, /robot/range, /note",
        ),
        (
            ["in.csv", "--with", "bias.yaml", "-o", "o.csv", "--at", "*note"],
            "",
        ),
    ],
)
def test_what_is_refused(words: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    log(ROWS)
    Path("in.txt").write_text("")
    Path("bias.yaml").write_text("disturbance: b\naspects: {it: {type: Bias, by: 1, at: '*.x'}}\n")
    code = main(["recording", "apply", *words])
    assert (code, capsys.readouterr().err) == ((2, f"error: {message}\n") if message else (0, ""))


def test_what_cannot_be_altered_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    record()
    disturbance("{type: Bias, by: 1}")
    assert main(["recording", "apply", "in.mcap", "--with", "d.yaml", "-o", "o.mcap", "--at", "/robot/scan"]) == 2
    assert capsys.readouterr().err == (
        "error: aspect it failed in pass_token() at recording.robot_scan at (0 s, 2): a token of type Opaque holds no "
        "numbers to alter\n   declared at d.yaml:3:3\n   help: in.mcap is not a recording of ROS 2: it holds "
        "'jsonschema', which is not of ROS 2\n"
    )
    assert not Path("o.mcap").exists()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "{type: CrashRestart, at: robot}",
            """\
d.yaml:1:1: error: d has no aspect that alters, delays or loses tokens
    1 | disturbance: d
      | ^^^^^^^^^^^""",
        ),
        (
            "{type: PacketLoss, probability: 1, at: robot.scan}",
            """\
d.yaml:3:46: error: aspect it: 'robot.scan' matches no port, did you mean 'robot.plan'?
    3 |   it: {type: PacketLoss, probability: 1, at: robot.scan}
      |                                              ^^^^^^^^^^
   help: valid ports of robot: plan, range""",
        ),
    ],
)
def test_disturbances_that_are_not_for_a_recording(text: str, message: str) -> None:
    with pytest.raises(EpicycleError) as caught:
        epicycle.disturb(log(ROWS), disturbance(text), "out.csv")
    assert str(caught.value) == message
