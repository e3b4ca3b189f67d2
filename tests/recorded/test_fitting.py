"""Models fitted to measured traces: known parameters are found again, tests have their level, files are checked."""

from __future__ import annotations

import json
import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

import epicycle
from epicycle.aspects import GilbertElliott, Latency, PacketLoss, PortAspect
from epicycle.runner.interface.cli import main
from epicycle.runner.recorded.delays import delay_laws
from epicycle.runner.recorded.losses import Channel, LossModel, gilbert, log_likelihood, loss_models, run_lengths, runs
from tests.aspects.bench import Bench
from tests.aspects.laws import lost_of

COUNT = 20_000
# More of them repeat the proof.
SEEDS = pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 3))])


def losses_of(aspect: PortAspect, seed: int, count: int = COUNT) -> np.ndarray:
    return lost_of(Bench(aspect, seed).play(range(count)), count)


def best(found: list[LossModel]) -> LossModel:
    return min(found, key=lambda each: each.bic)


# -- losses -----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@SEEDS
@pytest.mark.parametrize(
    "truth",
    [
        {"p": 0.02, "r": 0.1, "loss_bad": 0.8, "loss_good": 0.05},
        {"p": 0.05, "r": 0.2, "loss_bad": 0.9, "loss_good": 0.01},
        {"p": 0.005, "r": 0.05, "loss_bad": 0.6, "loss_good": 0.0},
    ],
    ids=str,
)
def test_a_hidden_channel_is_found_again(truth: dict[str, float], seed: int) -> None:
    losses = losses_of(GilbertElliott(**truth), seed)
    found = best(loss_models(losses))
    assert found.name == "Gilbert-Elliott"
    # By the likelihood, the truth lies within the joint 99.9 % region around the estimate.
    truly = log_likelihood(losses.astype(np.uint8), Channel(**truth))
    assert 0.0 <= 2.0 * (found.log_likelihood - truly) <= stats.chi2.ppf(0.999, 4)
    for name, value in truth.items():
        assert found.parameters[name] == pytest.approx(value, rel=0.35, abs=0.02)
    assert found.runs is not None
    assert found.runs.p > 0.001
    assert found.gain is not None
    assert found.gain.p < 1e-6


@pytest.mark.slow
@SEEDS
def test_bursts_are_found_again_and_no_more_is_made_of_them(seed: int) -> None:
    found = best(loss_models(losses_of(GilbertElliott(p=1 / 12, r=0.25), seed)))
    assert found.name == "Gilbert"
    share = 0.25
    for name, value, seen in (("p", 1 / 12, COUNT * (1 - share)), ("r", 0.25, COUNT * share)):
        error = math.sqrt(value * (1 - value) / seen)
        assert abs(found.parameters[name] - value) <= stats.norm.ppf(0.9995) * error
    assert found.runs is not None
    assert found.runs.p > 0.001


@SEEDS
def test_independent_losses_stay_independent(seed: int) -> None:
    found = best(loss_models(losses_of(PacketLoss(probability=0.2), seed)))
    assert (found.name, found.aspect) == ("independent", "PacketLoss")
    low, high = stats.binom.interval(0.999, COUNT, 0.2)
    assert low <= found.parameters["probability"] * COUNT <= high


def test_the_likelihood_is_that_of_the_definition() -> None:
    """The sum over all ways through the hidden states."""
    channel = Channel(0.3, 0.4, 0.7, 0.1)
    losses = np.array([1, 0, 1, 1, 0], np.uint8)
    whole = 0.0
    for way in range(2**5):
        states = [way >> index & 1 for index in range(5)]
        probability = channel.bad if states[0] else 1 - channel.bad
        for before, after in pairwise(states):
            probability *= (0.6 if after else 0.4) if before else (0.3 if after else 0.7)
        for bad, lost in zip(states, losses, strict=True):
            share = 0.7 if bad else 0.1
            probability *= share if lost else 1 - share
        whole += probability
    assert log_likelihood(losses, channel) == pytest.approx(math.log(whole), rel=1e-12)
    assert log_likelihood(losses, Channel(0.0, 1.0)) == -math.inf  # impossible


@pytest.mark.parametrize("lost", [[1, 0, 0, 0, 0, 0], [0, 0, 0, 1, 1, 1], [1, 1, 0], [0, 1]])
def test_bursts_are_possible_where_only_one_kind_of_change_is_seen(lost: list[int]) -> None:
    """Otherwise, whatever is compared with them were certainly better."""
    independent, bursts, hidden = loss_models(np.array(lost, bool))
    assert all(math.isfinite(each.log_likelihood) for each in (independent, bursts, hidden))
    assert hidden.gain is not None
    assert hidden.gain.p > 0.05


