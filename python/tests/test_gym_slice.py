"""The task Slice: masses against volumes of what is drawn, forces against the board, lines against areas of the outline."""

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")

import kerf.gym  # noqa: E402
from kerf.gym._slab import DENSITY, HALF_WIDTH, STATIONS, THICKNESS  # noqa: E402
from kerf.gym.slice import RESISTANCE  # noqa: E402


def episode(one, seed, each=lambda info: None):
    """Plays an episode by the expert; what came of it, and its return."""
    one.reset(seed=seed)
    total = 0.0
    while True:
        _, reward, terminated, truncated, info = one.step(one.expert())
        total += reward
        each(info)
        if terminated or truncated:
            return info, total


def volumes(places, triangles):
    """Of the closed surfaces that these triangles are, the largest first: flooded from one to the next, tetrahedra from the origin added up."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    assert sorted(edges.tolist()) == sorted(edges[:, ::-1].tolist())  # closed: every edge goes both ways
    beside = {}
    for i, corners in enumerate(triangles.tolist()):
        for corner in corners:
            beside.setdefault(corner, []).append(i)
    of = np.full(len(triangles), -1)
    for first in range(len(triangles)):
        reached = [first] if of[first] < 0 else []
        while reached:
            i = reached.pop()
            if of[i] < 0:
                of[i] = first
                reached += [j for corner in triangles[i] for j in beside[corner]]
    a, b, c = (places[triangles[:, k]] for k in range(3))
    parts = (a * np.cross(b, c)).sum(axis=1) / 6
    return np.array(sorted((parts[of == number].sum() for number in np.unique(of)), reverse=True))


@pytest.mark.parametrize("randomise", [False, True])
def test_slices_weigh_what_they_are_drawn_as(randomise):
    one = gymnasium.make("Kerf/Slice-v0", randomise=randomise).unwrapped
    wanted = set()
    for seed in range(21, 25):
        info, total = episode(one, seed)
        session = one.session
        masses = session.material["density"] * volumes(session.rest_positions, session.triangles)
        assert session.piece_masses == pytest.approx(masses, rel=2e-3)
        k = info["wanted"]
        share = masses / masses.sum()
        assert len(masses) == info["slices"] == k and np.abs(share - 1 / k).max() < 0.02 / k
        assert info["evenness"] == pytest.approx(np.minimum(share[:k], 1 / k).sum(), abs=1e-3)
        assert info["is_success"] and 9 < total < 12
        assert session.material["density"] == DENSITY or randomise
        wanted.add(k)
    assert wanted == {2, 3, 4}
    one.close()


def test_the_board_holds_what_the_knife_draws():
    """While the knife goes through: resistance by thickness, along its way. The board's friction is what the knife feels, its pressure the weight."""
    one = gymnasium.make("Kerf/Slice-v0").unwrapped
    along, board, weight = [], [], []

    def look(_):
        session, knife = one.session, one.session.tools[0]
        touching = session.contacts
        if one.tasks.stage[0] == 2:
            held = touching["force"][touching["obstacle"] >= 0].sum(axis=0)
            along.append(knife["force"] @ knife["axes"][:, 0])
            board.append(knife["force"] - held)
            weight.append(session.piece_masses.sum() * 9.81)

    episode(one, 22, look)
    assert len(along) > 30
    assert -np.median(along) == pytest.approx(RESISTANCE * THICKNESS, rel=0.01)
    away = np.abs(np.array(board) + np.array(weight)[:, None] * [0, 0, 1])  # N
    assert np.median(away, axis=0).max() < 0.005 and np.percentile(away, 90) < 0.02
    one.close()


def test_lines_part_the_outline_evenly():
    """Areas left of the marked lines, of a polygon clipped at them (shoelace)."""
    one = gymnasium.make("Kerf/Slice-v0").unwrapped
    outline = np.concatenate([np.stack([STATIONS, -HALF_WIDTH], 1), np.stack([STATIONS, HALF_WIDTH], 1)[::-1]])

    def area(polygon):
        x, y = np.asarray(polygon).T
        return 0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1))

    for seed in range(6):
        one.reset(seed=seed)
        k = one.tasks.wanted[0]
        for i, (near, _, far) in enumerate(one.tasks.lines[0, :k - 1, :, :2]):
            side = (outline - near) @ np.array([near[1] - far[1], far[0] - near[0]])  # above 0: to the left
            kept = []
            for j in range(len(outline)):
                a, b = side[j - 1], side[j]
                if (a > 0) != (b > 0):
                    kept.append(outline[j - 1] + a / (a - b) * (outline[j] - outline[j - 1]))
                if b > 0:
                    kept.append(outline[j])
            assert area(kept) / area(outline) == pytest.approx((i + 1) / k, abs=0.002)
    one.close()


def test_an_uneven_cut_earns_its_part_and_scraps_are_no_slices():
    """Led by hand: first a corner off, then off the middle. Rewards add up to the gain in evenness, less what force and time cost."""
    one = gymnasium.make("Kerf/Slice-v0").unwrapped
    seed = next(seed for seed in range(20) if one.reset(seed=seed) and one.tasks.wanted[0] == 2)
    one.reset(seed=seed)
    total, costs, over = 0.0, 0.0, False
    for x in (0.067, -0.02):
        for place in ((x, -0.05, 0.03, 0), (x, -0.05, -0.012, 0), (x, 0.05, -0.012, 0), (x, 0.05, 0.03, 0)):
            while not over and np.abs(way := np.array(place) - one.tasks.hand[0]).max() > 1e-9:
                _, reward, over, _, info = one.step(np.clip(way / (0.005, 0.005, 0.005, 0.06), -1, 1))
                total, costs = total + reward, costs + 0.01 + 0.01 * np.linalg.norm(one.session.tools[0]["force"])
        assert over == (x < 0)
    share = one.session.piece_masses / one.session.uncut_mass
    assert len(share) == 3 and share[2] < 0.02 and info["slices"] == 2 and not info["is_success"]
    assert info["evenness"] == pytest.approx(0.5 + share[1])
    assert total + costs == pytest.approx(10 * share[1] / 0.5)
    one.close()
