"""Several targets: bodies that come and go, sensors that cannot tell them apart, the tracker, and how it is judged."""

import importlib
import math

import numpy as np
import pytest
from scipy.stats import binom, chi2, kstest, poisson

from epicycle.actors import (
    BodyState,
    ClearanceMonitor,
    Detections,
    EpicycleError,
    Estimate,
    JPDATracker,
    MultiTargetSensor,
    TrackingError,
    Tracks,
    WaypointMotion,
)
from epicycle.actors.testing import Harness

ORIGIN = (0.0, 0.0)


def body(x: float, y: float, time: float = 0.0) -> BodyState:
    return BodyState((x, y), ORIGIN, time)


def scan(
    *places: tuple[float, float], time: float = 0.0, robot: str = "main", observer: tuple[float, float] = ORIGIN,
    deviation: float = 0.1, **changed: object,
) -> Detections:  # fmt: skip
    """What a good sensor at ``observer`` sees of bodies at ``places``."""
    values = np.array(places, dtype=float).reshape(len(places), 2) - observer
    fields = {
        "robot": robot, "observer": observer, "kind": "relative_position", "values": values, "along": deviation,
        "across": deviation, "probability": 0.9, "clutter": 0.1, "max_range": 50.0, "time": time, **changed,
    }  # fmt: skip
    return Detections(**fields)


def track(*scans: list[Detections], **parameters: object) -> Harness:
    """A tracker that is triggered ten times a second, with some scans each time."""
    harness = Harness(JPDATracker("main.tracker", **{"velocity_noise": 0.01, **parameters}))
    for tick, each in enumerate(scans):
        harness.fire(tick / 10, trigger=tick, detections=each)
    return harness


def numbers(harness: Harness) -> list[tuple[int, ...]]:
    return [each.numbers for each in harness.tokens("tracks")]


# --- bodies ---------------------------------------------------------------------------------------------------------


def test_a_body_appears_moves_and_leaves() -> None:
    harness = Harness(WaypointMotion("body", waypoints=[[0, 0], [3, 4], [3, 6]], speed=2.0, appears=1.0, leaves=6.0))
    for second in range(8):
        harness.fire(float(second), trigger=second)
    states = harness.tokens("state")
    assert [each.time for each in states] == [1.0, 2.0, 3.0, 4.0, 5.0]
    expected = [(0, 0), (1.2, 1.6), (2.4, 3.2), (3, 5), (3, 6)]
    assert np.array([each.position for each in states]) == pytest.approx(np.array(expected, dtype=float))
    assert states[0].velocity == pytest.approx([1.2, 1.6])
    assert states[3].velocity == pytest.approx([0.0, 2.0])
    assert states[4].velocity.tolist() == [0.0, 0.0]


def test_a_body_that_repeats_its_way() -> None:
    harness = Harness(WaypointMotion("body", waypoints=[[0, 0], [4, 0], [0, 0]], repeats=True))
    for second in range(12):
        harness.fire(float(second), trigger=second)
    places = [each.position[0] for each in harness.tokens("state")]
    assert places == pytest.approx([0, 1, 2, 3, 4, 3, 2, 1, 0, 1, 2, 3])


def test_a_body_needs_a_place() -> None:
    with pytest.raises(EpicycleError, match="needs at least one waypoint"):
        WaypointMotion("body", waypoints=np.empty((0, 2)))
    still = Harness(WaypointMotion("body", waypoints=[[1, 2]], repeats=True))
    still.fire(5.0, trigger=0)
    assert still.last("state").position.tolist() == [1.0, 2.0]


# --- sensor ---------------------------------------------------------------------------------------------------------


def sense(count: int, *targets: tuple[float, float], **parameters: object) -> list[Detections]:
    harness = Harness(MultiTargetSensor("main.sensor", **parameters), widths={"targets": len(targets)})
    for step in range(count):
        bodies = [body(*each) for each in targets]
        harness.fire(step / 10, robot=body(1.0, 2.0, step / 10), targets=bodies)
    return harness.tokens("detections")


