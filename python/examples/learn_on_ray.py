"""A policy learns to cut a pattern, on several processes or machines: PPO of RLlib on Kerf/PatternCut.

    pip install "$(ls dist/kerf-*.whl)[gym]" "ray[rllib]" torch
    python learn_on_ray.py --minutes 5 --runners 2 --out learned
    python learn_on_ray.py --address auto --runners 32 --out learned      # on a cluster that `ray start` has made

Each runner is a process of Ray that steps many copies by one call, in one thread. The learner is this process. What is learned goes to a folder,
and a run that finds it there goes on from it.
"""

import argparse
import os
import time
from pathlib import Path

os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")

import ray
from ray import tune
from ray.rllib.algorithms.ppo import PPOConfig

TASK = "Kerf/PatternCut-v0"


def create(context):
    """What a runner steps: `num_envs` copies as one, or one alone where RLlib asks what its spaces are."""
    import gymnasium
    import kerf.gym

    copies = context.get("num_envs")
    return kerf.gym.make_vec(TASK, copies, threads=1) if copies else gymnasium.make(TASK)


def settings(runners, copies, seed):
    return (
        PPOConfig()
        .environment("pattern-cut")
        .env_runners(num_env_runners=runners, num_envs_per_env_runner=copies, gym_env_vectorize_mode="vector_entry_point",
                     rollout_fragment_length=128)
        .fault_tolerance(restart_failed_env_runners=True)
        .training(lr=4e-4, gamma=0.98, lambda_=0.95, train_batch_size=max(runners, 1) * copies * 128, minibatch_size=512, num_epochs=8,
                  vf_clip_param=1e4)
        .rl_module(model_config={"fcnet_hiddens": [128, 128], "fcnet_activation": "tanh"})
        .debugging(seed=seed, log_level="ERROR")
    )


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--minutes", type=float, default=5)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--runners", type=int, default=2, help="processes that step; 0: this one")
    options.add_argument("--copies", type=int, default=16, help="of the task, in each runner")
    options.add_argument("--address", help="of a Ray cluster; by default this machine alone")
    options.add_argument("--out", type=Path, default=Path("learned"))
    options = options.parse_args()

    ray.init(address=options.address, include_dashboard=None if options.address else False, log_to_driver=False, logging_level="error")
    tune.register_env("pattern-cut", create)
    learner = settings(options.runners, options.copies, options.seed).build_algo()
    kept = options.out.resolve() / "checkpoint"
    if kept.exists():
        learner.restore_from_path(kept)
    began = time.monotonic()
    while time.monotonic() - began < 60 * options.minutes:
        result = learner.train()
        runners = result["env_runners"]
        actions = result["num_env_steps_sampled_lifetime"]
        seconds = time.monotonic() - began
        print(f"{seconds:6.0f} s  {actions:9.0f} actions  return {runners.get('episode_return_mean', float('nan')):7.2f}", flush=True)
    learner.save_to_path(kept)
    learner.stop()
    ray.shutdown()
    print(f"written: {options.out}")


if __name__ == "__main__":
    main()
