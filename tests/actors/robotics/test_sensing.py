"""Sensor, broadcast channel and estimators."""

import importlib
import math
from itertools import permutations

import numpy as np
import pytest
from scipy.stats import chi2

from epicycle.actors import (
    BodyState,
    BroadcastChannel,
    ChannelError,
    Estimate,
    FilterError,
    FilterPyEstimator,
    Measurement,
    Observation,
    Sensor,
    SensorModel,
    UnscentedEstimator,
)
from epicycle.actors.testing import Harness

FILTERS = (
    "KalmanFilter",
    "SquareRootKalmanFilter",
    "ExtendedKalmanFilter",
    "UnscentedKalmanFilter",
    "CubatureKalmanFilter",
)


def body(x: float, y: float, time: float = 0.0) -> BodyState:
    return BodyState(np.array([x, y]), np.zeros(2), time)


def sense(count: int, *, seed: int = 1, path: str = "main.sensor", **parameters: object) -> list[Measurement]:
    harness = Harness(Sensor(path, **parameters), seed=seed)
    for step in range(count):
        harness.fire(step / 10, robot=body(1.0, 2.0), target=body(4.0, 6.0))
    return harness.tokens("measurement")


def test_sensor_noise_is_the_ellipse_along_the_line_of_sight() -> None:
    count = 2000
    values = np.array([each.value for each in sense(count)]) - [3.0, 4.0]
    axes = np.array([[0.6, 0.8], [-0.8, 0.6]])  # along, across
    errors = values @ axes.T / [0.2, 2.0]
    low, high = chi2.ppf([0.0005, 0.9995], count)
    for component in errors.T:
        assert low < (component**2).sum() < high
    assert abs(np.corrcoef(errors.T)[0, 1]) < 4 / math.sqrt(count)
    assert np.abs(errors.mean(axis=0)).max() < 4 / math.sqrt(count)


def test_sensor_range_uses_the_same_draw_along() -> None:
    relative, ranges = sense(5), sense(5, kind="range")
    for a, b in zip(relative, ranges, strict=True):
        assert b.value.shape == (1,)
        assert b.value[0] - 5.0 == pytest.approx((a.value - [3.0, 4.0]) @ [0.6, 0.8])


def test_sensor_stream_depends_on_seed_and_path_only() -> None:
    def first(**given: object) -> list[float]:
        return sense(1, **given)[0].value.tolist()  # type: ignore[arg-type]

    assert first() == first()
    assert first() != first(seed=2)
    assert first() != first(path="other.sensor")


def test_sensor_out_of_range_does_not_shift_the_noise() -> None:
    harness = Harness(Sensor("main.sensor", max_range=10.0))
    harness.fire(0.0, robot=body(1.0, 2.0), target=body(400.0, 6.0))
    harness.fire(0.1, robot=body(1.0, 2.0))
    harness.fire(0.2, robot=body(1.0, 2.0), target=body(4.0, 6.0))
    (only,) = harness.tokens("measurement")
    assert only.value.tolist() == sense(3)[2].value.tolist()


def test_sensor_names_its_robot() -> None:
    assert sense(1, path="observer[2].sensor")[0].robot == "observer[2]"
    assert sense(1, path="sensor")[0].robot == "sensor"
    assert sense(1, robot_name="Ada")[0].robot == "Ada"


def test_sensor_on_top_of_the_target_is_finite() -> None:
    harness = Harness(Sensor("main.sensor"))
    harness.fire(0.0, robot=body(1.0, 2.0), target=body(1.0, 2.0))
    assert harness.last("measurement").finite


def test_sensor_on_top_of_the_target_looks_along_x() -> None:
    for parameters, place in (({"across": 0.0}, 0), ({"along": 0.0}, 1)):
        harness = Harness(Sensor("main.sensor", **parameters))
        harness.fire(0.0, robot=body(1.0, 2.0), target=body(1.0, 2.0))
        value = harness.last("measurement").value
        assert value[place] != 0.0
        assert value[1 - place] == 0.0


