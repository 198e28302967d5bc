#!/usr/bin/env python3
"""Checks what `kerf run` exported, with none of Kerf's own code.

usage: check_export.py DIR [--volume V] [--area A] [--pieces N] [--open]

Reads DIR/visual_rest.obj, DIR/visual.obj, DIR/collision.obj and DIR/report.json. Positions that agree to the bit are one
vertex in visual_rest.obj only as far as the file's own vertices say: lips of a cut lie on each other there, so topology
is taken from the indices. Exit status 0 if all holds.
"""
import argparse
import json
import math
import sys


def read_obj(path):
    positions, faces, material, materials = [], [], "", []
    with open(path) as file:
        for line in file:
            words = line.split()
            if not words:
                continue
            if words[0] == "v":
                positions.append(tuple(float(x) for x in words[1:4]))
            elif words[0] == "usemtl":
                material = words[1]
            elif words[0] == "f":
                faces.append(tuple(int(w.split("/")[0]) - 1 for w in words[1:]))
                materials.append(material)
    return positions, faces, materials


def components(faces):
    parent = {}

    def find(a):
        while parent[a] != a:
            parent[a] = parent[parent[a]]
            a = parent[a]
        return a

    for f in faces:
        for v in f:
            parent.setdefault(v, v)
        for v in f[1:]:
            parent[find(v)] = find(f[0])
    return len({find(v) for v in parent})


def edge_report(faces):
    """(number of border edges, list of complaints)"""
    directed, complaints = {}, []
    for i, f in enumerate(faces):
        if len(set(f)) != 3:
            complaints.append(f"face {i + 1} repeats a vertex or is no triangle: {f}")
        for k in range(3):
            e = (f[k], f[(k + 1) % 3])
            if e in directed:
                complaints.append(f"edge {e} twice in one direction (faces {directed[e] + 1} and {i + 1})")
            directed[e] = i
    border = sum(1 for (a, b) in directed if (b, a) not in directed)
    return border, complaints


def fans(faces):
    """Vertices whose faces form more than one fan."""
    around = {}
    for i, f in enumerate(faces):
        for k in range(3):
            around.setdefault(f[k], []).append((f[(k + 1) % 3], f[(k + 2) % 3]))
    bad = []
    for v, links in around.items():
        successor = dict(links)
        targets = {b for _, b in links}
        starts = [a for a, _ in links if a not in targets]
        if len(starts) > 1:
            bad.append(v)
            continue
        a = starts[0] if starts else links[0][0]
        seen = 0
        first = a
        while a in successor:
            a = successor[a]
            seen += 1
            if a == first or seen > len(links):
                break
        if seen != len(links):
            bad.append(v)
    return bad


def measure(positions, faces, keep=lambda i: True):
    area = volume = 0.0
    for i, (a, b, c) in enumerate(faces):
        p, q, r = positions[a], positions[b], positions[c]
        u = [q[k] - p[k] for k in range(3)]
        w = [r[k] - p[k] for k in range(3)]
        n = (u[1] * w[2] - u[2] * w[1], u[2] * w[0] - u[0] * w[2], u[0] * w[1] - u[1] * w[0])
        if keep(i):
            area += 0.5 * math.sqrt(sum(x * x for x in n))
        volume += (p[0] * n[0] + p[1] * n[1] + p[2] * n[2]) / 6
    return area, volume


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("dir")
    parser.add_argument("--volume", type=float)
    parser.add_argument("--area", type=float, help="of the skin")
    parser.add_argument("--pieces", type=int)
    parser.add_argument("--open", action="store_true", help="an open sheet: borders are fine")
    args = parser.parse_args()
    wrong = []

    rest, faces, materials = read_obj(f"{args.dir}/visual_rest.obj")
    deformed, deformed_faces, _ = read_obj(f"{args.dir}/visual.obj")
    collision, collision_faces, _ = read_obj(f"{args.dir}/collision.obj")
    with open(f"{args.dir}/report.json") as file:
        report = json.load(file)

    for name, positions in (("visual_rest", rest), ("visual", deformed), ("collision", collision)):
        if not all(math.isfinite(x) for p in positions for x in p):
            wrong.append(f"{name}: a coordinate is not finite")
    if deformed_faces != faces:
        wrong.append("visual.obj and visual_rest.obj have different faces")
    for name, mesh, closed in (("visual", faces, not args.open), ("collision", collision_faces, False)):
        border, complaints = edge_report(mesh)
        wrong += [f"{name}: {c}" for c in complaints[:5]]
        if closed and border:
            wrong.append(f"{name}: {border} border edges on a surface that should be closed")
        bad = fans(mesh)
        if bad:
            wrong.append(f"{name}: {len(bad)} vertices with several fans, first {bad[0] + 1}")

    pieces, collision_pieces = components(faces), components(collision_faces)
    if pieces != collision_pieces:
        wrong.append(f"pieces: visual {pieces}, collision {collision_pieces}")
    if args.pieces is not None and pieces != args.pieces:
        wrong.append(f"pieces: {pieces}, expected {args.pieces}")
    reported = report.get("counts", {}).get("final", {}).get("pieces")
    if reported is not None and reported != pieces:
        wrong.append(f"pieces: {pieces} in the files, {reported} in the report")

    area, volume = measure(rest, faces, lambda i: materials[i] != "cut")
    if args.area is not None and abs(area - args.area) > 1e-9 * args.area:
        wrong.append(f"area of the skin {area:.17g}, expected {args.area:.17g}")
    if args.volume is not None and not args.open and abs(volume - args.volume) > 1e-9 * abs(args.volume):
        wrong.append(f"volume {volume:.17g}, expected {args.volume:.17g}")

    print(f"{args.dir}: {len(rest)} vertices, {len(faces)} faces, {pieces} pieces, "
          f"skin {area:.12g} m2, volume {volume:.12g} m3: {'wrong' if wrong else 'right'}")
    for w in wrong:
        print("  " + w)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
