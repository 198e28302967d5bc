"""What type checkers are told is what there is."""

import ast
import inspect
from pathlib import Path

import numpy as np

import kerf

HERE = Path(kerf.__file__).parent


def returned(module):
    """{class.name: type as it is written} of what a module's text says functions and properties return."""
    return {f"{c.name}.{f.name}": ast.unparse(f.returns) for c in ast.walk(module) if isinstance(c, ast.ClassDef)
            for f in c.body if isinstance(f, ast.FunctionDef) and f.returns and not any("setter" in ast.unparse(d) for d in f.decorator_list)}


def test_types_are_shipped():
    assert (HERE / "py.typed").exists()
    told = returned(ast.parse((HERE / "_core.pyi").read_text()))
    session = kerf.Session("sheet")
    for name in dir(session):
        if name.startswith("_") or f"Session.{name}" not in told:
            continue
        value = getattr(session, name)
        if isinstance(value, np.ndarray) and not value.dtype.names:
            dtype = "bool_" if value.dtype == bool else value.dtype  # NumPy 1 has no numpy.bool
            assert told[f"Session.{name}"].endswith(f"NDArray[numpy.{dtype}]"), name
        elif not callable(value):
            words = told[f"Session.{name}"].replace("None", "NoneType").split(" | ")
            assert type(value).__name__ in [word.split("[")[0] for word in words], name
    assert told["Stroke.is_open"] == "bool"


def test_everything_is_annotated():
    for kind in (kerf.Session, kerf.Recording, kerf.Playback):
        members = [(name, getattr(value, "fget", None) or getattr(value, "__func__", value)) for name, value in
                   ((name, inspect.getattr_static(kind, name)) for name in dir(kind))]
        functions = [(name, value) for name, value in members if inspect.isfunction(value) and value.__module__.startswith("kerf.")]
        assert functions
        for name, function in functions:
            parameters = [p for p in inspect.signature(function).parameters.values() if p.name not in ("self", "cls")]
            assert "return" in function.__annotations__ and all(p.annotation is not p.empty for p in parameters), name


def test_viewers_are_annotated():
    for name, member in inspect.getmembers(kerf.Viewer):
        function = member.fget if isinstance(member, property) else member
        if inspect.isfunction(function):
            parameters = [p for p in inspect.signature(function).parameters.values() if p.name != "self"]
            assert "return" in function.__annotations__ and all(p.annotation is not p.empty for p in parameters), name


def test_bodies_are_what_is_told():
    told = returned(ast.parse((HERE / "_core.pyi").read_text()))
    body = kerf.bind("sheet")
    for name in ("vertices", "triangles", "collision_vertices", "collision_triangles"):
        assert told[f"Body.{name}"].endswith(f"NDArray[numpy.{getattr(body, name).dtype}]"), name
    assert told["Body.save"] == "None" and told["Body.closed"] == "bool"
    for function in (kerf.bind, kerf.load, kerf.view):
        assert {p.name for p in inspect.signature(function).parameters.values()} | {"return"} == {*function.__annotations__}
