"""The cost of aspects that do nothing: `python -m benchmarks.aspects [--rounds 200]`.

A chain of actors runs beside another part that carries one token.  Compared with the same model without aspects:

- again: the same model, which shows the effect of chance;
- off: ten aspects that are declared and disabled (`enabled: false`);
- nowhere: ten whose pointcut selects the ports of an array without instances;
- elsewhere: one at a port of the other part;
- around: one at an actor of the other part;
- asleep: one at a port of the chain that is never active (`from` is after the end), which costs a check of the time;
- here: one at a port of the chain that passes every token.

In each round, all of them run in turn, each round starting with a different one.  Printed are the ratios of user CPU
time (median over the rounds of the ratio within a round, with the 95 % interval of that median, and best to best) and
the number of calls of functions that a run makes, which is the same every time: what does not grow with the run is
spent before and after it.
"""

from __future__ import annotations

import argparse
import gc
import resource
import sys
import tempfile
from pathlib import Path
from statistics import median
from types import FrameType
from typing import Any

from benchmarks.measure import interval
from epicycle.runner import Simulation, load_model
from epicycle.runner.model.build.model import Model

TEXT = """\
model: cost
parameters: {{spares: 0}}
actors:
  clock: {{type: Clock, period: 1 ms}}
  link: {{type: Scale, count: 20}}
  single: {{type: SingleEvent, time: 1 ms, value: 1.0}}
  end: {{type: Scale}}
  spare: {{type: Scale, count: "${{spares}}"}}
connections:
  - clock.output -> link[0].input
  - link[..-2].output -> link[1..].input
  - single.output -> end.input
  - single.output -> spare[*].input
aspects: {{{aspects}}}
run: {{stop: {stop}}}
"""
LOSS = "type: PacketLoss, probability: 0"
PLACES = {
    "bare": "",
    "again": "",
    "off": ", ".join(f"a{n}: {{{LOSS}, enabled: false, at: 'link[*].input'}}" for n in range(10)),
    "nowhere": ", ".join(f"a{n}: {{{LOSS}, at: 'spare[*].input'}}" for n in range(10)),
    "elsewhere": f"a: {{{LOSS}, at: end.input}}",
    "around": "a: {type: SkipFiring, probability: 0, at: end}",
    "asleep": f"a: {{{LOSS}, from: 1 h, at: 'link[10].input'}}",
    "here": f"a: {{{LOSS}, at: 'link[10].input'}}",
}


def model(place: str, stop: str) -> Model:
    """The model with aspects at a place."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.yaml"
        path.write_text(TEXT.format(aspects=PLACES[place], stop=stop), encoding="utf-8")
        return load_model(path)


def user_seconds(model: Model) -> float:
    """The user CPU time of one run."""
    simulation = Simulation(model)
    gc.collect()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_utime
    simulation.run()
    return resource.getrusage(resource.RUSAGE_SELF).ru_utime - before


def calls(model: Model) -> int:
    """The number of calls of Python and C functions in one run."""
    simulation, count = Simulation(model), 0

    def note(frame: FrameType, event: str, argument: Any) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    gc.disable()  # whose callbacks count, too
    sys.setprofile(note)
    try:
        simulation.run()
    finally:
        sys.setprofile(None)
        gc.enable()
    return count


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--rounds", type=int, default=200)
    rounds = options.parse_args().rounds
    models, longer = ({place: model(place, stop) for place in PLACES} for stop in ("250 ms", "500 ms"))
    took: dict[str, list[float]] = {place: [] for place in models}
    order = list(models)
    for _ in range(rounds + 1):
        order = [*order[1:], order[0]]
        for place in order:
            took[place].append(user_seconds(models[place]))
    took = {place: times[1:] for place, times in took.items()}  # the first round warms up
    further = [
        {place: calls(each) - calls(family["bare"]) for place, each in family.items()} for family in (models, longer)
    ]
    print(f"{rounds} rounds, {1000 * median(took['bare']):.0f} ms and {calls(models['bare']):,} calls a run")
    print("| aspects | median ratio | 95 % interval | best to best | further calls | in a run twice as long |")
    print("|---|---|---|---|---|---|")
    for place in list(models)[1:]:
        ratios = [mine / bare for mine, bare in zip(took[place], took["bare"], strict=True)]
        low, high = interval(ratios)
        best = min(took[place]) / min(took["bare"])
        once, twice = (each[place] for each in further)
        print(f"| {place} | {median(ratios):.4f} | {low:.4f} to {high:.4f} | {best:.4f} | {once:+,} | {twice:+,} |")


if __name__ == "__main__":
    main()
