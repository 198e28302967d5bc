"""Pictures and depth, judged by rays, closed forms and what the body's arrays say."""

import gc
import os
import pickle
import signal
import threading
import time

import numpy as np
import pytest

import kerf

WEIGHTLESS = {"body": {"model": "sheet"}, "simulation": {"gravity": [0, 0, 0]}}
ACROSS = np.array([[[0, -1, 0.5], [0, -1, -0.5]], [[0, 1, 0.5], [0, 1, -0.5]]])
LOW = ((0.6, -1.1, 0.9), (0, 0, 0))
NOTHING_BELOW = {"body": {"model": "steak"}, "simulation": {"gravity": [0, 0, -1], "time_step": 0.002},
                 "fix": [{"half_space": {"point": [0, 0.055, 0], "normal": [0, 1, 0]}}]}


@pytest.fixture
def sheet():
    return kerf.Session(WEIGHTLESS)


def rays(camera, width, height):
    """Directions one metre long along the view, (height, width, 3), as the docstring of kerf.Camera has them."""
    eye, target, up = (np.array(v) for v in (camera.eye, camera.target, camera.up))
    ahead = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(ahead, up)
    right /= np.linalg.norm(right)
    top = np.cross(right, ahead)
    half = np.tan(camera.field_of_view / 2)
    x = half * (2 * np.arange(width) + 1 - width) / height
    y = half * (1 - (2 * np.arange(height) + 1) / height)
    return ahead + x[None, :, None] * right + y[:, None, None] * top


def first_hits(session, camera, width, height):
    """Depth by brute force: every ray with every triangle (Moeller and Trumbore)."""
    a, b, c = (session.positions[session.triangles[:, k]] for k in range(3))
    e1, e2, s = b - a, c - a, np.array(camera.eye) - a
    q = np.cross(s, e1)
    out = np.full(width * height, np.inf)
    for i, ray in enumerate(rays(camera, width, height).reshape(-1, 3)):
        p = np.cross(ray, e2)
        det = (e1 * p).sum(1)
        with np.errstate(divide="ignore", invalid="ignore"):
            u, v, t = (s * p).sum(1) / det, q @ ray / det, (e2 * q).sum(1) / det
        hit = t[(u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)]
        if len(hit):
            out[i] = hit.min()
    return out.reshape(height, width)


def orange(rgb):
    """Pixels of walls in a sheet."""
    return rgb[..., 0].astype(int) > rgb[..., 2].astype(int) + 20


def test_arrays_are_the_callers_own(sheet):
    rgb, depth = sheet.render(50, 30, depth=True)
    assert rgb.shape == (30, 50, 3) and rgb.dtype == np.uint8
    assert depth.shape == (30, 50) and depth.dtype == np.float32
    assert rgb.flags.c_contiguous and rgb.flags.writeable and depth.flags.writeable
    rgb[:], depth[:] = 7, 7
    again = sheet.render(50, 30)
    assert isinstance(again, np.ndarray) and (again != 7).any() and not np.shares_memory(rgb, again)
    assert sheet.render().shape == (480, 640, 3)
    sheet.close()
    assert (rgb == 7).all() and (again != 7).any()


@pytest.mark.parametrize("eye, target", [((0.1, -0.25, 0.2), (0, 0, 0)), ((0.02, 0.03, 0.05), (0.08, 0, 0)), ((0, 0, -0.3), (0, 0.01, 0))])
def test_depth_is_that_of_rays(eye, target):
    session = kerf.Session(NOTHING_BELOW)
    session.cut([[[0.0, -0.10, 0.05], [0.0, -0.10, -0.05]], [[0.01, 0.02, 0.05], [0.01, 0.02, -0.05]]])
    session.step(100)
    camera = kerf.Camera(eye, target, (0.1, 0.9, 0.3), 0.7)
    depth = session.render(32, 24, camera=camera, depth=True)[1]
    expected = first_hits(session, camera, 32, 24)
    assert 200 < np.isfinite(expected).sum()
    with np.errstate(invalid="ignore"):
        unlike = ~((depth == expected) | (np.abs(depth - expected) < 1e-6))
    assert unlike.sum() <= 1  # a ray through an edge, by a rounding error


