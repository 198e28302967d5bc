"""Where the rows of a sweep go: a Parquet dataset, and a journal of what is not yet in it.

A folder holds rows-000000.parquet and so on, _sweep.json (what is swept), _journal.jsonl and _lock: readers of datasets pass over names with _.
Each row goes to the journal at once, and many together from there into the next file. Whenever the writer is killed, every row that add()
returned for is there, and once.
"""

from __future__ import annotations

import fcntl
import json
import os
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .._error import Error

if TYPE_CHECKING:
    import pyarrow

try:
    import numpy as np
    import pyarrow as pa
    import pyarrow.parquet as pq
except ImportError as error:
    raise ImportError("kerf.sweep needs pyarrow: pip install ray pyarrow tqdm") from error

__all__ = ["Store", "read"]

MOST_ROWS, MOST_BYTES = 10_000, 32 << 20  # of the journal, before it becomes a file of the dataset
BETWEEN_SYNCS = 5.0  # s: what a power failure may cost
LAST = ("seconds", "tries", "host", "kerf", "error_kind", "error")  # columns behind all others
TYPES = {"row": pa.int64(), "seed": pa.int64(), "seconds": pa.float64(), "tries": pa.int32(), "host": pa.string(), "kerf": pa.string(),
         "error_kind": pa.string(), "error": pa.string()}


class Store:
    """The folder of one sweep, for the one who writes.

    head: what is swept; it must be the same when the sweep goes on. parameters: names of the values, in order. kerf.Error: the folder
    holds something else or another sweep, or another program writes to it.
    """

    def __init__(self, folder: str | os.PathLike[str], head: dict[str, Any], parameters: list[str], rows: int) -> None:
        self.folder, self._parameters = Path(folder), parameters
        self._make_folder()
        self._lock = open(self.folder / "_lock", "w")  # noqa: SIM115 (held as long as the store is)
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self._lock.close()
            raise Error(f"{self.folder}: another program is at work on this sweep") from None
        try:
            self._check_head(head)
            self.done, self.failed = np.zeros(rows, bool), 0
            self._read_parts()
            self._read_journal()
        except BaseException:
            self._lock.close()
            raise

    def _make_folder(self) -> None:
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            strange = not (self.folder / "_sweep.json").exists() and any(path.name != "_lock" for path in self.folder.iterdir())
        except OSError as error:
            raise Error(f"{self.folder}: {error.strerror or error}") from None
        if strange:
            raise Error(f"{self.folder}: holds something else than a sweep; name a new or an empty folder")

    def _check_head(self, head: dict[str, Any]) -> None:
        path = self.folder / "_sweep.json"
        if not path.exists():
            _replace(path, (json.dumps({"sweep": 1, **head}, indent=1) + "\n").encode())
            return
        try:
            found = json.loads(path.read_text())
        except ValueError as error:
            raise Error(f"{path}: {error}") from None
        for key, value in head.items():
            if found.get(key) != value:
                raise Error(f"{self.folder}: holds another sweep, whose {key} is {found.get(key)!r} and not {value!r}; name another folder")

    def _read_parts(self) -> None:
        for path in self.folder.glob(".rows-*.tmp"):
            path.unlink()
        self._parts = _parts(self.folder)
        for path in self._parts:
            table = pq.read_table(path, columns=["row", "error"])
            self.done[table["row"].to_numpy()] = True
            self.failed += len(table) - table["error"].null_count

    def _read_journal(self) -> None:
        path = self.folder / "_journal.jsonl"
        self._journal = open(path, "a+b", buffering=0)  # noqa: SIM115 (held as long as the store is)
        self._rows, whole = _journaled(path)
        self._journal.truncate(whole)
        self._rows = [row for row in self._rows if not self.done[row["row"]]]  # those of a file that was finished and a journal that was not emptied
        for row in self._rows:
            self.done[row["row"]] = True
            self.failed += row.get("error") is not None
        self._bytes, self._synced = whole, time.monotonic()

    def forget_failed(self) -> None:
        """Takes out the rows with an error, so that they are tried again."""
        self._flush()
        for path in self._parts:
            table = pq.read_table(path)
            good = table["error"].is_null()
            if table["error"].null_count == len(table):
                continue
            self.done[table.filter(_not(good))["row"].to_numpy()] = False
            _write(table.filter(good), path)
        self.failed = 0

    def add(self, rows: list[dict[str, Any]]) -> None:
        """Rows that are done: in the journal when this returns. One that is there already is left out."""
        new = []
        for row in rows:
            if not self.done[row["row"]]:
                self.done[row["row"]] = True
                self.failed += row.get("error") is not None
                new.append(row)
        if not new:
            return
        text = "".join(json.dumps(row) + "\n" for row in new).encode()
        view = memoryview(text)
        while view:
            view = view[self._journal.write(view):]
        self._rows += new
        self._bytes += len(text)
        if time.monotonic() - self._synced > BETWEEN_SYNCS:
            os.fsync(self._journal.fileno())
            self._synced = time.monotonic()
        if len(self._rows) >= MOST_ROWS or self._bytes >= MOST_BYTES:
            self._flush()

    def close(self) -> None:
        """Puts what is in the journal into the dataset, and makes all files have the same columns. Twice does nothing."""
        if self._lock.closed:
            return
        try:
            self._flush()
            self._parts = _parts(self.folder)  # one that _flush() wrote before Ctrl-C may not be listed
            _make_alike(self._parts, self._parameters)
        finally:
            self._journal.close()
            self._lock.close()

    def _flush(self) -> None:
        if self._rows:
            number = int(self._parts[-1].stem.split("-")[1]) + 1 if self._parts else 0
            path = self.folder / f"rows-{number:06d}.parquet"
            _write(_table(self._rows, self._parameters), path)
            self._rows = []  # first: Ctrl-C may come between any two lines, and close() writes what is here into the next file
            self._parts.append(path)
        self._journal.truncate(0)
        self._bytes = 0


