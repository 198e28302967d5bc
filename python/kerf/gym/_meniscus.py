"""A meniscus, held by its outer wall and its horns, in a joint full of water; and where its volume is."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import Session

MIDDLE = (0.0, 0.022)  # m: of the oval that its inner rim is part of
SHORT = 0.012  # m: the inner rim is nearer to the middle than this, all else farther
CELL = 0.0002  # m: side of a column
ORIGIN = np.array([-0.0230, -0.0006])  # m: lowest corner of the columns, which cover the whole body
SHAPE = (230, 175)  # columns along x and y
DIVISIONS = 4  # of the sides of a triangle whose parts are counted
LONGEST = 0.0025  # m: no edge of the surface is longer


def meniscus_scene(time_step: float) -> dict[str, Any]:
    """The scene; the body is the model "meniscus"."""
    return {"body": {"model": "meniscus"}, "cut": {"layers": 4, "path_tolerance": 0.008},
            "simulation": {"time_step": time_step, "gravity": [0, 0, 0]},
            "fix": [{"half_space": {"point": [0, 0.027, 0], "normal": [0, 1, 0]}}, {"half_space": {"point": [0, 0.003, 0], "normal": [0, -1, 0]}}]}


def border_of(triangles: NDArray[np.int32]) -> NDArray[np.int64]:
    """Edges (k, 2) that one triangle alone has, along it."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]).astype(np.int64)
    low, high = np.minimum(edges[:, 0], edges[:, 1]), np.maximum(edges[:, 0], edges[:, 1])
    _, first, count = np.unique(low * (high.max() + 1) + high, return_index=True, return_counts=True)
    return edges[first[count == 1]]


def inner_rim(session: Session) -> NDArray[np.float64]:
    """Angle about the middle and distance from it (k, 2) of the uncut inner rim, by rising angle: radians, metres."""
    rest = session.collision_rest_positions
    rim = rest[np.unique(border_of(session.collision_triangles)), :2] - MIDDLE
    polar = np.stack([np.arctan2(rim[:, 1], rim[:, 0]), np.linalg.norm(rim, axis=1)], axis=1)
    polar = polar[(polar[:, 1] < SHORT) & (rim[:, 1] < 0)]
    return polar[np.argsort(polar[:, 0])]


def at_rim(rim: NDArray[np.float64], angle: float, inwards: float) -> NDArray[np.float64]:
    """The place (2) that is so far in the tissue, seen from the rim at an angle; metres."""
    away = np.interp(angle, rim[:, 0], rim[:, 1]) + inwards
    return np.array(MIDDLE) + away * np.array([np.cos(angle), np.sin(angle)])


def column_middles() -> NDArray[np.float64]:
    """Middles (SHAPE, 2) of the columns, metres."""
    return ORIGIN + CELL * (np.stack(np.meshgrid(*map(np.arange, SHAPE), indexing="ij"), axis=-1) + 0.5)


def column_of(places: NDArray[np.float64]) -> NDArray[np.int64]:
    """Numbers (k, 2) of the columns of these places (k, 2)."""
    return np.floor((places - ORIGIN) / CELL).astype(np.int64)


def _parts() -> NDArray[np.float64]:
    """Middles of the equal parts of a triangle, barycentric: (DIVISIONS squared, 3)."""
    n = DIVISIONS
    up = [(i + 1 / 3, j + 1 / 3) for i in range(n) for j in range(n - i)]
    down = [(i + 2 / 3, j + 2 / 3) for i in range(n) for j in range(n - i - 1)]
    ab = np.array(up + down) / n
    return np.column_stack([ab, 1 - ab.sum(axis=1)])


PARTS = _parts()


def volumes(session: Session, near: NDArray[np.float64] | None = None, reach: float = 0.0) -> tuple[NDArray[np.float64], tuple[slice, slice]]:
    """How much of the body at rest is in each column, m3, and which columns these are: all, or a square about a place (2).

    Height times area seen from above, over the closed surface, is its volume. Parts of triangles go to the column of their middle.
    """
    rest, triangles = session.rest_positions, session.triangles
    low, high = np.zeros(2, np.int64), np.array(SHAPE)
    if near is not None:
        low, high = np.clip(column_of(np.stack([near - reach, near + reach])) + ((0, 0), (1, 1)), 0, SHAPE)
        x, y = (np.abs(rest[:, i] - near[i]) < reach + LONGEST for i in range(2))
        a, b, c = (x & y)[triangles.T]
        triangles = triangles[a | b | c]
    corners = rest[triangles]
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / len(PARTS)
    middles = PARTS @ corners
    number = np.floor((middles[..., :2] - ORIGIN) / CELL).astype(np.int64) - low
    size = high - low
    x, y = ((number[..., i] >= 0) & (number[..., i] < size[i]) for i in range(2))
    inside = x & y
    flat = number[..., 0] * size[1] + number[..., 1]
    found = np.bincount(flat[inside], (middles[..., 2] * area[:, None])[inside], minlength=size[0] * size[1])
    return found.reshape(size), (slice(low[0], high[0]), slice(low[1], high[1]))
