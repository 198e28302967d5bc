"""Sweeps: plans, the folder of results whatever happens to its writer, and rows by Ray that fail, hang, die and lose their machine."""

import importlib
import json
import os
import re
import resource
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import kerf

pa = pytest.importorskip("pyarrow")
import pyarrow.parquet as pq  # noqa: E402

import kerf.sweep  # noqa: E402
from kerf.sweep import Plan, _store  # noqa: E402
from kerf.sweep.__main__ import main  # noqa: E402


def square(parameters, seed):
    return {"square": parameters["x"] ** 2, "both": parameters["x"] + seed}


def numbers_of(folder):
    return kerf.sweep.read(folder)["row"].to_pylist()


# --- Plans ---


def test_all_combinations_in_order():
    plan = Plan({"a": [1, 2, 3], "material.young": [1e4, 2e4]}, seeds=[5, 9])
    assert len(plan) == 12 and plan.names == ["a", "material.young"]
    assert [tuple(row) for row in plan[:5]] == [(0, {"a": 1, "material.young": 1e4}, 5), (1, {"a": 1, "material.young": 1e4}, 9),
                                                (2, {"a": 1, "material.young": 2e4}, 5), (3, {"a": 1, "material.young": 2e4}, 9),
                                                (4, {"a": 2, "material.young": 1e4}, 5)]
    assert [row.number for row in plan] == list(range(12)) and plan[-1] == plan[11]
    with pytest.raises(IndexError):
        plan[12]


def test_random_values_belong_to_seed_and_name():
    kinds = {"u": {"uniform": [2, 3]}, "l": {"log_uniform": [1e-3, 1e3]}, "n": {"normal": [5, 0]}, "i": {"integers": [1, 3]}, "c": {"choice": ["p", "q"]}}
    plan = Plan({"a": [1, 2]}, random=kinds, seeds=200)
    rows = list(plan)
    assert all(2 <= row.parameters["u"] <= 3 and 1e-3 <= row.parameters["l"] <= 1e3 and row.parameters["n"] == 5 for row in rows)
    assert {row.parameters["i"] for row in rows} == {1, 2, 3} and {row.parameters["c"] for row in rows} == {"p", "q"}
    assert all(rows[i].parameters == {**rows[200 + i].parameters, "a": 1} for i in range(200))
    fewer = Plan({"a": [1, 2]}, random={"u": kinds["u"]}, seeds=[7])
    assert fewer[0].parameters["u"] == rows[7].parameters["u"]


def test_rows_as_they_stand():
    plan = Plan(rows=[{"a": np.float32(0.5)}, {"a": 2, "b": np.arange(3)}])
    assert [row.parameters for row in plan] == [{"a": 0.5}, {"a": 2, "b": [0, 1, 2]}] and plan.names == ["a", "b"]


def test_a_fingerprint_is_of_all_rows():
    plans = [Plan({"a": [1, 2]}), Plan({"a": [1, 3]}), Plan({"b": [1, 2]}), Plan({"a": [1, 2]}, seeds=2), Plan({"a": [1, 2]}, seeds=[1]),
             Plan({"a": [1, 2]}, random={"b": {"uniform": [0, 1]}}), Plan(rows=[{"a": 1}, {"a": 2}])]
    assert len({plan.fingerprint for plan in plans}) == len(plans) and plans[0].fingerprint == Plan({"a": (1, 2)}, seeds=range(1)).fingerprint


@pytest.mark.parametrize("given, error", [
    ({"grid": {"a": []}}, ValueError), ({"grid": {"seed": [1]}}, ValueError), ({"grid": {"a": "text"}}, TypeError), ({"grid": {1: [1]}}, TypeError),
    ({"grid": {"a": [{}]}}, TypeError), ({"grid": {}, "rows": []}, ValueError), ({"rows": [1]}, TypeError), ({"seeds": 0}, ValueError),
    ({"seeds": [1, 1]}, ValueError), ({"seeds": [-1]}, ValueError), ({"seeds": 1.5}, TypeError), ({"random": {"a": {"uniform": [2, 1]}}}, ValueError),
    ({"random": {"a": {"gauss": [0, 1]}}}, ValueError), ({"random": {"a": {"uniform": [1]}}}, ValueError),
    ({"random": {"a": {"log_uniform": [0, 1]}}}, ValueError), ({"grid": {"a": [1]}, "random": {"a": {"uniform": [0, 1]}}}, ValueError)])
def test_plans_that_are_none(given, error):
    with pytest.raises(error):
        Plan(**given)


def test_a_plan_of_many_rows_is_small():
    plan = Plan({"a": range(1000), "b": range(1000)}, seeds=1000)
    assert len(plan) == 10**9 and plan[10**9 - 1].parameters == {"a": 999, "b": 999} and plan[123_456_789] == (123_456_789, {"a": 123, "b": 456}, 789)


# --- The folder ---


