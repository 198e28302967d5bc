"""Recordings: judged by the program, which records runs and replays what sessions of this package recorded."""

import copy
import json
import os
import pickle
import re
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest

import kerf
from kerf import _program

SCENE = """
title = "A sheet is cut"
body = { model = "sheet" }
simulation = { time_step = 0.01, duration = 2.3 }
output = { meshes = ["visual", "collision"] }
fix = [{ half_space = { point = [0, 0.4, 0], normal = [0, 1, 0] } }]
command = [{ at = 0.5, type = "blade", frame = "rest", poses = [
  { time = 0, base = [0.05, -0.6, 0.3], tip = [0.05, -0.6, -0.3] }, { time = 0.9, base = [0.05, 0.1, 0.3], tip = [0.05, 0.1, -0.3] } ] }]
"""
STEPS = 230


def program(*arguments):
    if not _program.PROGRAM.is_file():
        pytest.skip("built without the program")
    return subprocess.run([_program.PROGRAM, *map(str, arguments)], capture_output=True, text=True)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A recording of the program, and the folder of its results."""
    folder = tmp_path_factory.mktemp("run")
    (folder / "cut.toml").write_text(SCENE)
    done = program("run", folder / "cut.toml", "--out", folder / "out", "--record", folder / "cut.kerfrec", "--quiet")
    assert done.returncode == 0, done.stderr
    return folder


def vertices_of(obj):
    return np.array([line.split()[1:4] for line in obj.read_text().splitlines() if line.startswith("v ")], dtype=float)


def edited(run, tmp_path, edit):
    content = json.loads((run / "cut.kerfrec").read_text())
    edit(content)
    path = tmp_path / "edited.kerfrec"
    path.write_text(json.dumps(content))
    return path


# --- Recordings of the program ---


def test_what_a_recording_tells(run):
    recording = kerf.Recording.load(run / "cut.kerfrec")
    assert recording.file == str(run / "cut.kerfrec") and recording.name == "cut" and recording.scene == SCENE
    assert recording.title == "A sheet is cut" and recording.time_step == 0.01
    assert recording.steps == STEPS and recording.duration == pytest.approx(2.3) and recording.changes == []
    assert recording.instructions == json.loads((run / "cut.kerfrec").read_text())["instructions"]
    assert "cut" in repr(recording) and "230" in repr(recording)


def test_the_same_bits_as_the_program(run):
    said = program("replay", run / "cut.kerfrec")
    assert said.returncode == 0
    numbers = re.search(r"(\d+) steps, (\d+) changes, (\d+) hashes: the same bits", said.stdout)
    recording = kerf.Recording.load(run / "cut.kerfrec")
    report = recording.replay()
    assert report["same"] and report["first_difference"] is None and report["over"] and report["score"] is None
    assert [report["steps"], len(recording.changes), report["hashes"]] == [int(number) for number in numbers.groups()]
    session = recording.session_at(recording.duration)
    for array, file in ((session.positions, "visual.obj"), (session.collision_positions, "collision.obj")):
        assert np.array_equal(vertices_of(run / "out" / file), array)
    assert session.topology_version > 0


def test_stops_on_the_way(run):
    recording = kerf.Recording.load(run / "cut.kerfrec")
    alone = kerf.Session(SCENE)
    times, playback = [], recording.play(every=0.5)
    for session in playback:
        alone.step(session.steps - alone.steps)
        assert session is playback.session and session.hash == alone.hash
        assert playback.report["same"] and playback.report["steps"] == session.steps
        times.append(session.time)
    assert times == pytest.approx([0, 0.5, 1, 1.5, 2, 2.3]) and playback.report["over"]
    assert next(playback, None) is None
    assert recording.session_at(1.004).steps == 100
    assert len(list(recording.play())) == STEPS + 1
    assert len(list(recording.play(every=1e9))) == len(list(recording.play(every=1.7e308))) == 2
    assert [session.steps for session in recording.play(every=0.015)][:5] == [0, 2, 3, 4, 6]


@pytest.mark.parametrize("every, error", [(0, ValueError), (-1, ValueError), (np.nan, ValueError), (np.inf, ValueError), ("1", TypeError)])
def test_stops_that_are_none(run, every, error):
    with pytest.raises(error, match="every"):
        kerf.Recording.load(run / "cut.kerfrec").play(every)


@pytest.mark.parametrize("time, error", [(-0.01, ValueError), (2.4, ValueError), (np.nan, ValueError), (None, TypeError)])
def test_times_that_are_none(run, time, error):
    with pytest.raises(error, match="time"):
        kerf.Recording.load(run / "cut.kerfrec").session_at(time)


def test_one_number_that_was_edited(run, tmp_path):
    def another_hash(content):
        step, word = content["hashes"][1]
        content["hashes"][1] = [step, f"{int(word, 16) ^ 1:016x}"]

    for edit, step in ((another_hash, 100), (lambda content: content["changes"].append([140, "gravity", 0, 0, -9.82]), 200)):
        path = edited(run, tmp_path, edit)
        said = program("replay", path)
        assert said.returncode == 1 and f"at step {step} of {STEPS}" in said.stderr
        recording = kerf.Recording.load(path)
        report = recording.replay()
        assert not report["same"] and report["first_difference"] == step
        difference = recording.compare(kerf.Recording.load(run / "cut.kerfrec"))
        assert not difference["same"] and difference["settings"] == [] and difference["same_end"]
        assert difference["first_change"] == (140 if recording.changes else None)
        assert difference["first_difference"] == (None if recording.changes else 100)
    assert recording.compare(recording)["same"]


def test_whoever_cuts_on_the_way_is_told(run):
    playback = kerf.Recording.load(run / "cut.kerfrec").play(every=0.5)
    next(playback).gravity = (0, 0, -1)
    for _ in playback:
        pass
    assert playback.report["first_difference"] == 100


def test_a_session_closed_on_the_way(run):
    playback = kerf.Recording.load(run / "cut.kerfrec").play(every=0.5)
    next(playback).close()
    with pytest.raises(kerf.Error, match="closed"):
        next(playback)


def test_files_that_are_none(run, tmp_path):
    whole = (run / "cut.kerfrec").read_text()
    path = tmp_path / "bad.kerfrec"
    for text in ("", "no recording", whole[:-5], whole.replace('"hashes"', '"hushes"'), whole.replace('recording":1', 'recording":7'), "{}", "[" * 9999):
        path.write_text(text)
        with pytest.raises(kerf.Error, match=re.escape(str(path))) as caught:
            kerf.Recording.load(path)
        assert caught.value.file == str(path) and caught.value.kind == "bad input"
    for path in (tmp_path / "none.kerfrec", tmp_path):
        with pytest.raises(kerf.Error, match=re.escape(str(path))) as caught:
            kerf.Recording.load(path)
        assert caught.value.file == str(path)
    with pytest.raises(TypeError):
        kerf.Recording.load(5)


def test_a_scene_that_is_wrong_is_named_with_its_line(run, tmp_path):
    def edit(content):
        content["scene"]["text"] = content["scene"]["text"].replace("duration", "durasion")

    path = edited(run, tmp_path, edit)
    recording = kerf.Recording.load(path)
    for wrong in (recording.replay, recording.play, lambda: recording.title, lambda: recording.session_at(0)):
        with pytest.raises(kerf.Error, match="edited.kerfrec") as caught:
            wrong()
        assert caught.value.line == 4


def test_meshes_that_did_not_travel(run, tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    kerf.bind("sheet").save(tmp_path / "a" / "own.kerf")
    (tmp_path / "a" / "own.toml").write_text('body.bound = "own.kerf"\nsimulation.duration = 0.05\n')
    path = tmp_path / "own.kerfrec"
    assert program("run", tmp_path / "a" / "own.toml", "--out", tmp_path / "out", "--record", path, "--quiet").returncode == 0
    content = json.loads(path.read_text())
    del content["scene"]["meshes"][0]["base64"]
    path.write_text(json.dumps(content))
    (tmp_path / "a" / "own.kerf").rename(tmp_path / "b" / "own.kerf")
    with pytest.raises(kerf.Error, match="own.kerf"):
        kerf.Recording.load(path).replay()
    assert kerf.Recording.load(path, meshes=tmp_path / "b").replay()["same"]
    kerf.bind("closed-sheet").save(tmp_path / "b" / "own.kerf")
    with pytest.raises(kerf.Error, match="not the one that was recorded"):
        kerf.Recording.load(path, meshes=[tmp_path / "b"]).replay()


def test_ctrl_c_ends_a_replay(run, tmp_path):
    path = edited(run, tmp_path, lambda content: content.update(last_step=10**8))
    signal.signal(signal.SIGALRM, signal.default_int_handler)
    signal.setitimer(signal.ITIMER_REAL, 0.5)
    try:
        with pytest.raises(KeyboardInterrupt):
            kerf.Recording.load(path).replay()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, signal.SIG_DFL)


def test_a_report_while_another_thread_plays(run, tmp_path):
    playback = kerf.Recording.load(edited(run, tmp_path, lambda content: content.update(last_step=2000))).play(every=20)
    next(playback)
    thread = threading.Thread(target=next, args=(playback,))
    thread.start()
    told = set()
    while thread.is_alive():
        told.add(playback.report["steps"])
    thread.join()
    assert told <= {0, 2000} and playback.report["steps"] == 2000 and playback.report["over"]


def test_saved_again(run, tmp_path):
    recording = kerf.Recording.load(run / "cut.kerfrec")
    recording.save(tmp_path / "again.kerfrec")
    assert json.loads((tmp_path / "again.kerfrec").read_text()) == json.loads((run / "cut.kerfrec").read_text())
    assert os.listdir(tmp_path) == ["again.kerfrec"]
    with pytest.raises(kerf.Error, match="none"):
        recording.save(tmp_path / "none" / "x.kerfrec")
    for made in (kerf.Recording, lambda: kerf.Playback(5, 1.0), lambda: recording.compare(5)):
        with pytest.raises(TypeError, match="(?i)recording"):
            made()


def test_pickled(run):
    recording = kerf.Recording.load(run / "cut.kerfrec")
    again = pickle.loads(pickle.dumps(recording))
    assert again.compare(recording)["same"] and again.file == recording.file and again.scene == recording.scene
    assert again.session_at(1.0).hash == recording.session_at(1.0).hash
    assert copy.copy(recording) is recording and copy.deepcopy(recording) is recording
    make, (text, _, meshes) = recording.__reduce_ex__(4)
    with pytest.raises(kerf.Error, match="a pickled recording"):
        make(text[:-9], "", meshes)


def test_a_session_goes_on_in_another_process():
    session = kerf.Session("sheet", record=True)
    session.cut([[[0, -0.6, 0.3], [0, -0.6, -0.3]], [[0, 0.1, 0.3], [0, 0.1, -0.3]]])
    session.step(150)
    code = "import pickle, sys; r = pickle.load(sys.stdin.buffer); print(r.session_at(r.duration).hash)"
    done = subprocess.run([sys.executable, "-c", code], input=pickle.dumps(session.recording()), capture_output=True, check=True)
    assert int(done.stdout) == session.hash


# --- Sessions that record ---

HELD = {"half_space": {"point": [0, 0.06, 0], "normal": [0, 1, 0]}}


def replayed(session, tmp_path):
    """The program's verdict of all that was done to a session, and the package's; the recording."""
    path = tmp_path / "session.kerfrec"
    session.recording().save(path)
    said = program("replay", path)
    assert said.returncode == 0, said.stderr
    recording = kerf.Recording.load(path)
    report = recording.replay()
    assert report["same"] and report["refused"] is None
    end = recording.session_at(recording.duration)
    assert end.hash == session.hash and np.array_equal(end.positions, session.positions)
    return recording


def test_everything_by_hand(tmp_path):
    session = kerf.Session({"body": {"model": "steak"}, "fix": [HELD]}, record=True)
    alone = kerf.Session({"body": {"model": "steak"}, "fix": [HELD]})
    for s in (session, alone):
        with s.stroke(frame="rest") as blade:
            blade.move([0, -0.10, 0.05], [0, -0.10, -0.05])
            s.step(5)
            blade.move([0, 0.02, 0.05], [0, 0.02, -0.05])
        with s.stroke(frame="world") as blade:
            blade.move([0.05, -0.10, 0.05], [0.05, -0.10, -0.05])
            blade.move([0.05, 0.02, 0.05], [0.05, 0.02, -0.05])
            blade.cancel()
        s.step(20)
        assert s.punch([-0.05, 0, 0], 0.012, frame="rest")
        s.punch([-0.02, 0, 0], 0.008, shape="d", frame="world", roughness=0.001, reach=0.1, take=True)
        s.grasp("hand", [0.02, -0.06, 0], radius=0.01)
        s.move("hand", by=[0, -0.02, 0.03], over=0.2)
        s.step(30)
        s.move("hand", to=[0.02, -0.07, 0.02])
        s.cut([[[0.06, -0.1, 0.05], [0.06, -0.1, -0.05]], [[0.06, 0.1, 0.05], [0.06, 0.1, -0.05]]])
        s.fix(sphere={"center": [0.02, 0, 0], "radius": 0.01})
        s.step(15)
        s.undo()
        s.redo()
        s.unfix(sphere={"center": [0.02, 0, 0], "radius": 0.01})
        s.set_material(young=2 * s.material["young"])
        s.gravity = (0, 1, -9)
        s.step(20)
        s.release("hand")
        s.step(20)
        s.remove(sphere={"center": [-0.05, 0, 0], "radius": 0.2}, frame="world")
        s.step(10)
    assert session.hash == alone.hash  # who notes does not disturb
    recording = replayed(session, tmp_path)
    kinds = {change["kind"] for change in recording.changes}
    assert kinds >= {"begin_stroke", "blade", "end_stroke", "cancel_stroke", "undo", "redo", "grasp", "move", "release", "fix", "unfix", "gravity",
                     "material", "punch", "suck"}
    grasp = next(change for change in recording.changes if change["kind"] == "grasp")
    assert grasp["id"] == "hand" and grasp["step"] == 25 and len(grasp["elements"]) >= 1


def test_a_piece_that_a_grasp_takes_away(tmp_path):
    session = kerf.Session({"body": {"model": "steak"}, "fix": [HELD]}, record=True)
    session.punch([-0.05, 0, 0], 0.012, frame="rest")
    session.grasp("hand", [-0.05, 0, 0])
    session.step(3)
    assert session.remove("hand") == 1
    session.step(3)
    assert [change["kind"] for change in replayed(session, tmp_path).changes] == ["punch", "grasp", "remove"]


def test_tools_and_a_scene_that_acts_itself(tmp_path):
    scene = "meniscus-probe"
    session = kerf.Session(scene, record=True)
    tool = session.tool_ids[0]
    session.step(20)
    place = session.tools["position"][0]
    session.move_tool(tool, place + [0, 0, 0.002])
    session.step(10)
    session.move_tool(tool, place, [0.1, 0, 0], over=0.05)
    session.step(90)
    assert [change["kind"] for change in replayed(session, tmp_path).changes] == ["tool", "tool"]


def test_batches_are_noted(tmp_path):
    sessions = [kerf.Session({"body": {"model": "sheet"}, "fix": [{"half_space": {"point": [0, 0.4, 0], "normal": [0, 1, 0]}}]}, record=True)
                for _ in range(2)]
    batch = kerf.Batch(sessions, threads=2)
    for i in range(2):
        batch.place_blade(i, [0.1 * i, -0.6, 0.3], [0.1 * i, -0.6, -0.3])
        sessions[i].grasp("hand", [0.3, -0.4, 0])
    ends = np.array([[[0.1 * i, 0, 0.3], [0.1 * i, 0, -0.3]] for i in range(2)])
    assert batch.turn(10, blade=ends, grasps={"hand": np.array([[0.3, -0.4, 0.1]] * 2)}) == {}
    assert batch.turn(5) == {}
    for session in sessions:
        assert session.counts["visual_vertices"] > kerf.Session("sheet").counts["visual_vertices"]
        replayed(session, tmp_path)


def test_what_was_restored_is_forgotten(tmp_path):
    session = kerf.Session("sheet", record=True)
    session.step(2)
    with session.stroke() as blade:
        blade.move([0, -0.6, 0.3], [0, -0.6, -0.3])
        within = session.snapshot()
        blade.move([0, 0.1, 0.3], [0, 0.1, -0.3])
    session.step(150)
    later = session.snapshot()
    session.restore(within)
    session.step(3)
    session.punch([0.2, 0, 0], 0.05, frame="rest")
    assert [change["kind"] for change in replayed(session, tmp_path).changes] == ["begin_stroke", "blade", "end_stroke", "punch"]
    session.restore(later)
    session.step(3)
    assert [change["kind"] for change in replayed(session, tmp_path).changes] == ["begin_stroke", "blade", "blade", "end_stroke"]


def test_calls_that_fail_are_no_trouble(tmp_path):
    session = kerf.Session("sheet", record=True)
    for wrong in (session.undo, lambda: session.release("none"), lambda: session.set_material(young=-1), lambda: session.set_material(density=0), lambda: session.punch([0, 0, 0], 0.05, axis=[0, 0, 0]),
                  lambda: session.shave([[[0, 0, 0], [0, 0, 0.1]]] * 2, [0, 1], -1), lambda: session.grasp("a", [0, 0, 0], stiffness=-1)):
        with pytest.raises(kerf.Error):
            wrong()
    session.step(2)
    session.recording().save(tmp_path / "a.kerfrec")
    assert program("replay", tmp_path / "a.kerfrec").returncode == 0
    assert kerf.Recording.load(tmp_path / "a.kerfrec").replay()["same"]


def test_a_cut_that_ctrl_c_ends(tmp_path):
    session = kerf.Session("steak", record=True)
    y = np.linspace(-0.1, 0.12, 200000)
    poses = np.stack([np.stack([0.03 * np.sin(400 * y), y, np.full_like(y, z)], axis=1) for z in (0.05, -0.05)], axis=1)
    signal.signal(signal.SIGALRM, signal.default_int_handler)
    signal.setitimer(signal.ITIMER_REAL, 0.3)
    try:
        with pytest.raises(KeyboardInterrupt):
            session.cut(poses)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
    session.step(2)
    assert replayed(session, tmp_path).changes[-1]["kind"] == "cancel_stroke"


def test_nothing_was_done():
    recording = kerf.Session("sheet", record=True).recording()
    assert recording.replay()["same"] and recording.duration == 0 and [s.steps for s in recording.play(every=1)] == [0]


def test_what_recordings_have_no_change_for():
    poses = [{"time": t, "base": [0, y, 0.3], "tip": [0, y, -0.3]} for t, y in ((0, -0.6), (0.5, 0.1))]
    for do in (lambda s: s.apply({"type": "blade", "frame": "rest", "poses": poses}), lambda s: s.grasp("a", [0, 0, 0], stiffness=100.0),
               lambda s: s.remove(sphere={"center": [9, 9, 9], "radius": 0.1}, frame="rest")):
        session = kerf.Session("sheet", record=True)
        session.step(1)
        before = session.snapshot()
        do(session)
        with pytest.raises(kerf.Error, match="can't be recorded"):
            session.recording()
        session.restore(before)
        assert session.recording().steps == 1
    with pytest.raises(kerf.Error, match="record=True"):
        kerf.Session("sheet").recording()


def test_files_of_a_scene_travel(tmp_path):
    kerf.bind("sheet").save(tmp_path / "own.kerf")
    session = kerf.Session({"body": {"bound": str(tmp_path / "own.kerf")}}, record=True)
    session.step(4)
    recording = session.recording()
    assert recording.file is None and recording.replay()["same"]
    (tmp_path / "own.kerf").unlink()
    assert recording.replay()["same"]
