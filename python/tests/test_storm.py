"""Calls in any order, on sessions that are closed, restored and cut meanwhile: errors, never a crash or a broken body."""

import random

import numpy as np
import pytest

import kerf

NAMES = ["positions", "velocities", "normals", "rest_positions", "triangles", "uvs", "collision_positions", "collision_rest_positions",
         "collision_triangles", "nodes", "node_velocities", "hexahedra", "counts", "hash", "time", "last_step", "notes", "undo_depth",
         "contacts", "tools", "grasps"]


class Storm:
    def __init__(self, seed):
        self.random, self.numbers = random.Random(seed), np.random.default_rng(seed)
        self.sessions = [self.new() for _ in range(3)]
        self.blades, self.snapshots, self.arrays = [], [], []

    def new(self):
        ball = {"id": "ball", "kind": "sphere", "radius": 0.02, "position": [0, 0, 0.1]}
        return kerf.Session({"body": {"model": self.random.choice(["sheet", "steak"])}, "tool": [ball] * self.random.randrange(2)})

    def frame(self):
        return self.random.choice(["rest", "world"])

    def call(self, session):
        which = self.random.choice
        name = which(["step", "step", "cut", "undo", "redo", "snapshot", "restore", "begin", "move", "move", "exit", "cancel", "get", "get", "get", "close",
                      "punch", "shave", "remove", "grasp", "pull", "release", "fix", "unfix", "tool", "jaws"])
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
        else:
            self.command(name, session)
        if name == "close" and self.random.random() < 0.2:
            session.close()
            self.sessions[self.sessions.index(session)] = self.new()

    def command(self, name, session):
        point, ball = self.numbers.normal(0, 0.08, 3), {"center": self.numbers.normal(0, 0.08, 3), "radius": 0.05}
        id = self.random.choice("abc")
        if name == "punch":
            session.punch(point, self.random.choice([0.005, 0.03]), frame=self.frame(), take=self.random.choice([True, False]))
        elif name == "shave":
            session.shave(self.numbers.normal(0, 0.05, (2, 2, 3)), [0, 0.003], 0.01, frame=self.frame())
        elif name == "remove":
            session.remove(*self.random.choice([(id,), ()]), sphere=self.random.choice([None, ball]))
        elif name == "grasp":
            session.grasp(id, point, radius=0.02, frame=self.frame())
        elif name == "pull":
            session.move(id, by=self.numbers.normal(0, 0.01, 3), over=self.random.choice([0, 0.01]))
        elif name == "release":
            session.release(id)
        elif name == "fix":
            session.fix(sphere=ball)
        elif name == "unfix":
            session.unfix(sphere=ball)
        elif name == "tool":
            session.move_tool("ball", point, over=0.01)
        elif name == "jaws":
            session.close_jaws("ball")

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