def test_rows_in_this_process(tmp_path):
    folder = tmp_path / "results"
    summary = kerf.sweep.run(square, Plan({"x": [1, 2.5, 3]}, seeds=2), folder, workers=0)
    assert (summary.rows, summary.done, summary.new, summary.failed) == (6, 6, 6, 0)
    table = kerf.sweep.read(folder)
    assert table.column_names == ["row", "seed", "x", "square", "both", "seconds", "tries", "host", "kerf", "error_kind", "error"]
    assert table["square"].to_pylist() == [1, 1, 6.25, 6.25, 9, 9] and table["both"].to_pylist() == [1, 2, 2.5, 3.5, 3, 4]
    assert set(table["kerf"].to_pylist()) == {kerf.__version__} and table["error"].null_count == 6
    assert sorted(os.listdir(folder)) == ["_journal.jsonl", "_lock", "_sweep.json", "rows-000000.parquet"]
    assert (folder / "_journal.jsonl").stat().st_size == 0
    again = kerf.sweep.run(square, Plan({"x": [1, 2.5, 3]}, seeds=2), folder, workers=0)
    assert (again.done, again.new) == (6, 0) and kerf.sweep.read(folder).equals(table)


def test_all_kinds_of_results(tmp_path):
    def kinds(parameters, seed):
        return [{"a": 1, "b": [1, 2], "c": "x", "d": None, "e": True}, {"a": 0.5, "b": np.zeros(0), "c": "y", "d": 3, "e": np.False_},
                {"a": np.nan, "b": np.float32([0.5]), "late": np.int64(3)}, {"a": "text"}][parameters["i"]]

    kerf.sweep.run(kinds, [{"i": i} for i in range(4)], tmp_path, workers=0)
    rows = kerf.sweep.read(tmp_path).to_pylist()
    assert rows[0]["b"] == [1, 2] and rows[1]["b"] == [] and rows[2]["b"] == [0.5] and rows[3]["b"] is None
    assert [row["late"] for row in rows] == [None, None, 3, None] and [row["e"] for row in rows[:2]] == [True, False]
    assert [row["a"] for row in rows] == ["1", "0.5", "NaN", "text"]  # a column of numbers and texts is one of texts


STRANGE = os.fsdecode(b"\xff.stl")  # the name of a file, not UTF-8


def test_texts_that_are_not_utf_8(tmp_path):
    def texts(parameters, seed):
        if seed == 2:
            open(STRANGE)
        if seed == 4:
            return {STRANGE: 1}
        return [{"t": "plain", "all": ["x"], "some": 1}, {"t": STRANGE, "all": [STRANGE], "some": STRANGE}][seed % 2]

    plan = Plan(rows=[{"mesh": STRANGE}], seeds=5)
    assert kerf.sweep.run(texts, plan, tmp_path, workers=0).failed == 2
    rows = kerf.sweep.read(tmp_path).to_pylist()
    assert rows[1]["t"] == rows[1]["some"] == rows[1]["mesh"] == "\\udcff.stl" and rows[1]["all"] == ["\\udcff.stl"] and rows[0]["some"] == "1"
    assert "No such file" in rows[2]["error"] and "\\udcff.stl" in rows[2]["error"] and "is not UTF-8" in rows[4]["error"]
    again = kerf.sweep.run(texts, plan, tmp_path, workers=0, retry_errors=True)
    assert (again.new, again.failed) == (2, 2) and kerf.sweep.read(tmp_path)["row"].to_pylist() == list(range(5))
    with pytest.raises(ValueError, match="not UTF-8"):
        Plan({STRANGE: [1]})


def test_a_row_that_was_lost_has_an_error_that_is_not_utf_8(tmp_path):
    store = opened(tmp_path)
    store.add([{**ROWS[0], "error_kind": "died", "error": STRANGE}])
    store.close()
    opened(tmp_path).close()
    assert kerf.sweep.read(tmp_path)["error"].to_pylist() == ["\\udcff.stl"]


@pytest.mark.parametrize("long, other", [(2**60 + 1, 0.5), ([2**60 + 1], [0.5]), (2**63 + 5, 0.5), (2**63 + 5, 5), (2**60 + 1, "x")])
@pytest.mark.parametrize("rows_of_a_file", [1, 2])
def test_long_numbers_beside_others(tmp_path, monkeypatch, long, other, rows_of_a_file):
    monkeypatch.setattr(_store, "MOST_ROWS", rows_of_a_file)

    def either(parameters, seed):
        return {"h": other if seed else long}

    for _ in range(2):
        assert kerf.sweep.run(either, Plan(seeds=2), tmp_path, workers=0).done == 2
    first, second = kerf.sweep.read(tmp_path)["h"].to_pylist()
    if isinstance(first, str):
        first, second = json.loads(first), second if isinstance(other, str) else json.loads(second)
    assert first == pytest.approx(long, rel=1e-15) and second == other


@pytest.mark.parametrize("result, words", [([1], "returns a dict"), ({"x": 1}, "'x' can't be the name"), ({"error": 1}, "'error' can't be"), ({"y": {}}, "y must be made of"),
                                           ({1: 1}, "names of results")])
