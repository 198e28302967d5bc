"""Contacts, tools and grasps as structured arrays: the layout of python/src/state_records.h."""

_VECTOR, _AXES = ("f8", 3), ("f8", (3, 3))
_FIELDS = {
    "contacts": [("point", *_VECTOR), ("normal", *_VECTOR), ("force", *_VECTOR), ("gap", "f8"), ("normal_force", "f8"), ("obstacle", "i4"),
                 ("tool", "i4"), ("sliding", "?")],
    "tools": [("position", *_VECTOR), ("axes", *_AXES), ("velocity", *_VECTOR), ("spin", *_VECTOR), ("pose_position", *_VECTOR),
              ("pose_axes", *_AXES), ("jaws", "f8"), ("force", *_VECTOR), ("torque", *_VECTOR), ("coupling_force", *_VECTOR),
              ("coupling_torque", *_VECTOR)],
    "grasps": [("held", *_VECTOR), ("target", *_VECTOR), ("force", *_VECTOR), ("vertices", "i8")],
}


_dtypes = {}


def dtype(name):
    """Of one record."""
    if name not in _dtypes:
        import numpy as np  # here: `import kerf` goes without it

        _dtypes[name] = np.dtype(_FIELDS[name], align=True)
    return _dtypes[name]


class Records:
    """Views of the bytes that the extension hands out; the same view while the bytes are the same."""

    def __init__(self):
        self._views = {}

    def view(self, name, rows):
        known = self._views.get(name)
        if known is None or known[0] is not rows:
            known = self._views[name] = rows, rows.view(dtype(name))[:, 0]
        return known[1]

    def forget(self):
        self._views.clear()