def test_channel_sends_to_all_but_the_speaker() -> None:
    harness = Harness(BroadcastChannel("plans"), widths={"input": 3, "output": 3})
    harness.fire(0.0, input=["a", None, "c"])
    sent = list(zip(harness.channels["output"], harness.tokens("output"), strict=True))
    assert sent == [(1, "a"), (2, "a"), (0, "c"), (1, "c")]


def test_channel_with_one_participant_sends_nothing() -> None:
    harness = Harness(BroadcastChannel("plans"), widths={"input": 1, "output": 1})
    harness.fire(0.0, input=["a"])
    assert harness.tokens("output") == []


def test_channel_with_unequal_ends_is_an_error() -> None:
    with pytest.raises(ChannelError, match=r"net\.plans has 3 connections into 'input' but 2 out of 'output'"):
        Harness(BroadcastChannel("net.plans"), widths={"input": 3, "output": 2})


# --- estimators ---------------------------------------------------------------------------------------


def drive(harness: Harness, steps: int, *, kind: str = "relative_position", gap: range = range(0)) -> np.ndarray:
    """Feed two robots' measurements of a circling target; (steps, 2, 4): mean estimate and truth."""
    random = np.random.default_rng(11)
    rows = []
    for step in range(steps):
        turned = 0.628 * step / 10
        centre = np.array([12.0, 0.0])
        target = centre + 2.0 * np.array([-math.sin(turned), math.cos(turned)])
        measurements = []
        for name, place in (("a", (30.0 - step / 10, 0.0)), ("b", (20.0, 12.0 - step / 20))):
            offset = target - place
            distance = np.hypot(*offset)
            along, across = offset / distance, np.array([-offset[1], offset[0]]) / distance
            e = random.normal(size=2)
            value = offset + 0.2 * e[0] * along + 2.0 * e[1] * across
            if kind == "range":
                value = np.array([distance + 0.2 * e[0]])
            measurements.append(Measurement(name, np.array(place), kind, value, 0.2, 2.0, step / 10))
        harness.fire(step / 10, trigger=step, measurements=measurements if step not in gap else [])
        velocity = -1.256 * np.array([math.cos(turned), math.sin(turned)])
        rows.append([harness.last("estimate").mean, np.concatenate([target, velocity])])
    return np.array(rows)


@pytest.mark.parametrize("kind", ["relative_position", "range"])
def test_estimator_follows_the_target(kind: str) -> None:
    rows = drive(Harness(UnscentedEstimator("main.estimator")), 100, kind=kind)
    error = np.hypot(*(rows[20:, 0, :2] - rows[20:, 1, :2]).T)
    assert error.mean() < 0.4
    assert error.max() < 1.0


def test_estimator_grows_unsure_in_a_gap_and_recovers() -> None:
    harness = Harness(UnscentedEstimator("main.estimator"))
    rows = drive(harness, 60, gap=range(20, 40))
    estimates = harness.tokens("estimate")
    spread = [np.trace(each.covariance[:2, :2]) for each in estimates]
    assert (np.diff(spread[19:40]) > 0.0).all()
    assert spread[41] < spread[39] / 10
    assert estimates[30].sources == ()
    assert estimates[41].sources == ("a", "b")
    assert np.hypot(*(rows[45:, 0, :2] - rows[45:, 1, :2]).T).max() < 1.0
    for each in estimates:
        assert np.linalg.eigvalsh(each.covariance)[0] > 0.0
        assert (each.covariance == each.covariance.T).all()


def test_estimator_predicts_over_the_time_that_passed() -> None:
    often, seldom = (Harness(UnscentedEstimator("e", velocity_noise=0.0)) for _ in range(2))
    for harness in (often, seldom):
        harness.fire(0.0, trigger=0)
    for step in range(1, 6):
        often.fire(step / 10, trigger=step)
    seldom.fire(0.5, trigger=1)
    assert often.last("estimate").mean == pytest.approx(seldom.last("estimate").mean)
    assert often.last("estimate").covariance == pytest.approx(seldom.last("estimate").covariance)


def test_estimator_starts_from_its_prior() -> None:
    harness = Harness(UnscentedEstimator("main.estimator"))
    harness.fire(0.1, trigger=0)
    assert harness.last("estimate").mean.tolist() == [10.0, 0.0, 0.0, 0.0]
    assert np.diag(harness.last("estimate").covariance).tolist() == [400.0, 400.0, 4.0, 4.0]


