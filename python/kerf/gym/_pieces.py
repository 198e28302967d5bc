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


def inside(outline: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which points (k, 2) lie inside of a closed outline (m, 2)? By the parity of crossings."""
    x, y = points.T
    x0, y0 = outline.T
    x1, y1 = np.roll(outline, -1, axis=0).T
    above = y0 <= y[:, None]
    point, edge = np.divmod(np.flatnonzero(above != np.roll(above, -1, axis=1)), len(outline))
    x0, y0, x1, y1 = x0[edge], y0[edge], x1[edge], y1[edge]
    left = x[point] < x0 + (y[point] - y0) / (y1 - y0) * (x1 - x0)
    return np.bincount(point[left], minlength=len(points)) % 2 == 1


def area_of(outline: NDArray[np.float64]) -> float:
    """Area of a closed outline (m, 2)."""
    x, y = outline.T
    return 0.5 * abs(float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))))


def areas_of(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Areas of triangles (m, 3, 2)."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return 0.5 * np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def way_between(triangles: NDArray[np.int32], first: int, last: NDArray[np.bool_]) -> NDArray[np.int64]:
    """The fewest triangles, each beside the next one, from one to any of those marked; none where there is no such way."""
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).astype(np.int64), axis=1)
    keys = sides[:, 0] * (int(triangles.max()) + 1) + sides[:, 1]
    order = np.argsort(keys, kind="stable")
    same = np.flatnonzero(keys[order[1:]] == keys[order[:-1]])
    beside: list[list[int]] = [[] for _ in triangles]
    for a, b in zip((order[same] // 3).tolist(), (order[same + 1] // 3).tolist(), strict=True):
        beside[a].append(b)
        beside[b].append(a)
    came, edge = {first: first}, [first]
    for at in edge:  # grows as it is gone through
        if last[at]:
            way = [at]
            while way[-1] != first:
                way.append(came[way[-1]])
            return np.array(way[::-1])
        for other in beside[at]:
            if other not in came:
                came[other] = at
                edge.append(other)
    return np.zeros(0, np.int64)
