"""Kerf cuts thin deformable solids in real time.

    import kerf

    session = kerf.Session("steak", scripted=False)  # without the scene's own cuts
    with session.stroke(frame="rest") as blade:
        blade.move([0, -0.10, 0.05], [0, -0.10, -0.05])
        blade.move([0, 0.02, 0.05], [0, 0.02, -0.05])
    session.punch([0.03, 0, 0], 0.01, frame="rest")
    session.step(100)
    print(session.counts, session.positions.shape)
    kerf.view(session)  # in a browser, or in the notebook's cell

Meshes of one's own: kerf.Session(kerf.bind(vertices, triangles)).
"""

from . import _machine

_machine.check()

from ._body import Body, bind, load  # noqa: E402
from ._core import Snapshot, Stroke  # noqa: E402
from ._batch import Batch  # noqa: E402
from ._camera import Camera  # noqa: E402
from ._error import Error  # noqa: E402
from ._recording import Playback, Recording  # noqa: E402
from ._scene import models, scenes  # noqa: E402
from ._session import Session  # noqa: E402
from ._view import Viewer, view  # noqa: E402

__all__ = ["Batch", "Body", "Camera", "Error", "Playback", "Recording", "Session", "Snapshot", "Stroke", "Viewer", "bind", "load", "models", "scenes", "view"]


TYPE_CHECKING = False  # checkers take it for true; typing is slow to import
if TYPE_CHECKING:
    __version__: str
else:
    def __getattr__(name):
        if name == "__version__":
            from importlib.metadata import version  # slow to import

            return version("kerf")
        raise AttributeError(f"module 'kerf' has no attribute '{name}'")
