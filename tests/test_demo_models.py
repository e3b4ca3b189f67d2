"""The packaged demo models do what theory says, sample by sample where that can be said, else within 99 %."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.signal
import scipy.stats
import simpy

from epicycle.runner import Simulation, load_model
from epicycle.runner.execution.engine import LoopError
from epicycle.runner.model.build.figures import figures_of
from epicycle.runner.model.text.problems import Problems
from tests.demo_models import run


def interval(samples: list[float]) -> tuple[float, float]:
    """The 99 % confidence interval of the mean of independent replications."""
    error = scipy.stats.sem(samples) * scipy.stats.t.ppf(0.995, len(samples) - 1)
    return float(np.mean(samples) - error), float(np.mean(samples) + error)


def assert_within(samples: list[float], theory: float, sharpness: float) -> None:
    """Theory lies in the interval, which is narrow enough for that to mean something."""
    low, high = interval(samples)
    assert low <= theory <= high
    assert high - low < 2 * sharpness * theory


def waits(name: str, seed: int, until: float, **settings: Any) -> float:
    """The mean wait of a run after it has settled."""
    wait = run(name, seed, until, **settings).signals["wait.output"]
    return float(np.mean(wait.values[wait.times > 0.1 * until]))


# -- queues ---------------------------------------------------------------------------------------------------------


def test_waits_obey_lindleys_equation() -> None:
    """Whoever comes waits for what the one before had still to wait and to be served: W' = max(0, W + S - A)."""
    results = run("mm1", 3, 600.0, keep_log=True)
    records = [record for record in results.log.records if record.event == "send"]
    arrivals = [record.tag.seconds for record in records if record.actor == "customers"]
    services = [record.value for record in records if record.actor == "service"]
    wait, expected = 0.0, [0.0]
    for gap, service in zip(np.diff(arrivals), services, strict=False):
        wait = max(0.0, wait + service - gap)
        expected.append(wait)
    found = results.signals["wait.output"].values
    assert len(found) > 400
    # Services are rounded to whole nanoseconds, and the roundings of a busy period add up.
    assert found == pytest.approx(expected[: len(found)], abs=1e-6)


def test_number_in_the_system_is_the_integral_over_all_stays() -> None:
    """Little's law as an identity: mean number x time is the sum of the times that customers are there."""
    results = run("mm1", 4, 500.0, keep_log=True, warm_up=0)
    sends = [record for record in results.log.records if record.event == "send"]
    comes = [record.tag.time for record in sends if record.actor == "customers"]
    leaves = [record.tag.time for record in sends if (record.actor, record.port) == ("server", "output")]
    end = 500 * 10**9  # the stop time, which no event falls on
    stays = sum(leaves) + end * (len(comes) - len(leaves)) - sum(comes)
    assert results.metrics["mean_number"] == stays / end


def test_mm1_waits_as_long_as_theory_says() -> None:
    load = 0.6
    samples = [waits("mm1", seed, 1200.0, load=load) for seed in range(16)]
    assert_within(samples, load / (1 - load), 0.2)


@pytest.mark.parametrize(("variation", "replications"), [(0.1, 12), (2.0, 24)])
def test_mg1_waits_as_long_as_pollaczek_and_khinchine_say(variation: float, replications: int) -> None:
    load = 0.5
    samples = [waits("mg1", seed, 1000.0, load=load, variation=variation) for seed in range(replications)]
    assert_within(samples, load / (1 - load) * (1 + variation) / 2, 0.35)


# -- SimPy's examples -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("washers", [1, 2])
def test_car_wash_does_what_plain_simpy_does(washers: int) -> None:
    results = run("car_wash", 7, washers=washers)
    environment = simpy.Environment()
    wash = simpy.Resource(environment, washers)
    begun, done = [], []

    def car(arrival: float) -> Any:
        yield environment.timeout(arrival)
        with wash.request() as request:
            yield request
            begun.append(environment.now)
            yield environment.timeout(300.0)
            done.append(environment.now)

    arrivals = results.signals["arrival.output"].times
    for arrival in arrivals:
        environment.process(car(float(arrival)))
    environment.run(until=8 * 3600 + 1e-6)
    assert len(done) > 60
    assert results.signals["wash.begun"].times == pytest.approx(begun, abs=1e-6)
    assert results.signals["wash.output"].times == pytest.approx(done, abs=1e-6)
    gaps = np.diff(arrivals[4:])
    assert gaps.min() >= 300
    assert gaps.max() <= 540


