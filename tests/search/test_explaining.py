"""Explanations: the smallest set of acts, what each does, the way to the break, and what is written of them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import yaml

import epicycle
from epicycle.actors import EpicycleError
from epicycle.runner.execution.engine import Interventions, Simulation
from epicycle.runner.interface.cli import main
from epicycle.runner.model.build.load import load_model
from epicycle.runner.model.graph.acts import ActName
from epicycle.runner.search import explaining

# A relay sends what it gets once a second; it must not be silent for longer than two and a half.
TEXT = """
model: relay
parameters: {loss: {value: 0.4, unit: "1"}}
actors:
  clock: {type: Clock, period: 1 s}
  relay: {type: Scale, factor: 2}
  double: {type: Scale, factor: 1}
  sink: {type: Recorder}
connections:
  - clock.output -> relay.input
  - relay.output -> double.input
  - double.output -> sink.input
aspects:
  loss: {type: PacketLoss, probability: "${loss}", at: relay.input}
  noise: {type: Noise, deviation: 0.1, at: clock.output, enabled: false}
run: {stop: 30 s}
monitors:
  heard: always (sends double.output implies eventually from 1 ns to 2.5 s sends double.output)
  alive: always after 1 s eventually within 2.5 s sends double.output
"""


TOO_SHORT = (
    "monitor property cannot be judged in this run of relay (the run was too short to tell): there is nothing "
    "to explain"
)


@pytest.fixture
def model(tmp_path: Path) -> Path:
    file = tmp_path / "relay.yaml"
    file.write_text(TEXT, encoding="utf-8")
    return file


def losses(found: epicycle.Explanation) -> list[int]:
    return [name.token for name in found.names]


@pytest.mark.parametrize("seed", range(12))
def test_two_losses_in_a_row_suffice(model: Path, seed: int) -> None:
    made = load_model(model)
    results = Simulation(made, seed=seed, acts=Interventions()).run()
    if results.monitors["alive"].holds is not False:
        with pytest.raises(
            EpicycleError, match="monitor alive holds in this run of relay: there is nothing to explain"
        ):
            epicycle.explain(model, "alive", seed=seed)
        return
    found = epicycle.explain(model, "alive", seed=seed)
    names = found.names
    assert len(names) == 2
    assert names[1].token == names[0].token + 1
    # By brute force: with these it is broken, without one of them it is not.
    for exactly in ([*names], names[:1], names[1:], []):
        verdict = Simulation(made, seed=seed, acts=Interventions(frozenset(exactly))).run().monitors["alive"]
        assert verdict.holds is (exactly != names)
    assert all(effect.without == effect.alone == float("inf") for effect in found.effects)


def broken_seed(model: Path) -> int:
    made = load_model(model)
    return next(seed for seed in range(50) if Simulation(made, seed=seed).run().monitors["alive"].holds is False)


def test_what_is_said_and_written(model: Path, tmp_path: Path) -> None:
    seed = broken_seed(model)
    found = epicycle.explain(model, "alive", seed=seed)
    first, second = (effect.act for effect in found.effects)
    times = f"{first.time / 1e9:g} s and {second.time / 1e9:g} s"
    broken = found.verdict_of_set.time
    assert broken is not None
    assert found.sentence == (
        f"2 faults of {found.acts} suffice: loss dropped a token of clock.output at relay.input at {times}. "
        "With these alone, alive (always after 1 s eventually within 2.5 s sends double.output) is broken at "
        f"{broken:.9g} s. Without any single one of them, it holds."
    )
    assert [step.port for step in found.steps] == ["relay.output", "double.output"]
    assert {step.time for step in found.steps} == {first.time / 1e9}
    assert all(step.token is None or step.instead is None for step in found.steps)
    written = found.save(tmp_path / "out")
    assert [path.name for path in written] == ["explanation.yaml", "explanation.json", "explanation.html"]
    facts = json.loads(written[1].read_text(encoding="utf-8"))
    assert facts["sentence"] == found.sentence
    assert facts["effects"][0]["act"]["name"] == ["loss", "relay.input", first.name.token]
    assert yaml.safe_load(written[0].read_text(encoding="utf-8"))["exactly"] == [
        {"aspect": "loss", "at": "relay.input", "token": act.name.token} for act in (first, second)
    ]
    # Anybody can run it.
    again = epicycle.run(model, seed=seed, disturb=written[0])
    assert again.monitors["alive"] == found.verdict_of_set
    assert again.aspects["loss"] == {"dropped": 2}
    assert "1 fault" not in str(found)
    assert "robustness without it" in str(found)


def test_the_monitor_that_is_broken_first_by_default(model: Path, tmp_path: Path) -> None:
    found = epicycle.explain(model, seed=broken_seed(model))
    verdicts = epicycle.run(model, seed=broken_seed(model)).monitors
    times = {name: each.time for name, each in verdicts.items() if each.holds is False and each.time is not None}
    first, *others = sorted(times, key=lambda name: times[name])
    assert found.monitor == first
    assert found.also == tuple(others)
    assert others
    assert found.sentence.endswith(f" Also broken in the whole run: {', '.join(others)}.")
    with pytest.raises(EpicycleError) as raised:
        epicycle.explain(model, set={"loss": 0})
    assert str(raised.value) == (
        "monitor heard holds in this run of relay and monitor alive holds in this run of relay: there is nothing to "
        "explain"
    )


def test_a_model_that_breaks_by_itself(model: Path) -> None:
    found = epicycle.explain(model, "always double.output < 10", seed=1)
    assert found.effects == []
    assert found.sentence == (
        "property (always double.output < 10) is broken at 5 s without any fault of an aspect: the model breaks it by "
        "itself."
    )
    assert found.disturbance().endswith("exactly: []\n")


@pytest.mark.parametrize(
    ("monitor", "message"),
    [
        ("aliv", "relay has no monitor 'aliv', did you mean 'alive'?\n   help: its monitors: heard, alive"),
        ("eventually within 1 min double.output < 0", TOO_SHORT),
    ],
)
def test_mistakes(model: Path, monitor: str, message: str) -> None:
    with pytest.raises(EpicycleError) as raised:
        epicycle.explain(model, monitor)
    assert str(raised.value) == message


def test_a_search_that_is_killed_continues_to_the_same_answer(model: Path, tmp_path: Path) -> None:
    seed = broken_seed(model)
    whole = epicycle.explain(model, "alive", seed=seed, out=tmp_path / "whole")
    lines = next((tmp_path / "whole").glob("tried-*.jsonl")).read_text(encoding="utf-8").splitlines(keepends=True)
    assert len(lines) > 5
    part = tmp_path / "part"
    part.mkdir()
    name = next((tmp_path / "whole").glob("tried-*.jsonl")).name
    # Killed in the middle of a line.
    (part / name).write_text("".join(lines[:4]) + lines[4][: len(lines[4]) // 2], encoding="utf-8")
    again = epicycle.explain(model, "alive", seed=seed, out=part)
    assert again.names == whole.names
    assert again.effects == whole.effects
    assert again.runs < whole.runs
    assert (part / name).read_text(encoding="utf-8").splitlines(keepends=True)[:4] == lines[:4]


def test_the_command(model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    seed, out = broken_seed(model), tmp_path / "out"
    words = ["explain", str(model), "--seed", str(seed), "--monitor", "alive", "--out", str(out)]
    assert main(words) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("2 faults of ")
    assert f"wrote {out / 'explanation.html'}" in printed
    assert main([*words, "--json", "--no-page"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["command"] == ["epicycle", "run", str(model), "--seed", str(seed)]
    # The folder of a run will do as well.
    assert main(["run", str(model), "--seed", str(seed), "--out", str(tmp_path / "run"), "--check"]) == 3
    capsys.readouterr()
    assert main(["explain", str(tmp_path / "run"), "--monitor", "alive", "--out", str(out), "--json", "--no-page"]) == 0
    assert json.loads(capsys.readouterr().out)["effects"] == facts["effects"]
    assert main(["explain", str(model), "--monitor", "alive2"]) == 2
    assert "did you mean 'alive'?" in capsys.readouterr().err


def test_the_command_that_is_saved_makes_the_run(
    model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    types, out = tmp_path / "types_of_the_explained.py", tmp_path / "out"
    types.write_text("from epicycle.actors import Scale\n\n\nclass OwnScale(Scale):\n    pass\n", encoding="utf-8")
    model.write_text(TEXT.replace("{type: Scale, factor: 1}", "{type: OwnScale, factor: 1}"), encoding="utf-8")
    further = ["--max-actors", "50", "--types", str(types)]
    seed = next(seed for seed in range(50) if main(["run", str(model), "--seed", str(seed), *further, "--check"]) == 3)
    capsys.readouterr()
    words = ["explain", str(model), "--seed", str(seed), "--monitor", "alive", "--out", str(out), "--json", "--no-page"]
    assert main([*words, *further]) == 0
    said = json.loads(capsys.readouterr().out)["command"]
    assert said == ["epicycle", "run", str(model), "--types", str(types), "--max-actors", "50", "--seed", str(seed)]
    assert main([*said[1:], "--check"]) == 3


# -- one run, and not two ---------------------------------------------------------------------------------------------


@pytest.fixture
def twice(tmp_path: Path) -> Path:
    """What is lost before the relay shifts the numbers of what is lost behind it."""
    file = tmp_path / "twice.yaml"
    behind = '  behind: {type: PacketLoss, probability: "${loss}", at: double.input}\n  noise:'
    file.write_text(TEXT.replace("  noise:", behind), encoding="utf-8")
    return file


@pytest.mark.slow
def test_all_times_are_those_of_the_run_of_the_set(twice: Path) -> None:
    made, moved, elsewhere = load_model(twice), 0, 0
    for seed in range(12):
        found = epicycle.explain(twice, "alive", seed=seed)
        results = Simulation(made, seed=seed, acts=Interventions(frozenset(found.names))).run()
        assert [effect.act for effect in found.effects] == results.acts
        assert found.verdict_of_set == results.monitors["alive"]
        whole = {act.name: act for act in Simulation(made, seed=seed, acts=Interventions()).run().acts}
        assert [effect.whole for effect in found.effects] == [whole[name] for name in found.names]
        moved += any(effect.has_moved for effect in found.effects)
        elsewhere += found.verdict.time != found.verdict_of_set.time
    assert moved
    assert elsewhere


def test_an_act_that_is_another_in_the_whole_run_is_told(twice: Path) -> None:
    found = epicycle.explain(twice, "alive", seed=3)
    assert found.sentence == (
        "2 faults of 17 suffice: behind dropped a token of relay.output at double.input at 9 s; loss dropped a token "
        "of clock.output at relay.input at 10 s. With these alone, alive (always after 1 s eventually within 2.5 s "
        "sends double.output) is broken at 8 s (in the whole run at 7 s). Without any single one of them, it holds. "
        "One fault is not the same in the whole run, which takes another course: behind at double.input, token 10: at "
        "12 s, another token."
    )
    assert "in the whole run" in str(found).split("\n\n")[1].splitlines()[0]


# -- a search that ends too soon --------------------------------------------------------------------------------------

# Only many delays together make the last token late; there are some 400 acts.
LATE = """
model: late
actors:
  clock: {type: Clock, period: 100 ms}
  relay: {type: Scale, factor: 1}
  sums: {type: Accumulator}
  sink: {type: Recorder}
