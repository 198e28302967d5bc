"""What Kerf writes, Kerf reads: random cut bodies are written in each format and bound again. Judged by numpy: parts, area, volume, borders, holes.

KERF_FUZZ_SECONDS=n in the environment: so long, KERF_FUZZ_SEED=s from another seed. 30 bodies take 25 s.
"""

import collections
import math
import os
import random
import struct
import time

import numpy as np
import pytest

import kerf

SLAB, SHEET = 0.006, 0.002  # m: thickness


# --- Bodies ---


def grid(nx, ny, width, height, lift):
    x, y = np.meshgrid(np.linspace(-width / 2, width / 2, nx + 1), np.linspace(-height / 2, height / 2, ny + 1), indexing="ij")
    at = np.arange(x.size).reshape(x.shape)
    a, b, c, d = at[:-1, :-1].ravel(), at[1:, :-1].ravel(), at[1:, 1:].ravel(), at[:-1, 1:].ravel()
    return np.stack([x, y, lift(x, y)], -1).reshape(-1, 3), np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def thickened(points, triangles):
    up, n = [0, 0, SLAB / 2], len(points)
    edges = {(t[i], t[(i + 1) % 3]) for t in triangles.tolist() for i in range(3)}
    side = [row for a, b in sorted(edges) if (b, a) not in edges for row in ([b, a, a + n], [b, a + n, b + n])]
    return np.concatenate([points + up, points - up]), np.concatenate([triangles, triangles[:, ::-1] + n, np.array(side)])


BODIES = {
    "plate": ((0.12, 0.08), None, lambda: kerf.bind(*thickened(*grid(12, 8, 0.12, 0.08, lambda x, y: 0 * x)))),
    "bent plate": ((0.12, 0.09), None, lambda: kerf.bind(*thickened(*grid(20, 14, 0.12, 0.09, lambda x, y: 3 * x * x)))),
    "sheet": ((0.12, 0.10), SHEET, lambda: kerf.bind(*grid(13, 11, 0.12, 0.10, lambda x, y: 0 * x), thickness=SHEET)),
    "wavy sheet": ((0.12, 0.12), SHEET, lambda: kerf.bind(*grid(16, 16, 0.12, 0.12, lambda x, y: 0.006 * np.sin(40 * x) * np.cos(30 * y)), thickness=SHEET)),
    "steak": ((0.20, 0.14), None, lambda: kerf.bind("steak")),
}


# --- Cuts ---


def cut_once(session, chance, width, height):
    kind = chance.choice(["through", "slit", "inner", "zigzag", "punch"])
    if kind == "punch":
        session.punch([chance.uniform(-0.3, 0.3) * width, chance.uniform(-0.3, 0.3) * height, 0], chance.uniform(0.004, 0.01),
                      take=chance.random() < 0.5, frame="rest")
        return
    turn, far = chance.uniform(0, 2 * math.pi), 2 * max(width, height)
    middle = np.array([chance.uniform(-0.25, 0.25) * width, chance.uniform(-0.25, 0.25) * height])
    along = np.array([math.cos(turn), math.sin(turn)])
    aside = np.array([-along[1], along[0]])
    ends = {"through": (-far, far), "slit": (-far, 0), "inner": (-0.2 * height, 0.2 * height)}
    if kind == "zigzag":
        n = chance.randint(3, 6)
        way = [middle + (0.7 * i / n - 0.35) * height * along + chance.uniform(-0.08, 0.08) * height * aside for i in range(n + 1)]
    else:
        way = [middle + s * along for s in ends[kind]]
    session.cut([[[x, y, 0.03], [x, y, -0.03]] for x, y in way], "rest")


# --- Files ---


def write(path, points, triangles):
    kind = path.suffix
    if kind == ".obj":
        path.write_text("".join("v %.17g %.17g %.17g\n" % tuple(p) for p in points) + "".join("f %d %d %d\n" % tuple(t) for t in triangles + 1))
    elif kind == ".off":
        head = f"OFF\n{len(points)} {len(triangles)} 0\n"
        path.write_text(head + "".join("%.17g %.17g %.17g\n" % tuple(p) for p in points) + "".join("3 %d %d %d\n" % tuple(t) for t in triangles))
    elif kind == ".ply":
        head = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n" + "".join(f"property double {c}\n" for c in "xyz") +
                f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n")
        rows = np.zeros(len(triangles), [("n", "u1"), ("corners", "<i4", 3)])
        rows["n"], rows["corners"] = 3, triangles
        path.write_bytes(head.encode() + points.astype("<f8").tobytes() + rows.tobytes())
    else:
        rows = np.zeros(len(triangles), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])
        rows["corners"] = points[triangles]
        path.write_bytes(bytes(80) + struct.pack("<I", len(triangles)) + rows.tobytes())
    return path