def test_results_that_are_none(tmp_path, result, words):
    assert kerf.sweep.run(lambda parameters, seed: result, [{"x": 1}], tmp_path, workers=0).failed == 1
    row = kerf.sweep.read(tmp_path).to_pylist()[0]
    assert words in row["error"] and row["error_kind"] == "raised" and row["x"] == 1


def test_what_a_row_raises_is_its_error(tmp_path):
    def fails(parameters, seed):
        if parameters["young"] == 3:
            sys.exit("gone")
        return {"mass": kerf.Session({"body": {"model": "sheet"}, "material": {"young": parameters["young"]}}).uncut_mass / parameters["divide"]}

    plan = Plan(rows=[{"young": 1e4, "divide": 1}, {"young": -1, "divide": 1}, {"young": 1e4, "divide": 0}, {"young": 3, "divide": 1}])
    assert kerf.sweep.run(fails, plan, tmp_path, workers=0).failed == 3
    errors = kerf.sweep.read(tmp_path)["error"].to_pylist()
    assert errors[0] is None and errors[1].startswith("kerf.Error: scene:") and "young" in errors[1]
    assert errors[2].startswith("ZeroDivisionError: ") and "(test_sweep.py:" in errors[2] and errors[3].startswith("SystemExit: gone")
    again = kerf.sweep.run(lambda parameters, seed: {"mass": 1.0}, plan, tmp_path / "other", workers=0)
    assert again.failed == 0


def ends_at_3(parameters, seed):
    if seed == 3:
        time.sleep(parameters["pause"] / 20)
        os.kill(int(parameters["driver"]), signal.SIGTERM)
        time.sleep(parameters["pause"])
    return {"y": seed}


def terminated(folder, workers, pause):
    """Does a run in this process take SIGTERM for Ctrl-C? What was done with the signal before is done again behind it."""
    caught = []
    before = signal.signal(signal.SIGTERM, lambda *_: caught.append(True))
    try:
        with pytest.raises(KeyboardInterrupt):
            kerf.sweep.run(ends_at_3, Plan({"driver": [os.getpid()], "pause": [pause]}, seeds=200), folder, workers=workers)
        os.kill(os.getpid(), signal.SIGTERM)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert caught == [True]
    assert 0 < len(numbers_of(folder)) <= 3 and (folder / "_journal.jsonl").stat().st_size == 0


def test_termination_in_this_process(tmp_path):
    terminated(tmp_path, workers=0, pause=0)
    assert numbers_of(tmp_path) == [0, 1, 2]


def test_failed_rows_are_tried_again_on_request(tmp_path):
    def half(parameters, seed):
        if seed % 2 and not os.environ.get("KERF_TEST_MENDED"):
            raise ValueError("odd")
        return {"y": seed}

    plan = Plan(seeds=9)
    assert kerf.sweep.run(half, plan, tmp_path, workers=0).failed == 4
    assert kerf.sweep.run(half, plan, tmp_path, workers=0).new == 0
    os.environ["KERF_TEST_MENDED"] = "1"
    try:
        summary = kerf.sweep.run(half, plan, tmp_path, workers=0, retry_errors=True)
    finally:
        del os.environ["KERF_TEST_MENDED"]
    assert (summary.done, summary.new, summary.failed) == (9, 4, 0)
    assert kerf.sweep.read(tmp_path)["y"].to_pylist() == list(range(9)) and numbers_of(tmp_path) == list(range(9))


def test_another_sweep_or_something_else_is_not_overwritten(tmp_path):
    kerf.sweep.run(square, Plan({"x": [1]}), tmp_path / "a", workers=0)
    with pytest.raises(kerf.Error, match="holds another sweep, whose plan"):
        kerf.sweep.run(square, Plan({"x": [2]}), tmp_path / "a", workers=0)
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "thesis.txt").write_text("years")
    with pytest.raises(kerf.Error, match="something else"):
        kerf.sweep.run(square, Plan({"x": [2]}), tmp_path / "b", workers=0)
    assert os.listdir(tmp_path / "b") == ["thesis.txt"]
    for folder in (tmp_path / "b", tmp_path / "none"):
        with pytest.raises(kerf.Error, match="no folder of a sweep"):
            kerf.sweep.read(folder)


HEAD, ROWS = {"title": None}, [{"row": i, "seed": 0, "x": i / 2, "seconds": 0.0, "tries": 1, "host": "h", "kerf": "k", "error_kind": None, "error": None} for i in range(40)]


def opened(folder):
    return _store.Store(folder, HEAD, ["x"], 40)


def test_one_writer_at_a_time(tmp_path):
    store = opened(tmp_path)
    with pytest.raises(kerf.Error, match="another program"):
        opened(tmp_path)
    store.close()
    store.close()
    opened(tmp_path).close()


