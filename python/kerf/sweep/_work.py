"""What is done to one row, in whatever process."""

from __future__ import annotations

import os
import socket
import sys
import sysconfig
import time
import traceback
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

from .. import __version__
from .._error import Error
from ._plan import RESERVED, is_utf8, plain

_kept: dict[str, Any] = {}  # what this process has of the sweep that it was last at


def do_row(function: Callable[..., Any], shared: dict[str, Any], row: tuple[int, dict[str, Any], int]) -> dict[str, Any]:
    """The row as it goes into the table. Whatever the function raises is its error."""
    number, parameters, seed = row
    out = {"row": number, "seed": seed, **parameters}
    began = time.perf_counter()
    try:
        out.update(_checked(function(dict(parameters), seed, **shared), out))
    except (Exception, SystemExit) as error:
        out.update({"error_kind": "raised", "error": _told(error)})
    return {**out, "seconds": time.perf_counter() - began, "host": _host(), "kerf": __version__}


def lost_row(row: tuple[int, dict[str, Any], int], kind: str, error: str, seconds: float | None, tries: int) -> dict[str, Any]:
    """A row that came to nothing."""
    number, parameters, seed = row
    return {"row": number, "seed": seed, **parameters, "seconds": seconds, "tries": tries, "host": None, "kerf": __version__, "error_kind": kind,
            "error": error}


def code_of(modules: Iterable[str | os.PathLike[str] | ModuleType]) -> list[tuple[str, str, str]]:
    """(name, file, text) of modules, that install() makes modules of elsewhere."""
    out: dict[str, tuple[str, str, str]] = {}
    for module in modules:
        file = getattr(module, "__file__", None) if isinstance(module, ModuleType) else os.fspath(module)
        if not isinstance(file, str) or not file.endswith(".py"):
            raise TypeError(f"modules must be modules or files in Python, not {module!r}")
        with open(file, encoding="utf-8") as text:
            name = module.__name__ if isinstance(module, ModuleType) else Path(file).stem
            out.setdefault(name, (name, os.path.abspath(file), text.read()))
    return list(out.values())


def module_of(function: Callable[..., Any]) -> list[ModuleType]:
    """The module of a function where it is a file of one's own, which other machines need not have. That of the program travels by pickle."""
    inner = getattr(function, "measure", None) or getattr(function, "func", function)  # of a Scene, of a partial
    module = sys.modules.get(getattr(inner, "__module__", None) or "")
    file = getattr(module, "__file__", None)
    if module is None or file is None or module.__name__ == "__main__" or "." in module.__name__ or not file.endswith(".py"):
        return []
    return [] if any(Path(file).is_relative_to(folder) for folder in {*sysconfig.get_paths().values()}) else [module]


def install(code: list[tuple[str, str, str]]) -> None:
    """Makes modules of texts, in this order, from the first on that is not there with this text: those behind it may import it."""
    there = True
    for name, file, text in code:
        there = there and getattr(sys.modules.get(name), "__kerf_text__", None) == text
        if there:
            continue
        module = ModuleType(name)
        module.__file__ = file
        sys.modules[name] = module
        try:
            exec(compile(text, file, "exec"), vars(module))
        except BaseException:
            del sys.modules[name]
            raise
        vars(module)["__kerf_text__"] = text


def work(job: str, held: list[Any], chunk: list[tuple[int, dict[str, Any], int]], pace: float) -> Iterator[list[dict[str, Any]]]:
    """Does the rows, and yields those that are done from time to time; first an empty list, when the first row begins.

    held: references of Ray to code_of() modules and to (function, shared), which each process fetches once for a job. pace: seconds between
    two that it yields, at least.
    """
    if job not in _kept:
        import ray

        _kept.clear()
        install(ray.get(held[0]))
        _kept[job] = ray.get(held[1])
    function, shared = _kept[job]
    yield []
    done, told = [], time.monotonic()
    for row in chunk:
        done.append(do_row(function, shared, row))
        if time.monotonic() - told > pace:
            yield done
            done, told = [], time.monotonic()
    if done:
        yield done


def _checked(result, row):
    if not isinstance(result, dict):
        raise TypeError(f"the function of a sweep returns a dict, not {type(result).__name__}")
    for name in result:
        if not isinstance(name, str):
            raise TypeError(f"names of results are text, not {type(name).__name__}")
        if name in row or name in RESERVED:
            raise ValueError(f"{name!r} can't be the name of a result: it is that of a value or a column of every sweep")
        if not is_utf8(name):
            raise ValueError(f"{name!a} can't be the name of a result: it is not UTF-8; give another name")
    return {name: plain(value, name) for name, value in result.items()}


def _told(error):
    """An exception in one line; where it came from, unless it is of Kerf, whose words say enough."""
    name = type(error).__name__ if type(error).__module__ == "builtins" else f"{type(error).__module__}.{type(error).__qualname__}"
    words = f"{name}: {error}".replace("\n", " ").replace("\0", "")
    frames = traceback.extract_tb(error.__traceback__)[1:]  # the first is do_row
    if isinstance(error, Error) or not frames:
        return words
    return f"{words} ({os.path.basename(frames[-1].filename)}:{frames[-1].lineno})"


def _host():
    return f"{socket.gethostname()}:{os.getpid()}"
