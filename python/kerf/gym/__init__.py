"""Tasks to learn cutting by, for Gymnasium.

    import gymnasium, kerf.gym

    env = gymnasium.make("Kerf/PatternCut-v0", render_mode="rgb_array")   # one
    envs = kerf.gym.make_vec("Kerf/PatternCut-v0", 16)                    # many, in threads, by one call

What a task is, its actions, observations and rewards stand in the docstring of its class.
"""

from __future__ import annotations

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


for _task in TASKS.values():  # Gymnasium names what it makes by words: PatternCutEnv is one copy of PatternCut
    _name = f"{_task.__name__}Env"
    globals()[_name] = type(_name, (TaskEnv,), {"task": _task, "__doc__": f"One copy of {_task.__name__}.", "__module__": __name__})


def register() -> None:
    """Makes the tasks known to gymnasium.make(); done on import, and harmless again."""
    for name, task in TASKS.items():
        if name not in gymnasium.registry:
            gymnasium.register(name, entry_point=f"kerf.gym:{task.__name__}Env", vector_entry_point=f"kerf.gym:{task.__name__}")


def make_vec(name: str, num_envs: int, **options: Any) -> Tasks:
    """`num_envs` copies of a task, stepped by one call in C++ threads. Options: as of Tasks. ValueError: no such task."""
    known = {**TASKS, **{full.rsplit("-", 1)[0]: task for full, task in TASKS.items()}}
    if name not in known:
        raise ValueError(f"there is no task {name!r}; there are {', '.join(TASKS)}")
    return known[name](num_envs, **options)


register()