def measured(robot: str, time: float, x: float = 8.0) -> Measurement:
    return Measurement(robot, np.zeros(2), "relative_position", np.array([x, 1.0]), 0.2, 2.0, time)


def numbers(estimate: Estimate) -> list[object]:
    return [estimate.time, estimate.mean.tolist(), estimate.covariance.tolist()]


@pytest.mark.parametrize("make", [UnscentedEstimator, FilterPyEstimator])
def test_late_measurements_are_fused_at_their_own_time_to_the_last_bit(make: type) -> None:
    """In whatever order they come, and whether between triggers or at one, in the end nothing tells that they did."""
    random = np.random.default_rng(3)
    made = [measured(robot, tick / 10, 8.0 + random.normal()) for tick in range(12) for robot in ("a", "b", "c")]
    in_time, late = Harness(make("e")), Harness(make("e"))
    came = [(each.time + float(random.choice([0.0, 0.03, 0.1, 0.4, 0.75])), each) for each in made]
    for tick in range(20):
        now = tick / 10
        for between, each in came:
            if now - 0.1 < between - 1e-9 < now - 1e-3:
                late.fire(between, measurements=[each])
        late.fire(now, trigger=tick, measurements=[each for at, each in came if abs(at - now) < 1e-6])
        in_time.fire(now, trigger=tick, measurements=[each for each in made if each.time == now])
    assert [numbers(each) for each in late.tokens("estimate")[:8]] != [
        numbers(each) for each in in_time.tokens("estimate")[:8]
    ]
    assert numbers(late.last("estimate")) == numbers(in_time.last("estimate"))
    assert late.tokens("too_late") == []


@pytest.mark.parametrize("filter_name", FILTERS)
def test_every_filter_goes_back(filter_name: str) -> None:
    in_time, late = (Harness(FilterPyEstimator("e", filter=filter_name)) for _ in range(2))
    for tick in range(6):
        now = tick / 10
        in_time.fire(now, trigger=tick, measurements=[measured("a", now), measured("b", now, 9.0)])
        late.fire(now, trigger=tick, measurements=[measured("a", now), measured("b", now - 0.2, 9.0)][: 1 + (tick > 1)])
    for tick in (6, 7):
        late.fire(tick / 10, trigger=tick, measurements=[measured("b", tick / 10 - 0.2, 9.0)])
        in_time.fire(tick / 10, trigger=tick)
    assert late.last("estimate").mean == pytest.approx(in_time.last("estimate").mean, abs=1e-9)
    assert late.last("estimate").covariance == pytest.approx(in_time.last("estimate").covariance, abs=1e-9)
    assert late.last("estimate").sources == ("b",)


def test_a_measurement_between_two_triggers_is_fused_at_its_own_time() -> None:
    """As the kernels do it one after the other: prediction to its time, fusion, prediction to the trigger."""
    ukf = importlib.import_module("epicycle.actors.robotics.numerics.ukf")
    harness = Harness(UnscentedEstimator("e"))
    harness.fire(0.0, trigger=0)
    harness.fire(0.07, measurements=[measured("a", 0.04)])
    harness.fire(0.1, trigger=1)
    noise = np.diag([0.002, 0.002, 0.4, 0.4])
    row = np.array([[ukf.RELATIVE_POSITION, 0.0, 0.0, 8.0, 1.0, 0.2, 2.0]])
    prior = np.array([10.0, 0.0, 0.0, 0.0]), np.diag([400.0, 400.0, 4.0, 4.0])
    mean, covariance, _ = ukf.predict_and_fuse(
        *prior, ukf.constant_velocity(0.04), noise * (0.04 / 0.1), 0.0, row, True
    )
    mean, covariance = ukf.predict(mean, covariance, ukf.constant_velocity(0.06), noise * (0.06 / 0.1))
    assert harness.last("estimate").mean == pytest.approx(mean, abs=1e-12)
    assert harness.last("estimate").covariance == pytest.approx(covariance, abs=1e-12)
    assert harness.last("estimate").sources == ("a",)


