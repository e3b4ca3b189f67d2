"""Loops of control and of vehicles as wholes: crashes, snapshots, traces, tokens that are no numbers."""

from __future__ import annotations

import itertools
import math

import pytest

from epicycle.runner import ActorError, Simulation, load_model
from epicycle.runner.execution.engine import Firing, Tracer
from tests.actors.feeding import load

LOOP = """
model: loop
actors:
  clock: {type: Clock, period: 100 ms}
  plant: {type: TransferFunction, denominator: [1, 1], initial: [3]}
  filter: {type: DiscreteFilter, design: {type: Butterworth, cutoff: 2 Hz, period: 100 ms}, start: settled}
  pid: {type: PID, setpoint: 1, proportional: 2, integral: 3, derivative: 0.1, filter_time: 50 ms, low: -5, high: 5}
  valve: {type: Limiter, rising: 8, falling: 8, initial: 0}
  steps: {type: Quantizer, step: 0.01}
  alarm: {type: Hysteresis, upper: 1.1, lower: 0.9}
  zone: {type: DeadZone, low: -0.01, high: 0.01}
connections:
  - clock.output -> plant.trigger
  - plant.output -> filter.input, alarm.input
  - filter.output -> pid.measurement
  - pid.error -> zone.input
  - pid.output -> steps.input
  - steps.output -> valve.input
  - valve.output -> plant.input, pid.tracking
run: {stop: 20 s, record: ["*.output"]}
"""
VEHICLES = """
model: vehicles
actors:
  clock: {type: Clock, period: 100 ms}
  car: {type: Ackermann}
  robot: {type: Unicycle, start: [0, 5], speed: 1, turn_rate: 0.3}
  guide: {type: WaypointFollower, waypoints: [[8, 0], [8, 8], [0, 8], [0, 0]], closed: true, wheelbase: 2.5}
  scanner: {type: RangeScanner, beams: 8, deviation: 0.1, walls: [[-9, -9, 9, -9]]}
  bearing: {type: RangeBearingSensor, bearing_deviation: 0.1, range_deviation: 0.1}
  imu: {type: InertialSensor, turn_rate_noise: 0.01, turn_rate_walk: 0.01, acceleration_walk: 0.1}
connections:
  - clock.output -> car.trigger, robot.trigger
  - car.pose -> guide.pose, scanner.pose, bearing.pose, imu.pose
  - robot.pose -> scanner.bodies, bearing.target
  - guide.speed -> car.speed
  - guide.steering -> car.steering
run: {stop: 20 s, record: ["**"]}
"""


@pytest.mark.parametrize("text", [LOOP, VEHICLES])
def test_a_snapshot_goes_on_as_if_nothing_had_been(text: str) -> None:
    model = load(text)
    wanted = Simulation(model, seed=4).run().digest
    simulation = Simulation(model, seed=4)
    simulation.advance(7.3)
    snapshot = simulation.snapshot()
    other = simulation.fork()
    assert simulation.run().digest == wanted
    simulation.restore(snapshot)
    assert simulation.run().digest == wanted
    assert other.run().digest == wanted


@pytest.mark.parametrize("text", [LOOP, VEHICLES])
def test_all_of_them_may_crash(text: str) -> None:
    crash = 'aspects: {crash: {type: CrashRestart, at: "*", mtbf: 2 s, repair: 0.5 s}}\n'
    results = Simulation(load(text + crash.replace('"*"', '["*", "!clock"]')), seed=1).run()
    assert results.aspects["crash"]["crashed"] > 30
    assert results.aspects["crash"]["crashed"] - results.aspects["crash"]["restarted"] <= 8


def test_what_crashes_begins_anew() -> None:
    crash = "aspects: {crash: {type: CrashRestart, at: ACTOR, times: [10 s], repair: 1 s}}\n"
    plant = Simulation(load(LOOP + crash.replace("ACTOR", "plant"))).run().signals["plant.output"]
    after = dict(zip(plant.times, plant.values, strict=True))
    assert after[0.0] == 3.0
    assert after[9.9] == pytest.approx(1.0, abs=0.02)
    assert 10.5 not in after  # it was down
    assert after[11.0] == 3.0  # since its restart no time has passed
    clean = Simulation(load(VEHICLES)).run().signals["car.pose"].tokens
    crashed = Simulation(load(VEHICLES + crash.replace("ACTOR", "guide"))).run().signals["car.pose"].tokens
    assert [each.position.tolist() for each in crashed[:100]] == [each.position.tolist() for each in clean[:100]]
    # While its guide was down the car went on as it was told last, straight or on an arc.
    turns = {round(b.heading - a.heading, 12) for a, b in itertools.pairwise(crashed[101:110])}
    assert len(turns) == 1


def test_the_log_has_the_same_bits_whoever_looks() -> None:
    """A trace changes nothing, and tells why an actor fired."""
    model = load(LOOP)
    wanted = Simulation(model).run(until=1.0).digest
    found: list[Firing] = []
    tracer = Tracer({"pid": model.graph.actors["pid"]}, found.append)
    assert Simulation(model, tracer=tracer).run(until=1.0).digest == wanted
    # A measurement each tick, and what the valve tells of it in a firing of its own.
    assert len(found) == 22


@pytest.mark.parametrize(
    ("token", "message"),
    [
        (math.nan, "pid.measurement got nan, expected a finite number"),
        ("cold", "pid.measurement got 'cold', expected a finite number"),
    ],
)
def test_what_is_no_number_ends_the_run(token: object, message: str) -> None:
    text = """
model: m
actors:
  clock: {type: Clock, period: 1, values: [VALUE]}
  any: {type: Merge}
  pid: {type: PID}
connections: [clock.output -> any.input, any.output -> pid.measurement]
run: {stop: 2 s}
"""
    value = ".nan" if token != "cold" else "cold"
    with pytest.raises(ActorError) as caught:
        Simulation(load(text.replace("VALUE", value))).run()
    assert caught.value.reason == message


@pytest.mark.parametrize("name", ["pid_loop", "waypoints"])
def test_packaged_loops_may_be_interrupted(name: str) -> None:
    model = load_model(name)
    simulation = Simulation(model)
    simulation.advance(3.0)
    other = simulation.fork()
    assert simulation.run().digest == other.run().digest == Simulation(model).run().digest


def test_aspects_alter_poses_as_they_do_other_tokens() -> None:
    aspects = """
aspects:
  compass: {type: Bias, by: 0.25, fields: heading, at: car.pose}
  rain: {type: Noise, deviation: 0.5, at: robot.pose}
  stuck: {type: StuckAt, p: 0.2, r: 0.2, at: robot.pose}
"""
    clean, wrong = (Simulation(load(VEHICLES + each), seed=2).run() for each in ("", aspects))
    before, after = (each.signals["car.pose"].tokens[0] for each in (clean, wrong))
    assert (after.heading, after.position.tolist()) == (before.heading + 0.25, before.position.tolist())
    assert [each.time for each in wrong.signals["robot.pose"].tokens] == [k / 10 for k in range(201)]
    assert wrong.aspects["stuck"]["replaced"] > 50
