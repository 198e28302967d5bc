"""Many sessions that go on together, in a few threads of the machine."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from . import _core
from ._session import Session

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

__all__ = ["Batch"]


class Batch(_core.Batch):
    """Sessions that take their turns at once: n sessions, one call, without Python's lock.

    sessions: each is used by nobody else during a call. threads: by default as many as the machine has processors.
    Every array has a row for each session. What a session does is the same to the bit as by itself, however many threads there are.
    """

    def __init__(self, sessions: Iterable[Session], *, threads: int | None = None) -> None:
        self.sessions: tuple[Session, ...] = tuple(sessions)
        if not self.sessions:
            raise ValueError("a batch holds one session or more")
        for session in self.sessions:
            if not isinstance(session, Session):
                raise TypeError(f"a batch is made of kerf.Session, not of {type(session).__name__}")
        if threads is not None and threads < 1:
            raise ValueError("threads must be 1 or more")
        super().__init__(list(self.sessions), threads or 0)

    def turn(self, steps: int = 1, *, blade: ArrayLike | None = None, cuts: ArrayLike | None = None, takes: ArrayLike | None = None,
             grasps: Mapping[str, ArrayLike] | None = None, tools: Mapping[str, ArrayLike] | None = None) -> dict[int, str]:
        """`steps` time steps of every session.

        blade: (n, 2, 3), base and tip of a blade's edge at the end, metres, world. It goes there straight and evenly from where it was.
        cuts: (n,) bool, whether it cuts on its way; one stroke as long as it does. takes: (n,) bool, the sessions that take part.
        grasps: {id: (n, 3)}, where grasps are at the end. tools: {id: (n, 6)}, position and rotation (axis times angle) of poses at the end.
        Returns the messages of the sessions that could not do it, by their number; what they did before that stays.
        TypeError, ValueError: not such arrays. Ctrl-C ends it after whole steps.
        """
        n = len(self)
        if steps < 0:
            raise ValueError("steps must not be negative")
        return dict(self._turn(
            steps, None if blade is None else _rows(blade, "blade", (n, 2, 3)), None if cuts is None else _flags(cuts, "cuts", n),
            None if takes is None else _flags(takes, "takes", n),
            [(id, _rows(targets, f"grasps[{id!r}]", (n, 3))) for id, targets in (grasps or {}).items()],
            [(id, _rows(poses, f"tools[{id!r}]", (n, 6))) for id, poses in (tools or {}).items()]))

    def place_blade(self, session: int, base: ArrayLike, tip: ArrayLike) -> None:
        """Puts the blade of one session somewhere without a cut; its stroke ends. Metres, world."""
        self._place_blade(session, base, tip)

    def to_world(self, rest: ArrayLike, out: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """Where the material that is at these places at rest is now: (n, k, 3), metres. As Session.to_world()."""
        import numpy as np

        places = _rows(rest, "rest", (len(self), None, 3))
        now = np.empty_like(places) if out is None else out
        if places.size:
            self._to_world(places, now)
        return now

    def to_rest(self, world: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The places of the middle surface that are nearest to these now, at rest: (n, k, 3), and how far they are: (n, k). Metres."""
        import numpy as np

        places = _rows(world, "world", (len(self), None, 3))
        rest, distance = np.empty_like(places), np.empty(places.shape[:2])
        if places.size:
            self._to_rest(places, rest, distance)
        return rest, distance


def _rows(given, name, shape):
    import numpy as np

    array = np.ascontiguousarray(given, dtype=np.float64)
    if array.ndim != len(shape) or any(want not in (None, have) for want, have in zip(shape, array.shape, strict=True)):
        words = ", ".join("k" if want is None else str(want) for want in shape)
        raise ValueError(f"{name} must be an array of shape ({words}), not of shape {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite")
    return array


def _flags(given, name, n):
    import numpy as np

    array = np.ascontiguousarray(given)
    if array.shape != (n,) or array.dtype != np.bool_:
        raise ValueError(f"{name} must be {n} truth values")
    return array
