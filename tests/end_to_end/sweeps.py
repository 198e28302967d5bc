#!/usr/bin/env python3
"""sweeps.py PYTHON: does the sweeps that ship as a person would, kills each on its way (SIGKILL to all its processes), goes on, and reads what came out.

PYTHON: an interpreter that has kerf with kerf[test]. Exit status 1: something is wrong; it says what. 77: it has no Ray.
"""
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time

SWEEPS = pathlib.Path(__file__).resolve().parent.parent.parent / "python/sweeps"
LONGEST = 900  # s of one sweep, on a machine with much else to do
ROWS = "import kerf.sweep, sys; t = kerf.sweep.read(sys.argv[1]); print(t.num_rows, len(set(zip(*(t[c].to_pylist() for c in sys.argv[2].split(','))))))"


def rows(out):
    """Rows that are there, while the sweep goes on."""
    journal, parts = out / "_journal.jsonl", sorted(out.glob("rows-*.parquet"))
    return (len(journal.read_bytes().splitlines()) if journal.exists() else 0) + len(parts)


def begin(python, name, out, seeds):
    command = [python, "-m", "kerf.sweep", str(SWEEPS / f"{name}.toml"), "--out", str(out), "--quiet", *(["--seeds", str(seeds)] if seeds else [])]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True)


def end(process):
    said, _ = process.communicate(timeout=LONGEST)
    assert process.returncode == 0, said
    return said.strip().splitlines()[-1]


def check(python, name, wanted, seeds=None, keys=""):
    with tempfile.TemporaryDirectory() as folder:
        out, start = pathlib.Path(folder) / "out", time.monotonic()
        first = begin(python, name, out, seeds)
        while rows(out) < 3:
            assert first.poll() is None, first.communicate()[0]
            assert time.monotonic() < start + LONGEST, f"{name}: no row within {LONGEST} s"
            time.sleep(0.05)
        os.killpg(first.pid, signal.SIGKILL)
        first.communicate()
        before = rows(out)
        assert before < wanted, f"{name}: it was killed too late"
        said = end(begin(python, name, out, seeds))
        assert f"{wanted} of {wanted} rows" in said and "; 0 failed" in said, said
        new = int(re.search(r"(\d+) of them now", said)[1])
        assert wanted - before <= new <= wanted - before + 1, f"{name}: of {before} rows that were there it lost more than the one on its way: {said}"
        again = end(begin(python, name, out, seeds))
        assert ", 0 of them now" in again, again
        there, different = map(int, subprocess.run([python, "-c", ROWS, str(out), keys], check=True, capture_output=True, text=True).stdout.split())
        assert there == different == wanted, f"{name}: {there} rows, {different} different ones, of {wanted}"
        judged = subprocess.run([python, str(SWEEPS / f"{name}.py"), str(out)], capture_output=True, text=True)
        assert judged.returncode == 0, judged.stdout + judged.stderr
        print(f"ok   {name}: killed after {before} rows; {said}; {time.monotonic() - start:.0f} s in all\n{judged.stdout.strip()}", flush=True)


def main(python):
    if subprocess.run([python, "-c", "import ray"], capture_output=True).returncode != 0:
        print("sweeps: Ray is not installed: scripts/python installs it where it can")
        return 77
    check(python, "strip_compliance", 24, keys="slit,young")
    check(python, "cut_storm", 21, seeds=1, keys="way,body")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
