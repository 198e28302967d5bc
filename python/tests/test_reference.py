"""The page of the package (scripts/reference) has every public name, and each says what it does."""

import importlib.machinery
import importlib.util
import re
from pathlib import Path

import pytest

import kerf

SCRIPT = Path(__file__).parents[2] / "scripts" / "reference-of-python"


@pytest.fixture
def reference():
    loader = importlib.machinery.SourceFileLoader("reference_of_python", str(SCRIPT))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("reference_of_python", loader))
    loader.exec_module(module)
    return module


def test_every_public_name_has_a_docstring(reference, monkeypatch):
    assert list(reference.without_docstring()) == []
    monkeypatch.setattr(kerf.Session, "silent", lambda self: None, raising=False)
    monkeypatch.setattr(kerf.Batch, "quiet", property(lambda self: None), raising=False)
    assert list(reference.without_docstring()) == ["kerf.Batch.quiet", "kerf.Session.silent"]


def test_the_page(reference):
    page = "\n".join(reference.page())
    ids = re.findall('id="([^"]+)"', page)
    assert len(ids) == len(set(ids))
    session = [name for name in dir(kerf.Session) if not name.startswith("_")]
    assert {f"kerf.{name}" for name in kerf.__all__} | {f"kerf.Session.{name}" for name in session} <= set(ids)
    lines = re.sub("<[^>]+>", "", page).splitlines()
    for written in ("step(n: int = 1)", "positions: NDArray[np.float64]", "play(every: float | None = None) -&gt; Playback",
                    "cut(poses: ArrayLike, frame: str = &#x27;rest&#x27;, through: bool = False) -&gt; bool"):
        assert any(line.endswith(written) for line in lines), written
    assert "Simulates n time steps of time_step seconds each." in lines and "step(self" not in page
