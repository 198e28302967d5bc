"""The wheel names what it bundles, with the licence text of each."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

import kerf
from kerf import _program

HERE = Path(kerf.__file__).parent
TEXTS = {path.stem: path.read_text() for path in (HERE / "licenses").glob("*.txt")}
SOURCES = Path(__file__).parents[2]

# The text of what headers of third parties begin with. Others are the system's.
HEADERS = {"boost": "boost", "CLI": "cli11", "Eigen": "eigen", "fmt": "fmt", "nanobind": "nanobind", "nlohmann": "nlohmann-json",
           "oneapi": "tbb", "png.h": "libpng", "toml++": "tomlplusplus"}
SYSTEM = {"arpa", "fcntl.h", "pthread.h", "ifaddrs.h", "immintrin.h", "limits.h", "malloc.h", "spawn.h", "stdlib.h", "sys", "time.h", "unistd.h"}
# And of shared libraries; those of the compiler and of the C library stay on the machine.
LIBRARIES = {"libfmt": "fmt", "libpng": "libpng", "libtbb": "tbb", "libtomlplusplus": "tomlplusplus", "libz": "zlib"}
STAYS = {"ld-linux-x86-64", "libc", "libgcc_s", "libm", "libpthread", "librt", "libdl", "libstdc++"}

pytestmark = pytest.mark.skipif(not Path("/usr/share/doc/libtbb-dev/copyright").exists(), reason="texts are those of Debian's packages")


def test_headers_that_are_compiled_in():
    found = set()
    for folder in ("src", "apps/kerf", "python/src"):
        for path in (SOURCES / folder).rglob("*"):
            if path.suffix in (".h", ".cpp"):
                found |= {name.split("/")[0] for name in re.findall(r"^#include <([^>]+(?:/|\.h)[^>]*)>", path.read_text(), re.M)}
    assert "Eigen" in found and found <= {*HEADERS, *SYSTEM}
    for header in found - SYSTEM:
        assert len(TEXTS[HEADERS[header]]) > 1000, header


def test_libraries_that_are_linked():
    readelf = shutil.which("readelf", path=os.defpath)  # where the tests run without other programs too
    if not readelf:
        pytest.skip("there is no readelf")
    linked = set()
    for file in (*HERE.glob("_core*.so"), _program.PROGRAM):
        needed = subprocess.run([readelf, "-d", file], capture_output=True, text=True, check=True).stdout
        linked |= {name.split(".so")[0] for name in re.findall(r"\(NEEDED\).*\[(.*)\]", needed)}
    linked = {re.sub(r"\d*(_debug|-[0-9a-f]{8})?$", "", name) for name in linked - STAYS}
    assert "libtbb" in linked and linked <= set(LIBRARIES)
    for library in linked:
        assert len(TEXTS[LIBRARIES[library]]) > 1000, library


def test_a_repaired_wheel_uses_its_own():
    libraries = HERE.parent / "kerf.libs"
    if not libraries.is_dir():
        pytest.skip("not repaired")
    used = set(re.findall(r"/\S+/lib(?:tbb|fmt)\S*", Path("/proc/self/maps").read_text()))
    assert len(used) == 2 and all(Path(path).parent == libraries for path in used)


def test_packages_of_the_page():
    if not (SOURCES / "apps/viewer/dist/index.html").exists():
        pytest.skip("built without the page")
    assert all(name in TEXTS["page"] for name in ("three", "uplot", "MIT"))


def test_what_bundled_things_bring_themselves():
    assert "Wenzel Jakob" in TEXTS["nanobind"] and "Goetghebuer" in TEXTS["nanobind"]
    assert "zlib" in TEXTS  # of libpng
    assert "Boost Software License" in TEXTS["boost"] and "Mozilla Public License" in TEXTS["eigen"]
