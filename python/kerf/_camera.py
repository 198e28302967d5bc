"""Where pictures are taken from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from . import _arguments, _core

if TYPE_CHECKING:  # `import kerf` goes without NumPy
    from numpy.typing import ArrayLike


@dataclass(frozen=True, init=False)
class Camera:
    """A pinhole camera, for Session.render().

    eye: where it is. target: what it looks at, the middle of the picture. Both metres, world. up: upwards in the picture, any length.
    field_of_view: from the foot of the picture to its top, radians, 0.02 to 2.5; pixels are square.
    The middle of pixel (row, column) looks along  ahead + x * right + y * up  from the eye, with  y = tan(field_of_view / 2) *
    (1 - (2 * row + 1) / height)  and  x = tan(field_of_view / 2) * (2 * column + 1 - width) / height.
    TypeError, ValueError: something else, an eye at its target, up along the view.
    """

    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    up: tuple[float, float, float]
    field_of_view: float

    def __init__(self, eye: ArrayLike, target: ArrayLike, up: ArrayLike = (0.0, 0.0, 1.0), field_of_view: float = 0.5) -> None:
        values = {"eye": _arguments.point(eye, "eye"), "target": _arguments.point(target, "target"), "up": _arguments.point(up, "up"),
                  "field_of_view": _arguments.number(field_of_view, "field_of_view")}
        _core.check_camera(**values)
        for name, value in values.items():
            object.__setattr__(self, name, value)


Camera.__module__ = "kerf"