def test_a_journal_that_ends_in_the_middle_of_a_row(tmp_path):
    store = opened(tmp_path)
    store.add(ROWS[:10])
    text = (tmp_path / "_journal.jsonl").read_bytes()
    for cut in (1, 20, len(text.splitlines()[-1])):
        folder = tmp_path / str(cut)
        folder.mkdir()
        (folder / "_sweep.json").write_bytes((tmp_path / "_sweep.json").read_bytes())
        (folder / "_journal.jsonl").write_bytes(text[:-cut])
        assert numbers_of(folder) == list(range(9))
        again = opened(folder)
        assert np.flatnonzero(again.done).tolist() == list(range(9))
        again.add(ROWS[5:12])  # those that are there already stay as they are
        again.close()
        assert numbers_of(folder) == list(range(12))
    store.close()


def test_a_writer_killed_between_file_and_journal(tmp_path):
    store = opened(tmp_path)
    store.add(ROWS[:10])
    text = (tmp_path / "_journal.jsonl").read_bytes()
    store.close()
    (tmp_path / "_journal.jsonl").write_bytes(text)
    (tmp_path / ".rows-000001.parquet.tmp").write_bytes(b"PAR1 and no more")
    assert numbers_of(tmp_path) == list(range(10))
    again = opened(tmp_path)
    assert again.done.sum() == 10 and not list(tmp_path.glob(".rows*"))
    again.add(ROWS[10:])
    again.close()
    assert numbers_of(tmp_path) == list(range(40)) and len(list(tmp_path.glob("rows-*.parquet"))) == 2


@pytest.mark.parametrize("listed", [False, True])
def test_ctrl_c_behind_a_new_file(tmp_path, listed):
    class Interrupted(list):
        def append(self, path):
            if listed:
                super().append(path)
            store._parts = list(self)
            raise KeyboardInterrupt

    store = opened(tmp_path)
    store.add([{**row, "y": 1} for row in ROWS[:3]])
    store._flush()
    store.add([{**row, "y": 0.5} for row in ROWS[3:6]])
    store._parts = Interrupted(store._parts)
    with pytest.raises(KeyboardInterrupt):
        store._flush()
    store.close()
    parts = sorted(tmp_path.glob("rows-*.parquet"))
    assert sum(len(pq.read_table(part)) for part in parts) == 6 and len({str(pq.read_schema(part)) for part in parts}) == 1


def test_all_files_have_the_same_columns(tmp_path, monkeypatch):
    monkeypatch.setattr(_store, "MOST_ROWS", 3)
    values = [None, None, None, 1, 2, 3, 0.5, 2, 1, 7]
    kerf.sweep.run(lambda parameters, seed: {"v": values[seed], **({"late": "x"} if seed > 7 else {})}, Plan(seeds=10), tmp_path, workers=0)
    parts = sorted(tmp_path.glob("rows-*.parquet"))
    assert len(parts) == 4 and len({str(pq.read_schema(part)) for part in parts}) == 1
    assert kerf.sweep.read(tmp_path)["v"].to_pylist() == values
    assert pq.ParquetDataset(tmp_path).read()["late"].null_count == 8  # and any reader of Parquet takes them together


# --- Scenes ---

HELD = [{"half_space": {"point": [0, 0.45, 0], "normal": [0, 1, 0]}}]
SCENE = {"body": {"model": "sheet"}, "simulation": {"time_step": 0.01, "duration": 0.2}, "fix": HELD,
         "command": [{"at": 0.05, "type": "punch", "point": [0, 0, 0], "radius": 0.1, "frame": "rest"}]}


def test_keys_of_a_scene(tmp_path):
    plan = Plan({"material.young": [1e4, 1e6], "command.0.radius": [0.05, 0.1]})
    kerf.sweep.run(kerf.sweep.Scene(SCENE), plan, tmp_path, workers=0)
    rows = kerf.sweep.read(tmp_path).to_pylist()
    assert all(row["error"] is None and row["time"] == pytest.approx(0.2) and row["pieces"] == 2 for row in rows)
    assert rows[0]["lowest"] < rows[2]["lowest"] and rows[0]["piece_masses"][1] < rows[1]["piece_masses"][1]
    alone = kerf.Session({**SCENE, "material": {"young": 1e6}})
    alone.step(20)
    assert rows[3]["hash"] == f"{alone.hash:016x}"


@pytest.mark.parametrize("name, words", [("command.1.radius", "1 is none of the 1 numbers"), ("command.x.radius", "x is none"), ("body.model.x", "there is a str"),
                                         ("material.yung", "yung"), ("command.0.radius", "radius")])
def test_keys_that_a_scene_does_not_have(tmp_path, name, words):
    kerf.sweep.run(kerf.sweep.Scene(SCENE), Plan({name: [-1.0]}), tmp_path, workers=0)
    error = kerf.sweep.read(tmp_path)["error"][0].as_py()
    assert error.startswith("kerf.Error: ") and words in error


@pytest.mark.parametrize("name", ["sheet", "steak", "meniscus"])
def test_a_shipped_scene_is_the_same_to_the_bit(name):
    alone = kerf.Session(name)
    alone.step(2)
    scene = kerf.sweep.Scene(name, steps=2)
    for _ in range(2):
        assert scene({}, 1)["hash"] == f"{alone.hash:016x}"
        scene.bind([])


