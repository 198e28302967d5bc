"""Recordings: everything that was done to one session, to do it again to the same bits."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

from . import _arguments, _core
from ._paths import path_text
from ._error import Error
from ._session import Session, paths_text

if TYPE_CHECKING:
    Path = str | os.PathLike[str]


class Recording:
    """A recording (.kerfrec): its scene with what it needs of mesh files, every change by step, and hashes of the state.

    Made by Recording.load(), and by Session.recording() of a session that records. It never changes; any threads may have it. It can be pickled:
    session.recording().session_at() in another process is the session there, to the bit, for the time that playing it takes.
    """

    _held: _core.HeldRecording
    _meshes: list[str]
    _scene: tuple[str, float] | None

    def __init__(self) -> None:
        raise TypeError("a recording comes from kerf.Recording.load(path), or from recording() of a kerf.Session(scene, record=True)")

    @classmethod
    def load(cls, path: Path, *, meshes: Path | Iterable[Path] = ()) -> Recording:
        """The recording in a file: of `kerf run --record`, of the page's record button, or of save().

        meshes: folders where mesh files are looked for that were too large to travel in it.
        kerf.Error, with `file`: there is no such file, it is damaged or something else, or it is of another version.
        """
        file, folders = path_text(path), paths_text(meshes)
        try:
            return cls._of(_core.read_recording(file), folders)
        except Error as error:
            error.file = error.file or file
            raise

    @classmethod
    def _of(cls, held: _core.HeldRecording, meshes: list[str]) -> Recording:
        out = object.__new__(cls)
        out._held, out._meshes, out._scene = held, meshes, None
        return out

    def save(self, path: Path) -> None:
        """Writes it to a file for `kerf replay`, usually .kerfrec: the file appears complete and lasts, or not at all.

        An existing file is replaced. kerf.Error: it can't be written.
        """
        self._held.save(path_text(path))

    @property
    def file(self) -> str | None:
        """Where it was loaded from; None: it was recorded by a session of this process."""
        return self._held.file or None

    @property
    def name(self) -> str:
        """Name of its scene."""
        return self._held.name

    @property
    def scene(self) -> str:
        """Text of its scene, TOML."""
        return self._held.scene

    @property
    def instructions(self) -> str:
        """Instruction set that it was made with. Another one may round differently."""
        return self._held.instructions

    @property
    def title(self) -> str:
        """Title of its scene. kerf.Error: the scene or a mesh file of it can't be used."""
        return self._read_scene()[0]

    @property
    def time_step(self) -> float:
        """Length of a step, seconds. kerf.Error: as for title."""
        return self._read_scene()[1]

    @property
    def steps(self) -> int:
        """Time steps from its begin to its end."""
        return self._held.steps

    @property
    def duration(self) -> float:
        """Simulated time from its begin to its end, seconds. kerf.Error: as for title."""
        return self.steps * self.time_step

    @property
    def changes(self) -> list[dict[str, Any]]:
        """What was done from outside, in order: a new list of dicts.

        step: it was done after so many. kind ("blade", "punch", ...) and values (numbers): as docs/recording.md has them. id: of a grasp or
        a tool. elements: numbers of collision vertices of a grasp, or of the collision triangle whose piece went. What the scene itself does
        is not among them.
        """
        return self._held.changes()

    def play(self, every: float | None = None) -> Playback:
        """Its session, step by step: `for session in recording.play(every=0.1)`.

        every: seconds from one stop to the next, to the nearest step; by default each step is one. The first stop is the begin, the last one
        the end. TypeError, ValueError: every is no such number, or not above 0. kerf.Error: the scene or a mesh file of it can't be used.
        """
        steps = 1.0
        if every is not None:
            seconds = _arguments.number(every, "every")
            if not 0 < seconds < math.inf:
                raise ValueError("every must be finite and above 0")
            steps = min(max(seconds / self.time_step, 1.0), max(self.steps, 1))
        return Playback(self, steps)

    def session_at(self, time: float) -> Session:
        """A session of its own, played to the step nearest to this time (seconds), what was done after that step included.

        TypeError, ValueError: time is no number from 0 to duration. kerf.Error: as for play(), or a step can't be done. Ctrl-C ends it.
        """
        seconds = _arguments.number(time, "time")
        steps = round(seconds / self.time_step) if math.isfinite(seconds) else -1
        if seconds < 0 or not 0 <= steps <= self.steps:
            raise ValueError(f"time must be from 0 to {self.duration:g} s, where the recording ends, not {seconds:g}")
        playback = Playback(self, 1.0)
        playback._to(steps)
        return playback.session

    def replay(self) -> dict[str, Any]:
        """Does everything again and compares, as `kerf replay`: Playback.report at the end.

        kerf.Error: it can't be done again. Python's lock is free meanwhile; Ctrl-C ends it.
        """
        playback = Playback(self, 1.0)
        try:
            playback._to(self.steps)
            return playback.report
        finally:
            playback.session.close()

    def compare(self, other: Recording) -> dict[str, Any]:
        """Where this recording and another one part, as they are written: a dict. Nothing is played.

        same; settings: what differs from the start, in words; first_change: step of the first change that is not the same in both, or None, and
        changes: it in both, in words; hashes: how many steps both have a hash of, and first_difference: the first such step whose hashes
        differ, or None; same_end. TypeError: other is no recording.
        """
        if not isinstance(other, Recording):
            raise TypeError(f"a recording is compared with a kerf.Recording, not with {type(other).__name__}")
        return self._held.compare(other._held)

    def _read_scene(self) -> tuple[str, float]:
        if self._scene is None:
            self._scene = self._held.title_and_step(self._meshes)
        return self._scene

    def __reduce_ex__(self, protocol: Any) -> Any:
        return _unpickled, (self._held.text(), self._held.file, self._meshes)

    def __copy__(self) -> Recording:
        return self

    def __deepcopy__(self, memo: Any) -> Recording:
        return self

    def __repr__(self) -> str:
        return f"<kerf.Recording of {self.name!r}, {self.steps} steps>"


