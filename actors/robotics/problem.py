"""The horizon problem of a robot with any dynamics and any objective, as its solver sees it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..core import Configurable, declared_parameters
from .arrays import Array

if TYPE_CHECKING:
    from .dynamics import Dynamics
    from .numerics.horizon import Solution

FAR = 1e6  # m; infinity for solvers, to which inf - inf is no number


class Beliefs(NamedTuple):
    """What a robot expects of the others at steps 1..N, for an objective: arrays of numbers or of symbols."""

    targets: Array  # (T, N, d) m, where each target is expected
    covariances: Array  # (T, N, d (d + 1) / 2) m^2 of that, the rows of the upper triangle
    samples: Array  # (T M, d) m, where each may be at step N: M sigma points, or the particles of a ``SampledEstimate``
    weights: Array  # (M,) of the samples of a target
    peers: Array  # (n, N, d) m, where the other robots are going to be
    names: tuple[str, ...] = ()  # theirs

    @property
    def samples_by_target(self) -> list[Array]:
        """The samples (M, d) of each target."""
        size = len(self.weights)
        return [self.samples[k : k + size] for k in range(0, len(self.samples), size)] if size else []


class Trajectory(NamedTuple):
    """A plan, for an objective: arrays of numbers or of symbols, a row for each of the steps 1..N."""

    states: Any  # (N, n)
    positions: Any  # (N, d)
    controls: Any  # (N, m)
    period: float  # s
    positive: Callable[[Any], Any] = lambda values: np.maximum(0.0, values)

    # ``positive`` is max(0, .) of each element, for costs that grow with it: a solver may put variables in its place.


class Objective(Configurable):
    """What a robot wants: a cost of its trajectory, given what it believes of the others.

    It is written once for numbers and for symbols of CasADi: use the functions of ``symbolic``.  Those that Epicycle's
    compiled solver knows have a ``pose``, too.
    """

    def cost(self, trajectory: Trajectory, beliefs: Beliefs) -> Any:
        """The number that a plan should make small."""
        raise NotImplementedError(f"{type(self).__name__} has no cost()")

    def check_dimensions(self, dimensions: int) -> None:
        """Raise ``ParameterError`` if it is not for a robot with so many dimensions."""

    def pose(self, problem: Problem) -> dict[str, Any]:
        """The fields of a ``HorizonProblem`` that say this objective to the compiled kernels."""
        raise NotImplementedError


class Problem(NamedTuple):
    """A plan to be found: controls (N, m) for steps 1..N of the horizon, of which the last one changes no state.

    It keeps to its tube, and away from the obstacles, which are the targets, and the peers; at the end of these may be
    some without a name, who only stand in the way.
    """

    dynamics: Dynamics
    objective: Objective
    names: tuple[str, ...]  # of the first peers
    period: float  # s
    state: Array  # (n,) at step 1
    tube_centre: Array  # (N, d) m
    tube_radius: Array  # (N,) m; inf where the tube is free
    safe_distance: float  # m, to keep from the obstacles, and besides
    margin: float  # standard deviations
    obstacle_mean: Array  # (T, N, d) m
    obstacle_covariance: Array  # (T, N, d (d + 1) / 2) m^2
    peer_mean: Array  # (n, N, d) m
    peer_distance: Array  # (n, N) m, to keep from them
    samples: Array  # (T M, d) of the ``beliefs``
    weights: Array  # (M,)
    lowest: float = -math.inf  # m, in space, the height to stay above
    highest: float = math.inf  # m, in space, the height to stay below

    @property
    def beliefs(self) -> Beliefs:
        """What the objective is given of the others."""
        peers = self.peer_mean[: len(self.names)]
        return Beliefs(self.obstacle_mean, self.obstacle_covariance, self.samples, self.weights, peers, self.names)

    def trajectory(self, controls: Any, positive: Callable[[Any], Any] | None = None) -> Trajectory:
        """The states under controls (N, m)."""
        states = self.dynamics.trajectory(self.state, controls, self.period)
        made = Trajectory(states, states[:, : self.dynamics.dimensions], controls, self.period)
        return made if positive is None else made._replace(positive=positive)

    def cost(self, controls: Any, positive: Callable[[Any], Any] | None = None) -> Any:
        """What is to be minimised; ``positive`` may replace max(0, .)."""
        return self.objective.cost(self.trajectory(controls, positive), self.beliefs)

    def constraints(self, controls: Any) -> Any:
        """Lengths in m that are <= 0 if the plan keeps off obstacles and peers, and in its tube: f3 to f5, and f7."""
        from .numerics.definitions import constraints

        values = constraints(self, self.trajectory(controls).positions, self.dynamics.decided).ravel()
        return values if values.dtype == object else np.maximum(values, -FAR)

    def limits(self, controls: Any) -> Any:
        """Numbers that are <= 0 if the robot can do it: those of the dynamics, of all states but the first, which is
        decided, and of all controls."""
        states = self.trajectory(controls).states[1:]
        rows: list[Sequence[Any]] = [self.dynamics.state_limits(state) for state in states]
        rows += [self.dynamics.control_limits(control) for control in controls]
        return np.array([each for row in rows for each in row])

    def solution(self, controls: Array, iterations: int = 0) -> Solution:
        """The answer of a solver, with its violation of the constraints and its cost."""
        from .numerics.horizon import TOLERANCE, Solution

        worst = float(np.max(self.constraints(controls), initial=0.0))
        return Solution(controls, worst if worst > TOLERANCE else 0.0, float(self.cost(controls)), iterations)

    # --- for solvers that work on symbols ---------------------------------------------------------------

    @property
    def arrays(self) -> tuple[Any, ...]:
        """All numbers."""
        return self[3:]

    @property
    def key(self) -> Any:
        """What else there is."""
        return _told(self.dynamics), _told(self.objective), self.names

    def of(self, arrays: Sequence[Any]) -> Problem:
        """The same problem of other numbers, or of symbols."""
        return Problem(self.dynamics, self.objective, self.names, *arrays)


def _told(value: Any) -> Any:
    """A part with all its parameters, as something that is equal if the part is."""
    if isinstance(value, Configurable):
        return type(value), *(_told(each.value_in(value)) for each in declared_parameters(type(value)).values())
    if isinstance(value, Mapping):
        return tuple((name, _told(each)) for name, each in value.items())
    if isinstance(value, (list, tuple)):
        return tuple(map(_told, value))
    return (value.shape, value.tobytes()) if isinstance(value, np.ndarray) else value
