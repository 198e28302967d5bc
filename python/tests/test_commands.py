"""Commands by hand: punches, grasps, tools. Judged by runs of the program, by statics and by Newton's laws."""

import json
import subprocess

import numpy as np
import pytest

import kerf
from kerf import _program, _scene

GRAVITY = 9.81
SLAB = {"body": {"model": "closed-sheet"}, "material": {"young": 2e5, "density": 1000}, "lattice": {"cells": [6, 6, 1]}}
SLAB_MASS = 1.0 * 1.0 * 0.1 * 1000
EDGE_Y = {"half_space": {"point": [0, 0.45, 0], "normal": [0, 1, 0]}}
FREE = {"damping_mass": 0, "damping_stiffness": 0}


def slab(**more):
    material = {**SLAB["material"], **more.pop("material", {})}
    return kerf.Session({**SLAB, "material": material, **more})


def at_rest(session, most=4000):
    """Steps until nothing moves."""
    for _ in range(most // 50):
        session.step(50)
        if np.abs(session.node_velocities).max() < 1e-5:
            return session
    raise AssertionError("it does not come to rest")


# --- The same bits as a run of the program ---

GRASPS = """
body = { model = "steak" }
simulation = { time_step = 0.002, duration = 0.2 }
fix = [{ half_space = { point = [0, 0.06, 0], normal = [0, 1, 0] } }]
command = [
  { at = 0.00, type = "grasp", id = "a", point = [0, -0.07, 0], radius = 0.02, stiffness = 300 },
  { at = 0.02, type = "move", id = "a", by = [0, -0.01, 0.02], over = 0.05 },
  { at = 0.04, type = "fix", sphere = { center = [0.08, 0, 0], radius = 0.03 } },
  { at = 0.06, type = "punch", point = [-0.03, 0, 0], radius = 0.015, frame = "rest", roughness = 0.001 },
  { at = 0.08, type = "move", id = "a", to = [0, -0.08, 0.03] },
  { at = 0.10, type = "unfix", sphere = { center = [0.08, 0, 0], radius = 0.03 } },
  { at = 0.12, type = "remove", sphere = { center = [-0.03, 0, 0], radius = 0.01 }, frame = "rest" },
  { at = 0.14, type = "release", id = "a" },
  { at = 0.15, type = "undo" },
  { at = 0.16, type = "redo" },
  { at = 0.17, type = "blade", frame = "rest", poses = [
    { time = 0, base = [0.03, -0.1, 0.05], tip = [0.03, -0.1, -0.05] },
    { time = 0.02, base = [0.03, 0.02, 0.05], tip = [0.03, 0.02, -0.05] } ] },
]
"""


@pytest.mark.parametrize("scene, until", [("punch", 0.4), ("contour", 0.14), ("scissors", 1.4), ("meniscus-probe", 0.5), (GRASPS, 0.2)],
                         ids=["punch", "contour", "scissors", "meniscus-probe", "grasps"])
def test_by_hand_as_in_a_run(scene, until, tmp_path):
    tomllib = pytest.importorskip("tomllib")
    if not _program.PROGRAM.is_file():
        pytest.skip("built without the program")
    text = scene if "\n" in scene else (_scene.SHIPPED / f"{scene}.toml").read_text()
    given = tomllib.loads(text)
    commands = [c for c in given["command"] if c["at"] < until]
    given["simulation"]["duration"], given["output"] = until, {"meshes": [], "animation": False, "picture": False}
    last = max(c["at"] + max([p["time"] for p in c.get("poses", [])] + [c.get("over", 0)]) for c in commands)
    if last > until:  # what the scene leads beyond the end is refused there
        given["simulation"]["duration"] = last
    file = tmp_path / "whole.toml"
    file.write_text(_scene.toml_of({**given, "command": commands}))
    out = tmp_path / "out"
    subprocess.run([_program.PROGRAM, "run", file, "--out", out, "--quiet"], check=True)
    run = json.loads((out / "report.json").read_text())

    # How many of a scene's commands are done is part of its state: ones that do nothing stand for those given by hand.
    session = kerf.Session({**given, "command": [{"at": 0, "type": "redo"}] * len(commands)})
    step = given["simulation"].get("time_step", 0.001)
    while session.steps < round(given["simulation"]["duration"] / step):
        while commands and commands[0]["at"] < session.time + 0.5 * step:
            session.apply({key: value for key, value in commands.pop(0).items() if key != "at"})
        session.step()
    assert not commands
    assert f"{session.hash:016x}" == run["state_hash"]


# --- Punches, shavers, removal ---


def test_a_punch_takes_a_disc():
    session = slab()
    assert session.punch([0.1, 0.05, 0], 0.2, take=True)
    removed = session.report()["cuts"][-1]["removed"]
    assert removed["pieces"] == 1
    assert 0.97 < removed["volume"] / (np.pi * 0.2**2 * 0.1) < 1.001  # a polygon in the circle
    session.validate()
    session.undo()  # what was taken
    session.undo()  # the punch
    assert session.undo_depth == 0 and session.counts["pieces"] == 1


def test_a_polygon_and_where_nothing_is():
    session = slab()
    corners = np.array([[-0.1, -0.15], [0.1, -0.15], [0.1, 0.15], [-0.1, 0.15]])
    assert not session.punch([5, 0, 0], points=corners)
    assert session.undo_depth == 0
    assert session.punch([0, 0, 0], points=corners)
    assert session.counts["pieces"] == 2
    assert session.remove(sphere={"center": [0, 0, 0], "radius": 0.05}) == 1
    assert session.report()["cuts"][-1]["removed"]["volume"] == pytest.approx(0.2 * 0.3 * 0.1, rel=0.01)
    assert session.remove(sphere={"center": [0, 0, 0], "radius": 0.3}) == 0


def test_what_a_grasp_holds_is_taken():
    session = slab()
    session.punch([0, 0, 0], 0.2)
    session.grasp("plug", [0, 0, 0])
    assert session.remove("plug") == 1
    assert session.grasp_ids == [] and session.counts["pieces"] == 1


def test_a_shaver_takes_the_edge_back():
    session = slab(simulation={"gravity": [0, 0, 0]})
    session.punch([0, 0, 0], 0.2, take=True)
    window = [[[0.2, 0, 0.06], [0.2, 0, -0.06]], [[0.2, 0.05, 0.06], [0.2, 0.05, -0.06]]]
    session.shave(window, [0, 0.02], 0.03, frame="rest", removal=0.5)
    assert session.in_stroke
    session.step(25)
    assert not session.in_stroke and session.undo_depth == 3
    assert session.report()["cuts"][-1]["kind"] == "shave"
    session.validate()


# --- Statics ---


def test_supports_carry_the_weight():
    session = at_rest(slab(fix=[EDGE_Y], material={"damping_mass": 8, "young": 2e6}))
    assert session.support_force == pytest.approx((0, 0, SLAB_MASS * GRAVITY), abs=0.01 * SLAB_MASS * GRAVITY)


def test_a_grasp_is_a_spring():
    weight, stiffness = SLAB_MASS * GRAVITY, 2e4
    session = slab(material={"damping_mass": 8, "young": 2e6})
    session.grasp("hand", [0, 0, 0], radius=0.15, stiffness=stiffness)
    at_rest(session)
    hand = session.grasps[0]
    assert session.grasp_ids == ["hand"] and hand["vertices"] > 1
    assert hand["force"] == pytest.approx([0, 0, weight], abs=0.01 * weight)
    assert hand["target"] - hand["held"] == pytest.approx([0, 0, weight / stiffness], abs=0.02 * weight / stiffness)
    session.move("hand", by=[0.3, 0, 0.1], over=0.5)
    at_rest(session.step(600) or session)
    moved = session.grasps[0]
    assert moved["held"] - hand["held"] == pytest.approx([0.3, 0, 0.1], abs=0.005)
    session.move("hand", to=[0, 0, 0])
    session.step()
    assert session.grasps[0]["target"] == pytest.approx([0, 0, 0])


def test_what_is_released_falls():
    session = slab(fix=[EDGE_Y], material=FREE)
    session.unfix(**EDGE_Y)
    session.step(100)
    assert session.support_force == (0, 0, 0)
    assert session.node_velocities[:, 2] == pytest.approx(-GRAVITY * session.time, rel=1e-6)


def test_what_is_fixed_stays():
    session = slab()
    session.step(20)
    falling = session.positions.copy()
    session.fix(**EDGE_Y)
    session.step(20)
    fixed = session.rest_positions[:, 1] >= 0.4999
    assert session.positions[fixed] == pytest.approx(falling[fixed], abs=1e-9)
    assert session.positions[~fixed][:, 2].min() < falling[~fixed][:, 2].min() - 1e-3


# --- Tools ---

BALL = {"id": "ball", "kind": "sphere", "radius": 0.1, "position": [0, 0, 0.3]}


def test_a_tool_presses_as_much_as_it_is_pressed():
    session = slab(fix=[EDGE_Y, {"half_space": {"point": [0, -0.45, 0], "normal": [0, -1, 0]}}], tool=[BALL], material={"damping_mass": 8},
                   simulation={"gravity": [0, 0, 0]})
    assert session.tool_ids == ["ball"] and len(session.contacts) == 0
    assert session.tools["position"][0] == pytest.approx([0, 0, 0.3])
    session.move_tool("ball", [0, 0, 0.12], over=0.1)
    session.step(400)
    ball, touching = session.tools[0], session.contacts
    touching = touching[touching["tool"] == 0]
    assert len(touching) > 0 and (touching["obstacle"] == -1).all()
    assert ball["pose_position"] == pytest.approx([0, 0, 0.12])
    assert ball["force"][2] > 0.1
    assert touching["force"].sum(axis=0) == pytest.approx(-ball["force"], rel=0.05, abs=1e-6)
    assert ball["coupling_force"] == pytest.approx(-ball["force"], rel=0.05, abs=0.05)
    # The coupling is a spring of 2000 N/m.
    assert ball["coupling_force"] == pytest.approx(2000 * (ball["pose_position"] - ball["position"]), rel=0.05, abs=0.05)
    across = np.linalg.norm(touching["normal"], axis=1)
    assert across == pytest.approx(np.ones(len(touching)), abs=1e-6)
    assert (touching["normal_force"] >= 0).all()


def test_poses_and_turns():
    session = slab(tool=[{**BALL, "kind": "probe", "radius": None, "position": [2, 0, 1], "rotation": [0, 0, 0.5]}], simulation={"gravity": [0, 0, 0]})
    turned = [[np.cos(0.5), -np.sin(0.5), 0], [np.sin(0.5), np.cos(0.5), 0], [0, 0, 1]]
    assert session.tools["axes"][0] == pytest.approx(np.array(turned))
    session.move_tool("ball", [2, 0, 1.5])
    session.step()
    assert session.tools["pose_axes"][0] == pytest.approx(np.array(turned), abs=1e-12)  # it keeps its rotation
    session.move_tool("ball", [2, 0, 2], [np.pi / 2, 0, 0], over=0.01)
    session.step(500)
    assert session.tools["axes"][0] @ [0, 1, 0] == pytest.approx([0, 0, 1], abs=1e-3)
    assert session.tools["position"][0] == pytest.approx([2, 0, 2], abs=1e-3)


def test_jaws():
    session = slab(tool=[{"id": "grasper", "kind": "grasper", "position": [2, 0, 1]}])
    session.close_jaws("grasper", over=0.02)
    session.step(10)
    assert session.tools["jaws"][0] == pytest.approx(0.5, abs=0.06)
    session.step(20)
    assert session.tools["jaws"][0] == 0
    session.open_jaws("grasper", over=0)
    session.step(2)
    assert session.tools["jaws"][0] == 1


# --- Records ---


def test_records_are_read_only_and_kept():
    session = slab(obstacle=[{"shape": "plane", "position": [0, 0, -0.051]}], tool=[BALL])
    session.grasp("a", [0, 0.4, 0])
    session.step(100)
    kept = {name: getattr(session, name) for name in ("contacts", "tools", "grasps")}
    copies = {name: array.copy() for name, array in kept.items()}
    for name, array in kept.items():
        assert len(array) > 0 and not array.flags.writeable and not array.flags.owndata
        assert getattr(session, name) is array
    assert (kept["contacts"]["obstacle"] == 0).all() and (kept["contacts"]["tool"] == -1).all()
    session.punch([0, 0, 0], 0.2)
    assert len(session.contacts) == 0
    session.step(3)
    session.close()
    for name, array in kept.items():
        assert (array == copies[name]).all()  # field by field: copies leave out what lies between fields


def test_nothing_touches_and_nothing_is_held():
    session = slab()
    session.step()
    for array in (session.contacts, session.tools, session.grasps):
        assert array.shape == (0,) and array.dtype.names


# --- What is wrong ---

WRONG = [
    {"type": "punch", "point": [0, 0, 0], "raduis": 1},
    {"type": "punch", "point": [0, 0, 0]},
    {"type": "punch", "point": [0, 0], "radius": 1},
    {"type": "punch", "point": [0, 0, float("nan")], "radius": 1},
    {"type": "punch", "point": [0, 0, 0], "radius": 1, "axis": [0, 0, 0]},
    {"type": "poke"},
    {"type": "grasp", "point": [0, 0, 0]},
    {"type": "fix"},
    {"type": "tool", "id": "bal", "poses": [{"time": 0, "position": [0, 0, 0]}]},
    {"type": "close", "id": "ball"},
    {"type": "shave", "radius": 0.1, "poses": [{"time": 0, "base": [0, 0, 0], "tip": [0, 0, 1]}]},
]


@pytest.mark.parametrize("command", WRONG, ids=lambda c: "-".join(c))
def test_errors_are_those_of_scenes(command):
    scene = {**SLAB, "tool": [BALL]}
    session = kerf.Session(scene)
    before = session.hash
    with pytest.raises(kerf.Error) as caught:
        session.apply(command)
    with pytest.raises(kerf.Error) as in_scene:
        kerf.Session({**scene, "command": [{"at": 0, **command}]})

    def words(error):
        return [line.split(": ", 1)[1] for line in str(error.value).splitlines()]

    assert words(caught) == words(in_scene)
    assert caught.value.file == "command" and caught.value.line is not None
    assert session.hash == before


@pytest.mark.parametrize("call, words", [
    (lambda s: s.move("a", by=[0, 0, 0]), "no grasp 'a'"),
    (lambda s: s.release("a"), "no grasp 'a'"),
    (lambda s: s.remove("a"), "a"),
    (lambda s: s.move_tool("hook", [0, 0, 0]), "there is no tool \"hook\""),
    (lambda s: s.fix(sphere={"center": [9, 9, 9], "radius": 0.1}), "holds nothing"),
    (lambda s: s.apply({"type": "undo", "at": 0.5}), "no at"),
    (lambda s: s.apply("type = "), "command:1"),
    (lambda s: s.apply({}), "type"),
])
def test_what_can_not_be_done(call, words):
    session = slab()
    before = session.hash
    with pytest.raises(kerf.Error, match=words):
        call(session)
    assert session.hash == before


def test_types():
    session = slab()
    for wrong in (5, None, b"type = 'undo'", ["undo"]):
        with pytest.raises(TypeError):
            session.apply(wrong)
    with pytest.raises(TypeError):
        session.punch([0, 0, object()], 1)
    with pytest.raises(ValueError, match="times"):
        session.shave(np.zeros((2, 2, 3)), [0, 1, 2], 0.1)
    with pytest.raises(ValueError):
        session.shave(np.zeros((2, 3)), [0, 1], 0.1)


def test_within_a_stroke():
    session = slab()
    with session.stroke() as blade:
        blade.move([0, -1, 1], [0, -1, -1])
        session.grasp("a", [0.3, 0, 0])
        session.move("a", by=[0, 0, 0.01])
        blade.move([0, 0, 1], [0, 0, -1])
        for call in (lambda: session.punch([0, 0, 0], 0.1), lambda: session.remove(half_space={"point": [0, 0, 0], "normal": [1, 0, 0]}),
                     lambda: session.apply({"type": "undo"}), lambda: session.apply({"type": "redo"})):
            with pytest.raises(kerf.Error, match="stroke is open"):
                call()
        assert blade.is_open
    assert session.undo_depth == 1
    session.apply({"type": "undo"})
    assert session.undo_depth == 0


def test_a_closed_session_takes_no_commands():
    session = slab()
    session.close()
    for call in (lambda: session.punch([0, 0, 0], 1), lambda: session.release("a"), lambda: session.contacts, lambda: session.tools,
                 lambda: session.grasps, lambda: session.tool_ids, lambda: session.support_force):
        with pytest.raises(kerf.Error, match="closed"):
            call()


def test_the_key_that_is_wrong(tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text('[body]\nmodel = "steak"\n[simulation] # how\n"time_step" = -1\n[[command]]\nat = 0\ntype = "punch"\npoint = [0, 0]\n')
    with pytest.raises(kerf.Error) as caught:
        kerf.Session(path)
    assert (caught.value.line, caught.value.key) == (4, "simulation.time_step")
    for scene, key in (({"body": {"model": "steak"}, "cut": {"layers": 0}}, "cut.layers"), ("body.model = 'steek'", "body.model")):
        with pytest.raises(kerf.Error) as caught:
            kerf.Session(scene)
        assert caught.value.key == key
    with pytest.raises(kerf.Error) as caught:
        slab().punch([0, 0, 0], -1)
    assert (caught.value.file, caught.value.key) == ("command", "radius")
    with pytest.raises(kerf.Error) as caught:
        slab().undo()
    assert caught.value.key is None
