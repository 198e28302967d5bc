#!/usr/bin/env python3
"""What a sweep costs beside a plain loop: rows a second, processor time of the driver for a row, memory. Needs kerf[sweep].

    python bench/sweep_speed.py --rows 5000 --turns 3

Times are of this machine as it is; the ways take turns, and the median of each is told.
"""

import argparse
import resource
import statistics
import tempfile
import time
from pathlib import Path

import kerf
import kerf.sweep


def nothing(parameters, seed):
    return {"y": seed}


def sheet(parameters, seed):
    """Some 10 ms of a processor."""
    with kerf.Session({"body": {"model": "sheet"}, "simulation": {"threads": 1, "time_step": 0.01}}) as session:
        session.cut([[[-0.6, 0.1, 0.3], [-0.6, 0.1, -0.3]], [[0.6, -0.1, 0.3], [0.6, -0.1, -0.3]]])
        session.step(20)
        return {"pieces": session.counts["pieces"], "hash": f"{session.hash:016x}"}


def plain(function, rows):
    for row in kerf.sweep.Plan(seeds=rows):
        function(row.parameters, row.seed)


def swept(function, rows, workers, folder):
    kerf.sweep.run(function, kerf.sweep.Plan(seeds=rows), folder, workers=workers)


def main():
    import ray

    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--rows", type=int, default=5000)
    options.add_argument("--turns", type=int, default=3)
    options = options.parse_args()
    ray.init(address="local", num_cpus=2, include_dashboard=False, log_to_driver=False, logging_level=40)
    for function, rows in ((nothing, options.rows), (sheet, options.rows // 5)):
        ways = {"plain loop": lambda f: plain(function, rows), "workers=0": lambda f: swept(function, rows, 0, f),
                "Ray, 1 worker": lambda f: swept(function, rows, 1, f), "Ray, 2 workers": lambda f: swept(function, rows, 2, f)}
        told = {way: [] for way in ways}
        for turn in range(options.turns + 1):
            for way, work in ways.items():
                with tempfile.TemporaryDirectory() as folder:
                    began, busy = time.perf_counter(), time.process_time()
                    work(Path(folder) / "out")
                    if turn:  # the first one warms up
                        told[way].append((time.perf_counter() - began, time.process_time() - busy))
        print(f"\n{function.__name__}, {rows} rows\n\n| way | rows/s | ms of this process a row |\n|---|---|---|")
        for way, times in told.items():
            print(f"| {way} | {rows / statistics.median(t for t, _ in times):.0f} | {1e3 * statistics.median(b for _, b in times) / rows:.2f} |", flush=True)
    print(f"\nlargest memory of this process: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")


if __name__ == "__main__":
    main()
