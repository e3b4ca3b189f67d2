"""What runs of large models take."""

from __future__ import annotations

import gc
import tracemalloc

import pytest

from benchmarks import growth
from epicycle.actors import NO_TOKENS
from epicycle.runner import Simulation
from epicycle.runner.model.build.model import Model

ACTORS = 500


@pytest.fixture
def model() -> Model:
    return growth.model(growth.PIPELINE, actors=ACTORS, stop=3)


@pytest.mark.slow
def test_an_actor_of_a_pipeline_takes_at_most_2200_bytes_in_a_run(model: Model) -> None:
    Simulation(model).run()  # what all runs share is there
    gc.collect()
    tracemalloc.start()
    simulation = Simulation(model)
    simulation.run()
    gc.collect()
    taken = tracemalloc.get_traced_memory()[0] / len(simulation.actors)
    tracemalloc.stop()
    assert taken <= 2_200


def test_runs_share_what_does_not_change(model: Model) -> None:
    first = Simulation(model)
    first.advance(1.0)
    for other in (first.fork(), Simulation(model)):
        for path, actor in model.graph.actors.items():
            for name, port in actor.inputs.items():
                ours = other.actors[path].inputs[name]
                assert ours is not port
                assert (ours.terms, ours.path) == (port.terms, port.path)
                assert (ours.arrived is NO_TOKENS) is (name != "input")  # to which nothing is connected
    assert first.log.digest != first.fork().run().digest == Simulation(model).run().digest