def test_how_often_a_body_is_detected_and_with_what_noise() -> None:
    scans = sense(2000, (4.0, 6.0), (1.0, 50.0), detection_probability=0.7)
    seen = np.array([each.values[0] for each in scans if len(each.values)])
    assert {len(each.values) for each in scans} == {0, 1}  # the other one is out of range
    assert binom.ppf(0.0005, 2000, 0.7) <= len(seen) <= binom.ppf(0.9995, 2000, 0.7)
    errors = (seen - [3.0, 4.0]) @ np.array([[0.6, 0.8], [-0.8, 0.6]]).T / [0.2, 2.0]  # along, across
    low, high = chi2.ppf([0.0005, 0.9995], len(seen))
    for component in errors.T:
        assert low <= (component**2).sum() <= high


@pytest.mark.parametrize("kind", ["relative_position", "range"])
def test_clutter_is_poisson_and_uniform(kind: str) -> None:
    scans = sense(1000, kind=kind, clutter=3.0, max_range=20.0)
    counts = np.array([len(each.values) for each in scans])
    assert poisson.ppf(0.0005, 3000) <= counts.sum() <= poisson.ppf(0.9995, 3000)
    assert counts.var() == pytest.approx(3.0, rel=0.15)
    values = np.concatenate([each.values for each in scans])
    assert values.shape[1] == (1 if kind == "range" else 2)
    shares = values[:, 0] / 20.0 if kind == "range" else (values**2).sum(axis=1) / 400.0
    assert kstest(shares, "uniform").pvalue > 0.001
    assert scans[0].clutter_density == pytest.approx(3.0 / (20.0 if kind == "range" else 400.0 * math.pi))


def test_the_order_of_a_scan_says_nothing() -> None:
    ways = sense(50, (9.0, 0.0), (-9.0, 0.0), clutter=2.0)
    assert all(each.values.tolist() == sorted(each.values.tolist()) for each in ways)


def test_a_body_that_is_gone_changes_nothing_about_the_others() -> None:
    def seen(gone: bool) -> list[list[float]]:
        harness = Harness(MultiTargetSensor("main.sensor", detection_probability=0.5), widths={"targets": 2})
        found = []
        for step in range(30):
            bodies = [None if gone else body(-20.0, 0.0), body(5.0, 0.0)]
            harness.fire(step / 10, robot=body(0.0, 0.0), targets=bodies)
            found.append([each for each in harness.last("detections").values.tolist() if each[0] > -10.0])
        return found

    assert seen(gone=True) == seen(gone=False)


def test_scans_that_cannot_be_used() -> None:
    good = scan((1.0, 2.0))
    assert good.finite
    assert scan().finite
    for field, bad in {
        "values": np.zeros((1, 3)), "kind": "range", "along": 0.0, "across": -1.0, "probability": 1.5,
        "clutter": -1.0, "max_range": 0.0, "time": math.inf,
    }.items():  # fmt: skip
        assert not scan((1.0, 2.0), **{field: bad}).finite
    harness = track([scan((1.0, 2.0), time=math.nan)], [scan((1.0, 2.0), clutter=math.inf)])
    assert numbers(harness) == [(), ()]


# --- tracker --------------------------------------------------------------------------------------------------------


def test_a_track_is_confirmed_and_ends() -> None:
    """Three hits confirm it, and it ends when misses have made it unlikely: known answers, in clear sight."""
    scans = [[scan(*([(10.0, 0.0)] if tick < 10 else []), time=tick / 10)] for tick in range(20)]
    harness = track(*scans)
    told = numbers(harness)
    assert told[:10] == [(), ()] + [(1,)] * 8
    # The odds were at most lifetime / period = 300, and each miss divides them by nearly ten.
    assert told[10:14] == [(1,)] * 3 + [()]
    assert told[14:] == [()] * 6
    last = harness.tokens("tracks")[9].estimates[0]
    assert last.mean[:2] == pytest.approx([10.0, 0.0], abs=1e-6)
    assert last.sources == ("main",)
    assert harness.tokens("confirmed") == [len(each) for each in told]


