"""A policy learns to cut a pattern out of a gauze: PPO of Stable-Baselines3 on Kerf/PatternCut.

    pip install "$(ls dist/kerf-*.whl)[gym]" stable-baselines3 matplotlib pillow
    python learn_pattern_cut.py --minutes 20 --seed 1 --out learned

The wheel is built by `scripts/python --pack` in the source; the `kerf` on PyPI is another project.
Writes policy.zip, curve.csv, curve.png and episode.gif, and says how policy, expert and chance do on 64 episodes that the policy has not seen.
"""

import argparse
import csv
import time
from pathlib import Path

import gymnasium
import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback

import kerf.gym
from kerf.gym.baselines import BaselinesVecEnv

TASK = "Kerf/PatternCut-v0"
UNSEEN = 1_000_000  # seeds of the episodes that policies are judged by begin here
SETTINGS = {"n_steps": 128, "batch_size": 512, "n_epochs": 8, "gamma": 0.98, "learning_rate": 4e-4,
            "policy_kwargs": {"net_arch": [128, 128], "log_std_init": -0.7}}


class Progress(BaseCallback):
    """Notes mean return and share of solved episodes every ten seconds, and ends when the time is over."""

    def __init__(self, seconds):
        super().__init__()
        self.seconds, self.rows, self.returns, self.solved = seconds, [], [], []

    def _on_training_start(self):
        self.began = self.last = time.monotonic()

    def _on_step(self):
        for info in self.locals["infos"]:
            if "episode" in info:
                self.returns.append(info["episode"]["r"])
                self.solved.append(info["is_success"])
        now = time.monotonic()
        if self.returns and now - self.last > 10:
            self.last = now
            self.rows.append((now - self.began, self.num_timesteps, np.mean(self.returns[-100:]), np.mean(self.solved[-100:])))
            print("{:6.0f} s  {:9d} actions  return {:6.2f}  solved {:4.0%}".format(*self.rows[-1]), flush=True)
        return now - self.began < self.seconds


def judge(act, episodes=64):
    """Mean return and share of solved episodes that were not learned from."""
    envs = kerf.gym.make_vec(TASK, episodes)
    seen, _ = envs.reset(seed=UNSEEN)
    total, solved, done = np.zeros(episodes), np.zeros(episodes, bool), np.zeros(episodes, bool)
    while not done.all():
        seen, rewards, terminated, truncated, info = envs.step(act(envs, seen))
        total += np.where(done, 0, rewards)
        over = (terminated | truncated) & ~done
        solved |= over & info["is_success"]
        done |= over
    envs.close()
    return total.mean(), solved.mean()


def film(policy, file):
    """One episode as a film of 10 pictures a second."""
    from PIL import Image

    env = gymnasium.make(TASK, render_mode="rgb_array").unwrapped
    seen, _ = env.reset(seed=UNSEEN)
    pictures, over = [env.render()], False
    while not over:
        seen, _, terminated, truncated, _ = env.step(policy.predict(seen, deterministic=True)[0])
        over = terminated or truncated
        pictures.append(env.render())
    for _ in range(16):  # what came out falls
        env.session.step()
        pictures.append(env.render())
    frames = [Image.fromarray(picture).quantize(64) for picture in pictures[::2] + [pictures[-1]] * 5]
    frames[0].save(file, save_all=True, append_images=frames[1:], duration=100, loop=0, optimize=True)


def plot(rows, marks, file):
    """The learning curve, with what expert and chance get."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    seconds, _, returns, solved = np.array(rows).T
    figure, (above, below) = plt.subplots(2, 1, figsize=(7, 6), sharex=True, layout="constrained")
    above.plot(seconds / 60, returns, label="PPO, while it learns")
    for (name, (mean, _)), style in zip(marks.items(), ("-.", "--", ":"), strict=True):
        above.axhline(mean, linestyle=style, color="gray", linewidth=1, label=f"{name}, unseen episodes: {mean:.1f}")
    above.set_ylabel("return, mean of 100 episodes")
    above.legend(loc="center right")
    below.plot(seconds / 60, 100 * solved)
    below.set_ylabel("episodes solved, %")
    below.set_xlabel("minutes")
    figure.savefig(file, dpi=100)


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--minutes", type=float, default=20)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--copies", type=int, default=16, help="copies of the task that go on together")
    options.add_argument("--out", type=Path, default=Path("learned"))
    options = options.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    torch.set_num_threads(1)

    envs = BaselinesVecEnv(TASK, options.copies)
    policy = PPO("MlpPolicy", envs, seed=options.seed, device="cpu", **SETTINGS)
    progress = Progress(60 * options.minutes)
    policy.learn(10**12, callback=progress)
    policy.save(options.out / "policy.zip")
    with open(options.out / "curve.csv", "w", newline="") as file:
        csv.writer(file).writerows([("seconds", "actions", "return", "solved"), *progress.rows])

    random = np.random.default_rng(options.seed)
    marks = {"policy": judge(lambda _, seen: policy.predict(seen, deterministic=True)[0]),
             "expert": judge(lambda envs, _: envs.expert()),
             "chance": judge(lambda envs, _: random.uniform(-1, 1, envs.action_space.shape))}
    for name, (mean, solved) in marks.items():
        print(f"{name}: return {mean:.2f}, solved {solved:.0%}")
    if progress.rows:
        plot(progress.rows, marks, options.out / "curve.png")
    film(policy, options.out / "episode.gif")
    print(f"written: {options.out}")


if __name__ == "__main__":
    main()
