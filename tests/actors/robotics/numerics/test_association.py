"""Data association against all joint events listed one by one, and against Stone Soup; GOSPA against both, too."""

import importlib
from datetime import datetime
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2, multivariate_normal

from tests.actors.robotics.numerics.numerics_parts import PREFIX, spread

association = importlib.import_module(PREFIX + "association")
definitions = importlib.import_module(PREFIX + "definitions")
kernels = importlib.import_module(PREFIX + "gospa")
ukf = importlib.import_module(PREFIX + "ukf")

ALONG, ACROSS, REACH = 0.5, 0.9, 40.0


def scene(random: np.random.Generator, tracks: int, detections: int, kind: int) -> dict[str, Any]:
    """Tracks in a small area, and detections there, so that most gates overlap."""
    observer = random.normal(scale=15.0, size=2)
    sensor = np.array([kind, *observer, 0.0, 0.0, ALONG, ACROSS])
    places = random.normal(scale=3.0, size=(detections, 2))
    rows = np.repeat(sensor[np.newaxis], detections, axis=0)
    rows[:, 3:5] = places - observer
    if kind == ukf.RANGE:
        rows[:, 3], rows[:, 4] = np.linalg.norm(places - observer, axis=1), 0.0
    return {
        "means": random.normal(scale=2.0, size=(tracks, 4)),
        "covariances": np.array([spread(random, 4) for _ in range(tracks)]).reshape(tracks, 4, 4),
        "existence": np.ones(tracks),
        "kappa": 0.0,
        "sensor": sensor,
        "detections": rows,
        "probability": random.uniform(0.3, 1.0),
        "density": random.uniform(0.001, 0.1),
        "max_range": REACH,
        "gate": 9.0,
        "averaged": True,
    }


