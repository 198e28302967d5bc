"""Sweeps: a function or a scene over many values, on all processors of this machine or of a Ray cluster.

    import kerf.sweep

    def sag(parameters, seed):
        session = kerf.Session({"body": {"model": "sheet"}, "material": {"young": parameters["young"]},
                                "fix": [{"half_space": {"point": [0, 0.45, 0], "normal": [0, 1, 0]}}]})
        session.step(200)
        return {"lowest": session.positions[:, 2].min(), "hash": f"{session.hash:016x}"}

    kerf.sweep.run(sag, kerf.sweep.Plan(grid={"young": [1e4, 1e5, 1e6]}), "results")
    table = kerf.sweep.read("results")  # a pyarrow.Table, one row for each value

A sweep that was interrupted goes on where it was when it is run again. `python -m kerf.sweep sweep.toml --out results` does one from a file.
"""

from __future__ import annotations

from ._plan import Plan
from ._run import Summary, run
from ._scene import Scene
from ._store import read

__all__ = ["Plan", "Scene", "Summary", "read", "run"]

for _made in (Plan, Scene, Summary, run, read):
    _made.__module__ = "kerf.sweep"
