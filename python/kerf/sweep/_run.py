"""Does the rows of a sweep: in this process, on this machine, or on a cluster, by Ray."""

from __future__ import annotations

import itertools
import logging
import math
import os
import signal
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

from .. import __version__, _arguments
from .._error import Error
from ._plan import Plan, Row
from ._scene import Scene
from ._store import Store
from ._work import code_of, do_row, lost_row, module_of, work

__all__ = ["Summary", "run"]

CHUNK_SECONDS, MOST_CHUNK = 1.0, 500  # how much one task of Ray gets: so long it should take, so many rows at most
BETWEEN_NEWS = 0.1  # s: rows that take less are told of together
MOST_NEWS = 500  # a second that this process takes in: from 50 processors on each tells of its rows less often
AHEAD = 2  # tasks for each processor that are with Ray at a time: none waits for this process, and a million rows need no more memory
LOOK = 0.25  # s: between looks at time limits
BETWEEN_COUNTS = 5.0  # s: between looks at how many processors the cluster has


@dataclass(frozen=True)
class Summary:
    """What came of a run. rows: of the sweep; done: in the folder; new: of those in this run; failed: with an error; seconds: of this run."""

    rows: int
    done: int
    new: int
    failed: int
    seconds: float
    folder: Path


def run(function: Callable[..., Mapping[str, Any]], plan: Plan | Iterable[Mapping[str, Any]], folder: str | os.PathLike[str], *,
        workers: int | None = None, address: str | None = None, shared: Mapping[str, Any] | None = None, time_limit: float | None = None,
        tries: int = 2, retry_errors: bool = False, progress: bool | None = None, title: str | None = None, cpus: float = 1.0,
        modules: Iterable[str | os.PathLike[str] | ModuleType] = ()) -> Summary:
    """Calls `function(parameters, seed, **shared)` for each row of a plan, and writes what it returns into a Parquet dataset.

    function: returns a dict of numbers, texts and lists of these; or a kerf.sweep.Scene. It comes to other processes by cloudpickle. What it raises
    is the error of its row. plan: a kerf.sweep.Plan, or a list of dicts, each with the values of one row.
    folder: of results, for kerf.sweep.read(); made where there is none. Where it holds this sweep in part, the rest is done; a driver that was
    killed has lost no row that was there, and none is there twice.
    workers: processes at once; by default one for each processor of the machine, or as many as a cluster has. 0: in this process,
    without Ray, and without time limits. address: of a Ray cluster, "auto" or "host:port"; by default the one that this process is connected
    to already, or a new one of this machine alone. cpus: processors that a row takes, above 0.
    shared: arguments that are the same for all rows, as bodies of kerf.bind(); each process gets them once.
    time_limit: seconds that a row may take; one that takes longer becomes an error row, and its process is ended. tries: how often a row is
    begun whose process or machine dies, before that is its error. retry_errors: rows that failed in an earlier run are done again.
    progress: a bar on stderr; by default where that is a terminal. title: kept with the sweep. modules: one's own, or files in Python, that the
    function's file imports: their text travels, each after those that it imports itself. The function's own file travels by itself.

    In the main thread, Ctrl-C and SIGTERM raise KeyboardInterrupt after all rows that are done are in the folder. kerf.Error: the folder holds another
    sweep or is in use, Ray can't be reached, or a machine of the cluster has another version of Kerf. TypeError, ValueError: arguments that can't be.
    """
    if not isinstance(plan, Plan):
        if isinstance(plan, (str, bytes, Mapping)) or not isinstance(plan, Iterable):
            raise TypeError(f"plan must be a kerf.sweep.Plan or a list of dicts, not {type(plan).__name__}")
        plan = Plan(rows=plan)
    if not callable(function):
        raise TypeError(f"function must be callable, not {type(function).__name__}")
    job = _Job(function, dict(shared or {}), plan, workers=None if workers is None else _arguments.whole(workers, "workers"), address=address,
               time_limit=math.inf if time_limit is None else _above_0(time_limit, "time_limit"), tries=_arguments.whole(tries, "tries", 1),
               cpus=_above_0(cpus, "cpus"), code=code_of([*modules, *module_of(function)]))
    if isinstance(function, Scene):
        function.bind(plan.names)
    head = {"title": title, "function": _name_of(function), "rows": len(plan), "plan": plan.fingerprint, "parameters": plan.names,
            "scene": function.fingerprint if isinstance(function, Scene) else None}
    began = time.monotonic()
    store = Store(folder, head, plan.names, len(plan))
    with _termination_as_interrupt():
        try:
            if _arguments.flag(retry_errors, "retry_errors"):
                store.forget_failed()
            before = int(store.done.sum())
            with _bar(len(plan), before, progress) as bar:
                job.do(store, bar)
        finally:
            store.close()
    done = int(store.done.sum())
    return Summary(len(plan), done, done - before, store.failed, time.monotonic() - began, Path(folder))


