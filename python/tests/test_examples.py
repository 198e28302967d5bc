"""The examples of python/examples do what they say."""

import importlib.util
import json
import re
from pathlib import Path

import numpy as np
import pytest

import kerf

EXAMPLES = Path(__file__).parents[1] / "examples"


def cells_of(name):
    notebook = json.loads((EXAMPLES / name).read_text())
    assert (notebook["nbformat"], notebook["nbformat_minor"]) == (4, 5)
    ids = [cell["id"] for cell in notebook["cells"]]
    assert len(ids) == len(set(ids))
    for cell in notebook["cells"]:
        assert cell["cell_type"] == "markdown" or cell["outputs"] == [] and cell["execution_count"] is None
    return [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]


def run(name):
    """What all code cells leave behind. Without matplotlib those tagged "plot" are left out."""
    draws = importlib.util.find_spec("matplotlib") is not None
    if draws:
        import matplotlib

        matplotlib.use("Agg")
    names = {}
    for cell in cells_of(name):
        if draws or "plot" not in cell["metadata"].get("tags", []):
            exec(compile("".join(cell["source"]), f"{name}, cell {cell['id']}", "exec"), names)
    return names


def test_stl_to_cut(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = run("stl_to_cut.ipynb")
    steak, body, session = names["steak"], names["body"], names["session"]
    assert (tmp_path / "steak.stl").stat().st_size == 84 + 50 * len(steak.triangles)
    assert np.allclose(np.ptp(body.vertices, axis=0), np.ptp(steak.vertices, axis=0), rtol=1e-5)
    assert body.diagnosis["thinness"] == "thin" and body.diagnosis["warnings"] == []
    uncut = kerf.Session(body).counts
    assert session.counts["visual_triangles"] > uncut["visual_triangles"] and session.walls.any() and session.undo_depth == 1
    assert len(names["times"]) == 40 and names["lowest"][-1] < names["lowest"][0] - 0.001
    picture = names["picture"]
    assert picture.shape == (480, 640, 3) and len(np.unique(picture.reshape(-1, 3), axis=0)) > 50


def test_a_strip_off_a_plate(capsys):
    """The walls of the cut lie where the strip of the wanted width begins."""
    pytest.importorskip("gymnasium")
    spec = importlib.util.spec_from_file_location("strip_task", EXAMPLES / "strip_task.py")
    task = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(task)
    envs = task.Strip(3, threads=1)
    envs.reset(seed=5)
    going, total = np.ones(3, bool), np.zeros(3)
    while going.any():
        _, rewards, terminated, truncated, info = envs.step(envs.expert())
        total += rewards * going
        for row in np.flatnonzero(going & terminated):
            session = envs.sessions[row]
            place = session.rest_positions[session.triangles[session.walls]][..., 0]
            assert place == pytest.approx(0.5 - envs.wanted[row], abs=0.01)
            assert session.counts["pieces"] == 2 and info["is_success"][row]
        assert not truncated[going].any()
        going &= ~terminated
    assert (total > 0).all()
    envs.close()
    task.main()
    assert capsys.readouterr().out.count("wanted") == 4


def test_nobody_is_sent_to_the_other_kerf():
    """The name on PyPI is another project's: what is to be installed is a file, or this folder."""
    root = EXAMPLES.parents[1]
    pages = [*root.glob("*.md"), *(root / "docs").rglob("*.md"), *EXAMPLES.iterdir(), *(root / "python").glob("*.md"),
             *(root / "python" / "kerf").rglob("*.py")]
    assert len(pages) > 30
    for page in filter(Path.is_file, pages):
        assert not re.search(r"""pip install\b[^\n]*[ "'\\]kerf(?![\w.-])""", page.read_text()), page
