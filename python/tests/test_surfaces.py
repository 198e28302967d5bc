"""Surfaces for other packages, judged by these."""

import sys
import types

import numpy as np
import pytest

import kerf

ACROSS = [[[0, -0.2, 0.05], [0, -0.2, -0.05]], [[0, 0.2, 0.05], [0, 0.2, -0.05]]]
PACKAGES = ("trimesh", "pyvista", "meshio")


@pytest.fixture
def parted():
    """A steak in two, pulled apart a little."""
    session = kerf.Session({"body": {"model": "steak"}, "simulation": {"gravity": [0, 0, 0]}})
    session.cut(ACROSS)
    session.step(3)
    return session


def test_trimesh_sees_two_closed_pieces_of_the_whole_volume(parted):
    trimesh = pytest.importorskip("trimesh")
    whole = kerf.Session({"body": {"model": "steak"}}).to_trimesh()
    assert type(whole) is trimesh.Trimesh and whole.is_watertight and not whole.face_attributes["wall"].any()
    mesh = parted.to_trimesh()
    assert mesh.is_watertight and mesh.is_winding_consistent
    assert whole.euler_number == 2 and mesh.euler_number == 4  # a ball each
    assert mesh.volume == pytest.approx(whole.volume, rel=1e-3)


def test_walls_are_what_a_cut_adds(parted):
    pytest.importorskip("trimesh")
    whole = kerf.Session({"body": {"model": "steak"}}).to_trimesh()
    mesh = parted.to_trimesh()
    walls = mesh.face_attributes["wall"] == 1
    assert (walls == parted.walls).all() and 0 < walls.sum() < len(walls)
    skin = mesh.area_faces[~walls].sum()
    assert skin == pytest.approx(whole.area, rel=0.01)
    # Both sides of a plane x = 0: they face each other, and are as large.
    normals, areas = mesh.face_normals[walls], mesh.area_faces[walls]
    right, left = areas[normals[:, 0] > 0.5].sum(), areas[normals[:, 0] < -0.5].sum()
    assert right == pytest.approx(left, rel=0.01) and right + left == pytest.approx(areas.sum(), rel=0.01)
    assert abs(mesh.triangles_center[walls][:, 0]).max() < 0.005
    parted.undo()
    assert not parted.walls.any() and len(parted.walls) == len(parted.triangles)


@pytest.mark.parametrize("name", PACKAGES)
def test_numbers_stay_and_copies_are_ones_own(parted, name):
    pytest.importorskip(name)
    surface = getattr(parted, f"to_{name}")()
    points = surface.vertices if name == "trimesh" else surface.points
    corners = {"trimesh": lambda: surface.faces, "pyvista": lambda: surface.faces.reshape(-1, 4)[:, 1:],
               "meshio": lambda: surface.cells_dict["triangle"]}[name]()
    walls = {"trimesh": lambda: surface.face_attributes["wall"], "pyvista": lambda: surface.cell_data["wall"],
             "meshio": lambda: surface.cell_data["wall"][0]}[name]()
    assert (points == parted.positions).all() and (corners == parted.triangles).all() and (walls == parted.walls).all()
    before = parted.positions[0, 0]
    points[0, 0] += 1
    assert points[0, 0] == before + 1 and parted.positions[0, 0] == before


def test_meshio_writes_and_reads_it(parted, tmp_path):
    meshio = pytest.importorskip("meshio")
    parted.to_meshio().write(tmp_path / "steak.vtu")
    back = meshio.read(tmp_path / "steak.vtu")
    assert (back.points == parted.positions).all() and (back.cell_data["wall"][0] == parted.walls).all()


@pytest.mark.parametrize("ending", ["ply", "obj", "stl", "off", "glb"])
def test_trimesh_writes_it(parted, tmp_path, ending):
    trimesh = pytest.importorskip("trimesh")
    mesh = parted.to_trimesh()
    mesh.export(tmp_path / f"steak.{ending}")
    back = trimesh.load_mesh(tmp_path / f"steak.{ending}")
    assert back.area == pytest.approx(mesh.area, rel=1e-5) and len(back.faces) == len(mesh.faces)


@pytest.mark.parametrize("name", PACKAGES)
def test_what_is_missing_is_named(parted, name, monkeypatch):
    monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(ImportError, match=f"pip install {name}") as caught:
        getattr(parted, f"to_{name}")()
    assert caught.value.name == name


def test_pyvista_gets_what_its_manual_asks_for(parted, monkeypatch):
    """Where it is not installed: points, and faces as 3, a, b, c in one row."""
    class PolyData:
        def __init__(self, points, faces):
            self.points, self.faces, self.cell_data = points, faces, {}

    module = types.ModuleType("pyvista")
    module.PolyData = PolyData
    monkeypatch.setitem(sys.modules, "pyvista", module)
    surface = parted.to_pyvista()
    assert surface.faces.ndim == 1 and (surface.faces[::4] == 3).all()
    assert (surface.faces.reshape(-1, 4)[:, 1:] == parted.triangles).all() and (surface.points == parted.positions).all()
    assert surface.cell_data["wall"].dtype == np.uint8 and (surface.cell_data["wall"] == parted.walls).all()


@pytest.mark.parametrize("name", PACKAGES)
def test_a_closed_session_has_no_surface(name):
    pytest.importorskip(name)
    session = kerf.Session({"body": {"model": "sheet"}})
    session.close()
    with pytest.raises(kerf.Error, match="closed"):
        getattr(session, f"to_{name}")()