@dataclass
class _Flight:
    """A task of Ray on its way."""

    rows: deque[Row]  # that nothing has been heard of
    heard: float | None = None  # time when something was heard of it last; None: it has not begun


@dataclass
class _Job:
    function: Callable[..., Any]
    shared: dict[str, Any]
    plan: Plan
    workers: int | None
    address: str | None
    time_limit: float
    tries: int
    cpus: float
    code: list[tuple[str, str, str]]
    _begun: dict[int, int] = field(default_factory=dict)  # how often a row was begun alone whose process died
    _again: deque[Row] = field(default_factory=deque)  # rows to do by themselves
    _mean: float = math.inf  # seconds of a row; inf: none is known
    _pace: float = BETWEEN_NEWS  # s: between what a task tells

    def do(self, store: Store, bar: Any) -> None:
        todo = (self.plan[number] for number in range(len(self.plan)) if not store.done[number])
        if self.workers == 0:
            for row in todo:
                self._keep([do_row(self.function, self.shared, row)], store, bar)
        elif not store.done.all():
            with _ray(self) as ray:
                self._fly(ray, todo, store, bar)

    def _keep(self, rows: list[dict[str, Any]], store: Store, bar: Any) -> None:
        for row in rows:
            row.setdefault("tries", self._begun.pop(row["row"], 0) + 1)
        store.add(rows)
        bar.set_postfix(failed=store.failed, refresh=False)
        bar.update(len(rows))

    # --- With Ray ---

    def _fly(self, ray: Any, todo: Iterator[Row], store: Store, bar: Any) -> None:
        task = ray.remote(num_returns="streaming", num_cpus=self.cpus, max_retries=0)(work)
        held = [ray.put(self.code), ray.put((self.function, self.shared))]
        flights: dict[Any, _Flight] = {}
        counted, places = -math.inf, 1
        try:
            while True:
                now = time.monotonic()
                if now - counted > BETWEEN_COUNTS:
                    counted, places = now, self._places(ray)
                    self._pace = max(BETWEEN_NEWS, places / MOST_NEWS)
                while len(flights) < AHEAD * places:
                    rows = self._next(todo)
                    if not rows:
                        break
                    flights[task.remote(held[1].hex(), held, rows, self._pace)] = _Flight(deque(rows))
                if not flights:
                    return
                ready, _ = ray.wait(list(flights), num_returns=len(flights), timeout=0, fetch_local=False)
                if not ready:
                    ready, _ = ray.wait(list(flights), num_returns=1, timeout=LOOK, fetch_local=False)
                for news in ready:
                    if self._hear(ray, news, flights[news], store, bar):
                        del flights[news]
                for news in [news for news, flight in flights.items() if self._is_late(flight)]:
                    ray.cancel(news, force=True)
                    self._lose(flights.pop(news), "time", f"took longer than {self.time_limit:g} s", store, bar)
        finally:
            for news in flights:
                ray.cancel(news, force=True)

    def _places(self, ray: Any) -> int:
        there = int(ray.cluster_resources().get("CPU", 0) / self.cpus)
        return max(1, there if self.workers is None else min(self.workers, there))

    def _next(self, todo: Iterator[Row]) -> list[Row]:
        if self._again:
            return [self._again.popleft()]
        size = 1 if self._mean == math.inf else min(max(int(max(CHUNK_SECONDS, 2 * self._pace) / max(self._mean, 1e-6)), 1), MOST_CHUNK)
        return list(itertools.islice(todo, size))

    def _hear(self, ray: Any, news: Any, flight: _Flight, store: Store, bar: Any) -> bool:
        """Takes what a task has to tell. Is it over?"""
        try:
            rows = ray.get(next(news))
        except StopIteration:
            return True
        except ray.exceptions.RayTaskError as error:  # no row raises: the function or what is shared does not come out of its pickle
            raise Error(f"a worker can't begin: {error.cause!r}", "failed") from None
        except ray.exceptions.RayError as error:
            self._lose(flight, "died", _first_line(error), store, bar)
            return True
        flight.heard = time.monotonic()
        for row in rows:
            if row["kerf"] != __version__:
                raise Error(f"{row['host']} has version {row['kerf']} of Kerf and this machine {__version__}; the same bits need the same version", "failed")
            flight.rows.popleft()
            self._mean = row["seconds"] if self._mean == math.inf else 0.95 * self._mean + 0.05 * row["seconds"]
        self._keep(rows, store, bar)
        return False

    def _is_late(self, flight: _Flight) -> bool:
        return flight.heard is not None and bool(flight.rows) and time.monotonic() - flight.heard > self.time_limit + self._pace + LOOK

    def _lose(self, flight: _Flight, kind: str, why: str, store: Store, bar: Any) -> None:
        """A task is gone with rows in it. Which of several it was is not known: each is done again, alone."""
        if len(flight.rows) != 1:
            self._again.extend(flight.rows)
            return
        row = flight.rows[0]
        begun = self._begun[row.number] = self._begun.get(row.number, 0) + 1
        if kind == "died" and begun < self.tries:
            self._again.append(row)
            return
        seconds = None if flight.heard is None else time.monotonic() - flight.heard
        del self._begun[row.number]
        self._keep([lost_row(row, kind, why, seconds, begun)], store, bar)