def test_a_plate_has_its_size(sheet):
    low, high = sheet.positions.min(axis=0), sheet.positions.max(axis=0)
    away = 4.0
    camera = kerf.Camera(((low + high) / 2)[:2].tolist() + [high[2] + away], (low + high) / 2, (0.3, 1, 0), 0.6)  # askew: edges meet pixels evenly
    depth = sheet.render(300, 300, camera=camera, depth=True)[1]
    focal = 150 / np.tan(0.3)
    pixels = (high - low)[:2].prod() * (focal / away) ** 2
    assert np.isfinite(depth).sum() == pytest.approx(pixels, rel=0.01)
    assert depth[150, 150] == pytest.approx(away, abs=1e-5)


def test_background_is_seen_through_a_gap():
    plate = kerf.Session({**WEIGHTLESS, "body": {"model": "closed-sheet"}})
    camera = kerf.Camera((0, 0, 4), (0, 0, 0), (0, 1, 0), 0.6)
    whole, before = plate.render(200, 200, camera=camera, depth=True)
    assert np.isfinite(before[100, 70:130]).all()
    assert plate.cut(ACROSS)
    assert plate.counts["pieces"] == 2
    plate.fix(half_space={"point": [-0.3, 0, 0], "normal": [-1, 0, 0]})
    plate.grasp("hand", [0.35, 0, 0], radius=0.2)
    plate.move("hand", by=[0.25, 0, 0], over=0.5)
    plate.step(int(1.5 / plate.time_step))
    rgb, depth = plate.render(200, 200, camera=camera, depth=True)
    x = plate.positions[plate.triangles][..., 0]
    right = x.min(axis=1) > 0.1  # half-way between the lips
    left_end, right_start = x[~right].max(), x[right].min()
    assert right_start - left_end > 0.15
    focal = 100 / np.tan(0.3)
    gap = np.flatnonzero(~np.isfinite(depth[100, 60:140])) + 60
    assert (np.diff(gap) == 1).all()  # one gap
    assert len(gap) == pytest.approx((right_start - left_end) * focal / 4, abs=2.5)
    assert (rgb[100, gap] == whole[100, 0]).all()  # the backdrop of this row
    assert not orange(whole).any()
    side_view = plate.render(200, 200, camera=kerf.Camera((2, 0, 1.2), (0, 0, 0)))
    assert orange(side_view).sum() > 20  # the wall of the left piece


def test_obstacles_tools_and_ground():
    plain = kerf.Session(WEIGHTLESS)
    full = kerf.Session({**WEIGHTLESS, "obstacle": [{"shape": "plane", "position": [0, 0, -0.5]},
                                                    {"shape": "sphere", "radius": 0.3, "position": [0, 0, 1]}],
                         "tool": [{"id": "probe", "kind": "probe", "position": [0.45, 0, 0.5]}]})
    camera = kerf.Camera((0, 0, 5), (0, 0, 0), (0, 1, 0), 0.6)
    nothing, there = (s.render(201, 201, camera=camera, depth=True)[1] for s in (plain, full))
    assert np.isinf(nothing[0, 0]) and there[0, 0] == pytest.approx(5.5, abs=1e-5)
    assert there[100, 100] == pytest.approx(5 - 1.3, abs=0.01)
    disc = (there[60:141, 60:141] < 4.3).sum()
    assert disc == pytest.approx(np.pi * (100.5 / np.tan(0.3) * np.tan(np.arcsin(0.3 / 4))) ** 2, rel=0.04)  # corners about
    column = round(100.5 + 0.45 * 100.5 / np.tan(0.3) / 4.5 - 0.5)
    assert (there[95:106, column - 2:column + 3] < nothing[95:106, column - 2:column + 3]).any()


