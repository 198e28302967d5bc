"""Bodies from meshes of one's own: judged by the program's bind, by closed forms and by trimesh."""

import copy
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
import types

import numpy as np
import pytest

import kerf
from kerf import _program

ACROSS = [[[0, -1, 1], [0, -1, -1]], [[0, 1, 1], [0, 1, -1]]]


def plate(n=12, size=(0.12, 0.10, 0.01)):
    """A closed box of n x n squares on each face, two triangles each; vertices on its edges are shared."""
    points, triangles, known = [], [], {}

    def corner(p):
        key = tuple(np.round(p, 12))
        if key not in known:
            known[key] = len(points)
            points.append(p)
        return known[key]

    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        nu, nv = (1 if k == 2 else n for k in (u, v))
        for side in (0, 1):
            for i in range(nu):
                for j in range(nv):
                    def at(a, b):
                        p = np.zeros(3)
                        p[axis], p[u], p[v] = side, a / nu, b / nv
                        return corner((p - 0.5) * size)

                    a, b, c, d = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
                    triangles += [(a, b, c), (a, c, d)] if side else [(a, c, b), (a, d, c)]
    return np.array(points), np.array(triangles)


def middle(n=6, size=(0.12, 0.10)):
    """The mid-surface of that plate."""
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, n + 1), np.linspace(-0.5, 0.5, n + 1), indexing="ij")
    points = np.stack([x.ravel() * size[0], y.ravel() * size[1], np.zeros(x.size)], axis=1)
    a = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    b, c, d = a + n + 1, a + n + 2, a + 1
    return points, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def ball(n=24):
    """What is not thin."""
    v = np.array([[np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)] for t in np.linspace(0, np.pi, n)[1:-1]
                  for p in np.linspace(0, 2 * np.pi, n, endpoint=False)] + [[0, 0, 1], [0, 0, -1]])
    at = np.arange((n - 2) * n).reshape(n - 2, n)
    up, down, right, low = at[:-1], at[1:], np.roll(at[:-1], -1, 1), np.roll(at[1:], -1, 1)
    north, south = np.full(n, len(v) - 2), np.full(n, len(v) - 1)
    f = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in
                        [(up, down, low), (up, low, right), (north, at[0], np.roll(at[0], -1)), (south, np.roll(at[-1], -1), at[-1])]])
    return 0.05 * v, f


PLATE, MIDDLE = plate(), middle()


def write_obj(path, mesh):
    path.write_text("".join(f"v {' '.join(map(repr, p))}\n" for p in mesh[0].tolist()) +
                    "".join(f"f {a} {b} {c}\n" for a, b, c in (mesh[1] + 1).tolist()))
    return path


def run(*words):
    if not _program.PROGRAM.is_file():
        pytest.skip("built without the program")
    return subprocess.run([_program.PROGRAM, *map(str, words)], capture_output=True, text=True)


@pytest.fixture(scope="module")
def body():
    return kerf.bind(*PLATE)


# --- As the program ---

WAYS = {
    "alone": ({}, []),
    "millimetres": ({"scale": 0.5}, ["--scale", "0.5"]),
    "finer": ({"collision_triangles": 300}, ["--triangles", "300"]),
    "material": ({"young": 3e5, "poisson": 0.3, "density": 900}, ["--young", "3e5", "--poisson", "0.3", "--density", "900"]),
    "exact": ({"exact_paths": True}, ["--exact"]),
}


def bent(mesh):
    """Coordinates with all their digits."""
    points = mesh[0] + 0.0
    points[:, 2] += np.sin(20 * points[:, 0]) / 300 + points[:, 1] ** 2 / 3
    return points, mesh[1]


@pytest.mark.parametrize("way", WAYS)
def test_the_bytes_are_those_of_the_program(way, tmp_path):
    arguments, words = WAYS[way]
    mesh = bent(PLATE)
    done = run("bind", write_obj(tmp_path / "plate.obj", mesh), "--out", tmp_path / "program.kerf", *words)
    assert done.returncode == 0, done.stderr
    kerf.bind(*mesh, **arguments).save(tmp_path / "array.kerf")
    kerf.bind(tmp_path / "plate.obj", **arguments).save(tmp_path / "file.kerf")
    wanted = (tmp_path / "program.kerf").read_bytes()
    assert (tmp_path / "array.kerf").read_bytes() == wanted and (tmp_path / "file.kerf").read_bytes() == wanted


def test_with_a_mid_surface_too(tmp_path):
    visual, collision = write_obj(tmp_path / "v.obj", PLATE), write_obj(tmp_path / "c.obj", MIDDLE)
    assert run("bind", visual, "--collision", collision, "--out", tmp_path / "program.kerf").returncode == 0
    wanted = (tmp_path / "program.kerf").read_bytes()
    for given in (MIDDLE, list(MIDDLE), collision, str(collision)):
        body = kerf.bind(*PLATE, collision=given)
        body.save(tmp_path / "mine.kerf")
        assert (tmp_path / "mine.kerf").read_bytes() == wanted
        assert body.diagnosis is None and len(body.collision_triangles) == len(MIDDLE[1])
    assert np.abs(body.collision_vertices - MIDDLE[0]).max() < 1e-3  # its border is led to the rim


