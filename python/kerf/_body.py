"""Bodies: meshes from arrays, files and other packages, bound and ready to be cut."""

from __future__ import annotations

import math
import numbers
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _arguments, _core
from ._core import Body
from ._error import Error
from ._scene import models, utf8

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

_MESHES = "(vertices, triangles), a path of a mesh file, or a mesh of trimesh, pyvista or meshio"


def bind(vertices: ArrayLike | Any, triangles: ArrayLike | None = None, *, collision: Any = None, scale: float = 1.0,
         thickness: float | None = None, weld: float | None = None, collision_triangles: int | None = None, exact_paths: bool = False, young: float | None = None,
         poisson: float | None = None, density: float | None = None) -> Body:
    """Makes a body that can be cut from the surface of a thin solid, or from an open sheet: what `kerf bind` does with files.

    vertices, triangles: (n, 3) finite numbers, and (m, 3) whole numbers of vertices, counter-clockwise from outside. Or in place of both
    one mesh: a path of a file (OBJ, PLY, STL, OFF), a trimesh.Trimesh, a triangulated pyvista.PolyData, a meshio.Mesh of triangles, or
    anything else with `vertices` and `faces` or `triangles`; or the name of a model (kerf.models()).
    collision: the mid-surface, an open surface, as one mesh or a pair (vertices, triangles). Without it one is made: body.diagnosis tells how.
    scale: metres per unit of both. thickness: metres; an open sheet needs it. weld: metres; corners this close become one, with 0 none; by
    default those at one place that the mesh does not keep apart, as the lips of a slit. Arrays and meshes in memory bring no texture, which
    tells seams from slits in an open sheet: weld=1e-9 merges seams. collision_triangles: wanted of the mesh that is made, 8 to
    100000, at most as many as the surface has, or 1500; by default 160, or what the bends need. A model has collision meshes of its own: then it
    is one of their counts, by default the model's, and kerf.Error names them. exact_paths: exact geodesics, slower and a
    little shorter.
    young (Pa), poisson, density (kg/m3): of the material; scenes use them where they say none.
    Arrays and objects of other packages bring no texture. So an open sheet that is split at UV seams is refused, or keeps a seam as a slit:
    weld=1e-9 joins seams. An OBJ or a PLY by its path brings its texture, whose seams are merged.

    kerf.Error: a mesh that can't be bound, with the program's words; its `diagnosis` is a dict as body.diagnosis where a collision mesh was
    tried to be made. TypeError, ValueError: arguments that are no such meshes or numbers. Python's lock is free meanwhile; Ctrl-C ends it.
    """
    options: dict[str, Any] = {"scale": _positive(scale, "scale"), "exact_paths": _arguments.flag(exact_paths, "exact_paths")}
    for name, value in (("thickness", thickness), ("young", young), ("density", density)):
        if value is not None:
            options[name] = _positive(value, name)
    if weld is not None:
        options["weld"] = _number(weld, "weld")
        if not 0 <= options["weld"] < math.inf:
            raise ValueError(f"weld must be finite and at least 0, not {weld}")
    if poisson is not None:
        options["poisson"] = _number(poisson, "poisson")
        if not 0 <= options["poisson"] <= 0.49:
            raise ValueError(f"poisson must be from 0 to 0.49, not {poisson}")
    if collision_triangles is not None:
        options["collision_triangles"] = _count(collision_triangles, collision)
    if triangles is None and _is_model(vertices):
        if weld is not None:
            raise ValueError(f"{vertices} is a model, which has no loose corners; leave weld out, or give a mesh")
        if collision is not None or options["scale"] != 1:
            raise ValueError(f"{vertices} is a model, in metres and with its own collision mesh; leave scale and collision out, or give a mesh")
        visual, options["model"] = None, vertices
    else:
        visual = _mesh(vertices, "") if triangles is None else _arrays(vertices, triangles, "")
    middle = None if collision is None else _mesh(collision, "collision ")
    diagnosis: dict[str, Any] = {}
    try:
        return _core.bind_body(visual, middle, options, diagnosis)
    except Error as error:
        error.diagnosis = diagnosis or None
        raise


def load(path: str | os.PathLike[str]) -> Body:
    """A body saved by body.save() or `kerf bind`. kerf.Error: there is no such file, or it is damaged or something else."""
    return _core.load_body(path_text(path))