def test_between_scans_a_track_moves_on_and_spreads() -> None:
    """As a Kalman filter predicts it, with the noise of one period for each."""
    scans = [[scan((10.0, 0.1 * tick), time=tick / 10)] for tick in range(5)]
    harness = track(*scans, [], [], position_noise=0.25, velocity_noise=0.5)
    before, *after = (told.estimates[0] for told in harness.tokens("tracks")[4:])
    mean, covariance, transition = before.mean, before.covariance, np.eye(4) + 0.1 * np.eye(4, k=2)
    for each in after:
        mean, covariance = transition @ mean, transition @ covariance @ transition.T + np.diag([0.25, 0.25, 0.5, 0.5])
        assert each.mean == pytest.approx(mean)
        assert each.covariance == pytest.approx(covariance)


def test_two_hits_of_four_are_not_enough() -> None:
    """A detection, two misses and so on: with M = 3 of N = 4 nothing is ever confirmed; with M = 1, at once."""
    scans = [[scan(*([(10.0, 0.0)] if tick % 3 == 0 else []), time=tick / 10)] for tick in range(12)]
    assert set(numbers(track(*scans))) == {()}
    eager = track(*scans, confirm_hits=1, confirm_steps=1, confirm_probability=0.0)
    assert numbers(eager)[0] == (1,)
    patient = track(*scans, confirm_hits=3, confirm_steps=9)
    assert (1,) in numbers(patient)


def test_who_could_not_see_it_does_not_count() -> None:
    """A second sensor, 100 m away, neither confirms nor ends anything."""
    near = [[scan((10.0, 0.0), time=tick / 10)] for tick in range(6)]
    both = [[*each, scan(time=tick / 10, robot="far", observer=(100.0, 0.0))] for tick, each in enumerate(near)]
    alone, together = track(*near), track(*both)
    assert numbers(alone) == numbers(together)
    for one, other in zip(alone.tokens("tracks"), together.tokens("tracks"), strict=True):
        assert [each.mean.tolist() for each in one.estimates] == [each.mean.tolist() for each in other.estimates]


def test_obstacles_that_cross_keep_their_tracks() -> None:
    """Two of them meet head on; a number stays with its body, and both are tracked to a decimetre."""

    def places(tick: int) -> list[tuple[float, float]]:
        return [(10.0 - 0.2 * tick + 2.0, 0.3), (8.0 + 0.2 * tick - 2.0, -0.3)]

    random = np.random.default_rng(4)
    scans = []
    for tick in range(40):
        noisy = [tuple(np.add(place, random.normal(scale=0.1, size=2))) for place in places(tick)]
        scans.append([scan(*sorted(noisy), time=tick / 10)])
    harness = track(*scans, velocity_noise=0.001)
    nearest = []
    for tick in (8, 39):
        told = harness.tokens("tracks")[tick]
        assert told.numbers == (1, 2)
        errors = np.array([[math.dist(each.mean[:2], place) for place in places(tick)] for each in told.estimates])
        nearest.append(errors.argmin(axis=1).tolist())
        assert errors.min(axis=1).max() < 0.2
    assert sorted(nearest[0]) == [0, 1]
    assert nearest[0] == nearest[1]


def test_the_order_of_arrival_has_no_influence() -> None:
    random = np.random.default_rng(5)

    def ticks(turned: bool) -> list[list[Detections]]:
        return [each[::-1] if turned else each for each in scans]

    scans = [
        [
            scan(*random.normal((8.0, 3.0), 0.3, size=(3, 2)), time=tick / 10, robot=robot, observer=(place, 0.0))
            for robot, place in (("a", 0.0), ("b", 5.0), ("c", 9.0))
        ]
        for tick in range(10)
    ]
    assert same(track(*ticks(False)), track(*ticks(True)))


def same(one: Harness, other: Harness, since: int = 0) -> bool:
    """Whether two trackers say the same, to the bit."""

    def words(harness: Harness) -> list[object]:
        return [
            (each.numbers, [(e.mean.tobytes(), e.covariance.tobytes(), e.time) for e in each.estimates])
            for each in harness.tokens("tracks")[since:]
        ]

    return words(one) == words(other)


