"""The task TensionAndCut: parts against areas beside the line, forces against the supports, stretch against the drawn vertices."""

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")

import kerf.gym  # noqa: E402
from kerf.gym._gauze import SIDE, THICKNESS  # noqa: E402
from kerf.gym.tension_and_cut import DENSITY, LIMIT, MEASURED, TAUT  # noqa: E402

HELD, LED = slice(0, 3), slice(3, 6)  # of an action: the grasp, the blade


def begun(seed, **options):
    one = gymnasium.make("Kerf/TensionAndCut-v0", **options).unwrapped
    one.reset(seed=seed)
    return one


def test_the_parts_are_those_beside_the_line():
    for seed in range(21, 25):
        one = begun(seed, randomise=seed % 2 == 0)
        total = 0.0
        while True:
            _, reward, terminated, truncated, info = one.step(one.expert())
            total += reward
            if terminated or truncated:
                break
        session, curve = one.session, one.tasks.curve[0]
        right = np.trapezoid(SIDE / 2 - curve[:, 0], curve[:, 1]) if hasattr(np, "trapezoid") else np.trapz(SIDE / 2 - curve[:, 0], curve[:, 1])
        parts = np.array(sorted((right, SIDE**2 - right), reverse=True)) * THICKNESS * session.material["density"]
        assert session.piece_masses[:2] == pytest.approx(parts, rel=0.03)
        assert terminated and info["is_success"] and info["deviation"] < 0.001 and 11 < total < 14
        one.close()


@pytest.mark.parametrize("idle", [HELD, LED])
def test_it_takes_both_arms(idle):
    """The expert with one arm tied."""
    one = begun(22)
    before, total = one.session.topology_version, 0.0
    for _ in range(100):
        action = one.expert()
        action[idle] = 0
        _, reward, terminated, _, info = one.step(action)
        total += reward
        assert not terminated
    assert one.session.topology_version == before and info["progress"] == 0 and total < 1
    one.close()


def rim(session):
    """How long the rims of the drawn sheet are at rest: edges that one triangle has."""
    edges, count = np.unique(np.sort(session.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0, return_counts=True)
    a, b = session.rest_positions[edges[count == 1].T]
    return np.linalg.norm(b - a, axis=1).sum()


def test_a_blade_in_a_slack_gauze_does_not_cut():
    """Led in by 5 cm without a pull, it leaves the body as it is; the same way makes two lips of 5 cm where the gauze is taut."""
    for pulled in (0.0, 1.0):
        one = begun(3)
        for _ in range(12):
            one.step(np.array([pulled * (one.tasks.hand[0, 0] < 0.054), 0, 0, 0, 0, 0]))
        for target in ((0, -0.06, 0.02), (0, -0.06, -0.02), (0, 0, -0.02)):
            while np.abs(way := np.array(target) - one.tasks.tip[0]).max() > 1e-9:
                *_, info = one.step(np.append(np.zeros(3), np.clip(way / 0.004, -1, 1)))
        assert (info["stretch"] >= TAUT) == (pulled > 0)
        assert rim(one.session) == pytest.approx(4 * SIDE + 2 * 0.05 * pulled, abs=0.015)
        one.close()


def test_forces_and_stretch_are_the_bodys():
    """Pulled too hard and held: grasp and supports carry the weight and balance each other; the cost is that of the force."""
    one = begun(5)
    for _ in range(60):
        one.step(np.array([0.2, -0.03, 0.05, 0, 0, 1]) * (one.tasks.hand[0, 0] < 0.065))
    _, reward, _, _, info = one.step(np.zeros(6))
    session = one.session
    grasp, support = session.grasps[0]["force"], np.array(session.support_force)
    weight = np.array([0, 0, SIDE**2 * THICKNESS * DENSITY * 9.81])
    assert grasp + support == pytest.approx(weight, abs=2e-3)
    assert info["tension"] == pytest.approx(np.linalg.norm(support - weight), abs=2e-3) and info["tension"] > LIMIT
    assert reward == pytest.approx(-0.01 - 0.05 * (np.linalg.norm(support - weight) / LIMIT - 1), abs=1e-3)
    assert 0 < info["strained"] < 1

    def nearest(place):
        return np.linalg.norm(session.rest_positions - place, axis=1).argmin()

    mark = one.tasks.curve[0, MEASURED]
    side, line, hand = (nearest(place) for place in ((-SIDE / 2, mark[1], 0), mark, (SIDE / 2 - 0.005, 0, 0)))

    def way(places):
        return np.linalg.norm(places[line] - places[side]) + np.linalg.norm(places[hand] - places[line])

    assert info["stretch"] == pytest.approx(way(session.positions) / way(session.rest_positions), abs=0.01)
    assert info["stretch"] > TAUT
    one.close()