def test_runs_at_the_ends_are_cut_off() -> None:
    lost, kept = runs(np.array([1, 1, 0, 0, 0, 1, 0, 1, 1, 0], np.uint8))
    assert (lost.tolist(), kept.tolist()) == ([1, 2], [3, 1])
    lost, kept = runs(np.array([0, 1, 1, 0, 0, 1], np.uint8))
    assert (lost.tolist(), kept.tolist()) == ([2], [2])


def test_the_test_of_runs_has_its_level_and_its_power() -> None:
    """Of 200 true models, about 5 % are refused at that level; a wrong one always is."""
    refused = 0
    for seed in range(200):
        g = np.random.default_rng(seed)
        bursts = np.concatenate([np.repeat([0, 1], [g.geometric(0.1), g.geometric(0.3)]) for _ in range(300)])
        losses, share = bursts.astype(np.uint8), float(bursts.mean())
        true, wrong = run_lengths(losses, gilbert(losses), 2), run_lengths(losses, Channel(1.0, 1.0, share, share), 1)
        assert true is not None
        assert wrong is not None
        refused += true.p < 0.05
        assert wrong.p < 1e-6
    low, high = stats.binom.interval(0.999, 200, 0.05)
    assert low <= refused <= high


@pytest.mark.parametrize(("lost", "probability"), [([False] * 5, 0.0), ([True] * 5, 1.0), ([True], 1.0)])
def test_nothing_to_fit(lost: list[bool], probability: float) -> None:
    (found,) = loss_models(np.array(lost))
    assert found.parameters == {"probability": probability}
    assert (found.log_likelihood, found.runs) == (0.0, None)


@pytest.mark.parametrize("lost", [[True, False], [False, True], [False, False, True, True, False]])
def test_little_to_fit(lost: list[bool]) -> None:
    for found in loss_models(np.array(lost)):
        assert all(0.0 <= value <= 1.0 for value in found.parameters.values())
        assert math.isfinite(found.log_likelihood)


# -- delays -----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@SEEDS
@pytest.mark.parametrize(
    ("name", "shift", "mean", "shape"),
    [
        ("exponential", 0.0, 0.005, 1.0),
        ("shifted exponential", 0.003, 0.005, 1.0),
        ("gamma", 0.0, 0.005, 0.8),
        ("gamma", 0.0, 0.02, 4.0),
        ("shifted gamma", 0.01, 0.005, 2.5),
    ],
)
def test_laws_of_delays_are_found_again(name: str, shift: float, mean: float, shape: float, seed: int) -> None:
    rest: dict[str, Any] = {"distribution": {"type": "Gamma", "shape": shape, "mean": 1}}
    bench = Bench(Latency(delay=shift, jitter=mean, reordering=True, **rest), seed).play(range(COUNT), period=1)
    sent = {token: token * 1e-3 for token in range(COUNT)}
    delays = np.array([time - sent[token] for time, _, token in sorted(bench.out, key=lambda each: each[2])])
    found = min(delay_laws(delays), key=lambda each: each.bic)
    assert found.name == name
    assert found.shift == pytest.approx(shift, abs=2e-5 + 0.003 * shift)
    assert found.mean == pytest.approx(mean, rel=0.06)
    assert found.shape == pytest.approx(shape, rel=0.06)
    assert found.spread is not None
    assert found.spread.p > 0.001


def test_the_likelihood_of_delays_is_scipys() -> None:
    delays = np.random.default_rng(1).gamma(2.0, 0.01, 500) + 0.004
    for law in delay_laws(delays):
        expected = stats.gamma(law.shape, law.shift, law.mean / law.shape).logpdf(delays).sum()
        assert law.log_likelihood == pytest.approx(expected, rel=1e-9)
    gamma = next(law for law in delay_laws(delays) if law.name == "gamma")
    shape, _, scale = stats.gamma.fit(delays, floc=0)
    assert (gamma.shape, gamma.mean) == pytest.approx((shape, shape * scale), rel=1e-4)


def test_a_wrong_law_is_refused() -> None:
    delays = np.random.default_rng(1).uniform(0.001, 0.002, 5_000)
    assert all(law.spread is not None and law.spread.p < 1e-6 for law in delay_laws(delays))