connections:
  - clock.output -> relay.input
  - relay.output -> sums.input
  - sums.output -> sink.input
aspects:
  loss: {type: PacketLoss, probability: 0.5, at: relay.input}
  slow: {type: Latency, delay: 10 ms, jitter: 50 ms, at: sums.input}
run: {stop: 20 s}
monitors:
  enough: eventually within 20 s sums.output >= 12000
"""


@pytest.fixture
def late(tmp_path: Path) -> Path:
    file = tmp_path / "late.yaml"
    file.write_text(LATE, encoding="utf-8")
    return file


def breaks(file: Path, found: epicycle.Explanation) -> bool:
    """Whether what was told breaks the property, by the disturbance that is written."""
    folder = file.parent / "check"
    written = found.save(folder, page=False)
    again = epicycle.run(file, seed=found.seed, disturb=written[0])
    assert again.monitors[found.monitor] == found.verdict_of_set
    return again.monitors[found.monitor].holds is False


@pytest.mark.slow
def test_a_limit_of_runs(late: Path, tmp_path: Path) -> None:
    told: list[tuple[int, int]] = []

    def tell(runs: int, acts: int) -> None:
        told.append((runs, acts))

    found = epicycle.explain(late, "enough", seed=1, runs=40, out=tmp_path / "out", progress=tell)
    assert [runs for runs, _ in told] == sorted(runs for runs, _ in told)
    assert told[-1][0] == 40
    assert [acts for _, acts in told] == sorted((acts for _, acts in told), reverse=True)
    assert "The search ended at its limit of 40 runs: the set may not be minimal." in found.sentence
    assert breaks(late, found)
    # The same again, and further with more runs, from what is noted.
    again = epicycle.explain(late, "enough", seed=1, runs=40, out=tmp_path / "out")
    assert again.names == found.names
    assert again.runs < 10
    more = epicycle.explain(late, "enough", seed=1, runs=60, out=tmp_path / "out")
    assert len(more.names) <= len(found.names)
    assert more.runs < 30
    with pytest.raises(EpicycleError, match=r"^runs: '0' is not a whole number from 1 to 1e9$"):
        epicycle.explain(late, "enough", runs=0)


def test_an_interrupt_tells_the_smallest_set_so_far(late: Path) -> None:
    def tell(runs: int, acts: int) -> None:
        if runs == 12:
            raise KeyboardInterrupt

    found = epicycle.explain(late, "enough", seed=1, progress=tell)
    assert "The search was interrupted: the set may not be minimal." in found.sentence
    assert breaks(late, found)


def test_an_interrupted_command(
    late: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(explaining, "minimal", interrupted)
    words = ["explain", str(late), "--seed", "1", "--monitor", "enough", "--out", str(tmp_path / "out")]
    assert main(words) == 130
    printed = capsys.readouterr()
    assert "The search was interrupted: the set may not be minimal." in printed.out
    assert [line for line in printed.out.splitlines() if line.startswith("wrote")] == [
        f"wrote {tmp_path / 'out' / 'explanation.yaml'}",
        f"wrote {tmp_path / 'out' / 'explanation.json'}",
    ]
    assert printed.err == ""


def interrupted(*_: object) -> list[ActName]:
    raise KeyboardInterrupt


def test_what_is_noted_is_short(late: Path, tmp_path: Path) -> None:
    """A line for each run, and no names."""
    epicycle.explain(late, "enough", seed=1, runs=60, out=tmp_path)
    lines = next(tmp_path.glob("tried-*.jsonl")).read_text(encoding="utf-8").splitlines()
    assert len(lines) >= 50
    assert sum(map(len, lines)) < 60 * 150


@pytest.mark.slow
def test_the_acts_of_one_aspect(late: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    words = ["explain", str(late), "--seed", "1", "--monitor", "enough", "--only", "slow", "--out", str(out)]
    assert main([*words, "--no-page"]) == 0
    assert capsys.readouterr().out.splitlines()[0] == (
        "enough (eventually within 20 s sums.output >= 12000) is broken at 20 s without any fault of slow: other "
        "aspects or the model itself break it."
    )
    assert main([*words[:-3], "loss", "--out", str(out), "--runs", "30", "--no-page"]) == 0
    said = capsys.readouterr().out.splitlines()[0]
    facts = json.loads((out / "explanation.json").read_text(encoding="utf-8"))
    assert facts["only"] == ["loss"]
    assert {each["act"]["name"][0] for each in facts["effects"]} == {"loss"}
    assert {each[0] for each in facts["others"]} == {"slow"}
    assert said.endswith(f"The faults of other aspects ({len(facts['others'])}) happened as well.")
    again = epicycle.run(late, seed=1, disturb=out / "explanation.yaml")
    assert again.monitors["enough"].holds is False
    assert again.aspects["loss"]["dropped"] == len(facts["effects"])
    assert main([*words[:-3], "los"]) == 2
    assert capsys.readouterr().err == (
        "error: late has no aspect 'los', did you mean 'loss'?\n   help: its aspects: loss, slow\n"
    )


# -- the paper --------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_chosen_set_in_the_paper() -> None:
    """What is told of a run of the paper's scenario, checked by brute force."""
    check_paper(134)


