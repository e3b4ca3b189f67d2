"""The event log, its digest, its files, and the bytes that tokens become."""

from __future__ import annotations

import csv
import hashlib
import itertools
import json
import math
import os
import struct
import subprocess
import sys
import tracemalloc
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from epicycle.actors import Tag
from epicycle.actors.compiled import CORE
from epicycle.runner.execution.engine import ActorError, LogFilter, Simulation
from epicycle.runner.execution.results import (
    EventLog,
    LogError,
    Record,
    TokenError,
    canonical,
    check_log_path,
    leaves,
    plain,
    write_log,
)
from tests.engine.engine_parts import Plan, load, simulate

MODEL = """
actors: {t: {type: Ticker, limit: 3}, s: {type: Scale, factor: 0.5}, join: {type: Join}}
connections: [t.output -> s.input, "t.output, s.output -> join.input"]
aspects: {loss: {type: PacketLoss, probability: 0.5, at: s.input}}
"""


@dataclass
class Point:
    x: float
    y: Any


@dataclass
class Spot:
    x: float
    y: Any


class Colour(Enum):
    RED = 1


DIFFERENT: list[Any] = [
    None, True, False, 0, 1, -1, 2**63, -(2**63) - 1, 0.0, -0.0, 1.0, math.nan, math.inf, -math.inf,
    "", "0", "1", "a", "None", [], [0], [0.0], [[0]], [0, 0], [[0], 0], ["a", "b"], ["ab"],
    {}, {"a": 1}, {"a": 1.0}, {"b": 1}, {1: "a"}, {"1": "a"}, set(), {0}, {"a"}, b"", b"a", 1j, Colour.RED,
    Point(0, 1), Point(0.0, 1), Spot(0, 1), {"x": 0, "y": 1},
    np.zeros(0), np.zeros(1), np.zeros(2), np.zeros((1, 2)), np.zeros((2, 1)), np.zeros(2, dtype=np.float32),
    np.zeros(2, dtype=int), np.zeros(2, dtype=bool), np.array([0.0, -0.0]), np.array([0.0, math.nan]),
    np.array(["a"]), np.array([None, 1]),
]  # fmt: skip


def test_canonical_bytes_tell_kinds_apart() -> None:
    found = [canonical(token) for token in DIFFERENT]
    for (one, first), (other, second) in itertools.combinations(zip(DIFFERENT, found, strict=True), 2):
        assert first != second, f"{one!r} and {other!r}"


def test_equal_tokens_give_equal_bytes() -> None:
    odd_nan = struct.unpack("<d", struct.pack("<Q", 0xFFF8000000000001))[0]
    assert canonical(odd_nan) == canonical(math.nan)
    assert canonical(np.array([odd_nan, 1.0])) == canonical(np.array([math.nan, 1.0]))
    assert canonical({"a": 1, "b": 2}) == canonical({"b": 2, "a": 1})
    assert canonical({"x", "y", "z"}) == canonical({"z", "y", "x"})
    assert canonical(np.float64(0.5)) == canonical(0.5)
    assert canonical(np.int32(5)) == canonical(5)
    assert canonical(np.bool_(True)) == canonical(True)
    assert canonical((1, 2)) == canonical([1, 2])
    assert canonical(np.arange(6).reshape(2, 3).T) == canonical(np.ascontiguousarray(np.arange(6).reshape(2, 3).T))
    assert canonical(np.longdouble(1)) == canonical(np.longdouble(1))


@pytest.mark.parametrize("size", [0, 1, 2, 4, 5, 40])
@pytest.mark.parametrize("kind", ["<f8", ">f8", "<f4", "<i8"])
def test_bytes_of_arrays(size: int, kind: str) -> None:
    numbers = np.arange(size).astype(kind)
    arrays = [numbers, np.repeat(numbers, 2)[::2], numbers.reshape(1, -1), np.ma.masked_array(numbers, mask=True)]
    if numbers.dtype.kind == "f":
        for position in range(size):
            for odd in ([math.nan], [-math.nan], [math.inf], [math.inf, -math.inf]):
                changed = numbers.copy()
                changed[position : position + len(odd)] = odd[: size - position]
                arrays.append(changed)
    for array in arrays:
        plainly = np.array(array, subok=False, order="C")
        if plainly.dtype.kind == "f":
            plainly[np.isnan(plainly)] = np.nan
        head = b"a" + array.dtype.str.encode() + struct.pack(f"<{array.ndim + 1}I", array.ndim, *array.shape)
        assert canonical(array) == head + plainly.tobytes()
        assert digest_of(array) == digest_of_bytes(("a", head + plainly.tobytes()))


@dataclass(frozen=True)
class Frozen:
    x: Any


@dataclass(frozen=True)
class Sealed:
    y: Any


def fixed(array: np.ndarray) -> np.ndarray:
    array.flags.writeable = False
    return array


