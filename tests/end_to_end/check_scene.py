#!/usr/bin/env python3
"""Runs a shipped scene as a newcomer does, from a folder of its own, and checks what it leaves.

usage: check_scene.py PROGRAM SCENE [options of check_export.py]

The exported meshes are checked by check_export.py; body.glb by Khronos' validator where node and tests/tools/node_modules are
there (npm ci in tests/tools). Exit status 0 if all is right.
"""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

here = pathlib.Path(__file__).resolve().parent


def main():
    program, scene, options = os.path.abspath(sys.argv[1]), sys.argv[2], sys.argv[3:]
    with tempfile.TemporaryDirectory(prefix="kerf_scene_") as folder:
        # Real meshes are looked for beside the project; without them their scenes can't be checked.
        meshes = here.parent.parent.parent / "shared" / "meshes"
        run = subprocess.run([program, "run", scene, "--out", "out", "--meshes", str(meshes)], cwd=folder, stderr=subprocess.PIPE, text=True)
        sys.stderr.write(run.stderr)
        if run.returncode == 2 and not meshes.exists() and "--meshes" in run.stderr:
            print(f"skipped: {scene} needs meshes that are not here ({meshes})")
            return 77
        if run.returncode != 0:
            print(f"kerf run {scene}: exit status {run.returncode}, expected 0")
            return 1
        out = os.path.join(folder, "out")
        with open(os.path.join(out, "report.json")) as file:
            report = json.load(file)
        wrong = []
        if not report["invariants"]["all_hold"]:
            wrong += [f"invariant at {c['time']} s: {c['problem']}" for c in report["invariants"]["checks"] if not c["holds"]]
        text = (here.parent.parent / "scenes" / f"{scene}.toml").read_text()
        cuts = any(word in text for word in ('"blade"', '"scalpel"', '"scissors"'))
        if cuts and not report["cuts"]:
            wrong.append("the scene cut nothing")
        for i, cut in enumerate(report["cuts"]):
            met = cut["triangles_walked"] > 0
            if cut["kind"] == "removal":
                met = cut["after"]["pieces"] < cut["before"]["pieces"]
            elif cut["kind"] == "shave":
                met = True  # smoothing alone changes no count
            if not cut["finished"] or not met:
                wrong.append(f"{cut['kind']} {i + 1} was not finished or met nothing")
        for name in ("visual.obj", "visual_rest.obj", "collision.obj", "hexahedra.vtu", "body.glb", "picture.png"):
            if not os.path.exists(os.path.join(out, name)) or os.path.getsize(os.path.join(out, name)) == 0:
                wrong.append(f"{name} is missing or empty")
        for line in wrong:
            print(f"{scene}: {line}")
        status = subprocess.run([sys.executable, str(here / "check_export.py"), out, *options]).returncode
        tools = here.parent / "tools"
        if shutil.which("node") and (tools / "node_modules").exists():
            status |= subprocess.run(["node", str(tools / "validate-gltf.mjs"), os.path.join(out, "body.glb")]).returncode
        else:
            print("body.glb is not validated: no node, or no tests/tools/node_modules")
        return 1 if wrong or status else 0


if __name__ == "__main__":
    sys.exit(main())