def test_the_camera_that_is_made_has_the_body_in_view():
    session = kerf.Session(NOTHING_BELOW)
    for width, height in ((120, 90), (60, 120), (64, 64)):
        camera = session.camera(width, height)
        depth = session.render(width, height, depth=True)[1]
        seen = np.isfinite(depth)
        assert not (seen[0].any() or seen[-1].any() or seen[:, 0].any() or seen[:, -1].any())
        span = max(np.ptp(np.flatnonzero(seen.any(axis=0))) / width, np.ptp(np.flatnonzero(seen.any(axis=1))) / height)
        assert 0.8 < span < 0.95
        assert (session.render(width, height) == session.render(width, height, camera=camera)).all()


def test_same_state_same_bytes():
    def run():
        session = kerf.Session("steak")
        session.render(100, 100)
        first = session.render(64, 64, camera=kerf.Camera(*LOW), depth=True)
        start = session.snapshot()
        session.cut(ACROSS)
        session.step(50)
        return session, start, first

    one, start, before = run()
    other, _, _ = run()
    camera = kerf.Camera((0.1, -0.3, 0.3), (0, 0, 0))
    hash_before = one.hash
    a, b = one.render(64, 48, camera=camera, depth=True), other.render(64, 48, camera=camera, depth=True)
    assert (a[0] == b[0]).all() and (a[1] == b[1]).all()
    assert one.hash == hash_before and one.hash == other.hash
    one.restore(start)
    again = one.render(64, 64, camera=kerf.Camera(*LOW), depth=True)
    assert (again[0] == before[0]).all() and (again[1] == before[1]).all()


@pytest.mark.parametrize("shadows", [False, True])
def test_alpha_is_where_something_is(sheet, shadows):
    camera = kerf.Camera(*LOW)
    plain, depth = sheet.render(80, 60, camera=camera, depth=True, shadows=shadows)
    picture = sheet.render(80, 60, camera=camera, alpha=True, shadows=shadows)
    assert picture.shape == (60, 80, 4) and picture.dtype == np.uint8 and picture.flags.writeable
    there = np.isfinite(depth)
    assert there.any() and not there.all()
    assert (picture[there] == np.c_[plain[there], np.full(there.sum(), 255)]).all() and not picture[~there].any()
    both, far = sheet.render(80, 60, camera=camera, alpha=True, depth=True, shadows=shadows)
    assert (both == picture).all() and (far == depth).all()


def test_shadows():
    session = kerf.Session(WEIGHTLESS)
    camera = kerf.Camera(*LOW)
    rgb, depth = session.render(80, 60, camera=camera, depth=True, shadows=True)
    quick, same = session.render(80, 60, camera=camera, depth=True)
    assert rgb.shape == quick.shape and (depth == same).all() and (rgb != quick).any()
    assert session.render(20, 10, shadows=True).shape == (10, 20, 3)
    blue = lambda picture: picture[..., 2].astype(int) > picture[..., 0].astype(int) + 25  # noqa: E731
    assert (blue(rgb) != blue(quick)).mean() < 0.04  # both show the sheet where it is


@pytest.mark.parametrize("size, error", [((0, 10), ValueError), ((10, -1), ValueError), ((10**9, 10), ValueError), ((10, 2**70), ValueError),
                                         ((8193, 1), ValueError), ((10.5, 10), TypeError), (("10", 10), TypeError), ((None, 10), TypeError)])
def test_sizes(sheet, size, error):
    for call in (sheet.render, sheet.camera):
        with pytest.raises(error, match="width|height"):
            call(*size)


@pytest.mark.parametrize("size", [(1, 1), (np.int64(3), np.uint8(2)), (8192, 1), (1, 8192)])
def test_sizes_in_every_form(sheet, size):
    assert sheet.render(*size).shape == (size[1], size[0], 3)