def test_a_scene_in_a_file_brings_its_meshes_along(tmp_path):
    kerf.Session("meniscus", scripted=False).to_trimesh().export(tmp_path / "own.stl")
    (tmp_path / "own.toml").write_text("body.visual = 'own.stl'\nbody.collision_triangles = 200\n[simulation]\ntime_step = 0.01\nduration = 0.05\n")
    scene = kerf.sweep.Scene(tmp_path / "own.toml")
    alone = kerf.Session(tmp_path / "own.toml")
    alone.step(5)
    scene.bind(["material.young"])
    (tmp_path / "own.stl").unlink()
    assert scene({}, 1)["hash"] == f"{alone.hash:016x}"


HALVES = {"visual": "halves.off", "thickness": 0.01}


@pytest.mark.parametrize("body, refused", [
    ({"model": "closed-sheet", "size": [0.12, 0.09, 0.002]}, False), ({"model": "sheet", "size": [0.12, 0.09, 0.002]}, True), ({**HALVES, "weld": 1e-9}, False),
    ({**HALVES, "weld": 0}, True), (HALVES, True), ({"visual": "sheet"}, True), ({**HALVES, "weld": 1e-9, "collision_triangles": 0, "exact_paths": True}, False),
    ({**HALVES, "weld": 1e-9, "scale": 2, "position": [0, 0, 0.1], "collision": None}, False)])
def test_a_body_is_bound_with_all_its_keys(tmp_path, monkeypatch, body, refused):
    monkeypatch.chdir(tmp_path)
    points = [(x / 10, y / 10, 0) for end in (0, 4) for x in range(end, end + 5) for y in range(5)]  # two sheets, a rim of each at one place
    firsts = [25 * half + 5 * x + y for half in (0, 1) for x in range(4) for y in range(4)]
    triangles = [(3, i, *ends) for i in firsts for ends in ((i + 5, i + 6), (i + 6, i + 1))]
    rows = [(len(points), len(triangles), 0), *points, *triangles]
    Path("halves.off").write_text("\n".join(["OFF", *(" ".join(map(str, row)) for row in rows), ""]))
    scene = {"body": body, "simulation": {"time_step": 0.01, "threads": 1, "seed": 1}}
    swept = kerf.sweep.Scene(scene, steps=1)
    if refused:
        for make in (lambda: kerf.Session(scene), lambda: swept.bind([]) or swept({}, 1)):
            with pytest.raises(kerf.Error):
                make()
        return
    alone = kerf.Session(scene)
    alone.step()
    swept.bind([])
    assert swept({}, 1)["hash"] == f"{alone.hash:016x}"


def test_a_scene_that_was_edited_is_another_sweep(tmp_path):
    path, plan = tmp_path / "own.toml", Plan({"material.young": [1e4]})
    path.write_text('body.model = "sheet"\nsimulation.duration = 0.02\n')
    (tmp_path / "moved").mkdir()
    (tmp_path / "moved" / "other.toml").write_text(path.read_text())
    body = kerf.bind("sheet")

    def first(session):
        return {"y": 1}

    def second(session):
        return {"y": 2}

    Scene = kerf.sweep.Scene
    for i, scene in enumerate([Scene(path), Scene("sheet", steps=1), Scene({"body": {"bound": body}}, steps=1, measure=first)]):
        kerf.sweep.run(scene, plan, tmp_path / str(i), workers=0)
    same = [(0, Scene(tmp_path / "moved" / "other.toml")), (1, Scene("sheet", steps=1)), (2, Scene({"body": {"bound": kerf.bind("sheet")}}, steps=1, measure=first))]
    path.write_text(path.read_text().replace("0.02", "0.03"))
    others = [(0, Scene(path)), (1, Scene("sheet", steps=2)), (1, Scene("sheet", steps=1, scripted=False)), (1, Scene("steak", steps=1)),
              (2, Scene({"body": {"bound": kerf.bind("closed-sheet")}}, steps=1, measure=first)), (2, Scene({"body": {"bound": body}}, steps=1, measure=second))]
    for i, scene in same:
        assert kerf.sweep.run(scene, plan, tmp_path / str(i), workers=0).new == 0
    for i, scene in others:
        with pytest.raises(kerf.Error, match="holds another sweep, whose (scene|function) is"):
            kerf.sweep.run(scene, plan, tmp_path / str(i), workers=0)


def test_a_scene_goes_through_two_sweeps(tmp_path):
    scene = kerf.sweep.Scene({"body": {"model": "sheet"}}, steps=1)
    for i, (name, value) in enumerate([("material.young", 1e4), ("body.model", "closed-sheet"), ("material.young", 1e4)]):
        assert kerf.sweep.run(scene, Plan({name: [value]}), tmp_path / str(i), workers=0).failed == 0
    first, other, again = (kerf.sweep.read(tmp_path / str(i))["hash"].to_pylist() for i in range(3))
    assert first == again != other


# --- The command line ---


