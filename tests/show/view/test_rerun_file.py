"""Files for rerun, read back with its own library."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from epicycle.runner import load_model
from epicycle.runner.show.space import ellipses
from epicycle.runner.show.view.recording import Recording, ViewError

from .exported import recorded, results_of


class Rerun:
    """A recording of rerun: its columns by entity, rows in the order of tags."""

    def __init__(self, path: Path) -> None:
        reader = pytest.importorskip("rerun.chunk").RrdReader(str(path))
        self.stores = [(each.kind, each.recording_id) for each in reader.recordings()]
        self.blueprints = len(reader.blueprints())
        self.static: dict[str, dict[str, Any]] = {}
        self.entities: dict[str, dict[str, list[Any]]] = {}
        for chunk in reader.store().stream().to_chunks():
            batch = chunk.to_record_batch()
            names = [name for name in batch.schema.names if not name.startswith("rerun.controls")]
            columns = {name: batch.column(name) for name in names}
            if "time" in columns:
                columns["time"] = columns["time"].cast("int64")
            found = (self.static if chunk.is_static else self.entities).setdefault(chunk.entity_path, {})
            for name, column in columns.items():
                found.setdefault(name, []).extend(column.to_pylist())

    def column(self, entity: str, name: str) -> list[Any]:
        """The values of a component of which there is one at a time."""
        return [each and each[0] for each in self.entities[entity][name]]


def rerun(recording: Recording, folder: Path) -> Rerun:
    pytest.importorskip("rerun")
    from epicycle.runner.show.view.rerun_file import write_rerun

    write_rerun(recording, folder / "run.rrd")
    return Rerun(folder / "run.rrd")


def test_rerun_has_signals_firings_and_acts(wifi: Recording, tmp_path: Path) -> None:
    file, results = rerun(wifi, tmp_path), results_of(wifi)
    assert file.stores == [("recording", results.digest)]
    assert file.blueprints == 1
    state = results["main.state"]
    for place in (0, 1):
        entity = rf"/signals/main/state/position\[{place}\]"
        assert file.entities[entity]["time"] == [tag.time for tag in state.tags]
        assert file.column(entity, "Scalars:scalars") == state["position"][:, place].tolist()
    assert set(file.column("/signals/main/plan/robot", "StateChange:state")) == {"main"}
    counts = [len(each["tag"]) for entity, each in file.entities.items() if entity.startswith("/firings/")]
    assert sum(counts) == wifi.firings
    assert file.column("/firings/clock", "Scalars:scalars")[:3] == [1.0, 2.0, 3.0]
    drops = file.column("/aspects/wifi_loss", "TextLog:text")
    assert len(drops) == results.aspects["wifi_loss"]["dropped"]
    assert drops[0].startswith('observer[1].peer_measurement: dropped {"robot": "observer[0]", ')
    (about,) = file.static["/about"]["TextDocument:text"]
    assert f"| digest | {results.digest} |" in about[0]


def test_rerun_has_a_place_for_each_microstep(wifi: Recording, tmp_path: Path) -> None:
    file = rerun(wifi, tmp_path)
    columns, tags, _ = wifi.kept()
    fired: dict[str, list[Any]] = {}
    for tag, actor in zip(columns["firing_tag"], columns["firing_actor"], strict=True):
        fired.setdefault(list(wifi.places)[actor], []).append(tags[tag])
    placed = {}
    for actor, found in fired.items():
        entity = "/firings/" + actor.replace(".", "/").replace("[", r"\[").replace("]", r"\]")
        assert file.entities[entity]["time"] == [tag.time for tag in found]
        placed |= dict(zip(found, file.entities[entity]["tag"], strict=True))
    assert len(set(placed.values())) == len(placed) > 1000
    assert sorted(placed, key=placed.__getitem__) == sorted(placed)
    # What stands in space at an instant stands there after its last microstep.
    body = file.entities["/space/body/main/state"]
    assert all(place >= 0 for place in body["tag"])
    last = {tag.time: placed[tag] for tag in sorted(placed)}
    assert [place >= last[time] for time, place in zip(body["time"], body["tag"], strict=True)] == [True] * 50


def test_rerun_has_tokens_of_any_kind_and_whole_nanoseconds(varied: Recording, tmp_path: Path) -> None:
    file = rerun(varied, tmp_path)
    mode = file.entities["/signals/it/pose/mode"]
    assert mode["time"] == [100_000_000_000_000 + ns for ns in (1, 1, 2, 2, 3, 3)]
    assert file.column("/signals/it/pose/mode", "StateChange:state")[::2] == [None, "slow ?", "fast"]
    assert file.column("/signals/it/pose/is_on", "StateChange:state")[::2] == ["true", "false", "true"]
    assert file.column(r"/signals/it/pose/matrix\[1\]\[1\]", "Scalars:scalars")[::2] == [1.0, 2.0, 0.0]
    limit = file.column("/signals/it/pose/limit", "Scalars:scalars")[::2]
    assert limit[:2] == [math.inf, 4.0]
    assert math.isnan(limit[2])
    assert file.column("/signals/it/number", "Scalars:scalars") == [0.0, 0.25, 0.5]


def test_rerun_has_what_figures_place_in_space(wifi: Recording, tmp_path: Path) -> None:
    file, results = rerun(wifi, tmp_path), results_of(wifi)
    body = file.entities["/space/body/main/state"]["Points3D:positions"]
    expected = [[*place, 0.0] for place in results["main.state"]["position"].tolist()]
    assert np.array(body)[:, 0] == pytest.approx(np.array(expected), rel=1e-6)
    assert file.static["/space/body/main/state"]["Points3D:labels"] == [["main"]]
    trail = file.entities["/space/trail/main/state"]["LineStrips3D:strips"]
    assert [len(each[0]) if each else 0 for each in trail] == [0, *range(2, 51)]
    disc = file.entities["/space/ellipse/main/estimate"]
    sizes = np.array(disc["Ellipsoids3D:half_sizes"])[:, 0, :2]
    assert sizes == pytest.approx(ellipses(results["main.estimate"])[:, 2:4], rel=1e-6)
    plan = file.entities["/space/tube/main/plan"]["Cylinders3D:radii"]
    assert np.array(plan) == pytest.approx(np.array([[0.2 + 0.4 * step for step in range(12)]] * 50))
    assert file.entities["/space/body/obstacle/state"]["Cylinders3D:radii"] == [[2.0]] * 50
    assert len(file.entities["/space/goal/goal"]["Points3D:positions"]) == 1


def test_equal_runs_are_equal_recordings_of_rerun(wifi: Recording, tmp_path: Path) -> None:
    one = rerun(wifi, tmp_path)
    other = rerun(recorded(load_model("collision_avoidance", disturb=["wifi_burst"])), tmp_path)
    assert one.entities == other.entities
    assert one.static == other.static
    assert one.stores == other.stores


def test_a_run_that_was_not_made_has_no_file(tmp_path: Path) -> None:
    with pytest.raises(ViewError) as caught:
        rerun(Recording(load_model("mm1"), {}), tmp_path)
    assert str(caught.value) == "a file needs a run that has been made: call Recording.run first"
