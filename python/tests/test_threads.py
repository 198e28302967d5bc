"""Python's lock is free while the engine works; one session is used by one thread at a time."""

import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import kerf

LARGE = {"body": {"model": "sheet", "options": {"visual_triangles": 106496}}}


def ticks_while(work):
    """How much of the time that a thread works this one could go on."""
    thread = threading.Thread(target=work)
    began = time.perf_counter()
    thread.start()
    longest, last = 0.0, time.perf_counter()
    while thread.is_alive():
        time.sleep(0.001)
        now = time.perf_counter()
        longest, last = max(longest, now - last), now
    return longest, time.perf_counter() - began


def test_others_go_on_during_steps():
    held = {"half_space": {"point": [0, 0.05, 0], "normal": [0, 1, 0]}}
    session = kerf.Session({"body": {"model": "steak"}, "lattice": {"cells": [40, 32, 4]}, "fix": [held]})
    longest, whole = ticks_while(lambda: session.step(60))
    print(f"\nsteps: {whole:.2f} s, longest pause {longest:.3f} s")
    assert whole > 0.05
    assert longest < 0.5 * whole


def test_others_go_on_while_a_body_is_bound():
    longest, whole = ticks_while(lambda: kerf.Session(LARGE))
    print(f"\nbinding: {whole:.2f} s, longest pause {longest:.3f} s")
    assert longest < 0.5 * whole


@pytest.mark.parametrize("shadows", [False, True])
def test_others_go_on_while_pictures_are_drawn(shadows):
    session = kerf.Session("steak")
    longest, whole = ticks_while(lambda: session.render(800, 600, shadows=shadows))
    print(f"\npictures: {whole:.2f} s, longest pause {longest:.3f} s")
    assert longest < 0.5 * whole


def test_two_threads_in_one_session():
    session = kerf.Session("steak")
    stop, refused = threading.Event(), []

    def work():
        while not stop.is_set():
            try:
                session.step(200)
            except kerf.Error as error:
                refused.append(str(error))

    thread = threading.Thread(target=work)
    thread.start()
    for _ in range(2000):
        try:
            session.counts
            session.positions
        except kerf.Error as error:
            refused.append(str(error))
            time.sleep(0.0002)
    stop.set()
    thread.join()
    assert refused and all("another thread" in text for text in refused)
    session.validate()


def test_sessions_in_threads_of_their_own():
    hashes = []

    def work():
        session = kerf.Session("steak")
        session.step(150)
        hashes.append(session.hash)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(hashes) == 4 and len(set(hashes)) == 1


@pytest.mark.parametrize("work", ["step", "cut", "bind"])
def test_ctrl_c_ends_long_work(work):
    session = kerf.Session("steak")
    y = np.linspace(-0.1, 0.12, 200000)
    poses = np.stack([np.stack([0.03 * np.sin(400 * y), y, np.full_like(y, z)], axis=1) for z in (0.05, -0.05)], axis=1)
    before = session.hash
    signal.signal(signal.SIGALRM, signal.default_int_handler)
    signal.setitimer(signal.ITIMER_REAL, 0.3)
    began = time.perf_counter()
    try:
        with pytest.raises(KeyboardInterrupt):
            if work == "step":
                session.step(10**9)
            elif work == "cut":
                session.cut(poses)
            else:
                for _ in range(1000):
                    kerf.Session(LARGE)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
    assert time.perf_counter() - began < 5
    assert work == "step" or session.hash == before
    session.step(1)
    session.validate()


@pytest.mark.parametrize("work", ["session.step(1)", "session.step(10**6)", "batch.turn(1)", "session.render(64, 64)", "kerf.Session('steak')"])
def test_a_daemon_may_be_at_work_when_python_ends(work):
    program = f"""
import threading, time
import kerf

def go_on():
    session = kerf.Session("steak")
    batch = kerf.Batch([kerf.Session("sheet") for _ in range(2)], threads=2)
    begun.release()
    while True:
        {work}

begun = threading.Semaphore(0)
for _ in range(2):
    threading.Thread(target=go_on, daemon=True).start()
for _ in range(2):
    begun.acquire()
time.sleep(0.05)
"""
    for _ in range(4):
        ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
        assert ended.returncode == 0, ended.stderr
        assert ended.stderr == "" or ended.stderr.startswith("nanobind: leaked")  # a build with assertions tells what the threads had