SHARED = np.zeros(2)  # what read-only views look at


@pytest.mark.parametrize(
    ("token", "change"),
    [
        (np.zeros(2), lambda token: token.fill(1.0)),
        ([0.0], lambda token: token.append(1.0)),
        (Point(0.0, 1), lambda token: setattr(token, "x", 1.0)),
        (Frozen(np.zeros(2)), lambda token: token.x.fill(1.0)),
        (Frozen(fixed(SHARED[:])), lambda _: SHARED.fill(1.0)),
        (Frozen(fixed(np.array([[0.0]], dtype=object))), lambda token: token.x.flags.__setattr__("writeable", True)),
        (Frozen([0.0]), lambda token: token.x.append(1.0)),
        (Frozen((0.0, [0.0])), lambda token: token.x[1].append(1.0)),
        (Frozen(Point(0.0, 1)), lambda token: setattr(token.x, "x", 1.0)),
        (Frozen(Frozen({})), lambda token: token.x.x.update(a=1)),
    ],
)
def test_the_log_tells_what_a_token_was_when_it_was_sent(token: Any, change: Callable[[Any], Any]) -> None:
    log = EventLog()
    before, tag = canonical(token), Tag(0, 1)
    log.add(tag, "send", "a", "output", None, "", token)
    change(token)
    log.add(tag, "send", "b", "output", None, "", token)
    assert log.digest == digest_of_bytes(("a", before), ("b", canonical(token)))


def digest_of(token: Any) -> str:
    """The digest of a log to which a token was sent."""
    log = EventLog()
    log.add(Tag(0, 1), "send", "a", "output", None, "", token)
    return log.digest


def digest_of_bytes(*sent: tuple[str, bytes]) -> str:
    """The digest of sends of these actors, with these values."""
    data = canonical(0).replace(b"i", b"\0", 1) + b"\1"  # the tag
    for number, (actor, value) in enumerate(sent, start=1):
        data += bytes([number]) + b"".join(map(canonical, ("send", actor, "output", "", None))) + value
    return hashlib.sha256(data).hexdigest()


class Word(str):
    pass


@dataclass(frozen=True)
class Measure(float):
    y: Any = 1


def nested(depth: int) -> Any:
    return Frozen((nested(depth - 1), depth)) if depth else fixed(np.array([math.nan, 1.0]))


@pytest.mark.parametrize(
    "token",
    [
        (), ((),), ("", "\ud800", "\N{GREEK SMALL LETTER ALPHA}", Word("a")), (0, -1, 2**63 - 1, -(2**63), 2**63, True),
        (0.0, -0.0, math.nan, -math.nan, math.inf, np.float64(1.5), np.float32(1.5), np.int64(3), Measure(2.0)),
        (None, Colour.RED, b"a", {"a": 1.0}, {1.0, 2.0}, [1.0, [2.0]], Point(1.0, Spot(2.0, "a"))),
        np.array(1.0), np.zeros((0, 3)), np.array([[1.0, math.nan], [-math.nan, 0.0]]), np.arange(6.0).reshape(2, 3).T,
        np.array([1.0], ">f8"), np.frombuffer(b"a" + bytes(8), "<f8", offset=1), np.array(["a"]), np.array([{"a": 1}]),
        np.ma.masked_array([1.0], mask=True), Frozen(np.array([1], np.int16)), nested(3), nested(60),
    ],
)  # fmt: skip
def test_every_core_logs_the_canonical_bytes(token: Any) -> None:
    for each in (token, Frozen((token, 1.0))):
        assert digest_of(each) == digest_of_bytes(("a", canonical(each)))


