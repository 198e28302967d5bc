"""A task by itself."""

from __future__ import annotations

from typing import Any, ClassVar

import gymnasium
import numpy as np
from numpy.typing import NDArray

from .. import Error
from ._tasks import Tasks, given_actions, given_options, no_copies

__all__ = ["TaskEnv"]


class TaskEnv(gymnasium.Env):
    """One copy of the task `task` as a gymnasium.Env. Options: as of Tasks, but num_envs.

    tasks: the one copy of the task, with what it remembers. session: its kerf.Session.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["rgb_array", "human"], "render_fps": 20}

    task: ClassVar[type[Tasks]]

    def __init__(self, **options: Any) -> None:
        self.tasks = self.task(1, **options)
        self.render_mode = self.tasks.render_mode
        self.action_space = self.tasks.single_action_space
        self.observation_space = self.tasks.single_observation_space

    @property
    def session(self) -> Any:
        """The kerf.Session of the episode."""
        return self.tasks.sessions[0]

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[NDArray[Any], dict[str, Any]]:
        """Begins an episode. There are no options."""
        self.tasks._must_be_open()
        given_options(options)
        super().reset(seed=seed)
        self.tasks.reset_rows(np.array([0]), self.np_random)
        return self._observed(), self._told()

    def step(self, action: Any) -> tuple[NDArray[Any], float, bool, bool, dict[str, Any]]:
        """One action: observation, reward, terminated, truncated, info. kerf.Error: no episode goes on; reset() begins one."""
        self.tasks._must_have_begun()
        if self.tasks._ended[0]:
            raise Error("the episode has ended; call reset() to begin another one")
        given = given_actions(action, "an action", self.action_space.shape)
        rewards, terminated, truncated, failures = self.tasks.act(given[None], np.ones(1, bool))
        told = self._told()
        if failures:
            told["error"] = failures[0]
        if self.render_mode == "human":
            self.tasks._show()
        return self._observed(), float(rewards[0]), bool(terminated[0]), bool(truncated[0]), told

    def expert(self) -> NDArray[np.float32]:
        """An action of somebody who knows how. kerf.Error: no episode has begun."""
        return self.tasks.expert()[0]

    def render(self) -> NDArray[np.uint8] | None:
        """A picture, 480 x 360, where render_mode is "rgb_array"."""
        pictures = self.tasks.render()
        return None if pictures is None else pictures[0]

    def close(self) -> None:
        """Frees the session."""
        self.tasks.close()

    def __reduce_ex__(self, protocol: Any) -> Any:
        raise no_copies()

    def _observed(self) -> NDArray[Any]:
        return self.tasks._observed()[0]

    def _told(self) -> dict[str, Any]:
        return {word: values.tolist()[0] for word, values in self.tasks._said().items()}
