#!/usr/bin/env python3
"""The numbers that tests/session/notched_plate_test.cpp compares with, from CalculiX (ccx, Debian package calculix-ccx).

A plate of 10 x 10 x 1, Young's modulus 1, Poisson's ratio 0.3, its middle in the origin, with a straight slit of length a
through its thickness, from the side x = 5 at y = y0. Linear statics, 20-node bricks, graded towards the tip. Four loads of
total force 1, each spread evenly:

    tension  face y = 5 pulled along y, face y = -5 held
    bending  face y = 5 pushed along z, face y = -5 held
    opening  the faces x = 5, y0 < y < y0 + 1 and y0 - 1 < y < y0 pulled apart along y, face x = -5 held
    tearing  the same along z

Prints the compliance (force times displacement) of each, as rows of the test's table.

    tests/mechanics/notched_plate.py                all rows, about ten minutes
    tests/mechanics/notched_plate.py --fine         the same on a finer mesh, to see that it has converged
    tests/mechanics/notched_plate.py --only 4.5 0   one row: a, y0
"""
import argparse
import pathlib
import subprocess
import sys
import tempfile

ROWS = [(0, 0), (2, 0), (4, 0), (4.25, 0), (4.5, 0), (4.75, 0), (5, 0), (6, 0), (2, 0.5), (4.5, 0.5), (4.75, 0.5), (6, 0.5)]
HALF = 5.0


def graded(start, end, smallest, growth, largest):
    """From `start` (fine) to `end`: offsets, the first of them 0."""
    length = abs(end - start)
    if length == 0:
        return [start]
    steps, sum_, size = [], 0.0, smallest
    while sum_ < length:
        steps.append(size)
        sum_ += size
        size = min(size * growth, largest)
    scale = length / sum_
    at, lines = 0.0, [start]
    for s in steps:
        at += s * scale
        lines.append(start + (at if end > start else -at))
    lines[-1] = end
    return lines


def merge(*lists):
    out = []
    for value in sorted(v for values in lists for v in values):
        if not out or value - out[-1] > 1e-9:
            out.append(value)
    return out


