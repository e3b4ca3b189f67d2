"""What pages say in a real browser is what the run had: times, numbers, gaps and names, and what they leave out."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from epicycle.runner.show.view import lanes
from epicycle.runner.show.view import page as page_module

from .conftest import Opened, written

Open = Callable[..., Opened]

FINE = """
model: fine
actors: {clock: {type: Clock, period: 1 ns, offset: 100000.000000001 s}}
run: {stop: 100000.000000004 s, seed: 9223372036854775807}
"""


def test_times_and_seeds_are_shown_to_the_last_digit(tmp_path: Path, opened: Open) -> None:
    (tmp_path / "fine.yaml").write_text(FINE)
    (tmp_path / "late.yaml").write_text(FINE.replace("01 s}", "02 s}"))
    runs = [(str(tmp_path / f"{name}.yaml"), dict[str, str]()) for name in ("fine", "late")]
    page = opened(written(tmp_path / "page.html", *runs, names=("fine", "late")))
    words = page.words()
    assert "seed\t9223372036854775807\nend\t100000.000000004 s, stop time" in words
    assert "fine\t(100000.000000001 s, 1) clock.output send: 0" in words
    assert "fine\t(100000.000000001 s, 1) clock takes a wake-up; sends output 0" in words
    page.do("state.setTag(1)")
    assert page.words("#now") == "100000.000000002 s"


def test_the_words_at_an_axis_differ_and_stand_apart(wifi_page: Path, opened: Open) -> None:
    page = opened(wifi_page)
    said = page.do("""
        const { chart } = views, { text } = chart, seen = [];
        const wide = (words) => chart.paper.measureText(words).width;
        chart.text = (words, x, y) => { if (y === 11) seen.push([words, x, wide(words)]); };
        const drawn = () => { seen.length = 0; chart.write(10, false); chart.ruler(); return [...seen]; };
        state.show(2.4e9, 2.4e9 + 500);
        const near = drawn();
        state.show(0, state.end);
        const whole = drawn();
        state.setByTag(true);
        state.show(0, 8);
        const tags = drawn();
        chart.text = text;
        return [[near, whole, tags], chart.width];
    """)
    (near, whole, tags), width = said
    assert [words for words, _, _ in near][:3] == ["2.4 s", "2.4000001 s", "2.4000002 s"]
    assert whole[-1][0] == "4 s"
    assert tags[0][0] == "0 s"
    for words in (near, whole, tags):
        ends = [start + wide for _, start, wide in words]
        assert ends[-1] < width
        assert all(end < start for end, (_, start, _) in zip(ends, words[1:], strict=False))


NUMBERS = """
model: numbers
actors:
  clock: {type: Clock, period: 1 s}
  few: {type: Sequence, values: [1234567, 1e300, 1.5e-50, 123456789.0, 0.1]}
connections: [clock.output -> few.trigger]
run: {stop: 4 s, record: few.output}
"""


def test_numbers_are_shown_as_the_run_had_them(tmp_path: Path, opened: Open) -> None:
    (tmp_path / "numbers.yaml").write_text(NUMBERS)
    page = opened(written(tmp_path / "page.html", (str(tmp_path / "numbers.yaml"), {})))
    said = page.do("""
        const { lanes } = views, { text } = lanes, seen = [];
        lanes.text = (words, x, y, { size }) => { if (size === 11) seen.push(words); };
        for (let i = 0; i < 5; i++) { state.setTime(i * 1e9); lanes.paint(); }
        lanes.text = text;
        return seen;
    """)
    assert said == ["1234567", "1e+300", "1.5e-50", "1.23457e+8", "0.1"]


@pytest.mark.parametrize(
    ("style", "lines"), [("steps", [[0, 0, 1, 0], [2, 1, 3, 1, 3, 2, 4, 2]]), ("line", [[2, 1, 3, 2]])]
)
def test_a_line_has_gaps_where_there_is_no_number(
    style: str, lines: list[list[int]], tmp_path: Path, opened: Open
) -> None:
    text = NUMBERS.replace("1234567, 1e300, 1.5e-50, 123456789.0, 0.1", "0, .nan, 1, 2, .inf")
    (tmp_path / "gaps.yaml").write_text(
        f"{text}figures: {{f: {{type: TimeSeries, signals: few.output, style: {style}}}}}\n"
    )
    page = opened(written(tmp_path / "page.html", (str(tmp_path / "gaps.yaml"), {})))
    drawn = page.do("""
        const { lanes } = views, { line } = lanes, [lane] = state.run.lanes, seen = [];
        lanes.line = (points, colour, width) => { if (width === 1.4 && points.length > 2) seen.push(points); };
        lanes.numbers([lane], 0);
        lanes.line = line;
        const seconds = (x) => Math.round(lanes.at(x) / 1e9), values = (y) => Math.round((41 - y) / 17);
        return seen.map((points) => points.map((each, i) => i % 2 ? values(each) : seconds(each)));
    """)
    assert drawn == lines


LONG = f"long_{'name_' * 20}of_an_actor"
MUCH = f"""
model: much
parameters: {{a: {{value: 1}}, b: {{value: 2}}, c: {{value: 3}}}}
actors:
  clock: {{type: Clock, period: 1 s}}
  {LONG}: {{type: Scale, factor: "${{a + b + c}}"}}
