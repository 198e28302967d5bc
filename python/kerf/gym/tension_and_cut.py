"""Pull a hanging gauze taut with one arm and cut it along a marked line with the other: traction and counter-traction."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ._gauze import SIDE, gauze_body
from ._tasks import Tasks
from ._vectors import lengths_of

__all__ = ["TensionAndCut"]

MARKS = 201  # points of the line, 0.5 mm apart across the gauze
AHEAD = (0, 4, 8, 12)  # those that are seen, from where the cut has come to
WINDOW = 13  # marks that one action may go along: more than a move is long
LEFT_OUT = 2  # marks: a cut that begins farther on makes no headway
MEASURED = 8  # marks ahead of the cut: where stretch is measured, off its lips
TAUT = 1.03  # stretch from which the blade cuts; its weight alone stretches the gauze to 1.01
SLACK = 0.9  # stretch from which pulling is rewarded
LIMIT = 0.8  # N: a harder pull costs
YOUNG, DENSITY = 2e4, 300.0  # Pa, kg/m3
HOLD = 0.015  # m: the grasp holds the rim so far to both sides
STIFFNESS = 300.0  # N/m of the grasp
REACH = 0.004  # m: farthest move of an action along each axis
EDGE = 0.03  # m: length of the blade's edge, tip to base
TOLERANCE = 0.005  # m: a cut farther from the line makes no headway
CROSS = 0.005  # m: arms of the cross that pictures show where the grasp is led
PARTED = 0.2  # of the mass: a lighter piece is a scrap
ALL = 0.9  # of the line: the last action may part more than it makes headway
NEAREST, FARTHEST = (0.0, -0.04, -0.05), (0.09, 0.04, 0.03)  # m: of the grasp


class TensionAndCut(Tasks):
    """Cut a gauze of 10 cm x 10 cm in two along the marked line. It is held at one side and hangs: the blade cuts only what is taut.

    Action (6): how far the grasp at the middle of the free side is led along x, y and z, then how far the tip of an upright blade goes, in
    parts of 4 mm. The blade cuts where its edge passes the gauze and feels nothing; where the stretch was below 1.03 before the action, it
    passes without a cut. An action takes 2 steps of 25 ms.

    Stretch: how long the way is from the side that is held straight to the line, 4 mm ahead of the cut, and on to the grasp, against the
    same way at rest. A gauze that hangs through has less than 1.

    State (31), lengths in units of 1 cm: where the grasp is led (3), where it holds the gauze from there (3, mm) and its force on the
    gauze (3, N); stretch (1, in tenths beyond 1); the tip of the blade (3); its place on the gauze at rest (2) and how high it is over that
    place (1); the next four marks as they are now, seen from the tip (12); how far the cut is off the line (1); then headway (1, 0 to 1)
    and time (1, 0 to 1).

    Reward: 10 for the whole line, by parts, where the blade cuts within 5 mm of it and leaves nothing out; 1 for stretch from 0.9 to 1.03,
    by parts, once; -0.02 for each action that cuts and each 5 mm, at most three, that it is off the line; -0.05 for each action and each
    0.8 N, at most three, that the grasp pulls harder than 0.8 N; -0.01 for each action; when the gauze is in two, scraps of less than a
    fifth apart, 3 times the headway. An episode ends then, or after 200 actions.

    info: progress (0 to 1), deviation (m, mean while it cut), stretch, tension (N, of the grasp), strained (share of the actions beyond
    0.8 N), is_success (in two, nine tenths of the line, and a mean deviation below 2 mm).
    """

    steps: ClassVar[int] = 2
    horizon: ClassVar[int] = 200
    action_size: ClassVar[int] = 6
    state_size: ClassVar[int] = 31
    camera: ClassVar[dict[str, Any]] = {"eye": (0.05, -0.17, 0.16), "target": (0.005, 0, -0.01), "field_of_view": 0.6}

    def scene(self) -> dict[str, Any]:
        return {"body": {"bound": gauze_body()}, "lattice": {"cells": [9, 9, 1]},
                "material": {"young": YOUNG, "poisson": 0.3, "density": DENSITY, "damping_mass": 2.0},
                "simulation": {"time_step": 0.025, "tolerance": 0.02},
                "fix": [{"half_space": {"point": [-SIDE / 2 + 0.006, 0, 0], "normal": [-1, 0, 0]}}]}

    def prepare(self) -> None:
        for session in self.sessions:
            session.grasp("hand", [SIDE / 2, 0, 0], radius=HOLD, stiffness=STIFFNESS)
        self.grip = np.array(self.sessions[0].grasps[0]["held"])  # m, at rest
        n = self.num_envs
        self.hand = np.tile((0.035, 0.0, -0.01), (n, 1))
        self.batch.turn(20, grasps={"hand": self.hand})
        self.batch.turn(60, grasps={"hand": self.hand})  # it hangs still
        self.held, self.force = np.zeros((n, 3)), np.zeros((n, 3))
        self.curve = np.zeros((n, MARKS, 3))
        self.curve[..., 1] = np.linspace(-SIDE / 2, SIDE / 2, MARKS)
        self.tip = np.zeros((n, 3))
        self.marks = np.zeros((n, len(AHEAD), 3))  # m, those ahead as they are now
        self.level = np.zeros(n)  # m, height of the gauze at the blade
        self.stretch = np.zeros(n)
        self.taut = np.zeros((n,), bool)
        self.pulled, self.gained = np.zeros(n), np.zeros(n)  # part of the way to taut so far, and in the last action
        self.fresh = np.ones(n, bool)  # nothing has been measured in this episode
        self.at = np.zeros(n, np.int64)  # mark that the cut has come to
        self.beside = np.zeros(n, np.int64)  # mark that the blade is beside
        self.off = np.zeros(n)  # m, off the line in the last action that cut
        self.cutting = np.zeros(n, bool)
        self.headway = np.zeros(n, np.int64)  # marks gained in the last action
        self.sum_off, self.cuts, self.strained = np.zeros(n), np.zeros(n, np.int64), np.zeros(n, np.int64)
        self.parted = np.zeros(n, bool)
        self.stage = np.zeros(n, np.int64)  # of the expert's blade: over the rim, along, up
        self.goal = np.zeros(n, np.int64)  # mark that it has come to

    def begin(self, row: int, random: np.random.Generator) -> None:
        along = np.linspace(0, 1, MARKS)
        wave, phase = random.uniform(-0.004, 0.004, 2), random.uniform(0, 2 * np.pi, 2)
        self.curve[row, :, 0] = (random.uniform(-0.01, 0.015) + random.uniform(-0.008, 0.008) * (along - 0.5) +
                                 wave[0] * np.sin(np.pi * along + phase[0]) + wave[1] * np.sin(2 * np.pi * along + phase[1]))
        session = self.sessions[row]
        self.hand[row] = (random.uniform(0.02, 0.038), random.uniform(-0.01, 0.01), random.uniform(-0.02, 0.0))
        session.move("hand", to=self.hand[row], over=0.5)
        session.step(40)  # it hangs still enough
        self.tip[row] = (random.uniform(-0.02, 0.04), random.uniform(-0.06, -0.04), random.uniform(0.01, 0.025))
        self.batch.place_blade(row, self.tip[row] + (0, 0, EDGE), self.tip[row])
        self.level[row] = -0.01
        self.at[row] = self.beside[row] = self.headway[row] = self.cuts[row] = self.strained[row] = self.stage[row] = self.goal[row] = 0
        self.off[row] = self.sum_off[row] = self.gained[row] = 0
        self.pulled[row] = 1  # until it has been measured
        self.parted[row] = self.cutting[row] = False
        self.fresh[row] = True

    def control(self, actions: NDArray[np.float64], plays: NDArray[np.bool_]) -> dict[str, Any]:
        hand = np.clip(self.hand + REACH * actions[:, :3], NEAREST, FARTHEST)
        tip = np.clip(self.tip + REACH * actions[:, 3:], (-0.04, -0.06, -0.05), (0.06, 0.06, 0.03))
        self.hand = np.where(plays[:, None], hand, self.hand)
        self.tip = np.where(plays[:, None], tip, self.tip)
        return {"grasps": {"hand": self.hand}, "blade": np.stack([self.tip + (0, 0, EDGE), self.tip], axis=1), "cuts": self.taut.copy()}

    def look(self, states: NDArray[np.float32], rows: NDArray[np.bool_]) -> None:
        hold = self.batch.grasp("hand")
        self.held[rows], self.force[rows] = hold["held"][rows], hold["force"][rows]
        # Where the upright edge passes the gauze: looked for at the height at which it did last.
        place, _ = self.batch.to_rest(np.concatenate([self.tip[:, :2], self.level[:, None]], axis=1)[:, None])
        self._go_along(place[:, 0, :2], rows)
        over = self._marks_at((MEASURED,))
        seen = self.batch.to_world(np.concatenate([place, self._marks_at(AHEAD), over], axis=1))
        self.level[rows] = seen[rows, 0, 2]
        self.marks[rows] = seen[rows, 1:-1]
        side = over[:, 0] * (0, 1, 1) - (SIDE / 2, 0, 0)
        self.stretch[rows] = (_way(side, seen[:, -1], self.held) / _way(side, over[:, 0], self.grip))[rows]
        self.taut[rows] = self.stretch[rows] >= TAUT
        part = np.clip((self.stretch - SLACK) / (TAUT - SLACK), 0, 1)
        self.gained[rows] = np.where(self.fresh, 0, np.maximum(part - self.pulled, 0))[rows]
        self.pulled[rows] = np.where(self.fresh, part, np.maximum(part, self.pulled))[rows]
        self.fresh[rows] = False
        cm = 100.0
        state = np.concatenate([
            cm * self.hand, 10 * cm * (self.held - self.hand), self.force, 10 * (self.stretch - 1)[:, None], cm * self.tip,
            cm * place[:, 0, :2], cm * (self.tip[:, 2] - self.level)[:, None],
            cm * (self.marks - self.tip[:, None]).reshape(self.num_envs, -1),
            np.stack([cm * self.off, self.at / (MARKS - 1), self.elapsed / self.horizon_now], axis=1)], axis=1)
        states[rows] = state[rows]

    def _marks_at(self, ahead: tuple[int, ...]) -> NDArray[np.float64]:
        """Marks so far ahead of the cut, at rest: (n, k, 3)."""
        return np.take_along_axis(self.curve, np.minimum(self.at[:, None] + ahead, MARKS - 1)[..., None], axis=1)

    def _go_along(self, place: NDArray[np.float64], rows: NDArray[np.bool_]) -> None:
        """Headway and deviation of these copies, whose blades pass the gauze at these places (n, 2) at rest."""
        away = lengths_of(self.curve[..., :2] - place[:, None])
        beside, off = away.argmin(axis=1), away.min(axis=1)
        cutting = self.taut & (self.tip[:, 2] < self.level) & ~self.fresh
        gain = np.where(cutting & (off < TOLERANCE) & (self.beside <= self.at + LEFT_OUT), beside - self.at, 0)
        gain[(gain < 0) | (gain > WINDOW)] = 0
        self.headway[rows] = gain[rows]
        self.at[rows] += gain[rows]
        self.off[rows] = np.where(cutting, off, 0)[rows]
        self.cutting[rows] = cutting[rows]
        self.beside[rows] = beside[rows]

    def judge(self, plays: NDArray[np.bool_]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        inside = self.cutting & (self.at > 0)
        self.sum_off += np.where(plays & inside, self.off, 0)
        self.cuts += plays & inside
        beyond = np.maximum(lengths_of(self.force) / LIMIT - 1, 0)
        self.strained += plays & (beyond > 0)
        for row in np.flatnonzero(plays & self.cutting):
            session = self.sessions[row]
            self.parted[row] = session.counts["pieces"] > 1 and session.piece_masses[1] > PARTED * session.uncut_mass
        ended = plays & self.parted
        rewards = (10 * self.headway / (MARKS - 1) + self.gained - 0.01 - 0.02 * np.minimum(self.off / TOLERANCE, 3)
                   - 0.05 * np.minimum(beyond, 3) + 3 * ended * self.at / (MARKS - 1))
        return rewards, ended

    def blade(self, row: int) -> NDArray[np.float64]:
        return np.stack([self.tip[row] + (0, 0, EDGE), self.tip[row]])

    def marked(self, row: int) -> NDArray[np.float64]:
        cross = np.linspace(-CROSS, CROSS, 40)[:, None, None] * np.eye(3)
        return np.concatenate([self.sessions[row].to_world(self.curve[row]), self.hand[row] + cross.reshape(-1, 3)])

    def tell(self) -> dict[str, NDArray[Any]]:
        progress, deviation = self.at / (MARKS - 1), self.sum_off / np.maximum(self.cuts, 1)
        return {"progress": progress, "deviation": deviation, "stretch": self.stretch, "tension": lengths_of(self.force),
                "strained": self.strained / np.maximum(self.elapsed, 1),
                "is_success": self.parted & (progress >= ALL) & (deviation < 0.002)}

    def expert(self) -> NDArray[np.float32]:
        """Pulls until the stretch is 1.04, at most with 0.75 N; sinks in beside the rim and follows the marks while the gauze is taut.

        Where the gauze is not in two after that, a strand was left: the blade goes along the line once more.
        """
        pull = np.minimum(1.04 - self.stretch, (0.75 - lengths_of(self.force)) * 0.1)
        hand = np.stack([0.08 * pull, -self.hand[:, 1], -self.hand[:, 2]], axis=1)
        ahead = self.beside - self.goal
        along = (self.stage == 1) & (ahead > 0) & (ahead <= WINDOW)
        self.goal = np.where(along, self.beside, self.goal)
        wanted = np.minimum(self.goal[:, None] + (0, AHEAD[2], MARKS), MARKS - 1)
        mark, next_, last = self.batch.to_world(np.take_along_axis(self.curve, wanted[..., None], axis=1)).swapaxes(0, 1)
        start = mark - (0, 0.008, 0)
        near = lengths_of((start - self.tip)[:, :2]) < 0.001
        low, high = self.tip[:, 2] < mark[:, 2] - 0.004, self.tip[:, 2] > self.level + 0.008
        out = (self.goal >= MARKS - 1 - AHEAD[2]) & (self.tip[:, 1] > last[:, 1] + 0.006)
        go = np.stack([near & low & self.taut, out, high])
        self.stage = (self.stage + np.take_along_axis(go, self.stage[None], axis=0)[0]) % 3
        self.goal = np.where(self.stage == 2, 0, self.goal)
        beyond = np.where(self.goal >= MARKS - 1 - AHEAD[2], 0.008, 0)[:, None] * (0, 1, 0)
        aim = np.where((ahead > WINDOW)[:, None], mark - (0, 0.002, 0), next_ + beyond)
        aim = np.stack([start, aim, self.tip])[self.stage, np.arange(self.num_envs)]
        aim[:, 2] = np.where(self.stage == 2, self.level + 0.012, mark[:, 2] + np.where((self.stage == 1) | near, -0.01, 0.012))
        way = (aim - self.tip) / REACH
        way[:, :2] /= np.maximum(np.abs(way[:, :2]).max(axis=1, keepdims=True), 1)
        way[(self.stage == 1) & ~self.taut, :2] = 0
        return np.clip(np.concatenate([hand / REACH, way], axis=1), -1, 1).astype(np.float32)


def _way(*places: NDArray[np.float64]) -> NDArray[np.float64]:
    """How long the ways (n) are from place to place (n, 3)."""
    return sum(lengths_of(b - a) for a, b in zip(places[:-1], places[1:], strict=True))