def test_models_by_name(tmp_path):
    assert run("bind", "meniscus", "--out", tmp_path / "program.kerf").returncode == 0
    body = kerf.bind("meniscus")
    body.save(tmp_path / "mine.kerf")
    assert (tmp_path / "mine.kerf").read_bytes() == (tmp_path / "program.kerf").read_bytes()
    assert kerf.Session(body).name == "scene" and body.diagnosis is None
    with pytest.raises(ValueError, match="model"):
        kerf.bind("meniscus", scale=0.001)


def test_open_sheets(tmp_path):
    sheet = middle(20)
    file = write_obj(tmp_path / "sheet.obj", sheet)
    with pytest.raises(kerf.Error, match="is an open surface .*thickness"):
        kerf.bind(*sheet)
    assert run("bind", file, "--thickness", "0.004", "--out", tmp_path / "program.kerf").returncode == 0
    body = kerf.bind(*sheet, thickness=0.004)
    body.save(tmp_path / "mine.kerf")
    assert (tmp_path / "mine.kerf").read_bytes() == (tmp_path / "program.kerf").read_bytes() and not body.closed


def sheet_with_a_seam(seam):
    """A sheet of 4 x 4 squares whose lowest rows of vertices are there twice in the middle, with a texture that differs: points, triangles, uv."""
    points, numbers = [], {}

    def number(x, y, side):
        key = (x, y, side and x == 2 and y < seam)
        if key not in numbers:
            numbers[key] = len(points)
            points.append((x / 10, y / 10, 0, x / 8 + key[2] / 2, y / 8))
        return numbers[key]

    squares = [[number(x + i, y + j, x >= 2) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))] for x in range(4) for y in range(4)]
    triangles = np.array([corners for a, b, c, d in squares for corners in ((a, b, c), (a, c, d))])
    return np.array(points)[:, :3], triangles, np.array(points)[:, 3:]


@pytest.mark.parametrize("seam", [2, 5])
def test_a_texture_tells_seams_from_slits(tmp_path, seam):
    points, triangles, uv = sheet_with_a_seam(seam)
    lines = [f"v {x} {y} {z}\nvt {u} {v}" for (x, y, z), (u, v) in zip(points, uv, strict=True)]
    lines += ["f " + " ".join(f"{i}/{i}" for i in row) for row in triangles + 1]
    (tmp_path / "sheet.obj").write_text("\n".join([*lines, ""]))
    assert run("bind", tmp_path / "sheet.obj", "--thickness", "0.01", "--out", tmp_path / "program.kerf").returncode == 0
    mesh = types.SimpleNamespace(vertices=points, faces=triangles, visual=types.SimpleNamespace(uv=uv))
    poly = Poly(points, row(triangles))
    poly.active_texture_coordinates = uv
    for body in (kerf.bind(points, triangles, uv=uv, thickness=0.01), kerf.bind(points, triangles, uv=uv[triangles], thickness=0.01),
                 kerf.bind(mesh, thickness=0.01), kerf.bind(poly, thickness=0.01), kerf.bind((points, triangles), uv=uv.tolist(), thickness=0.01)):
        assert len(body.vertices) == 25
        body.save(tmp_path / "mine.kerf")
        assert (tmp_path / "mine.kerf").read_bytes() == (tmp_path / "program.kerf").read_bytes()
    # Without it they are slits, or parts.
    assert len(kerf.bind(points, triangles, thickness=0.01, weld=1e-9).vertices) == 25
    if seam == 5:
        with pytest.raises(kerf.Error, match="2 separate bodies"):
            kerf.bind(points, triangles, thickness=0.01)
    else:
        assert len(kerf.bind(points, triangles, thickness=0.01).vertices) == 25 + seam


