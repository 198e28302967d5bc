"""What the extension needs of the processor: it is built for x86-64-v3, and anything less would die of an illegal instruction."""

import os

_NEEDED = {"abm", "avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "movbe"}


def missing(cpuinfo="/proc/cpuinfo"):
    """What the processor lacks, sorted; nothing where that can't be told."""
    if os.uname().machine != "x86_64":
        return []
    try:
        with open(cpuinfo, encoding="ascii", errors="replace") as lines:
            for line in lines:
                if line.startswith("flags"):
                    return sorted(_NEEDED - set(line.split()))
    except OSError:
        pass
    return []


def check():
    lacking = missing()
    if lacking:
        raise ImportError(
            f"kerf is built for processors with x86-64-v3 (2013 and newer); this one lacks {', '.join(lacking)}")
