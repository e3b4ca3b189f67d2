"""The packaged models of shared resources do what programs in plain SimPy do."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import simpy

from tests.demo_models import run

PACE, DOORS, STEP, PLACES = 2, 6, 1, 8


def test_the_warehouse_does_what_plain_simpy_does() -> None:
    results = run("warehouse", until=4 * 3600.0)
    environment = simpy.Environment()
    orders, chargers = simpy.Store(environment), simpy.Resource(environment, 3)
    delivered: list[list[tuple[float, float]]] = [[] for _ in range(20)]
    charged = []

    def customers() -> Any:
        signal = results.signals["order.output"]
        for time, order in zip(signal.times, signal.values, strict=True):
            yield environment.timeout(float(time) - environment.now)
            yield orders.put(order)

    def robot(number: int) -> Any:
        charge = 0.2 + (0.9 - 0.2) * (number + 1) / 20
        while True:
            since = environment.now
            order = yield orders.get()
            charge -= (environment.now - since) / (30 * 3600)
            way = order["way"] / (1.2 * (1 + 0.5 * number / 20))
            yield environment.timeout(way)
            yield environment.timeout(way)
            charge -= way / 6000 + way / 3600
            delivered[number].append((environment.now, environment.now - order["came"]))
            if charge < 0.2:
                since = environment.now
                with chargers.request() as request:
                    yield request
                    charge -= (environment.now - since) / (30 * 3600)
                    charged.append((since, environment.now))
                    yield environment.timeout(720 * math.log((1 - charge) / (1 - 0.9)))
                    charge = 0.9

    environment.process(customers())
    for number in range(20):
        environment.process(robot(number))
    environment.run(until=4 * 3600)
    for number, expected in enumerate(delivered):
        found = results.signals[f"robot[{number}].delivered"]
        assert found.times == pytest.approx([time for time, _ in expected], abs=1e-5)
        assert found.values == pytest.approx([stay for _, stay in expected], abs=1e-5)
    assert sum(map(len, delivered)) > 300
    assert max(end - begin for begin, end in charged) > 60  # some had to wait


@pytest.mark.parametrize("favour", ["true", "false"])
def test_the_cell_does_what_plain_simpy_does(favour: str) -> None:
    results = run("manufacturing_cell", until=2 * 86_400.0, night=1, favour=favour)
    machines = [f"lathe[{number}]" for number in range(3)]
    work = {
        (machine.split("[")[0], job["number"]): job["work"]
        for machine in (*machines, "mill")
        for job in results.signals[f"{machine}.job.output"].values
    }
    environment = simpy.Environment()
    robot = simpy.PriorityResource(environment, 1)
    store, buffer = simpy.Store(environment), simpy.Store(environment)
    stays = []

    def blanks() -> Any:
        signal = results.signals["blank.output"]
        for time, blank in zip(signal.times, signal.values, strict=True):
            yield environment.timeout(float(time) - environment.now)
            yield store.put(blank)

    def machine(kind: str, rank: int, before: simpy.Store) -> Any:
        next_part = before.get()
        while True:
            part = yield next_part
            for step in ("load", "unload"):
                with robot.request(priority=rank) as request:
                    yield request
                    yield environment.timeout(50)
                if step == "load":
                    yield environment.timeout(work[kind, part["number"]])
            # A lathe and the mill may ask at one instant: the mill goes first by rank, or else the lathe by channel.
            if kind == "lathe" and favour == "true":
                yield buffer.put(part)
            next_part = before.get()
            if kind == "lathe" and favour == "false":
                buffer.put(part)
            if kind == "mill":
                stays.append((environment.now, environment.now - part["came"]))

    environment.process(blanks())
    for _ in machines:
        environment.process(machine("lathe", 1, store))
    environment.process(machine("mill", 0 if favour == "true" else 1, buffer))
    environment.run(until=2 * 86_400 - 3600)  # what has not begun by the end of the run has no time to be looked up
    found = results.signals["stay.output"]
    assert len(stays) > 300
    assert found.times[: len(stays)] == pytest.approx([time for time, _ in stays], abs=1e-5)
    assert found.values[: len(stays)] == pytest.approx([stay for _, stay in stays], abs=1e-5)


def test_the_robot_of_the_cell_rests_at_night() -> None:
    results = run("manufacturing_cell", until=2 * 86_400.0)
    modes = results.signals["mill.machine.mode"]
    begun = modes.times[np.isin(modes.values.astype(str), ["loading", "unloading"])] % 86_400
    assert len(begun) > 300
    assert not np.any((begun > 20 * 3600 + 0.001) & (begun < 24 * 3600))
    assert results.metrics["boxes"] == len(results.signals["stay.output"].values) // 12


@pytest.mark.parametrize("urgent", ["true", "false"])
def test_the_switch_does_what_plain_simpy_does(urgent: str) -> None:
    results = run("switched_network", until=5.0, urgent=urgent)
    environment = simpy.Environment()
    lines = [simpy.Resource(environment, 1) for _ in range(4)]
    ports = [simpy.PriorityResource(environment, 1) for _ in range(5)]
    sent = []

    def frame(time: float, it: dict[str, Any]) -> Any:
        yield environment.timeout(time)
        if it["host"] < 4:
            with lines[it["host"]].request() as request:
                yield request
                yield environment.timeout(it["size"] / 1e6)
            yield environment.timeout(50e-6)
        yield environment.timeout(20e-6)
        with ports[it["destination"]].request(priority=it["kind"] if urgent == "true" else 0) as request:
            yield request
            yield environment.timeout(it["size"] / 1e6)
        sent.append((it["destination"], environment.now, it["host"], it["came"]))

    for name in (*(f"frame[{number}].output" for number in range(4)), "file_frame.output"):
        signal = results.signals[name]
        for time, it in zip(signal.times, signal.values, strict=True):
            environment.process(frame(float(time), it))
    environment.run(until=5.0)
    signal = results.signals["switch.output"]
    found = sorted(
        (it["destination"], float(time), it["host"], it["came"])
        for time, it in zip(signal.times, signal.values, strict=True)
    )
    assert len(sent) > 1000
    for one, other in zip(found, sorted(sent), strict=True):
        assert one == pytest.approx(other, abs=1e-6)
    assert results.metrics["file"] == len(results.signals["receiver.output"].values)
    assert results.metrics["repeated"] > 0


@dataclass
class Passenger:
    came: float
    origin: int
    to: int
    entered: float = 0.0
    left: float = 0.0

    @property
    def direction(self) -> int:
        return 1 if self.to > self.origin else -1


def lift(environment: Any, passengers: list[Passenger], bell: Any) -> Iterator[Any]:
    """Serves passengers, who are appended to its list when the bell is put into."""
    floor, direction = 0, 1
    aboard: list[Passenger] = []
    while True:
        while not (passengers or aboard):
            yield bell.get()
        bell.items.clear()
        goals = [each.origin for each in passengers] + [each.to for each in aboard]
        if not any((goal - floor) * direction > 0 for goal in goals):
            here = [each for each in passengers if each.origin == floor]
            elsewhere = [goal for goal in goals if goal != floor]
            if here:
                direction = here[0].direction
            elif elsewhere:
                direction = 1 if elsewhere[0] > floor else -1
        leaving = [each for each in aboard if each.to == floor]
        free = PLACES - len(aboard) + len(leaving)
        entering = [each for each in passengers if each.origin == floor and each.direction == direction][:free]
        if leaving or entering:
            for each in leaving:
                each.left = environment.now
                aboard.remove(each)
            for each in entering:
                each.entered = environment.now
                passengers.remove(each)
                aboard.append(each)
            yield environment.timeout(DOORS + STEP * (len(leaving) + len(entering)))
        elif goals:
            yield environment.timeout(PACE)
            floor += direction


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "rush"), [pytest.param(1, 0.8, marks=pytest.mark.slow), (2, 0.0)])
def test_every_passenger_gets_on_and_off_when_plain_simpy_says(seed: int, rush: float) -> None:
    results = run("lift_group", seed, keep_log=True, rush=rush)
    environment = simpy.Environment()
    halls: list[list[Passenger]] = [[] for _ in range(4)]
    bells = [simpy.Store(environment) for _ in halls]
    everybody = []

    def doors() -> Iterator[Any]:
        """Passengers as the model made them, each sent to the lift to which the model sent it."""
        for record in results.log.records:
            if (record.actor, record.port, record.event) != ("hall", "output", "send"):
                continue
            passenger = Passenger(record.tag.seconds, record.value["origin"], record.value["to"])
            yield environment.timeout(passenger.came - environment.now)
            everybody.append(passenger)
            halls[record.channel].append(passenger)
            bells[record.channel].put(None)

    environment.process(doors())
    for hall, bell in zip(halls, bells, strict=True):
        environment.process(lift(environment, hall, bell))
    environment.run(until=7200)
    assert len(everybody) > 800
    waits = sorted((each.entered, each.entered - each.came) for each in everybody if each.entered)
    stays = sorted((each.left, each.left - each.came) for each in everybody if each.left)
    for signal, expected in ((results.signals["wait.output"], waits), (results.signals["stay.output"], stays)):
        found = sorted(zip(signal.times.tolist(), signal.values.tolist(), strict=True))
        assert len(found) == len(expected) > 700
        for mine, theirs in zip(found, expected, strict=True):
            assert mine == pytest.approx(theirs, abs=1e-6)
