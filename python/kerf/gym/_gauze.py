"""A gauze: a thin square sheet."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .. import Body, bind

SIDE = 0.10  # m
THICKNESS = 0.004  # m


def gauze_mesh(cells: int = 20) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Vertices (k, 3) and triangles (m, 3) of the middle of the gauze, `cells` squares along each side."""
    along = np.linspace(-SIDE / 2, SIDE / 2, cells + 1)
    x, y = np.meshgrid(along, along)
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    i, j = np.meshgrid(np.arange(cells), np.arange(cells))
    a = (j * (cells + 1) + i).ravel()
    b, c, d = a + 1, a + cells + 2, a + cells + 1
    even = ((i + j) % 2 == 0).ravel()[:, None]
    first = np.where(even, np.stack([a, b, d], 1), np.stack([a, b, c], 1))
    second = np.where(even, np.stack([b, c, d], 1), np.stack([a, c, d], 1))
    return vertices, np.concatenate([first, second]).astype(np.int32)


@lru_cache(maxsize=1)
def gauze_body() -> Body:
    """The gauze, bound."""
    return bind(*gauze_mesh(), thickness=THICKNESS)