def written(scene: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Weights of no detection (T,), and of each detection (T, m), of tracks that exist, from the definitions of their
    parts."""
    sensor, gate, rows = scene["sensor"], scene["gate"], scene["detections"]
    size = 1 if sensor[0] == ukf.RANGE else 2
    missed, likelihood = [], []
    for mean, covariance in zip(scene["means"], scene["covariances"], strict=True):
        points, weights = ukf.sigma_points(mean, covariance, scene["kappa"])
        offsets = points[:, :2] - sensor[1:3]
        images = np.linalg.norm(offsets, axis=1)[:, np.newaxis] if size == 1 else offsets
        xx, xy, yy = ukf.measurement_noise(points, weights, sensor[np.newaxis])[0]
        noise = np.array([[xx]]) if size == 1 else np.array([[xx, xy], [xy, yy]])
        expected = weights @ images
        covariance = (weights[:, np.newaxis] * (images - expected)).T @ (images - expected) + noise
        detected = scene["probability"] * weights[np.linalg.norm(offsets, axis=1) <= scene["max_range"]].sum()
        missed.append(1.0 - detected * chi2.cdf(gate, size))
        innovations = rows[:, 3 : 3 + size] - expected
        squared = (innovations @ np.linalg.inv(covariance) * innovations).sum(axis=1)
        density = multivariate_normal(np.zeros(size), covariance).pdf(innovations)
        likelihood.append(np.where(squared <= gate, detected * np.atleast_1d(density), 0.0))
    return np.array(missed), np.array(likelihood).reshape(len(missed), len(rows))


def jpda(missed: np.ndarray, likelihood: np.ndarray, density: float) -> np.ndarray:
    """The definition for tracks that exist."""
    found: np.ndarray = definitions.association(missed, likelihood, density, np.ones(len(missed)))[1]
    return found


def test_one_track_and_one_detection_by_hand() -> None:
    """It exists and was missed, or is the detection, which comes from elsewhere in the other two cases."""
    exists, caused = definitions.association(np.array([0.2]), np.array([[3.0]]), 0.5, np.array([0.4]))
    missed, seen, absent = 0.4 * 0.2 * 0.5, 0.4 * 3.0, 0.6 * 0.5
    assert exists == pytest.approx([(missed + seen) / (missed + seen + absent)])
    assert caused == pytest.approx(np.array([[missed, seen]]) / (missed + seen))


@pytest.mark.parametrize("dimensions", [1, 2])
def test_the_probability_of_a_gate(dimensions: int) -> None:
    for gate in (1e-6, 0.5, 4.0, 9.0, 16.0, 100.0, 900.0):
        assert association.gate_probability(gate, dimensions) == pytest.approx(chi2.cdf(gate, dimensions), abs=1e-13)


@pytest.mark.slow
@pytest.mark.parametrize("kind", [ukf.RELATIVE_POSITION, ukf.RANGE])
def test_association_probabilities(random: np.random.Generator, kind: int) -> None:
    """The sum over all joint events, in 400 scenes of each kind."""
    shared = 0
    for number in range(400):
        given = scene(random, number % 5, number % 7, kind)
        if number % 3 == 0:
            given["max_range"] = 15.0  # within the cloud of sigma points
        *_, found, shares, rough = association.fuse_scan(*given.values())
        missed, likelihood = written(given)
        assert found == pytest.approx(jpda(missed, likelihood, given["density"]), abs=1e-11)
        assert rough == 0
        assert len(shares) == len(given["means"])
        shared += bool(((likelihood > 0.0).sum(axis=0) > 1).any())
    assert shared > 100


@pytest.mark.slow
def test_tracks_that_may_not_exist(random: np.random.Generator) -> None:
    """Joint events of all subsets of the tracks that may be there."""
    for number in range(200):
        given = scene(random, 1 + number % 4, number % 5, (ukf.RELATIVE_POSITION, ukf.RANGE)[number % 2])
        given["existence"] = random.uniform(0.05, 1.0, size=1 + number % 4)
        _, _, existence, caused, *_ = association.fuse_scan(*given.values())
        expected = definitions.association(*written(given), given["density"], given["existence"])
        assert existence == pytest.approx(expected[0], abs=1e-11)
        assert caused == pytest.approx(expected[1], abs=1e-11)


def test_one_track_that_may_not_exist() -> None:
    """A known answer, that of Musicki's IPDA: the odds grow by 1 - P_D P_G + P_D N / density."""
    sensor = np.array([ukf.RELATIVE_POSITION, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0])
    detection = np.array([[ukf.RELATIVE_POSITION, 0.0, 0.0, 3.0, 0.0, 1.0, 1.0]])
    track = np.array([[2.0, 0.0, 0.0, 0.0]]), np.eye(4)[np.newaxis]
    for rows, factor in (
        (detection, 1.0 - 0.8 * chi2.cdf(9.0, 2) + 0.8 * np.exp(-0.25) / (4.0 * np.pi) / 0.01),
        (detection[:0], 1.0 - 0.8 * chi2.cdf(9.0, 2)),
    ):
        *_, after, _, _, _ = association.fuse_scan(
            *track, np.array([0.3]), 0.0, sensor, rows, 0.8, 0.01, 99.0, 9.0, True
        )
        assert after[0] / (1.0 - after[0]) == pytest.approx(0.3 / 0.7 * factor)


def test_clusters_are_independent(random: np.random.Generator) -> None:
    """Sparse weights, in which tracks fall into clusters of all kinds, one without any detection among them."""
    sizes = set()
    for _ in range(60):
        tracks, detections = random.integers(1, 6), random.integers(0, 6)
        likelihood = random.uniform(size=(tracks, detections)) * (random.uniform(size=(tracks, detections)) < 0.3)
        missed = random.uniform(0.05, 1.0, size=tracks)
        found, rough = association.association_probabilities(np.column_stack([missed, likelihood / 0.3]))
        assert found == pytest.approx(jpda(missed, likelihood, 0.3), abs=1e-12)
        assert rough == 0
        sizes.add(len(np.unique(association._labels(np.column_stack([missed, likelihood])))))
    assert sizes == {1, 2, 3, 4, 5}


def test_a_track_is_the_mixture_of_its_events(random: np.random.Generator) -> None:
    for number in range(100):
        given = scene(random, 3, 4, (ukf.RELATIVE_POSITION, ukf.RANGE)[number % 2])
        means, covariances, _, caused, *_ = association.fuse_scan(*given.values())
        for t in range(3):
            mean, covariance = given["means"][t], given["covariances"][t]
            points, weights = ukf.sigma_points(mean, covariance, 0.0)
            noise = ukf.measurement_noise(points, weights, given["sensor"][np.newaxis])
            each = [(mean, covariance)]
            for row in given["detections"]:
                each.append(ukf.update(mean, covariance, 0.0, row[np.newaxis], noise))
            expected = definitions.mixture(caused[t], *map(np.array, zip(*each, strict=True)))
            assert means[t] == pytest.approx(expected[0], abs=1e-10)
            assert covariances[t] == pytest.approx(expected[1], abs=1e-10)
            assert np.linalg.eigvalsh(covariances[t]).min() > 0.0


def test_too_large_a_cluster() -> None:
    """Beyond the limit, every pair competes with the others of its track and of its detection."""
    tracks, detections = 16, 4  # 2^16 (1 + 4) numbers
    random = np.random.default_rng(3)
    weights = random.uniform(0.1, 2.0, size=(tracks, 1 + detections))
    found, rough = association.association_probabilities(weights)
    assert rough == tracks
    assert found.sum(axis=1) == pytest.approx(np.ones(tracks))
    for t in range(tracks):
        for j in range(1, 1 + detections):
            rivals = weights[t, 1:].sum() + weights[:, j].sum() - weights[t, j]
            assert found[t, j] == pytest.approx(weights[t, j] / (weights[t, 0] + rivals))
    exact, rough = association.association_probabilities(weights[:14])  # 2^14 * 5
    assert rough == 0
    assert exact.sum(axis=1) == pytest.approx(np.ones(14))
    assert (exact[:, 1:].sum(axis=0) <= 1.0).all()  # a detection has one cause


def test_impossible_events() -> None:
    """Two tracks that must both have caused the only detection: no event is possible, and nothing is concluded."""
    found, _ = association.association_probabilities(np.array([[0.0, 1.0], [0.0, 1.0]]))
    assert found.tolist() == [[1.0, 0.0], [1.0, 0.0]]
    found, _ = association.association_probabilities(np.zeros((1, 1)))
    assert found.tolist() == [[1.0]]


def test_tracks_that_are_one(random: np.random.Generator) -> None:
    """Only younger ones are named, and not for the sake of one that is itself too many."""
    covariance = spread(random, 4)
    root = np.linalg.cholesky(2.0 * covariance)
    means = np.array([root @ ([each] + [0.0] * 3) for each in (0.0, 0.9, 1.8, 0.5)])
    found = association.duplicates(means, np.array([covariance] * 4), 1.0)
    assert found.tolist() == [0.0, 1.0, 0.0, 1.0]


def test_how_far_tracks_are_from_each_other(random: np.random.Generator) -> None:
    covariances = np.array([spread(random, 4) for _ in range(5)])
    means = random.normal(size=(5, 4))
    found = association.separations(means, covariances, 2)
    for one in range(2):
        for other in range(3):
            away = means[one] - means[2 + other]
            expected = away @ np.linalg.solve(covariances[one] + covariances[2 + other], away)
            assert found[one, other] == pytest.approx(expected)


def test_a_new_track() -> None:
    detection = np.array([ukf.RELATIVE_POSITION, 1.0, 2.0, 0.0, 10.0, 0.2, 2.0])
    mean, covariance = association.new_track(detection, 4.0)
    assert mean.tolist() == [1.0, 12.0, 0.0, 0.0]
    assert covariance == pytest.approx(np.diag([4.0, 0.04, 4.0, 4.0]))


def test_gospa(random: np.random.Generator) -> None:
    from scipy.optimize import linear_sum_assignment

    for number in range(300):
        truth = random.normal(scale=3.0, size=(number % 5, 2))
        tracks = random.normal(scale=3.0, size=(number % 4, 2))
        total, error, missed, false = kernels.gospa(truth, tracks, 4.0)
        assert total == pytest.approx(definitions.gospa(truth, tracks, 4.0), abs=1e-12)
        assert missed - false == len(truth) - len(tracks)
        pairs = len(truth) - missed
        assert total**2 == pytest.approx(pairs * error**2 + 8.0 * (missed + false))
    for _ in range(50):  # larger than can be listed
        costs = random.uniform(size=(12, 30))
        rows, columns = linear_sum_assignment(costs)
        chosen = kernels._least_cost(costs).astype(int)
        assert costs[rows, chosen].sum() == pytest.approx(costs[rows, columns].sum())


# --- Stone Soup -----------------------------------------------------------------------------------------------------


def test_stone_soup_s_joint_association(random: np.random.Generator) -> None:
    """Its JPDA and its Kalman updater: probabilities, means and covariances of tracks after a scan of positions."""
    pytest.importorskip("stonesoup", reason="needs stonesoup")
    from stonesoup.dataassociator.probability import JPDA
    from stonesoup.hypothesiser.probability import PDAHypothesiser
    from stonesoup.models.measurement.linear import LinearGaussian
    from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantVelocity
    from stonesoup.predictor.kalman import KalmanPredictor
    from stonesoup.types.array import CovarianceMatrix, StateVector
    from stonesoup.types.detection import Detection
    from stonesoup.types.state import GaussianState
    from stonesoup.types.track import Track
    from stonesoup.updater.kalman import KalmanUpdater

    now, noise = datetime(2026, 1, 1), np.eye(2) * ALONG**2
    still = CombinedLinearGaussianTransitionModel([ConstantVelocity(0.0), ConstantVelocity(0.0)])
    model = LinearGaussian(4, (0, 1), CovarianceMatrix(noise))
    compared = 0
    for number in range(40):
        given = scene(random, 1 + number % 3, 1 + number % 4, ukf.RELATIVE_POSITION)
        for rows in (given["sensor"][np.newaxis], given["detections"]):
            rows[:, 6] = ALONG  # round, so that the noise is the same everywhere, as in Stone Soup
        given["max_range"] = 1e6
        found = association.fuse_scan(*given.values())
        updater = KalmanUpdater(model)
        hypothesiser = PDAHypothesiser(
            KalmanPredictor(still), updater,
            clutter_spatial_density=given["density"],
            prob_detect=given["probability"],
            prob_gate=chi2.cdf(given["gate"], 2),
        )  # fmt: skip
        tracks = [
            Track([GaussianState(StateVector(mean), CovarianceMatrix(covariance), timestamp=now)])
            for mean, covariance in zip(given["means"], given["covariances"], strict=True)
        ]
        detections = [
            Detection(StateVector(row[1:3] + row[3:5]), timestamp=now, measurement_model=model)
            for row in given["detections"]
        ]
        answers = JPDA(hypothesiser=hypothesiser).associate(tracks, set(detections), now)
        for t, track in enumerate(tracks):
            each, shares = [], []
            probabilities = np.zeros(1 + len(detections))
            for hypothesis in answers[track]:
                place = 1 + detections.index(hypothesis.measurement) if hypothesis else 0
                probabilities[place] = float(hypothesis.probability)
                each.append(updater.update(hypothesis) if hypothesis else hypothesis.prediction)
                shares.append(float(hypothesis.probability))
            assert found[3][t] == pytest.approx(probabilities, abs=1e-9)
            means = np.hstack([np.asarray(state.state_vector) for state in each]).T
            mean, covariance = definitions.mixture(
                np.array(shares), means.astype(float), np.array([np.asarray(state.covar) for state in each], float)
            )
            assert found[0][t] == pytest.approx(mean, abs=1e-8)
            assert found[1][t] == pytest.approx(covariance, abs=1e-8)
            compared += len(shares) > 2
    assert compared > 20


def test_stone_soup_s_gospa(random: np.random.Generator) -> None:
    pytest.importorskip("stonesoup", reason="needs stonesoup")
    from stonesoup.metricgenerator.ospametric import GOSPAMetric
    from stonesoup.types.state import State

    now, measure = datetime(2026, 1, 1), GOSPAMetric(c=4.0, p=2, switching_penalty=0.0)
    for number in range(40):
        truth = random.normal(scale=3.0, size=(1 + number % 5, 2))
        tracks = random.normal(scale=3.0, size=(1 + number % 4, 2))
        states = [[State(each[:, np.newaxis], timestamp=now) for each in some] for some in (tracks, truth)]
        metric, _ = measure.compute_gospa_metric(*states)
        total, _, missed, false = kernels.gospa(truth, tracks, 4.0)
        assert total == pytest.approx(metric.value["distance"])
        assert (missed, false) == (metric.value["missed"] / 8.0, metric.value["false"] / 8.0)
