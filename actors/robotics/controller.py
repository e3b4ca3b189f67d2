"""The distributed robust model predictive controller of every robot (paper, sections II.C and II.D)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..core import Actor, InputPort, OutputPort, Parameter
from .messages import Array, BodyState, Estimate, Plan, enclosing
from .objectives import Objective, ReachGoal
from .solvers import Barrier, Solver

if TYPE_CHECKING:
    from .numerics.horizon import HorizonProblem

STEPS, SECONDS = "steps", "seconds"
DECISION, NOW = "decision", "now"


@dataclass(frozen=True, slots=True)
class _Standing:
    """The plan that the controller made last."""

    made_at: float  # s
    controls: Array  # (N, 2) U_{t+1} .. U_{t+N}, as seen from made_at
    positions: Array  # (N, 2) at steps 1..N from made_at

    def age(self, now: float, period: float) -> int:
        return max(0, round((now - self.made_at) / period))


class RobustController(Actor):
    """Solves the horizon problem at every trigger and sends the acceleration for the *next* period.

    Connect ``control`` to the vehicle with a delay of one period: solving takes time, so what is computed
    from the state at t acts from t + period on (the paper's U_{t+1}).

    Eq. (2) sums over the states at t + 1 .. t + N periods, of which U_{t+N} reaches none: in the paper's dynamics a
    control moves the robot two periods later.  ``horizon_from: decision`` counts the N steps from t + period instead,
    from where the first unknown control acts.

    The latest plan of each peer counts; with every period beyond the first that has passed since it was made,
    the distance to keep grows (eq. 4).  Before a first plan or estimate comes, there is nobody to avoid.
    Plans and estimates that are not finite are ignored, the last good ones stay.  Without a finite own state
    the control is zero, and nothing else is sent.
    """

    trigger = InputPort(object, doc="plan now")
    state = InputPort(BodyState, doc="where the robot is")
    estimate = InputPort(Estimate, required=False, doc="of the target; unconnected: there is none to avoid")
    peer_plans = InputPort(Plan, multi=True, required=False, doc="what the other robots intend")
    control = OutputPort(np.ndarray, shape=(2,), doc="m/s^2, for the period after this one")
    plan = OutputPort(Plan, doc="what this robot intends, for the others")
    violation = OutputPort(float, doc="metres by which the plan breaks a constraint at worst; 0 if it keeps all")
    infeasible = OutputPort(int, doc="how many plans so far broke a constraint")
    iterations = OutputPort(int, doc="Newton (or solver) iterations that this plan took")

    objective = Parameter(Objective, ReachGoal(), doc="what the robot wants")
    solver = Parameter(Solver, Barrier(), doc="how the problem is solved")
    max_speed = Parameter(float, 8.0, unit="m/s", min=1e-6, doc="Vmax")
    max_acceleration = Parameter(float, 8.0, unit="m/s^2", min=1e-6, doc="Amax")
    horizon = Parameter(int, 10, min=3, doc="N: periods to look ahead")
    horizon_from = Parameter(
        str,
        NOW,
        choices=(NOW, DECISION),
        doc="where the N steps begin: at t, or at t + period, when U_{t+1} begins to act",
    )
    period = Parameter(float, 0.1, unit="s", min=1e-9, doc="Delta t: time between two triggers")
    safe_distance = Parameter(float, 2.0, unit="m", min=0, doc="Dmin: to the target and to other robots")
    margin = Parameter(float, 2.0, unit="1", min=0, doc="alpha: standard deviations to add to it")
    tube_initial = Parameter(float, 0.2, unit="m", min=1e-6, doc="sigma_r0: radius of the reachability set now")
    tube_growth = Parameter(float, 0.4, unit="m", min=0, doc="beta: what it grows by, per unit of tau")
    tube_time = Parameter(str, STEPS, choices=(STEPS, SECONDS), doc="unit of tau in eq. (3)")
    covariance_noise = Parameter(bool, False, doc="let process noise widen the target's predicted covariance")
    position_noise = Parameter(float, 0.002, unit="m^2", min=0, doc="Qp in one period; for covariance_noise")
    velocity_noise = Parameter(float, 0.4, unit="m^2/s^2", min=0, doc="Qv in one period; for covariance_noise")
    robot_name = Parameter(str, "", doc="name in the plan; empty: the path of what the controller stands in")

    def initialize(self) -> None:
        from .numerics.reachability import tube_radius
        from .numerics.warm_up import compile_kernels

        self.solver.prepare()
        compile_kernels()
        self._name = self.robot_name or enclosing(self.path)
        tau = 1.0 if self.tube_time == STEPS else self.period
        # The kernels count steps from t.  From t + period on there is one more of them, and tau is 0 at the first.
        ahead = 1 if self.horizon_from == DECISION else 0
        self._steps = self.horizon + ahead
        self._radius = tube_radius(
            self.tube_initial - ahead * self.tube_growth * tau, self.tube_growth, tau, self._steps
        )
        noise = np.diag([self.position_noise] * 2 + [self.velocity_noise] * 2)
        self._process_noise = noise if self.covariance_noise else np.zeros((4, 4))
        self._applied = np.zeros(2)  # U_t
        self._standing: _Standing | None = None
        self._peers: dict[str, Plan] = {}
        self._target: Estimate | None = None
        self._target_at = 0.0
        self._infeasible = 0

    def fire(self) -> None:
        self._listen()
        if not self.trigger.present:
            return
        if not (self.state.present and self.state.value.finite):
            self._applied = np.zeros(2)
            self._standing = None
            self.control.send(np.zeros(2))
            return
        own = self.state.value
        problem = self._problem(own)
        solution = self.solver.solve(problem, first_guesses(problem, self._shifted_controls()))
        controls, violation = solution.controls, solution.violation
        if not np.isfinite(controls).all():  # input so large that its squares are not finite
            controls, violation = braking(problem, self._steps), math.inf
        self._send(own, problem, controls)
        self._infeasible += violation > 0.0
        self.violation.send(float(violation))
        self.infeasible.send(self._infeasible)
        self.iterations.send(int(solution.iterations))

    def _listen(self) -> None:
        """Remember the latest estimate and plans, also those that come between triggers."""
        for plan in self.peer_plans.tokens:
            known = self._peers.get(plan.robot)
            if plan.robot != self._name and plan.finite and (known is None or plan.time >= known.time):
                self._peers[plan.robot] = plan
        if self.estimate.present and self.estimate.value.finite:
            self._target, self._target_at = self.estimate.value, self.now

    def _send(self, own: BodyState, problem: HorizonProblem, controls: Array) -> None:
        from .numerics.horizon import trajectory

        positions = trajectory(problem.position, problem.velocity, controls, self.period, self._steps)
        self._standing = _Standing(self.now, controls, positions)
        announced = np.empty((self.horizon + 1, 2))
        announced[0], announced[1:] = self._applied, controls[: self.horizon]
        self.plan.send(Plan(self._name, self.now, own, announced))
        self._applied = controls[0].copy()
        self.control.send(controls[0].copy())

    # --- the problem ------------------------------------------------------------------------------------

    def _problem(self, own: BodyState) -> HorizonProblem:
        from .numerics.horizon import REACH_GOAL, HorizonProblem

        target_mean, target_covariance, points, weights = self._predicted_target()
        peer_mean, peer_distance = self._predicted_peers()
        tube_centre, tube_radius = self._tube()
        posed = HorizonProblem(
            period=self.period,
            position=own.position + self.period * own.velocity,
            velocity=own.velocity + self.period * self._applied,
            max_speed=self.max_speed,
            max_acceleration=self.max_acceleration,
            tube_centre=tube_centre,
            tube_radius=tube_radius,
            safe_distance=self.safe_distance,
            margin=self.margin,
            obstacle_mean=target_mean,
            obstacle_covariance=target_covariance,
            peer_mean=peer_mean,
            peer_distance=peer_distance,
            objective=REACH_GOAL,
            goal=np.zeros(2),
            sigma_positions=np.empty((0, 2)),
            sigma_weights=np.empty(0),
            others_distance=np.empty((0, 0)),
            measurement_variance=1.0,
            range_penalty=0.0,
            measurement_range=0.0,
        )
        return self.objective.pose(posed, points, weights, peer_mean[:, -1].copy())

    def _tube(self) -> tuple[Array, Array]:
        """f3: centres (N, 2) and radii (N,); it binds where the standing plan reaches, and is free beyond."""
        centre, radius = np.zeros((self._steps, 2)), np.full(self._steps, np.inf)
        if self._standing is not None:
            age = self._standing.age(self.now, self.period)
            reached = max(0, self._steps - age)
            centre[:reached] = self._standing.positions[age:]
            radius[:reached] = self._radius[:reached]
        return centre, radius

    def _shifted_controls(self) -> Array:
        """The standing plan from the next period on; zero where it ends."""
        controls = np.zeros((self._steps, 2))
        if self._standing is not None:
            age = self._standing.age(self.now, self.period)
            controls[: max(0, self._steps - age)] = self._standing.controls[age:]
        return controls

    def _predicted_target(self) -> tuple[Array, Array, Array, Array]:
        """Means (K, N, 2), covariances (K, N, 3), sigma points (M, 2) at step N, weights; K is 0 or 1."""
        from .numerics.reachability import propagate
        from .numerics.ukf import constant_velocity, sigma_points

        steps = self._steps
        if self._target is None:
            return np.empty((0, steps, 2)), np.empty((0, steps, 3)), np.empty((0, 2)), np.empty(0)
        # Copies, as tokens are read-only and the kernels are compiled for arrays that are not.
        mean, covariance = self._target.mean.copy(), self._target.covariance.copy()
        age = max(0, round((self.now - self._target_at) / self.period))
        transition = constant_velocity(self.period)
        means, covariances = propagate(mean, covariance, transition, self._process_noise, age + steps)
        points, weights = sigma_points(mean, covariance, 0.0)
        last = points[:, :2] + (age + steps) * self.period * points[:, 2:]
        return means[np.newaxis, age:].copy(), covariances[np.newaxis, age:].copy(), last, weights

    def _predicted_peers(self) -> tuple[Array, Array]:
        """f5: positions (n, N, 2) and the distances to keep from them (n, N), sorted by the peers' names."""
        from .numerics.reachability import planned_positions

        steps = self._steps
        positions, distances = np.empty((len(self._peers), steps, 2)), np.empty((len(self._peers), steps))
        for row, name in enumerate(sorted(self._peers)):
            plan = self._peers[name]
            age = max(0, round((self.now - plan.time) / self.period))
            lost = max(0, age - 1)  # one period of latency is normal
            positions[row] = planned_positions(
                plan.state.position.copy(),
                plan.state.velocity.copy(),
                plan.controls.copy(),
                self.period,
                age,
                steps,
            )
            distances[row] = self.safe_distance + self.margin * (self._radius + self.tube_growth * lost)
        return positions, distances


def first_guesses(problem: HorizonProblem, shifted: Array) -> Array:
    """Where a solver may start, (k, N, 2), the best guess first: the shifted standing plan, then braking."""
    return np.array([shifted, braking(problem, len(shifted))])


def braking(problem: HorizonProblem, steps: int) -> Array:
    """Controls (steps, 2) that stop the vehicle as fast as f2 allows, with 5 % to spare."""
    controls = np.zeros((steps, 2))
    speed = math.hypot(problem.velocity[0], problem.velocity[1])
    if not 1e-9 < speed < math.inf:
        return controls
    x, y = (problem.velocity / speed).tolist()  # floats: arithmetic on arrays of two takes ten times as long
    rows = []
    for _ in range(steps):
        push = min(0.95 * problem.max_acceleration, speed / problem.period)
        rows.append((-push * x, -push * y))
        speed -= push * problem.period
    controls[:] = rows
    return controls