def test_late_scans_are_fused_at_their_time() -> None:
    """Scans that come 0.3 s late: from then on, tracks are those of a tracker that got them in time."""
    random = np.random.default_rng(6)
    own = [[scan((10 + 0.1 * tick, 0.0), time=tick / 10)] for tick in range(12)]
    others = [
        scan((10 + 0.1 * tick, 0.0), (20.0, 5.0), tuple(random.uniform(-9, 9, size=2)), time=tick / 10, robot="b")
        for tick in range(9)
    ]
    punctual = track(*[[*each, *others[tick : tick + 1]] for tick, each in enumerate(own)])
    late = track(*[[*each, *(others[tick - 3 : tick - 2] if tick >= 3 else [])] for tick, each in enumerate(own)])
    assert len(punctual.tokens("tracks")[-1].numbers) == 2
    assert not same(punctual, late)
    assert same(punctual, late, since=11)
    copied = track(*[[*each, *others[tick : tick + 1] * 3] for tick, each in enumerate(own)])
    assert same(punctual, copied)


@pytest.mark.parametrize("other", ["a", "z"])
def test_a_late_scan_changes_no_number(other: str) -> None:
    """Another robot has seen a second body before the first, and it has seen the first one, too.

    All its scans come at once: then the second body's track would have been confirmed first, and the scans of the robot
    that is the first by name would have begun the first one's.
    """
    own = [[scan((10.0, 0.0), time=tick / 10)] if tick > 2 else [] for tick in range(12)]
    late = [scan((20.0, 5.0), *([(10.0, 0.0)] if tick > 2 else []), time=tick / 10, robot=other) for tick in range(8)]
    own[8].extend(late)
    told = track(*own).tokens("tracks")
    assert told[7].numbers == (1,)
    assert told[8].numbers == (1, 2)
    assert [round(float(each.mean[0])) for each in told[8].estimates] == [10, 20]
    assert told[-1].numbers == (1,)  # nobody sees the second body any longer