def running_machines(machines: int, ratio: float) -> float:
    """The mean number of machines that run with one repairman and repairs of one length (Ashcroft 1950).

    ``ratio`` is the repair time over the mean time to failure.
    """
    factors = np.cumprod([1.0, *(math.expm1(k * ratio) for k in range(1, machines))])
    repairs = sum(math.comb(machines - 1, k) * factors[k] for k in range(machines))
    return float(machines * repairs / (1 + machines * ratio * repairs))


def test_machine_shop_has_as_many_machines_broken_as_theory_says() -> None:
    assert running_machines(1, 0.1) == pytest.approx(1 / 1.1)
    # Parts do not matter for this, and take time to simulate.
    day = 86_400.0
    samples = [run("machine_shop", seed, 14 * day, part_time="300 min").metrics["mean_broken"] for seed in range(8)]
    assert_within(samples, 10 - running_machines(10, 0.1), 0.15)


def test_machines_make_parts_as_long_as_they_run() -> None:
    results = run("machine_shop", 5, part_spread="0.001 min")
    metrics = results.metrics
    running = 10 - metrics["mean_broken"]
    assert metrics["parts"] == pytest.approx(running * results.end / 600, rel=0.002)


def test_parts_that_take_no_time_come_to_an_end() -> None:
    # So wide a distribution gives nothing but zeros.  Made within one firing, such parts would fill the memory.
    with pytest.raises(LoopError, match=r"^time stands still at 0 s: more than 100,000 microsteps"):
        run("machine_shop", machines=1, part_spread="1e20 min")


# -- the others -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("variation", [0.04, 1.0])
def test_inspection_paradox(variation: float) -> None:
    runs = [run("inspection_paradox", seed, 2 * 86_400.0, variation=variation) for seed in range(10)]
    mean_square = 1 + variation  # E[X^2] / E[X]^2
    assert_within([each.metrics["mean_wait"] for each in runs], 10 * mean_square / 2, 0.25)
    assert_within([each.metrics["mean_gap_met"] for each in runs], 10 * mean_square, 0.25)
    assert_within([each.metrics["mean_gap_over_time"] for each in runs], 10 * mean_square, 0.25)
    assert_within([each.metrics["mean_gap"] for each in runs], 10, 0.25)


@pytest.mark.parametrize(("gain", "delay"), [(0.2, 3), (0.4, 2), (0.05, 0)])
def test_feedback_obeys_its_difference_equation(gain: float, delay: int) -> None:
    results = run("feedback", gain=gain, delay=f"{delay} s")
    levels, rate = [0.0], 0.0
    for step in range(60):
        if step >= delay:
            rate = gain * (1.0 - levels[step - delay])
        levels.append(levels[-1] + rate)
    assert results.signals["tank.level"].values == pytest.approx(levels, abs=1e-9)


@pytest.mark.parametrize("restitution", [0.8, 0.5])
def test_ball_bounces_when_the_closed_form_says(restitution: float) -> None:
    results = run("bouncing_ball", bounces=12, restitution=restitution)
    speed = math.sqrt(2 * 9.81 * 10)
    flights = [2 * speed * restitution**k / 9.81 for k in range(1, 12)]
    expected = speed / 9.81 + np.concatenate([[0.0], np.cumsum(flights)])
    assert results.signals["ball.bounce"].times == pytest.approx(expected, abs=5e-9)
    assert results.end == pytest.approx(expected[-1], abs=5e-9)
    height = results.signals["ball.height"]
    fall = height.times < expected[0]
    assert height.values[fall] == pytest.approx(10 - 9.81 / 2 * height.times[fall] ** 2, abs=1e-9)


# -- figures --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["car_wash", "feedback"])
def test_figures_are_drawn(name: str, tmp_path: Path) -> None:
    model = load_model(name)
    problems = Problems()
    figures = figures_of(model, problems)
    assert len(problems) == 0
    results = Simulation(model).run(until=60.0)
    for figure, drawn in figures.items():
        drawn.draw(results, tmp_path / f"{figure}.png")
        assert (tmp_path / f"{figure}.png").read_bytes().startswith(b"\x89PNG")


