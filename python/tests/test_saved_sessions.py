"""Sessions that are saved, pickled and copied: judged by those that simply went on."""

import copy
import pickle
import subprocess
import sys

import numpy as np
import pytest

import kerf
from kerf import _program

THROUGH = [[[0.02, -1, 1], [0.02, -1, -1]], [[0.02, 1, 1], [0.02, 1, -1]]]


class Named(kerf.Session):
    """A session of one's own class, that remembers."""

    remembers = 0


def lived(scene, seed, **options):
    """A session with a random life of cuts, holds and steps."""
    random = np.random.default_rng(seed)
    session = kerf.Session(scene, scripted=False, **options)
    size = np.ptp(session.positions, axis=0).max()
    for _ in range(4):
        at = session.positions[random.integers(len(session.positions))]
        kind = random.integers(4)
        if kind == 0:
            across = np.append(random.normal(size=2), 0) * size
            up = np.array([0, 0, size])
            session.cut([[at - across + up, at - across - up], [at + across + up, at + across - up]], frame="world")
        elif kind == 1:
            session.punch(at, 0.05 * size, frame="world")
        elif kind == 2:
            session.fix(sphere={"center": at.tolist(), "radius": 0.1 * size})
        else:
            session.gravity = (0, 0, -9.81)
        session.step(int(random.integers(1, 5)))
    return session


def after(session, steps=10):
    session.step(steps)
    return session.hash


@pytest.mark.parametrize("scene", ["steak", "meniscus", "sheet", "suture-pad"])
@pytest.mark.parametrize("way", [copy.copy, copy.deepcopy, lambda session: pickle.loads(pickle.dumps(session))])
def test_another_one_goes_on_to_the_same_bits(scene, way):
    for seed in range(3):
        session = lived(scene, seed)
        other = way(session)
        assert other is not session and other.hash == session.hash and other.time == session.time and other.notes == session.notes
        assert np.array_equal(other.positions, session.positions) and np.array_equal(other.triangles, session.triangles)
        assert other.undo_depth == 0 and (other.name, other.title) == (session.name, session.title)
        was = session.hash
        other.cut(THROUGH)
        other.step()
        assert session.hash == was  # it has nothing of the other one
        other = way(session)
        assert after(other) == after(session)
        other.validate()


def test_another_process_goes_on_to_the_same_bits():
    code = "import pickle, sys, kerf; s = pickle.load(sys.stdin.buffer); s.step(10); print(s.hash)"
    session = lived("steak", 5)
    done = subprocess.run([sys.executable, "-c", code], input=pickle.dumps(session), capture_output=True, check=True)
    assert int(done.stdout) == after(session)


