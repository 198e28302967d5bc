"""Batches: many sessions in one call do what each does by itself."""

import copy
import gc
import os
import pickle
import signal
import threading
import time
import weakref

import numpy as np
import pytest

import kerf

SHEET = {"body": {"model": "sheet"}, "simulation": {"time_step": 0.005},
         "fix": [{"half_space": {"point": [side * 0.45, 0, 0], "normal": [side, 0, 0]}} for side in (-1, 1)]}


def edges(places, low=-0.3, high=0.3):
    """Upright edges at (n, 2) places: (n, 2, 3)."""
    out = np.empty((len(places), 2, 3))
    out[:, :, :2] = np.asarray(places)[:, None]
    out[:, 0, 2], out[:, 1, 2] = high, low
    return out


def paths(n, turns, seed=3):
    """(turns, n, 2, 3): a walk for each session."""
    random = np.random.default_rng(seed)
    walk = np.cumsum(random.uniform(-0.1, 0.1, (turns, n, 2)), axis=0).clip(-0.4, 0.4)
    return np.stack([edges(places) for places in walk])


def by_hand(session, path, steps):
    """What a batch does, by calls of the session."""
    with session.stroke(frame="world") as blade:
        blade.move(*path[0])
        session.step(0)
        last = path[0]
        for at, edge in enumerate(path):
            for i in range(1, steps + 1):
                share = i / steps
                blade.move(*(last + share * (edge - last)))
                session.step()
            last = edge


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_turns_are_what_sessions_do_alone(threads):
    n, turns, steps = 4, 6, 3
    walk = paths(n, turns)
    batch = kerf.Batch([kerf.Session(SHEET) for _ in range(n)], threads=threads)
    for edge in walk:
        assert batch.turn(steps, blade=edge) == {}
    cut = 0
    for i, session in enumerate(batch.sessions):
        batch.place_blade(i, *walk[-1, i])  # lifts it
        alone = kerf.Session(SHEET)
        by_hand(alone, walk[:, i], steps)
        assert session.hash == alone.hash
        session.validate()
        cut += session.counts["collision_triangles"] > kerf.Session(SHEET).counts["collision_triangles"]
    assert cut == n


def test_who_takes_no_part_stays_as_it_is():
    batch = kerf.Batch([kerf.Session(SHEET) for _ in range(3)])
    before = [session.hash for session in batch.sessions]
    assert batch.turn(4, takes=[True, False, True]) == {}
    after = [session.hash for session in batch.sessions]
    assert after[1] == before[1] and after[0] == after[2] != before[0]


def test_cuts_only_while_it_is_told_to():
    batch = kerf.Batch([kerf.Session(SHEET) for _ in range(2)])
    assert batch.turn(1, blade=edges([(-0.3, 0), (-0.3, 0)]), cuts=[True, False]) == {}
    assert batch.sessions[0].in_stroke and not batch.sessions[1].in_stroke
    assert batch.turn(1, blade=edges([(0.3, 0), (0.3, 0)]), cuts=[True, False]) == {}
    assert batch.turn(1, blade=edges([(0.3, 0.1), (0.3, 0.1)]), cuts=[False, False]) == {}
    assert not batch.sessions[0].in_stroke
    assert [session.undo_depth for session in batch.sessions] == [1, 0]


def test_a_restored_session_has_met_no_blade():
    session = kerf.Session(SHEET)
    batch = kerf.Batch([session])
    start = session.snapshot()
    batch.turn(1, blade=edges([(-0.3, 0)]), cuts=[False])
    batch.turn(1, blade=edges([(0.3, 0)]), cuts=[False])
    session.restore(start)
    batch.turn(1, blade=edges([(-0.6, 0)]))
    assert session.undo_depth == 0 and session.counts["collision_triangles"] == kerf.Session(SHEET).counts["collision_triangles"]
    batch.turn(1, blade=edges([(-0.2, 0)]))
    assert session.counts["collision_triangles"] > kerf.Session(SHEET).counts["collision_triangles"]


