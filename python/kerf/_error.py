"""The package's exception."""

from __future__ import annotations

import re
from typing import Any

_PLACE = re.compile(r"^(?P<file>[^\n]*?):(?P<line>\d+): ")


class Error(Exception):
    """A scene, mesh or command that can't be used, or a computation that could not be finished.

    file, line: where the trouble is, as far as it is in a file, else None (of the first problem when there are several).
    key: what that line of a scene or command sets, with its table ("simulation.time_step"), else None.
    kind: "bad input" or "failed".
    diagnosis: of kerf.bind(): how the collision mesh was judged that it tried to make (as Body.diagnosis), else None.
    """

    def __init__(self, message: str, kind: str = "bad input") -> None:
        super().__init__(message)
        place = _PLACE.match(message)
        self.kind = kind
        self.file: str | None = place["file"] if place else None
        self.line: int | None = int(place["line"]) if place else None
        self.key: str | None = None
        self.diagnosis: dict[str, Any] | None = None


_HEADER = re.compile(r"\s*\[\[?\s*([^\[\]]+?)\s*\]\]?\s*(?:#.*)?$")
_KEY = re.compile(r"""\s*((?:[\w-]+|"[^"]*"|'[^']*')(?:\s*\.\s*(?:[\w-]+|"[^"]*"|'[^']*'))*)\s*=""")


def key_at(text, line):
    """The key that is set in this line (from 1) of a TOML text, after the name of its table; None: that line sets none."""
    lines = text.split("\n")
    if not 1 <= line <= len(lines):
        return None
    found = _KEY.match(lines[line - 1])
    if not found:
        return None
    table = next((h[1] for h in map(_HEADER.match, reversed(lines[: line - 1])) if h), "")
    return re.sub(r"[\s\"']", "", f"{table}.{found[1]}" if table else found[1])


class naming_keys:
    """`with`: an Error on its way out gets the key that its line of this text sets."""

    def __init__(self, text, name):
        self._text, self._name = text, name

    def __enter__(self):
        return self

    def __exit__(self, kind, error, trace):
        if isinstance(error, Error) and error.line is not None and error.file == self._name:
            error.key = key_at(self._text, error.line)


Error.__module__ = "kerf"
