"""Models as environments for learning agents."""

from __future__ import annotations

import subprocess
import sys
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")
pettingzoo_test = pytest.importorskip("pettingzoo.test")

import epicycle  # noqa: E402
from epicycle.actors import PoissonClock, Random, Recorder, Scale  # noqa: E402
from epicycle.bridges import Agent, AgentError  # noqa: E402
from epicycle.runner import ActorError, Model  # noqa: E402

spaces = gymnasium.spaces


def drift() -> Model:
    """A number that a random clock moves, and that an agent scales."""
    model = Model("drift", stop=20.0, seed=1)
    clock = model.add(PoissonClock("clock", mean_interval=0.5))
    noise = model.add(Random("noise", distribution={"type": "Uniform", "low": -1.0, "high": 1.0}))
    scaled = model.add(Scale("scaled", factor=1.0))
    kept = model.add(Recorder("kept"))
    model.connect(clock.output, noise.trigger)
    model.connect(noise.output, scaled.input)
    model.connect(scaled.output, kept.input)
    model.metric("sent", of=scaled.output, take="count")
    return model


BOX = spaces.Box(-1.0, 1.0, (1,), np.float64)
DRIFT: dict[str, Any] = {
    "observe": "noise.output",
    "act": "scaled.factor",
    "reward": {"scaled.output": -1.0},
    "actions": BOX,
    "observations": spaces.Box(-1.0, 1.0, (1,), np.float64),
}


def queue(**options: Any) -> Any:
    """A queue whose server takes the time that the agent says."""
    given: dict[str, Any] = {
        "observe": "server.size",
        "act": "server.service_time",
        "reward": {"server.size": -1.0},
        "actions": spaces.Box(0.0, 1.0, (1,), np.float64),
        "every": 5.0,
        "until": 200.0,
    }
    return epicycle.gym("mm1", **{**given, **options})


@pytest.mark.parametrize("make", [lambda: epicycle.gym(drift, **DRIFT), queue], ids=["drift", "queue"])
def test_check_env(make: Any) -> None:
    from gymnasium.utils.env_checker import check_env

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*(render|spec|infinity).*")
        check_env(make(), skip_render_check=True)


def agents(**options: Any) -> dict[str, Agent]:
    """Two agents that scale the same noise, each at its own times."""
    given: dict[str, Any] = {"observe": "noise.output", "actions": BOX, "observations": DRIFT["observations"]}
    return {
        "agent_0": Agent(**{**given, "act": "scaled.factor", "reward": "scaled.output", "every": 0.5, **options}),
        "agent_1": Agent(
            **{**given, "act": "scaled.offset", "reward": {"scaled.output": -1.0}, "every": 0.7, **options}
        ),
    }


def test_aec_passes_the_tests_of_pettingzoo() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*(render|human|infinity|single number).*")
        pettingzoo_test.api_test(epicycle.zoo(drift, agents()), num_cycles=200, verbose_progress=False)
    pettingzoo_test.seed_test(lambda: epicycle.zoo(drift, agents()), num_cycles=50)


def test_agents_that_decide_at_once_are_parallel() -> None:
    def make() -> Any:
        return epicycle.zoo(drift, agents(every=0.5), parallel=True)

    pettingzoo_test.parallel_api_test(make(), num_cycles=200)
    pettingzoo_test.parallel_seed_test(make, num_cycles=50)
    with pytest.raises(AgentError) as caught:
        epicycle.zoo(drift, agents(), parallel=True)
    assert str(caught.value) == (
        "agents of a parallel environment decide at once: give all of them the same every=SECONDS"
    )


def test_agents_decide_at_their_own_times_of_the_model() -> None:
    env = epicycle.zoo(drift, agents())
    env.reset(seed=3)
    turns = []
    for name in env.agent_iter(max_iter=8):
        turns.append((name, env.infos[name]["time"]))
        env.step(np.array([1.0]))
    assert turns == [
        ("agent_0", 0.0),
        ("agent_1", 0.0),
        ("agent_0", 0.5),
        ("agent_1", 0.7),
        ("agent_0", 1.0),
        ("agent_1", 1.4),
        ("agent_0", 1.5),
        ("agent_0", 2.0),
    ]


