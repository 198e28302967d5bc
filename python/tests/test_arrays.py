"""Arrays: read-only, as they were when asked for, whatever becomes of the session."""

import gc

import numpy as np
import pytest

import kerf

ACROSS = [[[0, -0.10, 0.05], [0, -0.10, -0.05]], [[0, 0.12, 0.05], [0, 0.12, -0.05]]]
ARRAYS = {
    "positions": np.float64, "velocities": np.float64, "normals": np.float32, "rest_positions": np.float64, "triangles": np.int32,
    "walls": np.bool_, "uvs": np.float32, "collision_positions": np.float64, "collision_rest_positions": np.float64, "collision_triangles": np.int32,
    "nodes": np.float64, "node_velocities": np.float64, "hexahedra": np.int32,
}


@pytest.fixture
def steak():
    return kerf.Session({"body": {"model": "steak"}})


@pytest.mark.parametrize("name", ARRAYS)
def test_read_only_and_kept(steak, name):
    array = getattr(steak, name)
    assert array.dtype == ARRAYS[name]
    assert array.flags.c_contiguous and not array.flags.writeable
    with pytest.raises(ValueError):
        array[0] = 0
    with pytest.raises(ValueError):
        array.flags.writeable = True
    assert getattr(steak, name) is array  # nothing has changed: no copy is made


@pytest.mark.parametrize("name", ARRAYS)
def test_old_arrays_stay_what_they_were(steak, name):
    array = getattr(steak, name)
    copy = array.copy()
    steak.cut(ACROSS)
    steak.step(5)
    steak.undo()
    steak.cut(np.array(ACROSS) + [0.02, 0, 0])
    steak.step(5)
    assert (array == copy).all()
    assert getattr(steak, name) is not array
    steak.close()
    del steak
    gc.collect()
    filler = [np.ones(copy.shape, copy.dtype) for _ in range(8)]  # freed memory would be taken
    assert (array == copy).all() and len(filler) == 8


def test_a_stroke_by_hand_that_ends_one_of_the_scene():
    session = kerf.Session({"body": {"model": "closed-sheet"}, "cut": {"dust": 0.1}, "simulation": {"gravity": [0, 0, 0]}})

    def pose(time, x, y):
        return {"time": time, "base": [x, y, 1], "tip": [x, y, -1]}

    session.apply({"type": "blade", "frame": "rest", "poses": [pose(0, 0.6, 0.2), pose(0.05, 0.2, 0.6), pose(9, 0.1, 0.7)]})
    while session.time < 0.2:
        session.step()
    before = len(session.positions)
    with session.stroke():
        assert len(session.positions) == session.counts["visual_vertices"] == len(session.normals)
        assert len(session.positions) < before  # the corner was dust
    with pytest.raises(ValueError, match="mine"):
        session.gravity = Unwilling([0, 0, 0])


class Unwilling(list):
    def __len__(self):
        raise ValueError("mine")


def test_shapes_follow_a_cut(steak):
    steak.cut(ACROSS)
    vertices, triangles = steak.counts["visual_vertices"], steak.counts["visual_triangles"]
    assert len(steak.positions) == len(steak.rest_positions) == len(steak.velocities) == len(steak.normals) == vertices
    assert len(steak.triangles) == len(steak.uvs) == triangles
    assert len(steak.collision_positions) == len(steak.collision_rest_positions) == steak.counts["collision_vertices"]
    assert len(steak.nodes) == len(steak.node_velocities)
    assert np.allclose(np.linalg.norm(steak.normals, axis=1), 1, atol=1e-4)


def test_at_rest_nothing_has_moved(steak):
    assert np.allclose(steak.positions, steak.rest_positions, atol=1e-12)