def test_a_session_at_work_can_be_printed():
    batch = kerf.Batch([kerf.Session("steak")])
    thread = threading.Thread(target=lambda: batch.turn(100))
    thread.start()
    seen = set()
    while thread.is_alive():
        seen.add(repr(batch.sessions[0])[:14])
    assert seen == {"<kerf.Session,"} or seen == {"<kerf.Session,", "<kerf.Session "}


def test_grasps_and_tools_are_led():
    scene = {**SHEET, "tool": [{"id": "probe", "kind": "probe", "position": [0, 0, 0.5]}]}
    sessions = [kerf.Session(scene) for _ in range(2)]
    for session in sessions:
        session.grasp("hand", [0, 0, 0], radius=0.1)
    batch = kerf.Batch(sessions)
    up = np.array([[0, 0, 0.05], [0, 0, 0.1]])
    poses = np.array([[0, 0, 0.6, 0, 0, 0], [0.1, 0, 0.5, 0, 0, 0.3]])
    assert batch.turn(20, grasps={"hand": up}, tools={"probe": poses}) == {}
    for i, session in enumerate(sessions):
        assert session.grasps[0]["target"] == pytest.approx(up[i], abs=0.02)
        assert session.tools[0]["pose_position"] == pytest.approx(poses[i, :3], abs=1e-9)


def test_a_row_of_nan_leaves_alone():
    """To the bit what sessions do that are led by themselves."""
    scene = {**SHEET, "tool": [{"id": "probe", "kind": "probe", "position": [0, 0, 0.5]}]}
    held = (("hand",), (), ("hand", "other"), ("other",), ("hand", "other"))  # grasps that each session has
    sessions, alone = ([kerf.Session(scene) for _ in held] for _ in range(2))
    for each in (sessions, alone):
        for session, ids in zip(each, held, strict=True):
            for id in ids:
                session.grasp(id, [0.2 * (id == "hand"), 0, 0], radius=0.1)
    places = np.random.default_rng(2).uniform(-0.05, 0.05, (5, 3))
    poses = np.column_stack([places + (0, 0, 0.6), np.zeros((5, 3))])
    poses[3] = np.nan
    grasps = {id: np.where([[id in ids] for ids in held], places, np.nan) for id in ("hand", "other")}
    takes = [True, True, True, True, False]
    batch, singles = kerf.Batch(sessions, threads=2), [kerf.Batch([session]) for session in alone]
    for x in (-0.2, 0.1):
        blade = edges([(x, 0.02 * i) for i in range(5)])
        assert batch.turn(8, grasps=grasps, tools={"probe": poses}, blade=blade, takes=takes) == {}
        for i, ids in enumerate(held[:4]):
            tools = {} if i == 3 else {"probe": poses[i:i + 1]}
            assert singles[i].turn(8, grasps={id: places[i:i + 1] for id in ids}, tools=tools, blade=blade[i:i + 1]) == {}
    assert [session.hash for session in sessions] == [session.hash for session in alone]
    assert [session.steps for session in sessions] == [16, 16, 16, 16, 0]
    assert [(session.grasps["target"] == other.grasps["target"]).all() for session, other in zip(sessions, alone, strict=True)] == [True] * 5
    assert list(batch.turn(1, grasps={"hand": places, "other": np.full((5, 3), np.nan)})) == [1, 3]
    for wrong in (np.where(np.arange(3) == 1, np.nan, places), np.full((5, 2), np.nan), np.full((5, 3), np.inf)):
        with pytest.raises(ValueError, match="hand"):
            batch.turn(1, grasps={"hand": wrong})


