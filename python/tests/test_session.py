"""A session as its users meet it: scenes in, cuts, arrays out."""

import re
from pathlib import Path

import numpy as np
import pytest

import kerf

ACROSS = [[[0, -0.10, 0.05], [0, -0.10, -0.05]], [[0, 0.12, 0.05], [0, 0.12, -0.05]]]


@pytest.fixture
def steak():
    return kerf.Session({"body": {"model": "steak"}, "simulation": {"time_step": 0.002}})


def cut_run():
    session = kerf.Session({"body": {"model": "steak"}})
    assert session.cut(ACROSS)
    session.step(20)
    return session


def examples_of(folder):
    readme = (Path(__file__).parents[folder] / "README.md").read_text()
    return re.findall(r"```python\n(.*?)```", readme, re.S)


def test_the_example_of_the_readme(capsys):
    exec(*examples_of(2), {})
    assert capsys.readouterr().out.startswith("2 (")


def test_meshes_and_tasks_of_the_readme_of_the_package(tmp_path, monkeypatch):
    pytest.importorskip("trimesh")
    pytest.importorskip("gymnasium")
    monkeypatch.chdir(tmp_path)
    _, meshes, learning = examples_of(1)
    names = {"kerf": kerf}
    exec(meshes, names)
    assert kerf.load(tmp_path / "disc.kerf").triangles.shape == names["body"].triangles.shape
    exec(learning, names)
    assert np.isfinite(names["reward"])
    names["env"].close()


def test_the_example_of_the_readme_of_the_package(capsys):
    names = {}
    exec(examples_of(1)[0], names)
    pieces, rest = capsys.readouterr().out.split(" ", 1)
    force = [float(number) for number in re.findall(r"\[([^]]*)\]", rest)[1].split()]
    assert pieces == "3" and force[1] < 0 < force[2]  # pulled outwards and up
    session = names["session"]
    assert session.redo_depth == 1 and session.counts["pieces"] == 2
    session.validate()


def test_a_steak_is_cut_in_two(steak):
    assert steak.counts["pieces"] == 1
    assert steak.cut(ACROSS)
    steak.validate()
    assert steak.counts["pieces"] == 2
    steak.step(10)
    assert steak.time == pytest.approx(0.02)
    assert np.isfinite(steak.positions).all()
    assert steak.positions.shape == (steak.counts["visual_vertices"], 3)
    assert steak.triangles.shape == (steak.counts["visual_triangles"], 3)
    assert steak.hexahedra.shape == (steak.counts["hexahedra"], 8)
    assert steak.triangles.max() == len(steak.positions) - 1
    assert steak.hexahedra.max() < len(steak.nodes)


def test_same_input_same_bits():
    one, other = cut_run(), cut_run()
    assert one.hash == other.hash
    assert (one.positions == other.positions).all()


def test_undo_and_redo(steak):
    before = steak.hash
    steak.cut(ACROSS)
    after = steak.hash
    steak.undo()
    assert steak.hash == before
    steak.redo()
    assert steak.hash == after
    with pytest.raises(kerf.Error):
        steak.redo()


def test_a_stroke_by_hand(steak):
    with steak.stroke(frame="world") as blade:
        assert blade.is_open and steak.in_stroke
        for y in np.linspace(-0.1, 0.1, 21):
            blade.move((0.01, y, 0.5), np.array([0.01, y, -0.5]))
            steak.step()
    assert steak.counts["pieces"] == 2
    assert not steak.in_stroke and not blade.is_open
    assert steak.undo_depth == 1
    steak.validate()


def test_a_stroke_can_be_taken_back(steak):
    before = steak.counts
    with steak.stroke() as blade:
        blade.move(*ACROSS[0])
        blade.move(*ACROSS[1])
        assert steak.counts != before
        blade.cancel()
    assert steak.counts == before


def test_what_was_cut_stays_after_an_exception(steak):
    with pytest.raises(ZeroDivisionError), steak.stroke() as blade:
        blade.move(*ACROSS[0])
        blade.move(*ACROSS[1])
        1 / 0
    assert steak.counts["pieces"] == 2
    steak.undo()
    assert steak.counts["pieces"] == 1