def test_the_command_line(tmp_path, capsys):
    (tmp_path / "judge.py").write_text("def twice(x):\n    return 2 * x\n")
    (tmp_path / "own.py").write_text("import judge\ndef f(parameters, seed):\n    return {'y': judge.twice(parameters['x']) + parameters['z']}\n")
    (tmp_path / "sweep.toml").write_text('title = "Twice"\nfunction = "own.py:f"\nmodules = ["judge.py"]\nseeds = 2\n[grid]\nx = [1, 2]\n'
                                         'z = { from = 1, to = 100, count = 3, spacing = "log" }\n')
    out = tmp_path / "out"
    assert main([str(tmp_path / "sweep.toml"), "--out", str(out), "--workers", "0"]) == 0
    assert "12 of 12 rows, 12 of them now" in capsys.readouterr().out
    assert kerf.sweep.read(out)["y"].to_pylist()[::2] == pytest.approx([3, 12, 102, 5, 14, 104])
    assert json.loads((out / "_sweep.json").read_text())["title"] == "Twice"
    (tmp_path / "scene.toml").write_text('scene = "sheet"\nsteps = 2\n[grid]\n"material.young" = [1e4, -1]\n')
    assert main([str(tmp_path / "scene.toml"), "--out", str(tmp_path / "s"), "--workers", "0"]) == 1
    assert "1 failed" in capsys.readouterr().out


@pytest.mark.parametrize("text, words", [("", "either scene or function"), ("scene = 'sheet'\nsede = 1", "no key 'sede'"), ("function = 'f'", "names no function"),
                                         ("function = 'none.py:f'", "no such file"), ("scene = 'shet'", "did you mean"), ("x = ", "sweep.toml"),
                                         ("scene = 'sheet'\nseeds = 0", "seeds must be 1"), ("scene = 'sheet'\ngrid = 5", "grid must be a table"),
                                         ("scene = 'sheet'\nrandom = 5", "random must be a table"), ("function = 5", "function must be a text"),
                                         ("scene = 'sheet'\nmodules = 'a.py'", "modules must be a list"), ("scene = 'sheet'\n[grid]\na = { from = 1 }", "evenly spaced")])
def test_files_that_are_no_sweep(tmp_path, capsys, text, words):
    (tmp_path / "sweep.toml").write_text(text)
    assert main([str(tmp_path / "sweep.toml"), "--out", str(tmp_path / "out"), "--workers", "0"]) == 2
    assert words in capsys.readouterr().err


def test_no_seeds_are_not_those_of_the_file(tmp_path, capsys):
    (tmp_path / "sweep.toml").write_text("scene = 'sheet'\nsteps = 1\nseeds = 2\n")
    assert main([str(tmp_path / "sweep.toml"), "--out", str(tmp_path / "out"), "--workers", "0", "--seeds", "0"]) == 2
    assert "seeds must be 1" in capsys.readouterr().err


def pieces_of_the_page(language):
    page = (Path(__file__).parents[2] / "docs" / "sweeps.md").read_text()
    return re.findall(rf"```{language}\n(.*?)```", page, re.S)


def test_the_file_of_the_page(tmp_path):
    (text,) = pieces_of_the_page("toml")
    (tmp_path / "sag.toml").write_text("steps = 2\n" + text)
    assert main([str(tmp_path / "sag.toml"), "--out", str(tmp_path / "out"), "--workers", "0", "--seeds", "2"]) == 0
    rows = kerf.sweep.read(tmp_path / "out").to_pylist()
    assert [row["material.young"] for row in rows[::2]] == pytest.approx([1e4, 1e5, 1e6]) and rows[0]["material.density"] == rows[2]["material.density"]


# --- Ray ---


@pytest.fixture(scope="module")
def cluster():
    """A cluster of one machine with two processors, to which others can be added."""
    pytest.importorskip("ray")
    from ray.cluster_utils import Cluster

    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 2, "include_dashboard": False})
    yield cluster
    cluster.shutdown()


@pytest.fixture(scope="module")
def ray(cluster):
    """Ray, to whose cluster this process is connected."""
    import ray

    ray.init(address=cluster.address, log_to_driver=False, logging_level="error")
    yield ray
    ray.shutdown()


def trouble(parameters, seed):
    """What a row does that `do` says; it notes in a file that it was begun."""
    with open(os.path.join(parameters["folder"], f"begun-{seed}"), "a") as file:
        file.write("x")
    if parameters["do"][seed] == "die" or parameters["do"][seed] == "die once" and os.path.getsize(os.path.join(parameters["folder"], f"begun-{seed}")) < 3:
        os.kill(os.getpid(), signal.SIGKILL)
    if parameters["do"][seed] == "hang":
        time.sleep(10_000)
    if parameters["do"][seed] == "raise":
        raise ValueError("bad")
    return {"y": seed}


