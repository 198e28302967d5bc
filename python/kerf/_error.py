"""The package's exception."""

import re

_PLACE = re.compile(r"^(?P<file>[^\n]*?):(?P<line>\d+): ")


class Error(Exception):
    """A scene, mesh or command that can't be used, or a computation that could not be finished.

    file, line: where the trouble is, as far as it is in a file, else None (of the first problem when there are several).
    kind: "bad input" or "failed".
    """

    def __init__(self, message, kind="bad input"):
        super().__init__(message)
        place = _PLACE.match(message)
        self.kind = kind
        self.file = place["file"] if place else None
        self.line = int(place["line"]) if place else None


Error.__module__ = "kerf"