# --- Judges ---


def parts_of(points, triangles):
    """Points and triangles of each part, largest first: joined by shared vertices."""
    label = np.arange(len(points))
    while True:
        least = label.copy()
        np.minimum.at(least, triangles.ravel(), np.repeat(label[triangles].min(1), 3))
        least = least[least]
        if (least == label).all():
            break
        label = least
    parts = []
    for part in np.unique(label[triangles[:, 0]]):
        mine = triangles[label[triangles[:, 0]] == part]
        used = np.unique(mine)
        parts.append((points[used], np.searchsorted(used, mine)))
    return sorted(parts, key=lambda p: -len(p[1]))


Measures = collections.namedtuple("Measures", "area volume euler border")


def measures(points, triangles):
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    sides = np.sort(np.concatenate([triangles[:, :2], triangles[:, 1:], triangles[:, ::2]]), axis=1)
    edges, count = np.unique(sides, axis=0, return_counts=True)
    open_ends = points[edges[count == 1]]
    return Measures(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2, np.einsum("ij,ij->", a, np.cross(b, c)) / 6,
                    len(np.unique(triangles)) - len(edges) + len(triangles), np.linalg.norm(open_ends[:, 0] - open_ends[:, 1], axis=1).sum())


def middle_of(session, points):
    """The part of the session's mid-surface that lies in these."""
    middles = parts_of(np.asarray(session.collision_rest_positions), np.asarray(session.collision_triangles))
    return min(middles, key=lambda part: np.mean([np.linalg.norm(points - p, axis=1).min() for p in part[0]]))


class Storm:
    def __init__(self, folder):
        self.folder, self.bodies = folder, {}
        self.counts = collections.Counter()

    def life(self, seed):
        """One body that is cut one to four times."""
        chance = random.Random(seed)
        name = list(BODIES)[seed % len(BODIES)]
        (width, height), thickness, make = BODIES[name]
        if name not in self.bodies:
            self.bodies[name] = make()
        session = kerf.Session(self.bodies[name])
        for _ in range(chance.randint(1, 4)):
            try:
                cut_once(session, chance, width, height)
            except kerf.Error as refused:  # a punch beside the body
                assert "punch" in str(refused)
        kind = chance.choice([".obj", ".ply", ".off"] + [".stl"] * (thickness is None))  # an STL sheet loses its cuts: docs/binding.md
        points, triangles = np.asarray(session.rest_positions), np.asarray(session.triangles)
        parts = parts_of(points, triangles)
        if len(parts) > 1:
            with pytest.raises(kerf.Error, match=f" {len(parts)} separate bodies"):
                kerf.bind(write(self.folder / f"all{kind}", points, triangles), thickness=thickness)
            self.counts["whole files"] += 1
        for part in parts[:3]:
            self.bind(session, f"{seed}: {name}{kind}", part, kind, thickness)

    def bind(self, session, what, part, kind, thickness):
        file = write(self.folder / f"part{kind}", *part)
        slits = len(part[0]) - len(np.unique(part[0], axis=0))
        try:
            body = kerf.bind(file, thickness=thickness)
            self.counts["slit" if slits else "plain"] += 1
        except kerf.Error:
            self.counts["refused"] += 1
            if thickness is not None:
                raise
            try:
                body = kerf.bind(file, collision=middle_of(session, part[0]))
            except kerf.Error:
                self.counts["refused with its mid-surface"] += 1
                return
        near = 1e-4 if kind == ".stl" else 1e-6
        got, want = measures(body.vertices, body.triangles), measures(*part)
        assert len(parts_of(body.vertices, body.triangles)) == 1, what
        assert got.euler == want.euler, f"{what}: {got}, {want}"
        assert got.area == pytest.approx(want.area, rel=near), what
        assert got.border == pytest.approx(want.border, rel=near, abs=1e-12), what
        if thickness is None:
            assert body.closed and got.volume == pytest.approx(want.volume, rel=near), what


def test_cut_bodies_come_back(tmp_path):
    storm = Storm(tmp_path)
    seconds, first = os.environ.get("KERF_FUZZ_SECONDS"), int(os.environ.get("KERF_FUZZ_SEED", 1))
    end, seed = time.monotonic() + float(seconds or 0), first
    while time.monotonic() < end if seconds else seed < first + 30:
        storm.life(seed)
        seed += 1
    print(f"\n{seed - first} bodies: " + ", ".join(f"{n} {what}" for what, n in storm.counts.most_common()))
    bound = storm.counts["slit"] + storm.counts["plain"]
    assert storm.counts["slit"] >= 0.2 * bound and storm.counts["whole files"] > 0
    assert storm.counts["refused"] <= 0.2 * bound and storm.counts["refused with its mid-surface"] <= 0.08 * bound
