"""``director: {like: ptolemy}``: borders of composites, defaults, aspects that are models, and how Python says it."""

from __future__ import annotations

from time import process_time
from typing import Any, ClassVar

import pytest

from epicycle import actors
from epicycle.actors import Actor, InputPort, OutputPort, Parameter, Tag
from epicycle.ptolemy.changing import Singly, Waiting
from epicycle.ptolemy.timing import TimeDelay
from epicycle.runner.execution.engine import Simulation
from epicycle.runner.model.build.model import Model
from epicycle.runner.model.text.problems import ModelError
from tests.engine.engine_parts import Probe, Repeat, load, seen, sends, simulate


class Hold(Actor):
    """Takes tokens, and sends none of them at their tag."""

    input: InputPort[Any] = InputPort(Any, required=False)
    output: OutputPort[Any] = OutputPort(Any, depends_on=())

    def fire(self) -> None:
        pass


class One(Singly):
    """Takes one token in each firing."""

    input: InputPort[Any] = InputPort(Any)
    output: OutputPort[Any] = OutputPort(Any)

    def fire_once(self) -> None:
        for token in self.input.tokens:
            self.output.send(token)


TYPES = [Hold, One, Repeat]
LIKE = "director: {like: ptolemy}\n"

BORDERS = """
composites:
  Source:
    outputs: [out]
    director: {}
    actors: {t: {type: Ticker, limit: 1}, twice: {type: Repeat}}
    connections: [t.output -> twice.input, twice.output -> out]
  Twice:
    inputs: [in, other]
    outputs: [out]
    director: {}
    actors: {twice: {type: Repeat}, join: {type: Join}}
    connections: [in -> twice.input, twice.output -> out, in -> join.input, other -> join.input]
actors:
  t: {type: Ticker, limit: 1}
  twice: {type: Repeat}
  source: {type: Source}
  c: {type: Twice}
  probe: {type: Probe}
  middle: {type: Probe}
connections: [t.output -> twice.input, twice.output -> c.in, t.output -> c.other, c.out -> probe.input,
              source.out -> middle.input]
"""


def test_a_composite_fires_again_at_a_tag_for_tokens_that_wait_at_its_inputs() -> None:
    """What is left at its outputs follows at the next microsteps, as it does without."""
    simulation, results = simulate(BORDERS, types=TYPES)
    assert seen(simulation, "middle") == [(0.0, 1, (0,)), (0.0, 2, (0,))]
    assert seen(simulation) == [(0.0, microstep, (0,)) for microstep in (1, 2, 3, 4)]
    assert [row[1:] for row in sends(results, "c.join")] == [
        (1, "c.join.output", [[0], [0]]),
        (2, "c.join.output", [[0], []]),
    ]
    simulation, results = simulate(LIKE + BORDERS, types=TYPES)
    assert seen(simulation, "middle") == [(0.0, 1, (0,)), (0.0, 2, (0,))]
    assert seen(simulation) == [(0.0, 1, (0, 0)), (0.0, 2, (0,)), (0.0, 3, (0,))]
    assert [row[1:] for row in sends(results, "c.join")] == [
        (1, "c.join.output", [[0], [0]]),
        (1, "c.join.output", [[0], []]),
    ]


NEXT = """
composites:
  C:
    parameters: {between: }
    director: {}
    actors:
      first: {type: Wakes, at: [5]}
      second: {type: Wakes, at: "${[between]}"}
  Around: {parameters: {between: }, director: {}, actors: {c: {type: C, between: "${between}"}}}
actors:
  early: {type: TYPE, between: 0.5}
  alone: {type: Wakes, at: [1], then: 5}
  late: {type: TYPE, between: 3}
"""


class Wakes(Actor):
    """Wakes up at times, at the last of which it asks for another one; sends at whole multiples of 5 s."""

    is_source: ClassVar[bool] = True
    output: OutputPort[Any] = OutputPort(Any)
    at: Parameter[Any] = Parameter(object)
    then = Parameter(float, 0.0)

    def initialize(self) -> None:
        for time in self.at:
            self.wake_at(time)

    def fire(self) -> None:
        if self.now == self.at[-1] and self.then:
            self.wake_at(self.then)
        if self.now == 5:
            self.output.send(self.now)


