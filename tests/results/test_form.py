"""The digest of a log by the document alone (docs/semantics.md, "The form of the log"): a program of its own."""

from __future__ import annotations

import dataclasses
import hashlib
import struct
from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest

from epicycle.actors import Tag
from epicycle.runner import load_model
from epicycle.runner.execution.engine import Simulation
from epicycle.runner.execution.results import EventLog, Record, TokenError
from tests.engine.engine_parts import load
from tests.results.test_log import DIFFERENT, Frozen


def count(number: int) -> bytes:
    return struct.pack("<I", number)


def varint(number: int) -> bytes:
    return bytes([number]) if number < 128 else bytes([number % 128 + 128]) + varint(number // 128)


def text(token: str) -> bytes:
    data = token.encode("utf-8", "surrogatepass")
    return count(len(data)) + data


def array(token: Any) -> bytes:
    token = np.array(token, subok=False, order="C")
    if token.dtype.kind not in "biuf":
        return b"A" + value(token.dtype.str) + value(token.tolist())
    if token.dtype.kind == "f":
        token[np.isnan(token)] = np.nan
    return b"a" + token.dtype.str.encode() + b"".join(map(count, (token.ndim, *token.shape))) + bytes(token.tobytes())


def value(token: Any) -> bytes:
    if isinstance(token, float):
        is_number = token == token  # noqa: PLR0124
        return b"f" + (struct.pack("<d", token) if is_number else struct.pack("<Q", 0x7FF8000000000000))
    if isinstance(token, np.ndarray):
        return array(token)
    if dataclasses.is_dataclass(token):
        fields = [(field.name, getattr(token, field.name)) for field in dataclasses.fields(token)]
        head = b"d" + text(type(token).__qualname__) + count(len(fields))
        return head + b"".join(text(name) + value(item) for name, item in fields)
    if token is None or isinstance(token, bool):
        return b"n" if token is None else b"t" if token else b"u"
    if isinstance(token, int):
        return b"i" + struct.pack("<q", token) if -(2**63) <= token < 2**63 else b"I" + text(str(token))
    if isinstance(token, str):
        return b"s" + text(token)
    if isinstance(token, np.generic) and not isinstance(token.item(), np.generic):
        return value(token.item())
    if isinstance(token, (list, tuple)):
        return b"l" + count(len(token)) + b"".join(map(value, token))
    if isinstance(token, dict):
        return b"m" + count(len(token)) + b"".join(sorted(value(key) + value(item) for key, item in token.items()))
    if isinstance(token, (set, frozenset)):
        return b"e" + count(len(token)) + b"".join(sorted(map(value, token)))
    return b"r" + text(repr(token))


def digest(records: Iterable[Record]) -> str:
    data, tag, numbers = bytearray(), None, dict[bytes, int]()
    for record in records:
        if record.tag != tag:
            tag = record.tag
            data += b"\0" + struct.pack("<q", tag.time) + varint(tag.microstep)
        names = b"".join(map(value, (record.event, record.actor, record.port, record.aspect, record.channel)))
        if names in numbers:
            data += varint(numbers[names]) + value(record.value)
        else:
            numbers[names] = len(numbers) + 1
            data += varint(numbers[names]) + names + value(record.value)
    return hashlib.sha256(data).hexdigest()


MANY = """
actors: {t: {type: Ticker, limit: 3}, s: {type: Scale, count: 200, factor: 0.5}}
connections: ["t.output -> s[*].input"]
aspects: {loss: {type: PacketLoss, probability: 0.5, at: "s[*].input"}}
"""


@pytest.mark.parametrize(("name", "until"), [("collision_avoidance", 1.0), ("lift_group", 200.0), ("mm1", 200.0)])
def test_packaged_models(name: str, until: float) -> None:
    simulation = Simulation(load_model(name), seed=3, keep_log=True)
    found = simulation.run(until=until).digest
    assert len(simulation.log.records) > 100
    assert found == digest(simulation.log.records)


def test_however_a_run_is_made() -> None:
    simulation = Simulation(load(MANY), seed=1, keep_log=True)
    simulation.step()
    assert simulation.log.digest == digest(simulation.log.records)
    snapshot = simulation.snapshot()
    for each in (simulation, simulation.fork()):
        found = each.run().digest
        assert found == digest(each.log.records) == Simulation(load(MANY), seed=1).run().digest
    simulation.restore(snapshot)
    assert simulation.log.digest == digest(simulation.log.records)
    assert simulation.run().digest == found


def test_every_kind_of_value() -> None:
    log = EventLog(lambda *_: True)
    nested = [Frozen(token) for token in DIFFERENT] + [tuple(DIFFERENT), "\ud800", "é" * 200, np.float32(0.1), 2**70]
    for number, token in enumerate([*DIFFERENT, *nested, *DIFFERENT]):
        log.add(Tag(number // 3 - 5, number // 2), "send", f"a{number % 150}", "output", number % 4 or None, "", token)
    assert log.digest == digest(log.records)


def test_numbers_of_names_depend_on_records_alone() -> None:
    found = set()
    for order in ("abc", "cba"):
        log = EventLog(lambda *_: True)
        writers = {name: log.writer("send", name, "output", None, "") for name in order}
        with pytest.raises(TokenError):
            writers["c"].write(Tag(1, 1), object())  # leaves nothing behind, neither its names nor its tag
        for name, token in (("b", 1.0), ("a", 2.0), ("b", 3.0)):
            writers[name].write(Tag(0, 1), token)
        assert log.digest == digest(log.records)
        found.add(log.digest)
    assert len(found) == 1
