"""Models as environments for learning agents: Gymnasium's interface for one agent, PettingZoo's for several.

An agent decides at certain times of a model.  It observes the last tokens of output ports, its reward is the sum of
what output ports have sent since its last decision, and what it decides arrives at input ports at the next microstep.
"""

from __future__ import annotations

import copy
import json
import math
import operator
from collections import OrderedDict
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, cast

import gymnasium
import numpy as np
import pettingzoo
from gymnasium import spaces
from gymnasium.utils.seeding import np_random
from numpy.typing import NDArray

from epicycle.actors import Actor, EpicycleError, InputPort, OutputPort, Parameter, brief, did_you_mean
from epicycle.runner import Model, Results, Simulation, load_model
from epicycle.runner.execution.results import STOP_TIME

from .names import Source

Observation = NDArray[np.float64]
CHANGES = ("set", "overrides", "disturb", "aspects", "without_aspects", "types", "max_actors")
KEPT = 32  # models with other options, which are made once


class AgentError(EpicycleError):
    """What an agent and a model cannot exchange."""


@dataclass(frozen=True)
class Agent:
    """What an agent of a model observes and decides, and when.

    ``observe``: output ports that send numbers, or arrays of them, of which it sees the last one, or 0 before there is
    one; ``robot[*].charge`` is that of each robot.  ``act``: input ports that get its decision, each its own number, or
    all the same of a ``Discrete`` space; an input that takes one connection loses the one that it has.  ``reward``: an
    output port whose numbers are added up, or several with their weights.  It decides whenever the output port ``when``
    has sent, or ``every`` so many seconds (a number, or a text with a unit), or, without both, whenever something it
    observes has come.  ``actions`` and ``observations`` are spaces of Gymnasium (default: any numbers).
    """

    observe: Iterable[str]
    act: Iterable[str]
    reward: str | Mapping[str, float]
    actions: spaces.Space[Any] | None = None
    observations: spaces.Box | None = None
    when: str | None = None
    every: float | str | None = None
    weights: Mapping[str, float] = field(init=False)

    def __post_init__(self) -> None:
        for name in ("observe", "act"):
            ports = getattr(self, name)
            object.__setattr__(self, name, (ports,) if isinstance(ports, str) else tuple(ports))
        object.__setattr__(self, "weights", {self.reward: 1.0} if isinstance(self.reward, str) else dict(self.reward))
        if self.observations is not None and len(self.observations.shape) != 1:
            raise AgentError(f"observations are a Box of one dimension, not {self.observations}")
        if self.when is not None and self.every is not None:
            raise AgentError("an agent decides either when=PORT sends or every=SECONDS, not both")
        ports, space = list(self.act), self.actions
        if space is None:
            object.__setattr__(self, "actions", spaces.Box(-np.inf, np.inf, (len(ports),), np.float64))
        elif isinstance(space, spaces.Discrete):
            if not ports:
                raise AgentError(f"{space} needs a port: act is empty")
        elif not isinstance(space, (spaces.Box, spaces.MultiDiscrete, spaces.MultiBinary)):
            raise AgentError(f"actions are a Box, Discrete, MultiDiscrete or MultiBinary space, not {brief(space)}")
        elif (needed := math.prod(space.shape)) != len(ports):
            raise AgentError(
                f"{space} has {needed} numbers, and act has {len(ports)} ports: {', '.join(ports) or 'none'}"
            )


class _Desk(Actor):
    """Where an agent sits in the model; a subclass has its ports."""

    is_source: ClassVar[bool] = True
    of: ClassVar[Agent]

    every = Parameter(float, None, unit="s", above=0, doc="it decides at the start, and again after each such time")

    def initialize(self) -> None:
        self.gained = 0.0
        self.asks = False
        self.decision: list[Any] = []
        self._observed = [(name, self.inputs[f"seen_{place}"]) for place, name in enumerate(self.of.observe)]
        self.seen: list[list[float]] = [[0.0] for _, port in self._observed for _ in range(port.width)]
        self._rewards = [(self.inputs[f"reward_{place}"], each) for place, each in enumerate(self.of.weights.values())]
        self._asked = [self.inputs["trigger"]] if self.of.when is not None else [port for _, port in self._observed]
        self._tick = None if self.every is None else self.wake_in(0.0)

    def fire(self) -> None:
        for place, value in enumerate(self.decision):
            self.outputs[f"act_{place}"].send(value)
        self.decision = []
        channels = [(name, tokens) for name, port in self._observed for tokens in port.by_channel()]
        for place, (name, tokens) in enumerate(channels):
            if tokens:
                self.seen[place] = _numbers(tokens[-1], name)
        for (port, weight), name in zip(self._rewards, self.of.weights, strict=True):
            for token in port.tokens:
                self.gained += weight * _number(token, name)
        if self._tick is None:
            self.asks = self.asks or any(port.present for port in self._asked)
        elif self._tick.due and self.every is not None:
            self._tick, self.asks = self.wake_in(self.every), True

    def decide(self, decision: list[Any]) -> None:
        """Send a decision at the next microstep."""
        self.decision, self.asks = decision, False
        self.wake_in(0.0)

    def take(self) -> float:
        """What has been gained since this was asked last."""
        gained, self.gained = self.gained, 0.0
        return gained