def read(folder: str | os.PathLike[str]) -> pyarrow.Table:
    """All rows of a sweep so far, by their number, also while it goes on: a pyarrow.Table.

    Columns: row (its number), seed; the values; what the function returned; seconds that it took; tries; host; kerf (version); error_kind
    ("raised", "time", "died") and error, both null where all went well. table.to_pandas() and table.to_pylist() need no more.
    kerf.Error: there is no such sweep.
    """
    path = Path(folder)
    try:
        names = json.loads((path / "_sweep.json").read_text()).get("parameters", [])
    except (OSError, ValueError):
        raise Error(f"{path}: is no folder of a sweep") from None
    rows, _ = _journaled(path / "_journal.jsonl")  # first: meanwhile they may go on to a file, but never back
    tables = [pq.read_table(part) for part in _parts(path)]
    if rows:
        tables.append(_table(rows, names))
    if not tables:
        return _table([], names)
    schema = _common([table.schema for table in tables], names)
    whole = pa.concat_tables([_cast(table, schema) for table in tables]).sort_by("row")
    numbers = whole["row"].to_numpy()
    return whole.filter(pa.array(np.diff(numbers, prepend=-1) > 0))


def _parts(folder):
    return sorted(folder.glob("rows-*.parquet"))


def _journaled(path):
    """(rows, length in bytes) of what is whole in a journal."""
    try:
        text = path.read_bytes()
    except FileNotFoundError:
        return [], 0
    rows, whole = [], 0
    for line in text.splitlines(keepends=True):
        if not line.endswith(b"\n"):
            break
        try:
            rows.append(json.loads(line))
        except ValueError:
            break
        whole += len(line)
    return rows, whole


def _not(mask):
    import pyarrow.compute as pc

    return pc.invert(mask)


# --- Tables ---


def _table(rows, parameters):
    names = dict.fromkeys(["row", "seed", *parameters])
    for row in rows:
        names.update(dict.fromkeys(name for name in row if name not in LAST))
    columns = {name: _column([row.get(name) for row in rows], TYPES.get(name)) for name in [*names, *LAST]}
    return pa.table(columns)


def _column(values, kind):
    try:
        return pa.array(values, kind)
    except UnicodeEncodeError:  # texts with bytes that are not UTF-8, as names of files have them
        return _column(_with_utf8(values), kind)
    except (pa.ArrowInvalid, pa.ArrowTypeError, OverflowError):  # a column of several kinds of things
        return _column([None if value is None else value if isinstance(value, str) else json.dumps(value) for value in values], pa.string())


def _with_utf8(value):
    if isinstance(value, str):
        return value.encode(errors="backslashreplace").decode()
    return [_with_utf8(item) for item in value] if isinstance(value, list) else value


def _common(schemas, parameters):
    """One schema that holds all of these."""
    names = dict.fromkeys(["row", "seed", *parameters])
    for schema in schemas:
        names.update(dict.fromkeys(name for name in schema.names if name not in LAST))
    fields = []
    for name in [*names, *LAST]:
        kinds = [schema.field(name) for schema in schemas if name in schema.names]
        try:
            one = pa.unify_schemas([pa.schema([kind]) for kind in kinds], promote_options="permissive") if kinds else pa.schema([(name, pa.null())])
            fields.append(one.field(0))
        except (pa.ArrowInvalid, pa.ArrowTypeError):
            fields.append(pa.field(name, pa.string()))
    return pa.schema(fields)


def _cast(table, schema):
    columns = []
    for field in schema:
        if field.name not in table.column_names:
            columns.append(pa.nulls(len(table), field.type))
            continue
        column = table[field.name]
        if field.type == pa.string() and column.type not in (field.type, pa.null()):
            column = pa.array([None if value is None else json.dumps(value) for value in column.to_pylist()], pa.string())
        # Beside fractions, whole numbers beyond 2^53 lose their last digits.
        columns.append(column.cast(field.type, safe=False) if column.type != field.type else column)
    return pa.table(columns, schema=schema)


def _make_alike(parts, parameters):
    schemas = [pq.read_schema(part) for part in parts]
    if not schemas:
        return
    schema = _common(schemas, parameters)
    for part, own in zip(parts, schemas, strict=True):
        if not own.equals(schema):
            _write(_cast(pq.read_table(part), schema), part)


# --- Files that appear whole or not at all ---


def _write(table, path):
    beside = path.with_name(f".{path.name}.tmp")
    with open(beside, "wb") as file:
        pq.write_table(table, file, compression="zstd")
        file.flush()
        os.fsync(file.fileno())
    os.replace(beside, path)
    _sync_folder(path.parent)


def _replace(path, content):
    beside = path.with_name(f".{path.name}.tmp")
    with open(beside, "wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    os.replace(beside, path)
    _sync_folder(path.parent)


def _sync_folder(folder):
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
