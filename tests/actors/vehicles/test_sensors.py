"""What vehicles measure: against geometry, and noise against its law."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epicycle.actors import BodyState, InertialSensor, ParameterError, RangeBearingSensor, RangeScanner
from epicycle.actors.testing import Harness
from epicycle.runner import ActorError
from epicycle.runner.execution.engine import Simulation
from tests.actors.feeding import load
from tests.actors.vehicles.test_motion import pose


def body(x: float, y: float) -> BodyState:
    return BodyState((x, y), (0.0, 0.0), 0.0)


# -- range and bearing ------------------------------------------------------------------------------------------------


@settings(deadline=None)
@given(st.floats(-9, 9), st.floats(-9, 9), st.floats(-20, 20), st.floats(-9, 9), st.floats(-9, 9))
def test_range_and_bearing_are_those_of_the_plane(x: float, y: float, heading: float, tx: float, ty: float) -> None:
    harness = Harness(RangeBearingSensor("it"), widths={"target": 1})
    harness.fire(0.0, pose=pose(x, y, heading), target=body(tx, ty))
    distance, bearing = harness.last("range"), harness.last("bearing")
    assert -math.pi <= bearing <= math.pi
    seen = x + distance * math.cos(heading + bearing), y + distance * math.sin(heading + bearing)
    assert seen == pytest.approx((tx, ty), abs=1e-12)


def test_what_is_out_of_sight_is_not_seen_and_moves_no_noise() -> None:
    def measured(**sight: Any) -> dict[float, float]:
        sensor = RangeBearingSensor("it", bearing_deviation=0.1, range_deviation=0.2, **sight)
        harness = Harness(sensor, seed=3, widths={"target": 1})
        for k in range(200):
            angle = k / 10
            harness.fire(float(k), pose=pose(0, 0), target=body(math.cos(angle) * k / 10, math.sin(angle) * k / 10))
        return dict(harness.sent["bearing"]) | {-time - 1: value for time, value in harness.sent["range"]}

    every, some = measured(), measured(max_range=12, field_of_view="90 deg")
    assert some.items() <= every.items()
    seen = {k for k in range(200) if k / 10 <= 12 and abs(math.remainder(k / 10, 2 * math.pi)) <= math.pi / 4}
    assert {time for time in some if time >= 0} == seen


def test_noise_has_its_deviations() -> None:
    sensor = RangeBearingSensor("it", bearing_deviation=0.02, range_deviation=0.3, landmark=[-40, 0])
    harness = Harness(sensor)
    for k in range(4000):
        harness.fire(float(k), pose=pose(0, 0))
    bearings = np.array(harness.tokens("bearing"))
    assert np.abs(bearings).max() <= math.pi  # behind the vehicle, where angles wrap
    turned = np.mod(bearings, 2 * math.pi) - math.pi
    for errors, deviation in ((turned, 0.02), (np.array(harness.tokens("range")) - 40, 0.3)):
        assert abs(errors.mean()) < 4 * deviation / math.sqrt(4000)
        assert errors.std() == pytest.approx(deviation, rel=4 / math.sqrt(8000))


def test_the_latest_target_counts() -> None:
    harness = Harness(RangeBearingSensor("it"), widths={"target": 1})
    harness.fire(0.0, pose=pose(0, 0))
    harness.fire(1.0, target=body(3, 4))
    harness.fire(2.0, pose=pose(0, 0))
    assert harness.sent["range"] == [(2.0, 5.0)]


@pytest.mark.parametrize("landmark", ["", ", landmark: [1, 2]"])
def test_a_sensor_has_one_target(landmark: str) -> None:
    target = "  - other.pose -> it.target\n" if landmark else ""
    text = f"""
model: m
actors:
  clock: {{type: Clock, period: 1}}
  robot: {{type: Unicycle}}
  other: {{type: Unicycle}}
  it: {{type: RangeBearingSensor{landmark}}}
