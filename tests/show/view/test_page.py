"""Pages in a real browser: they load without a request or an error, and what is clicked on tells its causes."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from epicycle.runner.model.catalogue.packaged import packaged_models
from epicycle.runner.show.view import drawing

from .conftest import Opened, written

Open = Callable[..., Opened]
SHORT = {
    "changing_roles": 5.0,
    "flying_observers": 2.0,
    "lift_group": 600.0,
    "machine_shop": 7e4,
    "manufacturing_cell": 3600.0,
    "inspection_paradox": 3600.0,
    "mg1": 500.0,
}
SHORT |= {"mm1": 500.0, "car_wash": 7200.0, "warehouse": 1800.0, "switched_network": 1.0}


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("view") / "pair.html"
    runs = [("collision_avoidance", {"set": [f"disturbance={level}"]}) for level in (0, 0.5)]
    return written(path, *runs, names=("calm", "lossy"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("width", "height", "scheme"), [(390, 844, "light"), (1280, 900, "dark"), (3840, 2160, "light")]
)
def test_all_views_draw_at_every_size(wifi_page: Path, opened: Open, width: int, height: int, scheme: str) -> None:
    page = opened(wifi_page, width, height, scheme)
    page.do("state.setTime(2.4e9)")
    if width < 820:  # one view at a time
        for tab, view in (("space", "space"), ("graph", "graph"), ("sequence", "chart"), ("signals", "lanes")):
            page.tab.get_by_role("button", name=tab, exact=True).click()
            page.do("")
            assert page.ink(view) > 3_000
        page.tab.get_by_role("button", name="details", exact=True).click()
    else:
        assert all(page.ink(view) > 5_000 for view in ("scrubber", "space", "graph", "chart", "lanes"))
    assert page.words().startswith("collision_avoidance")
    assert page.tab.evaluate("() => document.documentElement.scrollWidth") == width
    assert wifi_page.stat().st_size < 3_000_000


def test_a_dropped_plan_tells_why_the_robot_did_as_it_did(wifi_page: Path, opened: Open) -> None:
    page = opened(wifi_page)
    # The first plan that the main robot did not get after 2.2 s, clicked on in the sequence chart.
    spot = page.do("""
        const {run} = state, loss = run.losses.find(({record}) =>
            run.portPath(run.record_port[record]) === "main.peer_plan" && run.times[run.record_tag[record]] > 2.2e9);
        const tag = run.record_tag[loss.record];
        state.setByTag(true); state.setTag(tag); state.show(tag - 6, tag + 10);
        views.chart.scrollBy(views.chart.rows().at.get(loss.actor) * 19 - 60);
        views.chart.paint();
        const hit = views.chart.hits.find(([, , what]) => what.record === loss.record);
        return [hit[0], hit[1], run.tagText(tag)];
    """)
    box = page.tab.locator("canvas[data-view=chart]").bounding_box()
    page.tab.mouse.click(box["x"] + spot[0], box["y"] + spot[1])
    words = page.words()
    assert words.startswith(f"dropped by wifi_loss\nat main.peer_plan, {spot[2]}")
    assert "fired without it\nmain.controller fired at" in words
    assert "led to it" in words
    assert "came of it" in words
    # The controller's next firing says what it did not get, and what came of it: a control for the vehicle.
    page.tab.get_by_role("button", name="fired at").click()
    words = page.words()
    assert words.startswith("main.controller\nfired at")
    assert "did not get\nmain.peer_plan plans.output of" in words
    assert "dropped by wifi_loss" in words
    cone = page.do("""
        const names = (firings) => [...new Set([...firings.keys()].map((firing) => state.run.actorName(firing)))];
        return [names(state.cone.back), names(state.cone.ahead)];
    """)
    assert {"main.estimator", "observer[0].sensor", "plans", "clock"} <= set(cone[0])
    assert {"main.vehicle", "clearance"} <= set(cone[1])


@pytest.mark.slow
def test_time_can_be_scrubbed_stepped_and_played(wifi_page: Path, opened: Open) -> None:
    page = opened(wifi_page)
    box = page.tab.locator("canvas[data-view=scrubber]").bounding_box()
    page.tab.mouse.move(box["x"] + 10, box["y"] + 10)
    page.tab.mouse.down()
    page.tab.mouse.move(box["x"] + box["width"] / 2, box["y"] + 10, steps=4)
    page.tab.mouse.up()
    assert page.do("return state.time / state.end") == pytest.approx(0.5, abs=0.01)
    tag = page.do("return state.tag")
    page.tab.keyboard.press("ArrowRight")
    page.tab.keyboard.press("ArrowRight")
    page.tab.keyboard.press("ArrowLeft")
    assert page.do("return state.tag") == tag + 1
    page.tab.keyboard.press("Home")
    assert page.words("#now") == "0 s"
    page.tab.keyboard.press(" ")
    page.tab.wait_for_function("() => epicycle.state.time > 2e7")
    page.tab.keyboard.press(" ")
    stopped = page.do("return [state.isPlaying, state.time]")
    assert stopped[0] is False
    page.tab.keyboard.press("t")  # by tag: each microstep has a place of its own
    assert page.do("const {run} = state; return [state.axis.byTag, state.place(run, 5) - state.place(run, 4)]") == [
        True,
        1,
    ]


def test_keys_and_screen_readers_get_everywhere(wifi_page: Path, opened: Open) -> None:
    page = opened(wifi_page)
    keys = page.tab.keyboard
    steps = page.tab.locator("#page > header .group").first.locator("button")
    assert steps.evaluate_all("(all) => all.map((each) => each.ariaLabel)") == [
        "first tag",
        "previous tag",
        "play",
        "next tag",
    ]
    for name, live in (("play", "off"), ("pause", "polite")):
        page.tab.get_by_role("button", name=name, exact=True).click()
        page.do("")
        assert page.do("return document.getElementById('now').ariaLive") == live
    page.tab.locator("canvas[data-view=graph]").focus()
    keys.press("Home")
    keys.press("ArrowRight")
    selected = []
    for _ in range(2):
        keys.press("Enter")
        selected.append(page.words().splitlines()[:2])
    assert [said for _, said in selected] == [f"fired at {page.words('#now')}"] * 2
    assert selected[0] != selected[1]
    page.tab.get_by_role("button", name="later", exact=True).focus()
    seen = []
    for _ in range(2):
        keys.press("Enter")
        seen.append(page.do("return [document.activeElement.textContent, state.selection.firing]"))
    assert [name for name, _ in seen] == ["later", "later"]
    assert seen[0][1] < seen[1][1]


def test_composites_open_and_close(wifi_page: Path, opened: Open) -> None:
    page = opened(wifi_page)
    seen = page.do("""
        const graph = views.graphs[0], box = graph.boxes.get("main"), before = graph.isShut(box);
        const {x, y, scale} = graph.camera;
        graph.pick((box.at[0] + 30 - x) * scale, (box.at[1] + 40 - y) * scale);
        const after = graph.isShut(box), actor = graph.boxOf("main.sensor").path;
        return [before, after, actor];
    """)
    assert seen == [True, False, "main.sensor"]


def test_clicks_on_bodies_and_actors_select_what_they_did(wifi_page: Path, opened: Open) -> None:
    page = opened(wifi_page)
    place = page.do("""
        state.setTime(2.45e9);
        const space = views.spaces[0]; space.paint();
        const at = space.place(space.marks.find(({name}) => name === "observer[1].state"), 2.45);
        return [space.x(at[0]), space.y(at[1])];
    """)
    box = page.tab.locator("canvas[data-view=space]").bounding_box()
    page.tab.mouse.click(box["x"] + place[0], box["y"] + place[1])
    assert page.words().startswith("observer[1].vehicle\nfired at 2.4 s")
    page.tab.keyboard.press("Escape")
    assert page.words().startswith("collision_avoidance")


@pytest.mark.slow
def test_clicks_on_aspects_select_what_they_did(wifi_page: Path, opened: Open) -> None:
    page = opened(wifi_page, 2000, 1400)
    page.do("""
        state.setTime(2.45e9);
        const graph = views.graphs[0]; graph.shut.set("main", false); graph.paint();
        const badge = graph.drawing.badges.find((each) => each[1] === "wifi_loss" && each[5] === "main.peer_plan");
        const {x, y, scale} = graph.camera;
        graph.pick((badge[2] + 3 - x) * scale, (badge[3] - y) * scale);
    """)
    assert re.match(r"dropped by wifi_loss\nat main\.peer_plan, 2\.201 s\n", page.words())
    page.do("""
        const {run} = state, row = run.aspects.indexOf("wifi_latency");
        const act = run.acts.find((record) =>
            run.record_aspect[record] === row && run.times[run.record_tag[record]] > 1e9);
        state.show(0.9e9, 1.2e9);
        views.lanes.pick(views.lanes.x(run.times[run.record_tag[act]]), 18 + 17 * row + 8);
    """)
    assert page.words().startswith("delayed by wifi_latency\nat ")


def test_tokens_travel_along_their_wires(wifi_page: Path, opened: Open) -> None:
    page = opened(wifi_page)
    routes = page.do("""
        const graph = views.graphs[0], {run} = state, found = {};
        for (let i = 0; i < run.arrival_record.length; i++) {
            const from = run.record_port[run.arrival_record[i]], to = run.arrival_port[i];
            const route = graph.route(from, to);
            const start = graph.portOf(from), end = graph.portOf(to), last = route.points.length - 2;
            const fits = Math.hypot(route.points[0] - start.x, route.points[1] - start.y) < 0.2
                && Math.hypot(route.points[last] - end.x, route.points[last + 1] - end.y) < 0.2;
            found[`${run.portPath(from)} ${run.portPath(to)}`] = fits;
        }
        return found;
    """)
    assert len(routes) > 60
    assert [name for name, fits in routes.items() if not fits] == []


ALL_LOST = """
model: all_lost
actors:
  clock: {type: Clock, period: 1 s}
  noisy: {type: Scale, factor: 2.0}
  heard: {type: Recorder}
  deaf: {type: Recorder}
