"""Every kernel as plain Python on NumPy's arrays, which raise an error where compiled code would corrupt memory."""

import os
import subprocess
import sys

import pytest

SCRIPT = """
import numpy as np
from epicycle.actors import BodyState, Estimate, Inform, RobustController
from epicycle.actors.testing import Harness
from epicycle.runner import Simulation, load_model

np.seterr(all="ignore")  # kernels give inf and NaN without a word
for model in ("collision_avoidance", "many_obstacles", "safe_avoidance", "flying_observers"):
    Simulation(load_model(model), seed=1).run(until=0.4)
for d in (2, 3):
    for size in (4, 6):
        harness = Harness(RobustController("main.a", objective=Inform(), dimensions=d))
        own = BodyState((30.0, 0.0, 5.0)[:d], np.zeros(d), 0.3)
        harness.fire(0.3, trigger=0, state=own, estimate=Estimate(np.zeros(size), np.eye(size), 0.0))
        assert np.isfinite(harness.last("control")).all()
"""


@pytest.mark.slow
def test_no_kernel_leaves_its_arrays() -> None:
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run([sys.executable, "-c", SCRIPT], env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