@pytest.mark.parametrize("make", [UnscentedEstimator, FilterPyEstimator])
def test_what_comes_too_late_is_counted(make: type) -> None:
    harness = Harness(make("e", max_delay="300 ms"))
    for tick in range(1, 6):
        harness.fire(tick / 10, trigger=tick, measurements=[measured("a", tick / 10)])
    before = harness.last("estimate")
    harness.fire(0.5, microstep=2, trigger=6, measurements=[measured("b", 0.1), measured("c", 0.2)])
    assert harness.last("estimate").sources == ("c",)
    assert harness.last("estimate").mean.tolist() != before.mean.tolist()
    assert harness.sent["too_late"] == [(0.5, 1)]
    harness.fire(0.55, measurements=[measured("b", 0.1), measured("b", 0.2), measured("b", 0.3)])
    harness.fire(0.6, trigger=7, measurements=[measured("b", 0.299)])
    assert harness.last("estimate").sources == ("b",)
    assert harness.sent["too_late"] == [(0.5, 1), (0.55, 3), (0.6, 4)]


def test_it_remembers_no_more_than_it_may_need() -> None:
    """Waiting measurements are bounded, too, though the trigger that they wait for should never come."""
    harness = Harness(UnscentedEstimator("e", max_delay=1.0))
    for tick in range(100):
        harness.fire(tick / 10, trigger=tick, measurements=[measured("a", tick / 10)])
    assert len(harness.actor._history.steps) == 11
    for tick in range(100, 200):
        harness.fire(tick / 10, measurements=[measured("a", tick / 10)])
    assert len(harness.actor._history._waiting) == 11
    assert harness.last("too_late") == 89


def test_a_copy_is_not_fused_again_and_the_future_is_now() -> None:
    harness, plain = (Harness(UnscentedEstimator("e")) for _ in range(2))
    plain.fire(0.0, trigger=0, measurements=[measured("a", 0.0)])
    harness.fire(0.0, trigger=0, measurements=[measured("a", 5.0), measured("a", 5.0)])
    assert numbers(harness.last("estimate")) == numbers(plain.last("estimate"))
    plain.fire(0.1, trigger=1)
    harness.fire(0.1, trigger=1, measurements=[measured("a", 0.0)])
    assert numbers(harness.last("estimate")) == numbers(plain.last("estimate"))
    assert harness.last("estimate").sources == ()


def test_estimate_and_measurement_are_of_the_time_of_what_they_describe() -> None:
    sensor, estimator = Harness(Sensor("main.sensor")), Harness(UnscentedEstimator("main.estimator"))
    sensor.fire(0.35, robot=body(0.0, 0.0, 0.3), target=body(3.0, 4.0, 0.31))
    assert sensor.last("measurement").time == 0.3
    estimator.fire(0.4, trigger=0, measurements=[sensor.last("measurement")])
    assert estimator.last("estimate").time == 0.4


@pytest.mark.parametrize("make", [UnscentedEstimator, FilterPyEstimator])
def test_order_of_arrival_is_immaterial_to_the_last_bit(make: type) -> None:
    measurements = [
        Measurement(name, np.array([x, 1.0]), "relative_position", np.array([12.0 - x, 2.0]), 0.2, 2.0, 0.0)
        for name, x in (("a", 0.0), ("b", 5.0), ("c", 30.0), ("a", 9.0))
    ]
    found = set()
    for order in permutations(measurements):
        harness = Harness(make("e"))
        harness.fire(0.0, trigger=0, measurements=list(order))
        found.add((harness.last("estimate").mean.tobytes(), harness.last("estimate").covariance.tobytes()))
        assert harness.last("estimate").sources == ("a", "b", "c")
    assert len(found) == 1