def test_texture_of_trimesh_itself(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    points, triangles, uv = sheet_with_a_seam(5)
    mesh = trimesh.Trimesh(points, triangles, visual=trimesh.visual.TextureVisuals(uv=uv), process=False)
    assert len(kerf.bind(mesh, thickness=0.01).vertices) == 25
    plain = trimesh.Trimesh(points, triangles, process=False)
    with pytest.raises(kerf.Error, match="2 separate bodies"):
        kerf.bind(plain, thickness=0.01)


@pytest.mark.parametrize("uv, error, words", [
    (np.zeros((3, 2)), ValueError, r"uv must be an array of shape \(338, 2\), not of shape \(3, 2\)"), (np.zeros((338, 3)), ValueError, "uv must be"),
    (np.zeros((5, 3, 2)), ValueError, "uv must be"), (np.full((338, 2), np.nan), ValueError, "uv must be finite"), ("uv", TypeError, "uv must be"),
    (np.full((338, 2), 1e300), ValueError, "float32"), ([[1, 2], [1]], ValueError, "differ in length")])
def test_texture_coordinates_that_are_none(uv, error, words):
    assert len(PLATE[0]) == 338
    with pytest.raises(error, match=words):
        kerf.bind(*PLATE, uv=uv)


def test_files_and_models_have_their_own_texture(tmp_path):
    with pytest.raises(ValueError, match="a file brings its own"):
        kerf.bind(write_obj(tmp_path / "plate.obj", PLATE), uv=np.zeros((338, 2)))
    with pytest.raises(ValueError, match="is a model"):
        kerf.bind("meniscus", uv=np.zeros((338, 2)))


def test_sessions_have_the_bits_of_the_program_s_file(body, tmp_path):
    assert run("bind", write_obj(tmp_path / "plate.obj", PLATE), "--out", tmp_path / "plate.kerf").returncode == 0
    sessions = [kerf.Session(tmp_path / "plate.kerf"), kerf.Session(body), kerf.Session(kerf.load(tmp_path / "plate.kerf"))]
    for session in sessions:
        session.cut(ACROSS)
        session.step(20)
    assert len({session.hash for session in sessions}) == 1


# --- What is bound ---


def test_vertices_stay_and_volume_and_area_too(body):
    trimesh = pytest.importorskip("trimesh")
    n = len(PLATE[0])
    assert (body.vertices[:n] == PLATE[0]).all() and len(body.vertices) > n
    mesh = trimesh.Trimesh(body.vertices, body.triangles, process=False)
    assert mesh.is_watertight and mesh.is_winding_consistent and body.closed
    assert mesh.volume == pytest.approx(0.12 * 0.10 * 0.01, rel=1e-9)
    assert mesh.area == pytest.approx(2 * (0.12 * 0.10 + 0.12 * 0.01 + 0.10 * 0.01), rel=1e-9)
    sheet = trimesh.Trimesh(body.collision_vertices, body.collision_triangles, process=False)
    assert not sheet.is_watertight and sheet.euler_number == 1
    assert sheet.area == pytest.approx(0.12 * 0.10, rel=0.05)


def test_arrays_of_a_body(body):
    for name, dtype in (("vertices", np.float64), ("triangles", np.int32), ("collision_vertices", np.float64), ("collision_triangles", np.int32)):
        array = getattr(body, name)
        assert array.dtype == dtype and array.ndim == 2 and array.shape[1] == 3 and not array.flags.writeable
        assert getattr(body, name) is array
    assert body.triangles.max() == len(body.vertices) - 1
    assert str(len(body.triangles)) in repr(body)
    with pytest.raises(TypeError):
        kerf.Body()


def test_a_cut_body_is_closed_and_weighs_the_same(body):
    pytest.importorskip("trimesh")
    session = kerf.Session(body)
    session.cut(ACROSS)
    mesh = session.to_trimesh()
    assert mesh.is_watertight and session.counts["pieces"] == 2 and mesh.euler_number == 4
    assert mesh.volume == pytest.approx(0.12 * 0.10 * 0.01, rel=1e-3)
    wall = mesh.area_faces[mesh.face_attributes["wall"] == 1].sum()
    assert wall == pytest.approx(2 * 0.10 * 0.01, rel=0.02)  # both lips of a cut across


def test_notes_tell_what_was_mended(tmp_path):
    points, triangles = PLATE
    body = kerf.bind(np.concatenate([points, points[:1] + 5]), np.concatenate([triangles, triangles[:1]]))
    assert any("duplicate" in note or "twice" in note for note in body.notes), body.notes
    assert all(note in kerf.Session(body).notes for note in body.notes)


def test_how_the_collision_mesh_was_judged(body):
    verdict = body.diagnosis
    assert verdict["thinness"] == "thin" and verdict["reasons"] == []
    assert verdict["width_over_thickness"] == pytest.approx(10, rel=0.15)  # twice 0.05 to the rim, over 0.01
    assert verdict["quality"]["mean_half_thickness"] == pytest.approx(0.005, rel=0.05)
    assert verdict["volume_ratio"] == pytest.approx(1, abs=0.1)
    surface = verdict["surface"]
    for name in ("side", "confidence", "thickness", "flag"):
        assert surface[name].shape == (len(surface["triangles"]),)
    x, y, z = surface["vertices"][surface["triangles"]].mean(axis=1).T
    faces = [surface["side"][(np.abs(x) < 0.04) & (np.abs(y) < 0.03) & (sign * z > 0)] for sign in (1, -1)]
    assert [{*np.sign(face)} for face in faces] in ([{1}, {-1}], [{-1}, {1}])


def test_the_diagnosis_is_what_the_program_saves(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    mesh = bent(PLATE)
    done = run("bind", write_obj(tmp_path / "plate.obj", mesh), "--out", tmp_path / "plate.kerf", "--write-collision", tmp_path / "middle.obj",
               "--diagnose", tmp_path / "judged.ply")
    assert done.returncode == 0, done.stderr
    body = kerf.bind(*mesh)
    for mine in (body.diagnosis, body.diagnosis["surface"]):
        mine.clear()
    diagnosis = body.diagnosis
    made = trimesh.load_mesh(tmp_path / "middle.obj", process=False, maintain_order=True)
    assert (made.vertices == diagnosis["collision"]["vertices"]).all() and (made.faces == diagnosis["collision"]["triangles"]).all()
    judged = trimesh.load_mesh(tmp_path / "judged.ply", process=False)
    assert len(judged.faces) == len(diagnosis["surface"]["triangles"])
    again = kerf.bind(*mesh, collision=(diagnosis["collision"]["vertices"], diagnosis["collision"]["triangles"]))
    again.save(tmp_path / "again.kerf")
    assert (tmp_path / "again.kerf").read_bytes() == (tmp_path / "plate.kerf").read_bytes()


def test_what_is_not_thin_is_refused_in_the_program_s_words(tmp_path):
    file = write_obj(tmp_path / "ball.obj", ball())
    done = run("bind", file, "--out", tmp_path / "ball.kerf")
    assert done.returncode != 0
    with pytest.raises(kerf.Error) as caught:
        kerf.bind(file)
    assert str(caught.value) in done.stderr
    with pytest.raises(kerf.Error) as by_arrays:
        kerf.bind(*ball())
    assert str(by_arrays.value) == str(caught.value).replace(str(file), "the mesh")
    assert by_arrays.value.diagnosis["thinness"] == "not thin" and by_arrays.value.diagnosis["reasons"]
    assert by_arrays.value.diagnosis["reasons"][0] in str(by_arrays.value)
    with pytest.raises(kerf.Error) as other:
        kerf.bind(file, collision=file)
    assert other.value.diagnosis is None


# --- Files ---


def test_load_gives_back_what_was_saved(tmp_path):
    body = kerf.bind(*PLATE, young=1e5)
    body.save(tmp_path / "a.kerf")
    again = kerf.load(tmp_path / "a.kerf")
    again.save(str(tmp_path / "b.kerf"))
    assert (tmp_path / "a.kerf").read_bytes() == (tmp_path / "b.kerf").read_bytes()
    assert (again.vertices == body.vertices).all() and (again.triangles == body.triangles).all() and again.diagnosis is None
    assert [path.name for path in sorted(tmp_path.iterdir())] == ["a.kerf", "b.kerf"]


def test_nothing_replaces_what_it_was_made_from(tmp_path):
    visual, collision = write_obj(tmp_path / "v.obj", PLATE), write_obj(tmp_path / "c.obj", MIDDLE)
    body = kerf.bind(visual, collision=collision)
    (tmp_path / "link.kerf").symlink_to(visual)
    before = visual.read_bytes()
    for path, what in ((visual, "visual mesh"), (collision, "collision mesh"), (tmp_path / "link.kerf", "visual mesh")):
        with pytest.raises(kerf.Error, match=f"would replace the {what}"):
            body.save(path)
    assert visual.read_bytes() == before
    body.save(tmp_path / "a.kerf")
    body.save(tmp_path / "a.kerf")  # its own result may be written anew
    with pytest.raises(kerf.Error, match="would replace the body"):
        kerf.load(tmp_path / "a.kerf").save(tmp_path / "a.kerf")


@pytest.mark.parametrize("path, error", [(5, TypeError), (None, TypeError), (b"a.kerf", TypeError), ("a\0b", ValueError), ("", kerf.Error), ("/", kerf.Error),
                                         ("/no/such/folder/a.kerf", kerf.Error), (os.fsdecode(b"\xff.kerf"), kerf.Error)])
def test_paths_that_are_none(body, path, error):
    with pytest.raises(error):
        body.save(path)
    with pytest.raises(error):
        kerf.load(path)


def test_files_that_are_no_bodies(tmp_path):
    for name, content in (("a.kerf", b""), ("b.kerf", b"KERFBODY" + bytes(200)), ("c.kerf", b"hello" * 100)):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(kerf.Error, match=name):
            kerf.load(tmp_path / name)
    with pytest.raises(kerf.Error, match="plate.xyz"):
        kerf.bind(tmp_path / "plate.xyz")


# --- Scenes ---


def test_bodies_in_scenes(body):
    scene = {"body": {"bound": body, "position": [0, 0, 0.3], "rotation": [0, 0, 0.5]}, "simulation": {"gravity": [0, 0, 0]}}
    session = kerf.Session(scene)
    assert scene["body"]["bound"] is body  # the dict is as it was
    assert session.rest_positions[:, 2].min() == pytest.approx(0.295) and session.rest_positions[:, 2].max() == pytest.approx(0.305)
    two = kerf.Session({"body": [{"bound": body}, {"bound": kerf.bind(*plate(8)), "position": [0, 0, 0.1]}, {"bound": body, "position": [0, 0, 0.2]}]})
    assert two.counts["pieces"] == 3
    two.step(2)


def test_a_body_s_material_counts_where_the_scene_says_none():
    light, heavy = (kerf.bind(*PLATE, collision=MIDDLE, density=density) for density in (500, 2000))

    def weight(body, **more):
        scene = {"body": {"bound": body}, "fix": [{"half_space": {"point": [0, 0.04, 0], "normal": [0, 1, 0]}}],
                 "simulation": {"time_step": 0.01, "tolerance": 1e-8}, "material": {"damping_mass": 40, **more}}
        session = kerf.Session(scene)
        session.step(100)
        return session.support_force[2]

    assert weight(light, young=1e6) == pytest.approx(500 * 0.12 * 0.10 * 0.01 * 9.81, rel=0.02)
    assert weight(heavy, young=1e6) == pytest.approx(2000 * 0.12 * 0.10 * 0.01 * 9.81, rel=0.02)
    assert weight(heavy, young=1e6, density=1000) == pytest.approx(1000 * 0.12 * 0.10 * 0.01 * 9.81, rel=0.02)


def test_a_body_outlives_its_session_and_serves_many_threads(body):
    hashes = []

    def work():
        session = kerf.Session(body)
        session.cut(ACROSS)
        session.step(5)
        hashes.append(session.hash)
        session.close()

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(hashes) == 4 and len({*hashes}) == 1


def test_bodies_elsewhere_in_scenes(body):
    for scene in ({"body": body}, {"body": {"visual": body}}, {"body": {"bound": [body]}}, {"body": {"bound": body}, "title": body}):
        with pytest.raises(TypeError, match='"bound": body'):
            kerf.Session(scene)
    with pytest.raises(kerf.Error, match="no file"):
        kerf.Session({"body": {"bound": "<kerf.Body 1>"}})
    with pytest.raises(kerf.Error, match="thickness"):
        kerf.Session({"body": {"bound": body, "thickness": 0.1}})


# --- Meshes of other packages ---


class Poly:
    """What pyvista.PolyData shows of itself."""

    def __init__(self, points, faces):
        self.points, self.faces = points, faces


def row(triangles):
    return np.column_stack([np.full(len(triangles), 3), triangles]).ravel()


def test_trimesh(body):
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.Trimesh(*PLATE, process=False)
    same(kerf.bind(mesh), body)
    same(kerf.bind(trimesh.Scene([mesh])), body)  # as of a .glb
    with pytest.raises(TypeError, match="holds 2 meshes.*to_mesh"):
        kerf.bind(trimesh.Scene([mesh, mesh]))
    disc = trimesh.creation.cylinder(radius=0.05, height=0.008, sections=64)
    bound = kerf.bind(disc)
    assert trimesh.Trimesh(bound.vertices, bound.triangles, process=False).volume == pytest.approx(disc.volume, rel=1e-9)


@pytest.mark.parametrize("unit, metres", [("mm", 1e-3), ("millimeters", 1e-3), ("Inches", 0.0254), ("centimetres", 0.01), ("m", 1), (None, 1), ("unitless", 1)])
def test_units_that_a_mesh_knows(unit, metres):
    mesh = types.SimpleNamespace(vertices=PLATE[0] / metres, faces=PLATE[1], units=unit)
    same(kerf.bind(mesh), kerf.bind(PLATE[0] / metres, PLATE[1], scale=metres))
    same(kerf.bind(mesh, scale=0.5 * metres), kerf.bind(PLATE[0] / metres, PLATE[1], scale=0.5 * metres))


def test_two_units_are_refused():
    visual = types.SimpleNamespace(vertices=PLATE[0], faces=PLATE[1], units="m")
    with pytest.raises(ValueError, match=r"in units of 1 m, its collision mesh in units of 0\.001 m"):
        kerf.bind(visual, collision=types.SimpleNamespace(vertices=MIDDLE[0], faces=MIDDLE[1], units="mm"))
    same(kerf.bind(visual, collision=types.SimpleNamespace(vertices=MIDDLE[0], faces=MIDDLE[1], units="metres")), kerf.bind(*PLATE, collision=MIDDLE))


def test_units_of_trimesh_itself(body):
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.Trimesh(1000 * PLATE[0], PLATE[1], process=False)
    mesh.units = "mm"
    assert np.ptp(kerf.bind(mesh).vertices[:, 0]) == pytest.approx(0.12)
    assert np.ptp(kerf.bind(trimesh.Scene([mesh])).vertices[:, 0]) == pytest.approx(0.12)
    with pytest.raises(ValueError, match="'parsecs', which is no unit known here; give scale"):
        kerf.bind(types.SimpleNamespace(vertices=PLATE[0], faces=PLATE[1], units="parsecs"))


def test_meshio(body):
    meshio = pytest.importorskip("meshio")
    points, triangles = PLATE
    same(kerf.bind(meshio.Mesh(points, [("triangle", triangles)])), body)
    same(kerf.bind(meshio.Mesh(points, [("triangle", triangles[:50]), ("line", [[0, 1]]), ("triangle", triangles[50:])])), body)
    with pytest.raises(ValueError, match="tetra"):
        kerf.bind(meshio.Mesh(points, [("triangle", triangles), ("tetra", [[0, 1, 2, 3]])]))
    with pytest.raises(ValueError, match="empty"):
        kerf.bind(meshio.Mesh(points, [("line", [[0, 1]])]))
    with pytest.raises(ValueError, match="shape"):
        kerf.bind(meshio.Mesh(points[:, :2], [("triangle", triangles)]))


def test_polydata(body):
    points, triangles = PLATE
    same(kerf.bind(Poly(points, row(triangles))), body)
    same(kerf.bind(*PLATE, collision=Poly(MIDDLE[0], row(MIDDLE[1]))), kerf.bind(*PLATE, collision=MIDDLE))
    for faces, words in (([4, 0, 1, 2, 3, 3, 0, 1], "the last of the faces .* has 3 corners, of which 2 are there"), ([3, 0, 1, 2, 2, 0, 1], r"faces\[1\] has 2 corners"),
                         ([3, 0, 1, 2, -3], "corners"), ([3, 0, 1, 2, 4, 0, 1, 2, 999], r"faces\[1\] has the vertex 999"), ([], "empty"), ([3, 0, 1], "2 are there")):
        with pytest.raises(ValueError, match=words):
            kerf.bind(Poly(points, np.array(faces, np.int64)))
    with pytest.raises(TypeError, match="whole numbers"):
        kerf.bind(Poly(points, np.array([3, 0, 1, 2.5])))
    grid = types.SimpleNamespace(points=points, cells=np.array([4, 0, 1, 2, 3]), celltypes=np.array([10]))
    with pytest.raises(ValueError, match=r"\.extract_surface\(\)"):
        kerf.bind(grid)


def polygons(points):
    """An L of five faces, upright: its outlines above and below have a corner that turns in, and the sides are quads."""
    n = len(points) // 2
    return [list(range(n))[::-1], list(range(n, 2 * n))] + [[i, (i + 1) % n, n + (i + 1) % n, n + i] for i in range(n)]


OUTLINE = np.array([(0, 0), (0.1, 0), (0.1, 0.04), (0.04, 0.04), (0.04, 0.1), (0, 0.1)])


def test_polygons_are_divided_as_those_of_files(tmp_path):
    points = np.array([(x, y, z) for z in (0, 0.006) for x, y in OUTLINE])
    faces = polygons(points)
    faces[0], faces[1] = faces[0][4:] + faces[0][:4], faces[1][1:] + faces[1][:1]  # from a corner whose fan leaves the L
    lines = [f"v {x} {y} {z}" for x, y, z in points.tolist()] + ["f " + " ".join(str(i + 1) for i in face) for face in faces]
    (tmp_path / "l.obj").write_text("\n".join([*lines, ""]))
    expected = kerf.bind(tmp_path / "l.obj")
    a, b, c = np.moveaxis(expected.vertices[expected.triangles], 1, 0)
    assert (a * np.cross(b, c)).sum() / 6 == pytest.approx((0.01 - 0.06 ** 2) * 0.006, rel=1e-9)
    same(kerf.bind(Poly(points, np.concatenate([[len(face), *face] for face in faces]))), expected)
    block = lambda kind, rows: types.SimpleNamespace(type=kind, data=rows)  # noqa: E731
    cells = [block("polygon", faces[:2]), block("quad", np.array(faces[2:], np.uint64))]
    same(kerf.bind(types.SimpleNamespace(points=points, cells=cells)), expected)
    cells[0].data = np.array(faces[:2])
    same(kerf.bind(types.SimpleNamespace(points=points, cells=cells)), expected)


def test_polygons_of_the_packages_themselves():
    points = np.array([(x, y, z) for z in (0, 0.006) for x, y in OUTLINE])
    faces = polygons(points)
    expected = kerf.bind(Poly(points, np.concatenate([[len(face), *face] for face in faces])))
    meshio = pytest.importorskip("meshio")
    same(kerf.bind(meshio.Mesh(points, [("polygon", faces[:2]), ("quad", faces[2:])])), expected)
    pyvista = pytest.importorskip("pyvista")
    same(kerf.bind(pyvista.PolyData(points, np.concatenate([[len(face), *face] for face in faces]))), expected)


def test_pyvista_itself(body):
    pyvista = pytest.importorskip("pyvista")
    same(kerf.bind(pyvista.PolyData(PLATE[0], row(PLATE[1]))), body)
    assert not kerf.bind(pyvista.Plane(i_size=0.1, j_size=0.1), thickness=0.004).closed  # quads with a texture


def same(a, b):
    assert (a.vertices == b.vertices).all() and (a.triangles == b.triangles).all()
    assert (a.collision_vertices == b.collision_vertices).all() and (a.collision_triangles == b.collision_triangles).all()


# --- What is wrong ---

POINTS, TRIANGLES = PLATE


@pytest.mark.parametrize("vertices, error", [
    (POINTS[:, :2], ValueError), (POINTS.ravel(), ValueError), (POINTS[None], ValueError), (np.empty((0, 3)), ValueError), ([], ValueError),
    (np.where(POINTS == POINTS[0], np.nan, POINTS), ValueError), (np.where(POINTS == POINTS[0], np.inf, POINTS), ValueError),
    (POINTS.astype(complex), TypeError), (POINTS.astype(object), TypeError), (POINTS.astype(str), TypeError), (POINTS > 0, TypeError),
    ([[0, 0, 0], [1, 1]], ValueError), (None, TypeError), (7, ValueError), ({}, TypeError), (POINTS * 1e300, kerf.Error),
    (np.zeros_like(POINTS), kerf.Error), (POINTS + 1e9, kerf.Error), (POINTS.astype("datetime64[s]"), TypeError)])
def test_vertices_that_are_none(vertices, error):
    with pytest.raises(error):
        kerf.bind(vertices, TRIANGLES)


@pytest.mark.parametrize("triangles, error", [
    (TRIANGLES[:, :2], ValueError), (TRIANGLES.ravel(), ValueError), (TRIANGLES[:0], ValueError), ([], ValueError), (TRIANGLES + 1, ValueError),
    (TRIANGLES - 1, ValueError), (TRIANGLES.astype(float), TypeError), (TRIANGLES > 0, TypeError), (TRIANGLES.astype(object), TypeError),
    ([["a", "b", "c"]], TypeError), ([[0, 1, 2], [0, 1]], ValueError), (5, ValueError), ({}, TypeError), (np.full((1, 3), 2**63, np.uint64), ValueError),
    ([[0, 1, 2**100]], TypeError), ([[0, 0, 0]], kerf.Error), ([[0, 1, 2]], kerf.Error), (TRIANGLES[:-1], kerf.Error)])
def test_triangles_that_are_none(triangles, error):
    with pytest.raises(error):
        kerf.bind(POINTS, triangles)


def test_triangles_that_can_be_mended(body):
    for triangles in (TRIANGLES[:, ::-1], np.concatenate([TRIANGLES] * 2)):
        mended = kerf.bind(POINTS, triangles)
        a, b, c = np.moveaxis(mended.vertices[mended.triangles], 1, 0)
        assert (a * np.cross(b, c)).sum() / 6 == pytest.approx(0.12 * 0.10 * 0.01, rel=1e-9) and mended.notes


def test_messages_say_where(body):
    with pytest.raises(ValueError, match=r"triangles\[7\] has the vertex 99999, but there are"):
        wrong = TRIANGLES.copy()
        wrong[7, 1] = 99999
        kerf.bind(POINTS, wrong)
    with pytest.raises(ValueError, match="collision triangles is empty"):
        kerf.bind(POINTS, TRIANGLES, collision=(POINTS, []))
    with pytest.raises(ValueError, match="collision vertices must be finite"):
        kerf.bind(POINTS, TRIANGLES, collision=(MIDDLE[0] * np.nan, MIDDLE[1]))
    with pytest.raises(kerf.Error, match="the collision mesh"):
        kerf.bind(POINTS, TRIANGLES, collision=PLATE)


@pytest.mark.parametrize("mesh", [POINTS, [POINTS] * 3, 5, None, object(), b"plate.obj", {"vertices": POINTS}, types.SimpleNamespace(points=POINTS)])
def test_what_is_no_mesh(mesh):
    with pytest.raises(TypeError):
        kerf.bind(mesh)
    with pytest.raises((TypeError, ValueError)):
        kerf.bind(*PLATE, collision=mesh if mesh is not None else 3)


@pytest.mark.parametrize("options, error", [
    ({"scale": 0}, ValueError), ({"scale": -1}, ValueError), ({"scale": np.nan}, ValueError), ({"scale": np.inf}, ValueError), ({"scale": "1"}, TypeError),
    ({"scale": True}, TypeError), ({"scale": 10**400}, ValueError), ({"scale": 1e-300}, kerf.Error), ({"scale": 1e300}, kerf.Error),
    ({"thickness": 0}, ValueError), ({"thickness": [1]}, TypeError), ({"young": -5}, ValueError), ({"poisson": 0.5}, ValueError),
    ({"poisson": np.nan}, ValueError), ({"density": 1j}, TypeError), ({"collision_triangles": 7}, ValueError), ({"collision_triangles": 10**30}, ValueError),
    ({"collision_triangles": 100.0}, TypeError), ({"collision_triangles": 100, "collision": MIDDLE}, ValueError), ({"unknown": 1}, TypeError)])
def test_options_that_are_none(options, error):
    with pytest.raises(error):
        kerf.bind(*PLATE, **options)


@pytest.mark.parametrize("vertices, triangles", [
    (POINTS.astype(np.float64).tolist(), TRIANGLES.tolist()), (np.asfortranarray(POINTS), np.asfortranarray(TRIANGLES)),
    (np.repeat(POINTS, 2, axis=0)[::2], np.repeat(TRIANGLES, 2, axis=1)[:, ::2]), (POINTS, TRIANGLES.astype(np.uint16)),
    (POINTS, TRIANGLES.astype(">i8")), (POINTS.astype(">f8"), TRIANGLES.astype(np.uint64)), (POINTS.astype(np.longdouble), TRIANGLES)])
def test_arrays_of_other_layouts(body, vertices, triangles):
    same(kerf.bind(vertices, triangles), body)


def test_meshes_whose_parts_raise():
    class Broken:
        @property
        def vertices(self):
            raise RuntimeError("mine")

        faces = TRIANGLES

    with pytest.raises(RuntimeError, match="mine"):
        kerf.bind(Broken())


# --- Python's lock, Ctrl-C ---


def test_others_go_on_and_ctrl_c_ends_it():
    large = plate(120)
    longest, last = 0.0, time.perf_counter()
    thread = threading.Thread(target=lambda: kerf.bind(*large))
    began = time.perf_counter()
    thread.start()
    while thread.is_alive():
        time.sleep(0.001)
        now = time.perf_counter()
        longest, last = max(longest, now - last), now
    whole = time.perf_counter() - began
    print(f"\nbinding: {whole:.2f} s, longest pause {longest:.3f} s")
    assert longest < 0.5 * whole
    signal.signal(signal.SIGALRM, signal.default_int_handler)
    signal.setitimer(signal.ITIMER_REAL, 0.3 * whole)
    began = time.perf_counter()
    try:
        with pytest.raises(KeyboardInterrupt):
            while True:
                kerf.bind(*large)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
    assert time.perf_counter() - began < 0.3 * whole + 5


def test_none_of_the_packages_is_imported():
    code = "import sys, kerf; kerf.bind; assert not {'numpy', 'trimesh', 'pyvista', 'meshio'} & {*sys.modules}"
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy])
def test_a_copy_of_a_body_is_that_body(copied):
    body = kerf.bind("sheet")
    assert copied(body) is body and copied([body])[0] is body


