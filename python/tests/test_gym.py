"""Tasks: Gymnasium's own checks, seeds, experts against random actions, and what came out against the body's arrays."""

import copy
import pickle
import re
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

import kerf

gymnasium = pytest.importorskip("gymnasium")

import kerf.gym  # noqa: E402
from gymnasium.utils.env_checker import check_env  # noqa: E402
from kerf.gym._pieces import area_of, areas_of, inside, pieces_of  # noqa: E402

TASKS = sorted(kerf.gym.TASKS)


def covers(corners, points):
    """Which points (k, 2) lie in one of the triangles (m, 3, 2)?"""
    a, b, c = (corners[:, i, None] for i in range(3))
    sides = [(q[..., 0] - o[..., 0]) * (points[:, 1] - o[..., 1]) - (q[..., 1] - o[..., 1]) * (points[:, 0] - o[..., 0])
             for o, q in ((a, b), (b, c), (c, a))]
    return (np.all([s >= 0 for s in sides], axis=0) | np.all([s <= 0 for s in sides], axis=0)).any(axis=0)


def play(envs, act, seed, most=10_000):
    """Returns of one episode of each copy, and whether it was solved."""
    observation, _ = envs.reset(seed=seed)
    n = envs.num_envs
    total, success, done = np.zeros(n), np.zeros(n, bool), np.zeros(n, bool)
    for _ in range(most):
        observation, reward, terminated, truncated, info = envs.step(act(observation))
        assert np.isfinite(observation).all() and np.isfinite(reward).all()
        total += np.where(done, 0, reward)
        over = (terminated | truncated) & ~done
        success[over] = info["is_success"][over]
        done |= over
        if done.all():
            return total, success
    raise AssertionError("an episode does not end")


@pytest.mark.parametrize("name", TASKS)
def test_passes_gymnasiums_check(name):
    env = gymnasium.make(name, render_mode="rgb_array")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*Box observation space.*")
        check_env(env.unwrapped, skip_close_check=True)
    env.close()
    assert env.unwrapped.session.closed


@pytest.mark.parametrize("name", TASKS)
@pytest.mark.parametrize("observations", ["state", "pixels"])
def test_seeds_reproduce_to_the_bit(name, observations):
    seen = []
    for _ in range(2):
        env = gymnasium.make(name, observations=observations, randomise=True).unwrapped
        random = np.random.default_rng(4)
        rows = [env.reset(seed=11)[0]]
        for _ in range(12):
            observation, reward, *_ = env.step(random.uniform(-1, 1, env.action_space.shape))
            rows += [observation, np.float64(reward)]
        seen.append((b"".join(np.ascontiguousarray(row).tobytes() for row in rows), env.session.hash))
        other, _ = env.reset(seed=12)
        assert (other != rows[0]).any() or observations == "pixels"
        env.close()
    assert seen[0] == seen[1]


@pytest.mark.parametrize("name", TASKS)
def test_the_expert_solves_what_chance_does_not(name):
    envs = kerf.gym.make_vec(name, 6)
    skilled, solved = play(envs, lambda _: envs.expert(), seed=21)
    random = np.random.default_rng(8)
    lucky, _ = play(envs, lambda _: random.uniform(-1, 1, envs.action_space.shape), seed=21)
    print(f"\n{name}: expert {skilled.mean():.2f}, chance {lucky.mean():.2f}")
    assert solved.mean() >= 0.8
    assert skilled.mean() > lucky.mean() + 3 * lucky.std()
    for session in envs.sessions:
        session.validate()
    envs.close()


@pytest.mark.parametrize("name", TASKS)
def test_many_are_what_one_is(name):
    envs = kerf.gym.make_vec(name, 3, threads=2)
    seen, _ = envs.reset(seed=[5, 6, 7])
    one = gymnasium.make(name).unwrapped
    alone, _ = one.reset(seed=6)
    assert envs.np_random_seed == (5, 6, 7) and one.np_random_seed == 6 and len(envs.np_random) == 3
    # A task of one takes Gymnasium's generator of the seed, as the copies do.
    assert alone == pytest.approx(seen[1], abs=1e-6)
    random = np.random.default_rng(3)
    for _ in range(8):
        actions = random.uniform(-1, 1, envs.action_space.shape).astype(np.float32)
        seen, rewards, *_ = envs.step(actions)
        alone, reward, *_ = one.step(actions[1])
        assert alone == pytest.approx(seen[1], abs=1e-4)
        assert reward == pytest.approx(rewards[1], abs=1e-4)
    one.close()
    envs.close()


@pytest.mark.parametrize("name", TASKS)
def test_copies_begin_anew_by_themselves(name):
    envs = kerf.gym.make_vec(name, 2, max_episode_steps=3)
    envs.reset(seed=1)
    still = np.zeros(envs.action_space.shape, np.float32)
    for turn in range(8):
        _, rewards, terminated, truncated, _ = envs.step(still)
        assert not terminated.any()
        assert truncated.all() == (turn % 4 == 2)  # three actions, and one that begins anew
        assert (rewards == 0).all() or turn % 4 != 3
    envs.close()


def test_one_copy_is_reset_alone():
    envs = kerf.gym.make_vec(TASKS[0], 2)
    envs.reset(seed=1)
    first, *_ = envs.step(np.full(envs.action_space.shape, 0.5))
    seen, _ = envs.reset(options={"reset_mask": np.array([False, True])})
    assert seen[0] == pytest.approx(first[0]) and (seen[1] != first[1]).any()
    envs.close()


@pytest.mark.parametrize("wrong", [{"num_envs": 0}, {"num_envs": 1, "observations": "smell"}, {"num_envs": 1, "render_mode": "ascii"}])
def test_options_that_are_none_are_refused(wrong):
    with pytest.raises(ValueError):
        kerf.gym.make_vec(TASKS[0], **wrong)


