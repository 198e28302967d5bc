"""Calls in any order, on sessions that are closed, restored and cut meanwhile: errors, never a crash or a broken body."""

import random

import numpy as np
import pytest

import kerf

NAMES = ["positions", "velocities", "normals", "rest_positions", "triangles", "uvs", "collision_positions", "collision_rest_positions",
         "collision_triangles", "nodes", "node_velocities", "hexahedra", "counts", "hash", "time", "last_step", "notes", "undo_depth"]


class Storm:
    def __init__(self, seed):
        self.random, self.numbers = random.Random(seed), np.random.default_rng(seed)
        self.sessions = [self.new() for _ in range(3)]
        self.blades, self.snapshots, self.arrays = [], [], []

    def new(self):
        return kerf.Session({"body": {"model": self.random.choice(["sheet", "steak"])}})

    def frame(self):
        return self.random.choice(["rest", "world"])

    def call(self, session):
        which = self.random.choice
        name = which(["step", "step", "cut", "undo", "redo", "snapshot", "restore", "begin", "move", "move", "exit", "cancel", "get", "get", "get", "close"])
        if name == "step":
            session.step(self.random.randrange(4))
        elif name == "cut":
            session.cut(self.numbers.normal(0, which([0.03, 0.1, 1]), (self.random.randrange(1, 5), 2, 3)), self.frame(), which([True, False]))
        elif name == "undo":
            session.undo()
        elif name == "redo":
            session.redo()
        elif name == "snapshot":
            self.snapshots = self.snapshots[-3:] + [session.snapshot()]
        elif name == "restore" and self.snapshots:
            session.restore(which(self.snapshots))
        elif name == "begin":
            blade = session.stroke(self.frame())
            self.blades = self.blades[-5:] + [blade]
            blade.__enter__()
        elif name == "move" and self.blades:
            which(self.blades).move(self.numbers.normal(0, 0.08, 3), tuple(self.numbers.normal(0, 0.08, 3)))
        elif name == "exit" and self.blades:
            which(self.blades).__exit__(None, None, None)
        elif name == "cancel" and self.blades:
            which(self.blades).cancel()
        elif name == "get":
            value = getattr(session, which(NAMES))
            if isinstance(value, np.ndarray):
                self.arrays = self.arrays[-30:] + [(value, value.tobytes())]
        elif name == "close" and self.random.random() < 0.2:
            session.close()
            self.sessions[self.sessions.index(session)] = self.new()

    def check(self, session):
        session.validate()
        assert np.isfinite(session.positions).all()
        assert session.triangles.max() < len(session.positions)
        assert session.hexahedra.max() < len(session.nodes)
        assert session.collision_triangles.max() < len(session.collision_positions)
        assert all(array.tobytes() == bits for array, bits in self.arrays)


@pytest.mark.parametrize("seed", range(3))
def test_calls_in_any_order(seed):
    storm, refused = Storm(seed), 0
    for i in range(3000):
        session = storm.random.choice(storm.sessions)
        try:
            storm.call(session)
        except (kerf.Error, ValueError):
            refused += 1
        if i % 100 == 0:
            storm.check(storm.random.choice(storm.sessions))
    assert 0 < refused < 3000
