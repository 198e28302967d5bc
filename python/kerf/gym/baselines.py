"""Tasks for Stable-Baselines3."""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Any

import numpy as np

from . import make_vec

try:
    from stable_baselines3.common.vec_env import VecEnv
except ImportError as error:
    raise ImportError("kerf.gym.baselines needs Stable-Baselines3: pip install stable-baselines3") from error

__all__ = ["BaselinesVecEnv"]


class BaselinesVecEnv(VecEnv):
    """n copies of a task as a VecEnv of Stable-Baselines3. name, options: as of make_vec().

    A copy that ends begins anew at once; info["terminal_observation"] and info["episode"] tell of what was.
    """

    def __init__(self, name: str, num_envs: int, **options: Any) -> None:
        self.tasks = make_vec(name, num_envs, **options)
        self.render_mode = self.tasks.render_mode
        super().__init__(num_envs, self.tasks.single_observation_space, self.tasks.single_action_space)
        self._actions = np.zeros(self.tasks.action_space.shape, np.float32)
        self._returns, self._lengths = np.zeros(num_envs), np.zeros(num_envs, np.int64)
        self._began = np.full(num_envs, time.monotonic())  # s, of each episode

    def reset(self) -> Any:
        """Begins all episodes anew: observations."""
        observation, _ = self.tasks.reset(seed=[None if seed is None else int(seed) for seed in self._seeds])
        self._reset_seeds()
        self._returns[:], self._lengths[:], self._began[:] = 0, 0, time.monotonic()
        self._note_begun(range(self.num_envs))
        return observation

    def _note_begun(self, rows: Iterable[int]) -> None:
        """What is told of episodes that begin."""
        told = self.tasks._said()
        for row in rows:
            self.reset_infos[row] = {word: values.tolist()[row] for word, values in told.items()}

    def step_async(self, actions: Any) -> None:
        """Takes the actions of the step that step_wait() does."""
        self._actions = np.asarray(actions)

    def step_wait(self) -> Any:
        """Observations, rewards, dones, infos."""
        everyone = np.ones(self.num_envs, bool)
        rewards, terminated, truncated, failures = self.tasks.act(self._actions, everyone)
        self._returns += rewards
        self._lengths += 1
        told, dones = self.tasks._said(), terminated | truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        ended = np.flatnonzero(dones)
        if ended.size:
            last, now = self.tasks._observed(), time.monotonic()
            for row in ended:
                infos[row] = {word: values.tolist()[row] for word, values in told.items()}
                infos[row].update({"terminal_observation": last[row], "TimeLimit.truncated": bool(truncated[row]),
                                   "episode": {"r": float(self._returns[row]), "l": int(self._lengths[row]),
                                               "t": float(now - self._began[row])}})
                if row in failures:
                    infos[row]["error"] = failures[row]
            self.tasks.reset_rows(ended)
            self._note_begun(ended)
            self._returns[ended], self._lengths[ended], self._began[ended] = 0, 0, now
        if self.render_mode == "human":
            self.tasks._show()
        return self.tasks._observed(), rewards.astype(np.float32), dones, infos

    def close(self) -> None:
        """Frees all sessions."""
        self.tasks.close()

    def get_images(self) -> list[Any]:
        """Pictures of all copies."""
        return [self.tasks.picture(row, 480, 360) for row in range(self.num_envs)]

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """The attribute of the task, once for each copy asked for."""
        return [getattr(self.tasks, attr_name)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Sets it, for all copies."""
        setattr(self.tasks, attr_name, value)

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        """Calls it, once."""
        return [getattr(self.tasks, method_name)(*args, **kwargs)] * len(list(self._get_indices(indices)))

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """No copy is wrapped."""
        return [False] * len(list(self._get_indices(indices)))