def test_actions_that_are_none_are_refused():
    envs = kerf.gym.make_vec(TASKS[0], 2)
    envs.reset(seed=0)
    for wrong in (np.zeros(3), np.full(envs.action_space.shape, np.nan), np.zeros((2, 9))):
        with pytest.raises(ValueError):
            envs.step(wrong)
    with pytest.raises(ValueError, match="Kerf/PatternCut"):
        kerf.gym.make_vec("Kerf/Juggle", 1)
    envs.close()


@pytest.mark.parametrize("name", TASKS)
def test_specs_go_through_json(name):
    env = gymnasium.make(name, observations="pixels")
    again = gymnasium.make(gymnasium.envs.registration.EnvSpec.from_json(env.spec.to_json()))
    assert again.observation_space == env.observation_space
    env.close()
    again.close()


def test_gymnasium_makes_them():
    assert gymnasium.make("Kerf/PatternCut-v0").unwrapped.session.counts["pieces"] == 1
    envs = gymnasium.make_vec("Kerf/PatternCut-v0", num_envs=2, vectorization_mode="vector_entry_point")
    assert isinstance(envs.unwrapped, kerf.gym.PatternCut) and envs.num_envs == 2
    envs.close()


def test_pieces_by_hand():
    triangles = np.array([[0, 1, 2], [1, 2, 3], [4, 5, 6], [6, 7, 8]], np.int32)
    assert len(set(pieces_of(triangles, 9))) == 2
    assert pieces_of(triangles, 9)[0] == pieces_of(triangles, 9)[1] != pieces_of(triangles, 9)[2] == pieces_of(triangles, 9)[3]
    star = np.array([[2 * np.cos(t), 2 * np.sin(t)] if i % 2 else [np.cos(t), np.sin(t)] for i, t in enumerate(np.arange(10) * np.pi / 5)])
    points = np.random.default_rng(1).uniform(-2, 2, (4000, 2))
    angle = np.arctan2(points[:, 1], points[:, 0])  # by hand: beyond the straight line between two corners seen from the middle
    first = np.floor(angle / (np.pi / 5)).astype(int) % 10
    a, b = star[first], star[(first + 1) % 10]
    within = (b - a)[:, 0] * (points - a)[:, 1] - (b - a)[:, 1] * (points - a)[:, 0] > 0
    assert (inside(star, points) == within).all()
    assert area_of(star) == pytest.approx(5 * 2 * np.sin(np.pi / 5))
    assert areas_of(np.array([[[0, 0], [2, 0], [0, 3]]], float)) == pytest.approx([3])


def test_what_is_cut_out_is_what_was_marked():
    """The area of the piece that lies apart, against the area inside of the curve (shoelace)."""
    solved = 0
    for seed in range(40, 44):
        one = gymnasium.make("Kerf/PatternCut-v0").unwrapped
        one.reset(seed=seed)
        for _ in range(one.tasks.horizon):
            _, _, terminated, truncated, info = one.step(one.expert())
            if terminated or truncated:
                break
        if not terminated:
            continue
        session, curve = one.session, one.tasks.curve[0, :, :2]
        x, y = curve.T
        marked = 0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))
        rest, triangles = session.collision_rest_positions, session.collision_triangles
        area = 0.5 * np.linalg.norm(np.cross(rest[triangles[:, 1]] - rest[triangles[:, 0]], rest[triangles[:, 2]] - rest[triangles[:, 0]]), axis=1)
        piece = pieces_of(triangles, len(rest))
        areas = sorted(area[piece == number].sum() for number in np.unique(piece))
        assert areas[-2] == pytest.approx(marked, rel=0.04)
        assert info["overlap"] > 0.95
        solved += 1
        one.close()
    assert solved >= 3


def test_stable_baselines_sees_the_same():
    pytest.importorskip("stable_baselines3")
    from kerf.gym.baselines import BaselinesVecEnv

    theirs, ours = BaselinesVecEnv(TASKS[0], 3, max_episode_steps=4), kerf.gym.make_vec(TASKS[0], 3, max_episode_steps=4)
    theirs.seed(5)
    seen, (same, told) = theirs.reset(), ours.reset(seed=5)
    begun = [{word: told[word][row] for word in told if not word.startswith("_")} for row in range(3)]
    assert begun[0] and theirs.reset_infos == begun
    random = np.random.default_rng(2)
    for turn in range(4):
        assert (seen == same).all()
        actions = random.uniform(-1, 1, theirs.tasks.action_space.shape)
        seen, rewards, dones, infos = theirs.step(actions)
        same, expected, terminated, truncated, _ = ours.step(actions)
        assert rewards == pytest.approx(expected, rel=1e-6)
        assert (dones == (terminated | truncated)).all() and dones.all() == (turn == 3)
    for row, info in enumerate(infos):
        assert (info["terminal_observation"] == same[row]).all() and info["TimeLimit.truncated"] and info["episode"]["l"] == 4
        assert 0 < info["episode"]["t"] < 600
    assert all(info.keys() == begun[0].keys() and info != was for info, was in zip(theirs.reset_infos, begun, strict=True))
    begun, *_ = ours.step(np.zeros_like(actions))  # ours begins anew with the next step
    assert (seen == begun).all()
    theirs.close()
    ours.close()


def volume_of(session):
    """Of the closed surface at rest, by the divergence theorem."""
    a, b, c = np.moveaxis(session.rest_positions[session.triangles], 1, 0)
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def test_a_bite_takes_a_disc_of_the_wedge():
    """Closed form: the meniscus is 4 mm thick at the outer wall, y = 0, and 1 mm at the inner rim, y = 13 mm, with straight lines between."""
    envs = kerf.gym.make_vec("Kerf/Meniscectomy-v0", 1)
    for y in (0.0095, 0.0105):
        envs.reset(seed=2)
        envs.lesion[0], envs.punch[0] = (0, 0.0125), (0, y)
        before = volume_of(envs.sessions[0])
        _, _, _, _, info = envs.step(np.array([[0, 0, 1]]))
        assert envs.gone[0] == pytest.approx(np.pi * 0.0016**2 * (0.004 - 0.003 * y / 0.013), rel=0.05)
        assert envs.gone[0] == pytest.approx(before - volume_of(envs.sessions[0]), rel=1e-6)
        assert info["bites"][0] == 1
    envs.close()