def test_rows_by_ray_are_those_of_this_process(ray, tmp_path):
    plan = Plan({"material.young": [1e4, 3e4, 1e5, -1]}, random={"command.0.radius": {"uniform": [0.02, 0.2]}}, seeds=3)
    scene = kerf.sweep.Scene(SCENE)
    for name, options in (("alone", {"workers": 0}), ("ray", {})):
        assert kerf.sweep.run(scene, plan, tmp_path / name, **options).failed == 3
    alone, by_ray = (kerf.sweep.read(tmp_path / name).drop_columns(["seconds", "host"]) for name in ("alone", "ray"))
    assert alone.equals(by_ray)
    assert str(os.getpid()) not in "".join(kerf.sweep.read(tmp_path / "ray")["host"].to_pylist())


def test_the_program_of_the_page(ray, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (text,) = pieces_of_the_page("python")
    names = {"__name__": "page"}
    exec(compile(text.replace("step(200)", "step(2)"), "docs/sweeps.md", "exec"), names)
    assert "done=24" in capsys.readouterr().out and names["table"]["error"].null_count == 24 and len(set(names["table"]["hash"].to_pylist())) == 24


def test_bodies_are_bound_once_and_shared(ray, tmp_path):
    body = kerf.bind("steak")

    def lowest(parameters, seed, *, body):
        session = kerf.Session({"body": {"bound": body}, "simulation": {"threads": 1}, "material": {"young": parameters["young"]}})
        session.step(2)
        return {"hash": f"{session.hash:016x}"}

    plan = Plan({"young": [1e4, 2e4, 3e4]})
    kerf.sweep.run(lowest, plan, tmp_path, shared={"body": body})
    assert kerf.sweep.read(tmp_path)["hash"].to_pylist() == [lowest(row.parameters, 0, body=body)["hash"] for row in plan]


def test_rows_that_raise_hang_and_die(ray, tmp_path):
    (tmp_path / "begun").mkdir()
    do = ["", "raise", "", "die", "", "die once", "", "hang", "", ""] + [""] * 20
    plan = Plan({"folder": [str(tmp_path / "begun")], "do": [do]}, seeds=30)
    summary = kerf.sweep.run(trouble, plan, tmp_path / "out", time_limit=3, tries=2)
    rows = kerf.sweep.read(tmp_path / "out").to_pylist()
    assert [row["row"] for row in rows] == list(range(30)) and summary.failed == 3
    assert {row["seed"]: row["error_kind"] for row in rows if row["error"]} == {1: "raised", 3: "died", 7: "time"}
    assert rows[7]["error"] == "took longer than 3 s" and rows[3]["tries"] == 2 and rows[5]["error"] is None and rows[5]["tries"] >= 1
    assert all(row["y"] == row["seed"] for row in rows if not row["error"])


def test_termination_with_a_ray_that_was_there(ray, tmp_path):
    terminated(tmp_path, workers=1, pause=10)


def test_a_module_that_was_edited(ray, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    judge, own = tmp_path / "edited_judge.py", tmp_path / "edited_own.py"
    judge.write_text("def value():\n    return 1\n")
    own.write_text("import edited_judge\ndef f(parameters, seed):\n    return {'y': edited_judge.value()}\n")
    import edited_judge
    import edited_own

    def outcome(folder):
        kerf.sweep.run(edited_own.f, Plan(seeds=4), tmp_path / folder, modules=[edited_judge])
        return set(kerf.sweep.read(tmp_path / folder)["y"].to_pylist())

    assert outcome("first") == {1}
    judge.write_text("def value():\n    return 1 + 1\n")
    importlib.reload(edited_judge)
    assert outcome("second") == {2}
    judge.write_text("def value():\n    return 1 + 1 + 1\nraise ValueError('half made')\n")
    for folder in ("third", "fourth"):
        with pytest.raises(kerf.Error, match="can't begin: ValueError.*half made"):
            outcome(folder)
    judge.write_text("def value():\n    return 1 + 1 + 1\n")
    assert outcome("fourth") == {3}


def test_a_function_that_does_not_travel(ray, tmp_path):
    lock = threading.Lock()
    with pytest.raises(TypeError, match="lock"):
        kerf.sweep.run(lambda parameters, seed: {"y": lock.locked()}, Plan(seeds=3), tmp_path)


def test_two_thousand_rows_take_no_more_memory_than_two_hundred(ray, tmp_path):
    def peak():
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024  # MB

    large = [0.5] * 1000  # 8 kB a row

    def row(parameters, seed):
        return {"y": large}

    kerf.sweep.run(row, Plan(seeds=200), tmp_path / "few")
    before = peak()
    summary = kerf.sweep.run(row, Plan(seeds=2000), tmp_path / "many")
    assert (summary.done, summary.failed) == (2000, 0) and peak() - before < 150
    assert numbers_of(tmp_path / "many") == list(range(2000))


DRIVER = """
import sys, time, kerf.sweep
def row(parameters, seed, pause=0):
    with open(f"{parameters['folder']}/{seed}", "a") as begun:
        begun.write("x")
    time.sleep(pause)
    return {"y": seed}
def run(begun, folder, **options):
    return kerf.sweep.run(row, kerf.sweep.Plan({"folder": [begun]}, seeds=120), folder, **options)
if __name__ == "__main__":
    run(sys.argv[1], sys.argv[2], workers=2, address=sys.argv[3] or None, shared={"pause": 0.05})
"""


def test_a_driver_that_is_killed_goes_on(cluster, tmp_path):
    """SIGTERM comes to one that has made a Ray of its own, the others are on a cluster; this process then does the rest alone."""
    (tmp_path / "begun").mkdir()
    begun, out = str(tmp_path / "begun"), tmp_path / "out"

    def done():
        return len(numbers_of(out)) if (out / "_sweep.json").exists() else 0

    for ending, address in ((signal.SIGTERM, ""), (signal.SIGINT, cluster.address), (signal.SIGKILL, cluster.address)):
        before = done()
        driver = subprocess.Popen([sys.executable, "-c", DRIVER, begun, str(out), address], stderr=subprocess.PIPE)
        wait_for(lambda driver=driver, before=before: done() > before + 5 or driver.poll() is not None)
        driver.send_signal(ending)
        _, told = driver.communicate(timeout=120)
        assert ending == signal.SIGKILL or b"KeyboardInterrupt" in told
        assert driver.returncode != 0 and before + 5 < done() < 120, told
    before, names = done(), {"__name__": "driver"}
    exec(DRIVER, names)
    assert names["run"](begun, out, workers=0).new == 120 - before
    assert sum(len(pq.read_table(part)) for part in out.glob("rows-*.parquet")) == 120
    assert numbers_of(out) == list(range(120)) and kerf.sweep.read(out)["y"].to_pylist() == list(range(120))
    times = [os.path.getsize(tmp_path / "begun" / str(i)) for i in range(120)]
    assert min(times) == 1 and sum(begun > 1 for begun in times) < 30  # only what was on its way was begun again


def test_a_cluster_that_loses_a_machine(cluster, ray, tmp_path):
    begun, out, lost = tmp_path / "begun", tmp_path / "out", []
    begun.mkdir()
    node = cluster.add_node(num_cpus=1)
    cluster.wait_for_nodes()

    def row(parameters, seed):
        node = ray.get_runtime_context().get_node_id()
        open(os.path.join(parameters["folder"], node), "w").close()
        while len(os.listdir(parameters["folder"])) < 2:
            time.sleep(0.02)
        time.sleep(0.05)
        return {"y": seed, "node": node}

    def lose():
        wait_for(lambda: len(os.listdir(begun)) == 2 and len({row["node"] for row in kerf.sweep.read(out).to_pylist()}) == 2 and len(numbers_of(out)) > 10)
        lost.append(len(numbers_of(out)))
        cluster.remove_node(node, allow_graceful=False)

    killer = threading.Thread(target=lose)
    killer.start()
    summary = kerf.sweep.run(row, Plan({"folder": [str(begun)]}, seeds=80), out, tries=3)
    killer.join()
    assert (summary.done, summary.failed) == (80, 0) and lost[0] < 60
    table = kerf.sweep.read(out)
    assert table["y"].to_pylist() == list(range(80)) and len(set(table["node"].to_pylist())) == 2


def wait_for(what, seconds=180):
    end = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < end, "it did not come to that"
        time.sleep(0.05)


# --- Those that ship ---

SWEEPS = Path(__file__).parents[1] / "sweeps"


def test_a_slit_makes_a_strip_more_compliant(tmp_path):
    text = (SWEEPS / "strip_compliance.toml").read_text()
    assert "slit = [0, 0.2, 0.3, 0.4, 0.5, 0.6]" in text
    text = re.sub(r"slit = .*", "slit = [0, 0.5]", re.sub(r"young = .*", "young = [1e5]", text)).replace('"strip_compliance.py', f'"{SWEEPS}/strip_compliance.py')
    (tmp_path / "sweep.toml").write_text(text)
    assert main([str(tmp_path / "sweep.toml"), "--out", str(tmp_path / "out"), "--workers", "0"]) == 0
    whole, slit = kerf.sweep.read(tmp_path / "out").to_pylist()
    assert whole["relative"] == pytest.approx(1, rel=0.01) and whole["pieces"] == slit["pieces"] == 1
    assert slit["relative"] / whole["relative"] - 1 == pytest.approx(slit["closed_form"] - 1, rel=0.15)


def test_a_storm_of_cuts(tmp_path, capsys):
    pytest.importorskip("shapely", minversion="2.1")
    text = (SWEEPS / "cut_storm.toml").read_text()
    text = re.sub(r"body = .*", 'body = ["washer"]', re.sub(r"way = .*", 'way = ["rest", "swing"]', text)).replace('"../tests', f'"{SWEEPS.parent}/tests')
    (tmp_path / "storm.toml").write_text(text.replace('"cut_storm.py', f'"{SWEEPS}/cut_storm.py'))
    assert main([str(tmp_path / "storm.toml"), "--out", str(tmp_path / "out"), "--workers", "0", "--seeds", "2"]) == 0
    rows = kerf.sweep.read(tmp_path / "out").to_pylist()
    assert len(rows) == 4 and not any(row["fails"] for row in rows) and all(row["pieces"] >= 1 for row in rows)