def test_one_that_fails_does_not_stop_the_others():
    sessions = [kerf.Session(SHEET) for _ in range(3)]
    batch = kerf.Batch(sessions)
    sessions[1].close()
    said = batch.turn(5)
    assert list(said) == [1] and "closed" in said[1]
    assert sessions[0].steps == sessions[2].steps == 5
    assert list(batch.turn(1, grasps={"nobody": np.zeros((3, 3))})) == [0, 1, 2]
    with pytest.raises(kerf.Error, match="closed"):
        batch.to_world(np.zeros((3, 1, 3)))


def test_places_go_there_and_back():
    batch = kerf.Batch([kerf.Session({"body": {"model": "sheet"}, "material": {"damping_mass": 0}}) for _ in range(2)])
    rest = np.random.default_rng(5).uniform(-0.4, 0.4, (2, 7, 3)) * [1, 1, 0]
    batch.turn(10, takes=[True, False])
    step = batch.sessions[0].time_step
    fallen = 9.81 * step**2 * 10 * 11 / 2
    now = batch.to_world(rest)
    assert now == pytest.approx(rest - np.array([[[0, 0, fallen]], [[0, 0, 0]]]), abs=1e-6)
    back, distance = batch.to_rest(now)
    assert back == pytest.approx(rest, abs=1e-6) and distance == pytest.approx(np.zeros((2, 7)), abs=1e-6)
    for i, session in enumerate(batch.sessions):
        assert (session.to_world(rest[i]) == now[i]).all()
        there, far = session.to_rest(now[i])
        assert (there == back[i]).all() and (far == distance[i]).all()
    assert batch.sessions[0].to_world(np.zeros((0, 3))).shape == (0, 3)
    assert batch.to_world(np.zeros((2, 0, 3))).shape == (2, 0, 3)


@pytest.mark.parametrize("wrong", [
    lambda b: b.turn(-1), lambda b: b.turn(blade=np.zeros((2, 2, 3))), lambda b: b.turn(blade=np.full((3, 2, 3), np.nan)),
    lambda b: b.turn(cuts=[1, 0, 1]), lambda b: b.turn(takes=[True]), lambda b: b.turn(grasps={"a": np.zeros((3, 2))}),
    lambda b: b.turn(tools={"a": np.zeros((3, 3))}), lambda b: b.to_world(np.zeros((3, 3))), lambda b: b.to_rest([[["a"]]]),
    lambda b: b.place_blade(0, [0, 0], [0, 0, 1]), lambda b: kerf.Batch([]), lambda b: kerf.Batch([b.sessions[0]] * 2),
    lambda b: kerf.Batch(b.sessions, threads=0), lambda b: kerf.Batch([b.sessions[0], "steak"]), lambda b: kerf.Batch(3)])
def test_what_can_not_be_used_is_refused(wrong):
    batch = kerf.Batch([kerf.Session(SHEET) for _ in range(3)])
    before = [session.hash for session in batch.sessions]
    with pytest.raises((ValueError, TypeError)):
        wrong(batch)
    assert [session.hash for session in batch.sessions] == before


def test_a_session_number_that_is_not_there():
    batch = kerf.Batch([kerf.Session(SHEET)])
    with pytest.raises(IndexError):
        batch.place_blade(1, [0, 0, 0], [0, 0, 1])
    with pytest.raises((IndexError, TypeError, OverflowError)):
        batch.place_blade(-1, [0, 0, 0], [0, 0, 1])


def test_a_batch_that_is_made_twice():
    batch = kerf.Batch([kerf.Session(SHEET)])
    before = batch.sessions
    with pytest.raises(TypeError, match="this batch is made already"):
        batch.__init__([kerf.Session(SHEET), kerf.Session(SHEET)])
    assert batch.sessions is before and batch.turn() == {}


def test_a_blade_without_an_edge_is_not_placed():
    batch = kerf.Batch([kerf.Session(SHEET)])
    with pytest.raises(kerf.Error, match="base and tip are the same point"):
        batch.place_blade(0, [0, 0, 1], [0, 0, 1])
    assert batch.turn(blade=np.array([[[0, 0, 1], [0, 0, 0.9]]])) == {}