@pytest.mark.parametrize(("work", "moves"), [("undo", 0), ("undo", 1), ("redo", 0), ("redo", 1), ("redo", 2)])
@pytest.mark.parametrize("undone", [False, True])
def test_a_stroke_goes_on_where_undo_and_redo_fail(steak, work, moves, undone):
    if undone:
        steak.cut(np.array(ACROSS) + [0.03, 0, 0])
        steak.undo()
    with steak.stroke() as blade:
        for edge in ACROSS[:moves]:
            blade.move(*edge)
        before = steak.hash
        with pytest.raises(kerf.Error, match=f"there is no stroke to {work}; .*open"):
            getattr(steak, work)()
        assert blade.is_open and steak.hash == before
        for edge in ACROSS[min(moves, 1):]:
            blade.move(*edge)
    assert steak.counts["pieces"] == 2 and steak.undo_depth == 1
    steak.undo()
    assert steak.counts["pieces"] == 1


def test_a_stroke_that_has_not_begun_says_how(steak):
    for use in (lambda b: b.move(*ACROSS[0]), lambda b: b.end(), lambda b: b.cancel()):
        with pytest.raises(kerf.Error, match="has not begun; use `with`"):
            use(steak.stroke())


def test_a_session_without_the_commands_of_its_scene():
    poses = [{"time": 0, "base": [0, -0.2, 0.5], "tip": [0, -0.2, -0.5]}, {"time": 0.02, "base": [0, 0.2, 0.5], "tip": [0, 0.2, -0.5]}]
    scene = {"body": {"model": "steak"}, "command": [{"at": 0, "type": "blade", "frame": "rest", "poses": poses}]}
    idle = kerf.Session(scene, scripted=False, record=True)
    with idle.stroke() as blade:
        blade.move(*np.array(ACROSS[0]) + [0.03, 0, 0])
        idle.step(30)
        assert blade.is_open and idle.counts["pieces"] == 1
    assert idle.undo_depth == 0
    assert idle.recording().replay()["same"]  # it knows that they did not run
    busy = kerf.Session(scene, scripted=True)
    busy.step(30)
    assert busy.undo_depth == 1 and busy.counts["pieces"] == 2
    with pytest.raises(TypeError, match="scripted must be True or False"):
        kerf.Session(scene, scripted=0)


def test_a_cut_through_the_air_is_none(steak):
    assert not steak.cut(np.array(ACROSS) + [1, 0, 0])
    assert steak.undo_depth == 0


def test_snapshots(steak):
    state = steak.snapshot()
    before = steak.hash
    steak.cut(ACROSS)
    steak.step(5)
    cut_triangles = steak.triangles
    steak.restore(state)
    assert steak.hash == before
    assert len(steak.triangles) < len(cut_triangles)
    other = kerf.Session({"body": {"model": "sheet"}})
    with pytest.raises(kerf.Error, match="another session"):
        other.restore(state)


def test_restore_in_a_stroke_leaves_no_stroke(steak):
    with steak.stroke() as blade:
        blade.move(*ACROSS[0])
        state = steak.snapshot()
        blade.move(*ACROSS[1])
        steak.restore(state)
        assert not blade.is_open
        with pytest.raises(kerf.Error, match="over"):
            blade.move(*ACROSS[1])
    assert steak.counts["pieces"] == 1


def test_a_blade_of_the_scene_goes_on_after_restore():
    poses = [{"time": 0, "base": [0, -0.2, 0.5], "tip": [0, -0.2, -0.5]}, {"time": 0.3, "base": [0, 0.2, 0.5], "tip": [0, 0.2, -0.5]}]
    session = kerf.Session({"body": {"model": "steak"}, "command": [{"at": 0, "type": "blade", "frame": "rest", "poses": poses}]})
    while session.time < 0.15:
        session.step()
    assert session.in_stroke
    state, before = session.snapshot(), session.hash

    def rest_of_it():
        while session.time < 0.35:
            session.step()
        return session.hash

    after = rest_of_it()
    assert session.counts["pieces"] == 2
    session.restore(state)
    assert session.in_stroke and session.hash == before
    assert rest_of_it() == after


def test_every_shipped_scene_is_found():
    assert "steak" in kerf.scenes() and "trainer-knee" not in kerf.scenes()
    with pytest.raises(kerf.Error, match="medial-meniscus.obj"):  # it is found by its name
        kerf.Session("trainer-knee")
    for name in kerf.scenes():
        kerf.Session(name).close()
    session = kerf.Session("steak")
    assert session.title == "Steak, a straight and a curved cut"
    session.step(1)
    assert session.report()["kerf_report_version"] == 1