def test_large_tokens_are_not_kept() -> None:
    log, tag, size = EventLog(), Tag(0, 1), 1_000_000
    tracemalloc.start()
    for _ in range(20):
        log.add(tag, "send", "a", "output", None, "", Frozen(fixed(np.zeros(size // 8))))
    taken, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert taken < 2 * size
    assert log.count == 20


def test_what_cannot_change_is_encoded_once() -> None:
    looks: Counter[Any] = Counter()

    @dataclass(frozen=True)
    class Watched:
        x: Any
        rest: Any = (1.0, "a", None, fixed(np.zeros(2)), Sealed(True))

        def __getattribute__(self, name: str) -> Any:
            value = object.__getattribute__(self, name)
            looks.update([value] if name == "x" else [])
            return value

    log = EventLog()
    kept = [Watched(number) for number in range(3)]
    for token in (*kept, *kept, *kept):
        log.add(Tag(0, 1), "send", "a", "output", None, "", token)
    before = log.digest
    once = 1 if CORE == "compiled" else 2  # Python asks first how large it is
    assert looks == dict.fromkeys(range(3), once)
    for number in range(3, 10_000):  # each takes the place of the one before it in memory
        log.add(Tag(number, 1), "send", "a", "output", None, "", Watched(number))
    assert log.digest != before
    assert looks == dict.fromkeys(range(10_000), once)
    assert log.count == 10_006


def test_what_cannot_be_encoded_is_told_at_once() -> None:
    log = EventLog()
    for token in (10**5_000, Frozen(10**5_000), Frozen((object(),))):
        with pytest.raises((ValueError, TokenError)):
            log.add(Tag(0, 1), "send", "b", "output", None, "", token)
    assert log.count == 0
    log.add(Tag(0, 1), "send", "a", "output", None, "", 1.0)
    assert log.digest == digest_of(1.0)


def test_plain_and_leaves() -> None:
    token = Point(
        np.float64(0.5), {"a": np.arange(2), "b": (True, None), "c": {2, 1}, "d": np.array([None, "x"], dtype=object)}
    )
    assert plain(token) == {"x": 0.5, "y": {"a": [0, 1], "b": [True, None], "c": [1, 2], "d": [None, "x"]}}
    assert json.loads(json.dumps(plain(DIFFERENT)))
    assert list(leaves(token)) == [
        ("x", 0.5), ("y.a[0]", 0), ("y.a[1]", 1), ("y.b[0]", True), ("y.b[1]", None), ("y.c", {1, 2}),
        ("y.d[0]", None), ("y.d[1]", "x"),
    ]  # fmt: skip
    assert list(leaves([[], {}, (), np.zeros((0, 2))]))[:3] == [("[0]", []), ("[1]", {}), ("[2]", ())]
    assert list(leaves({"a": np.array(2.5)})) == [("a", 2.5)]  # an array without an axis is one number


def test_a_token_without_a_value_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Plan, "begin", lambda actor: actor.wake_in(0))
    monkeypatch.setattr(Plan, "act", lambda actor: actor.output.send(object()))
    with pytest.raises(ActorError) as caught:
        simulate("actors: {a: {type: Plan}}")
    assert str(caught.value).splitlines()[0] == (
        "a failed in fire() at (0 s, 1): a token of type object has no value that can be logged: "
        "make it a dataclass, or give it a __repr__ that shows its contents"
    )


def test_order_and_digest() -> None:
    _, results = simulate(MODEL, seed=1)
    found = [(r.tag.seconds, r.event, r.actor, r.port, r.channel, r.aspect, r.value) for r in results.log.records]
    assert results.events == len(found)
    assert [row for row in found if row[0] == 0.0] == [
        (0.0, "send", "t", "output", None, "", 0),
        (0.0, "send", "s", "output", None, "", 0.0),
        (0.0, "send", "join", "output", None, "", [[0], [0.0]]),
    ]
    assert (1.0, "dropped", "s", "input", None, "loss", 1) in found
    assert results.digest == simulate(MODEL, seed=1)[1].digest
    assert len({simulate(MODEL, seed=seed)[1].digest for seed in range(8)}) > 3


@pytest.mark.slow
def test_the_digest_does_not_depend_on_the_hash_seed() -> None:
    script = (
        "from tests.results.test_log import MODEL, simulate\n"
        "from epicycle.runner.execution.engine import canonical\n"
        "print(simulate(MODEL, seed=3)[1].digest, canonical({'a', 'b', 'c', 'd'}).hex())"
    )
    found = set()
    for seed in ("0", "1", "12345"):
        environment = {**os.environ, "PYTHONHASHSEED": seed}
        run = subprocess.run(
            [sys.executable, "-c", script], cwd=Path(__file__).parents[2],
            env=environment, capture_output=True, text=True, check=True,
        )  # fmt: skip
        found.add(run.stdout)
    assert len(found) == 1


RECORDS = [
    Record(Tag(0, 1), "send", "a", "output", None, "", [1, 2.5, 'x,\n"é']),
    Record(Tag(1_500_000_000, 2), "dropped", "b[0].c", "input", None, "loss", None),
    Record(Tag(2**60, 3), "send", "a", "output", 4, "", {"x": True}),
]


@pytest.mark.parametrize("ending", [".jsonl", ".csv", ".parquet"])
@pytest.mark.parametrize("records", [RECORDS, []])
def test_files_hold_what_was_recorded(ending: str, records: list[Record], tmp_path: Path) -> None:
    path = tmp_path / f"log{ending}"
    check_log_path(path)
    write_log(records, path)
    names = ["time", "microstep", "event", "actor", "port", "channel", "aspect", "value"]
    if ending == ".jsonl":
        rows = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
        assert [list(row) for row in rows] == [names] * len(records)
        found = [(*list(row.values())[:-1], json.dumps(row["value"])) for row in rows]
    elif ending == ".csv":
        with path.open(encoding="utf-8", newline="") as file:
            header, *lines = csv.reader(file)
        assert header == names
        found = [(float(a), int(b), c, d, e, int(f) if f else None, g, h) for a, b, c, d, e, f, g, h in lines]
    else:
        table = pq.read_table(path)
        assert table.column_names == names
        found = [tuple(row.values()) for row in table.to_pylist()]
    assert found == [record.row() for record in records]


WHERE = """
actors:
  t: {type: Ticker, period: 1 ms}
  a: {type: Scale}
  b: {type: Scale}
connections: [t.output -> a.input, t.output -> b.input]
aspects:
  loss: {type: PacketLoss, at: "*.input", probability: 0.5}
  noise: {type: Noise, at: a.output, deviation: 1}
run: {stop: 40 ms}
"""


@pytest.mark.parametrize(
    ("texts", "fits"),
    [
        ([], lambda record: True),
        (["aspect=loss"], lambda record: record.aspect == "loss"),
        (["aspect=*"], lambda record: record.aspect != ""),
        (["aspect=loss", "aspect=noise"], lambda record: record.aspect != ""),
        (["aspect = *", "actor=a"], lambda record: record.aspect != "" and record.actor == "a"),
        (["event=dropped", "event=send"], lambda record: record.event != "replaced"),
        (["port=output"], lambda record: record.port == "output"),
        (["event=send", "aspect=loss"], lambda record: False),
    ],
)
def test_filter(texts: list[str], fits: Callable[[Record], bool]) -> None:
    model = load(WHERE)
    whole = Simulation(model, keep_log=True).run().log
    part = Simulation(model, keep_log=LogFilter.of(texts)).run().log
    assert part.records == [record for record in whole.records if fits(record)]
    assert (part.digest, part.count) == (whole.digest, whole.count)
    assert {record.event for record in whole.records} == {"send", "dropped", "replaced"}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("aspect=los", "aspect=los matches no aspect of the model, did you mean 'loss'?; aspects: loss, noise"),
        ("actor=c[*]", "actor=c[*] matches no actor of the model; actors: t, a, b"),
        (
            "event=drop",
            ("event=drop matches no event of the model, did you mean 'dropped'?; events: send, dropped, replaced"),
        ),
        ("port=a.output", "port=a.output matches no port of the model, did you mean 'output'?; ports: output, input"),
        ("actor=a..b", "'a..b' is not a pattern: '' is not a name, a name with an index, '*' or '**'"),
        ("loss", "'loss' is not a filter of the log: write COLUMN=PATTERN, such as aspect=packet_loss"),
        ("aspect=", "'aspect=' is not a filter of the log: write COLUMN=PATTERN, such as aspect=packet_loss"),
        (
            "actr=a",
            "the log has no column 'actr' to filter by, did you mean 'actor'?; columns: event, actor, port, aspect",
        ),
    ],
)
def test_wrong_filters(text: str, message: str) -> None:
    with pytest.raises(LogError) as caught:
        Simulation(load(WHERE), keep_log=LogFilter.of([text]))
    assert str(caught.value) == message


def test_paths_of_logs(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="is not a log file: its name must end in"):
        check_log_path(tmp_path / "log.txt")
    with pytest.raises(LogError, match="there is no folder"):
        check_log_path(tmp_path / "no" / "log.csv")


@pytest.mark.parametrize("options", [{}, {"keep_log": True, "log_to": list[Record]().append}])
def test_records_that_were_not_kept_are_no_frame(options: dict[str, Any]) -> None:
    results = Simulation(load("actors: {t: {type: Ticker, limit: 3}}"), **options).run()
    with pytest.raises(LogError) as caught:
        results.log.to_pandas()
    assert str(caught.value) == "the event log was not kept: make the run with Simulation(model, keep_log=True)"


def test_a_parquet_log_is_written_in_large_pieces(tmp_path: Path) -> None:
    """Small ones take a hundred times the place and the time."""
    records = (Record(Tag(time, 1), "send", "a", "output", None, "", time) for time in range(25_000))
    write_log(records, tmp_path / "l.parquet")
    found = pq.ParquetFile(tmp_path / "l.parquet").metadata
    assert [found.row_group(group).num_rows for group in range(found.num_row_groups)] == [10_000, 10_000, 5_000]


def test_a_token_that_a_loop_wraps_again_and_again_ends_at_a_limit_of_ours() -> None:
    # Not where Python runs out of stack, which differs from core to core.
    token: list[object] = [1.0]
    for _ in range(63):
        token = [token]
    assert EventLog().add(Tag(0, 1), "send", "a", "output", None, "", token) is None
    with pytest.raises(TokenError) as raised:
        EventLog().add(Tag(0, 1), "send", "a", "output", None, "", {"inside": token})
    assert str(raised.value) == (
        "the token is nested more than 64 levels deep; does a loop keep putting it into a list?"
    )