def _unpickled(text: str, file: str, meshes: list[str]) -> Recording:
    return Recording._of(_core.recording_of_text(text, file), meshes)


class Playback(Iterator[Session]):
    """A recording on its way, made by Recording.play(): an iterator over its stops.

    At each stop it gives the same session, as it is after so many steps and what was done then. Look at it, draw it; whoever cuts or steps it
    plays on another state than was recorded, and the report tells so.
    """

    def __init__(self, recording: Recording, every: float) -> None:
        if not isinstance(recording, Recording):
            raise TypeError("a playback comes from play() of a kerf.Recording")
        self._session = Session._of_recording(recording._held, recording._meshes)
        self._play = _core.Play(recording._held)
        self._every, self._stop, self._last = every, 0, recording.steps

    @property
    def session(self) -> Session:
        """The session that it plays in."""
        return self._session

    @property
    def report(self) -> dict[str, Any]:
        """How it went so far: a dict.

        same: the bits are the recorded ones. first_difference: the first step whose hash differs, or None; the difference arose there, or
        since the hash before it, 100 steps as a rule. steps, hashes: how many were done and compared. over: it is at its end.
        refused: the first change that the session refused, as it did when it was recorded, and what it said, or None.
        score: at the end of a scene with a lesion, as Session.score, else None.
        """
        return self._play.report()

    def _to(self, step: int) -> None:
        self._play.to(self._session, step)

    def __iter__(self) -> Playback:
        return self

    def __next__(self) -> Session:
        """Plays to the next stop. kerf.Error: a step can't be done, or the session is closed. Ctrl-C ends it after a whole step."""
        if self._play.over:
            raise StopIteration
        step = min(round(self._stop * self._every), self._last)
        self._to(step)
        self._stop += 1
        return self._session

    def __repr__(self) -> str:
        return f"<kerf.Playback at step {self._play.steps} of {self._last}>"


for _made in (Recording, Playback):
    _made.__module__ = "kerf"