def test_others_may_not_use_a_session_meanwhile():
    batch = kerf.Batch([kerf.Session("steak") for _ in range(2)])
    refused = []

    def disturb():
        while thread.is_alive():
            try:
                batch.sessions[1].hash
            except kerf.Error as error:
                refused.append(str(error))

    thread = threading.Thread(target=lambda: batch.turn(60))
    thread.start()
    disturb()
    assert refused == [] or "another thread" in refused[0]
    for session in batch.sessions:
        session.validate()


def test_two_threads_in_one_batch():
    batch = kerf.Batch([kerf.Session(SHEET) for _ in range(3)], threads=2)
    until, refused, done = time.perf_counter() + 1, [], []

    def use():
        while time.perf_counter() < until:
            for work in (lambda: batch.turn(3), lambda: batch.counts, lambda: batch.to_world(np.zeros((3, 1, 3))),
                         lambda: batch.place_blade(0, [0, 0, 1], [0, 0, 0])):
                try:
                    work()
                    done.append(1)
                except kerf.Error as error:
                    refused.append(str(error))

    threads = [threading.Thread(target=use, daemon=True) for _ in range(3)]  # one that hangs shall not keep the test
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(20)
        assert not thread.is_alive()
    assert done and refused and all("batch is in use by another thread" in text for text in refused)
    assert batch.turn(1) == {}


def test_a_batch_is_not_copied():
    batch = kerf.Batch([kerf.Session(SHEET)])
    for work in (copy.copy, copy.deepcopy, pickle.dumps):
        with pytest.raises(TypeError, match="make another one"):
            work(batch)


def test_ctrl_c_ends_a_turn():
    batch = kerf.Batch([kerf.Session(SHEET) for _ in range(2)])
    signal.signal(signal.SIGINT, signal.default_int_handler)  # shells start what runs in the background without it
    threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    began = time.perf_counter()
    with pytest.raises(KeyboardInterrupt):
        batch.turn(10**9)
    assert time.perf_counter() - began < 5
    for session in batch.sessions:
        session.validate()


