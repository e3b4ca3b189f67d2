"""The drawing of any model graph: boxes, ports, wires and words do not get in each other's way."""

from __future__ import annotations

from itertools import combinations, pairwise

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from epicycle.runner import load_model
from epicycle.runner.model.build.model import Model
from epicycle.runner.model.catalogue.packaged import packaged_models
from epicycle.runner.show.graph import layout, outline
from epicycle.runner.show.graph.layers import Cell, Net, Pin, Run
from epicycle.runner.show.graph.layout import draw
from epicycle.runner.show.graph.outlines import Box, Link, Outline, Port
from epicycle.runner.show.graph.places import tracks
from tests.show.graph.drawings import check


@st.composite
def boxes(draw_from: st.DrawFn, path: str = "", level: int = 0) -> Box:
    """Any box with what is in it."""
    number = st.integers(0, 3)

    def some_ports(side: str) -> list[Port]:
        count = draw_from(number) if path else 0
        aspects = st.lists(st.sampled_from(["loss", "a_long_name"]), max_size=2, unique=True).map(tuple)
        return [Port(f"{path}.{side}{n}", f"{side}{n}", n == 1, draw_from(aspects)) for n in range(count)]

    name = path.rpartition(".")[2]
    box = Box(path, name, "Composite" if level < 2 else "T", some_ports("in"), some_ports("out"))
    box.is_composite = not path or (level < 3 and draw_from(st.booleans()))
    if not box.is_composite:
        return box
    if path and draw_from(st.sampled_from([False, False, True])):
        box.is_closed, box.aspects = True, draw_from(st.sampled_from([(), ("inner",), ("inner", "loss")]))
        return box
    box.children = [
        draw_from(boxes(f"{path}.b{n}" if path else f"b{n}", level + 1)) for n in range(draw_from(st.integers(0, 5)))
    ]
    sources = [port.path for port in (*box.inputs, *(p for child in box.children for p in child.outputs))]
    targets = [port.path for port in (*box.outputs, *(p for child in box.children for p in child.inputs))]
    if sources and targets:
        delays = st.sampled_from([None, None, None, 0, 100_000_000])
        link = st.builds(Link, st.sampled_from(sources), st.sampled_from(targets), delays)
        box.links = draw_from(st.lists(link, max_size=12, unique_by=lambda each: (each.source, each.target)))
    return box


@pytest.mark.slow
@given(boxes())
@settings(max_examples=40, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
def test_every_drawing_is_right(root: Box) -> None:
    anything = Outline(Model("any"), root, 9, 9)
    drawing = draw(anything)
    check(drawing)
    layout._scopes.clear()  # from where unchanged composites would come
    assert draw(anything) == drawing


@given(st.lists(st.tuples(st.sets(st.integers(0, 5), min_size=1), st.sets(st.integers(0, 5), min_size=1)), max_size=5))
@settings(max_examples=150, deadline=None, derandomize=True)
def test_lines_between_layers_keep_apart(sides: list[tuple[set[int], set[int]]]) -> None:
    used: tuple[set[int], set[int]] = (set(), set())
    runs = []
    for left, right in sides:  # every height has one pin on each side
        left, right = left - used[0], right - used[1]
        if left and right:
            used[0].update(left)
            used[1].update(right)
            pins = [[Pin(Cell("box", y=12.0 * height)) for height in sorted(side)] for side in (left, right)]
            runs.append(Run(Net(pins[0][0], pins[1]), *pins))
    trunks, count = tracks(runs)
    for trunk in trunks:
        assert 0 <= trunk.track < count
    for one, other in combinations(trunks, 2):
        if one.track == other.track:
            assert one.high < other.low or other.high < one.low
        if one.runs == other.runs:
            continue
        first, last = sorted((one, other), key=lambda trunk: trunk.track)
        if first.track < last.track:  # lines from the left to the last trunk, from the first one to the right
            assert not set(first.right) & set(last.left)
    for run in runs:  # whatever the number of its trunks, they join what the run joins
        mine = [trunk for trunk in trunks if run in trunk.runs]
        if mine:
            assert set(mine[0].left) == {pin.cell.y for pin in run.left}
            assert set(mine[-1].right) == {pin.cell.y for pin in run.right}
            assert all(before.right == after.left for before, after in pairwise(mine))
        else:
            assert len({pin.cell.y for pin in (*run.left, *run.right)}) == 1


def test_two_nets_that_change_places_take_a_detour() -> None:
    """a goes from 0 to 1 and b from 1 to 0: whichever trunk is on the left, one of them must have a second track."""
    (a, b), (c, d) = [[Pin(Cell("box", y=24.0 * height)) for height in (0, 1)] for _ in range(2)]
    trunks, count = tracks([Run(Net(a, [d]), [a], [d]), Run(Net(b, [c]), [b], [c])])
    assert (len(trunks), count) == (3, 3)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(packaged_models()))
@pytest.mark.parametrize(("depth", "expand"), [(None, False), (0, False), (None, True)])
def test_packaged_models_are_drawn_right(name: str, depth: int | None, expand: bool) -> None:
    check(draw(outline(load_model(name), depth, expand)))


@pytest.mark.parametrize("observers", [0, 1, 8])
@pytest.mark.parametrize("expand", [False, True])
def test_scenario_is_drawn_right_for_any_number_of_observers(observers: int, expand: bool) -> None:
    check(draw(outline(load_model("collision_avoidance", set=[f"observers={observers}"]), 1, expand)))
