"""Attributes and methods of copies by name, as gymnasium.vector.SyncVectorEnv has them."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.vector import VectorEnv

__all__ = ["NamedVectorEnv"]

OF_ONE = {"action_space": "single_action_space", "observation_space": "single_observation_space", "session": "sessions"}  # names of one copy


class NamedVectorEnv(VectorEnv):
    """What has a row for each copy gives each copy its own; all else is the same for all of them."""

    _locked: frozenset[str] = frozenset()  # names that are not to be set from outside

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """What a method returns, or what an attribute is: one for each copy. A method is called once, for all."""
        if name.startswith("_"):
            raise ValueError(f"{name!r} is private")
        there = getattr(self, OF_ONE.get(name, name))
        return self._each(there(*args, **kwargs) if callable(there) else there)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """An attribute, one for each copy."""
        return self.call(name)

    def set_attr(self, name: str, values: Any) -> None:
        """Sets an attribute: to one value for all copies, or to a list or tuple with one for each.

        ValueError: as many values as there are no copies; several values where the task has one for all; what the environment itself needs.
        """
        several = isinstance(values, (list, tuple))
        if several and len(values) != self.num_envs:
            raise ValueError(f"values of {name} must be one, or {self.num_envs}, one for each copy, not {len(values)}")
        if name.startswith("_") or name in self._locked:
            raise ValueError(f"{name} of {type(self).__name__} can't be set from outside")
        now = getattr(self, name, None)
        if isinstance(now, np.ndarray) and now.shape[:1] == (self.num_envs,):
            now[...] = np.asarray(values) if several else values
            return
        if several and any(not np.array_equal(value, values[0]) for value in values):
            raise ValueError(f"{name} of {type(self).__name__} is one for all copies; give one value")
        setattr(self, name, values[0] if several else values)

    def _each(self, values: Any) -> tuple[Any, ...]:
        rows = isinstance(values, (list, tuple)) or isinstance(values, np.ndarray) and values.ndim
        return tuple(values) if rows and len(values) == self.num_envs else (values,) * self.num_envs
