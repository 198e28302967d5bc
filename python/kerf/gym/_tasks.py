"""What all tasks have in common: n copies of one, stepped together."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import wraps
from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from .. import Batch, Camera, Error, Session
from .._arguments import flag, kind_of, number, pixels, points, unmasked, whole
from ._by_name import NamedVectorEnv
from ._marks import STEEL, paint
from ._memory import Room

__all__ = ["Tasks"]

WHOLE = ("action_size", "state_size", "steps", "horizon")  # what a task says of itself in whole numbers
SETTINGS = (*WHOLE, "variety", "camera")  # what a task may set
VARIED = ("young", "poisson", "density")  # what `variety` may name
CHANGEABLE = ("randomise", "horizon_now", "variety", "spec", "render_mode")  # what may be set from outside of what Tasks itself has
LED = ("blade", "cuts", "grasps", "tools")  # what control() may return


def given_actions(given: Any, name: str, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Actions as numbers, or an error that says what is wrong with them."""
    unmasked(given, name)
    array = np.asarray(given)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name} must be numbers, not {kind_of(array, given)}")
    if array.shape != shape:
        raise ValueError(f"{name} must be of shape {shape}, not {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite")
    return array.astype(np.float64)


def given_options(given: Any, *known: str) -> dict[str, Any]:
    """Options of reset(), or an error that says which is none."""
    if given is not None and not isinstance(given, dict):
        raise TypeError(f"options must be a dict, not {type(given).__name__}")
    for word in given or {}:
        if word not in known:
            raise ValueError(f"options of reset() may have {' and '.join(map(repr, known)) or 'nothing in them'}, not {word!r}")
    return given or {}


def no_copies() -> TypeError:
    """What environments say to copy and pickle."""
    return TypeError("an environment of kerf.gym can't be copied or pickled: a task may remember anything; make another one by its name, and restore() snapshots in its sessions")


def _of_an_episode(expert: Callable[[Any], NDArray[np.float32]]) -> Callable[[Any], NDArray[np.float32]]:
    @wraps(expert)
    def of_an_episode(tasks: Any) -> NDArray[np.float32]:
        tasks._must_have_begun()
        actions = expert(tasks)
        given_actions(actions, f"what expert() of {type(tasks).__name__} returns", tasks.action_space.shape)
        return np.asarray(actions)

    return of_an_episode