@pytest.mark.parametrize("kind", ["C", "Around"])
def test_a_composite_is_posted_for_what_comes_first_in_it(kind: str) -> None:
    """Whenever it has fired: for 5 s after its firing between, which is before the other actor's or behind it."""
    inner = ".c" if kind == "Around" else ""
    ours = [f"early{inner}.first", f"late{inner}.first"]
    text = NEXT.replace("TYPE", kind)
    for head, order in (
        (LIKE, [ours[0], "alone", ours[1]]),
        ("", [ours[0], "alone", ours[1]]),
    ):
        _, results = simulate(head + text, types=[*TYPES, Wakes])
        assert [port.rpartition(".")[0] for _, _, port, _ in sends(results)] == order
    _, results = simulate(LIKE + text.replace("between: 0.5", "between: 4"), types=[*TYPES, Wakes])
    assert [port.rpartition(".")[0] for _, _, port, _ in sends(results)] == ["alone", ours[1], ours[0]]


LOOP = """
composites:
  C:
    inputs: [first, second]
    outputs: [out]
    director: {DIRECTOR}
    actors: {hold: {type: Hold}, gain: {type: Scale}}
    connections: [first -> gain.input, gain.output -> out, second -> hold.input]
actors: {a: {type: Ticker}, c: {type: C}, g: {type: Scale}}
connections: [a.output -> c.first, c.out -> g.input, g.output -> c.second]
"""


@pytest.mark.parametrize(
    ("head", "director", "is_right"),
    [("", "", True), ("", "like: ptolemy", False), (LIKE, "", False), (LIKE, "like: epicycle", True)],
)
def test_outputs_of_a_composite_depend_on_all_inputs(head: str, director: str, is_right: bool) -> None:
    text = head + LOOP.replace("DIRECTOR", director)
    if is_right:
        load(text, types=TYPES)
        return
    with pytest.raises(ModelError) as caught:
        load(text, types=TYPES)
    (problem,) = caught.value.problems
    assert problem.message == "a loop without delay: c -> g -> c"
    assert "c has a director like ptolemy: all its outputs depend on all its inputs" in problem.help


def test_a_delay_keeps_microsteps() -> None:
    text = """
actors: {t: {type: Ticker, limit: 1}, twice: {type: Repeat}, delay: {type: TimeDelay}, probe: {type: Probe}}
connections: [{from: t.output, to: twice.input, delay: 0}, twice.output -> delay.input, delay.output -> probe.input]
"""
    assert seen(simulate(text, types=TYPES)[0]) == [(1.0, 1, (0, 0))]
    # Both tokens come at (0 s, 2), and leave one after the other.
    assert seen(simulate(LIKE + text, types=TYPES)[0]) == [(1.0, 2, (0,)), (1.0, 3, (0,))]
    assert seen(simulate(LIKE + text.replace("TimeDelay", "TimeDelay, delay: 0"), types=TYPES)[0]) == [
        (0.0, 3, (0,)),
        (0.0, 4, (0,)),
    ]


def test_tokens_of_a_delay_that_leave_at_one_time() -> None:
    """A new one is the last of them, unless its microstep is below that of the last of all: then it is the first."""
    model = Model("m", like="ptolemy", stop=4)
    delay: Any = model.add(TimeDelay("delay"))
    source = model.add(Wakes("source", at=[0]))
    model.connect(source.output, delay.input)
    simulation = Simulation(model)
    simulation.advance(until=0.5)
    held: Any = simulation[delay]

    def put(token: str, seconds: float) -> None:
        held.inputs["delay"].start_with(seconds)
        held._put(token)

    for seconds, token in ((2.0, "a"), (1.0, "b"), (2.0, "c"), (3.0, "d"), (1.0, "e")):
        put(token, seconds)
    assert [token for _, token in held._line] == ["b", "e", "a", "c", "d"]
    last, token = held._line[-1]
    held._line[-1] = Tag(last.time, 9), token
    put("f", 2.0)
    assert [token for _, token in held._line] == ["b", "e", "f", "a", "c", "d"]