class _Policy(_Desk):
    """An agent's place with somebody who decides; a subclass has the policy."""

    policy: ClassVar[Callable[[Observation], Any]]

    def fire(self) -> None:
        super().fire()
        if self.asks:
            seen = _flat(self.seen)
            self.decide(_decision(self.path, self.of, type(self).policy(np.array(seen)), str(self.tag)))


def _flat(seen: list[list[float]]) -> list[float]:
    return [number for each in seen for number in each]


def _decision(name: str, agent: Agent, action: Any, where: str) -> list[Any]:
    """The tokens of an action; raises ``AgentError`` for what is not among the actions."""
    space, ports = agent.actions, tuple(agent.act)
    if isinstance(space, spaces.Box) and np.shape(action) == space.shape:
        action = np.asarray(action, space.dtype)
    elif not isinstance(space, spaces.Box) and np.ndim(action) == 0:
        action = np.int64(action) if isinstance(action, (int, np.integer)) else action
    if space is None or not space.contains(action):
        raise AgentError(
            f"{name} decides {brief(action)} for {', '.join(ports) or 'nothing'} at {where}: not in {space}"
        )
    numbers: list[Any] = np.asarray(action).ravel().tolist()
    return numbers * len(ports) if isinstance(space, spaces.Discrete) else numbers


def _number(token: Any, port: str) -> float:
    if isinstance(token, (bool, int, float, np.bool_, np.number)) and np.isfinite(token):
        return float(token)
    raise AgentError(f"{port} has sent {brief(token)}, which is not a finite number")


def _numbers(token: Any, port: str) -> list[float]:
    """The numbers of a token: one, or those of an array or list."""
    if isinstance(token, (list, tuple, np.ndarray)):
        return [number for each in token for number in _numbers(each, port)]
    return [_number(token, port)]


def deploy(model: Model, agent: Agent, policy: Callable[[Observation], Any], name: str = "agent") -> Model:
    """Put a policy in an agent's place: the model then runs by itself, and can be compared, falsified and explained.

    ``policy`` gives an action for an observation; it is called within a run and should keep no state.  Returns the
    model.  Raises ``ModelError``, and in a run ``ActorError`` for what is not among the agent's actions.
    """
    _seat(model, name, agent, _Policy, policy=staticmethod(policy))
    return model


def _seat(model: Model, name: str, agent: Agent, base: type[_Desk] = _Desk, **more: Any) -> None:
    """Add an agent to a model, and connect it; raises ``ModelError``."""
    sources = {f"seen_{place}": port for place, port in enumerate(agent.observe)}
    sources |= {f"reward_{place}": port for place, port in enumerate(agent.weights)}
    sources |= {} if agent.when is None else {"trigger": agent.when}
    targets = {f"act_{place}": port for place, port in enumerate(agent.act)}
    ports: dict[str, Any] = {each: InputPort[Any](multi=True) for each in sources}
    ports |= {each: OutputPort[Any](depends_on=()) for each in targets}
    about = {**ports, **more, "of": agent, "__doc__": base.__doc__, "__module__": __name__}
    model.add(type("Agent", (base,), about)(name, every=agent.every))
    for own, port in sources.items():
        model.connect(f"{port} -> {name}.{own}")
    for own, port in targets.items():
        node = model.graph.ports.get(port)
        if node is not None and node.port is not None and not node.port.multi:
            for edge in list(model.graph.incoming(port)):
                model.disconnect(edge.source, port)
        model.connect(f"{name}.{own} -> {port}")