def test_a_session_that_holds_its_batch_is_freed():
    class Mine(kerf.Session):
        pass

    session = Mine(SHEET)
    session.batch = kerf.Batch([session])
    gone = weakref.ref(session)
    del session
    gc.collect()
    assert gone() is None


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
def test_goes_on_after_a_fork():
    batch = kerf.Batch([kerf.Session(SHEET) for _ in range(3)], threads=3)
    batch.turn(2)
    time.sleep(0.1)  # its threads wait
    child = os.fork()
    if child == 0:
        signal.alarm(20)  # a child that hangs ends by it
        ok = batch.turn(2) == {} and batch.sessions[0].steps == 4
        del batch
        gc.collect()
        os._exit(0 if ok else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    assert batch.turn(2) == {}


@pytest.mark.parametrize(("wrong", "error", "words"), [
    (lambda b: b.turn("2"), TypeError, "steps"), (lambda b: b.turn(2**64), ValueError, "steps"), (lambda b: b.turn(grasps=[1]), TypeError, "dict of ids"),
    (lambda b: b.turn(tools={5: np.zeros((1, 6))}), TypeError, "an id in tools"), (lambda b: b.turn(blade=np.zeros((1, 2, 3), complex)), TypeError, "complex"),
    (lambda b: b.turn(blade=np.full((1, 2, 3), 2e6)), ValueError, "1e.06 at most"), (lambda b: b.turn(cuts=[1]), ValueError, "truth values"),
    (lambda b: b.to_world(np.full((1, 1, 3), 1e160)), ValueError, "1e.06 at most"), (lambda b: b.to_rest(np.full((1, 1, 3), -1e300)), ValueError, "at most"),
    (lambda b: b.place_blade(1, [0, 0, 0], [0, 0, 1]), IndexError, "numbered from 0"), (lambda b: kerf.Batch(b.sessions[0]), TypeError, "list of sessions"),
    (lambda b: kerf.Batch(b.sessions, threads=1.5), TypeError, "threads")])
def test_what_can_not_be_used_is_named(wrong, error, words):
    with pytest.raises(error, match=words):
        wrong(kerf.Batch([kerf.Session(SHEET)]))


def test_an_answer_goes_into_the_callers_array_or_is_refused():
    batch = kerf.Batch([kerf.Session(SHEET)])
    rest = np.array([[[0.1, 0.2, 0], [0, 0, 0]]])
    out = np.empty((1, 2, 3))
    assert batch.to_world(rest, out) is out and (out == batch.to_world(rest)).all()
    locked = np.empty((1, 2, 3))
    locked.flags.writeable = False
    for wrong in (np.empty((1, 2, 3), np.float32), np.empty((1, 3, 3)), np.empty((1, 2, 6))[..., ::2], locked):
        with pytest.raises(ValueError, match="out must be a writeable array"):
            batch.to_world(rest, wrong)
    with pytest.raises(TypeError, match="out"):
        batch.to_world(rest, [[0.0, 0, 0]])


def test_counts_and_masses_are_those_of_the_sessions():
    batch = kerf.Batch([kerf.Session(SHEET) for _ in range(3)], threads=2)
    batch.sessions[1].cut([[[0, -1, 1], [0, -1, -1]], [[0, 1, 1], [0, 1, -1]]])
    counts = batch.counts
    for i, session in enumerate(batch.sessions):
        assert {word: values[i] for word, values in counts.items()} == session.counts
    assert counts["pieces"].tolist() == [1, 2, 1] and counts["pieces"].dtype == np.int64 and counts["pieces"].flags.writeable
    masses = batch.piece_masses(2)
    assert masses.shape == (3, 2) and (masses[:, 1] > 0).tolist() == [False, True, False]
    assert (masses[1] == batch.sessions[1].piece_masses).all()
    assert (batch.piece_masses(1)[:, 0] == masses[:, 0]).all() and batch.piece_masses(4).shape == (3, 4)
    for wrong, error in ((0, ValueError), (10**12, ValueError), (1.5, TypeError), (None, TypeError)):
        with pytest.raises(error, match="most"):
            batch.piece_masses(wrong)


def test_tools_and_grasps_are_those_of_the_sessions():
    scene = {"body": {"model": "sheet"}, "tool": [{"id": "a", "kind": "sphere", "radius": 0.1, "position": [0, 0, 1]},
                                                  {"id": "b", "kind": "sphere", "radius": 0.1, "position": [0, 0.5, 1]}]}
    batch = kerf.Batch([kerf.Session(scene) for _ in range(3)])
    batch.sessions[2].grasp("h", [0.2, 0, 0], radius=0.1)
    for i in range(2):
        batch.turn(2, tools={"b": [[i, row, 2, 0, 0, 0] for row in range(3)]})
        tool, grasp = batch.tool("b"), batch.grasp("h")
        assert tool.shape == grasp.shape == (3,)
        for row, session in enumerate(batch.sessions):
            assert tool[row] == session.tools[1]
        assert grasp[2] == batch.sessions[2].grasps[0] and grasp["vertices"].tolist()[:2] == [0, 0] and not grasp["force"][:2].any()
    assert tool["pose_position"][:, 1].tolist() == [0, 1, 2]
    for read in (batch.tool, batch.grasp):
        with pytest.raises(TypeError, match="id must be text"):
            read(5)
    with pytest.raises(kerf.Error, match='session 0 of the batch: there is no tool "c"'):
        batch.tool("c")
    batch.sessions[1].close()
    for read in (lambda: batch.counts, lambda: batch.tool("a"), lambda: batch.grasp("h"), lambda: batch.piece_masses(1)):
        with pytest.raises(kerf.Error, match="session 1 of the batch: this session is closed"):
            read()
