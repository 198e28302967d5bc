"""What a sweep tries: rows in a fixed order, each made when it is asked for."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import zlib
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from .. import _arguments

__all__ = ["Plan", "Row", "is_utf8", "plain"]

RESERVED = ("row", "seed", "seconds", "tries", "host", "kerf", "error_kind", "error")  # columns of every sweep

KINDS = {"uniform": 2, "log_uniform": 2, "normal": 2, "integers": 2, "choice": None}  # of random values: how many numbers each takes


class Row(NamedTuple):
    """One row: its number, its values by name, its seed."""

    number: int
    parameters: dict[str, Any]
    seed: int


def plain(value: Any, name: str) -> Any:
    """A value as a table and JSON can have it: None, truth values, numbers, texts and lists of these. TypeError: it is something else."""
    if value is None or isinstance(value, (bool, str)):
        return value
    if hasattr(value, "dtype") and hasattr(value, "tolist"):
        return plain(value.tolist(), name)
    if isinstance(value, int):
        return int(value)
    if isinstance(value, float):
        return float(value)
    if isinstance(value, (list, tuple)):
        return [plain(item, name) for item in value]
    raise TypeError(f"{name} must be made of numbers, texts and lists, not of {type(value).__name__}")


def is_utf8(text: str) -> bool:
    """Has it bytes that are UTF-8, as the name of a column must? That of a file may have others."""
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


class Plan(Sequence[Row]):
    """The rows of a sweep. A plan of a million rows takes no more memory than one of ten.

    grid: {name: values}; every combination is tried. Or rows: a list of dicts {name: value}, each as it stands.
    random: {name: {kind: numbers}}: "uniform", "log_uniform" [least, most]; "normal" [mean, deviation]; "integers" [least, most], both
    included; "choice": a list. A value is drawn by the seed of its row and its name alone: all combinations of a grid see the same draws.
    seeds: 0 to n - 1 for a whole number n, or a list of whole numbers, 0 or more. Each combination is tried with each seed.
    Rows are numbered from 0; the seed runs fastest, then the last name of the grid.
    TypeError, ValueError: names or values that can't be.
    """

    def __init__(self, grid: Mapping[str, Iterable[Any]] | None = None, *, rows: Iterable[Mapping[str, Any]] | None = None,
                 random: Mapping[str, Mapping[str, Any]] | None = None, seeds: int | Iterable[int] = 1) -> None:
        if grid is not None and rows is not None:
            raise ValueError("a plan has a grid or rows, not both")
        self._grid = {_name(name): _values(values, name) for name, values in (grid or {}).items()}
        self._rows = None if rows is None else [_row(row) for row in rows]
        self._random = {_name(name): _distribution(name, given) for name, given in (random or {}).items()}
        self._seeds = _seeds(seeds)
        twice = set(self._random) & (set(self._grid) | {name for row in self._rows or () for name in row})
        if twice:
            raise ValueError(f"{', '.join(sorted(twice))} can't be both random and given")
        self._sizes = [len(values) for values in self._grid.values()]
        self._length = (math.prod(self._sizes) if self._rows is None else len(self._rows)) * len(self._seeds)

    @property
    def names(self) -> list[str]:
        """Names of the values, in the order of columns."""
        given = self._grid if self._rows is None else dict.fromkeys(itertools.chain.from_iterable(self._rows))
        return [*given, *self._random]

    @property
    def fingerprint(self) -> str:
        """A number in hexadecimal that differs where any row does."""
        seeds = [self._seeds.start, self._seeds.stop] if isinstance(self._seeds, range) else {"list": self._seeds}
        whole = [list(self._grid.items()), self._rows, list(self._random.items()), seeds]
        return hashlib.sha256(json.dumps(whole).encode()).hexdigest()[:16]

    def __len__(self) -> int:
        return self._length

    def __getitem__(self, number: Any) -> Any:
        if isinstance(number, slice):
            return [self[i] for i in range(*number.indices(len(self)))]
        at = _arguments.index(number, "a row")
        if not -len(self) <= at < len(self):
            raise IndexError(f"the plan has no row {at}; there are {len(self)}")
        at %= len(self)
        rest, seed = divmod(at, len(self._seeds))
        if self._rows is not None:
            parameters = dict(self._rows[rest])
        else:
            parameters, places = {}, []
            for size in reversed(self._sizes):
                rest, place = divmod(rest, size)
                places.append(place)
            for (name, values), place in zip(self._grid.items(), reversed(places)):
                parameters[name] = values[place]
        seed = self._seeds[seed]
        parameters.update({name: _drawn(name, kind, numbers, seed) for name, (kind, numbers) in self._random.items()})
        return Row(at, parameters, seed)

    def __repr__(self) -> str:
        return f"<kerf.sweep.Plan of {len(self)} rows: {', '.join(self.names) or 'seeds'}>"


def _name(name):
    if not isinstance(name, str):
        raise TypeError(f"names of values are text, not {type(name).__name__}")
    if not name or name in RESERVED:
        raise ValueError(f"{name!r} can't be the name of a value; every sweep has the columns {', '.join(RESERVED)}")
    if not is_utf8(name):
        raise ValueError(f"{name!a} can't be the name of a value: it is not UTF-8; give another name")
    return name


def _values(values, name):
    if isinstance(values, (str, bytes, Mapping)) or not isinstance(values, Iterable):
        raise TypeError(f"values of {name} must be a list, not {type(values).__name__}")
    found = [plain(value, name) for value in values]
    if not found:
        raise ValueError(f"{name} has no values")
    return found


def _row(row):
    if not isinstance(row, Mapping):
        raise TypeError(f"a row is a dict, not {type(row).__name__}")
    return {_name(name): plain(value, name) for name, value in row.items()}


def _seeds(seeds):
    if isinstance(seeds, Iterable) and not isinstance(seeds, (str, bytes)):
        found = seeds if isinstance(seeds, range) and seeds.step == 1 and seeds.start >= 0 else [_arguments.whole(seed, "a seed", 0) for seed in seeds]
        if len(set(found)) != len(found):
            raise ValueError("a seed stands twice in the list")
    else:
        found = range(_arguments.whole(seeds, "seeds", 1))
    if not found:
        raise ValueError("there must be one seed or more")
    return found


def _distribution(name, given):
    if not isinstance(given, Mapping) or len(given) != 1 or next(iter(given)) not in KINDS:
        raise ValueError(f"{name} must be one of {', '.join(KINDS)} with its numbers, as {{'uniform': [0, 1]}}, not {given!r}")
    kind, numbers = next(iter(given.items()))
    numbers = _values(numbers, name)
    if KINDS[kind] is None:
        return kind, numbers
    if len(numbers) != KINDS[kind]:
        raise ValueError(f"{kind} of {name} takes {KINDS[kind]} numbers, not {len(numbers)}")
    if kind == "integers":
        low, high = (_arguments.whole(number, name, -math.inf) for number in numbers)
    else:
        low, high = (_arguments.number(number, name) for number in numbers)
    if not (math.isfinite(low) and math.isfinite(high)) or (kind == "log_uniform" and low <= 0) or (high < 0 if kind == "normal" else high < low):
        raise ValueError(f"{kind} of {name} can't be from {low!r} and {high!r}")
    return kind, [low, high]


def _drawn(name, kind, numbers, seed):
    import numpy as np

    random = np.random.default_rng([seed, zlib.crc32(name.encode())])
    if kind == "choice":
        return numbers[int(random.integers(len(numbers)))]
    low, high = numbers
    if kind == "integers":
        return int(random.integers(low, high, endpoint=True))
    if kind == "normal":
        return float(random.normal(low, high))
    return float(random.uniform(low, high) if kind == "uniform" else math.exp(random.uniform(math.log(low), math.log(high))))
