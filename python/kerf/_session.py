"""The session."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Literal, overload

from . import _arguments, _core, _surfaces
from ._camera import Camera
from ._error import Error, naming_keys
from ._paths import path_text
from ._records import Records
from ._scene import command_of, source_of, utf8

if TYPE_CHECKING:  # `import kerf` goes without NumPy
    import meshio
    import numpy as np
    import pyvista
    import trimesh
    from numpy.typing import ArrayLike, NDArray

    from ._recording import Recording

    Path = str | os.PathLike[str]
    Region = dict[str, Any]


def paths_text(paths):
    """Folders as the library can have them: one or several. kerf.Error: one is not there."""
    if isinstance(paths, (str, os.PathLike)):
        paths = [paths]
    if not isinstance(paths, Iterable):
        raise TypeError(f"meshes must be a folder, or several in a list, not {type(paths).__name__}")
    return [_folder(utf8(os.fsdecode(path))) for path in paths]


def _folder(path):
    if not os.path.isdir(path):
        raise Error(f"{path}: {'is no folder' if os.path.exists(path) else 'there is no such folder'}; meshes names folders with mesh files")
    return path


class Session(_core.Session):
    """A body that is simulated and cut.

    scene: the name of a shipped scene (kerf.scenes()) or of a model (kerf.models()), a path to a scene file or to a body
    saved by `kerf bind`, a text in TOML, or a dict with the same keys. A file of that name goes before a shipped scene.
    Or a kerf.Body, which hangs by its far rim; in a dict it is what is bound: {"body": {"bound": body}}.
    meshes: folders where mesh files are looked for that are not beside the scene. They must exist.
    record: everything that is done to it is noted, for recording(). Every 100 steps then cost a hash of the state.
    scripted: whether the scene's own commands run; shipped scenes have some. kerf.Session("steak") cuts and pulls as it steps, and a blade of the
    scene that begins ends a stroke() that is open. With scripted=False nothing happens that the caller does not do.
    kerf.Error: the scene or a mesh can't be used. TypeError: scene is something else.

    copy.copy(), copy.deepcopy() and pickle give another session that goes on to the same bits, as save() and load() do.
    Lengths are metres, times seconds, z is up. A session is used by one thread at a time (another one gets a kerf.Error);
    many sessions can run at once. Arrays are read-only and stay what they were: ask again after a step or a cut. Pictures are the
    caller's own.
    """

    __slots__ = ("__weakref__", "_meshes", "_records")  # a name that is none is an AttributeError

    def __init__(self, scene: Path | dict[str, Any] | _core.Body, *, meshes: Path | Iterable[Path] = (), record: bool = False,
                 scripted: bool = True) -> None:
        if hasattr(self, "_records"):
            raise TypeError("this session is made already; make another one")
        text, name, folder, bodies = source_of(scene)
        self._meshes = paths_text(meshes)
        with naming_keys(text, name):
            super().__init__(utf8(text), utf8(name), utf8(folder), self._meshes, bodies, _arguments.flag(record, "record"),
                             _arguments.flag(scripted, "scripted"))
        self._records = Records()

    @classmethod
    def _of_recording(cls, recording: _core.HeldRecording, meshes: list[str]) -> Session:
        session = cls.__new__(cls)
        _core.Session.__init__(session, recording, meshes)
        session._records, session._meshes = Records(), meshes
        return session

    def recording(self) -> Recording:
        """All that was done so far, as a kerf.Recording: session.recording().save("cut.kerfrec"), for `kerf replay`.

        What was taken back by restore() is not in it; undo() is. kerf.Error: the session was made without record=True, or something was done
        that recordings have no change for: blades and shavers of apply() and shave(), which move by themselves; a tool's way of several
        poses; a grasp's own stiffness; a removal by a region at rest. A scene may do these.
        """
        from ._recording import Recording

        return Recording._of(self._recording(), self._meshes)

    def save(self, path: Path) -> None:
        """Writes the session to a file, usually .kerfstate, for Session.load() and `kerf run --from`: complete and lasting, or not at all.

        The scene, its meshes and a kerf.Body travel in it. What came before is not there to undo(), nor to recording().
        kerf.Error: a stroke is open, the file can't be written, or it is one that the scene reads.
        """
        self._save(path_text(path))

    @classmethod
    def load(cls, path: Path, *, meshes: Path | Iterable[Path] = ()) -> Session:
        """The session in a file of save() or `kerf run --save`: it goes on to the same bits, in any process.

        meshes: folders where mesh files are looked for that were too large to travel. It records nothing.
        kerf.Error, with `file`: there is no such file, it is damaged or something else, of another version or another instruction set, or
        a mesh is not what it was.
        """
        file, folders = path_text(path), paths_text(meshes)
        try:
            return cls._going_on(None, file, folders)
        except Error as error:
            error.file = error.file or file
            raise

    @classmethod
    def _going_on(cls, data: bytes | None, file: str, meshes: list[str]) -> Session:
        session = cls.__new__(cls)
        _core.Session.__init__(session, data, file, meshes)
        session._records, session._meshes = Records(), meshes
        return session

    def cut(self, poses: ArrayLike, frame: str = "rest", through: bool = False) -> bool:
        """One whole stroke: the blade's edge moves through these poses, base and tip of each.

        poses: shape (n, 2, 3), two or more, finite, metres. frame, through: as in stroke(). A blade of the scene that is
        cutting ends first. Returns whether it cut anything; then it is one step of undo().
        TypeError, ValueError: not such an array. kerf.Error: a stroke is open, or a pose can't be cut to. After an error
        or Ctrl-C the body is as before.
        """
        return self._cut(_arguments.path(poses), frame, through)

    def apply(self, command: str | dict[str, Any]) -> bool:
        """Does a command of a scene now: a dict, or a text in TOML, with the keys of a [[command]] (`kerf info --schema`).

        session.apply({"type": "punch", "point": [0, 0, 0], "radius": 0.01}). It has no `at`. Blades, shavers and moves then go on over
        the coming steps. Returns whether it is a step of undo(), or a stroke that may become one.
        kerf.Error: as a scene with this command (file "command", line, key), a stroke() is open, or it can't be done with what there is;
        the body is as before.
        """
        return self._do(command)[0]

    def _do(self, command: str | dict[str, Any]) -> tuple[bool, int]:
        text, name = command_of(command)
        text = utf8(text)
        with naming_keys(text, name):
            return self._apply(text, name)

    def punch(self, point: ArrayLike, radius: float | None = None, *, points: ArrayLike | None = None, shape: str | None = None,
              axis: ArrayLike | None = None, across: ArrayLike | None = None, frame: str | None = None, reach: float | None = None,
              roughness: float | None = None, take: bool | None = None) -> bool:
        """Presses a punch through the body: what is inside its outline comes loose. One step of undo().

        point: its middle. radius: metres; or points: (n, 2), corners of a polygon about it. shape: "circle" or "d". axis: along which it is
        pressed. frame: "world" or "rest". take: take away what comes loose. Everything else and all defaults: as in a scene.
        Returns whether it cut anything.
        """
        if points is not None and shape is None:
            shape = "polygon"
        return self.apply({"type": "punch", "shape": shape, "point": point, "axis": axis, "across": across, "frame": frame, "radius": radius,
                           "points": points, "reach": reach, "roughness": roughness, "take": take})

    def shave(self, poses: ArrayLike, times: ArrayLike, radius: float, *, frame: str | None = None, smoothing: float | None = None,
              removal: float | None = None) -> None:
        """Moves a shaver over cut surfaces in the coming steps; in_stroke until it has arrived. One step of undo().

        poses: ends of its window, shape (n, 2, 3), two or more, metres. times: seconds from now, rising, one each. radius: of the window,
        metres. frame, smoothing (1/s), removal (m/s): as in a scene.
        """
        self.apply({"type": "shave", "poses": _arguments.timed(poses, times), "radius": radius, "frame": frame, "smoothing": smoothing,
                    "removal": removal})

    def remove(self, grasp: str | None = None, *, box: Region | None = None, sphere: Region | None = None, half_space: Region | None = None,
               frame: str | None = None) -> int:
        """Takes loose pieces away: the one that a grasp holds, or those that reach into a region. One step of undo().

        box: {"min": ..., "max": ...}. sphere: {"center": ..., "radius": ...}. half_space: {"point": ..., "normal": ...}.
        Returns how many pieces went.
        """
        return self._do({"type": "remove", "grasp": grasp, "box": box, "sphere": sphere, "half_space": half_space, "frame": frame})[1]

    def grasp(self, id: str, point: ArrayLike, *, radius: float | None = None, frame: str | None = None,
              stiffness: float | None = None) -> None:
        """Takes hold of the surface at `point`, and of all within `radius`, metres. frame: "rest" (default) or "world".

        id: a name for move(), release() and remove(). stiffness: N/m of the whole grasp.
        """
        self.apply({"type": "grasp", "id": id, "point": point, "radius": radius, "frame": frame, "stiffness": stiffness})

    def move(self, id: str, *, by: ArrayLike | None = None, to: ArrayLike | None = None, over: float | None = None) -> None:
        """Moves a grasp in a straight line, by a way or to a place (metres, world), within `over` seconds; at once by default."""
        self.apply({"type": "move", "id": id, "by": by, "to": to, "over": over})

    def release(self, id: str) -> None:
        """Lets a grasp go."""
        self.apply({"type": "release", "id": id})

    def fix(self, *, box: Region | None = None, sphere: Region | None = None, half_space: Region | None = None) -> None:
        """Holds what lies in a region (coordinates at rest) where it is now. Regions: as for remove()."""
        self.apply({"type": "fix", "box": box, "sphere": sphere, "half_space": half_space})

    def unfix(self, *, box: Region | None = None, sphere: Region | None = None, half_space: Region | None = None) -> None:
        """Frees what lies in a region, whoever held it. Regions: as for remove()."""
        self.apply({"type": "unfix", "box": box, "sphere": sphere, "half_space": half_space})

    def move_tool(self, id: str, position: ArrayLike, rotation: ArrayLike | None = None, *, over: float = 0.0) -> None:
        """Leads a tool of the scene: its pose goes to this place within `over` seconds, and the tool follows through its coupling.

        position: metres, world. rotation: axis times angle, radians; by default as it is.
        """
        self.apply({"type": "tool", "id": id, "poses": [{"time": over, "position": position, "rotation": rotation}]})

    def close_jaws(self, id: str, *, over: float | None = None) -> None:
        """Closes a grasper or scissors of the scene within `over` seconds. A grasper then holds what is between its jaws."""
        self.apply({"type": "close", "id": id, "over": over})

    def open_jaws(self, id: str, *, over: float | None = None) -> None:
        """Opens a grasper or scissors of the scene within `over` seconds."""
        self.apply({"type": "open", "id": id, "over": over})

    def set_material(self, *, young: float | None = None, poisson: float | None = None, density: float | None = None) -> None:
        """Makes the bodies of something else, from the next step on: pascals, 1, kg/m3. What is not given stays.

        Regions follow where they had the same value. kerf.Error: a number that [material] of a scene may not have.
        """
        given = {"young": young, "poisson": poisson, "density": density}
        self._set_material(**{**self.material, **{word: _arguments.number(value, word) for word, value in given.items() if value is not None}})

    def to_world(self, rest: ArrayLike) -> NDArray[np.float64]:
        """Where the material that is at these places at rest is now: (k, 3), metres.

        Each place goes along with the part of the body that is nearest to it at rest; beside a cut that is one of its lips.
        """
        places = _arguments.points(rest, "rest")
        return self._to_world(places)

    def to_rest(self, world: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The places of the middle surface that are nearest to these now: (k, 3) at rest, and how far they are: (k,). Metres."""
        places = _arguments.points(world, "world")
        return self._to_rest(places)

    @overload
    def render(self, width: int = ..., height: int = ..., *, camera: Camera | None = ..., depth: Literal[False] = ...,
               shadows: bool = ..., alpha: bool = ...) -> NDArray[np.uint8]: ...

    @overload
    def render(self, width: int = ..., height: int = ..., *, camera: Camera | None = ..., depth: Literal[True],
               shadows: bool = ..., alpha: bool = ...) -> tuple[NDArray[np.uint8], NDArray[np.float32]]: ...

    def render(self, width: int = 640, height: int = 480, *, camera: Camera | None = None, depth: bool = False,
               shadows: bool = False, alpha: bool = False) -> NDArray[np.uint8] | tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """A picture of body, obstacles and tools as they are now, without a graphics card: shape (height, width, 3), uint8, sRGB.

        width, height: pixels, 1 to 8192. camera: a kerf.Camera; by default camera(width, height), which has the whole body in view.
        depth: returns (picture, depth). depth has shape (height, width), float32: metres along the view at the middle of each pixel, inf where
        nothing is. Row 0 is the top.
        alpha: the shape is (height, width, 4). Alpha is 255 where something is; all four are 0 where nothing is.
        All are new arrays of the caller's own. Same state, same bytes.
        Some milliseconds at 128 x 128. shadows=True draws the picture of `kerf run`, with soft shadows, smooth edges and a ground to lie on: some
        seconds; its depth and alpha are those of the quick one, without that ground.
        TypeError, ValueError: a size that is none, or a camera that is none.
        """
        columns, rows = _arguments.pixels(width, "width"), _arguments.pixels(height, "height")
        if camera is not None and not isinstance(camera, Camera):
            raise TypeError(f"camera must be a kerf.Camera, not {type(camera).__name__}")
        return self._render(columns, rows, camera, *(_arguments.flag(value, name) for name, value in
                                                     (("depth", depth), ("shadows", shadows), ("alpha", alpha))))

    def camera(self, width: int = 640, height: int = 480) -> Camera:
        """The camera of a picture of so many pixels that has the whole body in view, as it is now, from where the scene says.

        Keep it for pictures whose view stands still.
        """
        return Camera(*self._camera(_arguments.pixels(width, "width"), _arguments.pixels(height, "height")))

    @property
    def contacts(self) -> NDArray[np.void]:
        """What touched in the last step: a structured array, none after a change of topology.

        Fields: point (m), normal (unit, towards the body), gap (m, below 0: overlap), force (N, on the body), normal_force (N), sliding,
        obstacle and tool (numbers in the scene; both -1: the body itself).
        """
        return self._view("contacts", self._contacts())

    @property
    def tools(self) -> NDArray[np.void]:
        """Tools of the scene, in the order of tool_ids: a structured array.

        Fields: position (m) and axes (rotation matrix) of the tool, velocity, spin, pose_position and pose_axes that it follows, jaws (1 open,
        0 closed), force and torque of the body on it (N, N m), coupling_force and coupling_torque of whoever leads it.
        """
        return self._view("tools", self._tools())

    @property
    def grasps(self) -> NDArray[np.void]:
        """Grasps that hold, in the order of grasp_ids: a structured array.

        Fields: held (centre of the points, m), target (where it is pulled to, m), force (on the body in the last step, N), vertices.
        """
        return self._view("grasps", self._grasps())

    def _view(self, name: str, rows: NDArray[np.uint8]) -> NDArray[np.void]:
        return self._records.view(name, rows)

    def to_trimesh(self) -> trimesh.Trimesh:
        """The surface that is drawn, as it is: a copy as a trimesh.Trimesh, metres.

        Vertices and faces keep their numbers. face_attributes["wall"]: (m,) uint8, 1 on walls of cuts. ImportError: trimesh is not installed.
        """
        return _surfaces.to_trimesh(self)

    def to_pyvista(self) -> pyvista.PolyData:
        """The surface that is drawn, as it is: a copy as a pyvista.PolyData, metres.

        Points and faces keep their numbers. cell_data["wall"]: (m,) uint8, 1 on walls of cuts. ImportError: pyvista is not installed.
        """
        return _surfaces.to_pyvista(self)

    def to_meshio(self) -> meshio.Mesh:
        """The surface that is drawn, as it is: a copy as a meshio.Mesh of one block of triangles, metres.

        Points and triangles keep their numbers. cell_data["wall"][0]: (m,) uint8, 1 on walls of cuts. ImportError: meshio is not installed.
        """
        return _surfaces.to_meshio(self)

    def close(self) -> None:
        """Frees the session now; all else then raises kerf.Error. Arrays that came from it stay."""
        super().close()
        self._records.forget()

    def report(self) -> dict[str, Any]:
        """What has come of the session so far, as a dict with the keys of report.json that need no record of every step."""
        import json

        report = json.loads(self._report())
        for key in ("steps", "tools", "contact", "invariants"):
            report.pop(key, None)
        return report

    def __reduce_ex__(self, protocol: Any) -> Any:
        return _unpickled, (type(self), self._saved_bytes(), self._meshes), getattr(self, "__dict__", None) or None

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def __repr__(self) -> str:
        try:
            return f"<kerf.Session {self.name!r} at {self.time:g} s>"
        except Error:
            return "<kerf.Session, closed>" if self.closed else "<kerf.Session, in use by another thread>"


def unpickled_snapshot(data: bytes) -> _core.Snapshot:
    """What the pickle of a snapshot becomes: restore() of any session of the same scene takes it. kerf.Error: it is damaged."""
    return _core.snapshot_of_bytes(data)


def _unpickled(kind: type[Session], data: bytes, meshes: list[str]) -> Session:
    return kind._going_on(data, "a pickled session", meshes)
