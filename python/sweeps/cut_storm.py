"""Random cuts as a verification job: the tests' storm, of as many seeds as there are machines for. It needs kerf[test].

    python -m kerf.sweep cut_storm.toml --out storm --seeds 100
    python cut_storm.py storm                 # what is wrong, and how to repeat it
"""

import collections
import sys


def storm(parameters, seed):
    """What is wrong with one set of strokes: sentences, and their sorts."""
    import test_cuts_judged as judged  # of python/tests: it comes along

    case = judged.case_of(parameters["way"], parameters["body"], seed)
    wrong = judged.trial(case)
    sorts = sorted({judged.sort_of(text) for text in wrong})
    session = judged.flat(case.body, case.way != "rest").session
    return {"kind": case.kind, "poses": case.poses, "strokes": len(case.strokes), "pieces": session.counts["pieces"], "wrong": wrong, "sorts": sorts,
            "fails": any(sort not in judged.TOLERATED for sort in sorts), "hash": f"{session.hash:016x}"}


def main(folder):
    import kerf.sweep

    rows = kerf.sweep.read(folder).to_pylist()
    done = [row for row in rows if row["error"] is None]
    print(f"{len(rows)} sets, {sum(row['seconds'] or 0 for row in rows):.0f} s in all: {dict(collections.Counter(sort for row in done for sort in row['sorts']))}")
    for row in rows:
        if row["error"] or row["fails"]:
            print(f"trial(case_of({row['way']!r}, {row['body']!r}, {row['seed']}))  # {row['error'] or '; '.join(row['wrong'])}")
    return any(row["error"] or row["fails"] for row in rows)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
