"""Marks drawn on a body, into pictures of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .. import Camera

INK, STEEL = (20, 40, 160), (70, 72, 78)  # sRGB
BEFORE = 0.004  # m: marks are seen through so much of the body


def project(places: NDArray[np.float64], camera: Camera, height: int, width: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Columns and rows (k, 2) of places (k, 3) in a picture, and how far along the view they are (k), metres."""
    eye, target, up = (np.asarray(v, float) for v in (camera.eye, camera.target, camera.up))
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    seen = (places - eye) @ np.stack([right, np.cross(right, forward), forward], axis=1)
    scale = 0.5 * height / np.tan(0.5 * camera.field_of_view) / np.maximum(seen[:, 2], 1e-9)
    return np.stack([0.5 * width + scale * seen[:, 0], 0.5 * height - scale * seen[:, 1]], axis=1), seen[:, 2]


def paint(picture: NDArray[np.uint8], depth: NDArray[np.float32], places: NDArray[np.float64], camera: Camera,
          ink: tuple[int, int, int] = INK) -> None:
    """Dots at these places (k, 3), metres, where nothing hides them."""
    height, width = depth.shape
    at, far = project(places, camera, height, width)
    reach = max(0, round(height / 320))
    for i in range(-reach, reach + 1):
        for j in range(-reach, reach + 1):
            column, row = np.floor(at[:, 0]).astype(int) + i, np.floor(at[:, 1]).astype(int) + j
            inside = (far > 0) & (column >= 0) & (column < width) & (row >= 0) & (row < height)
            column, row, away = column[inside], row[inside], far[inside]
            shown = away < depth[row, column] + BEFORE
            picture[row[shown], column[shown]] = ink