connections: [clock.output -> {LONG}.input]
aspects: {{loss: {{type: PacketLoss, probability: 0.5, at: {LONG}.input}}}}
run: {{stop: 4 s, record: "**"}}
"""


def test_what_a_page_has_no_room_for_is_told(tmp_path: Path, opened: Open, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "much.yaml").write_text(MUCH)
    monkeypatch.setattr(lanes, "MOST", 1)
    monkeypatch.setattr(page_module, "SETTINGS", 1)
    page = opened(written(tmp_path / "page.html", (str(tmp_path / "much.yaml"), {})))
    words = page.words()
    assert "settings\ta = 1, and 2 more" in words
    told = "Not shown: 1 of the recorded signals, for which the page has no lane."
    assert f"{told} Record fewer, or choose them with a figure." in words


def test_names_that_are_cut_keep_their_end_and_badges_stand_above_lit_wires(tmp_path: Path, opened: Open) -> None:
    (tmp_path / "much.yaml").write_text(MUCH)
    page = opened(written(tmp_path / "page.html", (str(tmp_path / "much.yaml"), {})))
    said = page.do("""
        const { chart, graphs: [graph] } = views, seen = [], { paper } = chart;
        paper.fillText = (words) => seen.push(words);
        chart.paint();
        delete paper.fillText;
        const order = [];
        graph.tokens = () => order.push("tokens");
        graph.badges = () => order.push("badges");
        graph.paint();
        return [seen.filter((each) => each.includes("actor")), order];
    """)
    assert said[1] == ["tokens", "badges"]
    ((name,), _) = said
    assert name.startswith("…")
    assert LONG.endswith(name[1:])


def test_a_cone_may_be_of_any_size(wifi_page: Path, opened: Open) -> None:
    page = opened(wifi_page)
    words = page.do("""
        const back = { size: 3e5, keys: function* () { for (let i = 0; i < 3e5; i++) yield i % 10; } };
        return details.cone({ back, ahead: new Map(), isCut: false })[1].textContent;
    """)
    assert words == "led to it300,000 firings, 0 s to 0 s"


HOSTILE = """
model: hostile
doc: "<script>alert(1)</script></script><img src=x onerror=alert(2)>\\u202Eback"
parameters:
  words: {value: "</script><script>alert(3)</script>"}
actors:
  clock: {type: Clock, period: 0.1}
  said: {type: Const, value: "<img src=x onerror=alert(4)> ${words}\\u202Eback"}
connections:
  - clock.output -> said.trigger
aspects:
  lost: {type: PacketLoss, probability: 0.5, at: said.trigger}
run: {stop: 1 s, record: said.output}
metrics:
  last: {of: said.output, take: count, doc: "<b onmouseover=alert(5)>bold</b>"}
"""


def test_what_a_model_says_is_never_part_of_the_page(tmp_path: Path, opened: Open) -> None:
    model = tmp_path / "hostile.yaml"
    model.write_text(HOSTILE)
    path = written(tmp_path / "hostile.html", (str(model), {}))
    assert "alert" not in path.read_text()
    page = opened(path)
    words = page.words()
    assert "<script>alert(1)</script></script><img src=x onerror=alert(2)>\\u202eback" in words  # which is not obeyed
    assert "<b onmouseover=alert(5)>bold</b>" in words
    page.do("""
        const {run} = state, firing = run.firing_tag.findIndex((_, i) => run.actorName(i) === "said" && run.hasSent[i]);
        state.goTo({run: 0, firing, record: -1});
    """)
    assert "<img src=x onerror=alert(4)> </script><script>alert(3)</script>\\u202eback" in page.words()
    assert page.do("return state.run.lanes[0].states[0].slice(-10)") == "\\u202eback"
    assert page.tab.locator("img, iframe, .details script").count() == 0