def test_files_go_on_and_the_program_reads_them(tmp_path):
    session = lived("steak", 6)
    session.save(tmp_path / "a.kerfstate")
    session.save(tmp_path / "b.kerfstate")
    assert (tmp_path / "a.kerfstate").read_bytes() == (tmp_path / "b.kerfstate").read_bytes()
    again = kerf.Session.load(tmp_path / "a.kerfstate")
    assert after(again) == after(session)
    with pytest.raises(kerf.Error, match="nothing of this session was noted"):
        again.recording()
    if not _program.PROGRAM.is_file():
        pytest.skip("built without the program")
    wanted = kerf.Session.load(tmp_path / "a.kerfstate")
    wanted.step(round(0.3 / wanted.time_step) - wanted.steps)
    done = subprocess.run([_program.PROGRAM, "run", "--from", tmp_path / "a.kerfstate", "--duration", "0.3", "--save", tmp_path / "c.kerfstate",
                           "--out", tmp_path / "out", "--quiet"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert kerf.Session.load(tmp_path / "c.kerfstate").hash == wanted.hash


def test_what_a_session_needs_goes_along(tmp_path):
    """A kerf.Body that is in no file, and mesh files that are gone."""
    disc = kerf.bind("closed-sheet", young=7e4)
    disc.save(tmp_path / "b.kerf")
    (tmp_path / "box.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
    session = kerf.Session({"body": [{"bound": disc}, {"bound": "b.kerf", "position": [0, 0, 0.4]}],
                            "obstacle": [{"shape": "mesh", "mesh": "box.obj", "position": [0, 0, -3]}]}, meshes=tmp_path)
    session.step(3)
    data = pickle.dumps(session)
    for file in ("b.kerf", "box.obj"):
        (tmp_path / file).unlink()
    other = pickle.loads(data)
    once_more = copy.copy(other)
    assert other.material == session.material
    assert after(other) == after(once_more) == after(session)


def test_a_session_of_a_body_is_recorded():
    session = kerf.Session(kerf.bind("sheet"), record=True)
    session.cut(THROUGH)
    session.step(20)
    recording = pickle.loads(pickle.dumps(session.recording()))
    assert recording.replay()["same"] and recording.session_at(recording.duration).hash == session.hash


def test_classes_of_ones_own_come_back():
    session = Named("sheet")
    session.remembers = [1]
    for other in (copy.copy(session), pickle.loads(pickle.dumps(session))):
        assert type(other) is Named and other.remembers == [1] and other.hash == session.hash


def test_a_pickled_snapshot_is_for_every_session_of_its_scene():
    session = lived("steak", 7)
    snapshot, then = session.snapshot(), session.hash
    assert copy.copy(snapshot) is snapshot and copy.deepcopy([snapshot])[0] is snapshot
    session.cut(THROUGH)
    session.step(3)
    other = kerf.Session("steak", scripted=False, record=True)
    with pytest.raises(kerf.Error, match="of another session; pickled and unpickled"):
        other.restore(snapshot)
    snapshot = pickle.loads(pickle.dumps(pickle.loads(pickle.dumps(snapshot))))
    for one in (session, other):
        one.restore(snapshot)
        assert one.hash == then and one.undo_depth == 0
    assert after(session) == after(other)
    with pytest.raises(kerf.Error, match="a snapshot that came from elsewhere"):
        other.recording()
    with pytest.raises(kerf.Error, match="of another body"):
        kerf.Session("sheet").restore(snapshot)


def test_open_strokes_are_refused_with_the_way_out(tmp_path):
    session = kerf.Session("sheet")
    with session.stroke():
        snapshot = session.snapshot()
        for work in (copy.copy, pickle.dumps, lambda one: one.save(tmp_path / "a.kerfstate")):
            with pytest.raises(kerf.Error, match="end or cancel it, and save then"):
                work(session)
    with pytest.raises(kerf.Error, match="end or cancel it, and save then"):
        pickle.dumps(snapshot)
    assert not list(tmp_path.iterdir())


def test_files_that_go_nowhere_name_themselves(tmp_path):
    session = kerf.Session("sheet")
    session.save(tmp_path / "good.kerfstate")
    good = (tmp_path / "good.kerfstate").read_bytes()
    wrong = tmp_path / "wrong.kerfstate"
    for data, words in ((b"", "file is empty"), (b"nothing", "no saved state"), (good[:-1], "cut off or damaged"), (good[:99] + bytes([good[99] ^ 1]) + good[100:], "cut off or damaged"),
                        (good[:8] + b"\xff" + good[9:], "version 255")):
        wrong.write_bytes(data)
        with pytest.raises(kerf.Error, match=words) as error:
            kerf.Session.load(wrong)
        assert error.value.file == str(wrong) and str(wrong) in str(error.value)
    with pytest.raises(kerf.Error, match="no such file"):
        kerf.Session.load(tmp_path / "none")
    with pytest.raises(kerf.Error):
        session.save(tmp_path / "no" / "folder")
    with pytest.raises(TypeError):
        session.save(5)


def test_a_file_that_the_scene_reads_is_not_replaced(tmp_path):
    kerf.bind("sheet").save(tmp_path / "b.kerf")
    before = (tmp_path / "b.kerf").read_bytes()
    session = kerf.Session({"body": {"bound": "b.kerf"}}, meshes=tmp_path)
    with pytest.raises(kerf.Error, match="a file that the scene reads"):
        session.save(tmp_path / "b.kerf")
    assert (tmp_path / "b.kerf").read_bytes() == before


def test_damaged_pickles_are_refused():
    session = kerf.Session("sheet")
    make, (kind, data, meshes), _ = session.__reduce_ex__(4)
    for wrong in (b"", data[:-1], data[:1000] + bytes([data[1000] ^ 1]) + data[1001:]):
        with pytest.raises(kerf.Error, match="a pickled session"):
            make(kind, wrong, meshes)
    make, (data,) = session.snapshot().__reduce_ex__(4)
    with pytest.raises(kerf.Error, match="a pickled snapshot"):
        make(data[:-1])
