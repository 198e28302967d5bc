"""Whether so many copies of a task fit into memory."""

from __future__ import annotations

import os
from pathlib import Path

FIRST = 8  # copies that are made before the first look


def _figure(file: str, word: str = "") -> float:
    """The number after this word of a file of the system, in its unit; inf: it says none."""
    try:
        for line in Path(file).read_text().splitlines():
            if line.startswith(word):
                return float(line[len(word):].split()[0])
    except (OSError, ValueError, IndexError):
        pass
    return float("inf")


def free_bytes() -> float:
    """What this process may still use, of the machine or of its control group; inf: the system does not say."""
    limit, used = _figure("/sys/fs/cgroup/memory.max"), _figure("/sys/fs/cgroup/memory.stat", "anon ")
    return min(1024 * _figure("/proc/meminfo", "MemAvailable:"), max(0.0, limit - used) if used < float("inf") else limit)


def used_bytes() -> float:
    """What this process has in memory; inf: the system does not say."""
    try:
        return float(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError, IndexError):
        return float("inf")


class Room:
    """Asked while copies are made: after 8, 16, 32 and so on it takes what they have used for what the others will use."""

    def __init__(self, wanted: int) -> None:
        self._wanted, self._began, self._next = wanted, used_bytes(), FIRST

    def check(self, made: int) -> None:
        """ValueError: the copies that are wanted will not fit."""
        if made < self._next or made >= self._wanted:
            return
        self._next *= 2
        each = (used_bytes() - self._began) / made
        fit = made + free_bytes() / each if 0 < each < float("inf") else float("inf")
        if fit < self._wanted:
            raise ValueError(f"num_envs must be {fit:.0f} at most here: of {self._wanted} copies each takes about {each / 1e6:.0f} MB, "
                             f"and {free_bytes() / 1e9:.1f} GB are free")
