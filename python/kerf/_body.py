"""Bodies: meshes from arrays, files and other packages, bound and ready to be cut."""

from __future__ import annotations

import math
import numbers
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _arguments, _core, _meshes
from ._core import Body
from ._error import Error
from ._paths import path_text
from ._scene import models

if TYPE_CHECKING:
    from numpy.typing import ArrayLike



def bind(vertices: ArrayLike | Any, triangles: ArrayLike | None = None, *, uv: ArrayLike | None = None, collision: Any = None,
         scale: float | None = None, thickness: float | None = None, weld: float | None = None, collision_triangles: int | None = None, exact_paths: bool = False, young: float | None = None,
         poisson: float | None = None, density: float | None = None) -> Body:
    """Makes a body that can be cut from the surface of a thin solid, or from an open sheet: what `kerf bind` does with files.

    vertices, triangles: (n, 3) finite numbers, and (m, 3) whole numbers of vertices, counter-clockwise from outside. Or in place of both
    one mesh: a path of a file (OBJ, PLY, STL, OFF), a trimesh.Trimesh or a Scene of one, a pyvista.PolyData, a meshio.Mesh of triangles,
    quads and polygons, or anything else with `vertices` and `faces` or `triangles`; or the name of a model (kerf.models()).
    uv: texture coordinates, (n, 2) of the vertices or (m, 3, 2) of the triangles' corners. By default those that the mesh brings: visual.uv
    of trimesh, active_texture_coordinates of pyvista. They tell seams from slits in an open sheet: vertices at one place with different
    coordinates become one.
    collision: the mid-surface, an open surface, as one mesh or a pair (vertices, triangles). Without it one is made: body.diagnosis tells how.
    scale: metres per unit of both; by default that of a mesh that knows its unit, as `units` of trimesh, else 1. thickness: metres; an open sheet needs it. weld: metres; corners this close become one, with 0 none; by
    default those at one place that the mesh does not keep apart, as the lips of a slit. collision_triangles: wanted of the mesh that is made, 8 to
    100000, at most as many as the surface has, or 1500; by default 160, or what the bends need. A model has collision meshes of its own: then it
    is one of their counts, by default the model's, and kerf.Error names them. exact_paths: exact geodesics, slower and a
    little shorter.
    young (Pa), poisson, density (kg/m3): of the material; scenes use them where they say none.

    kerf.Error: a mesh that can't be bound, with the program's words; its `diagnosis` is a dict as body.diagnosis where a collision mesh was
    tried to be made. TypeError, ValueError: arguments that are no such meshes or numbers. Python's lock is free meanwhile; Ctrl-C ends it.
    """
    options: dict[str, Any] = {"exact_paths": _arguments.flag(exact_paths, "exact_paths")}
    for name, value in (("scale", scale), ("thickness", thickness), ("young", young), ("density", density)):
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
        if collision is not None or uv is not None or options.get("scale", 1) != 1:
            raise ValueError(f"{vertices} is a model, in metres and with its own collision mesh and texture; leave scale, collision and uv out, or give a mesh")
        visual, options["model"] = None, vertices
    else:
        visual = _meshes.surface(vertices if triangles is None else (vertices, triangles), "", uv)
    middle = None if collision is None else _meshes.surface(collision, "collision ")
    if middle is not None and None not in (visual.unit, middle.unit) and visual.unit != middle.unit and "scale" not in options:
        raise ValueError(f"the mesh is in units of {visual.unit:g} m, its collision mesh in units of {middle.unit:g} m; convert one, or give scale")
    if "scale" not in options and visual is not None and visual.unit is not None:
        options["scale"] = visual.unit
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
