"""``epicycle.gym`` and ``epicycle.zoo``, which need their packages only when they are called."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from epicycle.runner.support.extras import needed

from .names import Source

if TYPE_CHECKING:
    from gymnasium import spaces

    from .learning import Agent, GymEnv


def gym(
    model: Source,
    *,
    observe: str | Iterable[str],
    act: str | Iterable[str],
    reward: str | Mapping[str, float],
    actions: spaces.Space[Any] | None = None,
    observations: spaces.Box | None = None,
    when: str | None = None,
    every: float | str | None = None,
    until: float | str | None = None,
    **changes: Any,
) -> GymEnv:
    """A model as a Gymnasium environment; ``Agent`` says what the agent sees and does.

    ``model`` is a packaged one, a file, or a function that makes a ``Model``; ``until`` is the stop time (s, or a text
    with a unit; default: the model's), ``changes`` are those of ``epicycle.load``.  A run that stops by itself is
    terminated, one whose time is up is truncated.  Raises ``ModelError``, ``AgentError``.
    """
    learning = needed("epicycle.bridges.learning", "gym")
    agent = learning.Agent(observe, act, reward, actions, observations, when, every)
    made: GymEnv = learning.GymEnv(model, agent, until=until, **changes)
    return made


def zoo(
    model: Source,
    agents: Mapping[str, Agent],
    *,
    parallel: bool = False,
    until: float | str | None = None,
    **changes: Any,
) -> Any:
    """A model with several agents as a PettingZoo environment; see ``gym``.

    It is an ``AECEnv``, in which each agent decides at its own times; with ``parallel`` a ``ParallelEnv``, for agents
    that all decide ``every`` so many seconds, at once.
    """
    learning = needed("epicycle.bridges.learning", "zoo")
    env = learning.ZooEnv(model, agents, until=until, **changes)
    if not parallel:
        return env
    if not env.metadata["is_parallelizable"] or next(iter(agents.values())).every is None:
        raise learning.AgentError(
            "agents of a parallel environment decide at once: give all of them the same every=SECONDS"
        )
    from pettingzoo.utils import aec_to_parallel

    return aec_to_parallel(env)
