"""The session."""

import os

from . import _arguments, _core
from ._scene import source_of, utf8


class Session(_core.Session):
    """A body that is simulated and cut.

    scene: the name of a shipped scene (kerf.scenes()) or of a model (kerf.models()), a path to a scene file or to a body
    saved by `kerf bind`, a text in TOML, or a dict with the same keys. A file of that name goes before a shipped scene.
    meshes: folders where mesh files are looked for that are not beside the scene.
    kerf.Error: the scene or a mesh can't be used. TypeError: scene is something else.

    Lengths are metres, times seconds, z is up. A session is used by one thread at a time (another one gets a kerf.Error);
    many sessions can run at once. Arrays are read-only and stay what they were: ask again after a step or a cut.
    """

    def __init__(self, scene, *, meshes=()):
        text, name, folder = source_of(scene)
        if isinstance(meshes, (str, os.PathLike)):
            meshes = [meshes]
        super().__init__(utf8(text), utf8(name), utf8(folder), [utf8(os.fsdecode(path)) for path in meshes])

    def cut(self, poses, frame="rest", through=False):
        """One whole stroke: the blade's edge moves through these poses, base and tip of each.

        poses: shape (n, 2, 3), two or more, finite, metres. frame, through: as in stroke(). A blade of the scene that is
        cutting ends first. Returns whether it cut anything; then it is one step of undo().
        TypeError, ValueError: not such an array. kerf.Error: a stroke is open, or a pose can't be cut to. After an error
        or Ctrl-C the body is as before.
        """
        return self._cut(_arguments.path(poses), frame, through)

    def report(self):
        """What has come of the session so far, as a dict with the keys of report.json that need no record of every step."""
        import json

        report = json.loads(self._report())
        for key in ("steps", "tools", "contact", "invariants"):
            report.pop(key, None)
        return report

    def __reduce_ex__(self, protocol):
        raise TypeError("a session can't be copied or pickled; make another one of the same scene")

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        self.close()

    def __repr__(self):
        if self.closed:
            return "<kerf.Session, closed>"
        return f"<kerf.Session {self.name!r} at {self.time:g} s>"
