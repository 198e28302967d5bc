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


class Records:
    """Views of the bytes that the extension hands out; the same view while the bytes are the same."""

    def __init__(self):
        self._dtypes, self._views = {}, {}

    def view(self, name, rows):
        known = self._views.get(name)
        if known is None or known[0] is not rows:
            known = self._views[name] = rows, rows.view(self._dtype(name))[:, 0]
        return known[1]

    def _dtype(self, name):
        if name not in self._dtypes:
            import numpy as np  # here: `import kerf` goes without it

            self._dtypes[name] = np.dtype(_FIELDS[name], align=True)
        return self._dtypes[name]

    def forget(self):
        self._views.clear()