def test_text_path_and_dict_are_the_same(tmp_path):
    text = '[body]\nmodel = "sheet"\n[simulation]\ntime_step = 0.004\n[[fix]]\nhalf_space = { point = [0, 0, 0], normal = [0, 1, 0] }\n'
    path = tmp_path / "mine.toml"
    path.write_text(text)
    plain = {
        "body": {"model": "sheet"},
        "simulation": {"time_step": np.float64(0.004)},
        "fix": [{"half_space": {"point": np.zeros(3), "normal": (0, 1, 0)}}],
    }
    hashes = set()
    for scene in (text, path, str(path), plain):
        session = kerf.Session(scene)
        session.step(3)
        hashes.add(session.hash)
    assert len(hashes) == 1
    assert kerf.Session(path).name == "mine"


def test_strings_of_a_dict_are_quoted():
    title = 'a "steak" \\ with\ttabs\n and é'
    assert kerf.Session({"title": title, "body": {"model": "sheet"}}).title == title


def test_material_is_changed():
    scene = {"body": {"model": "strip"}, "material": {"young": 2e5, "damping_mass": 20.0}, "fix": [{"half_space": {"point": [-0.04, 0, 0], "normal": [-1, 0, 0]}}]}
    firm, soft = kerf.Session(scene), kerf.Session(scene)
    assert firm.material == {"young": 2e5, "poisson": firm.material["poisson"], "density": firm.material["density"]}
    soft.set_material(young=1e5)
    assert soft.material == {**firm.material, "young": 1e5}
    # A body that weighs half and is half as firm hangs the same.
    light = kerf.Session(scene)
    light.set_material(young=1e5, density=firm.material["density"] / 2)
    for session in (firm, soft, light):
        session.step(2000)
    sag = [session.positions[:, 2].min() for session in (firm, soft, light)]
    assert sag[2] == pytest.approx(sag[0], rel=1e-3)
    assert sag[1] < sag[0]
    assert light.uncut_mass == pytest.approx(firm.uncut_mass / 2)
    for wrong in ({"young": -1.0}, {"poisson": 0.6}, {"density": float("nan")}):
        with pytest.raises(kerf.Error):
            light.set_material(**wrong)
    with pytest.raises(TypeError):
        light.set_material(young="soft")
    before = light.material, light.gravity
    for word, beyond in (("young", 1e300), ("young", 1e-9), ("density", 1e9), ("density", 1e-9), ("poisson", 0.5)):
        words = f"{word} .*must be at .*, but is"
        with pytest.raises(kerf.Error, match=words):
            light.set_material(**{word: beyond})
        with pytest.raises(kerf.Error, match=words):
            kerf.Session({**scene, "material": {word: beyond}})
    with pytest.raises(kerf.Error, match="gravity goes from"):
        light.gravity = (0, 0, 1e300)
    assert (light.material, light.gravity) == before


def test_gravity_is_changed():
    session = kerf.Session({"body": {"model": "strip"}, "material": {"damping_mass": 0}})
    assert session.gravity == (0, 0, -9.81)
    session.gravity = [1, 0, 0]
    session.step(10)
    assert session.velocities.mean(axis=0) == pytest.approx([10 * session.time_step, 0, 0], abs=1e-9)
    with pytest.raises(ValueError):
        session.gravity = [0, float("inf"), 0]
    with pytest.raises((ValueError, TypeError)):
        session.gravity = 9.81


def test_pieces_are_weighed():
    session = kerf.Session("sheet")
    whole = session.uncut_mass
    assert session.piece_masses == pytest.approx([whole])
    session.cut(np.array([[[0.2, y, 0.2], [0.2, y, -0.2]] for y in (-0.6, 0.6)]))
    assert session.piece_masses == pytest.approx([0.7 * whole, 0.3 * whole])
    assert session.uncut_mass == whole


def test_an_operation_is_scored():
    assert kerf.Session("steak").score is None
    session = kerf.Session("trainer")
    score = session.score
    assert score["lesion_removed"] == 0 and score["healthy_removed"] == pytest.approx(0, abs=1e-15) and score["loose_pieces"] == 0
    middle = np.array([0.0, 0.0130, 0.0])
    assert session.punch(middle, 0.0025, frame="rest", take=True)
    assert session.score["lesion_removed"] > 0.9
    assert session.roughness >= 0
    assert session.score["lesion_volume"] == score["lesion_volume"] > 0