class _ray:
    """`with`: Ray, connected. A cluster that this process was connected to stays; one that is made here goes."""

    def __init__(self, job: _Job) -> None:
        self._job, self._mine = job, False

    def __enter__(self) -> Any:
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # a run of one's own tells nobody of itself
        os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
        try:
            import ray
        except ImportError as error:
            raise ImportError("kerf.sweep needs Ray: pip install ray pyarrow tqdm, or give workers=0") from error
        job = self._job
        if ray.is_initialized():
            return ray
        options: dict[str, Any] = {"address": job.address} if job.address else {
            "address": "local", "num_cpus": math.ceil(job.workers * job.cpus) if job.workers else None, "include_dashboard": False}
        try:
            ray.init(**options, log_to_driver=False, logging_level=logging.ERROR)
        except Exception as error:  # Ray raises of every kind, also plain ones where a busy machine does not start in time
            raise Error(f"{f'there is no Ray at {job.address}' if job.address else 'Ray does not start'}: {_first_line(error)}", "failed") from None
        self._mine = True
        _interrupt_at_termination()  # in place of Ray's abort
        return ray

    def __exit__(self, *exception: object) -> None:
        if self._mine:
            import ray

            ray.shutdown()


@contextmanager
def _termination_as_interrupt() -> Iterator[None]:
    """SIGTERM, which batch systems send first, is as Ctrl-C. Signals come to the main thread alone."""
    before = signal.getsignal(signal.SIGTERM)
    _interrupt_at_termination()
    try:
        yield
    finally:
        if _in_main_thread():
            signal.signal(signal.SIGTERM, before or signal.SIG_DFL)


def _interrupt_at_termination():
    if _in_main_thread():
        signal.signal(signal.SIGTERM, signal.default_int_handler)


def _in_main_thread():
    return threading.current_thread() is threading.main_thread()


def _bar(total, done, wanted):
    if wanted is None:
        wanted = sys.stderr.isatty()
    try:
        from tqdm import tqdm
    except ImportError:
        if wanted:
            raise ImportError("the bar of kerf.sweep needs tqdm: pip install tqdm, or give progress=False") from None
        return _NoBar()
    return tqdm(total=total, initial=done, unit="row", disable=not wanted, smoothing=0.05, dynamic_ncols=True)


class _NoBar:
    def __enter__(self):
        return self

    def __exit__(self, *exception):
        pass

    def update(self, rows):
        pass

    def set_postfix(self, **words):
        pass


def _above_0(given, name):
    number = _arguments.number(given, name)
    if not (number > 0 and math.isfinite(number)):
        raise ValueError(f"{name} must be finite and above 0, not {number}")
    return number


def _name_of(function):
    return getattr(function, "__qualname__", None) or repr(function)


def _first_line(error):
    return next((line.strip() for line in str(error).splitlines() if line.strip()), type(error).__name__)
