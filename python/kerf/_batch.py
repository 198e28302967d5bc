"""Many sessions that go on together, in a few threads of the machine."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from . import _arguments, _core, _records
from ._scene import utf8
from ._session import Session

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

__all__ = ["Batch"]

_COUNTS = ("visual_vertices", "visual_triangles", "collision_vertices", "collision_triangles", "nodes", "hexahedra", "pieces")
MOST_PIECES = 10_000  # asked for at once: arrays of 80 kB for a session


class Batch(_core.Batch):
    """Sessions that take their turns at once: n sessions, one call, without Python's lock.

    sessions: each is used by nobody else during a call, and the batch by one thread at a time (another one gets a kerf.Error). threads: by
    default as many as the machine has processors.
    Every array has a row for each session. What a session does is the same to the bit as by itself, however many threads there are.
    """

    def __init__(self, sessions: Iterable[Session], *, threads: int | None = None) -> None:
        if hasattr(self, "sessions"):
            raise TypeError("this batch is made already; make another one")
        if isinstance(sessions, Session) or not isinstance(sessions, Iterable):
            raise TypeError(f"a batch is made of a list of sessions, not of {type(sessions).__name__}")
        several = tuple(sessions)
        if not several:
            raise ValueError("a batch holds one session or more")
        for session in several:
            if not isinstance(session, Session):
                raise TypeError(f"a batch is made of kerf.Session, not of {type(session).__name__}")
        super().__init__(list(several), 0 if threads is None else min(_arguments.whole(threads, "threads", 1), len(several)))
        self.sessions: tuple[Session, ...] = several

    def turn(self, steps: int = 1, *, blade: ArrayLike | None = None, cuts: ArrayLike | None = None, takes: ArrayLike | None = None,
             grasps: Mapping[str, ArrayLike] | None = None, tools: Mapping[str, ArrayLike] | None = None) -> dict[int, str]:
        """`steps` time steps of every session.

        blade: (n, 2, 3), base and tip of a blade's edge at the end, metres, world. It goes there straight and evenly from where it was.
        cuts: (n,) bool, whether it cuts on its way, as it does by default; one stroke as long as it does. takes: (n,) bool, the sessions that
        take part; by default all.
        grasps: {id: (n, 3)}, where grasps are at the end. tools: {id: (n, 6)}, position and rotation (axis times angle) of poses at the end.
        A row of NaN leaves that grasp or tool of its session alone: it need not be there.
        Returns the messages of the sessions that could not do it, by their number; what they did before that stays.
        TypeError, ValueError: not such arrays. Ctrl-C ends it after whole steps.
        """
        n = len(self)
        return dict(self._turn(
            _arguments.steps(steps, "steps"), None if blade is None else _arguments.place_rows(blade, "blade", (n, 2, 3)),
            None if cuts is None else _arguments.flags(cuts, "cuts", n), None if takes is None else _arguments.flags(takes, "takes", n),
            _arguments.named_rows(grasps, "grasps", (n, 3), _arguments.led_rows),
            _arguments.named_rows(tools, "tools", (n, 6), _arguments.led_rows)))

    @property
    def counts(self) -> dict[str, NDArray[np.int64]]:
        """What the bodies are made of now: the keys of Session.counts, an array (n,) each. New arrays of the caller's own."""
        rows = self._counts()
        return {word: rows[:, i].copy() for i, word in enumerate(_COUNTS)}

    def piece_masses(self, most: int) -> NDArray[np.float64]:
        """Masses of the `most` heaviest pieces, heaviest first, kg: (n, most); 0 where there are fewer."""
        return self._piece_masses(_arguments.whole(most, "most", 1, MOST_PIECES))

    def tool(self, id: str) -> NDArray[np.void]:
        """The scenes' tool of this id: a structured array (n,) with the fields of Session.tools. kerf.Error: a scene has none."""
        return self._structured("tools", self._tool(_id(id)))

    def grasp(self, id: str) -> NDArray[np.void]:
        """The grasp of this id: a structured array (n,) with the fields of Session.grasps.

        All fields are 0 where a session has no such grasp; `vertices` is above 0 where it has.
        """
        return self._structured("grasps", self._grasp(_id(id)))

    def _structured(self, name: str, rows: NDArray[np.uint8]) -> NDArray[np.void]:
        return rows.view(_records.dtype(name))[:, 0]

    def place_blade(self, session: int, base: ArrayLike, tip: ArrayLike) -> None:
        """Puts the blade of one session somewhere without a cut; its stroke ends. Metres, world.

        IndexError: the batch has no such session. kerf.Error: the edge has no length.
        """
        number = _arguments.whole(session, "session", -math.inf)
        if not 0 <= number < len(self):
            raise IndexError(f"the batch has no session {number}; there are {len(self)}, numbered from 0")
        self._place_blade(number, base, tip)

    def to_world(self, rest: ArrayLike, out: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """Where the material that is at these places at rest is now: (n, k, 3), metres. As Session.to_world().

        out: an array of the caller's own for the answer: that shape, float64, in C order, writeable. It comes back.
        """
        import numpy as np

        places = _arguments.place_rows(rest, "rest", (len(self), None, 3))
        now = np.empty_like(places) if out is None else _own(out, places.shape)
        if places.size:
            self._to_world(places, now)
        return now

    def to_rest(self, world: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The places of the middle surface that are nearest to these now, at rest: (n, k, 3), and how far they are: (n, k). Metres."""
        import numpy as np

        places = _arguments.place_rows(world, "world", (len(self), None, 3))
        rest, distance = np.empty_like(places), np.empty(places.shape[:2])
        if places.size:
            self._to_rest(places, rest, distance)
        return rest, distance

    def __reduce_ex__(self, protocol: Any) -> Any:
        raise TypeError("a batch can't be copied or pickled; make another one, of other sessions")


def _own(out, shape):
    import numpy as np

    if not isinstance(out, np.ndarray):
        raise TypeError(f"out must be an array, not {type(out).__name__}")
    if out.shape != shape or out.dtype != np.float64 or not (out.flags.c_contiguous and out.flags.writeable):
        raise ValueError(f"out must be a writeable array of shape {shape}, float64, in C order")
    return out


def _id(given):
    if not isinstance(given, str):
        raise TypeError(f"id must be text, not {type(given).__name__}")
    return utf8(given)