@pytest.mark.parametrize(("factor", "plain", "stepping"), [(0, [1, 1, 1], [2, 3, 4]), (1, [1, 1, 1], [1, 1, 1])])
def test_a_bus_that_takes_no_time_takes_a_microstep_a_message(
    factor: int, plain: list[int], stepping: list[int]
) -> None:
    text = f"""
actors: {{t: {{type: Ticker, limit: 1}}, one: {{type: Probe}}, two: {{type: Probe}}, three: {{type: Probe}}}}
connections: ["t.output -> one.input, two.input, three.input"]
aspects: {{bus: {{type: Bus, factor: {factor}, at: ["*.input"]}}}}
"""
    for head, microsteps in (("", plain), (LIKE, stepping)):
        simulation, _ = simulate(head + text)
        got = [seen(simulation, name) for name in ("one", "two", "three")]
        assert got == [[(factor * (n + 1.0), step, (0,))] for n, step in enumerate(microsteps)]


ASPECT = """
composites:
  Resource:
    inputs: [request]
    outputs: [response]
    director: {}
    actors: {own: {type: Ticker, period: 0.5}, pass: {type: Merge, discard: false}}
    connections: [request -> pass.input, pass.output -> response]
actors: {t: {type: Ticker}, probe: {type: Probe}}
connections: [t.output -> probe.input]
aspects: {resource: {type: Resource, at: probe.input}}
"""


def test_requests_wait_for_the_turn_of_an_aspect_that_is_a_model() -> None:
    """Its own clock lets it fire at each second, but before the request comes: at the next microstep it fires again."""
    simulation, results = simulate(ASPECT, until=1)
    assert seen(simulation) == [(0.0, 1, (0,)), (1.0, 1, (1,))]
    simulation, results = simulate(LIKE + ASPECT, until=1)
    # At 0 s the aspect is posted behind the source; at 1 s, its clock has asked after the source, too.
    assert seen(simulation) == [(0.0, 1, (0,)), (1.0, 1, (1,))]
    late = ASPECT.replace("own: {type: Ticker, period: 0.5}, ", "")
    simulation, results = simulate(LIKE + late, until=1)
    assert seen(simulation) == [(0.0, 2, (0,)), (1.0, 2, (1,))]
    asked = [(r.tag.seconds, r.tag.microstep) for r in results.log.records if r.event == "requested"]
    assert asked == [(0.0, 2), (1.0, 2)]


def test_types_are_those_of_the_director_around() -> None:
    text = """
director: {like: ptolemy}
composites:
  Inner: {actors: {it: {type: Clock, period: 1}}}
  Opaque: {director: {drift: 2}, actors: {inner: {type: Inner}}}
  Other: {director: {like: epicycle}, actors: {inner: {type: Inner}}, outputs: [out], connections: []}
actors: {it: {type: Clock, period: 1}, opaque: {type: Opaque}, other: {type: Other}, here: {type: Recorder}}
aspects: {bus: {type: Bus, factor: 0, at: here.input}}
connections: [it.output -> here.input]
"""
    model = load(text)
    kinds = {path: type(actor).__module__ for path, actor in model.graph.actors.items() if "it" in path}
    ours, theirs = "epicycle.ptolemy.timing", "epicycle.actors.sources"
    assert kinds == {"it": ours, "opaque.inner.it": ours, "other.inner.it": theirs}
    assert type(model.aspects[0].aspect).__module__ == ours


def test_own_types_win() -> None:
    class Queue(Hold):
        pass

    model = load("director: {like: ptolemy}\nactors: {q: {type: Queue}}\n", types=[Queue])
    assert type(model.graph.actors["q"]) is Queue


