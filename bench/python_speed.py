"""What the Python package costs, beside what it aims at.

    scripts/python && build/python/*/bin/python bench/python_speed.py [--markdown]      (pip install gymnasium there)

Every figure is a median of runs, taken by turns where two are compared.
"""

import argparse
import statistics
import subprocess
import sys
import time

import numpy as np

import kerf
import kerf.gym

SHEET = {"body": {"model": "sheet"}, "lattice": {"cells": [9, 9, 1]}, "simulation": {"time_step": 0.005},
         "fix": [{"half_space": {"point": [side * 0.45, 0, 0], "normal": [side, 0, 0]}} for side in (-1, 1)]}


def seconds(work, runs=5):
    """Median time of a call."""
    times = []
    for _ in range(runs):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return statistics.median(times)


def sheets(threads, runs=7, actions=40):
    """Actions a second of 16 sheets of 81 hexahedra, 10 steps of 5 ms each, with each of these numbers of threads; by turns, from the same state."""
    sessions = [kerf.Session(SHEET) for _ in range(16)]
    batches = {count: kerf.Batch(sessions, threads=count) for count in threads}
    batches[1].turn(20)
    starts = [session.snapshot() for session in sessions]
    rates = {count: [] for count in threads}
    for _ in range(runs):
        for count, batch in batches.items():
            for session, start in zip(sessions, starts, strict=True):
                session.restore(start)
            rates[count].append(16 * actions / seconds(lambda batch=batch: [batch.turn(10) for _ in range(actions)], runs=1))
    return {count: statistics.median(values) for count, values in rates.items()}


class Sheets(kerf.gym.Tasks):
    """The least that a task can be: 16 of those sheets, one place of each is seen."""

    steps, action_size, state_size = 10, 1, 3

    def scene(self):
        return SHEET

    def begin(self, row, random):
        pass

    def control(self, actions, plays):
        return {}

    def look(self, states, rows):
        states[rows] = self.batch.to_world(np.zeros((self.num_envs, 1, 3)))[rows, 0]

    def judge(self, plays):
        return np.zeros(self.num_envs), np.zeros(self.num_envs, bool)


def alone(times):
    """Wall seconds of `times` programs at once, each with 16 sheets and one thread: what the machine's processors give at most."""
    work = "import sys; sys.path.insert(0, sys.argv[1]); import python_speed as p; p.sheets([1], runs=3, actions=120)"
    began = time.perf_counter()
    programs = [subprocess.Popen([sys.executable, "-c", work, sys.path[0]]) for _ in range(times)]
    if any([program.wait() for program in programs]):
        raise SystemExit("a program of its own failed")
    return time.perf_counter() - began


def inside_engine(envs, actions_of):
    """Share of the time of the steps of a task that is spent in calls of the batch."""
    envs.reset(seed=1)
    spent = [0.0]

    def timed(call):
        def within(*given, **named):
            began = time.perf_counter()
            try:
                return call(*given, **named)
            finally:
                spent[0] += time.perf_counter() - began
        return within

    for name in ("turn", "to_rest", "to_world"):
        setattr(envs.batch, name, timed(getattr(envs.batch, name)))
    whole = seconds(lambda: [envs.step(actions_of()) for _ in range(70)], runs=1)
    envs.close()
    return spent[0] / whole


def pattern_cut(observations, actions=70):
    """Actions a second of 16 copies of PatternCut, led by the expert."""
    envs = kerf.gym.make_vec("Kerf/PatternCut-v0", 16, observations=observations)

    def episode():
        envs.reset(seed=3)
        for _ in range(actions):
            envs.step(envs.expert())

    rate = 16 * actions / seconds(episode, runs=5)
    envs.close()
    return rate


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--markdown", action="store_true")
    options = options.parse_args()
    small = kerf.Session(SHEET)
    calls = seconds(lambda: [small.step(0) for _ in range(10_000)]) / 10_000
    small.positions  # noqa: B018
    views = seconds(lambda: [small.positions for _ in range(10_000)]) / 10_000
    imported = seconds(lambda: subprocess.run([sys.executable, "-c", "import kerf"], check=True))
    bare = seconds(lambda: subprocess.run([sys.executable, "-c", "pass"], check=True))
    rates = sheets([1, 2])
    sheet_tasks, still = Sheets(16), np.zeros((16, 1))
    of_sheets = inside_engine(sheet_tasks, lambda: still)
    tasks = kerf.gym.make_vec("Kerf/PatternCut-v0", 16)
    of_cuts = inside_engine(tasks, tasks.expert)
    two = statistics.median(2 * alone(1) / alone(2) for _ in range(3))
    rows = [("a call of `step()`", f"{1e6 * calls:.2f} µs", "2 µs"),
            ("an array that has not changed", f"{1e6 * views:.2f} µs", "1 µs"),
            ("`import kerf`", f"{1e3 * (imported - bare):.0f} ms", "80 ms"),
            ("16 sheets of 81 hexahedra, 10 steps of 5 ms an action, one thread", f"{rates[1]:.0f} actions/s", ""),
            ("the same, two threads", f"{rates[2] / rates[1]:.2f} times", "1.9 times"),
            ("two programs of one thread each, at once", f"{two:.2f} times", ""),
            ("a task of these sheets: share of the time inside the engine", f"{100 * of_sheets:.0f} %", "95 %"),
            ("PatternCut, 16 copies, state", f"{pattern_cut('state'):.0f} actions/s", "1500"),
            ("PatternCut, 16 copies, 64 x 64 pixels", f"{pattern_cut('pixels'):.0f} actions/s", "300"),
            ("PatternCut with its expert: share of the time inside the engine", f"{100 * of_cuts:.0f} %", "")]
    if options.markdown:
        print("| what | measured | aim |\n|---|---|---|")
    for row in rows:
        print("| " + " | ".join(row) + " |" if options.markdown else "{:70s} {:>16s}   {}".format(*row))


if __name__ == "__main__":
    main()
