"""What Stone Soup makes of the data of our runs: Kalman filter, JPDA, and its metrics.

A comparison runs a model with seeds 1, 2, ..., takes what its sensor sent from the recorded signals, gives it to
Stone Soup's filter or tracker, and measures the results of both with Stone Soup's own metrics.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

import epicycle
from epicycle.actors.robotics import Detections, Estimate, Measurement, Tracks
from epicycle.runner import Model, Results, Simulation
from epicycle.runner.study.inference import mean
from epicycle.runner.support.shown import rounded

START = datetime(2026, 1, 1)
NEAR = 5.0  # m, from which on an estimate is none of the target
METRICS = {
    "GOSPA": "least",
    "OSPA": "least",
    "SIAP completeness": "greatest",
    "SIAP ambiguity": "one",
    "SIAP spuriousness": "least",
    "SIAP position accuracy": "least",
}


@dataclass(frozen=True)
class Beside:
    """A number of Stone Soup's and one of ours."""

    asked: str
    theirs: str
    ours: str
    is_met: bool
    numbers: tuple[float, ...] = ()  # theirs, ours, and its interval


def compared(file: Path, kind: str, runs: int) -> Iterator[Beside]:
    """The comparisons of a model: of its ``filter`` or of its ``tracker``."""
    found = []
    for seed in range(1, runs + 1):
        model = epicycle.load(file)
        found.append((model, Simulation(model, seed=seed).run()))
    yield from (_filters if kind == "filter" else _trackers)(found)


# -- one target, measurements that come late ----------------------------------------------------------------------


def _filters(found: Sequence[tuple[Model, Results]]) -> Iterator[Beside]:
    """Position errors of the estimates at all triggers, and by how much the estimates differ at most."""
    errors: list[tuple[float, float]] = []
    apart = 0.0
    for model, results in found:
        theirs = _in_order(model, results)
        ours = [token.mean for token in results["filter.estimate"].tokens]
        truth = [token.position for token in results["target.state"].tokens]
        errors.append(
            (
                _rms([each[:2] - place for each, place in zip(theirs, truth, strict=True)]),
                _rms([each[:2] - place for each, place in zip(ours, truth, strict=True)]),
            )
        )
        apart = max(apart, *(float(np.abs(a - b).max()) for a, b in zip(theirs, ours, strict=True)))
    theirs_mean, ours_mean = (math.fsum(each) / len(errors) for each in zip(*errors, strict=True))
    asked = f"root mean square error of the position (m), mean of {len(errors)} runs; no estimate is 1e-6 apart"
    told = f"{ours_mean:.6f}" if apart <= 1e-6 else f"{ours_mean:.6f}; estimates are up to {apart:.2g} apart"
    yield Beside(asked, f"{theirs_mean:.6f}", told, apart <= 1e-6)


def _rms(errors: Sequence[Any]) -> float:
    return math.sqrt(math.fsum(float(each @ each) for each in errors) / len(errors))


def _in_order(model: Model, results: Results) -> list[Any]:
    """Stone Soup's estimate at each trigger, of all measurements that have come until then, in their order.

    It predicts from trigger to trigger, as our filter does: what the state gains in two periods depends on the steps.
    """
    from stonesoup.models.measurement.linear import LinearGaussian
    from stonesoup.predictor.kalman import KalmanPredictor
    from stonesoup.types.detection import Detection
    from stonesoup.types.hypothesis import SingleHypothesis
    from stonesoup.types.state import GaussianState
    from stonesoup.updater.kalman import KalmanUpdater

    own: Any = model.graph.actors["filter"]
    predictor = KalmanPredictor(_motion(own))
    arrived = results["arrived@filter.measurements"]
    came: list[tuple[float, Measurement]] = list(zip(arrived.times.tolist(), arrived.tokens, strict=True))
    found = []
    triggers = results["filter.estimate"].times.tolist()
    for number, now in enumerate(triggers, start=1):
        state: Any = GaussianState(own.prior_mean, np.diag(own.prior_variance), timestamp=START)
        for trigger in triggers[:number]:
            state = predictor.predict(state, timestamp=_at(trigger))
            for each in (each for time, each in came if time <= now and each.time == trigger):
                sensor = LinearGaussian(4, (0, 1), np.eye(2) * each.along**2)
                place = np.array(each.observer) + np.array(each.value)
                detection = Detection(place[:, np.newaxis], timestamp=_at(trigger), measurement_model=sensor)
                state = KalmanUpdater(sensor).update(SingleHypothesis(state, detection))
        found.append(np.asarray(state.state_vector, float).ravel())
    return found