def rollout(env: Any, seed: int, options: Any = None) -> tuple[list[float], dict[str, Any]]:
    seen, _ = env.reset(seed=seed, options=options)
    found, over = [*seen], False
    while not over:
        seen, reward, terminated, truncated, info = env.step(np.array([0.5 + 0.4 * np.sign(seen[0])]))
        found += [*seen, reward]
        over = terminated or truncated
    return found, info


def test_the_same_seed_is_the_same_trajectory() -> None:
    one, info = rollout(queue(), 3)
    two, other = rollout(queue(), 3)
    assert (one, info["digest"]) == (two, other["digest"])
    assert info["time"] <= 200
    assert len(one) == 1 + 2 * 40
    assert set(info["metrics"]) >= {"mean_number", "mean_wait"}
    assert rollout(queue(), 4)[1]["digest"] != info["digest"]


def test_the_same_over_processes() -> None:
    def make() -> Any:
        return queue()

    found = []
    for kind in (gymnasium.vector.SyncVectorEnv, gymnasium.vector.AsyncVectorEnv):
        env = kind([make, make])
        seen, _ = env.reset(seed=[1, 2])
        seens = [seen]
        for _ in range(30):
            seens.append(env.step(np.full((2, 1), 0.6))[0])
        found.append(np.array(seens))
        env.close()
    assert np.array_equal(*found)
    assert found[0][:, 0].tolist() != found[0][:, 1].tolist()


def test_aspects_are_options_of_a_reset(tmp_path: Path) -> None:
    file = tmp_path / "lost.yaml"
    file.write_text("disturbance: lost\naspects:\n  lost: {type: PacketLoss, probability: 0.5, at: server.input}\n")
    env = queue()
    plain, info = rollout(env, 3)
    lossy, disturbed = rollout(env, 3, {"disturb": str(file)})
    assert disturbed["metrics"]["customers"] < info["metrics"]["customers"]
    assert rollout(env, 3)[0] == plain != lossy
    assert rollout(env, 3, {"set": {"load": 0.3}})[1]["metrics"]["mean_number"] < info["metrics"]["mean_number"]
    with pytest.raises(AgentError) as caught:
        env.reset(options={"disturbs": "wifi_burst"})
    assert str(caught.value) == (
        "reset has no option 'disturbs', did you mean 'disturb'?; valid: set, overrides, disturb, aspects, "
        "without_aspects, types, max_actors"
    )


def test_a_policy_in_its_place_makes_the_run_of_the_environment() -> None:
    from epicycle.bridges import deploy
    from epicycle.runner import Simulation, load_model

    def policy(seen: Any) -> Any:
        return np.array([0.5 + 0.4 * np.sign(seen[0])])

    agent = Agent("server.size", "server.service_time", {"server.size": -1.0}, spaces.Box(0.0, 1.0, (1,)), every=5.0)
    results = Simulation(deploy(load_model("mm1"), agent, policy), seed=3).run(until=199.0)
    _, info = rollout(queue(actions=spaces.Box(0.0, 1.0, (1,)), until=199.0), 3)
    assert results.digest == info["digest"]


def test_what_an_agent_may_not_decide_loses_no_run() -> None:
    env = queue()
    env.reset(seed=1)
    for action, shown in ((np.array([np.nan]), "[nan]"), (np.array([3.0]), "[3.0]")):
        with pytest.raises(AgentError) as caught:
            env.step(action)
        assert str(caught.value) == (
            f"agent decides {shown} for server.service_time at (0 s, 1): not in Box(0.0, 1.0, (1,), float64)"
        )
    env.step(np.array([0.5]))
    assert env.simulation.tag.seconds >= 5.0


