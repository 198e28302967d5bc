"""Sweeps over the keys of a scene: no code, or a function that measures."""

from __future__ import annotations

import copy
import hashlib
import json
import os
import pickle
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from .. import _arguments, _core
from .._body import bind, load
from .._error import Error
from .._scene import source_of
from .._session import Session

__all__ = ["Scene"]

OF_A_FILE = {"visual": "vertices", "collision": "collision", "scale": "scale", "thickness": "thickness", "weld": "weld", "exact_paths": "exact_paths",
             "collision_triangles": "collision_triangles"}  # keys of [body] as arguments of kerf.bind()


class Scene:
    """What a sweep does with a scene: sets the values of a row, makes a session, steps it, measures. For kerf.sweep.run().

    scene: as of kerf.Session. Names of values are keys with their tables: "material.young", "command.0.radius" for the first [[command]].
    steps: time steps; by default those of the scene's duration. scripted: as of kerf.Session.
    measure: called with the session at the end, returns a dict of what goes into the table besides. By default: time (s), pieces, piece_masses (kg,
    heaviest first, 16 at most), lowest (m, of the surface), farthest (m, that a vertex is from its place at rest), triangles, notes (how
    many), and the words of score where the scene has a lesion. With it or without: hash, of the final state, in hexadecimal.
    The row's seed becomes simulation.seed, and simulation.threads is 1, where the scene or the row does not say otherwise. A body from files, or
    a model as it stands, is bound once, unless a value is a key of [body]: a row of the steak then takes 80 ms less, and other machines need
    no files.
    fingerprint: a number in hexadecimal that differs where the text of the scene, steps, scripted or the name of measure does.
    kerf.Error, TypeError, ValueError: as of kerf.Session; a body can't be bound.
    """

    def __init__(self, scene: str | os.PathLike[str] | dict[str, Any] | _core.Body, *, steps: int | None = None, scripted: bool = True,
                 measure: Callable[[Session], Mapping[str, Any]] | None = None) -> None:
        self._steps = None if steps is None else _arguments.steps(steps, "steps")
        self._scripted, self.measure = _arguments.flag(scripted, "scripted"), measure
        if measure is not None and not callable(measure):
            raise TypeError(f"measure must be callable, not {type(measure).__name__}")
        text, name, folder, bodies = source_of(scene)
        if isinstance(scene, dict):
            self._scene = copy.deepcopy(scene)
        elif isinstance(scene, _core.Body):
            self._scene = {"body": {"bound": scene}}
        else:
            self._scene = _parsed(text, name)
            _place_files(self._scene, folder)
        whole = [text, self._steps, self._scripted, getattr(measure, "__qualname__", None)]
        self.fingerprint = hashlib.sha256(json.dumps(whole).encode() + pickle.dumps(bodies, 4)).hexdigest()[:16]
        self._bound = self._scene  # what rows begin with
        self.__qualname__ = f"scene {scene}" if isinstance(scene, str) and "\n" not in scene else "scene"

    def bind(self, names: list[str]) -> None:
        """Binds what can be bound once for all rows, unless one of these values is a key of a body. kerf.sweep.run() calls it."""
        self._bound = _copied(self._scene)
        if any(name.split(".")[0] == "body" for name in names):
            return
        body = self._bound.get("body")
        for table in body if isinstance(body, list) else [body]:
            if not isinstance(table, dict):
                continue
            if isinstance(table.get("bound"), str):
                table["bound"] = load(table["bound"])
            elif isinstance(table.get("visual"), str):
                given = {OF_A_FILE[key]: table.pop(key) for key in list(table) if key in OF_A_FILE}
                if given.get("collision_triangles") == 0:  # as many as it needs
                    del given["collision_triangles"]
                table["bound"] = bind(Path(given.pop("vertices")), **{key: value for key, value in given.items() if value is not None})
            elif isinstance(table.get("model"), str) and not {"options", "size", *OF_A_FILE} & set(table):
                table["bound"] = bind(table.pop("model"))

    def with_values(self, parameters: Mapping[str, Any], seed: int) -> dict[str, Any]:
        """The scene of a row, as kerf.Session takes it. kerf.Error: a value's name leads nowhere."""
        scene = _copied(self._bound)
        for name, value in parameters.items():
            _set(scene, name, value)
        simulation = scene.setdefault("simulation", {})
        simulation.setdefault("threads", 1)
        simulation.setdefault("seed", seed)
        return scene

    def __call__(self, parameters: Mapping[str, Any], seed: int) -> dict[str, Any]:
        scene = self.with_values(parameters, seed)
        with Session(scene, scripted=self._scripted) as session:
            steps = self._steps
            if steps is None:
                steps = round(float(scene["simulation"].get("duration", 1.0)) / session.time_step)
            session.step(steps)
            found = dict((self.measure or _measured)(session))
            return {**found, "hash": f"{session.hash:016x}"}


def _measured(session):
    import numpy as np

    away = np.linalg.norm(session.positions - session.rest_positions, axis=1)
    out = {"time": session.time, "pieces": session.counts["pieces"], "piece_masses": session.piece_masses[:16],
           "lowest": session.positions[:, 2].min(), "farthest": away.max(), "triangles": session.counts["visual_triangles"],
           "notes": len(session.notes)}
    return {**out, **(session.score or {})}


def _parsed(text, name):
    try:
        import tomllib
    except ImportError:  # Python 3.10
        import tomli as tomllib
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise Error(f"{name}: {error}") from None


def _place_files(scene, folder):
    """Files are named by themselves: the scene is a dict from here on, and has no folder."""
    body = scene.get("body")
    for table in body if isinstance(body, list) else [body]:
        for key in ("visual", "collision", "bound"):
            if isinstance(table, dict) and isinstance(table.get(key), str) and folder and (Path(folder) / table[key]).exists():
                table[key] = str((Path(folder) / table[key]).resolve())


def _copied(value):
    """Dicts and lists anew, and what is in them as it is."""
    if isinstance(value, dict):
        return {key: _copied(item) for key, item in value.items()}
    return [_copied(item) for item in value] if isinstance(value, list) else value


def _set(scene, name, value):
    *way, last = name.split(".")
    at = scene
    for word in way:
        if isinstance(at, dict):
            at = at.setdefault(word, {})
        else:
            at = _item(at, word, name)
    if isinstance(at, dict):
        at[last] = value
    elif isinstance(at, list):
        _item(at, last, name)
        at[int(last)] = value
    else:
        raise Error(f"{name}: the scene has no such key; there is a {type(at).__name__} on the way")


def _item(at, word, name):
    if not isinstance(at, list):
        raise Error(f"{name}: the scene has no such key; there is a {type(at).__name__} on the way")
    if not word.isdecimal() or int(word) >= len(at):
        raise Error(f"{name}: {word} is none of the {len(at)} numbers from 0 that there are")
    return at[int(word)]
