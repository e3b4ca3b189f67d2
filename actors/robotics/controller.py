"""The distributed robust model predictive controller of every robot (paper, sections II.C and II.D)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np

from ..core import (
    Actor,
    EpicycleError,
    InputPort,
    MappingParameter,
    OutputPort,
    Parameter,
    ParameterError,
    array_parameter,
    did_you_mean,
    shaped,
)
from ..core.elementary import hypot
from .arrays import Array, array_of, finite, floats, joined, read_only, stacked
from .dynamics import DoubleIntegrator, Dynamics
from .estimator import TargetModel
from .messages import BodyState, Estimate, Plan, SampledEstimate, Tracks, enclosing
from .planning import Barrier, ReachGoal, Solver
from .problem import Objective, Problem
from .receiving import EITHER, PlaceParameter, latest, received

STEPS, SECONDS = "steps", "seconds"
DECISION, NOW = "decision", "now"
_MADE_AT, _CONTROLS = 0, 7  # columns of a table of plans of robots in the plane, see ``peer_tubes``


class _Standing(NamedTuple):
    """The latest plan of the controller; one made an infinite time ago has no effect."""

    made_at: float  # s, the time before its initial state
    state: Array  # (n,) at step 1 from made_at
    controls: Array  # (N, m) U_{t+1} .. U_{t+N}, as seen from made_at


class _Peers:
    """The latest plans of the other robots, each as a row that the kernels take.

    Positions of others at time 0 may be known in advance.  Each is an anonymous plan to stay there, until a first plan
    replaces the nearest one.
    """

    def __init__(self, places: list[list[float]]) -> None:
        # Their names are not paths.
        self._nobody = {f"[{number}]": tuple(place) for number, place in enumerate(places)}
        self._rows = {
            name: array_of((0.0, float(len(place)), 0.0, *place, *[0.0] * len(place)))
            for name, place in sorted(self._nobody.items())
        }

    def hear(self, plan: Plan) -> None:
        """Store a plan, unless a later one of that robot is known."""
        known = self._rows.get(plan.robot)
        if known is not None and plan.time < known[_MADE_AT]:
            return
        place, velocity = floats(plan.state.position), floats(plan.state.velocity)
        if known is None and self._nobody:
            away = {name: hypot(place[0] - there[0], place[1] - there[1]) for name, there in self._nobody.items()}
            nearest = min(away, key=away.__getitem__)
            del self._nobody[nearest], self._rows[nearest]
        begun = plan.time, float(len(place)), float(len(plan.controls))
        self._rows[plan.robot] = joined((*begun, *place, *velocity), plan.controls)
        if known is None:
            self._rows = dict(sorted(self._rows.items(), key=itemgetter(0)))

    @property
    def names(self) -> tuple[str, ...]:
        """Whose the rows are; of who has sent no plan yet, a name that is no path."""
        return tuple(self._rows)

    def table(self) -> Array:
        """The rows, sorted by name."""
        return stacked(self._rows.values(), _CONTROLS)


class RobustController(TargetModel, Actor):
    """Solves the horizon problem at every trigger and sends the acceleration for the *next* period.

    Connect ``control`` to the vehicle with a delay of one period: solving takes time, so a control computed from the
    state at t acts from t + period on (the paper's U_{t+1}).

    Eq. (2) sums over the states at t + 1 .. t + N periods, none of which is affected by U_{t+N}: in the paper's
    dynamics, a control moves the robot two periods later.  ``horizon_from: decision`` counts the N steps from t +
    period instead, when the first unknown control acts.

    The problem is posed at the time of the robot's own state, whenever that arrives and however long solving takes; the
    plan has that time, and the ages of all other data are counted from it.  The latest plan of each peer is used; the
    distance to keep grows with every period beyond the first between its time and that of the own state (eq. 4).  The
    latest estimate is used, too: an old one is predicted to the time of the own state as its filter would predict it,
    with the process noise, so that its covariance grows.

    With ``objectives`` and a ``role``, the objective changes during the run.  All else stays: the standing plan, to
    which f3 ties the next one, the peers' plans and the estimate.

    Before the first plan or estimate comes, the robot avoids only the positions in ``peers_at_start``, where its own
    ``start`` may be among them.  Plans and estimates that are not finite are ignored; the last good ones are kept.
    Without a finite own state the control is zero, and nothing else is sent.

    A robot with other ``dynamics`` than the paper's plans with its own states and controls.  Its plan is sent to the
    others as accelerations that bring a double integrator to the same places.

    In space (``dimensions: 3``), speed and acceleration stay in ellipsoids (f1 and f2), as those of a ``Vehicle`` do,
    and from the second step on, the plan stays above ``lowest`` and below ``highest`` (f7).  The target is on the
    ground if its estimate is in the plane, and so are peers whose plans are.
    """

    _of_target: Sequence[int] = EITHER  # the dimensions of the estimates that it takes

    trigger = InputPort(object, doc="plan now")
    state = InputPort(BodyState, triggers=False, doc="where the robot is")
    estimate = InputPort(
        Estimate,
        required=False,
        triggers=False,
        doc="estimate of the target; without a connection, there is none to avoid",
    )
    tracks = InputPort(
        Tracks, required=False, triggers=False, doc="estimates of several targets, to avoid and observe all of them"
    )
    peer_plans = InputPort(Plan, multi=True, required=False, triggers=False, doc="plans of the other robots")
    role = InputPort(
        str,
        required=False,
        triggers=False,
        doc="name of one of the objectives, for this plan and all later ones until another role comes",
    )
    control = OutputPort(np.ndarray, shape=(None,), doc="m/s^2, for the period after this one")
    plan = OutputPort(Plan, doc="plan of this robot, for the others")
    violation = OutputPort(float, doc="largest violation of a constraint by the plan in metres; 0 if it keeps all")
    infeasible = OutputPort(int, doc="number of plans so far that broke a constraint")
    iterations = OutputPort(int, doc="Newton (or solver) iterations for this plan")

    dynamics = Parameter(
        Dynamics, None, doc="how the robot moves; if left out, as a DoubleIntegrator with the limits below"
    )
    objective = Parameter(Objective, ReachGoal(), doc="objective of the robot, until a role comes")
    objectives = MappingParameter(Parameter(Objective), {}, doc="objectives by role")
    solver = Parameter(Solver, Barrier(), doc="solver of the problem")
    dimensions = Parameter(int, 2, min=2, max=3, doc="of the robot's positions: 3 if it flies, the height last")
    max_speed = Parameter(float, 8.0, unit="m/s", min=1e-6, doc="Vmax")
    max_acceleration = Parameter(float, 8.0, unit="m/s^2", min=1e-6, doc="Amax")
    climb_speed = Parameter(float, 4.0, unit="m/s", above=0, doc="in space, largest vertical speed, up and down")
    climb_acceleration = Parameter(float, 4.0, unit="m/s^2", above=0, doc="in space, largest vertical acceleration")
    lowest = Parameter(float, 1.0, unit="m", optional=True, doc="in space, height to stay above; none if null")
    highest = Parameter(float, None, unit="m", doc="in space, height to stay below; none if left out")
    horizon = Parameter(int, 10, min=3, doc="N: prediction horizon in periods")
    horizon_from = Parameter(
        str,
        NOW,
        choices=(NOW, DECISION),
        doc="start of the N steps: t, or t + period, when U_{t+1} begins to act",
    )
    period = Parameter(float, 0.1, unit="s", above=0, doc="Delta t: time between two triggers")
    safe_distance = Parameter(
        float, 2.0, unit="m", min=0, doc="Dmin: smallest distance to the target and to other robots"
    )
    margin = Parameter(float, 2.0, unit="1", min=0, doc="alpha: standard deviations to add to Dmin")
    tube_initial = Parameter(float, 0.2, unit="m", min=1e-6, doc="sigma_r0: radius of the reachability set now")
    tube_growth = Parameter(float, 0.4, unit="m", min=0, doc="beta: growth of that radius per unit of tau")
    tube_time = Parameter(str, STEPS, choices=(STEPS, SECONDS), doc="unit of tau in eq. (3)")
    covariance_noise = Parameter(
        bool, True, doc="whether process noise widens the target's predicted covariance, in f4 and in eq. (5)"
    )
    keep_out = array_parameter(
        (None, 3), (), unit="m", doc="in the plane, what stands in the way: x, y, and the distance to keep from there"
    )
    start = PlaceParameter(None, doc="where this robot is at time 0, to tell it from the others in 'peers_at_start'")
    peers_at_start = PlaceParameter(
        (), several=True, doc="positions of robots at time 0, used until their plans come; its own 'start' is left out"
    )
    robot_name = Parameter(
        str, "", doc="name in the plan; if empty, the path of the composite that contains the controller"
    )

    def check(self) -> None:
        super().check()
        self._motion: Dynamics = self.dynamics or DoubleIntegrator(
            dimensions=self.dimensions,
            max_speed=self.max_speed,
            max_acceleration=self.max_acceleration,
            climb_speed=self.climb_speed,
            climb_acceleration=self.climb_acceleration,
        )
        d = self._motion.dimensions
        self._motion.try_out([0.0] * d if self.start is None else self.start.tolist())
        for objective in (self.objective, *self.objectives.values()):
            if reason := self.solver.refuses(self._motion, objective):
                raise ParameterError(f"solver: {reason}")
        if d == 3 and len(self.keep_out):
            raise ParameterError("keep_out: a robot that flies is above what stands in the way; leave it out")
        if len(self.peers_at_start) and self.peers_at_start.shape[1] != d:
            raise ParameterError(f"peers_at_start: places have {self.peers_at_start.shape[1]} numbers; expected {d}")
        if self.start is not None and len(self.start) != d:
            raise ParameterError(f"start: it has {len(self.start)} numbers; expected {d}")
        self.control.change("type", shaped(np.ndarray, (self._motion.controls,)))

    def initialize(self) -> None:
        from .numerics import definitions, reachability
        from .numerics.warm_up import compile_kernels

        motion: Any = self._motion
        d, size = motion.dimensions, motion.controls
        self._d, self._rest = d, np.zeros(size)
        self._is_papers = type(motion) is DoubleIntegrator
        for objective in (self.objective, *self.objectives.values()):
            objective.check_dimensions(d)
        self.solver.prepare()
        compile_kernels(d)
        # Kept, as executing an import takes 1 us each time.
        self._standing_plan, self._peer_tubes = reachability.standing_plan, reachability.peer_tubes
        self._expected_target = reachability.expected_target
        self._name = self.robot_name or enclosing(self.path)
        tau = 1.0 if self.tube_time == STEPS else self.period
        # The kernels count steps from t.  From t + period on there is one more step, and tau is 0 at the first.
        ahead = 1 if self.horizon_from == DECISION else 0
        self._steps = self.horizon + ahead
        self._radius = definitions.sigma_r(
            self.tube_initial - ahead * self.tube_growth * tau, self.tube_growth * tau, np.arange(1.0, self._steps + 1)
        )
        self._room = self.period, self._radius, self.tube_growth, self.safe_distance, self.margin
        self._noise = {2 * d: self.process_noise(d) for d in EITHER}  # by the length of a mean
        self._model = self.covariance_noise, self.kappa, self.period
        # Means (K, N, d), covariances (K, N, d (d + 1) / 2), sigma points (M, d) at step N and their weights, without a
        # target.
        no_means, no_covariances = (np.empty((0, self._steps, columns)) for columns in (d, d * (d + 1) // 2))
        self._nobody = no_means, no_covariances, np.empty((0, d)), np.empty(0)
        places, apart = self.keep_out[:, np.newaxis, :2], self.keep_out[:, 2:]
        self._standing_there = np.repeat(places, self._steps, axis=1), np.repeat(apart, self._steps, axis=1)
        lowest, highest = (self.lowest, self.highest) if d == 3 else (None, None)
        self._heights = -math.inf if lowest is None else lowest, math.inf if highest is None else highest
        self._applied = self._rest  # U_t
        nowhere, nothing = np.zeros(motion.states), np.zeros((self._steps, size))
        self._standing = self._nothing = _Standing(-math.inf, nowhere, nothing)
        own = None if self.start is None else self.start.tolist()
        self._peers = _Peers([place for place in self.peers_at_start.tolist() if place != own])
        self._objective: Objective = self.objective
        self._target: Estimate | None = None
        self._tracks: Tracks | None = None
        self._infeasible = 0

    def fire(self) -> None:
        self._listen()
        if not self.trigger.present:
            return
        own = latest(self.state, (self._d,)) if self.state.present else None
        if own is None or not own.finite:
            self._applied, self._standing = self._rest, self._nothing
            self.control.send(np.zeros(len(self._rest)))
            return
        problem, starts = self._problem(own)
        solution = self.solver.solve(problem, starts)
        controls, violation = solution.controls, solution.violation
        if not finite(controls):  # inputs may be so large that their squares are not, or a solver is wrong
            controls, violation = starts[1], math.inf  # braking
        self._send(own, problem, controls)
        self._infeasible += bool(violation > 0.0)  # which may be a NumPy type
        self.violation.send(float(violation))
        self.infeasible.send(self._infeasible)
        self.iterations.send(int(solution.iterations))

    def _listen(self) -> None:
        """Store the latest estimate and plans, also those that come between triggers or are overtaken by others."""
        for plan in received(self.peer_plans):
            if plan.robot != self._name and plan.finite:
                self._peers.hear(plan)
        for estimate in received(self.estimate, self._of_target):
            if estimate.finite and (self._target is None or estimate.time >= self._target.time):
                self._target = estimate
        for role in self.role.tokens:
            if role not in self.objectives:
                roles = ", ".join(self.objectives) or "none"
                raise EpicycleError(
                    f"{self.path} has no objective for the role {role!r}{did_you_mean(role, self.objectives)}; "
                    f"'objectives' has: {roles}"
                )
            self._objective = self.objectives[role]
        for tracks in received(self.tracks, self._of_target):
            if tracks.finite and (self._tracks is None or tracks.time >= self._tracks.time):
                self._tracks = tracks

    def _send(self, own: BodyState, problem: Problem, controls: Array) -> None:
        self._standing = _Standing(own.time, problem.state, controls)
        told = own
        if self._is_papers:
            accelerations = joined(floats(self._applied), controls[: self.horizon]).reshape(self.horizon + 1, self._d)
        else:
            told, accelerations = self._motion.announced(own, problem.state, controls, self.period)
        self.plan.send(Plan(self._name, own.time, told, accelerations))
        self._applied = read_only(controls[0])
        self.control.send(self._applied)

    # --- the problem ------------------------------------------------------------------------------------

    def _problem(self, own: BodyState) -> tuple[Problem, Array]:
        """The problem, and the starts of its solver (2, N, m): the standing plan from the next period on; braking."""
        now, period, d = own.time, self.period, self._d
        motion: Any = self._motion
        made_at, begun, controls = self._standing
        if self._is_papers:
            # Floats: arithmetic on arrays of two takes ten times as long.
            place, moving, pushed = floats(own.position), floats(own.velocity), floats(self._applied)
            place = tuple([p + period * v for p, v in zip(place, moving, strict=True)])
            moving = tuple([v + period * u for v, u in zip(moving, pushed, strict=True)])
            state, (speed, most) = array_of((*place, *moving)), motion.speed_and_braking(moving)
            tube_centre, tube_radius, starts = self._standing_plan(
                begun[:d], begun[d:], controls, now - made_at, self._radius, state[d:], speed, most, period
            )
        else:
            state = motion.next_state(own, self._applied, period)
            tube_centre, tube_radius, starts = motion.standing_plan(
                begun, controls, now - made_at, self._radius, state, period
            )
        obstacle_mean, obstacle_covariance, samples, weights = self._expected(now)
        peer_mean, peer_distance = self._peer_tubes(self._peers.table(), now, *self._room, d)
        if len(self.keep_out):  # as f5, but nobody who measures
            there, apart = self._standing_there
            peer_mean, peer_distance = np.concatenate((peer_mean, there)), np.concatenate((peer_distance, apart))
        problem = Problem(
            motion, self._objective, self._peers.names, period, state, tube_centre, tube_radius,
            self.safe_distance, self.margin, obstacle_mean, obstacle_covariance, peer_mean, peer_distance, samples,
            weights, *self._heights,
        )  # fmt: skip
        return problem, starts

    def _expected(self, now: float) -> tuple[Array, ...]:
        """Means (K, N, d) and covariances (K, N, d (d + 1) / 2) of all targets, sigma points of each (K M, d) and their
        weights."""
        each = [
            self._expected_target(
                target.mean, target.covariance, self._noise[len(target.mean)], *self._model, now - target.time,
                self._steps, self._d,
            )
            for target in self._targets()
        ]  # fmt: skip
        if len(each) == 1:
            target = self._targets()[0]
            return (*each[0][:2], *self._samples(target, now)) if type(target) is SampledEstimate else each[0]
        if not each:
            return self._nobody
        means, covariances, points, weights = zip(*each, strict=True)
        return np.concatenate(means), np.concatenate(covariances), np.concatenate(points), weights[0]

    def _samples(self, target: SampledEstimate, now: float) -> tuple[Array, Array]:
        """The positions (M, d) of a target's samples at step N, if each moves on as it does, and their weights."""
        ahead, samples = now - target.time + self._steps * self.period, target.samples
        own, places = samples.shape[1] // 2, np.zeros((len(samples), self._d))
        common = min(own, self._d)
        places[:, :common] = samples[:, :common] + ahead * samples[:, own : own + common]
        return places, np.array(target.weights)

    def _targets(self) -> list[Estimate]:
        """The latest estimates of all targets."""
        targets = [self._target] if self._target is not None else []
        if self._tracks is not None:
            targets.extend(self._tracks.estimates)
        return targets