def test_what_an_agent_observes_must_be_numbers_of_its_space() -> None:
    env = queue(observations=spaces.Box(0.0, 1.0, (1,), np.float64), until=2000.0)
    env.reset(seed=1)
    with pytest.raises(AgentError) as caught:
        [env.step(np.array([1.0])) for _ in range(400)]
    assert str(caught.value) == (
        "agent observes [3.0] of server.size at (20 s, 1): not in Box(0.0, 1.0, (1,), float64)"
    )

    with pytest.raises(ActorError) as failed:
        epicycle.gym(nan_model, observe="worse.output", act="scaled.factor", reward="scaled.output", every=1)
    assert str(failed.value).splitlines()[0] == (
        "agent failed in fire() at (0 s, 1): worse.output has sent nan, which is not a finite number"
    )


def nan_model() -> Model:
    model = drift()
    one = model.add(epicycle.actors.Const("one", value=1.0))
    model.add(Scale("worse", factor=float("inf"), offset=float("-inf")))
    model.connect(one.output, "worse.input")
    return model


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"when": "server.size"}, "an agent decides either when=PORT sends or every=SECONDS, not both"),
        (
            {"actions": spaces.Box(0, 1, (2,))},
            "Box(0.0, 1.0, (2,), float32) has 2 numbers, and act has 1 ports: server.service_time",
        ),
        (
            {"actions": spaces.Text(3)},
            "actions are a Box, Discrete, MultiDiscrete or MultiBinary space, not Text(1, 3, charset=...)",
        ),
        ({"sets": {}}, "a model has no option 'sets', did you mean 'set'?; valid: set, overrides, disturb, aspects, "),
    ],
)
def test_mistakes_are_reported(given: dict[str, Any], message: str) -> None:
    with pytest.raises(AgentError) as caught:
        queue(**given)
    assert str(caught.value).startswith(message.partition("charset")[0])


def test_steps_come_between_reset_and_end() -> None:
    env = queue(until=10.0)
    with pytest.raises(AgentError) as caught:
        env.step(np.array([0.5]))
    assert str(caught.value) == "there is no run yet: reset() comes before step()"
    rollout(env, 1)
    with pytest.raises(AgentError) as caught:
        env.step(np.array([0.5]))
    assert str(caught.value) == "the run is over: reset() starts another one"


def test_without_the_packages_the_message_says_what_to_install() -> None:
    program = (
        "import sys; sys.modules['gymnasium'] = None\nimport epicycle\nfrom epicycle import *\n"
        "try:\n    epicycle.gym('mm1', observe='a', act='b', reward='c')\n"
        "except epicycle.EpicycleError as error:\n    print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "gym needs the package gymnasium, which is not installed: pip install 'epicycle[rl]'\n"


@pytest.mark.slow
def test_resets_are_fast() -> None:
    env = queue()
    env.reset(seed=1)
    begin = time.process_time()
    for seed in range(2000):
        env.reset(seed=seed)
    assert 2000 / (time.process_time() - begin) > 300  # 1,000 and more on an idle machine


def test_all_instances_are_observed_and_rewarded_by_one_name(tmp_path: Path) -> None:
    path = tmp_path / "three.yaml"
    path.write_text(
        "model: three\n"
        "actors:\n"
        "  one: {type: Ramp, count: 3, init: '${10 * index}'}\n"
        "  clock: {type: Clock, period: 1 s}\n"
        "  goes: {type: Recorder}\n"
        "connections:\n"
        "  - clock.output -> one[*].trigger\n",
        encoding="utf-8",
    )
    act = {"act": "goes.input", "every": "2 s", "until": 10.0}
    env = epicycle.gym(path, observe="one[*].output", reward={"one[*].output": 1.0}, **act)
    assert env.observation_space.shape == (3,)
    seen, _ = env.reset(seed=1)
    assert seen.tolist() == [0.0, 10.0, 20.0]
    seen, reward, *_ = env.step(np.zeros(1))
    assert seen.tolist() == [2.0, 12.0, 22.0]
    assert reward == 1.0 + 11.0 + 21.0 + 2.0 + 12.0 + 22.0
    env = epicycle.gym(path, observe=["one[2].output", "one[0..1].output"], reward="one[0].output", **act)
    assert env.reset(seed=1)[0].tolist() == [20.0, 0.0, 10.0]