class _World:
    """One run after the other of a model with agents."""

    def __init__(
        self, model: Source, agents: Mapping[str, Agent], until: float | str | None, changes: Mapping[str, Any]
    ) -> None:
        if not agents:
            raise AgentError("there is no agent")
        _check(changes, "a model")
        self.agents = dict(agents)
        self._source, self._until, self._changes = model, until, dict(changes)
        self._models: OrderedDict[str, Model] = OrderedDict()
        self._desks: dict[str, _Desk] = {}
        self.simulation: Simulation | None = None
        self.results: Results | None = None
        self.spaces: dict[str, spaces.Box] = {}
        if any(agent.observations is None for agent in self.agents.values()):
            self.begin(self._model({}).output.seed, None)  # what is observed says how much it is
        for name, agent in self.agents.items():
            own = copy.deepcopy(agent.observations)  # environments do not share the generators of spaces
            self.spaces[name] = own or spaces.Box(-np.inf, np.inf, (len(self._seen(name)),), np.float64)
        self._limits = {name: (space.low.tolist(), space.high.tolist()) for name, space in self.spaces.items()}
        self.simulation = None

    def _model(self, options: Mapping[str, Any]) -> Model:
        """The model with other options, made once; options that are no changes are for others, such as wrappers."""
        if options:
            _check({name: None for name in options if did_you_mean(name, CHANGES)}, "reset")
            options = {name: value for name, value in options.items() if name in CHANGES}
        key = json.dumps(options, sort_keys=True, default=str) if options else ""
        if key in self._models:
            self._models.move_to_end(key)
            return self._models[key]
        if not callable(self._source):
            model = load_model(self._source, partial=True, **{**self._changes, **options})
        elif options or self._changes:
            raise AgentError("a model that a function makes takes no options: let the function have them")
        else:
            model = self._source()
        for name, agent in self.agents.items():
            _seat(model, name, agent)
        if self._until is not None:
            model.stop = self._until
        if model.endless:
            raise AgentError(f"{model.endless}: give until=SECONDS")
        model.check()
        self._models[key] = model
        if len(self._models) > KEPT:
            self._models.popitem(last=False)
        return model

    def begin(self, seed: int, options: Mapping[str, Any] | None) -> None:
        """Start another run, up to the first decision."""
        simulation = Simulation(self._model(options or {}), seed=seed)
        self.simulation, self.results = simulation, None
        self._desks = {name: simulation.actors[name] for name in self.agents}  # type: ignore[misc]
        if (results := self.go_on()) is not None:
            ended = f"{self.running.tag} ({results.stopped})"
            raise AgentError(f"the run ended at {ended}, before {' or '.join(self.agents)} was to decide")

    @property
    def running(self) -> Simulation:
        if self.simulation is None:
            raise AgentError("there is no run yet: reset() comes before step()")
        return self.simulation

    def asking(self) -> list[str]:
        """The agents that are to decide."""
        return [name for name, desk in self._desks.items() if desk.asks]

    def go_on(self) -> Results | None:
        """Run until an agent is to decide, or to the end, which has results."""
        simulation = self.running
        if self.results is not None:
            raise AgentError("the run is over: reset() starts another one")
        if not simulation.advance_until(lambda: bool(self.asking())):
            self.results = simulation.finish()
        return self.results

    def decide(self, name: str, action: Any) -> None:
        """Let an agent decide; raises ``AgentError`` for what is not among its actions, and the run can go on."""
        self._desks[name].decide(_decision(name, self.agents[name], action, str(self.running.tag)))

    def _seen(self, name: str) -> list[float]:
        return _flat(self._desks[name].seen)

    def observation(self, name: str) -> Observation:
        """What an agent sees; raises ``AgentError`` if that is outside of its space."""
        space, seen = self.spaces[name], self._seen(name)
        low, high = self._limits[name]
        if len(seen) != len(low) or not all(map(operator.le, low, seen)) or not all(map(operator.le, seen, high)):
            ports = ", ".join(self.agents[name].observe)
            raise AgentError(f"{name} observes {brief(seen)} of {ports} at {self.running.tag}: not in {space}")
        return np.array(seen, space.dtype)

    def reward(self, name: str) -> float:
        """What an agent has gained since this was asked last."""
        return self._desks[name].take()

    @property
    def is_stopped(self) -> bool:
        """Whether the run ended because its time was up."""
        return self.results is not None and self.results.stopped == STOP_TIME

    @property
    def is_done(self) -> bool:
        """Whether the run ended by itself, such as by ``stop_when``."""
        return self.results is not None and not self.is_stopped

    def info(self) -> dict[str, Any]:
        """The time of the model (s), and at the end its metrics and its digest."""
        found: dict[str, Any] = {"time": self.running.tag.seconds}
        if self.results is not None:
            found |= {"metrics": dict(self.results.metrics), "digest": self.results.digest}
        return found