connections:
  - clock.output -> robot.trigger, other.trigger
  - robot.pose -> it.pose
{target}run: {{stop: 1 s}}
"""
    with pytest.raises(ActorError) as caught:
        Simulation(load(text)).run()
    assert caught.value.reason == "it needs one target: either connect 'target' or give a 'landmark'"


# -- scanning ---------------------------------------------------------------------------------------------------------

ROOM = [[-5, -3, 5, -3], [5, -3, 5, 3], [5, 3, -5, 3], [-5, 3, -5, -3]]


@settings(deadline=None, max_examples=50)
@given(st.floats(-4.5, 4.5), st.floats(-2.5, 2.5), st.floats(-7, 7))
def test_beams_in_a_room_end_at_its_walls(x: float, y: float, heading: float) -> None:
    harness = Harness(RangeScanner("it", beams=24, walls=ROOM, max_range=20))
    harness.fire(0.0, pose=pose(x, y, heading))
    found = harness.last("ranges")
    angles = heading - math.pi + 2 * math.pi * np.arange(24) / 24
    cos, sin = np.cos(angles), np.sin(angles)
    cos, sin = np.where(cos == 0, 1e-300, cos), np.where(sin == 0, 1e-300, sin)
    wanted = np.minimum((5 * np.sign(cos) - x) / cos, (3 * np.sign(sin) - y) / sin)
    assert found == pytest.approx(wanted, rel=1e-9)
    assert harness.last("nearest") == found.min()
    assert not found.flags.writeable


@settings(deadline=None, max_examples=50)
@given(st.floats(-8, 8), st.floats(-8, 8), st.floats(0.1, 3))
def test_beams_end_at_discs(cx: float, cy: float, radius: float) -> None:
    """By steps along the beam: the first place within the disc."""
    harness = Harness(RangeScanner("it", beams=13, field_of_view="180 deg", discs=[[cx, cy, radius]], max_range=10))
    harness.fire(0.0, pose=pose(0.0, 0.0, 0.3))
    along = np.linspace(0, 10, 20_001)
    for found, angle in zip(harness.last("ranges"), 0.3 + np.linspace(-math.pi / 2, math.pi / 2, 13), strict=True):
        inside = np.hypot(along * math.cos(angle) - cx, along * math.sin(angle) - cy) <= radius
        if inside.any():
            assert found == pytest.approx(along[inside.argmax()], abs=6e-4)
        else:  # a beam that grazes it may fall between two steps
            assert found == 10 or np.hypot(found * math.cos(angle) - cx, found * math.sin(angle) - cy) < radius + 1e-9


def test_bodies_move_and_hide_what_is_behind() -> None:
    harness = Harness(RangeScanner("it", beams=1, walls=[[9, -1, 9, 1]], body_radius=1), widths={"bodies": 2})
    harness.fire(0.0, pose=pose(0, 0))
    harness.fire(1.0, pose=pose(0, 0), bodies=[body(5, 0), None])
    harness.fire(2.0, pose=pose(0, 0), bodies=[None, body(3, 0)])
    harness.fire(3.0, pose=pose(0, 0), bodies=[body(0.5, 0), body(3, 9)])
    assert [each.tolist() for each in harness.tokens("ranges")] == [[9.0], [4.0], [2.0], [0.0]]


def test_beams_have_independent_noise_and_nothing_beyond_the_range() -> None:
    harness = Harness(RangeScanner("it", beams=2, field_of_view=0.2, walls=[[5, -9, 5, 9]], deviation=0.1, max_range=6))
    for k in range(3000):
        harness.fire(float(k), pose=pose(0, 0))
    found = np.array(harness.tokens("ranges")) - 5 / math.cos(0.1)
    assert found.std(axis=0) == pytest.approx([0.1, 0.1], rel=4 / math.sqrt(6000))
    assert abs(np.corrcoef(found.T)[0, 1]) < 4 / math.sqrt(3000)
    far = Harness(RangeScanner("it", beams=3, deviation=1.0, max_range=6))
    far.fire(0.0, pose=pose(0, 0))
    assert far.last("ranges").tolist() == [6.0, 6.0, 6.0]


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"max_range": math.inf}, "max_range: it must be finite, because beams that hit nothing end there"),
        ({"discs": [[0, 0, -1]]}, "discs: a radius is negative; expected >= 0"),
        ({"walls": [[0, 0, 1]]}, "it: RangeScanner.walls: [[0, 0, 1]] is not a list of n x 4 numbers in m"),
    ],
)
def test_scanners_that_are_none(parameters: dict[str, Any], message: str) -> None:
    with pytest.raises(ParameterError) as caught:
        RangeScanner("it", **parameters)
    assert str(caught.value) == message


# -- inertia ----------------------------------------------------------------------------------------------------------


def test_an_ideal_sensor_feels_turning_and_speeding_up() -> None:
    harness = Harness(InertialSensor("it"))
    harness.fire(0.0, pose=pose(0, 0, 0.0, time=0.0, speed=1.0))
    harness.fire(0.5, pose=pose(0, 0, 0.25, time=0.5, speed=2.0))
    harness.fire(1.0, pose=pose(0, 0, 0.25, time=0.5, speed=9.0))  # of the same time: there is nothing between
    harness.fire(1.5, pose=pose(0, 0, -0.75, time=1.0, speed=2.0))
    assert harness.tokens("turn_rate") == pytest.approx([0.5, -2.0])
    assert np.array(harness.tokens("acceleration")) == pytest.approx(np.array([[2.0, 0.75], [0.0, -4.0]]))


def test_on_a_circle_it_feels_the_centripetal_acceleration() -> None:
    text = """
