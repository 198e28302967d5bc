"""Cut a marked curve out of a gauze: the task "pattern cutting" of the Fundamentals of Laparoscopic Surgery."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ._gauze import SIDE, gauze_body
from ._pieces import area_of, areas_of, inside, pieces_of, way_between
from ._tasks import Tasks
from ._vectors import lengths_of

__all__ = ["PatternCut"]

MARKS = 256  # points of the curve
AHEAD = (0, 4, 8, 12)  # those that are seen, from where the cut has come to: about 2 mm apart
BEYOND = 64  # marks that a cut may go on past the first one, until it is closed
WINDOW = 10  # marks that one action may go along: 5 mm, more than a move is long
REACH = 0.004  # m: farthest move of an action along each axis
YOUNG, DENSITY = 2e4, 300.0  # Pa, kg/m3
ROUND = 243  # marks: the way round is done; the last ones may go with what comes out
CAME_OUT = 0.3  # overlap: below, what is loose are scraps of the cut
ACROSS = 0.003  # m: how far to both sides of the curve the expert cuts where it begins
EDGE = 0.03  # m: length of the blade's edge, tip to base
FALLEN = 0.06  # m: marks so low are on a scrap that falls
DEEP = 0.008  # m: how far under the gauze the expert leads the tip
LOW = 0.012  # m: the same under a thread, which hangs
PAST = 0.008  # m: how far it goes past a thread to both sides,
TURN = 5  # actions each
LATE = 90  # actions: who has come round and is not through by then has lost what is left
BELOW = 0.005  # m: where the tip does well to be under the gauze
TOLERANCE = 0.005  # m: a cut farther from the curve makes no headway
FARTHEST = 0.06  # m: of the tip from the middle of the gauze, along each axis


class PatternCut(Tasks):
    """Cut the marked closed curve out of a gauze of 10 cm x 10 cm that is held at its corners and sags.

    Action (3): how far the tip of an upright blade goes, along x, y and z, in parts of 4 mm. The blade cuts where its edge passes the
    gauze; it feels nothing. An action takes 2 steps of 25 ms.

    State (23), lengths in units of 1 cm: the tip (3); its place on the gauze at rest (2) and how high it is over that place (1); the next four
    marks of the curve as they are now, seen from the tip (12); how far the cut is off the curve (1); then headway (1, 0 to 1), whether
    a piece is out (1), whether the tip is below the gauze (1), and time (1, 0 to 1).

    Reward: 0.2 for each centimetre that the tip comes nearer to a place 5 mm below the next mark; 10 for the whole way round the curve, by parts, where the cut is within 5 mm of it; -0.02 for each action below the gauze and
    each 5 mm, at most three, that it is off the curve; -0.01 for each action; 5 at the end for the share of what came out and what was marked that is both.
    An episode ends when a piece is out and the way round is done; with -2 when the next mark has fallen; or after 150 actions.

    info: progress (0 to 1), deviation (m, mean while it cut), overlap (0 to 1, at the end), is_success (overlap of 0.8 or more).
    """

    steps: ClassVar[int] = 2
    horizon: ClassVar[int] = 150
    action_size: ClassVar[int] = 3
    state_size: ClassVar[int] = 23
    camera: ClassVar[dict[str, Any]] = {"eye": (0, -0.11, 0.16), "target": (0, 0, -0.01), "field_of_view": 0.6}

    def scene(self) -> dict[str, Any]:
        corner = SIDE / 2
        return {"body": {"bound": gauze_body()}, "lattice": {"cells": [9, 9, 1]},
                "material": {"young": YOUNG, "poisson": 0.3, "density": DENSITY, "damping_mass": 2.0},
                "simulation": {"time_step": 0.025, "tolerance": 0.05},
                "fix": [{"sphere": {"center": [x * corner, y * corner, 0], "radius": 0.012}} for x in (-1, 1) for y in (-1, 1)]}

    def prepare(self) -> None:
        self.batch.turn(80)  # it hangs still after two seconds
        n = self.num_envs
        self.rows = np.arange(n)[:, None]
        self.curve = np.zeros((n, MARKS, 3))
        self.outward = np.zeros((n, 2))  # m, at the first mark: how far the expert goes across the curve
        self.tip = np.zeros((n, 3))
        self.marks = np.zeros((n, len(AHEAD), 3))  # m, those ahead as they are now
        self.level = np.zeros(n)  # m, height of the gauze at the blade
        self.at = np.zeros(n, np.int64)  # mark that the cut has come to
        self.off = np.zeros(n)  # m, off the curve in the last action that cut
        self.below = np.zeros(n, bool)
        self.headway = np.zeros(n, np.int64)  # marks gained in the last action
        self.to_go, self.nearer = np.zeros(n), np.zeros(n)  # m, to below the next mark; how much less since the last action
        self.sum_off, self.cuts = np.zeros(n), np.zeros(n, np.int64)
        self.overlap = np.zeros(n)
        self.out = np.zeros(n, bool)
        self.pieces = np.ones(n, np.int64)  # as they were counted last
        self.stage = np.zeros(n, np.int64)  # of the expert: above, across, along

    def begin(self, row: int, random: np.random.Generator) -> None:
        angle = random.uniform(0, 2 * np.pi) + np.linspace(0, 2 * np.pi, MARKS, endpoint=False)
        wave = random.uniform(0, 0.08, 2)
        phase = random.uniform(0, 2 * np.pi, 2)
        radius = random.uniform(0.018, 0.025) * (1 + wave[0] * np.cos(2 * angle + phase[0]) + wave[1] * np.cos(3 * angle + phase[1]))
        self.curve[row, :, :2] = random.uniform(-0.006, 0.006, 2) + radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        outward = self.curve[row, 0, :2] - self.curve[row, :, :2].mean(axis=0)
        self.outward[row] = ACROSS / lengths_of(outward) * outward
        self.tip[row] = (*random.uniform(-0.03, 0.03, 2), 0.02)
        self.batch.place_blade(row, self.tip[row] + (0, 0, EDGE), self.tip[row])
        self.level[row] = 0
        self.at[row] = self.stage[row] = self.headway[row] = self.cuts[row] = 0
        self.off[row] = self.sum_off[row] = self.overlap[row] = 0
        self.out[row] = self.below[row] = False
        self.pieces[row] = 1

    def control(self, actions: NDArray[np.float64], plays: NDArray[np.bool_]) -> dict[str, Any]:
        moved = np.clip(self.tip + REACH * actions, (-FARTHEST, -FARTHEST, -0.04), (FARTHEST, FARTHEST, 0.04))
        self.tip = np.where(plays[:, None], moved, self.tip)
        return {"blade": np.stack([self.tip + (0, 0, EDGE), self.tip], axis=1)}

    def look(self, states: NDArray[np.float32], rows: NDArray[np.bool_]) -> None:
        # Where the upright edge passes the gauze: looked for at the height at which it did last.
        place, _ = self.batch.to_rest(np.concatenate([self.tip[:, :2], self.level[:, None]], axis=1)[:, None])
        ahead = (self.at[:, None] + AHEAD) % MARKS
        seen = self.batch.to_world(np.concatenate([place, self.curve[self.rows, ahead]], axis=1))
        self.level[rows] = seen[rows, 0, 2]
        self.marks[rows] = seen[rows, 1:]
        self.below[rows] = self.tip[rows, 2] < self.level[rows]
        self._go_along(place[:, 0, :2], rows)
        to_go = np.minimum(lengths_of(self.marks[:, 0] - (0, 0, BELOW) - self.tip), FARTHEST)
        # What is left of the way to the mark that was next; a mark that has just become the next one starts anew.
        self.nearer[rows] = np.where(self.headway > 0, 0, self.to_go - to_go)[rows]
        self.to_go[rows] = to_go[rows]
        cm = 100.0
        state = np.concatenate([
            cm * self.tip, cm * place[:, 0, :2], cm * (self.tip[:, 2] - self.level)[:, None],
            cm * (self.marks - self.tip[:, None]).reshape(self.num_envs, -1),
            np.stack([cm * self.off, np.minimum(self.at / MARKS, 1), self.out, self.below, self.elapsed / self.horizon_now], axis=1)], axis=1)
        states[rows] = state[rows]

    def _go_along(self, place: NDArray[np.float64], rows: NDArray[np.bool_]) -> None:
        """Headway and deviation of these copies, whose blades pass the gauze at these places (n, 2) at rest."""
        x, y = (self.curve[..., i] - place[:, i, None] for i in range(2))
        away = np.sqrt(x * x + y * y)
        window = np.minimum(self.at[:, None] + np.arange(WINDOW + 1), MARKS + BEYOND)
        near = away[self.rows, window % MARKS]
        best = near.argmin(axis=1)
        good = self.below & (near.min(axis=1) < TOLERANCE)
        at = np.minimum(self.at + np.where(good, best, 0), MARKS + BEYOND)
        self.headway[rows] = (np.minimum(at, MARKS) - np.minimum(self.at, MARKS))[rows]
        self.at[rows] = at[rows]
        self.off[rows] = np.where(self.below, away.min(axis=1), 0)[rows]

    def judge(self, plays: NDArray[np.bool_]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        cut = plays & self.below
        self.sum_off += np.where(cut, self.off, 0)
        self.cuts += cut
        rewards = 20 * self.nearer + 10 * self.headway / MARKS - 0.01 - 0.02 * np.minimum(self.off / TOLERANCE, 3) * self.below
        ended = np.zeros(self.num_envs, bool)
        for row in np.flatnonzero(plays & (self.at >= ROUND)):
            pieces = self.sessions[row].counts["pieces"]
            if pieces == self.pieces[row]:
                continue
            self.pieces[row] = pieces
            self.overlap[row] = self._overlap(row)
            if self.overlap[row] < CAME_OUT:
                continue
            self.out[row] = ended[row] = True
            rewards[row] += 5 * self.overlap[row]
        fallen = plays & ~ended & (self.marks[:, 0, 2] < -FALLEN)
        rewards[fallen] -= 2
        ended |= fallen
        return rewards, ended

    def _overlap(self, row: int) -> float:
        """Area of what came out and what was marked: the share of the union that is both. Triangles at the curve count whole, by their middle."""
        session, curve = self.sessions[row], self.curve[row, :, :2]
        triangles, rest = session.collision_triangles, session.collision_rest_positions[:, :2]
        corners = rest[triangles]
        areas, piece = areas_of(corners), pieces_of(triangles, len(rest))
        within = areas * inside(curve, corners.mean(axis=1))
        rim = np.abs(corners).max(axis=(1, 2)) > 0.49 * SIDE
        marked, best = area_of(curve), 0.0
        for number in np.setdiff1d(piece, piece[rim]):  # what reaches the rim did not come out
            came, both = areas[piece == number].sum(), within[piece == number].sum()
            best = max(best, float(both / (marked + came - both)))
        return best

    def blade(self, row: int) -> NDArray[np.float64]:
        return np.stack([self.tip[row] + (0, 0, EDGE), self.tip[row]])

    def marked(self, row: int) -> NDArray[np.float64]:
        return self.sessions[row].to_world(self.curve[row])

    def tell(self) -> dict[str, NDArray[Any]]:
        return {"progress": np.minimum(self.at / MARKS, 1), "deviation": self.sum_off / np.maximum(self.cuts, 1), "overlap": self.overlap,
                "is_success": self.overlap >= 0.8}

    def expert(self) -> NDArray[np.float32]:
        """Sinks in beside the first mark, cuts across the curve there, then follows the marks 4 mm ahead until it comes to that cut. Where that
        has left a thread it looks for it in the mesh, and goes to and fro across it."""
        aims = np.stack([self.marks[:, 0], self.marks[:, 0], self.marks[:, 2]])
        aims[0, :, :2] -= self.outward
        aims[1, :, :2] += self.outward
        aim = aims[self.stage, self.rows[:, 0]]
        near = lengths_of(aim[:, :2] - self.tip[:, :2]) < 0.0005
        self.stage = np.minimum(self.stage + (near & self.below), 2)
        thread = (self.at >= MARKS + BEYOND // 4) | (self.at >= ROUND) & (self.elapsed > LATE)
        aim[:, 2] = self.marks[:, 0, 2] + np.where((self.stage > 0) | near, -DEEP, 0.01)
        for row in np.flatnonzero(thread):
            aim[row] = self._across_thread(int(row))
        action = (aim - self.tip) / REACH
        action[(self.stage == 0) & near, :2] = 0
        action[:, :2] /= np.maximum(np.abs(action[:, :2]).max(axis=1, keepdims=True), 1)
        return np.clip(action, -1, 1).astype(np.float32)

    def _across_thread(self, row: int) -> NDArray[np.float64]:
        """To and fro across what the piece still hangs by: where the tip goes. Where that is not found, it stays."""
        session, curve = self.sessions[row], self.curve[row]
        triangles, rest = session.collision_triangles, session.collision_rest_positions
        corners = rest[triangles][..., :2]
        middles = corners.mean(axis=1)
        way = way_between(triangles, int(np.linalg.norm(middles - curve[:, :2].mean(axis=0), axis=1).argmin()),
                          np.abs(corners).max(axis=(1, 2)) > 0.49 * SIDE)
        within = inside(curve[:, :2], middles[way])
        if not within.any():
            return self.tip[row]
        last = np.flatnonzero(within)[-1]
        place = np.append(middles[way[last : last + 2]].mean(axis=0), 0)
        mark = np.linalg.norm(curve - place, axis=1).argmin()
        along = curve[(mark + 1) % MARKS] - curve[mark - 1]
        side = 1 if self.elapsed[row] // TURN % 2 else -1
        return session.to_world(place[None])[0] + side * PAST / np.linalg.norm(along) * along - (0, 0, LOW)
