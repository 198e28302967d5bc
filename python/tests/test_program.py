"""The program inside the package."""

import os
import re
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

import kerf
from kerf import _machine, _program


def test_the_program_finds_its_scenes():
    if not _program.PROGRAM.is_file():
        pytest.skip("built without the program")
    done = subprocess.run([sys.executable, "-m", "kerf", "info", "steak"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "steak" in done.stdout.lower()
    scenes = subprocess.run([sys.executable, "-m", "kerf", "info", "--scenes"], capture_output=True, text=True).stdout
    assert all(name in scenes for name in kerf.scenes())


def test_the_program_shows_its_page():
    if not _program.PROGRAM.is_file() or not (Path(__file__).parents[2] / "apps/viewer/dist/index.html").exists():
        pytest.skip("built without the program or its page")
    with subprocess.Popen([sys.executable, "-m", "kerf", "view", "sheet", "--no-browser", "--port", "0"], text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as program:
        try:
            address = next(found[0] for line in program.stdout if (found := re.search(r"http://\S+", line)))
            with urllib.request.urlopen(address, timeout=20) as answer:
                page = answer.read().decode()
        finally:
            program.terminate()
    assert "<title>Kerf" in page and "<script" in page


def test_older_processors_are_told(tmp_path):
    file = tmp_path / "cpuinfo"
    file.write_text("processor : 0\nflags : fpu sse sse2 avx\n")
    if _machine.missing(file):
        assert "avx2" in _machine.missing(file) and "avx" not in _machine.missing(file)
    assert _machine.missing(tmp_path / "none") == []
    assert _machine.missing() == []


def test_a_closed_pipe_ends_the_program_without_a_word():
    if not _program.PROGRAM.is_file():
        pytest.skip("built without the program")
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run([sys.executable, "-m", "kerf", "info", "--schema"], stdout=write, stderr=subprocess.PIPE, text=True)
    os.close(write)
    assert done.stderr == "" and done.returncode == -signal.SIGPIPE


def test_a_scene_that_is_none_is_looked_for_in_the_package():
    if not _program.PROGRAM.is_file():
        pytest.skip("built without the program")
    said = subprocess.run([sys.executable, "-m", "kerf", "info", "nosuch"], capture_output=True, text=True, env={**os.environ, "KERF_SCENES": ""}).stderr
    folders = re.search("looked for it as a file(.*)", said)[1].split(", in ")[1:]
    assert [Path(folder).resolve() for folder in folders] == [(Path(kerf.__file__).parent / "share/kerf/scenes").resolve()]