connections: [clock.output -> noisy.input, noisy.output -> heard.input, noisy.output -> deaf.input]
aspects:
  noise: {type: Noise, deviation: 0.1, at: noisy.output}
  lost: {type: PacketLoss, probability: 1, at: deaf.input}
run: {stop: 5 s}
"""


@pytest.mark.slow
def test_noise_loses_nothing_and_who_gets_nothing_never_fires(tmp_path: Path, opened: Open) -> None:
    model = tmp_path / "all_lost.yaml"
    model.write_text(ALL_LOST)
    page = opened(written(tmp_path / "page.html", (str(model), {})))
    losses = page.do("""
        const {run} = state;
        return run.losses.map(({record, actor}) => [run.events[run.record_event[record]], run.places[actor]]);
    """)
    assert losses == [["dropped", "deaf"]] * 6
    page.do("state.goTo({run: 0, firing: -1, record: state.run.losses[2].record})")
    words = page.words()
    assert words.startswith("dropped by lost\nat deaf.input, 2 s\n")
    assert "fired without it" not in words  # it has never fired


@pytest.mark.slow
def test_monitors_say_when_they_broke_and_lead_there(tmp_path: Path, opened: Open) -> None:
    model = tmp_path / "m.yaml"
    model.write_text(
        "model: m\nactors: {clock: {type: Clock, period: 1 s}}\nrun: {stop: 10 s}\n"
        "monitors: {low: always clock.output < 4, high: eventually clock.output > 8}\n",
        encoding="utf-8",
    )
    page = opened(written(tmp_path / "m.html", (str(model), {})))
    words = page.words()
    assert "Monitor low\nalways clock.output < 4\tbroken at 4 s, where clock.output = 4, robustness -6" in words
    assert "Monitor high\neventually clock.output > 8\tholds, robustness 2" in words
    page.tab.get_by_role("button", name="go to the break").click()
    assert page.do("return state.time") == 4e9


@pytest.mark.slow
def test_two_runs_are_shown_side_by_side_with_their_first_difference(pair: Path, opened: Open) -> None:
    page = opened(pair)
    page.do("state.setTime(2e9)")
    assert page.do("return [views.spaces.length, views.graphs.length, state.tags.length]") == [2, 2, 2]
    words = page.words()
    assert words.startswith("First difference\ncalm\t(")
    assert "\nlossy\t(" in words
    assert "arrival_time_0_2m" in words
    page.tab.get_by_role("button", name="go there").click()
    assert page.do("return state.tag === state.run.tagOfDifference") is True
    page.tab.get_by_role("button", name="lossy", exact=True).click()
    assert page.do("return [state.active, state.tag === state.run.tagOfDifference]") == [1, True]


@pytest.mark.slow
@pytest.mark.parametrize("model", sorted(packaged_models()))
def test_every_packaged_model_has_a_page(model: str, tmp_path: Path, opened: Open) -> None:
    path = written(tmp_path / "page.html", (model, {}), until=SHORT.get(model))
    page = opened(path)
    page.do("state.setTime(state.end / 2)")
    assert page.ink("graph") > 2_000
    assert page.ink("chart") > 5_000
    assert page.ink("lanes") > 2_000
    middle = page.do("""
        const firing = Math.floor(state.run.firing_tag.length / 2);
        state.goTo({run: 0, firing, record: -1});
        return [state.run.actorName(firing), state.cone.back.size + state.cone.ahead.size];
    """)
    assert page.words().startswith(middle[0])
    assert middle[1] > 1
    assert path.stat().st_size < 3_000_000


def lines(path: Path, *, count: int, length: int) -> Path:
    """A model of lines of actors, each in a composite of its own."""
    text = ["model: lines", "composites:"]
    for line in range(count):
        text += [f"  Line{line}:", "    inputs: [input]", "    outputs: [output]", "    actors:"]
        kinds = ("TimeDelay, delay: 0.01", "Scale, factor: 1.01")
        text += [f"      stage{n}: {{type: {kinds[(n + line) % 3 > 0]}}}" for n in range(length)]
        text += ["    connections:", "      - input -> stage0.input", f"      - stage{length - 1}.output -> output"]
        text += [f"      - stage{n}.output -> stage{n + 1}.input" for n in range(length - 1)]
    text.append("actors:")
    for line in range(count):
        text += [
            f"  clock{line}: {{type: Clock, period: {0.1 + 0.01 * line:.2f}}}",
            f"  line{line}: {{type: Line{line}}}",
        ]
    text.append("connections:")
    text += [f"  - clock{line}.output -> line{line}.input" for line in range(count)]
    path.write_text("\n".join([*text, "run: {stop: 3 s}"]))
    return path


INSIDE = """
model: inside
composites:
  Line:
    actors: {clock: {type: Clock, period: 1 s}, scale: {type: Scale, factor: 2}, sink: {type: Recorder}}
    connections: [clock.output -> scale.input, scale.output -> sink.input]
