"""Surfaces as the library takes them: files, arrays, and meshes of trimesh, pyvista and meshio."""

from __future__ import annotations

import os
from typing import Any, NamedTuple

from . import _arguments
from ._paths import path_text

_MESHES = "(vertices, triangles), a path of a mesh file, or a mesh of trimesh, pyvista or meshio"

# Metres. Names as trimesh has them, and British ones.
_UNITS = {name: metres for metres, names in {
    1e-9: "nm nanometer nanometre nanometers nanometres", 1e-6: "um micron microns micrometer micrometre micrometers micrometres",
    1e-3: "mm millimeter millimetre millimeters millimetres", 1e-2: "cm centimeter centimetre centimeters centimetres",
    1e-1: "dm decimeter decimetre decimeters decimetres", 1.0: "m meter metre meters metres", 1e3: "km kilometer kilometre kilometers kilometres",
    0.0254: "in inch inches", 0.3048: "ft foot feet", 0.9144: "yd yard yards"}.items() for name in names.split()}


class Surface(NamedTuple):
    """file, or points (n, 3), triangles (m, 3), texture (m, 3, 2) and polygons (k, 2): of faces with more corners, which are fans as yet, the first
    triangle and the number of corners."""

    file: str | None = None
    points: Any = None
    triangles: Any = None
    texture: Any = None
    polygons: Any = None
    unit: float | None = None  # metres


def surface(mesh: Any, what: str, uv: Any = None) -> Surface:
    """A path, or a pair of arrays, or whatever is a mesh. what: "" or "collision ", for messages. uv: instead of what the mesh brings."""
    if isinstance(mesh, (str, os.PathLike)):
        if uv is not None:
            raise ValueError("a file brings its own texture coordinates; leave uv out, or read the file and give its arrays")
        return Surface(path_text(mesh))
    if isinstance(mesh, (tuple, list)) and len(mesh) == 2:
        return _arrays(mesh[0], mesh[1], what, uv)
    kind = type(mesh).__name__
    faces = getattr(mesh, "faces", None)
    if hasattr(mesh, "vertices") and (faces is not None or hasattr(mesh, "triangles")):
        if uv is None:
            uv = getattr(getattr(mesh, "visual", None), "uv", None)
        return _arrays(mesh.vertices, mesh.triangles if faces is None else faces, what, uv)._replace(unit=_unit(mesh))
    if hasattr(mesh, "points"):
        if faces is not None:
            if uv is None:
                uv = getattr(mesh, "active_texture_coordinates", None)
            return _polygons(mesh.points, *_of_rows(mesh, faces), what, uv)
        blocks = getattr(mesh, "cells", None)
        if isinstance(blocks, list) and all(hasattr(block, "type") and hasattr(block, "data") for block in blocks):
            return _polygons(mesh.points, *_of_blocks(blocks), what, uv)
        if blocks is not None:
            raise ValueError(f"this {kind} has volumes or cells of many kinds; give its surface: .extract_surface()")
    if hasattr(mesh, "geometry") and hasattr(mesh, "to_mesh"):
        if len(mesh.geometry) == 1:  # of a .glb; placed by its node
            return surface(mesh.to_mesh(), what, uv)._replace(unit=_unit(mesh))
        raise TypeError(f"this {kind} holds {len(mesh.geometry)} meshes; give one of them, or all as one: .to_mesh()")
    if not what and hasattr(mesh, "__array__") or isinstance(mesh, (tuple, list)):
        raise TypeError(f"arrays come in twos: {what}vertices of shape (n, 3) and {what}triangles of shape (m, 3)")
    raise TypeError(f"a {what}mesh is {_MESHES}, not {kind}")


def _unit(mesh):
    """Metres per unit of a mesh that knows it."""
    name = getattr(mesh, "units", None)
    if not isinstance(name, str) or name.strip().lower() in ("", "unitless"):
        return None
    metres = _UNITS.get(name.strip().lower())
    if metres is None:
        raise ValueError(f"this {type(mesh).__name__} is in {name!r}, which is no unit known here; give scale, the metres per unit")
    return metres


# --- Faces of other packages: all their corners in a row, and how many each face has ---


