"""A strip under tension with a slit across its middle, beside the closed form of fracture mechanics.

    python -m kerf.sweep strip_compliance.toml --out results
    python strip_compliance.py results        # the table

A slit makes a strip more compliant by the energy that it would release on growing. With the stress intensity of a centre crack in a strip of
finite width, K = stress sqrt(pi a sec(pi a / width)) (C. E. Feddersen, ASTM STP 410, 1966), dC/da = 4 t K^2 / (young P^2).
"""

import math
import sys

import numpy as np

import kerf

LONG, WIDE, THICK = 0.12, 0.04, 0.004  # m
GAUGE = 0.07  # m: the length that stretches is measured between these, far from where the strip is held and pulled
STRAIN = 0.002  # without a slit
CELLS = (60, 20, 2)


def strip():
    """Vertices and triangles of a closed strip, in metres."""
    x, y = np.linspace(-LONG / 2, LONG / 2, 61), np.linspace(-WIDE / 2, WIDE / 2, 21)
    n, m = len(x), len(y)
    plane = np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)
    at = np.arange(n * m).reshape(n, m)
    a, b, c, d = at[:-1, :-1].ravel(), at[1:, :-1].ravel(), at[1:, 1:].ravel(), at[:-1, 1:].ravel()
    top = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    rim = np.concatenate([at[:, 0], at[-1, 1:], at[-2::-1, -1], at[0, -2::-1]])
    i, j = rim[:-1], rim[1:]
    walls = np.concatenate([np.stack([i, i + n * m, j + n * m], 1), np.stack([i, j + n * m, j], 1)])
    half = np.full((n * m, 1), THICK / 2)
    return np.concatenate([np.hstack([plane, half]), np.hstack([plane, -half])]), np.concatenate([top, top[:, ::-1] + n * m, walls])


def compliance(parameters, seed):
    """Metres that the gauge length grows for each newton, and its part that the slit makes by the closed form."""
    young, a = parameters["young"], parameters["slit"] * WIDE / 2
    pull = STRAIN * young * WIDE * THICK
    places = np.linspace(-WIDE / 2, WIDE / 2, 11)
    shares = np.where(np.abs(places) == WIDE / 2, 0.5, 1) / 10
    scene = {"body": {"bound": kerf.bind(*strip(), collision_triangles=1200)}, "lattice": {"cells": CELLS, "axes": np.eye(3)},
             "material": {"young": young, "poisson": 0.3, "density": young / 1e4, "damping_mass": 2.0},  # the same waves at each stiffness
             "simulation": {"time_step": 0.05, "gravity": [0, 0, 0], "tolerance": 1e-6, "threads": 1},
             "fix": [{"half_space": {"point": [-LONG / 2 + 1e-4, 0, 0], "normal": [-1, 0, 0]}}],
             "load": [{"point": [LONG / 2, y, 0], "force": [pull * share, 0, 0]} for y, share in zip(places, shares)]}
    with kerf.Session(scene) as session:
        if a:
            session.cut([[[0, y, 0.1], [0, y, -0.1]] for y in np.linspace(-a, a, 9)])
        across = np.linspace(-0.45, 0.45, 19) * WIDE
        ends = [np.stack([np.full(19, side * GAUGE / 2), across, np.zeros(19)], 1) for side in (-1, 1)]
        grown = math.inf
        for _ in range(60):
            before = grown
            session.step(10)
            grown = float(np.mean(session.to_world(ends[1])[:, 0] - session.to_world(ends[0])[:, 0])) - GAUGE
            if abs(grown - before) < 1e-5 * abs(grown):
                break
        return {"compliance": grown / pull, "relative": grown / (STRAIN * GAUGE), "closed_form": 1 + by_slit(a) / GAUGE,
                "steps": session.steps, "nodes": session.counts["nodes"], "pieces": session.counts["pieces"], "hash": f"{session.hash:016x}"}


def by_slit(a):
    """Compliance that a slit of length 2 a adds, times young, width and thickness: metres."""
    s = np.linspace(0, a, 2001)
    f = s / np.cos(np.pi * s / WIDE)
    return 4 * math.pi / WIDE * float(np.sum((f[1:] + f[:-1]) / 2 * np.diff(s)))


def main(folder):
    import kerf.sweep

    rows = [row for row in kerf.sweep.read(folder).to_pylist() if row["error"] is None]
    uncut = {row["young"]: row["relative"] for row in rows if row["slit"] == 0}
    print("| slit, of the width | " + " | ".join(f"{young:g} Pa" for young in sorted(uncut)) + " | closed form |\n|" + "---|" * (len(uncut) + 2))
    for slit in sorted({row["slit"] for row in rows}):
        of = {row["young"]: row for row in rows if row["slit"] == slit}
        print(f"| {slit:g} | " + " | ".join(f"{of[young]['relative'] / uncut[young]:.4f}" for young in sorted(of)) + f" | {next(iter(of.values()))['closed_form']:.4f} |")


if __name__ == "__main__":
    main(sys.argv[1])
