"""What a monitor says of random properties and signals, against the definition and against another library."""

from __future__ import annotations

import math
import random  # noqa: TID251 (what to try, and not what a model draws)
from typing import Any

import pytest

from epicycle.runner.model.temporal import Piece, Property, PropertyMonitor, PropertyVerdict, Sends, leaves, moment
from epicycle.runner.model.temporal.property import Junction, Not, Quantified, Until
from tests.temporal.definition import random_property, random_signal, random_times, robustness, values_of


def step(start: int, end: int, value: float) -> Piece:
    """A value from one time to another (ns)."""
    return Piece(moment(start), moment(end + 1) - 1, value)


def judged(tree: Property, signals: list[list[Piece]], draw: random.Random) -> PropertyVerdict:
    """What is found when the pieces come in in any order; what is said early must be said in the end."""
    monitor, left, said, most = PropertyMonitor(tree), [list(pieces) for pieces in signals], set(), math.inf
    while any(left):
        number = draw.choice([number for number, pieces in enumerate(left) if pieces])
        monitor.sources[number].pieces.append(left[number].pop(0))
        said.add(early := monitor.verdict(False).holds)
        assert monitor.most <= most
        most = monitor.most
        assert (most < 0.0) == (early is False)
    found = monitor.verdict(True)
    assert said <= {None, found.holds}
    assert found.robustness is None or found.robustness <= most + 1e-9
    return found


def compare(seed: str, *, lines: bool) -> None:
    draw = random.Random(seed)
    times = random_times(draw)
    tree = random_property(draw, draw.randrange(1, 4))
    signals = [random_signal(draw, times, lines=lines) for _ in leaves(tree)]
    wanted = robustness(tree, iter([values_of(each, times) for each in signals]), times)[0]
    found = judged(tree, signals, draw)
    about = (seed, tree, times, signals)
    assert found.holds == (None if wanted is None else wanted > 0), about
    if lines and wanted is not None:  # where lines cross, the last digit may be another one
        assert found.robustness == pytest.approx(wanted, abs=1e-9), about
    else:
        assert found.robustness == wanted, about


@pytest.mark.slow
@pytest.mark.parametrize("lines", [False, True], ids=["steps", "lines"])
def test_a_judge_agrees_with_the_definition(lines: bool) -> None:
    for number in range(2_000):
        compare(f"{lines} {number}", lines=lines)


@pytest.mark.slow
@pytest.mark.parametrize("lines", [False, True], ids=["steps", "lines"])
def test_a_judge_agrees_with_the_definition_100_000_times(lines: bool) -> None:
    for number in range(50_000):
        compare(f"many {lines} {number}", lines=lines)


def written(tree: Property, names: Any) -> str:
    """The property in the language of the other library."""
    match tree:
        case Not():
            return f"not({written(tree.of, names)})"
        case Junction():
            return f"(({written(tree.left, names)}) {'or' if tree.any else 'and'} ({written(tree.right, names)}))"
        case Quantified():
            return f"{'eventually' if tree.any else 'always'}[{tree.start}:{tree.end}]({written(tree.of, names)})"
        case Until():
            left = written(tree.left, names)
            return f"(({left}) until[{tree.start}:{tree.end}] ({written(tree.right, names)}))"
        case _:
            return f"{next(names)} >= 0"


def horizon(tree: Property) -> int:
    """For how long the value of a property depends on what comes."""
    match tree:
        case Not():
            return horizon(tree.of)
        case Junction():
            return max(horizon(tree.left), horizon(tree.right))
        case Quantified():
            return (tree.end or 0) + horizon(tree.of)
        case Until():
            return (tree.end or 0) + max(horizon(tree.left), horizon(tree.right))
        case _:
            return 0


def test_a_judge_agrees_with_rtamt() -> None:
    """Discrete time, bounded operators, signals that are there all the time: where both mean the same."""
    rtamt = pytest.importorskip("rtamt")
    for number in range(150):
        draw = random.Random(f"rtamt {number}")
        tree = random_property(draw, 3, unbounded=False)
        last = max(horizon(tree), 1)
        names = [f"x{place}" for place in range(len(leaves(tree)))]
        signals = {
            name: [float(draw.randrange(1, 5) * draw.choice([-1, 1])) for _ in range(last + 1)] for name in names
        }
        monitor = rtamt.StlDiscreteTimeSpecification()
        for name in names:
            monitor.declare_var(name, "float")
        monitor.spec = written(tree, iter(names))
        monitor.parse()
        theirs = monitor.evaluate({"time": list(range(last + 1)), **signals})[0][1]
        pieces = [[step(time, time, value) for time, value in enumerate(signal)] for signal in signals.values()]
        assert judged(tree, pieces, draw).robustness == theirs, tree


def test_when_a_property_broke() -> None:
    always = Quantified(False, Sends("a.b"))
    signal = [step(0, 4, 1.0), step(5, 5, -2.0), step(6, 9, 1.0)]
    assert judged(always, [signal], random.Random(1)) == PropertyVerdict(False, -2.0, moment(5))
    assert judged(Not(always), [signal], random.Random(1)) == PropertyVerdict(True, 2.0, None)
    within = Quantified(True, Not(Sends("a.b")), 0, 3)
    assert judged(within, [signal], random.Random(1)) == PropertyVerdict(False, -1.0, moment(4) - 1)
    both = Junction(False, always, Quantified(False, Sends("a.c"), 0, 2))
    assert judged(both, [signal, [step(0, 1, 1.0), step(2, 9, -1.0)]], random.Random(1)) == PropertyVerdict(
        False, -2.0, moment(2)
    )
    assert judged(within, [signal[:1]], random.Random(1)) == PropertyVerdict(False, -1.0, moment(4) - 1)
    assert judged(within, [[step(0, 2, 1.0)]], random.Random(1)) == PropertyVerdict()  # too short to tell


def test_a_break_is_known_at_once() -> None:
    monitor = PropertyMonitor(Quantified(False, Junction(True, Sends("a.b"), Quantified(True, Sends("a.c"), 0, 3))))
    monitor.sources[0].pieces += [step(0, 0, -1.0), step(1, 9, 1.0)]
    monitor.sources[1].pieces.append(step(0, 2, -5.0))
    assert monitor.verdict(False) == PropertyVerdict()
    monitor.sources[1].pieces.append(step(3, 3, -4.0))
    assert monitor.verdict(False) == PropertyVerdict(False, -1.0, moment(0))
