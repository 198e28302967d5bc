"""Smooth the rough edge that bites have left in a meniscus, and take little of what is healthy."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from .. import Session
from ._meniscus import MIDDLE, at_rim, border_of, inner_rim, meniscus_scene
from ._tasks import Tasks
from ._vectors import lengths_of

__all__ = ["Debride"]

MARKS = 12  # places of the cut edge that are seen
STEP = 0.01  # s
REACH = 0.0005  # m: farthest move of an action along each axis
LEASH = 0.001  # m: the hand is no farther from the shaver along each axis
LOW, HIGH = (-0.012, 0.006), (0.012, 0.028)  # m: where the hand may be
DEPTH = 0.0015  # m: how far the window reaches to both sides of the middle surface
SHAFT, WINDOW = 0.0005, 0.0009  # m: radius of the shaver, and of its window
STIFFNESS = 1000.0  # N/m of the hand
COMES = 20  # steps in which the shaver comes to where the hand begins
SMOOTHING, REMOVAL = 15.0, 0.001  # 1/s, m/s
SPREAD = 0.7  # rad: to both sides of the middle of the rim, where the middle of the bites may be
SMOOTH = 0.2  # share of the roughness at which the edge is smooth
SPARED = 1e-9  # m3: healthy tissue that may go
ON_RIM = 1e-5  # m: an edge that is nearer to the uncut border is a part of it
UNIT = 1e-9  # m3
WELD = np.array([1.0, 3.0 ** 0.5, 5.0 ** 0.5])  # what is at one place is one vertex
STANDOFF, NEAR = 0.0008, 0.0014  # m: from the edge to the hand of the expert, and to a shaver that it lets run


class Debride(Tasks):
    """Two bites of a rough punch have left a jagged edge in the inner rim of a meniscus. Smooth it with a shaver.

    Action (3): how far the hand that leads the upright shaver goes along x and y, in parts of 0.5 mm, and whether the shaver runs
    (above 0). The shaver follows the hand on a spring of 1000 N/m, touches the meniscus and pushes it aside; the hand is never farther
    than 1 mm ahead of it along each axis. Its window shaves where it is when the action begins: bumps go first, then the edge moves back.
    An action takes 4 steps of 10 ms.

    State (46), lengths in units of 5 mm: the shaver, seen from the middle of the inner rim's oval (2); the hand, seen from the shaver, in units of
    1 mm (2); the force on the shaver along x and y, N (2); 12 places evenly along the cut edge as it is now, seen from the shaver (24); the roughness
    about each of them, in units of 0.1 mm (12); the roughness of the whole edge, in parts of that at the start (1); the healthy tissue that is gone,
    mm3 (1); whether the shaver ran (1); and time (1, 0 to 1).

    Reward: 10 for all the roughness, by parts; -1 for each mm3 of healthy tissue, bumps not counted; -0.02 for each newton that the shaver
    presses; -0.02 for each action; 2 when 20 % of the roughness are left. That or 120 actions end an episode.

    info: roughness (m), roughness_left (share), healthy_removed (m3), is_success (20 % of the roughness or less, and no more than 1 mm3 gone).
    """

    steps: ClassVar[int] = 4
    horizon: ClassVar[int] = 120
    action_size: ClassVar[int] = 3
    state_size: ClassVar[int] = 10 + 3 * MARKS
    camera: ClassVar[dict[str, Any]] = {"eye": (0, 0.046, 0.036), "target": (0, 0.0155, 0), "field_of_view": 0.42}

    def scene(self) -> dict[str, Any]:
        return {**meniscus_scene(STEP), "contact": {"self": False},
                "tool": [{"id": "shaver", "kind": "shaver", "position": [*MIDDLE, -DEPTH], "length": 0.06, "radius": SHAFT, "stiffness": STIFFNESS}]}

    def prepare(self) -> None:
        n, session = self.num_envs, self.sessions[0]
        self.rim = inner_rim(session)
        self.border = session.collision_rest_positions[:, :2][border_of(session.collision_triangles)]  # m, uncut: (k, 2, 2)
        self.hand, self.shaver, self.force = np.zeros((n, 2)), np.zeros((n, 2)), np.zeros((n, 2))
        self.runs = np.zeros(n, bool)
        self.version = np.full(n, -1, np.int64)  # of the topology that the edge was looked at
        self.edge = np.zeros((n, MARKS, 3))  # m, at rest
        self.away = np.zeros((n, MARKS, 2))  # unit vectors out of the tissue
        self.rough = np.zeros((n, MARKS))  # m, about each of these places
        self.now = np.zeros((n, MARKS, 3))  # m, as it is now
        self.roughness, self.at_first = np.zeros(n), np.ones(n)  # m
        self.mass = np.zeros(n)  # kg at the start
        self.healthy = np.zeros(n)  # m3 gone
        self.before = np.zeros((n, 2))  # share of the roughness and m3, before the last action

    def begin(self, row: int, random: np.random.Generator) -> None:
        session = self.sessions[row]
        angle, apart, roughness = -np.pi / 2 + random.uniform(-SPREAD, SPREAD), random.uniform(0.22, 0.3), random.uniform(0.0002, 0.0003)
        for side in (-0.5, 0.5):
            place = at_rim(self.rim, angle + side * apart, random.uniform(0, 0.0004))
            session.punch([*place, 0], random.uniform(0.0016, 0.0019), roughness=roughness, take=True)
        self.hand[row] = at_rim(self.rim, angle + random.uniform(-0.4, 0.4), random.uniform(-0.0045, -0.003))
        session.move_tool("shaver", [*self.hand[row], -DEPTH])
        session.step(COMES)
        self.force[row] = self.healthy[row] = 0
        self.runs[row] = False
        self.mass[row] = session.piece_masses.sum()
        self.at_first[row] = session.roughness
        self._look_at_edge(row)
        self.before[row] = self.roughness[row] / self.at_first[row], 0

    def control(self, actions: NDArray[np.float64], plays: NDArray[np.bool_]) -> dict[str, Any]:
        moved = np.clip(self.hand + REACH * actions[:, :2], np.maximum(self.shaver - LEASH, LOW), np.minimum(self.shaver + LEASH, HIGH))
        self.hand = np.where(plays[:, None], moved, self.hand)
        self.runs = np.where(plays, actions[:, 2] > 0, self.runs)
        self.before[plays] = np.stack([self.roughness / self.at_first, self.healthy], axis=1)[plays]
        lasts = self.steps * STEP
        for row in np.flatnonzero(plays & self.runs):
            window = [[*self.shaver[row], DEPTH], [*self.shaver[row], -DEPTH]]
            self.sessions[row].shave([window, window], [0, lasts], WINDOW, smoothing=SMOOTHING, removal=REMOVAL)
        poses = np.zeros((self.num_envs, 6))
        poses[:, :2], poses[:, 2] = self.hand, -DEPTH
        return {"tools": {"shaver": poses}}

    def look(self, states: NDArray[np.float32], rows: NDArray[np.bool_]) -> None:
        tool = self.batch.tool("shaver")
        self.shaver[rows], self.force[rows] = tool["position"][rows, :2], tool["force"][rows, :2]
        for row in np.flatnonzero(rows):
            if self.sessions[row].topology_version != self.version[row]:
                self._look_at_edge(row)
        self.now[rows] = self.batch.to_world(self.edge)[rows]
        unit = 200.0  # of 5 mm
        state = np.concatenate([
            unit * (self.shaver - MIDDLE), 1e3 * (self.hand - self.shaver), self.force,
            unit * (self.now[..., :2] - self.shaver[:, None]).reshape(self.num_envs, -1), 1e4 * self.rough,
            np.stack([self.roughness / self.at_first, self.healthy / UNIT, self.runs, self.elapsed / self.horizon_now], axis=1)], axis=1)
        states[rows] = state[rows]

    def _look_at_edge(self, row: int) -> None:
        """Where the cut edge is and how rough, in places evenly along it."""
        session = self.sessions[row]
        self.version[row] = session.topology_version
        self.roughness[row] = session.roughness
        self.healthy[row] = max(0.0, (self.mass[row] - session.piece_masses.sum()) / session.material["density"])
        rest = session.collision_rest_positions
        edges = border_of(session.collision_triangles)
        edges = edges[_distances(rest[edges, :2].mean(axis=1), self.border) > ON_RIM]
        if not len(edges):
            self.rough[row] = 0
            return
        ends = rest[_along(edges)]
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        reached = length.cumsum()
        at = (np.arange(MARKS) + 0.5) / MARKS * reached[-1]
        which = np.minimum(np.searchsorted(reached, at), len(ends) - 1)
        part = 1 - (reached[which] - at) / length[which]
        way = ends[which, 1] - ends[which, 0]
        self.edge[row] = ends[which, 0] + part[:, None] * way
        self.away[row] = np.stack([way[:, 1], -way[:, 0]], axis=1) / length[which, None]
        wall, stray = _strays(session)
        nearest = ((wall[:, 0, None] - self.edge[row, :, 0]) ** 2 + (wall[:, 1, None] - self.edge[row, :, 1]) ** 2).argmin(axis=1)
        count = np.bincount(nearest, minlength=MARKS)
        self.rough[row] = np.sqrt(np.bincount(nearest, stray ** 2, minlength=MARKS) / np.maximum(count, 1))

    def judge(self, plays: NDArray[np.bool_]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        left = self.roughness / self.at_first
        smooth = left <= SMOOTH
        rewards = (10 * (self.before[:, 0] - left) - (self.healthy - self.before[:, 1]) / UNIT
                   - 0.02 * lengths_of(self.force) - 0.02 + 2 * smooth)
        return rewards, smooth

    def tell(self) -> dict[str, NDArray[Any]]:
        left = self.roughness / self.at_first
        return {"roughness": self.roughness, "roughness_left": left, "healthy_removed": self.healthy,
                "is_success": (left <= SMOOTH) & (self.healthy <= SPARED)}

    def expert(self) -> NDArray[np.float32]:
        """Goes to the nearest place of the edge that is rough, stays beside it, and lets the shaver run there until it is smooth."""
        away = lengths_of(self.now[..., :2] - self.shaver[:, None])
        jagged = self.rough > 0.5 * np.minimum(self.rough.max(axis=1, keepdims=True), self.at_first[:, None])
        goal = np.where(jagged, away, np.inf).argmin(axis=1)
        i = np.arange(self.num_envs)
        way = (self.now[i, goal, :2] + STANDOFF * self.away[i, goal] - self.hand) / REACH
        way /= np.maximum(np.abs(way).max(axis=1, keepdims=True), 1)
        return np.concatenate([way, np.where(away[i, goal] < NEAR, 1.0, -1.0)[:, None]], axis=1).astype(np.float32)

    def marked(self, row: int) -> NDArray[np.float64]:
        return self.now[row][self.rough[row] > SMOOTH * self.at_first[row]] + (0, 0, 0.001)


def _along(edges: NDArray[np.int64]) -> NDArray[np.int64]:
    """The same edges (k, 2), each after the one that ends where it begins."""
    after = {int(a): int(b) for a, b in edges}
    order = []
    for start in sorted(set(after) - set(after.values())) + sorted(after):
        at = start
        while at in after:
            order.append((at, after[at]))
            at = after.pop(at)
    return np.array(order)


def _strays(session: Session) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Inner vertices of the walls, which stand upright, seen from above (k, 2), and how far they stray from the walls' borders (k)."""
    rest, triangles = session.rest_positions, session.triangles[session.walls]
    _, first, number = np.unique(rest[triangles.ravel()] @ WELD, return_index=True, return_inverse=True)
    place = rest[triangles.ravel()[first], :2]
    border = border_of(number.reshape(-1, 3))
    inner = np.setdiff1d(np.arange(len(place)), border)
    return place[inner], _distances(place[inner], place[border])


def _distances(places: NDArray[np.float64], segments: NDArray[np.float64]) -> NDArray[np.float64]:
    """From places (k, 2) to the nearest of the segments (m, 2, 2): (k)."""
    (x, y), (u, v) = (segments[:, 1] - segments[:, 0]).T, (places[:, None] - segments[:, 0]).transpose(2, 0, 1)
    part = np.clip((u * x + v * y) / np.maximum(x * x + y * y, 1e-30), 0, 1)
    return np.sqrt(((u - part * x) ** 2 + (v - part * y) ** 2).min(axis=1))