model: m
actors:
  clock: {type: Clock, period: 100 ms}
  car: {type: Ackermann, speed: 5, steering: 0.2, wheelbase: 2}
  imu: {type: InertialSensor}
connections: [clock.output -> car.trigger, car.pose -> imu.pose]
run: {stop: 5 s, record: [imu.turn_rate, imu.acceleration]}
"""
    signals = Simulation(load(text)).run().signals
    rate = 5 * math.tan(0.2) / 2
    assert signals["imu.turn_rate"].values == pytest.approx([rate] * 50, abs=1e-12)
    assert np.array(signals["imu.acceleration"].tokens) == pytest.approx(np.array([[0, 5 * rate]] * 50), abs=1e-11)


@pytest.mark.parametrize("period", [0.01, 0.25])
def test_noise_and_bias_follow_their_laws(period: float) -> None:
    """White noise of a density, the same at any rate; a bias whose variance grows with time."""
    count = 4000

    def readings(seed: int = 0, **parameters: Any) -> Any:
        harness = Harness(InertialSensor("it", **parameters), seed=seed)
        for k in range(count + 1):
            harness.fire(float(k), pose=pose(0, 0, time=k * period))
        return np.column_stack([harness.tokens("turn_rate"), np.array(harness.tokens("acceleration"))])

    noise = readings(turn_rate_noise=0.02, acceleration_noise=0.3)
    wanted = np.array([0.02, 0.3, 0.3]) / math.sqrt(period)
    assert noise.std(axis=0) == pytest.approx(wanted, rel=4 / math.sqrt(2 * count))
    assert np.abs(np.corrcoef(noise[1:].T, noise[:-1].T)[:3, 3:]).max() < 4.5 / math.sqrt(count)  # white
    bias = readings(turn_rate_walk=0.05, acceleration_walk=0.01, turn_rate_bias=1, acceleration_bias=[2, 3])
    steps = np.diff(bias, axis=0)
    assert steps.std(axis=0) == pytest.approx(
        np.array([0.05, 0.01, 0.01]) * math.sqrt(period), rel=4 / math.sqrt(2 * count)
    )
    assert bias[0] == pytest.approx([1, 2, 3], abs=4 * 0.05 * math.sqrt(period))