@pytest.mark.parametrize("make", [UnscentedEstimator, FilterPyEstimator])
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e200])
def test_estimator_never_sends_what_is_not_finite(make: type, bad: float) -> None:
    harness = Harness(make("e"))
    kind, origin, near = "relative_position", np.zeros(2), np.array([12.0, 2.0])
    for step, measurement in enumerate(
        [
            Measurement("a", origin, kind, near, 0.2, 2.0, 0.0),
            Measurement("b", origin, kind, np.array([bad, 0.0]), 0.2, 2.0, 0.1),
            Measurement("b", np.array([0.0, bad]), kind, origin, 0.2, 2.0, 0.2),
            Measurement("b", np.array([1.5e308, 0.0]), kind, np.array([1.5e308, 0.0]), 0.2, 2.0, 0.3),
            Measurement("a", origin, kind, near, 0.2, 2.0, 0.4),
        ]
    ):
        harness.fire(step / 10, trigger=step, measurements=[measurement])
        assert harness.last("estimate").finite
    if not np.isfinite(bad):
        assert [each.sources for each in harness.tokens("estimate")] == [("a",), (), (), (), ("a",)]


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # NumPy's, of what is beyond a float
@pytest.mark.parametrize("filter_name", FILTERS)
@pytest.mark.parametrize("huge", [1e100, 1e155, 1e160, 1e308])
@pytest.mark.parametrize("where", ["value", "observer", "prior_mean", "prior_variance"])
def test_filterpy_does_not_end_a_run_for_huge_numbers(filter_name: str, huge: float, where: str) -> None:
    """NumPy and SciPy raise where a covariance is not finite, or is no longer one for its rounding."""
    given = {where: [huge] * 4} if where.startswith("prior") else {}
    harness = Harness(FilterPyEstimator("e", filter=filter_name, **given))
    for step in range(5):
        told = {"value": np.array([12.0, 2.0]), "observer": np.zeros(2)}
        if step == 2 and where in told:
            told[where] = np.array([huge, -huge])
        seen = Measurement("a", told["observer"], "relative_position", told["value"], 0.2, 2.0, step / 10)
        harness.fire(step / 10, trigger=step, measurements=[seen])
        assert harness.last("estimate").finite


@pytest.mark.parametrize("filter_name", FILTERS[2:])
def test_an_error_of_a_sensor_is_not_taken_for_one_of_filterpy(filter_name: str) -> None:
    class Broken(SensorModel):
        """Knows no place."""

        def h(self, target: object, observer: object) -> object:
            raise ValueError("no such place")

        def noise(self, target: object, observer: object) -> object:
            return [[1.0]]

    harness = Harness(FilterPyEstimator("e", filter=filter_name))
    seen = Observation("a", np.zeros(2), "Broken", np.zeros(1), 0.0, 0.0, 0.0, Broken(), np.zeros(4))
    with pytest.raises(ValueError, match=r"^no such place$"):
        harness.fire(0.0, trigger=0, measurements=[seen])


@pytest.mark.parametrize("filter_name", FILTERS)
def test_filterpy_is_near_ours(filter_name: str) -> None:
    ours = drive(Harness(UnscentedEstimator("e")), 60)
    theirs = drive(Harness(FilterPyEstimator("e", filter=filter_name)), 60)
    # Relative positions are linear: only rounding differs, from the first huge prior on.
    assert theirs[:, 0] == pytest.approx(ours[:, 0], abs=1e-6)


@pytest.mark.parametrize("filter_name", FILTERS[2:])
def test_filterpy_with_ranges_is_near_ours(filter_name: str) -> None:
    prior = {"prior_mean": [12, 2, 0, 0], "prior_variance": [4, 4, 4, 4]}
    ours = drive(Harness(UnscentedEstimator("e", **prior)), 60, kind="range")
    theirs = drive(Harness(FilterPyEstimator("e", filter=filter_name, **prior)), 60, kind="range")
    assert np.hypot(*(theirs[10:, 0, :2] - ours[10:, 0, :2]).T).max() < 0.2


@pytest.mark.parametrize("filter_name", FILTERS[:2])
def test_linear_filter_with_ranges_is_an_error_with_a_way_out(filter_name: str) -> None:
    harness = Harness(FilterPyEstimator("main.estimator", filter=filter_name))
    measurement = Measurement("a", np.zeros(2), "range", np.array([5.0]), 0.2, 2.0, 0.0)
    with pytest.raises(FilterError, match=r"main\.estimator: .*ExtendedKalmanFilter"):
        harness.fire(0.0, trigger=0, measurements=[measurement])
