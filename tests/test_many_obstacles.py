"""The packaged model many_obstacles: what is tracked and avoided, under aspects too, and what its figures show."""

import numpy as np
import pytest

from epicycle.aspects import Latency, MeasurementFailure, Noise
from epicycle.runner import Simulation, load_model
from epicycle.runner.show.trajectories import Trajectories
from tests.demo_models import run


def test_all_obstacles_are_tracked_and_avoided() -> None:
    results = run("many_obstacles")
    metrics = results.metrics
    assert metrics["arrival_time"] < 10.0
    assert metrics["least_clearance"] >= 2.0
    assert metrics["keeps_off_obstacles"]
    assert metrics["keeps_off_robots"]
    assert metrics["finds_obstacles"]
    assert metrics["gospa"] < 1.0
    assert metrics["false_tracks"] == 0.0
    told = results.signals["main.tracks"]
    last, truth = told.tokens[-1], [results.signals[f"obstacle[{i}].state"].tokens[-1].position for i in range(5)]
    errors = [min(np.linalg.norm(each.mean[:2] - place) for each in last.estimates) for place in truth]
    assert len(last.numbers) == 5
    assert max(errors) < 1.0


def test_obstacles_come_and_go_and_so_do_their_tracks() -> None:
    """The sixth leaves at 6 s, the fifth comes at 0.5 s."""
    results = run("many_obstacles", until=7.0, obstacles=6, goal=[-200, 0])
    times = results.signals["obstacle[5].state"].times
    assert times[-1] == pytest.approx(5.9)
    assert results.signals["obstacle[4].state"].times[0] == pytest.approx(0.5)
    count = dict(zip(results.signals["main.tracks"].times.round(1), results.signals["main.tracks"].tokens, strict=True))
    assert [len(count[time].numbers) for time in (0.0, 0.4, 0.9, 5.9, 6.9)] == [0, 4, 5, 6, 5]


@pytest.mark.parametrize("obstacles", [1, 10])
def test_any_number_of_obstacles_and_observers(obstacles: int) -> None:
    for observers in (0, 7):
        metrics = run("many_obstacles", until=1.0, obstacles=obstacles, observers=observers).metrics
        assert metrics["missed"] < 0.8 * obstacles


def test_aspects_take_a_scan_as_one_message() -> None:
    model = load_model("many_obstacles", set=["packet_loss=0.5"])
    model.weave("failure", MeasurementFailure(probability=0.3), at="*.sensor.detections")
    model.weave("noise", Noise(deviation=0.1, fields="values"), at="main.sensor.detections")
    model.weave("late", Latency(delay=0.25), at="*.peer_detections")
    results = Simulation(model, seed=3).run(until=3.0)
    assert results.aspects["failure"]["failed"] > 10
    assert results.aspects["packet_loss"]["dropped"] > 10
    assert results.metrics["missed"] < 2.0


def test_what_its_page_shows() -> None:
    """An ellipse for each track, gone when it ends; a line for each detection; obstacles that leave are gone, too."""
    model = load_model("many_obstacles", set=["obstacles=6", "goal=[-200, 0]"])
    _, values, _ = model.figures["trajectories"]
    figure = Trajectories(**values)
    model.record("main.detections", "main.plan", "observer[0].plan", "observer[1].plan")
    results = Simulation(model, seed=1).run(until=7.0)
    marks = {mark.name: mark for mark in figure.marks(results)}
    tracks = [mark for name, mark in marks.items() if name.startswith("main.tracks[")]
    assert len(tracks) >= 6
    assert all(mark.shape == "ellipse" for mark in tracks)
    ended = [mark for mark in tracks if np.isnan(mark.rows[-1]).all()]
    assert len(ended) == len(tracks) - 5
    gone = marks["obstacle[5].state"]
    assert np.isnan(gone.rows[-1]).all()
    assert gone.times[-1] == pytest.approx(6.0)
    assert not np.isnan(marks["obstacle[0].state"].rows).any()
    lines = [mark for name, mark in marks.items() if name.startswith("main.detections[")]
    most = max(len(token.values) for token in results.signals["main.detections"].tokens)
    assert len(lines) == most
    first = results.signals["main.detections"].tokens[0]
    assert lines[0].rows[0] == pytest.approx([*first.observer, *(first.observer + first.values[0])])
