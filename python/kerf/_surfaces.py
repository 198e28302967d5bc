"""Surfaces for other packages: trimesh, pyvista and meshio, none of which kerf needs."""

import importlib


def _package(name):
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise ImportError(f"to_{name}() needs the package {name}, which can't be imported ({error}); pip install {name}", name=name) from error


def _parts(session):
    """Vertices, triangles, and 1 for triangles of walls: copies, whoever writes to them."""
    import numpy as np

    return session.positions.copy(), session.triangles.astype(np.int64), session.walls.astype(np.uint8)  # PLY files have no bool


def to_trimesh(session):
    trimesh = _package("trimesh")
    vertices, triangles, walls = _parts(session)
    return trimesh.Trimesh(vertices, triangles, face_attributes={"wall": walls}, process=False)


def to_pyvista(session):
    import numpy as np

    pyvista = _package("pyvista")
    vertices, triangles, walls = _parts(session)
    faces = np.column_stack([np.full(len(triangles), 3, triangles.dtype), triangles])
    surface = pyvista.PolyData(vertices, faces.ravel())
    surface.cell_data["wall"] = walls
    return surface


def to_meshio(session):
    meshio = _package("meshio")
    vertices, triangles, walls = _parts(session)
    return meshio.Mesh(vertices, [("triangle", triangles)], cell_data={"wall": [walls]})