actors: {first: {type: Line}, second: {type: Line}}
run: {stop: 2 s}
"""


@pytest.mark.parametrize(
    ("most", "note", "boxes"),
    [
        (8, "", ["first", "first.clock", "first.scale", "first.sink"]),  # alike: the second is folded into it
        (7, "8 boxes are too many to draw: composites are drawn closed", ["first"]),
        (1, "8 boxes are too many to draw: what is of one type, with names that are alike, is one box", ["first"]),
        (0, "8 boxes are too many to draw", []),
    ],
)
def test_what_is_too_much_to_draw_is_told(
    most: int, note: str, boxes: list[str], tmp_path: Path, opened: Open, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "inside.yaml").write_text(INSIDE)
    monkeypatch.setattr(drawing, "MOST_BOXES", most)
    page = opened(written(tmp_path / "page.html", (str(tmp_path / "inside.yaml"), {})))
    assert page.do("return [...views.graphs[0].boxes.keys()].filter((each) => each.startsWith('first'))") == boxes
    assert page.tab.locator(".graph > .note").all_inner_texts() == ([note] if note else [])
    lit = page.do("const found = views.graphs[0].boxOf('first.scale'); return found ? found.path : ''")
    assert lit == ("first.scale" if not note else "first" if boxes else "")


@pytest.mark.slow
@pytest.mark.parametrize(("until", "events"), [(3.0, 20_000), (125.0, 1_000_000)])
def test_two_thousand_actors_and_a_million_events_fit_into_a_page(
    until: float, events: int, tmp_path: Path, opened: Open, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(drawing, "FEW", 40)  # every replica is a box of its own
    monkeypatch.setattr(drawing, "MOST_BOXES", 3_000)
    model = lines(tmp_path / "lines.yaml", count=40, length=49)
    path = written(tmp_path / "page.html", (str(model), {}), until=until)
    start = time.perf_counter()
    page = opened(path)
    page.do("state.setTime(state.end / 2)")
    taken = time.perf_counter() - start
    assert page.do("return state.run.drawing.boxes.length") == 40 * 51
    assert page.do("return state.run.record_tag.length") > events
    assert path.stat().st_size < 20_000_000
    assert taken < 5.0
    painted = page.do("""
        const all = [views.scrubber, ...views.graphs, views.chart, views.lanes], start = performance.now();
        state.isPlaying = true;
        for (let i = 0; i < 20; i++) { state.setTime(state.end * i / 20); for (const view of all) view.paint(); }
        state.isPlaying = false;
        return (performance.now() - start) / 20;
    """)
    assert painted < 60.0  # ms, in a browser without a graphics card