def _motion(own: Any) -> Any:
    """Eq. (1) of a filter or tracker of ours, over one of its periods, as Stone Soup's model."""
    from stonesoup.models.transition.linear import LinearGaussianTransitionModel

    class Motion(LinearGaussianTransitionModel):  # type: ignore[misc, unused-ignore]
        """Constant velocity, with a noise that grows with the time."""

        ndim_state = 4

        def matrix(self, time_interval: timedelta, **others: Any) -> Any:
            matrix = np.eye(4)
            matrix[0, 2] = matrix[1, 3] = time_interval.total_seconds()
            return matrix

        def covar(self, time_interval: timedelta, **others: Any) -> Any:
            return own.process_noise() * (time_interval.total_seconds() / own.period)

    return Motion()


def _at(time: float) -> datetime:
    return START + timedelta(seconds=time)


# -- several targets in clutter -----------------------------------------------------------------------------------


def _trackers(found: Sequence[tuple[Model, Results]]) -> Iterator[Beside]:
    """Each metric, with Student's interval of the difference over the runs put around ours."""
    pairs = [(measured(_associated(*each), each[1]), measured(_of_ours(each[1]), each[1])) for each in found]
    for metric, best in METRICS.items():
        theirs, ours = ([each[metric] for each in some] for some in zip(*pairs, strict=True))
        cost: Callable[[float], float] = {
            "least": lambda value: value, "greatest": lambda value: -value, "one": lambda value: abs(value - 1.0),
        }[best]  # fmt: skip
        worse = mean([cost(b) - cost(a) for a, b in zip(theirs, ours, strict=True)])
        gap = mean([b - a for a, b in zip(theirs, ours, strict=True)])
        base, width = mean(theirs).value, gap.high - gap.low
        numbers = base, base + gap.value, base + gap.low, base + gap.high
        told, value, low, high = (rounded(each, width) for each in numbers)
        asked = f"{metric}, mean of {len(theirs)} runs"
        drawn = tuple(map(float, (told, value, low, high)))
        yield Beside(asked, told, f"{value} ({low} to {high})", worse.low <= 0.0, drawn)


def _of_ours(results: Results) -> list[Any]:
    """Our tracks as Stone Soup's."""
    from stonesoup.types.state import GaussianState
    from stonesoup.types.track import Track

    states: dict[int, list[Any]] = {}
    for token in results["tracker.tracks"].tokens:
        tracks: Tracks = token
        for number, each in zip(tracks.numbers, tracks.estimates, strict=True):
            estimate: Estimate = each
            state = GaussianState(np.array(estimate.mean), np.array(estimate.covariance), timestamp=_at(tracks.time))
            states.setdefault(number, []).append(state)
    return [Track(each) for each in states.values()]