@pytest.mark.parametrize("protocol", range(3, pickle.HIGHEST_PROTOCOL + 1))
def test_a_pickled_body_is_the_same_to_the_bit(tmp_path, protocol):
    body = kerf.bind("steak", young=12e3, density=1050)
    data = pickle.dumps(body, protocol)
    again = pickle.loads(data)
    for name in ("vertices", "triangles", "collision_vertices", "collision_triangles"):
        assert np.array_equal(getattr(again, name), getattr(body, name))
    body.save(tmp_path / "a.kerf")
    again.save(tmp_path / "b.kerf")
    assert (tmp_path / "a.kerf").read_bytes() == (tmp_path / "b.kerf").read_bytes() and len(data) < 1.01 * (tmp_path / "a.kerf").stat().st_size
    sessions = [kerf.Session(made) for made in (body, again)]
    for session in sessions:
        session.cut([[[0, -0.2, 0.1], [0, -0.2, -0.1]], [[0, 0, 0.1], [0, 0, -0.1]]])
        session.step(20)
    assert sessions[0].hash == sessions[1].hash and sessions[0].name == sessions[1].name


def test_a_body_is_unpickled_in_another_process():
    code = "import pickle, sys, kerf; print(kerf.Session(pickle.load(sys.stdin.buffer)).hash)"
    body = kerf.bind("meniscus")
    done = subprocess.run([sys.executable, "-c", code], input=pickle.dumps(body), capture_output=True, check=True)
    assert int(done.stdout) == kerf.Session(body).hash


def test_a_damaged_pickle_of_a_body_is_refused():
    make, (data, title) = kerf.bind("sheet").__reduce_ex__(4)
    for wrong in (b"", b"KERFBODY", data[:-1], data[:1000] + bytes([data[1000] ^ 1]) + data[1001:]):
        with pytest.raises(kerf.Error, match="a pickled body"):
            make(wrong, title)
