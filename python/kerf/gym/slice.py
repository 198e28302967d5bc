"""Cut a slab on a board into equal slices, with a knife that feels what it cuts."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ._pieces import pieces_of
from ._slab import DENSITY, LENGTH, THICKNESS, half_width, slab_body
from ._tasks import Tasks
from ._vectors import lengths_of

__all__ = ["Slice"]

MOST = 4  # slices
SLANT = 0.25  # rad: steepest line, against y
YOUNG = 6e4  # Pa
RESISTANCE = 15.0  # N per metre of edge: the board's friction holds the slab against it
STIFFNESS = 300.0  # N/m of the hand: the knife lags by a millimetre where it cuts
STEP = 0.02  # s
UNIT = 0.02  # m, of the state
REACH, TURN = 0.005, 0.06  # m and rad: farthest move of an action
NEAREST, FARTHEST = (-0.09, -0.065, -0.013), (0.09, 0.065, 0.04)  # m: of the pose
MOST_TURNED = 0.5  # rad
UP, DOWN = 0.018, -0.012  # m: the expert's tip on its way, and where it cuts
BESIDE = 0.006  # m: how far off the rim the expert goes down, and comes out
SCRAP = 0.02  # of the whole mass: a lighter piece is no slice
SAMPLES = 0.0005  # m: grid of places that lines are found by


class Slice(Tasks):
    """Cut a slab of 14 cm x 6 cm x 14 mm, on a board, into 2, 3 or 4 slices of equal mass along the marked lines.

    Action (4): how far the hand goes along x, y and z, in parts of 5 mm, and how far it turns the knife about the vertical, in parts of
    0.06 rad. The knife hangs on the hand by springs and is heavy; its edge is upright and faces along y. It feels 15 N for each metre of
    edge in the meat while it cuts, what its flanks and its tip touch, but not the board. Friction alone holds the slab. An action takes
    2 steps of 20 ms.

    State (24), lengths in units of 2 cm: tip of the knife (3) and its turn (1, rad); how far the hand is ahead of it (3, mm); force on it
    (3, N); near, middle and far end of the next line as they are now, seen from the tip (9), and the line's turn (1, rad); lines to be
    cut yet (1), pieces (1), evenness (1, 0 to 1), and time (1, 0 to 1).

    Evenness: the share of the mass that is in the heaviest k pieces, each counted up to 1/k: 1/k at the start, 1 if all slices are equal.
    Reward: 10 for evenness from 1/k to 1, by parts; -0.01 for each newton of force on the knife in an action, at most 5; -0.01 for each
    action; 2 at the end if evenness is 0.95 or more. An episode ends when there are k slices, scraps of less than 2 % apart, or after 240 actions.

    info: slices, wanted, evenness (0 to 1), force (N, counted up to 5, mean over the episode), is_success (k slices and an evenness of 0.95 or more).
    """

    steps: ClassVar[int] = 2
    horizon: ClassVar[int] = 240
    action_size: ClassVar[int] = 4
    state_size: ClassVar[int] = 24
    variety: ClassVar[dict[str, float]] = {"young": 1.0, "density": 0.25}
    camera: ClassVar[dict[str, Any]] = {"eye": (0, -0.17, 0.21), "target": (0, -0.005, 0), "field_of_view": 0.6}

    def scene(self) -> dict[str, Any]:
        return {"body": {"bound": slab_body()}, "lattice": {"cells": [8, 4, 1]},
                "material": {"young": YOUNG, "poisson": 0.4, "density": DENSITY, "damping_mass": 2.0},
                "simulation": {"time_step": STEP, "tolerance": 0.02}, "cut": {"resistance": RESISTANCE},
                "obstacle": [{"name": "board", "shape": "box", "size": [0.24, 0.16, 0.02], "position": [0, 0, -THICKNESS / 2 - 0.0102],
                              "friction": 0.9}],
                "tool": [{"id": "knife", "kind": "scalpel", "position": [0, -0.055, 0.03], "rotation": [0, 0, np.pi / 2], "tip": 0.04,
                          "width": 0.015, "thickness": 0.001, "radius": 0.004, "length": 0.06, "stiffness": STIFFNESS,
                          "max_force": 20.0, "max_speed": 1.0}]}

    def prepare(self) -> None:
        self.batch.turn(25)  # it lies still after half a second
        n = self.num_envs
        side = np.arange(-LENGTH / 2, LENGTH / 2, SAMPLES) + SAMPLES / 2
        grid = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
        self.inside = grid[np.abs(grid[:, 1]) < half_width(grid[:, 0])]  # evenly spread over the slab
        self.hand = np.zeros((n, 4))  # m and rad
        self.wanted = np.full(n, 2)
        self.lines = np.zeros((n, MOST - 1, 3, 3))  # m, at rest: near end, middle, far end; those beyond wanted - 1 are none
        self.middles = np.zeros((n, MOST, 3))  # m, at rest: of the slices
        self.cut = np.zeros((n, MOST - 1), bool)
        self.line = np.zeros((n, 3, 3))  # m, the next one as it is now
        self.tip, self.turned = np.zeros((n, 3)), np.zeros(n)
        self.force = np.zeros((n, 3))
        self.pieces, self.slices = np.ones(n, np.int64), np.ones(n, np.int64)
        self.evenness, self.gain, self.sum_force = np.zeros(n), np.zeros(n), np.zeros(n)
        self.stage = np.zeros(n, np.int64)  # of the expert: over the line, down, through, up
        self.drawn = np.zeros(n, np.int64)  # lines cut when the expert began this one

    def begin(self, row: int, random: np.random.Generator) -> None:
        k = int(random.integers(2, MOST + 1))
        slant = random.uniform(-SLANT, SLANT)
        self.wanted[row] = k
        self._mark(row, k, slant)
        self.hand[row] = (random.uniform(-0.07, 0.07), random.uniform(-0.06, -0.045), random.uniform(0.015, 0.03), random.uniform(-0.2, 0.2))
        session = self.sessions[row]
        session.move_tool("knife", self.hand[row, :3], [0, 0, np.pi / 2 + self.hand[row, 3]])
        session.step(20)  # the knife is there
        self.cut[row] = False
        self.pieces[row] = self.slices[row] = 1
        self.evenness[row] = 1 / k
        self.gain[row] = self.sum_force[row] = self.stage[row] = self.drawn[row] = 0

    def _mark(self, row: int, k: int, slant: float) -> None:
        """Parallel lines that part the slab into k parts of equal area."""
        along, across = np.array([-np.sin(slant), np.cos(slant)]), np.array([np.cos(slant), np.sin(slant)])
        place = np.sort(self.inside @ across)
        bounds = place[[len(place) * i // k for i in range(1, k)]]
        way = np.linspace(-0.05, 0.05, 401)
        for i, bound in enumerate(bounds):
            points = bound * across + way[:, None] * along
            points = points[np.abs(points[:, 1]) < half_width(points[:, 0])]
            self.lines[row, i, :, :2] = points[0], points.mean(axis=0), points[-1]
        part = np.searchsorted(bounds, self.inside @ across)
        for i in range(k):
            self.middles[row, i, :2] = self.inside[part == i].mean(axis=0)

    def control(self, actions: NDArray[np.float64], plays: NDArray[np.bool_]) -> dict[str, Any]:
        moved = np.clip(self.hand + actions * (REACH, REACH, REACH, TURN), (*NEAREST, -MOST_TURNED), (*FARTHEST, MOST_TURNED))
        self.hand = np.where(plays[:, None], moved, self.hand)
        poses = np.zeros((self.num_envs, 6))
        poses[:, :3], poses[:, 5] = self.hand[:, :3], np.pi / 2 + self.hand[:, 3]
        return {"tools": {"knife": poses}}

    def look(self, states: NDArray[np.float32], rows: NDArray[np.bool_]) -> None:
        knife, pieces = self.batch.tool("knife"), self.batch.counts["pieces"]
        self.tip[rows], self.force[rows] = knife["position"][rows], knife["force"][rows]
        self.turned[rows] = np.arctan2(-knife["axes"][rows, 0, 0], knife["axes"][rows, 1, 0])
        self.gain[rows] = 0
        for row in np.flatnonzero(rows & (pieces != self.pieces)):
            self._count(int(row), int(pieces[row]))
        following = self._next()
        rest = np.take_along_axis(self.lines, following[:, None, None, None], axis=1)[:, 0]
        self.line[rows] = self.batch.to_world(rest)[rows]
        left = self.wanted - 1 - self.cut.sum(axis=1)
        state = np.concatenate([
            self.tip / UNIT, self.turned[:, None], 1000 * (self.hand[:, :3] - self.tip), self.force,
            (self.line - self.tip[:, None]).reshape(self.num_envs, -1) / UNIT,
            np.stack([self._slant(), left, self.pieces, self.evenness, self.elapsed / self.horizon_now], axis=1)], axis=1)
        states[rows] = state[rows]

    def _count(self, row: int, pieces: int) -> None:
        """What has been parted in one copy."""
        session = self.sessions[row]
        self.pieces[row] = pieces
        share = np.minimum(session.piece_masses / session.uncut_mass, 1)
        k = self.wanted[row]
        before, self.evenness[row] = self.evenness[row], np.minimum(share[:k], 1 / k).sum()
        self.gain[row] = self.evenness[row] - before
        self.slices[row] = (share > SCRAP).sum()
        piece = pieces_of(session.collision_triangles, len(session.collision_rest_positions))
        middle = session.collision_rest_positions[session.collision_triangles].mean(axis=1)
        of = [piece[np.linalg.norm(middle - self.middles[row, i], axis=1).argmin()] for i in range(k)]
        self.cut[row, :k - 1] = np.not_equal(of[1:], of[:-1])

    def _next(self) -> NDArray[np.int64]:
        """The first line that is not cut; the last one if all are."""
        open_ = ~self.cut & (np.arange(MOST - 1) < self.wanted[:, None] - 1)
        return np.where(open_.any(axis=1), open_.argmax(axis=1), self.wanted - 2)

    def _slant(self) -> NDArray[np.float64]:
        way = self.line[:, 2] - self.line[:, 0]
        return np.arctan2(-way[:, 0], way[:, 1])

    def judge(self, plays: NDArray[np.bool_]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        felt = np.minimum(lengths_of(self.force), 5)
        self.sum_force += np.where(plays, felt, 0)
        ended = plays & (self.slices >= self.wanted)
        gain = 10 * self.gain / (1 - 1 / self.wanted)
        return gain - 0.01 * felt - 0.01 + 2 * (ended & (self.evenness >= 0.95)), ended

    def marked(self, row: int) -> NDArray[np.float64]:
        ends = self.lines[row, :self.wanted[row] - 1][~self.cut[row, :self.wanted[row] - 1]]
        places = ends[:, None, 0] + np.linspace(0, 1, 120)[:, None] * (ends[:, None, 2] - ends[:, None, 0])
        return self.sessions[row].to_world(places.reshape(-1, 3)) + (0, 0, THICKNESS / 2)

    def tell(self) -> dict[str, NDArray[Any]]:
        return {"slices": self.slices, "wanted": self.wanted, "evenness": self.evenness, "force": self.sum_force / np.maximum(self.elapsed, 1),
                "is_success": (self.slices >= self.wanted) & (self.evenness >= 0.95)}

    def expert(self) -> NDArray[np.float32]:
        """Comes over the near end of the next line, goes down beside the rim, draws through along the line, and lifts the knife."""
        done = self.cut.sum(axis=1)
        near, far, slant = self.line[:, 0], self.line[:, 2], self._slant()
        way = np.stack([-np.sin(slant), np.cos(slant)], axis=1)
        start = near[:, :2] - BESIDE * way
        passed = ((self.tip - far)[:, :2] * way).sum(axis=1)
        low = self.tip[:, 2] < DOWN + 0.002
        there = (np.abs(self.tip[:, :2] - start).max(axis=1) < 0.0007) & (np.abs(self.turned - slant) < 0.02)
        go = np.stack([there, low, (done != self.drawn) | (passed > BESIDE), self.tip[:, 2] > UP - 0.003])
        self.stage = (self.stage + np.take_along_axis(go, self.stage[None], axis=0)[0]) % 4
        self.drawn = np.where(self.stage < 2, done, self.drawn)
        along = ((self.hand[:, :2] - near[:, :2]) * way).sum(axis=1) + 0.8 * REACH
        aims = np.stack([start, start, near[:, :2] + along[:, None] * way, self.hand[:, :2]])
        aim = np.take_along_axis(aims, self.stage[None, :, None], axis=0)[0]
        height = np.where(np.isin(self.stage, (1, 2)), DOWN, UP)
        behind = (self.stage == 0) & (self.tip[:, 2] < UP - 0.004)  # not across the slab before it is over it
        action = np.concatenate([(aim - self.hand[:, :2]) / REACH, ((height - self.hand[:, 2]) / REACH)[:, None],
                                 ((slant - self.hand[:, 3]) / TURN)[:, None]], axis=1)
        action[behind, :2] = 0
        action[self.stage == 3, 3] = 0
        return np.clip(action, -1, 1).astype(np.float32)