@pytest.mark.parametrize("seed", [4, 6, 12, 19, 45])
def test_a_number_stays_with_its_body_however_late_scans_are(seed: int) -> None:
    """Four bodies appear within a second, and the scans of three robots are up to half a second late."""
    random = np.random.default_rng(seed)
    places = np.array([(10.0, 0.0), (16.0, 2.0), (10.0, 8.0), (18.0, 10.0)])
    coming: dict[int, list[Detections]] = {}
    for tick in range(60):
        present = places[: 1 + tick // 3] + np.array((0.05 * tick, 0.0))
        for robot in "abc":
            seen = present[random.random(len(present)) < 0.8] + random.normal(0.0, 0.1, size=2)
            clutter = random.uniform(-20.0, 20.0, size=(random.poisson(0.3), 2))
            found = scan(*seen, *clutter, time=tick / 10, robot=robot, probability=0.8, clutter=0.3)
            coming.setdefault(tick + int(random.integers(0, 6)), []).append(found)
    told = track(*[coming.get(tick, []) for tick in range(60)]).tokens("tracks")
    bodies: dict[int, int] = {}
    for tick, each in enumerate(told):
        assert list(each.numbers) == sorted(set(each.numbers))
        for number, estimate in zip(each.numbers, each.estimates, strict=True):
            away = np.linalg.norm(places + np.array((0.05 * tick, 0.0)) - estimate.mean[:2], axis=1)
            if away.min() < 1.5:  # it is not clutter's
                assert bodies.setdefault(number, int(away.argmin())) == away.argmin(), (tick, number)
    assert sorted(bodies.values()) == [0, 1, 2, 3]


def test_scans_that_come_too_late_are_counted() -> None:
    harness = track([], [], [], max_delay=0.15)
    harness.fire(0.5, detections=[scan(time=0.3), scan((1.0, 1.0), time=0.2), scan(time=0.4)])
    assert harness.tokens("too_late") == [2]
    harness.fire(0.6, trigger=6)  # the third one has waited for too long
    assert harness.tokens("too_late") == [2, 3]
    assert harness.tokens("approximated") == []


def test_ranges_keep_a_track_but_begin_none() -> None:
    ranges = [
        Detections("b", (10.0, 10.0), "range", [[10.0]], 0.1, 0.1, 0.9, 0.1, 50.0, tick / 10) for tick in range(30)
    ]
    assert set(numbers(track(*[[each] for each in ranges]))) == {()}
    harness = track(*[[scan((10.0, 0.0), time=tick / 10)] if tick < 5 else [ranges[tick]] for tick in range(30)])
    assert numbers(harness)[-1] == (1,)
    # From there, a range tells how far it is, which is y, and little about x.
    spread = harness.last("tracks").estimates[0].covariance
    assert spread[1, 1] < 0.1 < spread[0, 0]


def test_tracks_are_limited_and_uncertain_ones_end() -> None:
    places = [(3.0 * place, 20.0) for place in range(10)]
    harness = track(*[[scan(*places, time=tick / 10)] for tick in range(5)], max_tracks=4)
    assert numbers(harness)[-1] == (1, 2, 3, 4)
    blind = [[scan((10.0, 0.0), time=tick / 10)] if tick < 5 else [] for tick in range(200)]
    told = numbers(track(*blind, max_deviation=3.0))
    assert told[6] == (1,)
    assert told[-1] == ()


def test_two_tracks_of_one_target_become_one() -> None:
    """Two sensors that disagree by a metre until one of them is corrected."""

    def scans(tick: int) -> list[Detections]:
        off = 4.0 if tick < 5 else 0.0
        return [
            scan((10.0, 0.0), time=tick / 10, probability=0.6),
            scan((10.0, off), time=tick / 10, robot="off", probability=0.6),
        ]

    told = numbers(track(*[scans(tick) for tick in range(40)]))
    assert told[4] == (1, 2)
    assert told[-1] == (1,)


def test_too_many_tracks_at_one_place_are_approximated() -> None:
    """Beyond 2^tracks (1 + detections) = 131,072, and the count says so."""
    places = [(2.0 * (place % 5), 20.0 + 2.0 * (place // 5)) for place in range(20)]
    crowd = [scan(*places, time=tick / 10, deviation=0.8, clutter=0.0) for tick in range(4)]
    harness = track(*[[each] for each in crowd], confirm_probability=0.5, merge_distance=0.0)
    assert harness.tokens("approximated")[-1] > 0
    assert len(harness.last("tracks").numbers) > 10


def test_numbers_of_tracks_that_no_scan_can_bring_back_are_forgotten() -> None:
    """Or a tracker would need more and more memory: here a body comes and goes every three seconds."""
    harness = track(*[[scan((10.0 * (tick // 30), 20.0), time=tick / 10)] for tick in range(150)])
    told = sorted({number for each in numbers(harness) for number in each})
    assert told == [1, 2, 3, 4, 5]
    assert list(harness.actor._numbers.values()) == [5]


# --- what judges them -----------------------------------------------------------------------------------------------


def test_the_tracking_error() -> None:
    harness = Harness(TrackingError("error", cutoff=5.0), widths={"bodies": 3})
    tracks = Tracks((1, 4), tuple(Estimate((x, 0.0, 0.0, 0.0), np.eye(4), 0.0) for x in (1.0, 40.0)), 0.0)
    harness.fire(0.0, bodies=[body(0.0, 0.0), None, body(20.0, 0.0)], tracks=tracks)
    assert harness.last("gospa") == pytest.approx(math.sqrt(1.0 + 12.5 + 12.5))
    assert (harness.last("error"), harness.last("missed"), harness.last("false")) == (1.0, 1, 1)
    harness.fire(0.1, tracks=Tracks((), (), 0.1))
    assert (harness.last("gospa"), harness.last("missed"), harness.last("false")) == (0.0, 0, 0)
    assert len(harness.tokens("error")) == 1


def test_the_clearance() -> None:
    harness = Harness(ClearanceMonitor("clearance"), widths={"others": 2})
    harness.fire(0.0, body=body(0.0, 0.0), others=[body(3.0, 4.0), body(0.0, 9.0)])
    harness.fire(0.1, body=body(0.0, 0.0), others=[None, body(0.0, 9.0)])
    harness.fire(0.2, body=body(0.0, 0.0))
    assert harness.tokens("distance") == [5.0, 9.0]


def test_nothing_is_compiled_while_a_tracker_runs() -> None:
    events = importlib.import_module("numba.core.event")
    track([scan((10.0, 0.0))])
    with events.install_recorder("numba:compile") as compiled:
        track(*[[scan((10.0, 0.0), (12.0, 1.0), time=tick / 10)] for tick in range(5)])
    assert not compiled.buffer