def _associated(model: Model, results: Results) -> list[Any]:
    """Stone Soup's tracks of the scans of a run: JPDA, with tracks begun from three detections, as its tutorials do."""
    from stonesoup.dataassociator.neighbour import GNNWith2DAssignment
    from stonesoup.dataassociator.probability import JPDA
    from stonesoup.deleter.error import CovarianceBasedDeleter
    from stonesoup.functions import gm_reduce_single
    from stonesoup.hypothesiser.distance import DistanceHypothesiser
    from stonesoup.hypothesiser.probability import PDAHypothesiser
    from stonesoup.initiator.simple import MultiMeasurementInitiator
    from stonesoup.measures import Mahalanobis
    from stonesoup.models.measurement.linear import LinearGaussian
    from stonesoup.predictor.kalman import KalmanPredictor
    from stonesoup.types.array import StateVectors
    from stonesoup.types.detection import Detection
    from stonesoup.types.state import GaussianState
    from stonesoup.types.track import Track
    from stonesoup.types.update import GaussianStateUpdate
    from stonesoup.updater.kalman import KalmanUpdater

    own: Any = model.graph.actors["tracker"]
    scans: list[Detections] = results["sensor.detections"].tokens
    first = scans[0]
    sensor = LinearGaussian(4, (0, 1), np.eye(2) * first.along**2)
    predictor, updater = KalmanPredictor(_motion(own)), KalmanUpdater(sensor)
    associator = JPDA(PDAHypothesiser(predictor, updater, first.clutter_density, prob_detect=first.probability))
    deleter = CovarianceBasedDeleter(covar_trace_thresh=4)
    initiator = MultiMeasurementInitiator(
        prior_state=GaussianState(np.zeros(4), np.diag([0.0, 0.0, own.birth_variance, own.birth_variance])),
        measurement_model=sensor,
        deleter=deleter,
        data_associator=GNNWith2DAssignment(
            DistanceHypothesiser(predictor, updater, measure=Mahalanobis(), missed_distance=3)
        ),
        updater=updater,
        min_points=own.confirm_hits,
    )
    tracks: set[Any] = set()
    known: dict[Any, None] = {}  # in the order in which they began
    for scan in scans:
        now = _at(scan.time)
        places = np.array(scan.values).reshape((-1, 2)) + np.array(scan.observer)
        detections = {Detection(each[:, np.newaxis], timestamp=now, measurement_model=sensor) for each in places}
        used = set()
        for track, hypotheses in associator.associate(tracks, detections, now).items():
            states = [updater.update(each) if each else each.prediction for each in hypotheses]
            weights = np.array([float(each.probability) for each in hypotheses])
            means = StateVectors([each.state_vector for each in states])
            average, covariance = gm_reduce_single(means, np.stack([each.covar for each in states], axis=2), weights)
            track.append(GaussianStateUpdate(average, covariance, hypotheses, now))
            # Those that rather belong to this track begin no other one.
            used |= {each.measurement for each in hypotheses if each and float(each.probability) > weights[0]}
        tracks -= deleter.delete_tracks(tracks)
        # The states before were known to nobody then.
        begun = {Track([each.state]) for each in initiator.initiate(detections - used, now)}
        tracks |= begun
        known.update(dict.fromkeys(begun))
    return list(known)


def measured(tracks: Sequence[Any], results: Results) -> dict[str, float]:
    """Stone Soup's metrics of tracks against the truth of a run."""
    from stonesoup.dataassociator.tracktotrack import TrackToTruth
    from stonesoup.measures import Euclidean
    from stonesoup.metricgenerator.manager import MultiManager
    from stonesoup.metricgenerator.ospametric import GOSPAMetric, OSPAMetric
    from stonesoup.metricgenerator.tracktotruthmetrics import SIAPMetrics
    from stonesoup.types.groundtruth import GroundTruthPath, GroundTruthState

    truths = {
        GroundTruthPath(
            [
                GroundTruthState(np.concatenate([token.position, token.velocity]), timestamp=_at(token.time))
                for token in signal.tokens
            ]
        )
        for name, signal in results.signals.items()
        if name.endswith(".state") and name != "station.state"
    }
    place = Euclidean((0, 1))
    generators = [
        GOSPAMetric(c=NEAR, p=2, measure=place, generator_name="gospa", tracks_key="tracks", truths_key="truths"),
        OSPAMetric(c=NEAR, p=2, measure=place, generator_name="ospa", tracks_key="tracks", truths_key="truths"),
        SIAPMetrics(place, Euclidean((2, 3)), generator_name="siap", tracks_key="tracks", truths_key="truths"),
    ]
    manager = MultiManager(generators, associator=TrackToTruth(association_threshold=NEAR))
    manager.add_data({"truths": truths, "tracks": set(tracks)})
    found = manager.generate_metrics()
    distances = [each.value["distance"] for each in found["gospa"]["GOSPA Metrics"].value]
    gaps = [each.value for each in found["ospa"]["OSPA distances"].value]
    siap = {name: float(metric.value) for name, metric in found["siap"].items() if not hasattr(metric.value, "__len__")}
    return {
        "GOSPA": math.fsum(map(float, distances)) / len(distances),
        "OSPA": math.fsum(map(float, gaps)) / len(gaps),
        "SIAP completeness": siap["SIAP Completeness"],
        "SIAP ambiguity": siap["SIAP Ambiguity"],
        "SIAP spuriousness": siap["SIAP Spuriousness"],
        "SIAP position accuracy": siap["SIAP Position Accuracy"],
    }