def test_delays_that_are_zero_are_told(tmp_path: Path) -> None:
    """The likelihood of a gamma law is zero or infinite there, so that only the exponential is left."""
    file = tmp_path / "t.csv"
    file.write_text("delay\n0\n" + "\n".join(map(str, np.random.default_rng(1).gamma(4.0, 0.01, 500))))
    fit = epicycle.fit(file)
    assert [law.name for law in fit.delay_laws] == ["exponential"]
    assert "; delays: exponential (does not fit: p = " in str(fit)
    assert "); 1 delay is 0, so no gamma law can be fitted\n" in str(fit)


def test_constant_delays() -> None:
    (law,) = delay_laws(np.full(10, 0.25))
    assert (law.name, law.shift, law.mean, law.spread) == ("constant", 0.25, 0.0, None)


# -- the whole --------------------------------------------------------------------------------------------------------


@pytest.fixture
def trace(tmp_path: Path) -> Path:
    """A channel of a simulation, measured: what is fitted to it must be that channel."""
    channel = losses_of(GilbertElliott(p=0.02, r=0.1, loss_bad=0.8, loss_good=0.05), 7)
    delays = 2.0 + np.random.default_rng(7).gamma(2.5, 2.0, COUNT)
    rows = (
        f"{0.1 * row:.1f},{int(lost)},{'' if lost else f'{delay:.6f}'}"
        for row, (lost, delay) in enumerate(zip(channel, delays, strict=True))
    )
    file = tmp_path / "link 3.csv"
    file.write_text("\n".join(["time,lost,rtt", *rows]) + "\n")
    return file


def test_a_fit_is_a_disturbance(trace: Path) -> None:
    fit = epicycle.fit(trace, at="server.input", delay="rtt", delay_unit="ms")
    losses, delays = fit.aspects().values()
    assert (losses["type"], delays["type"], delays["reordering"]) == ("GilbertElliott", "Latency", False)
    assert delays["distribution"]["shape"] == pytest.approx(2.5, rel=0.06)
    path = fit.save(trace.with_name("link_3.yaml"))
    results = epicycle.run("mm1", disturb=path, until="20 min", seed=1)
    dropped, late = results.aspects["losses"]["dropped"], results.aspects["delays"]["delayed"]
    assert dropped is not None
    assert late is not None
    assert dropped / (dropped + late) == pytest.approx(fit.lost / COUNT, rel=0.5)
    again = epicycle.fit(trace, at="server.input", delay="rtt", delay_unit="ms")
    assert again.disturbance("link_3") == path.read_text()


def test_the_command(trace: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["recording", "fit", str(trace), "--delay", "rtt", "--delay-unit", "ms", "--at", "server.input"]
    assert main(words) == 0
    said = capsys.readouterr().out
    fit = epicycle.fit(trace, at="server.input", delay="rtt", delay_unit="ms")
    assert said == f"{fit}\n\n{fit.disturbance()}"
    assert "Gilbert-Elliott *" in said
    assert "shifted gamma *" in said
    assert "disturbance: link_3\n" in said
    out = tmp_path / "fitted.yaml"
    assert main([*words, "-o", str(out), "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["aspects"] == fit.aspects()
    assert facts["losses"]["name"] == "Gilbert-Elliott"
    assert out.read_text() == fit.disturbance("fitted")


def test_correlated_delays_are_told(tmp_path: Path) -> None:
    noise = np.random.default_rng(1).exponential(1.0, 5_000)
    file = tmp_path / "t.csv"
    file.write_text("delay\n" + "\n".join(f"{each:.6f}" for each in noise[1:] + 3 * noise[:-1]))
    fit = epicycle.fit(file)
    assert fit.correlation == pytest.approx(0.3, abs=0.05)  # 3 / (1 + 9)
    assert (
        f"successive delays have the correlation {fit.correlation:.2f}, but Latency draws independent ones: to "
        "keep that, replay the trace with TraceReplay"
    ) in str(fit)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["none.csv"], "error: none.csv is not a trace: No such file or directory\n"),
        (["t.csv", "--lost", "loses"], "error: t.csv is not a trace: it has no column 'loses'; columns: x\n"),
        (["t.txt"], "error: t.txt is not a trace: its name must end in .csv or .parquet\n"),
        (["t.csv", "-o", "no/f.yaml"], "error: --out no/f.yaml cannot be written: there is no folder no\n"),
    ],
)
def test_what_cannot_be_fitted(
    words: list[str],
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "t.csv").write_text("x\n1\n")
    assert main(["recording", "fit", *words]) == 2
    assert capsys.readouterr().err == message