def _check(options: Mapping[str, Any], who: str) -> None:
    for name in options:
        if name not in CHANGES:
            raise AgentError(f"{who} has no option {name!r}{did_you_mean(name, CHANGES)}; valid: {', '.join(CHANGES)}")


class GymEnv(gymnasium.Env[Any, Any]):
    """A model with one agent, as ``gym`` makes it."""

    def __init__(
        self, model: Source, agent: Agent, *, until: float | str | None = None, name: str = "agent", **changes: Any
    ) -> None:
        assert agent.actions is not None
        self._name, self._world = name, _World(model, {name: agent}, until, changes)
        self.observation_space, self.action_space = self._world.spaces[name], copy.deepcopy(agent.actions)

    @property
    def simulation(self) -> Simulation | None:
        """The present run, if there is one."""
        return self._world.simulation

    @property
    def results(self) -> Results | None:
        """The results of the run, once it is over."""
        return self._world.results

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start a run with a seed, or one drawn by the generator that the last seed began.

        ``options`` change the model as those of ``epicycle.load`` do: ``{"disturb": "wifi_burst"}``.
        """
        super().reset(seed=seed)
        self._world.begin(int(self.np_random.integers(2**31)) if seed is None else seed, options)
        self._world.reward(self._name)  # of before the first decision
        return self._world.observation(self._name), self._world.info()

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Decide, and run to the next decision or to the end."""
        world = self._world
        _ = world.running
        if world.results is None:
            world.decide(self._name, action)
        world.go_on()
        return world.observation(self._name), world.reward(self._name), world.is_done, world.is_stopped, world.info()


class ZooEnv(pettingzoo.AECEnv):  # type: ignore[misc]  # it has no types
    """A model with several agents, which decide in turn, each at its own times; ``infos`` have the model's time.

    Agents that are to decide at the same time do so in the order in which they are given, without seeing each other's
    decisions, which arrive together.
    """

    def __init__(
        self, model: Source, agents: Mapping[str, Agent], *, until: float | str | None = None, **changes: Any
    ) -> None:
        super().__init__()
        self._world = _World(model, agents, until, changes)
        at_once = len({str(agent.every) for agent in agents.values()}) == 1
        self.metadata = {"name": "epicycle", "render_modes": [], "is_parallelizable": at_once}
        self.render_mode = None
        self.possible_agents = list(agents)
        self.agents: list[str] = []
        self.observation_spaces = dict(self._world.spaces)
        self.action_spaces = {name: copy.deepcopy(agent.actions) for name, agent in agents.items()}
        self._random, _ = np_random()

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """What an agent sees."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """What an agent may decide."""
        return cast("spaces.Space[Any]", self.action_spaces[agent])

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> None:
        """Start a run; see ``GymEnv.reset``."""
        if seed is not None:
            self._random, _ = np_random(seed)
        world = self._world
        world.begin(int(self._random.integers(2**31)) if seed is None else seed, options)
        self.agents = list(self.possible_agents)
        for each in self.agents:
            world.reward(each)
        self.rewards = dict.fromkeys(self.agents, 0.0)
        self._cumulative_rewards = dict.fromkeys(self.agents, 0.0)
        self._tell()

    def _tell(self) -> None:
        """Note where the run has come to, and who is next."""
        world = self._world
        self.terminations = dict.fromkeys(self.agents, world.is_done)
        self.truncations = dict.fromkeys(self.agents, world.is_stopped)
        self.infos = {name: world.info() for name in self.agents}
        waiting = world.asking() if world.results is None else self.agents
        self.agent_selection = waiting[0]

    def observe(self, agent: str) -> Observation:
        """What an agent sees now."""
        return self._world.observation(agent)

    def step(self, action: Any) -> None:
        """Let the selected agent decide; once all that are asked have, run to the next decision."""
        name, world = self.agent_selection, self._world
        if self.terminations[name] or self.truncations[name]:
            self._was_dead_step(action)
            return
        world.decide(name, action)
        self._cumulative_rewards[name] = 0.0
        self._clear_rewards()
        if not world.asking():
            world.go_on()
            self.rewards = {each: world.reward(each) for each in self.agents}
        self._tell()
        self._accumulate_rewards()
