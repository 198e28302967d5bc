"""A slab of meat: flat, longer than wide, wider at one end."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .. import Body, bind

LENGTH, THICKNESS = 0.14, 0.014  # m, along x and z
DENSITY = 1050.0  # kg/m3
COLUMNS, ROWS = 16, 6  # of cells
STATIONS = np.linspace(-LENGTH / 2, LENGTH / 2, COLUMNS + 1)  # m, where it is so wide:
HALF_WIDTH = 0.022 + 0.010 * np.sin(np.linspace(0.5, 2.6, COLUMNS + 1)) - 0.006 * np.linspace(-1, 1, COLUMNS + 1)  # m


def half_width(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """From the middle line to the rim at these places, metres; 0 beyond the ends."""
    return np.interp(x, STATIONS, HALF_WIDTH, left=0, right=0)


def slab_mesh() -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Vertices (k, 3) and triangles (m, 3) of its middle."""
    across = np.linspace(-1, 1, ROWS + 1)
    x = np.broadcast_to(STATIONS, (ROWS + 1, len(STATIONS)))
    vertices = np.stack([x.ravel(), (across[:, None] * HALF_WIDTH).ravel(), np.zeros(x.size)], axis=1)
    i, j = (of.ravel() for of in np.meshgrid(np.arange(len(STATIONS) - 1), np.arange(ROWS)))
    a = j * len(STATIONS) + i
    b, c, d = a + 1, a + len(STATIONS) + 1, a + len(STATIONS)
    even = ((i + j) % 2 == 0)[:, None]
    first = np.where(even, np.stack([a, b, d], 1), np.stack([a, b, c], 1))
    second = np.where(even, np.stack([b, c, d], 1), np.stack([a, c, d], 1))
    return vertices, np.concatenate([first, second]).astype(np.int32)


def slab_surface() -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Vertices (k, 3) and triangles (m, 3) of its closed surface."""
    middle, triangles = slab_mesh()
    count = len(middle)
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    whole = {(a, b) for a, b in edges.tolist()}
    rim = np.array([(a, b) for a, b in edges.tolist() if (b, a) not in whole], np.int32)
    half = np.array([0, 0, THICKNESS / 2])
    below = triangles[:, ::-1] + count
    wall = np.concatenate([np.stack([rim[:, 1], rim[:, 0], rim[:, 0] + count], 1),
                           np.stack([rim[:, 1], rim[:, 0] + count, rim[:, 1] + count], 1)])
    return np.concatenate([middle + half, middle - half]), np.concatenate([triangles, below, wall]).astype(np.int32)


@lru_cache(maxsize=1)
def slab_body() -> Body:
    """The slab, bound."""
    return bind(*slab_surface(), collision=slab_mesh())
