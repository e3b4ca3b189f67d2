"""The cost of a monitor on a run: `python -m benchmarks.monitors [--rounds 40]`.

A chain of actors carries a token every millisecond; a monitor listens at its end, or at a port that sends nothing.  In
each round, the same run is made with each of the monitors in turn.  Printed are the ratios of user CPU time to the run
without a monitor (median over the rounds, with the 95 % interval of that median) and what a token costs.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from statistics import median

from benchmarks.aspects import user_seconds
from benchmarks.measure import interval
from epicycle.runner import Model, load_model

TOKENS = 5_000
TEXT = f"""\
model: cost
actors:
  clock: {{type: Clock, period: 1 ms}}
  link: {{type: Scale, count: 20}}
  late: {{type: SingleEvent, time: 1 h, value: 1.0}}
connections:
  - clock.output -> link[0].input
  - link[..-2].output -> link[1..].input
run: {{stop: {TOKENS - 1} ms}}
"""
PORT = "link[19].output"
MONITORS = {
    "none": {},
    "none, again": {},
    "at a port that sends nothing": {"property": "always late.output > 0"},
    "a comparison": {"property": f"always {PORT} >= 0"},
    "a comparison, linear in between": {"property": f"always {PORT} >= 0", "between": "linear"},
    "a comparison, ends the run": {"property": f"always {PORT} >= 0", "stop": True},
    "two comparisons": {"property": f"always ({PORT} >= 0 and {PORT} < 1e9)"},
    "a response within 10 ms": {"property": f"always ({PORT} < 0 implies eventually within 10 ms {PORT} > 0)"},
}


def model(values: dict[str, object]) -> Model:
    """The model with a monitor."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.yaml"
        path.write_text(TEXT, encoding="utf-8")
        made = load_model(path)
    if values:
        made.monitor("it", **values)  # type: ignore[arg-type]
    return made


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--rounds", type=int, default=40)
    rounds = options.parse_args().rounds
    models = {name: model(dict(values)) for name, values in MONITORS.items()}
    took: dict[str, list[float]] = {name: [] for name in models}
    for _ in range(rounds + 1):
        for name, each in models.items():
            took[name].append(user_seconds(each))
    took = {name: times[1:] for name, times in took.items()}  # the first round warms up
    print(f"{rounds} rounds; a run of {TOKENS:,} tokens along 20 actors takes {median(took['none']):.3f} s")
    print("| monitor | median ratio | 95 % interval | a token |\n|---|---|---|---|")
    for name in list(models)[1:]:
        ratios = [mine / none for mine, none in zip(took[name], took["none"], strict=True)]
        low, high = interval(ratios)
        cost = 1e6 * (median(took[name]) - median(took["none"])) / TOKENS
        print(f"| {name} | {median(ratios):.3f} | {low:.3f} to {high:.3f} | {cost:.1f} us |")


if __name__ == "__main__":
    main()