def unpickled(data: bytes, title: str) -> Body:
    """What the pickle of a body becomes. kerf.Error: it is damaged."""
    return _core.body_of_bytes(data, title)


def path_text(path):
    """A path as the library can have it."""
    if not isinstance(path, (str, os.PathLike)):
        raise TypeError(f"a path is a str or os.PathLike, not {type(path).__name__}")
    text = utf8(os.fsdecode(path))
    if "\0" in text:
        raise ValueError("a path has no null characters")
    return text


def _is_model(mesh):
    return isinstance(mesh, str) and mesh in models() and not Path(mesh).exists()


# --- Numbers ---


def _number(value, name):
    if isinstance(value, bool) or not (isinstance(value, numbers.Real) or hasattr(value, "dtype") and getattr(value, "ndim", 1) == 0):
        raise TypeError(f"{name} must be a number, not {type(value).__name__}")
    try:
        return float(value)
    except OverflowError:
        return math.inf


def _positive(value, name):
    number = _number(value, name)
    if not (number > 0 and math.isfinite(number)):
        raise ValueError(f"{name} must be finite and more than 0, not {number}")
    return number


def _count(value, collision):
    count = _arguments.index(value, "collision_triangles")
    if collision is not None:
        raise ValueError("collision_triangles goes without collision: they are of the mesh that is made")
    if not 8 <= count <= 100000:
        raise ValueError(f"collision_triangles must be from 8 to 100000, not {count}")
    return count


# --- Meshes ---


def _mesh(mesh, what):
    """A path, or a pair of arrays, of whatever is a mesh. what: "" or "collision ", for messages."""
    if isinstance(mesh, (str, os.PathLike)):
        return path_text(mesh)
    if isinstance(mesh, (tuple, list)) and len(mesh) == 2:
        return _arrays(mesh[0], mesh[1], what)
    kind = type(mesh).__name__
    faces = getattr(mesh, "faces", None)
    if hasattr(mesh, "vertices") and (faces is not None or hasattr(mesh, "triangles")):
        return _arrays(mesh.vertices, mesh.triangles if faces is None else faces, what)
    if hasattr(mesh, "points"):
        if faces is not None:
            return _arrays(mesh.points, _of_rows(mesh, faces), what)
        blocks = getattr(mesh, "cells", None)
        if isinstance(blocks, list) and all(hasattr(block, "type") and hasattr(block, "data") for block in blocks):
            return _arrays(mesh.points, _of_blocks(blocks), what)
        if blocks is not None:
            raise ValueError(f"this {kind} has volumes or cells of many kinds; give its surface: .extract_surface().triangulate()")
    if hasattr(mesh, "geometry") and hasattr(mesh, "to_mesh"):
        if len(mesh.geometry) == 1:  # of a .glb; placed by its node
            return _mesh(mesh.to_mesh(), what)
        raise TypeError(f"this {kind} holds {len(mesh.geometry)} meshes; give one of them, or all as one: .to_mesh()")
    if not what and hasattr(mesh, "__array__") or isinstance(mesh, (tuple, list)):
        raise TypeError(f"arrays come in twos: {what}vertices of shape (n, 3) and {what}triangles of shape (m, 3)")
    raise TypeError(f"a {what}mesh is {_MESHES}, not {kind}")


def _of_rows(mesh, faces):
    """Triangles of PolyData: faces in one row, each with its number of corners before it."""
    import numpy as np

    row = np.asarray(faces)
    if row.ndim != 1:
        return row
    if len(row) % 4 or (row[::4] != 3).any() or getattr(mesh, "n_strips", 0):
        raise ValueError(f"this {type(mesh).__name__} has faces that are no triangles; give its .triangulate()")
    return row.reshape(-1, 4)[:, 1:]


def _of_blocks(blocks):
    """Triangles of meshio's blocks; points and lines beside them are left out."""
    import numpy as np

    others = sorted({block.type for block in blocks} - {"triangle", "vertex", "line"})
    if others:
        raise ValueError(f"this mesh has cells of type {', '.join(others)}; give triangles alone, of its surface")
    found = [block.data for block in blocks if block.type == "triangle"]
    return np.concatenate(found) if found else np.empty((0, 3), np.int64)


def _arrays(vertices, triangles, what):
    points = _arguments.table(vertices, f"{what}vertices", "an array of shape (n, 3), metres before scale")
    return points, _arguments.corners(triangles, f"{what}triangles", len(points))