def volume_in_disc(middle, radius):
    """Brute force, m3: the crescent between two ovals (docs of the model "meniscus"), 4 mm thick at the outer one, 1 mm at the inner one."""
    angle, across = np.linspace(-2.6, -0.5, 2001), np.linspace(0, 1, 401)

    def oval(half_width, below, center, power):
        c, s = np.cos(angle), np.sin(angle)
        r = ((np.abs(c) / half_width) ** power + (np.abs(s) / below) ** power) ** (-1 / power)
        return 1e-3 * np.stack([r * c, center + r * s], axis=1)

    outer, inner = oval(22.5, 15.5, 15.5, 2.8), oval(8.3, 9.0, 22.0, 2.2)
    places = outer[:, None] + across[:, None] * (inner - outer)[:, None]
    a, b = places[1:, :-1] - places[:-1, :-1], places[:-1, 1:] - places[:-1, :-1]
    area = np.abs(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
    centre = 0.25 * (places[1:, 1:] + places[:-1, :-1] + places[1:, :-1] + places[:-1, 1:])
    inside = ((centre - middle) ** 2).sum(axis=2) < radius**2
    return (area * (0.004 - 0.003 * (across[1:] + across[:-1]) / 2) * inside).sum()


def test_a_lesion_is_as_large_as_brute_force_says():
    envs = kerf.gym.make_vec("Kerf/Meniscectomy-v0", 6)
    envs.reset(seed=30)
    for row in range(6):
        assert envs.volume[row] == pytest.approx(volume_in_disc(envs.lesion[row], envs.radius[row]), rel=0.05)
    envs.close()


def test_what_is_left_of_a_lesion_is_what_the_score_says():
    """The bites of an episode, done again in a scene whose [lesion] it is; its score is made of the prisms of a coarser mesh."""
    for seed in range(60, 63):
        one = gymnasium.make("Kerf/Meniscectomy-v0").unwrapped
        one.reset(seed=seed)
        tasks, bites, terminated = one.tasks, [], False
        while not terminated:
            action = one.expert()
            _, _, terminated, _, info = one.step(action)
            if action[2] > 0:
                bites.append(tasks.punch[0].copy())
        ball = {"center": [*tasks.lesion[0], 0], "radius": tasks.radius[0]}
        with kerf.Session({**tasks.scene(), "lesion": {"sphere": ball}}) as scored:
            for place in bites:
                scored.punch([*place, 0], 0.0016, take=True)
            score = scored.score
            assert info["lesion_left"] == pytest.approx(1 - score["lesion_removed"], abs=0.03)
            assert tasks.volume[0] == pytest.approx(score["lesion_volume"], rel=0.12)
            assert info["healthy_removed"] == pytest.approx(score["healthy_removed"] / score["lesion_volume"], abs=0.05)
            assert volume_of(scored) == pytest.approx(volume_of(one.session), rel=1e-9)
        assert tasks.gone[0] == pytest.approx(tasks.whole.sum() - volume_of(one.session), rel=1e-3)
        one.close()


def test_what_a_shaver_took_is_healthy_tissue_and_bumps(monkeypatch):
    """Volume of the closed surface: what it lost, against the prisms' loss and the bumps, which a punch without roughness does not leave."""
    bites, punch = [], kerf.Session.punch

    def noted(session, point, radius, **how):
        bites.append((point, radius))
        return punch(session, point, radius, **how)

    monkeypatch.setattr(kerf.Session, "punch", noted)
    one = gymnasium.make("Kerf/Debride-v0").unwrapped
    one.reset(seed=70)
    rough, tasks = volume_of(one.session), one.tasks
    with kerf.Session(tasks.scene()) as smooth:
        for point, radius in bites[:2]:
            punch(smooth, point, radius, take=True)
        bumps = rough - volume_of(smooth)
    terminated = False
    while not terminated:
        _, reward, terminated, _, info = one.step(one.expert())
    assert info["is_success"] and info["roughness_left"] < 0.2
    for _ in range(3):  # bumps that are left
        for place in tasks.edge[0]:
            window = [place + (0, 0, 0.002), place - (0, 0, 0.002)]
            one.session.shave([window, window], [0, 0.01], 0.0009, frame="rest", smoothing=200, removal=0)
            one.session.step(2)
    assert one.session.roughness < 2e-6
    assert 0.5e-9 < bumps < 2e-9
    assert rough - volume_of(one.session) == pytest.approx(info["healthy_removed"] + bumps, rel=0.03)
    one.close()


def test_the_roughness_of_places_is_that_of_the_edge():
    envs = kerf.gym.make_vec("Kerf/Debride-v0", 4)
    envs.reset(seed=31)
    for _ in range(12):
        assert np.sqrt((envs.rough**2).mean(axis=1)) == pytest.approx([session.roughness for session in envs.sessions], rel=0.35)
        for row, session in enumerate(envs.sessions):  # brute force: places lie on the border of the collision mesh, between the rims
            corners = session.collision_rest_positions[session.collision_triangles][..., :2]
            inside = envs.edge[row, :, :2] - 2e-5 * envs.away[row]
            outside = envs.edge[row, :, :2] + 2e-5 * envs.away[row]
            assert covers(corners, inside).all() and not covers(corners, outside).any()
        envs.step(envs.expert())
    envs.close()


def test_a_shaver_that_presses_feels_the_spring_of_the_hand():
    """At rest the body pushes as hard as the spring pulls: 1000 N/m times how far the hand is ahead."""
    envs = kerf.gym.make_vec("Kerf/Debride-v0", 2)
    envs.reset(seed=33)
    for _ in range(40):
        way = (envs.now[:, 5, :2] - envs.hand) / 0.0005
        envs.step(np.concatenate([np.clip(way, -1, 1), -np.ones((2, 1))], axis=1))
    assert (np.linalg.norm(envs.force, axis=1) > 0.2).all()
    assert envs.force == pytest.approx(1000 * (envs.shaver - envs.hand), abs=0.02)
    assert (envs.healthy == 0).all()
    envs.close()


def own_task():
    """The task of docs/learning.md: the names that its text leaves behind."""
    page = (Path(__file__).parents[2] / "docs" / "learning.md").read_text()
    text = next(part.split("```")[0] for part in page.split("```python\n") if "class Halve" in part)
    names = {"__name__": __name__}
    exec(compile(text, "docs/learning.md", "exec"), names)
    return names


def test_the_documented_task_is_one():
    names = own_task()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*Box observation space.*")
        check_env(names["env"].unwrapped, skip_render_check=True)
    envs = names["envs"]
    total, solved = play(envs, lambda _: envs.expert(), seed=2)
    assert solved.all() and (total > 0).all()
    masses = [np.sort(session.piece_masses) for session in envs.sessions]
    envs.close()
    envs = gymnasium.make_vec("Own/Halve-v0", num_envs=2)  # Gymnasium takes the vector environment, not copies of one
    assert isinstance(envs, names["Halve"])
    envs.close()
    assert len(masses) == 4


def test_a_task_may_be_registered_again():
    names = own_task()
    kerf.gym.register("Own/Halve-v0", names["Halve"])
    for wrong in ({"name": "Own/Halve-v0"}, {"task": names["Halve"]}, {"name": "Own/Halve-v0", "task": kerf.Session},
                  {"name": 5, "task": names["Halve"]}, {}, {"name": "Own/Any-v0", "task": kerf.gym.Tasks}):
        with pytest.raises(TypeError, match=r"register\(\) takes a name and a class"):
            kerf.gym.register(**wrong)
    for name in ("Halve", "Halve-v0", "Own/Halve", "Own/Halve-vx", "/Halve-v0", "Own/-v0", "Own/Halve v0", ""):
        with pytest.raises(ValueError, match=r"register\(\) takes a name of namespace, task and version"):
            kerf.gym.register(name, names["Halve"])


class Still(kerf.gym.Tasks):
    """A task that pickle finds by its name."""

    steps, action_size, state_size = 1, 1, 1

    def scene(self):
        return {"body": {"model": "sheet"}}

    def begin(self, row, random):
        pass

    def control(self, actions, plays):
        return {}

    def look(self, states, rows):
        states[rows] = 0

    def judge(self, plays):
        return np.zeros(self.num_envs), np.zeros(self.num_envs, bool)


class Level(Still):
    """With something for each copy, and something for all."""

    def prepare(self):
        self.level, self.gain = np.zeros(self.num_envs), 1.0

    def expert(self):
        return np.arange(self.num_envs, dtype=np.float32)[:, None]

    def scaled(self, by, plus=0):
        return self.level * by + plus

    def name_of_it(self):
        return "level"


def test_attributes_and_methods_by_name():
    """As gymnasium's SyncVectorEnv of single copies answers."""
    env = Level(3, threads=1)
    env.reset(seed=1)
    assert env.get_attr("session") == tuple(env.sessions) and env.get_attr("gain") == (1.0,) * 3 and env.get_attr("level") == (0, 0, 0)
    assert env.get_attr("action_space") == (env.single_action_space,) * 3 and env.get_attr("elapsed") == (0, 0, 0)
    env.set_attr("level", [1, 2, 3])
    assert env.get_attr("level") == (1, 2, 3) and env.call("scaled", 10, plus=1) == (11, 21, 31)
    env.set_attr("level", 7)
    assert env.get_attr("level") == (7, 7, 7) and isinstance(env.level, np.ndarray)
    env.set_attr("gain", [2.0, 2.0, 2.0])
    env.set_attr("curriculum", "hard")
    env.set_attr("randomise", True)
    assert env.gain == 2.0 and env.curriculum == "hard" and env.randomise is True
    assert [row.tolist() for row in env.call("expert")] == [[0], [1], [2]] and env.call("name_of_it") == ("level",) * 3
    with pytest.raises(ValueError, match="must be one, or 3, one for each copy, not 2"):
        env.set_attr("level", [1, 2])
    with pytest.raises(ValueError, match="gain of Level is one for all copies; give one value"):
        env.set_attr("gain", [1.0, 2.0, 3.0])
    for name in ("sessions", "batch", "num_envs", "step", "_states", "_locked", "elapsed", "pixels", "metadata"):
        with pytest.raises(ValueError, match=f"{name} of Level can't be set from outside"):
            env.set_attr(name, 1)
    with pytest.raises(AttributeError):
        env.get_attr("nosuch")
    with pytest.raises(ValueError, match="private"):
        env.call("_observed")
    env.step(np.zeros((3, 1)))
    env.close()
    shipped = kerf.gym.make_vec("Kerf/PatternCut-v0", 2, threads=1)
    shipped.reset(seed=1)
    assert len(shipped.call("expert")) == 2 and shipped.get_attr("session") == tuple(shipped.sessions)


@pytest.mark.parametrize("name", [*TASKS, "Own/Still-v0"])
def test_specs_are_pickled_and_environments_are_not(name):
    if name not in gymnasium.registry:
        kerf.gym.register(name, Still)
    spec = pickle.loads(pickle.dumps(gymnasium.spec(name)))
    assert spec == gymnasium.spec(name)
    for env in (gymnasium.make(name).unwrapped, kerf.gym.make_vec(name, 2, threads=1)):
        assert pickle.loads(pickle.dumps(type(env))) is type(env)
        for copied in (pickle.dumps, copy.copy, copy.deepcopy):
            with pytest.raises(TypeError, match="an environment of kerf.gym can't be copied or pickled"):
                copied(env)
        env.close()
    again = gymnasium.make(spec)
    assert type(again.unwrapped) is type(gymnasium.make(name).unwrapped)
    again.close()


def materials(kind, **options):
    """Young's modulus and density of two copies (2, 2) in each of three episodes, the first of the seed 5."""
    envs = kind(2, threads=1, **options)
    found = []
    for seed in (5, None, None):
        envs.reset(seed=seed)
        found.append([[session.material[word] for word in ("young", "density")] for session in envs.sessions])
    envs.close()
    return np.array(found)


def test_a_task_of_ones_own_is_randomised():
    Halve = own_task()["Halve"]
    scene = kerf.Session("sheet").material
    usual = np.array([scene["young"], scene["density"]])
    assert (materials(Halve) == usual).all()
    octaves = np.log2(materials(Halve, randomise=True) / usual)
    assert (np.abs(octaves) <= (1, 0.5)).all() and len(np.unique(octaves)) == octaves.size
    assert (np.log2(materials(Halve, randomise=True) / usual) == octaves).all()
    wide = materials(type("Wide", (Halve,), {"variety": {"young": 0.1}}), randomise=True)
    assert len(np.unique(wide[..., 0])) == 6 and np.abs(np.log2(wide[..., 0] / usual[0])).max() <= 0.1 and (wide[..., 1] == usual[1]).all()


def test_a_material_lasts_for_its_episode():
    """What vary() or begin() sets is put back: the next episode finds the scene's."""
    Halve = own_task()["Halve"]
    found = []

    def vary(self, row, random):
        found.append(self.sessions[row].material["young"])
        self.sessions[row].set_material(young=found[-1] * 1.5)

    material = materials(type("Stiff", (Halve,), {"vary": vary}), randomise=True)
    assert len(found) == 6 and set(found) == {kerf.Session("sheet").material["young"]} and (material[..., 0] == 1.5 * found[0]).all()


@pytest.mark.parametrize("name", TASKS)
def test_every_task_is_randomised(name):
    envs = kerf.gym.make_vec(name, 2, randomise=True)
    envs.reset(seed=1)
    first, second = (session.material for session in envs.sessions)
    scene = kerf.Session(envs.scene()).material
    assert all(len({first[word], second[word], scene[word]}) == 3 for word in ("young", "density"))
    assert first["poisson"] == second["poisson"] == scene["poisson"]
    envs.close()


def test_a_task_that_lacks_something_says_what():
    class Half(kerf.gym.Tasks):
        action_size = state_size = 1

        def scene(self):
            return {"body": {"model": "sheet"}}

    with pytest.raises(NotImplementedError, match=r"Half has no begin\(\)"):
        Half(1).reset(seed=0)
    with pytest.raises(NotImplementedError, match="Tasks has no action_size; help"):
        kerf.gym.Tasks(1)


@pytest.mark.parametrize(("method", "answer", "error", "words"), [
    ("control", None, TypeError, r"control\(\) of Wrong must return a dict"), ("judge", None, TypeError, r"judge\(\) of Wrong must return two arrays"),
    ("judge", np.zeros(3), TypeError, "two arrays"), ("judge", (np.zeros((3, 1)), np.zeros(3, bool)), ValueError, r"rewards of Wrong must be of shape \(3,\)"),
    ("judge", (np.zeros(3), np.zeros(2, bool)), ValueError, "ends of Wrong"), ("judge", (0.0, np.zeros(3, bool)), ValueError, "rewards of Wrong"),
    ("judge", (np.array([0, np.nan, 0]), np.zeros(3, bool)), ValueError, "rewards of Wrong.* must be finite; that of copy 1 is nan"),
    ("judge", (["a", "b", "c"], np.zeros(3, bool)), TypeError, "rewards of Wrong.* must be numbers"),
    ("judge", (np.zeros(3), None), TypeError, "ends of Wrong.* must be truth values, not of type NoneType"),
    ("judge", (np.zeros(3), np.zeros(3)), TypeError, "truth values, not of type float64"), ("judge", (np.zeros(3), False), ValueError, "ends of Wrong"),
    ("look", np.zeros((3, 4)), TypeError, r"look\(\) of Wrong must write into states\[rows\] and return nothing, not ndarray"),
    ("look", None, ValueError, r"states\[0, 0\] was left out or is nan"), ("expert", None, TypeError, r"expert\(\) of Wrong .*not of type NoneType"),
    ("expert", np.zeros(3), ValueError, r"expert\(\) of Wrong .*\(3, 2\), not \(3,\)"),
    ("expert", np.full((3, 2), np.nan), ValueError, r"expert\(\) of Wrong returns must be finite"), ("tell", None, TypeError, r"tell\(\) of Wrong must return a dict"),
    ("control", {"steps": 3}, TypeError, r"control\(\) of Wrong may return blade, cuts, grasps, tools, not 'steps'"),
    ("control", {"blade": np.zeros((2, 2, 3))}, ValueError, r"control\(\) of Wrong: blade must be"),
    ("control", {"grasps": [0]}, TypeError, r"control\(\) of Wrong: grasps must be a dict"),
    ("control", {"grasps": {"hnad": np.zeros((3, 3))}}, ValueError, r"control\(\) of Wrong leads the grasp 'hnad', which no copy has had; there is none"),
    ("control", {"tools": {"kinfe": np.zeros((3, 6))}}, ValueError, r"control\(\) of Wrong leads the tool 'kinfe'"),
    ("tell", {5: np.zeros(3)}, TypeError, r"tell\(\) of Wrong must name its values by text, not 5"), ("tell", {"far": np.zeros(2)}, ValueError, r"tell\(\)\['far'\] of Wrong must be of shape \(3,\)")])
def test_a_task_that_answers_wrongly_is_told_so(method, answer, error, words):
    Halve = own_task()["Halve"]
    envs = type("Wrong", (Halve,), {method: lambda *given: answer})(3, threads=1)
    with pytest.raises(error, match=words):
        envs.reset(seed=0)
        envs.step(envs.expert())
    envs.close()


def test_a_state_that_is_no_number_is_told():
    Halve = own_task()["Halve"]

    def look(self, states, rows):
        Halve.look(self, states, rows)
        states[rows & (self.elapsed == 1), 2] = np.nan

    envs = type("Wrong", (Halve,), {"look": look})(3, threads=1)
    envs.reset(seed=0)
    with pytest.raises(ValueError, match=r"look\(\) of Wrong .*states\[0, 2\]"):
        envs.step(envs.expert())
    envs.close()


@pytest.mark.parametrize(("method", "answer", "error", "words"), [
    ("marked", None, TypeError, r"marked\(\) of Wrong .*not of type NoneType"), ("marked", np.zeros(3), ValueError, r"marked\(\) of Wrong .*not of shape \(3,\)"),
    ("marked", [[0, 0, np.nan]], ValueError, r"marked\(\) of Wrong returns must be finite"),
    ("marked", [[0, 0, 0], [1, 2]], ValueError, r"marked\(\) of Wrong .*rows differ"),
    ("blade", np.zeros(3), ValueError, r"blade\(\) of Wrong .*not of shape \(3,\)"),
    ("blade", [[0, 0, np.inf], [0, 0, 0]], ValueError, r"blade\(\) of Wrong returns must be finite"),
    ("marked", np.array(1.0), ValueError, r"marked\(\) of Wrong .*not of shape \(\)"), ("blade", "up", TypeError, r"blade\(\) of Wrong")])
def test_what_pictures_cannot_show_is_told(method, answer, error, words):
    envs = type("Wrong", (Still,), {method: lambda self, row: answer})(1, render_mode="rgb_array")
    envs.reset(seed=0)
    with pytest.raises(error, match=words):
        envs.render()
    envs.close()


def test_pictures_take_lists_and_nothing():
    def picture(**methods):
        envs = type("Shown", (Still,), {name: lambda self, row, answer=answer: answer for name, answer in methods.items()})(1, render_mode="rgb_array")
        envs.reset(seed=0)
        seen = envs.render()[0]
        envs.close()
        return seen

    plain, line = picture(), [[0, 0, 0.1], [0, 0.2, 0.3]]
    for nothing in ([], (), np.array([]), np.zeros((0, 3))):
        assert (picture(marked=nothing) == plain).all() and (picture(blade=nothing) == plain).all()
    assert (picture(blade=None) == plain).all()
    for method in ("marked", "blade"):
        seen = picture(**{method: line})
        assert (seen == picture(**{method: np.array(line)})).all() and (seen != plain).any()


@pytest.mark.parametrize(("camera", "error"), [
    ({"eye": (0, 0, 1)}, TypeError), ({"eye": (0, 0, 1), "target": (0, 0, 0), "zoom": 2}, TypeError), ("above", TypeError),
    ({"eye": (0, 0), "target": (0, 0, 0)}, ValueError), ({"eye": (0, 0, 0), "target": (0, 0, 0)}, ValueError)])
def test_a_camera_that_is_none_is_told(camera, error):
    with pytest.raises(error, match="camera of Wrong must be a dict with eye and target"):
        type("Wrong", (Still,), {"camera": camera})(1)


def test_a_grasp_that_is_lost_ends_the_episode():
    """It is the copy's own trouble, in one copy as in all; a name that no copy has had is the task's."""
    def prepare(self):
        for session in self.sessions:
            session.grasp("hand", [0, 0, 0], radius=0.1)

    def control(self, actions, plays):
        for row in np.flatnonzero(plays & (actions[:, 0] > 0)):
            self.sessions[row].release("hand")
        return {"grasps": {"hand": np.zeros((self.num_envs, 3))}}

    kind = type("Held", (Still,), {"prepare": prepare, "control": control})
    for n in (1, 2):
        envs = kind(n, threads=1)
        envs.reset(seed=0)
        assert not envs.step(np.zeros((n, 1)))[3].any()
        lost = np.arange(n) == 0
        _, _, terminated, truncated, info = envs.step(lost[:, None].astype(float))
        assert (truncated == lost).all() and not terminated.any() and "there is no grasp 'hand'" in info["error"][0]
        envs.close()


def test_a_grasp_is_made_in_an_episode():
    """Copies that hold the sheet are led, others are left alone."""
    def begin(self, row, random):
        self.holds[row] = False

    def prepare(self):
        self.holds, self.hand = np.zeros(self.num_envs, bool), np.zeros((self.num_envs, 3))

    def control(self, actions, plays):
        for row in np.flatnonzero(plays & ~self.holds & (actions[:, 0] > 0)):
            self.sessions[row].grasp("hand", [0, 0, 0], radius=0.1)
            self.holds[row] = True
        self.hand[plays & self.holds] += (0, 0, 0.01)
        return {"grasps": {"hand": np.where(self.holds[:, None], self.hand, np.nan)}}

    envs = type("Flap", (Still,), {"prepare": prepare, "begin": begin, "control": control})(3, threads=1)
    envs.reset(seed=0)
    for takers in ([], [1], [0, 1], []):
        actions = np.zeros((3, 1))
        actions[takers] = 1
        _, _, _, truncated, info = envs.step(actions)
        assert not truncated.any() and "error" not in info
    assert [list(session.grasp_ids) for session in envs.sessions] == [["hand"], ["hand"], []]
    assert [session.grasps[0]["target"][2] for session in envs.sessions[:2]] == pytest.approx([0.02, 0.03])
    envs.close()


@pytest.mark.parametrize("name", ["size", "pixels", "closed", "spec", "batch", "sessions", "num_envs", "render_mode", "randomise", "horizon_now",
                                  "metadata", "blade", "look", "step", "np_random_seed", "_states", "_ended", "_met"])
def test_names_that_are_taken_are_refused(name):
    def prepare(self):
        vars(self)[name] = np.zeros(self.num_envs)

    with pytest.raises(AttributeError, match=f"Wrong calls something of its own {name}; kerf.gym.Tasks needs that name"):
        type("Wrong", (Still,), {"prepare": prepare})(2, threads=1)


def test_names_of_classes_and_constructors_are_refused():
    def begin_with(name, value):
        def init(self, *given, **options):
            setattr(self, name, value)
            kerf.gym.Tasks.__init__(self, *given, **options)

        return {"__init__": init}

    for members in ({"size": 3}, {"batch": lambda self: None}, {"sessions": []}, begin_with("size", 3), begin_with("batch", None), begin_with("blade", 1)):
        with pytest.raises(AttributeError, match="Wrong calls something of its own (size|batch|sessions|blade);"):
            type("Wrong", (Still,), members)(1)
    type("Fine", (Still,), {"width": 3, **begin_with("width", 5)})(1).close()
    wide = type("Wide", (Still,), begin_with("state_size", 5))(1)
    assert wide.reset(seed=1)[0].shape == (1, 5)
    wide.close()


@pytest.mark.parametrize("name", ["action_size", "state_size", "steps", "horizon"])
@pytest.mark.parametrize(("wrong", "error"), [(0, ValueError), (-2, ValueError), (2.5, TypeError), (None, TypeError), ("2", TypeError)])
def test_numbers_of_a_task_are_whole(name, wrong, error):
    with pytest.raises(error, match=f"{name} of Wrong must be"):
        type("Wrong", (own_task()["Halve"],), {name: wrong})(1)


@pytest.mark.parametrize(("name", "value", "error"), [("steps", np.arange(3), TypeError), ("steps", 7, ValueError), ("horizon", 7, ValueError),
                                                      ("state_size", 7, ValueError)])
def test_numbers_of_a_task_stand_before_it_is_prepared(name, value, error):
    def prepare(self):
        setattr(self, name, value)

    with pytest.raises(error, match=f"{name} of Wrong "):
        type("Wrong", (Still,), {"prepare": prepare})(1)


def test_seeds_may_be_an_array_and_somebody_is_reset():
    envs = Still(2, threads=1)
    envs.reset(seed=np.array([3, 4]))
    assert envs.np_random_seed == (3, 4)
    with pytest.raises(ValueError, match="true for one copy or more"):
        envs.reset(options={"reset_mask": np.zeros(2, bool)})
    with pytest.raises(TypeError, match="num_envs must be a whole number, not bool"):
        Still(True)
    envs.close()


def test_one_value_stands_for_all_copies():
    Halve = own_task()["Halve"]
    kind = type("Same", (Halve,), {"judge": lambda self, plays: (np.ones(2, np.float32), [False, False]), "tell": lambda self: {"word": "yes", "size": [1.5, 2.5]}})
    envs = kind(2, threads=1)
    envs.reset(seed=0)
    _, rewards, terminated, _, info = envs.step(envs.expert())
    assert rewards.tolist() == [1, 1] and rewards.dtype == float and terminated.tolist() == [False, False] and envs.elapsed.tolist() == [1, 1]
    assert info["word"].tolist() == ["yes", "yes"] and info["size"].tolist() == [1.5, 2.5]
    envs.close()


@pytest.mark.parametrize("name", TASKS)
def test_no_step_without_an_episode(name):
    env, envs = gymnasium.make(name, max_episode_steps=1000).unwrapped, kerf.gym.make_vec(name, 2, max_episode_steps=1)
    still = np.zeros(env.action_space.shape, np.float32)
    for early in (lambda: env.step(still), env.expert, envs.expert, lambda: envs.step(np.stack([still, still])),
                  lambda: envs.reset(options={"reset_mask": np.array([True, False])})):
        with pytest.raises(kerf.Error, match=r"call reset\(\)"):
            early()
    env.reset(seed=0)
    env.step(still)
    env.close()
    envs.close()
    for late in (lambda: env.step(still), env.expert, envs.expert, env.reset, envs.reset, env.render, envs.render):
        with pytest.raises(kerf.Error, match="this environment is closed; make another one"):
            late()
    one = kerf.gym.PatternCutEnv(max_episode_steps=1)
    one.reset(seed=0)
    assert one.step(np.zeros(3))[3]
    with pytest.raises(kerf.Error, match=r"ended; call reset\(\)"):
        one.step(np.zeros(3))
    one.close()


def clumsy_task():
    """A task whose begin() raises while its `clumsy` is set; an episode has two actions."""
    Halve = own_task()["Halve"]

    def begin(self, row, random):
        if self.clumsy and row == self.num_envs - 1:
            raise RuntimeError("clumsy")
        Halve.begin(self, row, random)

    return type("Clumsy", (Halve,), {"begin": begin, "clumsy": False, "horizon": 2})


def test_an_episode_that_did_not_begin_is_none():
    """In many, where an episode is to begin by itself, and in one."""
    kind = clumsy_task()
    kerf.gym.register("Own/Clumsy-v0", kind)
    envs, one = kind(2, threads=1), gymnasium.make("Own/Clumsy-v0").unwrapped
    still = np.zeros((2, 2))
    envs.reset(seed=1)
    one.reset(seed=1)
    for _ in range(2):
        assert envs.elapsed.max() < 2
        envs.step(still)
        one.step(still[0])
    kind.clumsy = True
    for begin in (lambda: envs.step(still), one.reset):
        with pytest.raises(RuntimeError, match="clumsy"):
            begin()
    for _ in range(2):
        with pytest.raises(kerf.Error, match=r"no episode has begun in copy|no episode has begun; call reset\(\)"):
            envs.step(still)
        with pytest.raises(kerf.Error, match=r"no episode has begun; call reset\(\)"):
            one.step(still[0])
    with pytest.raises(kerf.Error, match="without a mask"):
        envs.reset(options={"reset_mask": np.array([True, False])})
    kind.clumsy = False
    envs.reset(options={"reset_mask": np.array([True, True])})
    one.reset()
    envs.step(still)
    one.step(still[0])
    assert envs.elapsed.tolist() == [1, 1] and one.tasks.elapsed.tolist() == [1]
    kind.clumsy = True
    with pytest.raises(RuntimeError, match="clumsy"):  # one whose episode goes on
        one.reset()
    with pytest.raises(kerf.Error, match=r"call reset\(\)"):
        one.expert()
    one.close()
    envs.close()


def test_what_is_no_action_is_told_in_its_own_shape():
    env = gymnasium.make(TASKS[0]).unwrapped
    env.reset(seed=0)
    size = env.action_space.shape[0]
    for wrong, error, words in ((None, TypeError, "not of type NoneType"), ("x", TypeError, "numbers"),
                                (np.zeros(size, complex), TypeError, "complex"), (np.zeros(size + 1), ValueError, rf"\({size},\), not \({size + 1},\)"),
                                (np.full(size, np.inf), ValueError, "finite")):
        with pytest.raises(error, match=words):
            env.step(wrong)
    env.close()


@pytest.mark.parametrize(("wrong", "error"), [
    ({"size": 0}, ValueError), ({"size": 10**6}, ValueError), ({"size": "64"}, TypeError), ({"num_envs": 2.5}, TypeError),
    ({"randomise": "no"}, TypeError), ({"randomise": 1}, TypeError), ({"num_envs": "2"}, TypeError), ({"max_episode_steps": 0}, ValueError), ({"max_episode_steps": 2.5}, TypeError)])
def test_options_of_another_kind_are_refused(wrong, error):
    with pytest.raises(error):
        kerf.gym.make_vec(TASKS[0], **{"num_envs": 1, **wrong})


def test_options_of_reset_are_known():
    name = "Kerf/Meniscectomy-v0"
    one, envs = gymnasium.make(name), kerf.gym.make_vec(name, 2)
    for env, wrong, words in ((one, "reset_mask", "may have nothing in them, not 'reset_mask'"), (envs, "reset_mak", "may have 'reset_mask', not 'reset_mak'")):
        env.reset(seed=1, options={})
        with pytest.raises(ValueError, match=words):
            env.reset(options={wrong: np.ones(2, bool)})
        with pytest.raises(TypeError, match="options must be a dict"):
            env.reset(options=[1])
        env.close()


def test_what_has_elapsed_is_only_read():
    envs = Still(2, threads=1)
    envs.reset(seed=1)
    before = envs.elapsed
    envs.step(np.zeros((2, 1)))
    assert before.tolist() == [0, 0] and envs.elapsed.tolist() == [1, 1]
    with pytest.raises(ValueError, match="read-only"):
        envs.elapsed[0] = 5
    envs.close()


@pytest.mark.parametrize(("wrong", "error"), [("x", TypeError), (1.5, TypeError), (-1, ValueError), ([1, 2, 3], ValueError), ([1, "x"], TypeError)])
def test_seeds_that_are_none_are_refused(wrong, error):
    envs = kerf.gym.make_vec("Kerf/Meniscectomy-v0", 2)
    with pytest.raises(error, match="seed"):
        envs.reset(seed=wrong)
    envs.close()


@pytest.mark.parametrize(("variety", "error", "words"), [
    ({"yuong": 1.0}, ValueError, "variety of Odd may have 'young', 'poisson', 'density', not 'yuong'"), ({"young": "1"}, TypeError, "'young'"),
    ({"young": -1}, ValueError, "0 or more"), ({"young": np.inf}, ValueError, "finite"), (["young"], TypeError, "must be a dict")])
@pytest.mark.parametrize("randomise", [False, True])
def test_a_variety_that_is_none_is_refused(variety, error, words, randomise):
    Odd = type("Odd", (own_task()["Halve"],), {"variety": variety})
    with pytest.raises(error, match=words):
        Odd(1, randomise=randomise)


def test_masked_actions_are_refused():
    envs = kerf.gym.make_vec(TASKS[0], 1)
    envs.reset(seed=1)
    with pytest.raises(TypeError, match="masked"):
        envs.step(np.ma.masked_array(np.zeros(envs.action_space.shape), mask=True))
    envs.close()


COPIES = """
import resource, sys
import kerf.gym
resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))  # where nothing looks ahead, that is the end
from kerf.gym import _memory
if len(sys.argv) > 2:
    _memory.free_bytes = lambda: float(sys.argv[2])
try:
    kerf.gym.make_vec("Kerf/PatternCut-v0", int(sys.argv[1])).close()
except ValueError as error:
    print(error)
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="memory is asked of Linux")
def test_copies_that_do_not_fit_are_refused():
    def said(*arguments):
        done = subprocess.run([sys.executable, "-c", COPIES, *arguments], capture_output=True, text=True, timeout=100)
        assert done.returncode == 0, done.stderr
        return done.stdout

    assert re.search(r"num_envs must be \d+ at most here: of 1000000000 copies", said("1000000000"))
    few = int(re.search(r"must be (\d+) at most", said("64", "1e8"))[1])
    assert 8 < few < 64
    assert said(str(few // 2), "1e8") == said("9") == ""
