#!/usr/bin/env python3
"""Small files for the fuzz targets to start from: make_seeds.py FOLDER [KERF_PROGRAM].

FOLDER/TARGET/* are written anew. With the program there are bound bodies too, and meshes as it writes them.
"""
import json, pathlib, struct, subprocess, sys, tempfile

root = pathlib.Path(__file__).resolve().parent.parent
out = pathlib.Path(sys.argv[1])
program = sys.argv[2] if len(sys.argv) > 2 else None

POINTS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]


def put(target, name, data):
    folder = out / target
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(data.encode() if isinstance(data, str) else data)


def obj():
    points = "".join(f"v {x} {y} {z}\n" for x, y, z in POINTS)
    put("obj_fuzz", "plain", points + "".join("f " + " ".join(str(i + 1) for i in f) + "\n" for f in FACES))
    put("obj_fuzz", "relative", points + "f -4 -2 -3\nf 1 2 4\n")
    put("obj_fuzz", "texture", points + "vt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\nusemtl a\nf 1/1/1 2/2/1 3/3/1\ng b\nf 1//1 2//1 4//1\n")
    put("obj_fuzz", "polygon", "v 0 0 0\r\nv 1 0 0\r\nv 1 1 0\r\nv 0 1 0\r\nf 1 2 3 4 \\\r\n\r\n# end\r\n")


def ply():
    head = "ply\nformat {}\ncomment seed\nelement vertex 4\nproperty {} x\nproperty {} y\nproperty {} z\nelement face 4\n"
    tail = "property list uchar int vertex_indices\nend_header\n"
    text = "".join("%g %g %g\n" % p for p in POINTS) + "".join("3 %d %d %d\n" % f for f in FACES)
    put("ply_fuzz", "ascii", head.format("ascii 1.0", *["float"] * 3) + tail + text)
    for name, order in (("little", "<"), ("big", ">")):
        body = b"".join(struct.pack(order + "3d", *p) for p in POINTS) + b"".join(struct.pack(order + "B3i", 3, *f) for f in FACES)
        put("ply_fuzz", name, (head.format(f"binary_{name}_endian 1.0", *["double"] * 3) + tail).encode() + body)
    put("ply_fuzz", "groups", head.format("ascii 1.0", *["float"] * 3) + "property uchar red\nproperty int group\n" + tail
        + "".join("%g %g %g\n" % p for p in POINTS) + "".join("7 2 3 %d %d %d\n" % f for f in FACES))


def stl():
    text = "solid s\n" + "".join(
        "facet normal 0 0 1\nouter loop\n" + "".join("vertex %g %g %g\n" % POINTS[i] for i in f) + "endloop\nendfacet\n"
        for f in FACES) + "endsolid s\n"
    put("stl_fuzz", "ascii", text)
    put("stl_fuzz", "binary", b"\0" * 80 + struct.pack("<I", 4)
        + b"".join(struct.pack("<12fH", 0, 0, 1, *(c for i in f for c in POINTS[i]), 0) for f in FACES))


def off():
    body = "".join("%g %g %g\n" % p for p in POINTS) + "".join("3 %d %d %d\n" % f for f in FACES)
    put("off_fuzz", "plain", "OFF\n4 4 6\n" + body)
    put("off_fuzz", "comments", "OFF # seed\n# none\n4 4 0\n" + body.replace("\n", " # c\n"))
    put("off_fuzz", "colours", "COFF\n4 1 0\n" + "".join("%g %g %g 255 0 0 255\n" % p for p in POINTS) + "4 0 1 2 3 0.5 0.5 0.5\n")


def scenes():
    for path in sorted((root / "scenes").glob("*.toml")):
        put("scene_fuzz", path.stem, path.read_bytes())
    put("scene_fuzz", "least", '[body]\nmodel = "sheet"\n')
    put("scene_fuzz", "files", '[body]\nvisual = "a.obj"\ncollision = "b.obj"\nscale = 0.001\nthickness = 2e-3\n[lattice]\ncells = [1, 2, 3]\n')


def recordings():
    recording = {
        "kerf_recording": 1, "instructions": "x86-64-v3",
        "scene": {"name": "s", "folder": "/tmp", "text": '[body]\nmodel = "sheet"\n', "files": [{"name": "a.obj", "base64": "AAAA"}]},
        "scripted": True, "time_step": 0.001, "last_step": 100,
        "changes": [[0, "begin_stroke", 1], [1, "blade", 0, 0, 1, 0, 0, -1], [2, "end_stroke"], [3, "undo"], [3, "redo"],
                    [4, "grasp", "g", 1, 2], [5, "move", "g", 0, 0, 1, 0.5], [6, "release", "g"], [7, "fix", 1, 0, 0, 0, 1],
                    [8, "gravity", 0, 0, -1], [9, "material", 20000, 0.45, 1000], [9, "unfix", 2, 0, 0, 0, 0, 0, 1]],
        "hashes": [[0, "0123456789abcdef"], [100, "ffffffffffffffff"]], "end": "0000000000000000"}
    put("recording_fuzz", "all", json.dumps(recording))
    recording["changes"] = []
    put("recording_fuzz", "none", json.dumps(recording))


def results():
    put("results_fuzz", "one", json.dumps({
        "kerf_bench": 1, "program": "p", "machine": {"a": "b"}, "figures": [{"id": "t-x", "caption": "c"}],
        "tables": [{"id": "t", "title": "T", "note": "", "columns": ["a", "b"], "rows": [[1.5, "x"], [None, -3]]}]}))


def protocol():
    for kind in range(16):
        put("protocol_fuzz", f"kind{kind}", struct.pack("<II", kind, 0) + bytes(120))


def bodies():
    if not program:
        return
    with tempfile.TemporaryDirectory() as folder:
        for name, model, arguments in (("open", "sheet", ["--visual-triangles", "1664"]),
                                       ("closed", "closed-sheet", ["--visual-triangles", "500", "--collision-triangles", "32"])):
            subprocess.run([program, "make", model, *arguments, "--out", folder, "--replace"], check=True, stdout=subprocess.DEVNULL)
            thick = ["--thickness", "0.1"] if name == "open" else []
            subprocess.run([program, "bind", f"{folder}/visual.obj", "--collision", f"{folder}/collision.obj", "--quiet", *thick,
                            "--out", f"{folder}/body.kerf"], check=True, stdout=subprocess.DEVNULL)
            put("body_fuzz", name, pathlib.Path(folder, "body.kerf").read_bytes())
            put("obj_fuzz", name, pathlib.Path(folder, "collision.obj").read_bytes())


for make in (obj, ply, stl, off, scenes, recordings, results, protocol, bodies):
    make()
