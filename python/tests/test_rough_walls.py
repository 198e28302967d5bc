"""Walls that `cut.roughness` makes rough."""

import numpy as np
import pytest

import kerf

shapely = pytest.importorskip("shapely", minversion="2.1")

from plane_judge import extruded  # noqa: E402


@pytest.mark.parametrize("over", [(0.15, -0.018), (0.15, 0.005)])
def test_they_stay_in_a_slab_whose_rim_they_meet_at_an_acute_angle(over):
    slab = shapely.box(0, 0, 0.12, 0.08)
    scene = {
        "body": {"bound": kerf.bind(*extruded(slab, 0.008, 0.002))},
        "cut": {"layers": 2, "roughness": 0.5, "dust": 0},
        "simulation": {"gravity": [0, 0, 0]},
    }
    with kerf.Session(scene, scripted=False) as session:
        path = np.array([(-0.01, 0.03), over])
        poses = np.stack([np.c_[path, [0.05, 0.05]], np.c_[path, [-0.05, -0.05]]], 1)
        assert session.cut(poses) and session.counts["pieces"] == 2
        places = session.rest_positions
        assert np.all(shapely.intersects_xy(slab.buffer(1e-8), places[:, 0], places[:, 1]))
        rough = places[np.unique(session.triangles[session.walls])]
        beside = np.abs(np.cross(np.r_[path[1] - path[0], 0], np.c_[rough[:, :2] - path[0], 0 * rough[:, 0]])[:, 2])
        assert beside.max() / np.linalg.norm(path[1] - path[0]) > 1e-3, "they are rough all the same"