# -- modes ----------------------------------------------------------------------------------------------------------


def test_a_thermostat_switches_at_its_borders_as_often_as_the_formula_says() -> None:
    results = run("thermostat", swing=0, until=200_000)
    switches = results.signals["room.switch"].values
    assert switches == pytest.approx([21, 19] * (len(switches) // 2) + [21] * (len(switches) % 2), abs=1e-8)
    up, down = 7200 * math.log((35 - 19) / (35 - 21)), 7200 * math.log((21 - 5) / (19 - 5))
    first = 7200 * math.log((35 - 20) / (35 - 21))
    modes = results.signals["room.mode"]
    wanted, time = [0.0], first
    while time < 200_000:
        wanted.append(time)
        time += down if len(wanted) % 2 == 0 else up
    assert modes.times == pytest.approx(wanted, abs=1e-5)


def test_the_ball_leaves_the_table_and_falls_as_the_formula_says() -> None:
    results = run("bouncing_modes", slowest=0.05)
    modes = results.signals["ball.mode"]
    ways = list(zip(modes.times, modes.values, strict=True))
    off = next(time for time, mode in ways if mode == "off")
    assert off == pytest.approx(2 / 0.8, abs=1e-9)
    floor = [time for time, mode in ways if time > off]
    assert floor[0] - off == pytest.approx(math.sqrt(2 / 9.81), abs=2e-9)
    assert ways[-1][1] == "resting"
    assert results.metrics["reached"] == pytest.approx(0.8 * ways[-1][0], abs=1e-6)


def test_the_lights_are_never_green_for_both_and_pedestrians_wait_as_long_as_was_set() -> None:
    results = run("traffic_light", rate=1.0, seed=3)
    cars, walkers = results.signals["cars.mode"], results.signals["walkers.mode"]
    both = (("cars", cars), ("walkers", walkers))
    events = sorted((time, who, mode) for who, each in both for time, mode in zip(each.times, each.values, strict=True))
    state = {"cars": "green", "walkers": "red"}
    for _, who, mode in events:
        state[str(who)] = str(mode)
        assert not (state["cars"] in ("green", "asked", "yellow") and state["walkers"] != "red")
    greens = [time for time, mode in zip(cars.times, cars.values, strict=True) if mode == "green"]
    # With somebody always there: 30 s of green, 3 s of yellow, 12 s to walk, 4 s to clear, 2 s until it is told.
    assert min(np.diff(greens)) == pytest.approx(30 + 3 + 12 + 4 + 2, abs=1e-6)


def test_the_robot_charges_for_what_its_tour_took() -> None:
    modes = run("searching_robot").signals["robot.mode"]
    spent = {mode: np.diff(modes.times)[modes.values[:-1] == mode] for mode in ("returning", "charging")}
    assert len(spent["charging"]) >= 4
    for back, charge in zip(spent["returning"], spent["charging"], strict=False):
        assert charge == pytest.approx((0.99 - (0.2 - back / 200)) / 0.05, abs=1e-4)


# -- control and vehicles -------------------------------------------------------------------------------------------


def pid_loop_by_scipy(anti_windup: bool) -> tuple[Any, Any]:
    """The loop of the model, written down once more: times and positions every 5 ms, and the forces every 50 ms."""
    period, high, gains = 0.05, 4.5, (10.0, 10.0, 5.0)
    plant = scipy.signal.cont2discrete(tuple(map(np.array, ([[0, 1], [-4, -0.8]], [[0], [1]], [[1, 0]], [[0]]))), 0.005)
    a, b = plant[0], plant[1][:, 0]
    state, total, slope, before, error, driven = np.zeros(2), 0.0, 0.0, None, 0.0, False
    positions, forces, force = [], [], 0.0
    for k in range(4001):
        positions.append(state[0])
        if k % 10 == 0:
            y = state[0]
            if not (anti_windup and driven and k):
                total += gains[1] * period * error
            if before is not None:  # a lag of one period behind the derivative, which ramps from sample to sample
                q = math.exp(-1)
                slope = q * slope + gains[2] * (1 - q) * (before - y) / period
            before, error = y, 1 - y
            wanted = gains[0] * error + total + slope
            force = min(max(wanted, -high), high)
            driven = (wanted - force) * error > 0
            forces.append(force)
        state = a @ state + b * (force + (1.0 if k >= 2000 else 0.0))
    return np.array(positions), np.array(forces)


@pytest.mark.parametrize("anti_windup", ["clamping", "none"])
def test_pid_loop_moves_as_the_same_loop_written_with_scipy(anti_windup: str) -> None:
    results = run("pid_loop", **{"pid.anti_windup": anti_windup})
    positions, forces = pid_loop_by_scipy(anti_windup == "clamping")
    assert results.signals["load.output"].values == pytest.approx(positions, abs=1e-10)
    assert results.signals["pid.output"].values == pytest.approx(forces, abs=1e-8)
    times = np.arange(4001) * 0.005
    early = positions[times < 10]
    assert results.metrics["overshoot"] == pytest.approx(100 * max(early.max() - 1, 0), abs=1e-8)
    assert results.metrics["settled"] == times[: len(early)][np.abs(early - 1) > 0.02].max()
    assert abs(results.metrics["error"]) < 1e-6  # the integral part leaves none, whatever pushes
    assert results.signals["pid.output"].values[-1] == pytest.approx(4.0 - 1.0, abs=1e-6)


def test_anti_windup_takes_the_overshoot_away() -> None:
    clamped, wound = (run("pid_loop", **{"pid.anti_windup": each}).metrics for each in ("clamping", "none"))
    assert clamped["overshoot"] < 1
    assert wound["overshoot"] > 9
    assert clamped["settled"] < wound["settled"]


def test_without_limits_the_overshoot_is_that_of_the_damping_ratio() -> None:
    """A proportional controller makes 1 / (s^2 + 0.8 s + 4 + Kp) of the plant: exp(-pi d / sqrt(1 - d^2))."""
    settings = {"force": "1000 N", "proportional": "96 N/m", "integral": 0, "derivative": 0, "period": "5 ms"}
    position = run("pid_loop", until=9.0, push=0, **settings).signals["load.output"].values
    settled = 96 / 100
    damping = 0.4 / 10
    overshoot = math.exp(-math.pi * damping / math.sqrt(1 - damping**2))
    # Holding for 5 ms delays by 2.5 ms, which takes 10 * 0.0025 * 0.96 of the damping, and so much the overshoot grows.
    damping_held = (0.8 - 96 * 0.0025) / 20
    assert position.max() / settled - 1 > overshoot
    wanted = math.exp(-math.pi * damping_held / math.sqrt(1 - damping_held**2))
    assert position.max() / settled - 1 == pytest.approx(wanted, rel=0.01)


def test_the_car_stays_near_its_lines_and_arrives() -> None:
    results = run("waypoints")
    poses = results.signals["car.pose"].tokens
    assert np.hypot(*(poses[-1].position - [25, 30])) < 0.25
    assert results.signals["follower.passed"].values.tolist() == [0, 1, 2, 3, 4]
    # It steers no further than it can: nowhere is its path sharper than the wheels allow.
    turned = np.abs(np.diff([each.heading for each in poses]))
    driven = np.array([each.speed * 0.05 for each in poses[:-1]])
    assert (turned <= np.array([3 * 0.05, *driven[1:]]) * math.tan(math.radians(35)) / 2.5 + 1e-9).all()
    chords = [np.hypot(*(b.position - a.position)) for a, b in itertools.pairwise(poses)]
    assert results.metrics["travelled"] == pytest.approx(sum(chords), rel=1e-12)
    assert 20 + 15 + 20 + 15 + 25 - 6 < results.metrics["travelled"] < 95
    near, far = (run("waypoints", lookahead=f"{each} m").metrics for each in (4, 7))
    assert max(near["left"], -near["right"]) < 2.1 < max(far["left"], -far["right"])


def test_the_scanner_tells_how_near_the_car_comes() -> None:
    results = run("waypoints")
    pylons = np.array([[16, 6, 0.3], [4, 20, 0.3], [10, 28, 0.3]])
    for pose, told in zip(results.signals["car.pose"].tokens, results.signals["scanner.nearest"].values, strict=True):
        true = (np.hypot(*(pylons[:, :2] - pose.position).T) - pylons[:, 2]).min()
        # A beam every 5 degrees may miss the nearest pylon far away, and hits one near by a little further.
        assert told >= true - 1e-9
        if true < 2:
            assert told < true + 0.1
