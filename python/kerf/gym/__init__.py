"""Tasks to learn cutting by, for Gymnasium.

    import gymnasium, kerf.gym

    env = gymnasium.make("Kerf/PatternCut-v0", render_mode="rgb_array")   # one
    envs = kerf.gym.make_vec("Kerf/PatternCut-v0", 16)                    # many, in threads, by one call

What a task is, its actions, observations and rewards stand in the docstring of its class.
"""

from __future__ import annotations

import copyreg
import re
from functools import lru_cache
from typing import Any

try:
    import gymnasium
except ImportError as error:
    raise ImportError("kerf.gym needs Gymnasium: pip install gymnasium") from error

from ._single import TaskEnv
from ._tasks import Tasks
from .debride import Debride
from .meniscectomy import Meniscectomy
from .pattern_cut import PatternCut
from .slice import Slice
from .tension_and_cut import TensionAndCut

__all__ = ["Debride", "Meniscectomy", "PatternCut", "Slice", "TaskEnv", "Tasks", "TensionAndCut", "make_vec", "register"]

TASKS: dict[str, type[Tasks]] = {f"Kerf/{_task.__name__}-v0": _task for _task in (Debride, Meniscectomy, PatternCut, Slice, TensionAndCut)}


class _OneOf(type):
    """What classes are that make one copy of a task. Pickled they are that task."""


@lru_cache(maxsize=None)
def _one_of(task: Any, module: str) -> Any:
    return _OneOf(f"{task.__name__}Env", (TaskEnv,), {"task": task, "__doc__": f"One copy of {task.__name__}.", "__module__": module})


copyreg.pickle(_OneOf, lambda one: (_one_of, (one.task, one.__module__)))  # type: ignore[attr-defined]


for _task in TASKS.values():  # Gymnasium names what it makes by words: PatternCutEnv is one copy of PatternCut
    globals()[f"{_task.__name__}Env"] = _one_of(_task, __name__)


_NAME = re.compile(r"[\w:-]+/[\w:.-]+-v\d+")


def register(name: str | None = None, task: type[Tasks] | None = None) -> None:
    """Makes a task of one's own known by a name, as "Own/Halve-v0": to gymnasium.make(), gymnasium.make_vec() and make_vec().

    task: a class that derives from Tasks. A name that is known already then means this one. Kerf's own tasks are known since the import.
    TypeError: not a name and such a class. ValueError: a name without a namespace or a version.
    """
    if not isinstance(name, str) or not (isinstance(task, type) and issubclass(task, Tasks) and task is not Tasks):
        raise TypeError('register() takes a name and a class that derives from kerf.gym.Tasks: register("Own/Halve-v0", Halve)')
    if not _NAME.fullmatch(name):
        raise ValueError(f'register() takes a name of namespace, task and version, as "Own/Halve-v0", not {name!r}')
    gymnasium.registry.pop(name, None)
    gymnasium.register(name, entry_point=_one_of(task, task.__module__), vector_entry_point=task)
    TASKS[name] = task


def make_vec(name: str, num_envs: int, **options: Any) -> Tasks:
    """`num_envs` copies of a task, stepped by one call in C++ threads. Options: as of Tasks. ValueError: no such task."""
    known = {**{full.rsplit("-", 1)[0]: task for full, task in TASKS.items()}, **TASKS}
    if name not in known:
        raise ValueError(f"there is no task {name!r}; there are {', '.join(TASKS)}, and register() adds others")
    return known[name](num_envs, **options)


for _name, _task in TASKS.items():
    if _name not in gymnasium.registry:
        gymnasium.register(_name, entry_point=f"kerf.gym:{_task.__name__}Env", vector_entry_point=f"kerf.gym:{_task.__name__}")