class Tasks(NamedVectorEnv):
    """n copies of one task as a gymnasium.vector.VectorEnv: one call steps them all, in threads.

    observations: "state" (a vector of float32 of the size of 1, cut off at -10 and 10) or "pixels" (RGB pictures, uint8, `size` high and wide).
    num_envs: copies; ValueError says how many fit into memory. threads: as of kerf.Batch.
    randomise: each episode has a body of another material: vary() makes it.
    max_episode_steps: actions of an episode, at most; by default `horizon`.
    A copy that has ended begins anew with the next step(), whose action it does not take (Gymnasium's NEXT_STEP).
    The same seeds and actions give the same observations and rewards, to the bit.

    A task of one's own derives from this class. It sets `action_size` and `state_size`, and may set `steps` (time steps of an action),
    `horizon` (actions of an episode, at most), `variety` (how far materials differ) and `camera` (what kerf.Camera takes, for pictures; else
    the whole body is in view). The first four stand before prepare().
    It defines scene(), begin(), control(), look() and judge(). They find the copies in `self.sessions`, a list of kerf.Session, and in
    `self.batch`, the kerf.Batch of them. `self.elapsed` (n,) is how many actions episodes have had, `self.horizon_now` how many they have at
    most. kerf.gym.register() makes the task known by a name. What a task remembers has names that this class does not use. `size`, `pixels`,
    `spec`, `closed`, `batch` and `blade` are among those it uses, and refused.

    Once: scene() for each copy, prepare(), and a snapshot, to which each episode goes back. An episode begins: vary() where `randomise` is set,
    begin(), look(), tell().
    An action: control(), `steps` time steps of all copies, look(), judge(), tell().
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["rgb_array", "human"], "render_fps": 20,
                                          "autoreset_mode": AutoresetMode.NEXT_STEP}
    # What a task says of itself.
    steps: ClassVar[int] = 10  #: time steps of an action
    horizon: ClassVar[int] = 200  #: actions of an episode, at most
    action_size: ClassVar[int]
    state_size: ClassVar[int]
    camera: ClassVar[dict[str, Any]] = {}  #: of pictures: kerf.Camera's; by default the whole body is in view at the start
    variety: ClassVar[dict[str, float]] = {"young": 1.0, "density": 0.5}  #: of vary(): 1 is from half to twice the scene's value, 2 a quarter to 4 times

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        if "expert" in cls.__dict__:
            setattr(cls, "expert", _of_an_episode(cls.__dict__["expert"]))  # noqa: B010 (a task's own is of another type)

    def __init__(self, num_envs: int = 1, *, observations: str = "state", size: int = 64, render_mode: str | None = None,
                 randomise: bool = False, threads: int | None = None, max_episode_steps: int | None = None) -> None:
        own = dict(vars(self))
        num_envs = whole(num_envs, "num_envs", 1)
        if max_episode_steps is not None:
            max_episode_steps = whole(max_episode_steps, "max_episode_steps", 1)
        if observations not in ("state", "pixels"):
            raise ValueError(f'observations must be "state" or "pixels", not {observations!r}')
        if render_mode not in (None, "rgb_array", "human"):
            raise ValueError(f'render_mode must be "rgb_array" or "human", not {render_mode!r}')
        numbers = self._whole_numbers()
        if type(self).vary is Tasks.vary:
            self._check_variety()
        self.num_envs, self.render_mode, self.randomise = num_envs, render_mode, flag(randomise, "randomise")
        self.pixels, self.size = observations == "pixels", pixels(size, "size")
        self.horizon_now = max_episode_steps or self.horizon
        self.single_action_space = spaces.Box(-1, 1, (self.action_size,), np.float32)
        self.single_observation_space = (spaces.Box(0, 255, (self.size, self.size, 3), np.uint8) if self.pixels
                                         else spaces.Box(-10, 10, (self.state_size,), np.float32))
        self.sessions = []
        self._make_sessions(num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.batch = Batch(self.sessions, threads=threads)
        self._random: list[np.random.Generator] = [np.random.default_rng() for _ in range(num_envs)]
        self._seeds = [-1] * num_envs
        self._states = np.zeros((num_envs, self.state_size), np.float32)
        self._elapsed = np.zeros(num_envs, np.int64)
        self._ended = np.ones(num_envs, bool)
        self._begun = np.zeros(num_envs, bool)  # which copies have an episode, that goes on or has ended
        self._window: Any = None
        self._met: set[str] = set()  # grasps that a copy has had
        self._start: list[Any] = []
        self._camera: Any = None
        needed = {name: value for name, value in vars(self).items() if name not in own or own[name] is not value}
        self.prepare()
        self._refuse_names(own, needed)
        self._locked = (frozenset(needed) | frozenset(dir(Tasks)) | {"_locked"}).difference(CHANGEABLE)
        for word, number_now in self._whole_numbers().items():
            if number_now != numbers[word]:
                raise ValueError(f"{word} of {type(self).__name__} is {numbers[word]} and can't become {number_now} in prepare(); set it in the class")
        self._start = [session.snapshot() for session in self.sessions]
        try:
            self._camera = Camera(**self.camera) if self.camera else self.sessions[0].camera()
        except (TypeError, ValueError) as error:
            kind = TypeError if isinstance(error, TypeError) else ValueError
            raise kind(f"camera of {type(self).__name__} must be a dict with eye and target, up and field_of_view if wanted: {error}") from error

    def _whole_numbers(self) -> dict[str, int]:
        """What a task has to say of itself in whole numbers."""
        name = type(self).__name__
        for word in WHOLE:
            if not hasattr(self, word):
                raise NotImplementedError(f"{name} has no {word}; help(kerf.gym.Tasks) says what a task defines")
        return {word: whole(getattr(self, word), f"{word} of {name}", 1) for word in WHOLE}

    def _make_sessions(self, wanted: int) -> None:
        room = Room(wanted)
        try:
            while len(self.sessions) < wanted:
                self.sessions.append(Session(self.scene()))
                room.check(len(self.sessions))
        except BaseException:
            for session in self.sessions:
                session.close()
            raise

    def _check_variety(self) -> None:
        """ValueError, TypeError: `variety` is not what vary() takes."""
        name = f"variety of {type(self).__name__}"
        if not isinstance(self.variety, Mapping):
            raise TypeError(f"{name} must be a dict, not {type(self.variety).__name__}")
        for word, span in self.variety.items():
            if word not in VARIED:
                raise ValueError(f"{name} may have {', '.join(map(repr, VARIED))}, not {word!r}")
            if not 0 <= number(span, f"{name}, {word!r},") < np.inf:
                raise ValueError(f"{name}, {word!r}, must be 0 or more and finite, not {span!r}")

    # --- What a task has to say. Arrays have a row for each copy. ---

    def scene(self) -> dict[str, Any]:
        """The scene of a copy, as kerf.Session takes it."""
        raise self._lacks("scene")

    def prepare(self) -> None:
        """Brings all sessions to where episodes begin, and makes the arrays that the task remembers things in."""

    def vary(self, row: int, random: np.random.Generator) -> None:
        """Another material for an episode of copy number `row`: called before begin() where `randomise` is set.

        Each value named in `variety` is that of the scene times 2 to the power of a number, which lies evenly within plus and minus its span.
        """
        self._check_variety()
        scene = self.sessions[row].material
        self.sessions[row].set_material(**{word: scene[word] * 2 ** random.uniform(-span, span) for word, span in self.variety.items()})

    def begin(self, row: int, random: np.random.Generator) -> None:
        """A new episode of copy number `row`, whose session is back at the start. All chance comes from `random`."""
        raise self._lacks("begin")

    def control(self, actions: NDArray[np.float64], plays: NDArray[np.bool_]) -> dict[str, Any]:
        """What the actions (n, action_size), within -1 and 1, do to the sessions: arguments of Batch.turn(), without steps and takes.

        plays: (n,), which copies take theirs; what the task remembers of others stays.
        """
        raise self._lacks("control")

    def look(self, states: NDArray[np.float32], rows: NDArray[np.bool_]) -> None:
        """Writes the states of these copies into their rows of `states`, (n, state_size), each number of them, and returns nothing.

        Nothing that it remembers of other copies changes.
        """
        raise self._lacks("look")

    def judge(self, plays: NDArray[np.bool_]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Rewards of the actions just done (n,), finite, and which episodes have come to their end (n,), bool. Called after look().

        What it says of copies that do not play does not count.
        """
        raise self._lacks("judge")

    def tell(self) -> dict[str, NDArray[Any]]:
        """What `info` holds: an array (n,) for each word, or one value for all copies. Learners look for "is_success"."""
        return {}

    def expert(self) -> NDArray[np.float32]:
        """Actions of somebody who knows how, (n, action_size): from the states as they are now. kerf.Error: no episode has begun."""
        raise self._lacks("expert")

    def _refuse_names(self, own: dict[str, Any], needed: dict[str, Any]) -> None:
        """Refuses names of a task's own that mean something here. own: what stood there first. needed: what was set here."""
        kind, now = type(self), vars(self)
        derived = kind.__mro__[:kind.__mro__.index(Tasks)]
        taken = {name for name, value in needed.items()
                 if name in own or now.get(name) is not value or any(name in vars(of) for of in derived)}
        taken |= {name for name in now if name not in needed and hasattr(Tasks, name) and name not in SETTINGS}
        if taken:
            raise AttributeError(f"{kind.__name__} calls something of its own {', '.join(sorted(taken))}; "
                                 "kerf.gym.Tasks needs that name, so choose another one")

    def _lacks(self, what: str) -> NotImplementedError:
        return NotImplementedError(f"{type(self).__name__} has no {what}(); help(kerf.gym.Tasks) says what a task defines")

    # --- Gymnasium ---

    @property
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """Where each copy's chance comes from."""
        return tuple(self._random)

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]
        """What each of them was begun with; -1: by the system."""
        return tuple(self._seeds)

    def reset(self, *, seed: int | list[int | None] | None = None,
              options: dict[str, Any] | None = None) -> tuple[NDArray[Any], dict[str, Any]]:
        """Begins all episodes anew, or those of options["reset_mask"]. An int seeds copy i with seed + i."""
        self._must_be_open()
        several = isinstance(seed, (list, tuple)) or isinstance(seed, np.ndarray) and seed.ndim == 1
        first = None if seed is None or several else whole(seed, "seed")
        seeds: Any = seed if several else [None if first is None else first + i for i in range(self.num_envs)]
        if len(seeds) != self.num_envs:
            raise ValueError(f"seed must be a number or a list of {self.num_envs}")
        generators = [None if seed is None else np.random.default_rng(whole(seed, f"seed[{i}]")) for i, seed in enumerate(seeds)]
        mask = np.asarray(given_options(options, "reset_mask").get("reset_mask", np.ones(self.num_envs, bool)))
        if mask.shape != (self.num_envs,) or mask.dtype != np.bool_:
            raise ValueError(f'options["reset_mask"] must be {self.num_envs} truth values')
        if not mask.any():
            raise ValueError('options["reset_mask"] must be true for one copy or more')
        if not (self._begun | mask).all():
            raise Error("not all copies have an episode; call reset() without a mask first")
        for row in np.flatnonzero(mask):
            if generators[row] is not None:
                self._random[row], self._seeds[row] = generators[row], int(seeds[row])
        self.reset_rows(np.flatnonzero(mask))
        return self._observed(), self._told()

    def reset_rows(self, rows: NDArray[np.int64], random: np.random.Generator | None = None) -> None:
        """New episodes of these copies, from their own random numbers or these. Where this raises, they have none."""
        self._begun[rows] = False
        for row in rows.tolist():
            chance = self._random[row] if random is None else random
            self.sessions[row].restore(self._start[row])
            if self.randomise:
                self.vary(row, chance)
            self.begin(row, chance)
        self._elapsed[rows] = 0
        self._look(np.isin(np.arange(self.num_envs), rows))
        self._ended[rows] = False
        self._begun[rows] = True

    def step(self, actions: Any) -> tuple[NDArray[Any], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """One action of every copy, (n, action_size): observations, rewards, terminated, truncated, infos."""
        anew = np.flatnonzero(self._ended)
        plays = ~self._ended
        rewards, terminated, truncated, failures = self.act(actions, plays)
        if anew.size:
            self.reset_rows(anew)
        told = self._told()
        if failures:
            told["error"] = np.array([failures.get(i, "") for i in range(self.num_envs)], object)
            told["_error"] = told["error"] != ""
        if self.render_mode == "human":
            self._show()
        return self._observed(), rewards, terminated, truncated, told

    def act(self, actions: Any, plays: NDArray[np.bool_]) -> tuple[NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[int, str]]:
        """One action of the copies that play: rewards, terminated, truncated, and what the engine refused."""
        self._must_have_begun()
        given = given_actions(actions, "actions", (self.num_envs, self.action_size))
        failures = self._turn(self.control(np.clip(given, -1, 1), plays), plays)
        self._elapsed += plays
        self._look(plays)
        rewards, terminated = self._judged(plays)
        failed = np.zeros(self.num_envs, bool)
        failed[list(failures)] = True
        truncated = ((self._elapsed >= self.horizon_now) | failed) & plays & ~terminated
        self._ended = terminated | truncated | ~plays
        return rewards, terminated, truncated, failures

    @property
    def elapsed(self) -> NDArray[np.int64]:
        """Actions of each episode so far: (n,), a read-only array that stays what it is."""
        elapsed = self._elapsed.copy()
        elapsed.flags.writeable = False
        return elapsed

    def _must_be_open(self) -> None:
        if self.closed:
            raise Error("this environment is closed; make another one")

    def _must_have_begun(self) -> None:
        self._must_be_open()
        if not self._begun.all():
            which = "" if not self._begun.any() else f" in copy {np.flatnonzero(~self._begun)[0]}"
            raise Error(f"no episode has begun{which}; call reset() first")

    def _observed(self) -> NDArray[Any]:
        if not self.pixels:
            return np.clip(self._states, -10, 10)
        return np.stack([self.picture(i, self.size, self.size) for i in range(self.num_envs)])

    def _turn(self, controls: Any, plays: NDArray[np.bool_]) -> dict[int, str]:
        """Does what control() returned: what the engine refused."""
        name = type(self).__name__
        if not isinstance(controls, dict):
            raise TypeError(f"control() of {name} must return a dict, arguments of kerf.Batch.turn(), not {type(controls).__name__}")
        for word in controls:
            if word not in LED:
                raise TypeError(f"control() of {name} may return {', '.join(LED)}, not {word!r}")
        grasps, tools = (of if isinstance(of, Mapping) else {} for of in (controls.get("grasps"), controls.get("tools")))
        for id in grasps:
            if id not in self._met and any(id in session.grasp_ids for session in self.sessions):
                self._met.add(id)
        try:
            failures = self.batch.turn(self.steps, takes=plays, **controls)
        except (TypeError, ValueError) as error:
            kind = TypeError if isinstance(error, TypeError) else ValueError
            raise kind(f"control() of {name}: {error}") from error
        if failures:  # of one copy, or of a name that none knows
            there = {id for session in self.sessions for id in session.tool_ids}
            for kind_of, given, known in (("tool", tools, there), ("grasp", grasps, self._met)):
                for id, rows in given.items():
                    if id not in known and not np.isnan(np.asarray(rows)[plays]).all():
                        raise ValueError(f"control() of {name} leads the {kind_of} {id!r}, which no copy has had; "
                                         f"there is {', '.join(map(repr, sorted(known))) or 'none'}")
        return failures

    def _look(self, rows: NDArray[np.bool_]) -> None:
        """Has the task write the states of these copies, each number of them."""
        self._states[rows] = np.nan
        answer: Any = self.look(self._states, rows)  # type: ignore[func-returns-value]
        if answer is not None:
            raise TypeError(f"look() of {type(self).__name__} must write into states[rows] and return nothing, not {type(answer).__name__}")
        left = np.isnan(self._states[rows])
        if left.any():
            at, number = np.argwhere(left)[0]
            raise ValueError(f"look() of {type(self).__name__} must write numbers into all of states[rows]; "
                             f"states[{np.flatnonzero(rows)[at]}, {number}] was left out or is nan")

    def _judged(self, plays: NDArray[np.bool_]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Rewards and ends of the copies that play; 0 and False for others."""
        judged, name = self.judge(plays), type(self).__name__
        if not isinstance(judged, (tuple, list)) or len(judged) != 2:
            raise TypeError(f"judge() of {name} must return two arrays: rewards, and which episodes have come to their end")
        rewards: Any = np.asarray(judged[0])
        ends: Any = np.asarray(judged[1])
        for given, array, what, kinds, wanted in ((judged[0], rewards, "rewards", "fiub", "numbers"), (judged[1], ends, "ends", "b", "truth values")):
            if array.dtype.kind not in kinds:
                raise TypeError(f"{what} of {name}, which judge() returns, must be {wanted}, not {kind_of(array, given)}")
            if array.shape != (self.num_envs,):
                raise ValueError(f"{what} of {name} must be of shape ({self.num_envs},), one for each copy, not {array.shape}")
        rewards = np.where(plays, rewards, np.float64(0))
        if not np.isfinite(rewards).all():
            row = np.flatnonzero(~np.isfinite(rewards))[0]
            raise ValueError(f"rewards of {name}, which judge() returns, must be finite; that of copy {row} is {rewards[row]}")
        return rewards, ends & plays

    def _of_copies(self, values: Any, what: str) -> NDArray[Any]:
        """What a task tells of its copies: an array (n,); one value stands for all."""
        array = np.asarray(values)
        if array.shape not in ((), (self.num_envs,)):
            raise ValueError(f"{what} of {type(self).__name__} must be of shape ({self.num_envs},), one for each copy, not {array.shape}")
        return np.full(self.num_envs, array)

    def _said(self) -> dict[str, NDArray[Any]]:
        """What tell() says, in new arrays."""
        words = self.tell()
        if not isinstance(words, dict):
            raise TypeError(f"tell() of {type(self).__name__} must return a dict, not {type(words).__name__}")
        for word in words:
            if not isinstance(word, str):
                raise TypeError(f"tell() of {type(self).__name__} must name its values by text, not {word!r}")
        return {word: self._of_copies(values, f"tell()[{word!r}]") for word, values in words.items()}

    def _told(self) -> dict[str, Any]:
        told: dict[str, Any] = {}
        for word, values in self._said().items():
            told[word], told["_" + word] = values, np.ones(self.num_envs, bool)
        return told

    def picture(self, row: int, width: int, height: int) -> NDArray[np.uint8]:
        """A picture of a copy: (height, width, 3)."""
        picture, depth = self.sessions[row].render(width, height, camera=self._camera, depth=True)
        paint(picture, depth, self._places(self.marked(row), "marked"), self._camera)
        given = self.blade(row)
        blade = self._places([] if given is None else given, "blade")
        if len(blade):
            length = np.append(0, np.linalg.norm(np.diff(blade, axis=0), axis=1).cumsum())
            along = np.linspace(0, length[-1], 4 * height)
            places = np.stack([np.interp(along, length, blade[:, i]) for i in range(3)], axis=1)
            paint(picture, depth, places, self._camera, STEEL)
        return picture

    def _places(self, given: Any, method: str) -> NDArray[np.float64]:
        """Places (k, 3) that a method gives for pictures; what is empty has none."""
        if isinstance(given, np.ndarray) and not given.size or isinstance(given, (list, tuple)) and not given:
            return np.zeros((0, 3))
        return points(given, f"what {method}() of {type(self).__name__} returns")

    def marked(self, row: int) -> NDArray[np.float64]:
        """Places (k, 3), metres, that pictures of a copy show as dots; empty: none."""
        return np.zeros((0, 3))

    def blade(self, row: int) -> NDArray[np.float64] | None:
        """Base and tip of a blade that pictures of a copy show, or more corners of a line: (k, 3), metres; None: the scene's own tools are all."""
        return None

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Pictures of all copies, 480 x 360, where render_mode is "rgb_array"."""
        self._must_be_open()
        if self.render_mode != "rgb_array":
            return None
        return tuple(self.picture(i, 480, 360) for i in range(self.num_envs))

    def _show(self) -> None:
        from ._window import Window

        if self._window is None:
            self._window = Window(480, 360, self.metadata["render_fps"])
        self._window.show(self.picture(0, 480, 360))

    def close_extras(self, **kwargs: Any) -> None:
        """Frees all sessions."""
        if self._window is not None:
            self._window.close()
        for session in self.sessions:
            session.close()

    def __reduce_ex__(self, protocol: Any) -> Any:
        raise no_copies()
