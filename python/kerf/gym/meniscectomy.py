"""Take a marked lesion out of a meniscus: partial meniscectomy with a basket punch."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from .. import Error
from ._meniscus import CELL, MIDDLE, ORIGIN, SHAPE, at_rim, column_middles, column_of, inner_rim, meniscus_scene, volumes
from ._tasks import Tasks
from ._vectors import lengths_of, squares_of

__all__ = ["Meniscectomy"]

RADIUS = 0.0016  # m: of the punch
REACH = 0.001  # m: farthest move of an action along each axis
LOW, HIGH = (-0.012, 0.008), (0.012, 0.028)  # m: where the punch may go
SPREAD = 0.8  # rad: to both sides of the middle of the rim, where a lesion's middle may be
SMALLEST, LARGEST = 0.0015, 0.0021  # m: radius of a lesion
LEFT = 0.05  # share of the lesion that may stay
SPARED = 1.0  # healthy tissue that may go, in volumes of the lesion
RUINED = 2.0  # healthy tissue, in volumes of the lesion, at which the episode is over; more does not count
AROUND = 2 * RADIUS  # m: a bite takes nothing that is farther along an axis
WINDOW = int(np.ceil(RADIUS / CELL))  # columns to each side of the punch that may lie within its radius
OUTLINE = np.linspace(0, 2 * np.pi, 33)
TRIES = np.stack(np.meshgrid(*2 * [np.linspace(-0.0016, 0.0016, 9)]), axis=-1).reshape(-1, 2)  # m: bites that the expert thinks of
ROUND = 0.97  # of the radius: within, a bite takes all, as its outline is a polygon
SPARING = 0.5  # what the expert gives for healthy tissue, in parts of what it gives for the lesion


class Meniscectomy(Tasks):
    """Bite a marked lesion out of the inner rim of a meniscus that is held by its outer wall and its horns, and spare the rest.

    Action (3): how far a round punch of 1.6 mm radius goes along x and y, in parts of 1 mm, and whether it bites there (above 0). What a
    bite cuts loose is gone. The joint is full of water, so nothing loads the body between bites. An action takes 2 steps of 20 ms.

    State (12), lengths in units of 5 mm, volumes in units of the lesion's: the punch, seen from the middle of the inner rim's oval (2); the
    middle of the lesion (2) and of what is left of it (2), seen from the punch; the lesion's radius (1); how much of the lesion is left (1)
    and how much else is gone (1); how much of the lesion (1) and of other tissue (1) a bite would take here; and time (1, 0 to 1).

    Reward, by volume: 10 for the lesion, by parts; -4 for as much healthy tissue, at most twice; -0.1 for a bite that meets nothing; -0.02
    for each action; 2 when no more than 5 % of the lesion are left. That, healthy tissue of twice the lesion's volume, or 60 actions end an
    episode.

    info: lesion_left (share), healthy_removed (volumes of the lesion), bites (those that met something), is_success (5 % or less of the
    lesion left, healthy tissue of no more than its volume gone).
    """

    steps: ClassVar[int] = 2
    horizon: ClassVar[int] = 60
    action_size: ClassVar[int] = 3
    state_size: ClassVar[int] = 12
    camera: ClassVar[dict[str, Any]] = {"eye": (0, 0.046, 0.036), "target": (0, 0.0155, 0), "field_of_view": 0.42}

    def scene(self) -> dict[str, Any]:
        return meniscus_scene(0.02)

    def prepare(self) -> None:
        n = self.num_envs
        self.rim = inner_rim(self.sessions[0])
        self.whole, _ = volumes(self.sessions[0])
        self.middles = column_middles().reshape(-1, 2)
        self.tissue = np.tile(self.whole.ravel(), (n, 1))  # m3 in each column
        self.lesion = np.zeros((n, 2))  # m, its middle
        self.radius = np.zeros(n)
        self.volume = np.ones(n)  # m3 of the lesion at the start
        self.gone = np.zeros(n)  # m3 of everything
        self.left = np.ones(n)  # share of the lesion
        self.healthy = np.zeros(n)  # gone, in volumes of the lesion
        self.rest_of_it = np.zeros((n, 2))  # m, middle of what is left of the lesion
        self.before = np.zeros((n, 2))  # left and healthy, before the last action
        self.punch = np.zeros((n, 2))  # m
        self.bites, self.idle = np.zeros(n, np.int64), np.zeros(n, bool)
        self.aim, self.aimed = np.zeros((n, 2)), np.zeros(n, bool)  # of the expert
        self.vain = np.zeros((n, 2))  # m, where the last bite that met nothing was

    def begin(self, row: int, random: np.random.Generator) -> None:
        self.radius[row] = random.uniform(SMALLEST, LARGEST)
        angle = -np.pi / 2 + random.uniform(-SPREAD, SPREAD)
        self.lesion[row] = at_rim(self.rim, angle, random.uniform(0, 0.0006))
        self.punch[row] = at_rim(self.rim, angle + random.uniform(-0.4, 0.4), random.uniform(-0.006, -0.003))
        self.tissue[row] = self.whole.ravel()
        self.volume[row] = self._of_lesion(row)[0]
        self.gone[row] = self.bites[row] = self.vain[row] = 0
        self._account(row)
        self.before[row] = self.left[row], self.healthy[row]
        self.idle[row] = False

    def control(self, actions: NDArray[np.float64], plays: NDArray[np.bool_]) -> dict[str, Any]:
        moved = np.clip(self.punch + REACH * actions[:, :2], LOW, HIGH)
        self.punch = np.where(plays[:, None], moved, self.punch)
        self.before[plays] = np.stack([self.left, self.healthy], axis=1)[plays]
        self.idle &= ~plays
        for row in np.flatnonzero(plays & (actions[:, 2] > 0)):
            self._bite(int(row))
        return {}

    def _bite(self, row: int) -> None:
        session, place = self.sessions[row], self.punch[row]
        try:
            self.idle[row] = not session.punch([*place, 0], RADIUS, take=True)
        except Error:  # no cut can be made there: the body is as before
            self.idle[row] = True
        if self.idle[row]:
            self.vain[row], self.aimed[row] = place, False
            return
        found, where = volumes(session, place, AROUND)
        tissue = self.tissue[row].reshape(SHAPE)
        self.gone[row] += (tissue[where] - found).sum()
        tissue[where] = found
        self.bites[row] += 1
        self._account(row)

    def _of_lesion(self, row: int) -> tuple[float, NDArray[np.float64]]:
        """How much tissue is where the lesion is or was, and the middle of it."""
        low, high = column_of(np.stack([self.lesion[row] - self.radius[row], self.lesion[row] + self.radius[row]]))
        tissue = self.tissue[row].reshape(SHAPE)[low[0]:high[0] + 1, low[1]:high[1] + 1].ravel()
        middles = self.middles.reshape(*SHAPE, 2)[low[0]:high[0] + 1, low[1]:high[1] + 1].reshape(-1, 2)
        tissue = np.where(squares_of(middles - self.lesion[row]) < self.radius[row] ** 2, tissue, 0)
        return float(tissue.sum()), tissue @ middles / max(float(tissue.sum()), 1e-15)

    def _account(self, row: int) -> None:
        volume, middle = self._of_lesion(row)
        self.left[row] = volume / self.volume[row]
        self.healthy[row] = max(0.0, self.gone[row] - (self.volume[row] - volume)) / self.volume[row]
        self.rest_of_it[row] = middle if self.left[row] > 0.001 else self.lesion[row]
        self.aimed[row] = False

    def _taken(self, places: NDArray[np.float64], rows: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """What bites at these places (m, k, 2) would take of the lesions of these rows (m), and of other tissue: (m, k), volumes of the lesion."""
        side = np.arange(-WINDOW, WINDOW + 1)
        window = np.stack(np.meshgrid(side, side, indexing="ij"), axis=-1).reshape(-1, 2)
        columns = np.clip(column_of(places)[:, :, None] + window, 0, np.array(SHAPE) - 1)
        middles = ORIGIN + CELL * (columns + 0.5)
        tissue = self.tissue[rows[:, None, None], columns[..., 0] * SHAPE[1] + columns[..., 1]]
        bitten = np.where(squares_of(middles - places[:, :, None]) < (ROUND * RADIUS) ** 2, tissue, 0)
        ill = squares_of(middles - self.lesion[rows, None, None]) < self.radius[rows, None, None] ** 2
        volume, lesion = bitten.sum(axis=2), np.where(ill, bitten, 0).sum(axis=2)
        return lesion / self.volume[rows, None], (volume - lesion) / self.volume[rows, None]

    def look(self, states: NDArray[np.float32], rows: NDArray[np.bool_]) -> None:
        ill, healthy = self._taken(self.punch[:, None], np.arange(self.num_envs))
        unit = 200.0  # of 5 mm
        state = np.concatenate([
            unit * (self.punch - MIDDLE), unit * (self.lesion - self.punch), unit * (self.rest_of_it - self.punch),
            np.stack([unit * self.radius, self.left, self.healthy, ill[:, 0], healthy[:, 0], self.elapsed / self.horizon_now], axis=1)], axis=1)
        states[rows] = state[rows]

    def judge(self, plays: NDArray[np.bool_]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        out = self.left <= LEFT
        rewards = (10 * (self.before[:, 0] - self.left) - 4 * (np.minimum(self.healthy, RUINED) - np.minimum(self.before[:, 1], RUINED))
                   - 0.1 * self.idle - 0.02 + 2 * (out & (self.before[:, 0] > LEFT)))
        return rewards, out | (self.healthy >= RUINED)

    def tell(self) -> dict[str, NDArray[Any]]:
        return {"lesion_left": self.left, "healthy_removed": self.healthy, "bites": self.bites,
                "is_success": (self.left <= LEFT) & (self.healthy <= SPARED)}

    def expert(self) -> NDArray[np.float32]:
        """Goes where a bite takes most of what is left of the lesion, less half of the healthy tissue that it takes, and bites there."""
        anew = np.flatnonzero(~self.aimed)
        if anew.size:
            places = self.rest_of_it[anew, None] + TRIES
            ill, healthy = self._taken(places, anew)
            again = lengths_of(places - self.vain[anew, None]) < 0.0003
            best = (ill - SPARING * healthy - 1e-6 * np.linalg.norm(TRIES, axis=1) - 10 * again).argmax(axis=1)
            self.aim[anew] = places[np.arange(anew.size), best]
            self.aimed[anew] = True
        way = (np.clip(self.aim, LOW, HIGH) - self.punch) / REACH
        there = np.abs(way).max(axis=1) <= 1
        way /= np.maximum(np.abs(way).max(axis=1, keepdims=True), 1)
        return np.concatenate([way, np.where(there, 1.0, -1.0)[:, None]], axis=1).astype(np.float32)

    def blade(self, row: int) -> NDArray[np.float64]:
        ring = np.column_stack([self.punch[row] + RADIUS * np.stack([np.cos(OUTLINE), np.sin(OUTLINE)], axis=1), np.full(len(OUTLINE), 0.0016)])
        return np.concatenate([ring, ring[:1] + (0.01, 0.02, 0.02)])

    def marked(self, row: int) -> NDArray[np.float64]:
        near = squares_of(self.middles - self.lesion[row]) < self.radius[row] ** 2
        height = self.tissue[row] / (2 * CELL ** 2)
        shown = near & (height > 0.0001)
        return self.sessions[row].to_world(np.column_stack([self.middles[shown], height[shown]])) if shown.any() else np.zeros((0, 3))
