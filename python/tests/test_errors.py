"""What is wrong is an exception that says so, never a crash."""

import array
import copy
import ctypes
import os
import pickle

import numpy as np
import pytest

import kerf

ACROSS = np.array([[[0, -0.10, 0.05], [0, -0.10, -0.05]], [[0, 0.12, 0.05], [0, 0.12, -0.05]]])


@pytest.fixture
def sheet():
    return kerf.Session({"body": {"model": "sheet"}})


def test_where_a_scene_is_wrong(tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text('[body]\nmodel = "steak"\n[simulation]\ntime_stap = 0.1\n')
    with pytest.raises(kerf.Error, match="time_step") as caught:
        kerf.Session(path)
    assert caught.value.file == str(path)
    assert caught.value.line == 4
    assert caught.value.kind == "bad input"


@pytest.mark.parametrize("scene", ["steek", "no/such/file.toml", "/", "x = \n", "", "body.model = 'none'", {}, {"body": {"model": "steak", "scale": np.nan}},
                                   {"simulation": {"duration": float("inf")}, "body": {"model": "steak"}}, "s" * 100000])
def test_scenes_that_are_none(scene):
    with pytest.raises(kerf.Error):
        kerf.Session(scene)


def test_folders_of_meshes_that_are_none(tmp_path):
    (tmp_path / "file").touch()
    for name, words in (("none", "there is no such folder"), ("file", "is no folder")):
        for meshes in (tmp_path / name, [tmp_path, str(tmp_path / name)]):
            with pytest.raises(kerf.Error, match=f"{name}: {words}"):
                kerf.Session("sheet", meshes=meshes)
    kerf.Session("sheet", meshes=tmp_path)


@pytest.mark.parametrize("scene", [5, None, b"steak", ["steak"], {1: 2}, {"body": {"model": object()}}])
def test_scenes_of_the_wrong_type(scene):
    with pytest.raises(TypeError):
        kerf.Session(scene)


def test_a_scene_in_itself():
    scene = {"body": {"model": "steak"}}
    scene["body"]["body"] = scene["body"]
    with pytest.raises(ValueError):
        kerf.Session(scene)


@pytest.mark.parametrize("poses", [ACROSS[0], ACROSS[:1], ACROSS[:0], ACROSS.reshape(2, 3, 2), np.full((2, 2, 3), np.nan),
                                   np.full((2, 2, 3), np.inf), [[[0, 0, 0], [1, 1]]], [], 5.0])
def test_paths_of_the_wrong_shape(sheet, poses):
    before = sheet.hash
    with pytest.raises(ValueError):
        sheet.cut(poses)
    assert sheet.hash == before and not sheet.in_stroke


def test_a_path_that_goes_wrong_half_way_leaves_no_trace(sheet):
    before = sheet.hash
    with pytest.raises(kerf.Error, match="edge"):
        sheet.cut(np.concatenate([ACROSS, np.zeros((1, 2, 3))]))
    assert sheet.hash == before and not sheet.in_stroke and sheet.undo_depth == 0


@pytest.mark.parametrize("poses", ["across", None, [["a"]], ACROSS.astype(complex), ACROSS.astype(object), {}])
def test_paths_of_the_wrong_type(sheet, poses):
    with pytest.raises(TypeError):
        sheet.cut(poses)


def test_paths_of_other_layouts(sheet):
    other = kerf.Session({"body": {"model": "sheet"}})
    sheet.cut(ACROSS)
    other.cut(np.asfortranarray(ACROSS))
    assert sheet.hash == other.hash
    third = kerf.Session({"body": {"model": "sheet"}})
    third.cut(np.repeat(ACROSS, 2, axis=0)[::2])
    assert sheet.hash == third.hash


@pytest.mark.parametrize("point, error", [((0, 0), ValueError), ((0, 0, 0, 0), ValueError), ((0, 0, np.nan), ValueError), ((0, 10**400, 0), TypeError),
                                          ("abc", TypeError), (None, TypeError), (5, ValueError), ((0, 0, "1"), TypeError), ((0, 0, 1j), TypeError),
                                          (np.zeros((3, 1)), ValueError), (np.zeros(3, bool), TypeError), (np.full(3, np.inf, np.float32), ValueError)])
def test_points_that_are_none(sheet, point, error):
    with sheet.stroke() as blade:
        with pytest.raises(error):
            blade.move(point, (0, 0, 1))
        with pytest.raises(error):
            blade.move((0, 0, 1), point)


@pytest.mark.parametrize("point", [(0, 0, 1), [0.0, 0, 1], np.array([0, 0, 1]), np.array([0, 0, 1], np.float32), np.arange(6.0)[::2],
                                   (np.float64(0), 0, np.int8(1))])
def test_points_in_every_form(sheet, point):
    with sheet.stroke() as blade:
        blade.move(point, (0, 0, -1))


def test_frames(sheet):
    with pytest.raises(ValueError, match="rest"):
        sheet.stroke(frame="body")
    with pytest.raises(ValueError):
        sheet.cut(ACROSS, frame="")
    for call in (lambda: sheet.stroke(frame=3), lambda: sheet.stroke(frame=None), lambda: sheet.cut(ACROSS, frame=b"rest")):
        with pytest.raises(TypeError, match='frame must be "rest" or "world"'):
            call()


def test_truth_values(sheet):
    sheet.stroke(through=np.bool_(True))
    for call in (lambda: sheet.stroke(through=1), lambda: sheet.stroke(through=None), lambda: sheet.cut(ACROSS, through="no")):
        with pytest.raises(TypeError, match="through must be True or False"):
            call()


def test_what_is_no_snapshot(sheet):
    for wrong in (None, 5, sheet):
        with pytest.raises(TypeError, match=r"snapshot\(\)"):
            sheet.restore(wrong)


def test_a_punch_that_reaches_nowhere(sheet):
    for wrong in ({"reach": 1e-300}, {"radius": 1e-300}):
        with pytest.raises(kerf.Error, match="too") as caught:
            sheet.punch([0.1, 0.1, 0], **{"radius": 0.1, **wrong})
        assert "nan" not in str(caught.value)
    assert sheet.undo_depth == 0


@pytest.mark.parametrize("n, error", [(-1, ValueError), (1.5, TypeError), ("2", TypeError), (2**70, ValueError), (None, TypeError)])
def test_numbers_of_steps(sheet, n, error):
    with pytest.raises(error, match="^n must "):
        sheet.step(n)


@pytest.mark.parametrize("n", [0, np.int64(2), np.uint8(2)])
def test_numbers_of_steps_in_every_form(sheet, n):
    sheet.step(n)
    assert sheet.steps == n


def test_files_that_are_not_utf8(tmp_path):
    path = tmp_path / os.fsdecode(b"\xff.toml")
    path.write_text("body.model = 'sheet'")
    for scene in (path, str(path), "title = '\udcff'\nbody.model = 'sheet'"):
        with pytest.raises(kerf.Error, match="UTF-8"):
            kerf.Session(scene)
    with pytest.raises(kerf.Error, match="UTF-8"):
        kerf.Session("sheet", meshes=[path])


def test_strokes_are_not_copied(sheet):
    for work in (copy.copy, copy.deepcopy, pickle.dumps):
        with pytest.raises(TypeError, match="can't be copied or pickled; "):
            work(sheet.stroke())


@pytest.mark.parametrize(("kind", "whence"), [(kerf.Body, r"kerf.bind\(\)"), (kerf.Stroke, r"stroke\(\)"), (kerf.Snapshot, r"snapshot\(\)")])
def test_what_comes_from_elsewhere_says_whence(kind, whence):
    for arguments in ((), (1, "a")):
        with pytest.raises(TypeError, match=f"comes from .*{whence}"):
            kind(*arguments)


def test_arguments_that_name_themselves(sheet):
    array = np.zeros(2)
    for wrong, words in ((lambda: kerf.Session("sheet", meshes=5), "meshes must be a folder"), (lambda: kerf.Session("sheet", record=array), "record must"),
                         (lambda: kerf.bind("sheet", exact_paths=1), "exact_paths must be True or False"), (lambda: sheet.render(depth="no"), "depth must"),
                         (lambda: sheet.set_material(young=array), "young must be one number"), (lambda: kerf.Batch(5), "list of sessions, not of int"),
                         (lambda: kerf.Camera((0, 0, 1), (0, 0, 0), (0, 1, 0), array), "field_of_view must be one number"),
                         (lambda: kerf.Batch([sheet]).place_blade("a", (0, 0, 0), (0, 0, 1)), "session must be a whole number")):
        with pytest.raises(TypeError, match=words):
            wrong()


@pytest.mark.parametrize("kind", ["now", 5])
def test_dates_are_no_points(sheet, kind):
    date = np.datetime64(kind) if kind == "now" else np.timedelta64(kind)
    for wrong in (date, np.array([date] * 3)):
        with sheet.stroke() as blade, pytest.raises(TypeError, match="tip must be three numbers"):
            blade.move((0, 0, 1), wrong)


def test_points_of_other_packages(sheet):
    """What has a buffer, and what has none."""
    with sheet.stroke() as blade:
        for point in ((ctypes.c_double * 3)(0, 0, -1), array.array("d", [0, 0, -1]), memoryview(np.array([0, 0, -1.0])), np.array([0, 0, -1], np.float16)):
            blade.move((0, 0, 1), point)
    sheet.gravity = (ctypes.c_float * 3)(0, 1, 2)
    assert sheet.gravity == (0, 1, 2)


@pytest.mark.parametrize("length", [2.0**996, 2.0**-996])
def test_a_direction_of_any_length(length):
    def loosened(axis):
        session = kerf.Session({"body": {"model": "sheet"}})
        return session.punch([0, 0, 0], 0.1, axis=axis), session.counts["pieces"], session.hash

    assert loosened([0, 0, length]) == loosened([0, 0, 1])
    assert loosened([0, 0, 1])[:2] == (True, 2)


def test_errors_are_pickled():
    with pytest.raises(kerf.Error) as caught:
        kerf.Session("body.model = 'none'")
    again = pickle.loads(pickle.dumps(caught.value))
    assert (str(again), again.kind, again.line) == (str(caught.value), "bad input", 1)


def test_nothing_to_undo(sheet):
    with pytest.raises(kerf.Error):
        sheet.undo()


def test_one_stroke_at_a_time(sheet):
    with sheet.stroke() as blade:
        blade.move(*ACROSS[0])
        with pytest.raises(kerf.Error, match="open"):
            sheet.stroke().__enter__()
        with pytest.raises(kerf.Error, match="open"):
            sheet.cut(ACROSS)
        blade.end()
        with pytest.raises(kerf.Error, match="over"):
            blade.move(*ACROSS[1])
    with pytest.raises(kerf.Error), blade:
        pass


def test_a_stroke_that_has_not_begun(sheet):
    with pytest.raises(kerf.Error):
        sheet.stroke().move(*ACROSS[0])


def test_a_stroke_that_a_scene_ends():
    poses = [{"time": 0, "base": [0.05, -1, 1], "tip": [0.05, -1, -1]}, {"time": 0.5, "base": [0.05, -0.9, 1], "tip": [0.05, -0.9, -1]}]
    session = kerf.Session({"body": {"model": "steak"}, "command": [{"at": 0.01, "type": "blade", "poses": poses}]})
    with session.stroke() as blade:
        blade.move(*ACROSS[0])
        session.step(20)
        assert session.in_stroke and not blade.is_open
        with pytest.raises(kerf.Error, match="over"):
            blade.move(*ACROSS[1])


def test_a_stroke_that_was_cancelled_does_not_move_the_next():
    poses = [{"time": 0, "base": [0.05, -1, 1], "tip": [0.05, -1, -1]}, {"time": 0.5, "base": [0.05, -0.9, 1], "tip": [0.05, -0.9, -1]}]
    session = kerf.Session({"body": {"model": "steak"}, "command": [{"at": 0.01, "type": "blade", "poses": poses}]})
    with session.stroke() as blade:
        blade.cancel()
        session.step(20)
        assert session.in_stroke and not blade.is_open
        with pytest.raises(kerf.Error, match="over"):
            blade.move(*ACROSS[0])


def test_a_stroke_that_undo_ends(sheet):
    with sheet.stroke() as blade:
        blade.move(*ACROSS[0])
        blade.move(*ACROSS[1])
        sheet.undo()
        assert not blade.is_open
        with pytest.raises(kerf.Error, match="over"):
            blade.move(*ACROSS[1])
    assert sheet.counts["pieces"] == 1


def test_a_stroke_left_open(sheet):
    blade = sheet.stroke()
    blade.__enter__()
    blade.move(*ACROSS[0])
    with pytest.raises(kerf.Error, match="open"):
        sheet.cut(ACROSS)
    sheet.step(2)
    del blade  # nobody could end it any more
    assert not sheet.in_stroke
    assert sheet.cut(ACROSS)
    del sheet


def test_a_lost_stroke_keeps_what_it_cut(sheet):
    blade = sheet.stroke().__enter__()
    for edge in ACROSS:
        blade.move(*edge)
    before = sheet.counts["visual_triangles"]
    del blade
    assert sheet.undo_depth == 1
    sheet.undo()
    assert sheet.counts["visual_triangles"] < before


def test_a_closed_session(sheet):
    with pytest.raises(RuntimeError, match="mine"), sheet.stroke() as blade:
        sheet.close()
        sheet.close()
        for name in ("time", "hash", "counts", "positions", "triangles", "notes", "in_stroke", "last_step"):
            with pytest.raises(kerf.Error, match="closed"):
                getattr(sheet, name)
        for call in (sheet.step, sheet.undo, sheet.redo, sheet.validate, sheet.snapshot, sheet.report, blade.end, blade.cancel,
                     lambda: sheet.cut(ACROSS), lambda: blade.move((0, 0, 1), (0, 0, 2))):
            with pytest.raises(kerf.Error, match="closed"):
                call()
        assert sheet.closed and not blade.is_open and "closed" in repr(sheet)
        raise RuntimeError("mine")


def test_a_session_closed_within_a_stroke(sheet):
    with pytest.raises(kerf.Error, match="closed"), sheet.stroke():
        sheet.close()


def test_a_session_is_closed_by_with():
    with kerf.Session({"body": {"model": "sheet"}}) as session:
        assert not session.closed
    assert session.closed


def test_a_session_that_was_never_made():
    class Mine(kerf.Session):
        def __init__(self):
            pass

    with pytest.warns(RuntimeWarning), pytest.raises(TypeError):
        Mine().step()
    with pytest.raises(TypeError, match="not made"):
        Mine().stroke()
    for other in (5, None):
        with pytest.raises(TypeError):
            kerf.Session.stroke(other)
        with pytest.raises(TypeError):
            kerf.Stroke.__enter__(other)
    with pytest.raises(TypeError):
        kerf.Stroke()


def test_a_session_that_is_made_twice(sheet):
    array = sheet.positions
    with pytest.raises(TypeError, match="this session is made already"):
        sheet.__init__("sheet")
    assert np.isfinite(array).all()
    sheet.step()


@pytest.mark.parametrize("far", [2e6, 1e160, 1e300])
def test_places_that_are_too_far_away(sheet, far):
    for call in (lambda: sheet.to_world([[0, far, 0]]), lambda: sheet.to_rest([[far, 0, 0]]),
                 lambda: sheet.cut([[[0, -far, 1], [0, -far, -1]], [[0, far, 1], [0, far, -1]]])):
        with pytest.raises(ValueError, match=r"metres, 1e\+06 at most"):
            call()
    assert np.isfinite(sheet.to_world([[1e6, 0, 0]])).all()


def test_a_blade_that_goes_too_far_away(sheet):
    batch = kerf.Batch([sheet])
    with sheet.stroke() as blade:
        blade.move([0, -1, 1], [0, -1, -1])
        for wrong in ([0, 2e6, 1], [-1e300, 0, 0]):
            with pytest.raises(ValueError, match="tip must be metres"):
                blade.move([0, 0, 1], wrong)
    with pytest.raises(ValueError, match="base must be metres"):
        batch.place_blade(0, [0, 0, 1e7], [0, 0, 0])


def test_texts_of_commands_that_are_not_unicode(sheet):
    for call in (lambda: sheet.release("\ud800"), lambda: sheet.grasp("h", ["\ud800", 0, 0]), lambda: sheet.apply("type = '\ud800'")):
        with pytest.raises(kerf.Error, match="UTF-8"):
            call()


def test_a_viewer_of_nothing():
    with pytest.raises(TypeError, match=r"kerf.view\(session\)"):
        kerf.Viewer(5)


def move(session, base, tip):
    with session.stroke() as blade:
        blade.move(base, tip)


MASKED = np.ma.masked_array(ACROSS, mask=np.ones((2, 2, 3), bool))


@pytest.mark.parametrize("use", [
    lambda s: s.cut(MASKED), lambda s: move(s, MASKED[0, 0], (0, 0, 0)), lambda s: setattr(s, "gravity", MASKED[0, 0]), lambda s: s.to_world(MASKED[0]), lambda s: kerf.Camera(MASKED[0, 0], (0, 0, 0)),
    lambda s: kerf.Batch([s]).turn(blade=MASKED[:1]), lambda s: kerf.bind(np.ma.masked_array(np.eye(3)), [[0, 1, 2]])])
def test_masked_arrays_are_refused(use):
    """A mask would be left out, and what it hides be cut."""
    session = kerf.Session("sheet")
    with pytest.raises(TypeError, match="masked array"):
        use(session)


def test_a_name_that_is_none_is_not_set():
    session = kerf.Session("sheet")
    with pytest.raises(AttributeError, match="gravty"):
        session.gravty = (0, 0, 0)


@pytest.mark.parametrize(("call", "kind", "words"), [
    (lambda s: s.punch(np.ma.masked_array(np.zeros(3), mask=True), 0.01), TypeError, "point must not be a masked array"),
    (lambda s: s.punch([0, None, 0], 0.01), TypeError, "point must be made of numbers.*NoneType"),
    (lambda s: s.grasp("g", np.array([0, None, 0]), radius=0.1), TypeError, "point must be made of numbers.*NoneType"),
    (lambda s: s.grasp("g", b"here"), TypeError, "point must be made of numbers.*bytes"),
    (lambda s: s.set_material(young=True), TypeError, "young must be a number, not bool"),
    (lambda s: s.set_material(young=np.bool_(True)), TypeError, "young must be a number, not bool")])
def test_values_of_commands_are_refused_by_name(sheet, call, kind, words):
    with pytest.raises(kind, match=words):
        call(sheet)


def test_long_numbers_are_numbers(sheet):
    sheet.grasp("long", [0, 0, 0], radius=np.longdouble(0.1))
    sheet.grasp("plain", [0, 0, 0], radius=0.1)
    long, plain = sheet.grasps["vertices"]
    assert long == plain


def test_a_scene_in_itself_is_refused():
    body = {}
    body["model"] = body
    with pytest.raises(ValueError, match="too deep for a scene"):
        kerf.Session({"body": body})


@pytest.mark.parametrize(("call", "kind", "words"), [
    (lambda s: move(s, None, (0, 0, 0)), TypeError, "^base must be three numbers, not of type NoneType"),
    (lambda s: move(s, (0, 0, 0), None), TypeError, "^tip must be three numbers, not of type NoneType"),
    (lambda s: move(s, (True, False, True), (0, 0, 0)), TypeError, "^base must be three numbers, not of type bool"),
    (lambda s: move(s, [0, None, 0], (0, 0, 0)), TypeError, "^base must be three numbers, not with NoneType in it"),
    (lambda s: setattr(s, "gravity", None), TypeError, "^gravity must be three numbers, not of type NoneType"),
    (lambda s: s.to_world([[0, "1", None]]), TypeError, r"^rest must be an array of shape \(k, 3\): .*, not with str in it"),
    (lambda s: s.cut(ACROSS.astype(object)), TypeError, r"^poses must be .*, not of objects; its astype\(float\) is of numbers"),
    (lambda s: s.step(True), TypeError, "^n must be a whole number, not bool"),
    (lambda s: s.render(True, 5), TypeError, "^width must be a whole number of pixels, not bool"),
    (lambda s: kerf.view(s, port=True), TypeError, "^port must be a whole number, not bool"),
    (lambda s: s.restore(kerf.Snapshot.__new__(kerf.Snapshot)), TypeError, r"^snapshot must be what a session's snapshot\(\) gave"),
    (lambda s: s.release("h\ud800"), kerf.Error, r"^'h\\ud800' is not UTF-8"),
    (lambda s: kerf.Session("\ud800"), kerf.Error, r"^'\\ud800' is not UTF-8"),
    (lambda s: kerf.bind([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.array([[0, None, 1]])), TypeError, "^triangles must be whole numbers, not with NoneType in it"),
    (lambda s: kerf.bind("sheet").save(None), TypeError, "^a path is a str or os.PathLike, not NoneType"),
    (lambda s: kerf.Recording.load(""), kerf.Error, "name the file of a recording")])
def test_what_is_refused_is_named(sheet, call, kind, words):
    with pytest.raises(kind, match=words):
        call(sheet)
