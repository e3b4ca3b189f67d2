"""Texts that are changed, in lines and in brackets."""

from __future__ import annotations

from collections.abc import Callable

from epicycle.runner.desk.parts import data_of, rendered, typed

Act = Callable[[str], str]
TEXT = """# A line of robots.
model: two_bodies   # its name

parameters:
  loss: {value: 0.2, min: 0, max: 1, doc: probability that a tick is lost}  # set by hand
actors:
  # The first of all.
  clock: {type: Clock, period: 500 ms}
  left: {type: CircularMotion, start: [0, 1]}    # on the left
  right:
    type: CircularMotion
    start: [0, -1]   # below

connections:
- clock.output -> left.trigger   # at once
# late
- {from: clock.output, to: right.trigger, delay: 100 ms}

aspects:
  lossy: {type: PacketLoss, probability: "${loss}", at: "*.trigger"}  # now and then
  # the end of aspects
run: {stop: 10 s, seed: 1, record: [left.state, right.state]}
metrics:
  heard: {of: left.state, take: count}
# the end
"""
FLOW = (
    "{model: flow, parameters: {a: 1, b}, actors: {\n  clock: {type: Clock, period: 1 s}, # ticks\n"
    "  gain: {type: Scale, factor: 2},\n  sum: {type: Merge} # all\n  },\n"
    ' connections: [clock.output -> gain.input, "gain.output -> sum.input"], run: {stop: 3 s}}\n'
)


def set_value(text: str, keys: tuple[str, ...], said: str) -> str:
    """A text with a value, as somebody types it, in the place of another, or behind the others if there is none."""
    data = holder = data_of(text)
    for key in keys[:-1]:
        holder = holder[key]
    holder[keys[-1]] = typed(said)
    return rendered(text, data)
