"""Paths of files."""

import os

from ._scene import utf8


def path_text(path):
    """A path as the library can have it."""
    if not isinstance(path, (str, os.PathLike)):
        raise TypeError(f"a path is a str or os.PathLike, not {type(path).__name__}")
    text = utf8(os.fsdecode(path))
    if "\0" in text:
        raise ValueError("a path has no null characters")
    return text
