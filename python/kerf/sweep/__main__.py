"""python -m kerf.sweep: a sweep from a file."""

from __future__ import annotations

import argparse
import importlib.util
import math
import sys
from pathlib import Path
from typing import Any

from .._error import Error
from ._plan import Plan
from ._scene import Scene, _parsed

ABOUT = """Does a sweep: calls a function, or steps a scene, for each row of a plan, on all processors of this machine or of a Ray cluster. Results
go into a Parquet dataset as they come. The same command again goes on where it was."""
FILE = """the file, in TOML:
  title = "Sag by stiffness"
  scene = "sheet"                 a scene as kerf.Session takes it, or a file beside this one; or
  function = "sag.py:sag"         a function (parameters, seed) -> dict, in a file beside this one
  measure = "sag.py:measure"      with scene: a function (session) -> dict
  modules = ["judge.py"]          files that those import, each after what it imports itself: they travel along
  steps = 200                     with scene: time steps; by default the scene's duration
  seeds = 8                       0 to 7; or a list
  time_limit = 60                 seconds of a row
  tries = 2                       times that a row is begun whose process dies
  [grid]
  "material.young" = [1e4, 1e5]
  "material.density" = { from = 500, to = 2000, count = 4, spacing = "log" }
  [random]
  "material.poisson" = { uniform = [0.3, 0.45] }

exit status: 0 every row is well, 1 rows failed or the run did, 2 bad input, 130 interrupted"""
KEYS = ("title", "scene", "function", "measure", "modules", "steps", "scripted", "seeds", "time_limit", "tries", "cpus", "grid", "random")
KINDS = {"title": (str, "a text"), "scene": (str, "a text"), "function": (str, "a text"), "measure": (str, "a text"), "modules": (list, "a list of files"),
         "grid": (dict, "a table"), "random": (dict, "a table")}


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m kerf.sweep", description=ABOUT, epilog=FILE, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path, help="the sweep, TOML")
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER", help="where results go; a folder that holds this sweep in part is gone on with")
    parser.add_argument("--address", help='of a Ray cluster, "auto" or host:port; by default this machine alone')
    parser.add_argument("--workers", type=int, help="processes at once; 0: in this one, without Ray")
    parser.add_argument("--seeds", type=int, metavar="N", help="seeds 0 to N - 1 instead of the file's")
    parser.add_argument("--retry-errors", action="store_true", help="do rows again that failed")
    parser.add_argument("--quiet", action="store_true", help="no bar")
    given = parser.parse_args(arguments)
    try:
        summary = _done(given)
    except KeyboardInterrupt:
        print(f"interrupted; what is done is in {given.out}, and the same command goes on", file=sys.stderr)
        return 130
    except (Error, ValueError, TypeError, ImportError) as error:
        print(f"kerf.sweep: {error}", file=sys.stderr)
        return 1 if getattr(error, "kind", "") == "failed" else 2
    rate = f", {summary.new / summary.seconds:.3g} rows/s" if summary.new else ""
    print(f"{summary.folder}: {summary.done} of {summary.rows} rows, {summary.new} of them now in {summary.seconds:.1f} s{rate}; {summary.failed} failed")
    return 1 if summary.failed else 0


def _done(given):
    from ._run import run

    try:
        text = given.file.read_text()
    except (OSError, UnicodeDecodeError) as error:
        raise Error(f"{given.file}: {getattr(error, 'strerror', None) or error}") from None
    sweep = _parsed(text, str(given.file))
    for key in sweep:
        if key not in KEYS:
            raise Error(f"{given.file}: there is no key {key!r}; there are {', '.join(KEYS)}")
        kind, words = KINDS.get(key, (object, ""))
        if not isinstance(sweep[key], kind):
            raise Error(f"{given.file}: {key} must be {words}, not {sweep[key]!r}")
    if ("scene" in sweep) == ("function" in sweep):
        raise Error(f"{given.file}: give either scene or function")
    folder = given.file.parent
    modules = [_module(folder / name) for name in sweep.get("modules", [])]
    plan = Plan({name: _values(values, name) for name, values in sweep.get("grid", {}).items()}, random=sweep.get("random"),
                seeds=sweep.get("seeds", 1) if given.seeds is None else given.seeds)
    if "function" in sweep:
        function = _function(folder, sweep["function"], modules)
    else:
        beside = folder / sweep["scene"]
        function = Scene(beside if beside.is_file() else sweep["scene"], steps=sweep.get("steps"), scripted=sweep.get("scripted", True),
                         measure=_function(folder, sweep["measure"], modules) if "measure" in sweep else None)
    return run(function, plan, given.out, workers=given.workers, address=given.address, time_limit=sweep.get("time_limit"), tries=sweep.get("tries", 2),
               cpus=sweep.get("cpus", 1.0), retry_errors=given.retry_errors, progress=False if given.quiet else None, title=sweep.get("title"), modules=modules)


def _values(values, name):
    """A list, or one of evenly spaced numbers."""
    if not isinstance(values, dict):
        return values
    if set(values) - {"spacing"} != {"from", "to", "count"} or values.get("spacing", "linear") not in ("linear", "log"):
        raise Error(f'{name}: evenly spaced numbers are {{ from = 1, to = 10, count = 4 }}, and spacing = "log" if wanted')
    low, high, count = float(values["from"]), float(values["to"]), int(values["count"])
    if count < 1 or (values.get("spacing") == "log" and min(low, high) <= 0):
        raise Error(f"{name}: there are no {count} such numbers from {low:g} to {high:g}")
    parts = [i / max(count - 1, 1) for i in range(count)]
    if values.get("spacing") == "log":
        return [math.exp(math.log(low) + part * math.log(high / low)) if 0 < part < 1 else (low, high)[int(part)] for part in parts]
    return [low + part * (high - low) if part < 1 else high for part in parts]


def _module(path: Path) -> Any:
    """The module in a file, by the name of that file."""
    name = path.stem
    if name not in sys.modules or getattr(sys.modules[name], "__file__", None) != str(path.resolve()):
        spec = importlib.util.spec_from_file_location(name, path.resolve())
        if spec is None or spec.loader is None or not path.is_file():
            raise Error(f"{path}: there is no such file in Python")
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        spec.loader.exec_module(module)
    return sys.modules[name]


def _function(folder, name, modules):
    file, _, word = name.rpartition(":")
    if not file:
        raise Error(f'{name!r} names no function; "file.py:function" does')
    module = _module(folder / file)
    modules.append(module)
    found = getattr(module, word, None)
    if not callable(found):
        raise Error(f"{folder / file}: has no function {word}")
    return found


if __name__ == "__main__":
    sys.exit(main())