class Plate:
    def __init__(self, a, y0, fine):
        f = 0.5 if fine else 1.0
        smallest, growth, largest = 0.05 * f, 1.3 if fine else 1.5, 0.6 * f
        tip = HALF - a
        self.x = merge(graded(tip, -HALF, smallest, growth, largest), graded(tip, HALF, smallest, growth, largest))
        marks = [-HALF, y0 - 1, y0, y0 + 1, HALF]
        self.y = merge(graded(y0, y0 - 1, smallest, growth, largest), graded(y0, y0 + 1, smallest, growth, largest),
                       graded(y0 - 1, -HALF, largest, 1, largest), graded(y0 + 1, HALF, largest, 1, largest))
        self.layers = 6 if fine else 4
        self.z = [-0.5 + k / self.layers for k in range(self.layers + 1)]
        assert all(any(abs(m - y) < 1e-9 for y in self.y) for m in marks)
        self.slit_row = 2 * min(range(len(self.y)), key=lambda j: abs(self.y[j] - y0))
        self.tip_column = 2 * min(range(len(self.x)), key=lambda i: abs(self.x[i] - tip))
        self.y0 = y0
        self.number, self.nodes, self.elements = {}, [], []
        self.loads = {"tension": {}, "bending": {}, "opening": {}, "tearing": {}}
        for k in range(self.layers):
            for j in range(len(self.y) - 1):
                for i in range(len(self.x) - 1):
                    self.add_element(i, j, k)

    def coordinate(self, lines, i):
        return lines[i // 2] if i % 2 == 0 else 0.5 * (lines[i // 2] + lines[i // 2 + 1])

    def node(self, i, j, k, above):
        twin = above and j == self.slit_row and i > self.tip_column
        key = (i, j, k, twin)
        if key not in self.number:
            self.nodes.append((self.coordinate(self.x, i), self.coordinate(self.y, j), self.coordinate(self.z, k)))
            self.number[key] = len(self.nodes)
        return self.number[key]

    def add_element(self, i, j, k):
        above = 2 * j >= self.slit_row
        at = lambda p: self.node(2 * i + p[0], 2 * j + p[1], 2 * k + p[2], above)
        bottom = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)]
        order = bottom + [(p[0], p[1], 2) for p in bottom]
        order += [(1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2)]
        order += [(p[0], p[1], 1) for p in bottom]
        self.elements.append([at(p) for p in order])
        # An even traction on an 8-node face: -1/12 of its force at each corner, 1/3 at each middle.
        face = [(u, v) for u in range(3) for v in range(3) if (u, v) != (1, 1)]
        share = lambda u, v: -1 / 12 if u % 2 == 0 and v % 2 == 0 else 1 / 3
        if j == len(self.y) - 2:
            area = (self.x[i + 1] - self.x[i]) * (self.z[k + 1] - self.z[k]) / (2 * HALF)
            for u, v in face:
                self.add_load("tension", at((u, 2, v)), 2, area * share(u, v))
                self.add_load("bending", at((u, 2, v)), 3, area * share(u, v))
        middle = 0.5 * (self.y[j] + self.y[j + 1]) - self.y0
        if i == len(self.x) - 2 and abs(middle) < 1:
            area = (self.y[j + 1] - self.y[j]) * (self.z[k + 1] - self.z[k]) * (1 if middle > 0 else -1)
            for u, v in face:
                self.add_load("opening", at((2, u, v)), 2, area * share(u, v))
                self.add_load("tearing", at((2, u, v)), 3, area * share(u, v))

    def add_load(self, name, node, axis, force):
        loads = self.loads[name]
        loads[(node, axis)] = loads.get((node, axis), 0.0) + force

    def write(self, path, held, names):
        with open(path, "w") as out:
            out.write("*NODE, NSET=ALL\n")
            for n, p in enumerate(self.nodes, 1):
                out.write(f"{n},{p[0]:.12g},{p[1]:.12g},{p[2]:.12g}\n")
            out.write("*ELEMENT, TYPE=C3D20R, ELSET=PLATE\n")
            for e, nodes in enumerate(self.elements, 1):
                out.write(f"{e}," + ",".join(map(str, nodes[:10])) + ",\n" + ",".join(map(str, nodes[10:])) + "\n")
            out.write("*MATERIAL, NAME=ONE\n*ELASTIC\n1,0.3\n*SOLID SECTION, ELSET=PLATE, MATERIAL=ONE\n*NSET, NSET=HELD\n")
            for n, p in enumerate(self.nodes, 1):
                if abs(p[held] + HALF) < 1e-9:
                    out.write(f"{n},\n")
            out.write("*BOUNDARY\nHELD,1,3\n")
            for name in names:
                out.write("*STEP\n*STATIC\n*CLOAD, OP=NEW\n")
                for (node, axis), force in sorted(self.loads[name].items()):
                    out.write(f"{node},{axis},{force:.12g}\n")
                out.write("*NODE PRINT, NSET=ALL\nU\n*END STEP\n")


def displacements(path):
    """One dictionary per step: node to (ux, uy, uz)."""
    steps = []
    for line in open(path):
        if "displacements" in line:
            steps.append({})
        words = line.split()
        if len(words) == 4 and steps:
            steps[-1][int(words[0])] = tuple(map(float, words[1:]))
    return steps


def compliances(a, y0, fine, folder):
    plate = Plate(a, y0, fine)
    result = {}
    for held, names in ((1, ("tension", "bending")), (0, ("opening", "tearing"))):
        if a == 0 and held == 0:
            continue  # no lips
        job = pathlib.Path(folder) / "plate"
        plate.write(f"{job}.inp", held, names)
        run = subprocess.run(["ccx", "-i", str(job)], cwd=folder, capture_output=True, text=True)
        if run.returncode != 0:
            sys.exit(run.stdout[-2000:])
        for name, u in zip(names, displacements(f"{job}.dat")):
            result[name] = sum(f * u[node][axis - 1] for (node, axis), f in plate.loads[name].items())
    return result, len(plate.nodes)


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--fine", action="store_true")
    options.add_argument("--only", nargs=2, type=float, metavar=("A", "Y0"))
    options = options.parse_args()
    version = subprocess.run(["ccx", "-v"], capture_output=True, text=True).stdout.split()
    print("//", " ".join(version))
    for a, y0 in [tuple(options.only)] if options.only else ROWS:
        with tempfile.TemporaryDirectory() as folder:
            c, nodes = compliances(a, y0, options.fine, folder)
        numbers = ", ".join(f"{c.get(name, 0):.5g}" for name in ("tension", "bending", "opening", "tearing"))
        print(f"    {{{a:g}, {y0:g}, {{{numbers}}}}},  // {nodes} nodes", flush=True)


if __name__ == "__main__":
    main()
