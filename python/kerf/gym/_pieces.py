"""Which part of a body a cut has parted: pieces of its collision mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def pieces_of(triangles: NDArray[np.int32], vertices: int) -> NDArray[np.int64]:
    """A number for each triangle (m, 3), the same for triangles that hang together by vertices."""
    label = np.arange(vertices)
    while True:
        least = label[triangles].min(axis=1)
        after = label.copy()
        np.minimum.at(after, triangles, least[:, None])
        after = after[after]  # labels are numbers of vertices: jump to the label's own
        if (after == label).all():
            return label[triangles[:, 0]]
        label = after


def covers(corners: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which points (k, 2) lie in one of the triangles (m, 3, 2)?"""
    if not len(corners):
        return np.zeros(len(points), bool)
    inside = np.zeros(len(points), bool)
    for chunk in np.array_split(corners, max(1, len(corners) // 64)):
        a, b, c = chunk[:, 0, None], chunk[:, 1, None], chunk[:, 2, None]
        p = points[None]
        sides = np.stack([(q[..., 0] - o[..., 0]) * (p[..., 1] - o[..., 1]) - (q[..., 1] - o[..., 1]) * (p[..., 0] - o[..., 0])
                          for o, q in ((a, b), (b, c), (c, a))])
        inside |= ((sides >= 0).all(axis=0) | (sides <= 0).all(axis=0)).any(axis=0)
    return inside