def test_python_names_the_classes_that_it_means() -> None:
    model = Model("m", like="ptolemy", stop=3)
    assert type(model.add(actors.TimeDelay("delay"))) is actors.TimeDelay
    model.composite("inside", director=True, like="epicycle")
    model.composite("plain", director=True)
    named = {path: each.dialect.name for path, each in model.graph.domains.items()}
    assert named == {"": "ptolemy", "inside": "epicycle", "plain": "ptolemy"}


MISTAKES: list[tuple[Any, str]] = [
    (
        lambda: Model("m", like="Ptolemy"),
        "m: director.like: 'Ptolemy' is not one of epicycle, ptolemy, did you mean 'ptolemy'?",
    ),
    (lambda: Model("m").composite("c", like="ptolemy"), "c: 'like' belongs to a director, and c has none of its own"),
]


@pytest.mark.parametrize(("call", "message"), MISTAKES)
def test_mistakes_in_python(call: Any, message: str) -> None:
    with pytest.raises(ModelError) as caught:
        call()
    assert [problem.message for problem in caught.value.problems] == [message]


def test_tokens_that_wait_without_a_model() -> None:
    port: InputPort[Any] = InputPort(multi=True).bind(Probe("p"))
    port.width = 2
    waiting = Waiting([port])
    for token, channel in ((1, 0), (2, 1), (3, 0), (4, 0)):
        port.receive(token, channel)
    assert (waiting.come(), port.tokens) == (4, ())
    assert [waiting.firsts(port) for _ in range(3)] == [([1, 2], [0, 1]), ([3], [0]), ([4], [0])]
    # What an execution aspect puts back comes behind what was left.
    port.receive(5, 1)
    waiting.come()
    port.receive(6, 1)
    port.give(port.take())
    assert (waiting.come(), waiting.firsts(port), waiting.firsts(port)) == (2, ([5], [1]), ([6], [1]))


@pytest.mark.slow
def test_what_waits_in_a_port_costs_nothing() -> None:
    """Taking a token out takes as long, however many wait: by a walk through all of them this would be minutes."""
    text = """
director: {like: ptolemy}
actors: {t: {type: SingleEvent}, many: {type: Repeat, times: 40000}, count: {type: Counter}}
connections: [t.output -> many.input, many.output -> count.increment, many.output -> count.increment]
"""
    before = process_time()
    found = sends(simulate(text)[1], "count")
    assert [row[3] for row in found] == [2 * (number + 1) for number in range(40_000)]
    assert process_time() - before < 10


KEPT = """
director: {like: ptolemy}
actors: {t: {type: Ticker, limit: 3}, twice: {type: Repeat}, one: {type: One}}
connections: [t.output -> twice.input, twice.output -> one.input]
"""


def test_kept_tokens_and_aspects_of_execution() -> None:
    """Each firing is put off as a whole, and fires as often as it takes tokens out."""
    assert [row[:2] + row[3:] for row in sends(simulate(KEPT, types=TYPES)[1], "one")] == [
        (time, 1, time) for time in (0.0, 1.0, 2.0) for _ in range(2)
    ]
    aspect = "aspects: {work: {type: ExecutionTime, time: 1500 ms, at: one}}"
    got = [row[:2] + row[3:] for row in sends(simulate(KEPT + aspect, types=TYPES)[1], "one")]
    assert got == [(1.5, 1, 0), (1.5, 1, 0), (3.0, 1, 1), (3.0, 1, 1), (4.5, 1, 2), (4.5, 1, 2)]


def test_a_crash_costs_the_tokens_that_wait() -> None:
    text = (
        LIKE
        + """
actors: {t: {type: Ticker, period: 0.25}, never: {type: SingleEvent, time: 9}, it: {type: Comparator, comparison: '=='}}
connections: [t.output -> it.left, never.output -> it.right]
"""
    )
    aspect = "aspects: {crash: {type: CrashRestart, mtbf: 100 ms, repair: 100 ms, at: it, until: 1500 ms}}"
    for more, left in (("", 21), (aspect, 14)):
        it: Any = simulate(text + more, until=5)[0]["it"]
        assert it._waiting.come() == left
