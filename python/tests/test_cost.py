"""Memory and the cost of calls. `pytest -s` prints the figures."""

import gc
import os
import time
import weakref
from pathlib import Path

import numpy as np

import kerf

SMALL = {"body": {"model": "sheet"}, "lattice": {"cells": [2, 2, 1]}}
ACROSS = np.array([[[0, -1, 0.5], [0, -1, -0.5]], [[0, 1, 0.5], [0, 1, -0.5]]])


def resident():
    """Bytes."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def test_2000_sessions_leave_nothing():
    def use():
        session = kerf.Session(SMALL)
        session.cut(ACROSS)
        session.grasp("a", [0.3, 0.3, 0], radius=0.2)
        session.step()
        return session.positions, session.triangles, session.grasps, session.contacts

    for _ in range(200):
        use()
    gc.collect()
    before = resident()
    began = time.perf_counter()
    for _ in range(2000):
        use()
    took = time.perf_counter() - began
    gc.collect()
    grown = resident() - before
    print(f"\n2,000 sessions, each cut in two: {1e3 * took / 2000:.2f} ms each, {grown / 2**20:+.2f} MiB")
    assert grown < 4 * 2**20


def test_errors_leave_nothing():
    session = kerf.Session(SMALL)

    def use():
        for bad in ("nothing", "body.model = 'nothing'", {"body": 1}):
            try:
                kerf.Session(bad)
            except kerf.Error:
                pass
        try:
            session.punch([0, 0, 0], -1)
        except kerf.Error:
            pass

    for _ in range(200):
        use()
    gc.collect()
    before = resident()
    for _ in range(2000):
        use()
    gc.collect()
    assert resident() - before < 2 * 2**20


def test_a_session_that_holds_its_stroke_goes():
    session = type("Mine", (kerf.Session,), {})(SMALL)
    session.mine = session.stroke()
    gone = weakref.ref(session)
    del session
    gc.collect()
    assert gone() is None


def least(work, times=2000, rounds=7):
    """Seconds of one call: the best of some rounds."""
    best = float("inf")
    for _ in range(rounds):
        began = time.perf_counter()
        for _ in range(times):
            work()
        best = min(best, (time.perf_counter() - began) / times)
    return best


def test_calls_are_cheap():
    session = kerf.Session("steak")
    session.step()
    positions = session.positions
    assert session.positions is positions
    call = least(lambda: None)
    step0 = least(lambda: session.step(0)) - call
    view = least(lambda: session.positions) - call
    clock = least(lambda: session.time) - call
    stroke = session.stroke()
    with stroke as blade:
        high, higher = (9.0, 9.0, 9.0), (9.0, 9.0, 9.1)
        move = least(lambda: blade.move(high, higher), 500) - call

    def fresh():
        session.step(0)  # counts as a change: positions are made anew
        return session.positions

    new = least(fresh, 200) - step0
    print(f"\nstep(0) {1e6 * step0:.2f} us; positions kept {1e6 * view:.2f} us, anew {1e6 * new:.1f} us of {len(positions)} vertices; "
          f"time {1e6 * clock:.2f} us; move in the air {1e6 * move:.2f} us")
    assert step0 < 20e-6 and view < 10e-6


def test_a_step_costs_little_more_than_in_cpp():
    session = kerf.Session(SMALL)
    session.step(100)
    inside = least(lambda: session.step(1000), 1, 15) / 1000
    outside = least(session.step, 1000, 15)
    print(f"\nstep: {1e6 * inside:.2f} us in a row, {1e6 * outside:.2f} us by calls: {1e6 * (outside - inside):+.2f} us")
    assert outside - inside < 20e-6


def test_pictures_are_quick():
    session = kerf.Session("steak")
    rates = {}
    for width, height in ((64, 64), (128, 128), (640, 480)):
        camera = session.camera(width, height)
        rates[width] = 1 / least(lambda: session.render(width, height, camera=camera), 5, 5)
    step = least(session.step, 20, 5)
    both = least(lambda: (session.step(), session.render(128, 128, camera=camera)), 20, 5)
    print("\npictures of the steak a second: " + ", ".join(f"{rate:.0f} of {width} pixels" for width, rate in rates.items()) +
          f"; step {1e3 * step:.2f} ms, step and picture {1e3 * both:.2f} ms")
    assert rates[128] > 10


def test_import_is_quick():
    import subprocess
    import sys

    code = "import time; t = time.perf_counter(); import kerf; t = time.perf_counter() - t; import sys; print(t, 'numpy' in sys.modules)"
    best, numpy = min(tuple(subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout.split()) for _ in range(5))
    print(f"\nimport kerf: {1e3 * float(best):.1f} ms, NumPy with it: {numpy}")
    assert float(best) < 1
