"""``epicycle validate``: warnings, ``--strict``, overrides files, and units of what is drawn."""

from __future__ import annotations

from pathlib import Path

import pytest

from epicycle.runner.interface.cli import main

MODEL = """model: m
actors:
  clock: {type: Clock, period: 1 s}
  seen: {type: Recorder}
  idle: {type: Scale, factor: 2}
  also: {type: Merge, count: 2}
connections:
  - clock.output -> seen.input
  - {from: "also[*].output", to: "also[1, 0].input", delay: 1}
  - {from: "also[0].output", to: idle.input, delay: 1}
run: {stop: 1 s}
"""
WARNING = """m.yaml:6:3: {}: also[0] can never fire: it is not a source, and only the loop also[0], also[1] feeds it
    6 |   also: {{type: Merge, count: 2}}
      |   ^^^^
   help: nor can the actors that it feeds: idle
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "m.yaml").write_text(MODEL)
    return tmp_path


def test_warnings_and_strict(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", "m.yaml"]) == 0
    out, err = capsys.readouterr()
    assert (out, err) == ("m.yaml is valid: 5 actors, 4 connections, 0 aspects\n", WARNING.format("warning"))
    assert main(["validate", "m.yaml", "--strict"]) == 2
    assert capsys.readouterr() == ("", WARNING.format("error"))
    assert main(["validate", "collision_avoidance", "--strict"]) == 0


def test_overrides(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "over.yaml").write_text("clock.period: 2 s\n'*.factor': 3\nidle.fcator: 4\n")
    assert main(["validate", "m.yaml", "--overrides", "over.yaml"]) == 2
    assert capsys.readouterr().err == (
        "over.yaml:3:1: error: 'idle.fcator' matches no parameter, did you mean 'idle.factor'?\n"
        "    3 | idle.fcator: 4\n"
        "      | ^^^^^^^^^^^\n"
    )
    (folder / "over.yaml").write_text("clock.period: 2 s\n")
    (folder / "more.yaml").write_text("'*.period': 4 s\n")
    for options, times in {
        (): 9,
        ("--overrides", "over.yaml"): 5,
        ("--overrides", "over.yaml", "--overrides", "more.yaml"): 3,
        ("--set", "clock.period=8", "--overrides", "more.yaml"): 2,
    }.items():
        assert main(["run", "m.yaml", "--until", "8", "--log", "log.csv", "--out", "out", *options]) == 0
        lines = (folder / "log.csv").read_text().splitlines()
        assert sum("send" in line and "clock" in line for line in lines) == times


OF_TIMES = """model: m
parameters:
  length: {value: 2, unit: km}
  wait: {value: 3, unit: min}
  number: 4
  half: "${wait / 2}"
composites:
  C:
    parameters: {n: 3, x: {}}
    inputs: [in]
    actors: {s: {type: Station, places: "${n}", service_time: {type: Constant, value: "${x}"}}}
    connections: [in -> s.input]
actors:
  clock: {type: Clock, period: "${half}"}
  a: {type: Server, distribution: {type: Exponential, mean: "${length}"}}
  b: {type: Server, distribution: {type: Exponential, mean: 5 m}}
  c: {type: Server, distribution: {type: Gamma, mean: "${wait}", shape: "${wait}"}}
  d: {type: Server, distribution: {type: Uniform, low: 61, high: 1 min}}
  e: {type: Server, distribution: {type: Exponential, men: 1 min}}
  f: {type: Random, distribution: {type: Exponentil}}
  g: {type: C, n: "${wait}", x: 1 min}
  h: {type: C, n: 2, x: "${length}"}
  i: {type: Random, distribution: {type: Bernoulli, probability: 50 ms}}
  j: {type: Server, servers: "${wait}"}
connections:
  - clock.output -> a.input, b.input, c.input, d.input, e.input, f.trigger, g.in, h.in, i.trigger, j.input
  - {from: f.output, to: j.service_time, delay: "${number}"}
run: {stop: "${wait ** 2}"}
"""
WRONG_TIMES = """m.yaml:15:61: error: a.distribution: Exponential.mean: '2 km' is a length, expected a time in s
   15 |   a: {type: Server, distribution: {type: Exponential, mean: "${length}"}}
      |                                                             ^^^^^^^^^^^

m.yaml:16:61: error: b.distribution: Exponential.mean: '5 m' is a length, expected a time in s
   16 |   b: {type: Server, distribution: {type: Exponential, mean: 5 m}}
      |                                                             ^^^

m.yaml:17:73: error: c.distribution: Gamma.shape: '3 min' is a time, expected a number
   17 |   c: {type: Server, distribution: {type: Gamma, mean: "${wait}", shape: "${wait}"}}
      |                                                                         ^^^^^^^^^

m.yaml:18:35: error: d.distribution: low is 61 and high is 60: low must not be above high
   18 |   d: {type: Server, distribution: {type: Uniform, low: 61, high: 1 min}}
      |                                   ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^

m.yaml:19:55: error: e.distribution: Exponential has no parameter 'men', did you mean 'mean'? valid parameters: mean
   19 |   e: {type: Server, distribution: {type: Exponential, men: 1 min}}
      |                                                       ^^^

m.yaml:20:42: error: f.distribution: 'Exponentil' is not one of Bernoulli, Binomial, Cauchy, ChiSquare, \
Choice, Constant, Exponential, Gamma, LogNormal, NegativeBinomial, Normal, Poisson, RandomInteger, StudentT, \
Triangular, Uniform, VonMises, did you mean 'Exponential'?
   20 |   f: {type: Random, distribution: {type: Exponentil}}
      |                                          ^^^^^^^^^^

m.yaml:21:19: error: g.n: '3 min' is a time, expected a number
   21 |   g: {type: C, n: "${wait}", x: 1 min}
      |                   ^^^^^^^^^
   help: declared by Station.places

m.yaml:22:25: error: h.x: '2 km' is a length, expected a time in s
   22 |   h: {type: C, n: 2, x: "${length}"}
      |                         ^^^^^^^^^^^
   help: declared by Constant.value

m.yaml:23:66: error: i.distribution: Bernoulli.probability: '50 ms' is a time, expected a number
   23 |   i: {type: Random, distribution: {type: Bernoulli, probability: 50 ms}}
      |                                                                  ^^^^^

m.yaml:24:30: error: j.servers: '3 min' is a time, expected a number
   24 |   j: {type: Server, servers: "${wait}"}
      |                              ^^^^^^^^^

m.yaml:28:13: error: stop: '9 min^2' is a quantity in min^2, expected a time in s
   28 | run: {stop: "${wait ** 2}"}
      |             ^^^^^^^^^^^^^^
11 errors in m.yaml
"""


def test_distributions_of_times(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "m.yaml").write_text(OF_TIMES)
    assert main(["validate", "m.yaml"]) == 2
    assert capsys.readouterr().err == WRONG_TIMES