def check_paper(seed: int) -> int:
    made = load_model("collision_avoidance", set={"disturbance": 0.5})
    made.monitor("near", "always clearance.distance >= 3.7 m")

    def holds(names: list[ActName]) -> Any:
        return Simulation(made, seed=seed, acts=Interventions(frozenset(names))).run().monitors["near"].holds

    found = epicycle.explain(made, "near", seed=seed)
    names = found.names
    assert names
    assert holds(names) is False
    assert holds([]) is True
    for each in names:
        assert holds([other for other in names if other != each]) is True
    assert found.steps[-1].port == "clearance.distance"
    return len(names)


@pytest.mark.slow
def test_ten_seeds_of_the_paper_with_the_least_margin() -> None:
    """Of 400 seeds at 50 %, none comes within 2 m: the ten that come nearest and would not without any act."""
    made = load_model("collision_avoidance", set={"disturbance": 0.5})
    nearest = []
    for seed in range(400):
        with_acts = Simulation(made, seed=seed).run().metrics["min_obstacle_distance"]
        if (
            with_acts
            < 3.7
            <= Simulation(made, seed=seed, acts=Interventions(())).run().metrics["min_obstacle_distance"]
        ):
            nearest.append((with_acts, seed))
    assert min(nearest)[0] > 2.0
    sizes = [check_paper(seed) for _, seed in sorted(nearest)[:10]]
    assert len(sizes) == 10
    print(f"sizes of the sets: {sizes}, least distances: {[round(each, 3) for each, _ in sorted(nearest)[:10]]}")
