"""What Kerf writes, Kerf reads: random cut bodies are written in each format and bound again. Judged by numpy: parts, area, volume, borders, holes.

KERF_FUZZ_SECONDS=n in the environment: so long, KERF_FUZZ_SEED=s from another seed. 30 bodies take 25 s.
"""

import collections
import math
import os
import random
import re
import struct
import subprocess
import time

import numpy as np
import pytest

import kerf
from kerf import _program

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
    """The part of the session's mid-surface that reaches as far as these."""

    def reach(p):
        return np.concatenate([p.min(0), p.max(0)])

    middles = parts_of(np.asarray(session.collision_rest_positions), np.asarray(session.collision_triangles))
    return min(middles, key=lambda middle: np.linalg.norm(reach(middle[0]) - reach(points)))


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


# --- Mangled meshes: what `kerf info` says of a file is what binding does with it ---


def hang_loose(chance, points, triangles):
    return points[triangles].reshape(-1, 3), np.arange(triangles.size).reshape(-1, 3)


def tremble(chance, points, triangles):
    """Corners that were one lie a little beside each other."""
    points, triangles = hang_loose(chance, points, triangles)
    size = np.ptp(points, axis=0).max() * 10 ** chance.uniform(-10, -3)
    return points + size * np.random.default_rng(chance.randrange(1 << 30)).uniform(-1, 1, points.shape), triangles


def leave_out(chance, points, triangles):
    return points, np.delete(triangles, [chance.randrange(len(triangles)) for _ in range(chance.choice([1, 1, 2, 9]))], axis=0)


def turn(chance, points, triangles):
    triangles = triangles.copy()
    which = slice(None) if chance.random() < 0.3 else [chance.randrange(len(triangles)) for _ in range(chance.choice([1, 3]))]
    triangles[which] = triangles[which][:, ::-1]
    return points, triangles


def twice(chance, points, triangles):
    i = chance.randrange(len(triangles))
    again = triangles[i][chance.choice([[0, 1, 2], [1, 2, 0], [0, 2, 1]])]
    return points, np.concatenate([triangles, [again]])


def fin(chance, points, triangles):
    i = chance.randrange(len(triangles))
    return np.concatenate([points, [points[triangles[i]].mean(0) + [0, 0, 0.01]]]), np.concatenate([triangles, [[*triangles[i][:2], len(points)]]])


def no_area(chance, points, triangles):
    a, b, _ = triangles[chance.randrange(len(triangles))]
    if chance.random() < 0.5:
        return points, np.concatenate([triangles, [[a, b, b]]])
    return np.concatenate([points, [(points[a] + points[b]) / 2]]), np.concatenate([triangles, [[a, b, len(points)]]])


def needle(chance, points, triangles):
    points = points.copy()
    a, b, _ = triangles[chance.randrange(len(triangles))]
    points[a] += (points[b] - points[a]) * (1 - 10 ** chance.uniform(-12, -1))
    return points, triangles


def another(chance, points, triangles):
    """A second body: away, touching in a face, an edge or a corner, at the same place, inside, or crossing."""
    size = np.ptp(points, axis=0)
    move = chance.choice([[2, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1], [0, 0, 0], [0, 0, 1], [0.31, 0.27, 0]])
    scale = chance.choice([1, 1, 0.4])
    return np.concatenate([points, scale * points + move * size]), np.concatenate([triangles, triangles + len(points)])


def unused(chance, points, triangles):
    return np.concatenate([points, [[chance.choice([0, 1, 1e3, 1e9])] * 3]]), triangles


def far(chance, points, triangles):
    return points + 10 ** chance.uniform(-1, 9), triangles


def other_size(chance, points, triangles):
    return points * 10 ** chance.uniform(-12, 12), triangles


MANGLERS = [hang_loose, tremble, tremble, leave_out, turn, twice, fin, no_area, needle, another, another, unused, far, other_size]


def judge(file, counts):
    """Words of `kerf info`, and of binding."""
    said = subprocess.run([_program.PROGRAM, "info", file], capture_output=True, text=True)
    assert said.returncode == 0, said.stderr
    unusable = re.findall(r"^unusable +(.*)$", said.stdout, re.M)
    repairs = re.findall(r"^(?:repair|warning) +(.*)$", said.stdout, re.M)
    try:
        body = kerf.bind(file, thickness=SHEET)
    except kerf.Error as refused:
        counts["refused"] += 1
        if unusable:
            counts["judged unusable"] += 1
            assert any(words in str(refused) for words in unusable), f"{file}: info: {unusable}; bind: {refused}"
        else:  # seen only by what comes after the judge
            counts[re.sub(r"[\d.e+-]+", "#", str(refused).split(": ", 1)[-1])[:40]] += 1
    else:
        counts["bound"] += 1
        assert not unusable, f"{file}: bound, but info says {unusable}"
        for words in repairs:
            assert any(words in note for note in body.notes), f"{file}: info: {words}; bind: {body.notes}"


def test_info_says_what_binding_does(tmp_path):
    first = int(os.environ.get("KERF_FUZZ_SEED", 1))
    counts = collections.Counter()
    seconds = os.environ.get("KERF_FUZZ_SECONDS")
    end, seed = time.monotonic() + float(seconds or 0), first
    while time.monotonic() < end if seconds else seed < first + 60:
        chance = random.Random(seed)
        flat = grid(6, 5, 0.12, 0.10, lambda x, y: 0 * x)
        points, triangles = flat if chance.random() < 0.3 else thickened(*flat)
        for _ in range(chance.choice([1, 1, 2, 3])):
            points, triangles = chance.choice(MANGLERS)(chance, points, triangles)
        judge(write(tmp_path / f"{seed}{chance.choice(['.obj', '.ply', '.off', '.stl'])}", points, triangles), counts)
        seed += 1
    print(f"\n{seed - first} meshes: " + ", ".join(f"{n} {what}" for what, n in counts.most_common()))
    assert counts["bound"] > 0.1 * (seed - first) and counts["judged unusable"] > 0.1 * (seed - first)
