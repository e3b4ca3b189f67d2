"""What figures make of samples: every value is under the envelope, and every state in its span."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epicycle.runner.show.samples import COLUMNS, Envelope, envelope, longest_spans, spans_of
from epicycle.runner.show.sheet import colours, in_common

DENSE = 6 * COLUMNS


def by_hand(times: list[float], values: list[float], begin: float, end: float, column: int) -> tuple[float, ...]:
    """Least, greatest and mean of what holds in one column."""
    width = (end - begin) / COLUMNS
    low, high = begin + column * width, begin + (column + 1) * width
    before = [value for time, value in zip(times, values, strict=True) if time <= low][-1:]
    inside = [(time, value) for time, value in zip(times, values, strict=True) if low < time < high]
    points = [(low, value) for value in before] + inside
    ends = [*(time for time, _ in points[1:]), high]
    area = sum(value * (until - time) for (time, value), until in zip(points, ends, strict=True))
    held = [value for _, value in points]
    return min(held), max(held), area / (high - points[0][0])


@pytest.mark.parametrize("seed", range(3))
def test_an_envelope_is_what_holds_in_each_column(seed: int) -> None:
    random = np.random.default_rng(seed)
    times = np.sort(random.uniform(0.0, 100.0, DENSE))
    values = random.normal(size=DENSE)
    found = envelope(times, values, 10.0, 90.0, holds=True)
    assert found is not None
    assert len(found.times) == COLUMNS
    assert found.width == pytest.approx(80.0 / COLUMNS)
    for column in random.choice(COLUMNS, 40, replace=False):
        expected = by_hand(times.tolist(), values.tolist(), 10.0, 90.0, int(column))
        assert (found.low[column], found.high[column], found.mean[column]) == pytest.approx(expected)


def test_an_envelope_of_samples_that_do_not_hold_has_their_plain_mean() -> None:
    times = np.repeat(np.linspace(0.0, 1.0, COLUMNS, endpoint=False) + 0.5 / COLUMNS, 5)
    values = np.tile([1.0, 2.0, 3.0, 4.0, 10.0], COLUMNS)
    found = envelope(times, values, 0.0, 1.0, holds=False)
    assert isinstance(found, Envelope)
    for column, expected in ((found.low, 1.0), (found.high, 10.0), (found.mean, 4.0)):
        np.testing.assert_allclose(column, expected)


def test_a_sleeper_is_seen_in_all_columns_and_what_has_not_begun_in_none() -> None:
    times = np.concatenate([[30.0], np.linspace(80.0, 100.0, DENSE)])
    values = np.concatenate([[7.0], np.zeros(DENSE)])
    found = envelope(times, values, 0.0, 100.0, holds=True)
    assert found is not None
    assert found.times[0] >= 30.0
    is_asleep = found.times < 79.9
    assert is_asleep.sum() >= 0.49 * COLUMNS
    np.testing.assert_array_equal(found.mean[is_asleep], 7.0)


@pytest.mark.parametrize(("begin", "end"), [(0.0, 1.0), (5.0, 5.0), (200.0, 300.0)])
def test_few_samples_are_drawn_as_they_are(begin: float, end: float) -> None:
    times = np.linspace(0.0, 100.0, DENSE)
    assert envelope(times, times, begin, end, holds=True) is None


@given(st.lists(st.tuples(st.integers(0, 3), st.sampled_from(["on", "off", None])), max_size=12))
@settings(max_examples=200, deadline=None)
def test_spans_hold_each_state_as_long_as_it_stands(steps: list[tuple[int, str | None]]) -> None:
    times = np.cumsum([wait for wait, _ in steps]).tolist()
    states = [state for _, state in steps]
    end = (times[-1] if times else 0) + 1
    spans = list(spans_of(times, states, end))
    for moment in np.arange(0.5, end, 1.0):
        holding = [state for time, state in zip(times, states, strict=True) if time <= moment][-1:] or [None]
        assert [state for since, until, state in spans if since <= moment < until] == [
            state for state in holding if state is not None
        ]
    assert all(one[1] < other[0] or one[2] != other[2] for one, other in pairwise(spans))


def test_of_very_many_spans_the_longest_in_each_column_is_kept() -> None:
    spans = [(float(n), n + (0.9 if n % 2 == 0 else 1.0), "rare" if n % 10 == 0 else "often") for n in range(100_000)]
    found = longest_spans(spans, 0.0, 100_000.0)
    assert [state for *_, state in found] == ["often"]
    few = longest_spans(spans, 100.0, 200.0)
    assert len(few) == 102
    assert {state for *_, state in few} == {"rare", "often"}


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (["robot[0].x", "robot[11].x"], ("robot[*].x", ["0", "11"])),
        (["a[0].b[1]", "a[0].b[2]"], ("a[0].b[*]", ["1", "2"])),
        (["a[0].b[1]", "a[1].b[2]"], ("", ["a[0].b[1]", "a[1].b[2]"])),
        (["a[0].x", "b[0].x"], ("", ["a[0].x", "b[0].x"])),
        (["a", "a[0]"], ("", ["a", "a[0]"])),
    ],
)
def test_names_of_an_array(names: list[str], expected: tuple[str, list[str]]) -> None:
    assert in_common(names) == expected


@pytest.mark.parametrize("count", [1, 8, 9, 20, 100])
def test_no_two_lines_have_one_colour(count: int) -> None:
    assert len(set(colours(count))) == count