@pytest.mark.parametrize("arguments, error, says", [
    (((0, 0, np.nan), (0, 0, 0)), ValueError, "eye must be finite"), (((0, 0, 1), (0, np.inf, 0)), ValueError, "target must be finite"),
    (((0, 0, 1), (0, 0, 1)), ValueError, "apart"), (((0, 0, 1), (0, 0, 0)), ValueError, "up must not be along"),
    (((0, -1, 1), (0, 0, 0), (0, 0, 0)), ValueError, "up must not be zero"), (((0, -1, 1), (0, 0, 0), (0, 5, -5)), ValueError, "along"),
    (((0, -1, 1e12), (0, 0, 0)), ValueError, "at most"), (((0, -1), (0, 0, 0)), ValueError, "eye"), (("here", (0, 0, 0)), TypeError, "eye"),
    (((0, -1, 1), (0, 0, 0), (0, 0, 1), 0), ValueError, "field_of_view"), (((0, -1, 1), (0, 0, 0), (0, 0, 1), np.nan), ValueError, "field_of_view"),
    (((0, -1, 1), (0, 0, 0), (0, 0, 1), 60), ValueError, "radians"), (((0, -1, 1), (0, 0, 0), (0, 0, 1), "wide"), TypeError, "field_of_view"),
    (((0, -1, 1), (0, 0, 0), (0, 0, 1), 10**400), ValueError, "field_of_view"), (((0, -1, 1), None), TypeError, "target")])
def test_what_is_no_camera(arguments, error, says):
    with pytest.raises(error, match=says):
        kerf.Camera(*arguments)


def test_cameras_are_values(sheet):
    camera = kerf.Camera([0, -1, 1], np.zeros(3), field_of_view=np.float32(0.5))
    assert camera == kerf.Camera((0, -1, 1), (0, 0, 0)) and hash(camera) == hash(pickle.loads(pickle.dumps(camera)))
    with pytest.raises(AttributeError):
        camera.eye = (0, 0, 0)
    for wrong in ((0, 0, 1), "camera", 5):
        with pytest.raises(TypeError, match="kerf.Camera"):
            sheet.render(10, 10, camera=wrong)
    object.__setattr__(camera, "eye", camera.target)  # whoever forces it is told as well
    with pytest.raises(ValueError, match="apart"):
        sheet.render(10, 10, camera=camera)


def test_a_closed_session(sheet):
    sheet.render(10, 10)
    sheet.close()
    for call in (sheet.render, sheet.camera):
        with pytest.raises(kerf.Error, match="closed"):
            call(10, 10)


def test_cameras_anywhere(sheet):
    sheet.cut(ACROSS)
    sheet.step(20)
    random = np.random.default_rng(5)
    drawn = 0
    for _ in range(400):
        scale = 10.0 ** random.uniform(-9, 9)
        eye, target, up = random.normal(size=(3, 3)) * [[scale], [10.0 ** random.uniform(-9, 9)], [10.0 ** random.uniform(-9, 8)]]
        try:
            camera = kerf.Camera(eye, target, up, random.uniform(0.02, 2.5))
        except ValueError:
            continue
        drawn += 1
        rgb, depth = sheet.render(*random.integers(1, 40, 2), camera=camera, depth=True)
        assert not np.isnan(depth).any() and (depth > 0).all()
    assert drawn > 200
    for _ in range(3):
        camera = kerf.Camera(sheet.positions[5], sheet.positions[9], random.normal(size=3), 2.5)  # an eye in the skin
        sheet.render(30, 30, camera=camera, depth=True)
        sheet.render(8, 8, camera=camera, shadows=True)


def test_pictures_leave_nothing():
    from test_cost import resident

    def use():
        session = kerf.Session({**WEIGHTLESS, "lattice": {"cells": [2, 2, 1]}})
        session.render(32, 32, depth=True)
        session.cut(ACROSS)
        session.render(32, 32)

    for _ in range(30):
        use()
    gc.collect()
    before = resident()
    for _ in range(150):
        use()
    gc.collect()
    assert resident() - before < 4 * 2**20


def test_ctrl_c_ends_a_picture_with_shadows():
    session = kerf.Session("steak")
    whole = session.render(64, 64, shadows=True)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # shells start what runs in the background without it
    began = time.perf_counter()
    timer = threading.Timer(0.1, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        session.render(3200, 2400, shadows=True, depth=True)
    assert time.perf_counter() - began < 3
    assert (session.render(64, 64, shadows=True) == whole).all()