def _of_rows(mesh, faces):
    """PolyData: faces in one row, each with its number of corners before it."""
    import numpy as np

    kind, row = type(mesh).__name__, np.asarray(faces)
    if row.ndim != 1:
        row = _arguments.corners(faces, "faces", np.iinfo(np.int32).max)
        return row.ravel(), np.full(len(row), 3)
    if getattr(mesh, "n_strips", 0):
        raise ValueError(f"this {kind} has strips of triangles; give its .triangulate()")
    if row.dtype.kind not in "iu":
        raise TypeError(f"faces must be whole numbers, not {_arguments.kind_of(row, faces)}")
    if len(row) and not len(row) % 4 and (row[::4] == 3).all():
        return row.reshape(-1, 4)[:, 1:].ravel().astype(np.int64), np.full(len(row) // 4, 3)
    heads, at, end = [], 0, len(row)
    while at < end:
        heads.append(at)
        at += 1 + max(0, int(row[at]))
    if at != end:
        raise ValueError(f"the last of the faces of this {kind} has {row[heads[-1]]} corners, of which {end - heads[-1] - 1} are there")
    return np.delete(row, heads).astype(np.int64), row[heads].astype(np.int64)


def _of_blocks(blocks):
    """meshio's blocks; points and lines beside faces are left out."""
    import numpy as np

    flat = ("triangle", "quad", "polygon")
    others = sorted({block.type for block in blocks} - {*flat, "vertex", "line"})
    if others:
        raise ValueError(f"this mesh has cells of type {', '.join(others)}; give triangles, quads and polygons alone, of its surface")
    corners, counts = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
    for block in blocks:
        if block.type not in flat:
            continue
        tables = [block.data] if getattr(block.data, "ndim", 0) == 2 else [[row] for row in block.data]  # polygons may differ in length
        for table in map(np.asarray, tables):
            if table.dtype.kind not in "iu":
                raise TypeError(f"cells must be whole numbers, not {_arguments.kind_of(table, block.data)}")
            corners.append(table.ravel().astype(np.int64))
            counts.append(np.full(len(table), table.shape[1]))
    return np.concatenate(corners), np.concatenate(counts)


# --- Arrays ---


def _arrays(vertices, triangles, what, uv):
    points = _points(vertices, what)
    corners = _arguments.corners(triangles, f"{what}triangles", len(points))
    return Surface(None, points, corners, None if what else _texture(uv, corners, len(points)))


def _polygons(vertices, corners, counts, what, uv):
    """Faces with more than three corners are given as fans from their first one. Those that the fan does not cover are divided otherwise later."""
    import numpy as np

    points = _points(vertices, what)
    if not len(counts):
        raise ValueError(f"{what}faces is empty: there is no surface")
    few = np.flatnonzero(counts < 3)
    if len(few):
        raise ValueError(f"{what}faces[{few[0]}] has {counts[few[0]]} corners; 3 are the least")
    wrong = np.flatnonzero((corners < 0) | (corners >= len(points)))
    if len(wrong):
        face = int(np.searchsorted(np.cumsum(counts), wrong[0], side="right"))
        raise ValueError(f"{what}faces[{face}] has the vertex {corners[wrong[0]]}, but there are {len(points)} vertices, numbered from 0")
    first = np.cumsum(counts - 2) - (counts - 2)  # triangle of each face
    face = np.repeat(np.arange(len(counts)), counts - 2)
    start = (np.cumsum(counts) - counts)[face]
    last = start + np.arange(len(face)) - first[face] + 2
    triangles = np.stack([corners[start], corners[last - 1], corners[last]], axis=1).astype(np.int32, order="C")
    more = np.flatnonzero(counts > 3)
    polygons = np.stack([first[more], counts[more]], axis=1).astype(np.int64, order="C") if len(more) else None
    return Surface(None, points, triangles, None if what else _texture(uv, triangles, len(points)), polygons)


def _points(vertices, what):
    return _arguments.table(vertices, f"{what}vertices", "an array of shape (n, 3), metres before scale")


def _texture(uv, triangles, count):
    """Texture coordinates of the corners of triangles, float32."""
    import numpy as np

    if uv is None:
        return None
    if _arguments.as_array(uv, "uv", f"an array of shape ({count}, 2)").ndim == 3:
        corners = _arguments.rows(uv, "uv", (len(triangles), 3, 2))
    else:
        corners = _arguments.rows(uv, "uv", (count, 2))[triangles]
    if corners.size and np.abs(corners).max() > np.finfo(np.float32).max:
        raise ValueError("uv must be float32 numbers")
    return np.array(corners, dtype=np.float32, order="C")
