"""Everything that a session can be made of, as the text of a scene."""

import math
import os
from pathlib import Path

from . import _arguments, _core
from ._error import Error

SHIPPED = Path(__file__).parent / "share" / "kerf" / "scenes"


def scenes() -> list[str]:
    """Names of the shipped scenes that open as they are, sorted. "trainer-knee" needs meshes that are not part of Kerf."""
    return sorted(name for name in _shipped() if _core.scene_opens(str(SHIPPED / f"{name}.toml")))


def _shipped():
    return [path.stem for path in SHIPPED.glob("*.toml")]


def models() -> list[str]:
    """Names of the models that can be generated."""
    return _core.model_names()


def source_of(scene):
    """(text, name for messages, folder that relative files start in, bodies by the names that they have in the text) of what is a scene."""
    if isinstance(scene, _core.Body):
        name = _name_of_body(1)
        return scene._scene_text(name), "scene", "", {name: scene}
    if isinstance(scene, dict):
        plain, bodies = _without_bodies(scene)
        return toml_of(plain), "scene", "", bodies
    return *_of_text(scene), {}


def _of_text(scene):
    if isinstance(scene, os.PathLike):
        return _of_file(Path(os.fsdecode(scene)))
    if isinstance(scene, str):
        return _of_words(scene)
    raise TypeError(f"a scene is a path, a name, a text in TOML, a dict or a kerf.Body, not {type(scene).__name__}")


def _name_of_body(number):
    return f"<kerf.Body {number}>"


def _without_bodies(scene):
    """The scene with a name for each kerf.Body that is `bound` in its body or bodies, and these."""
    found = scene.get("body")
    several = isinstance(found, (list, tuple))
    names = {}

    def plain(table):
        if not isinstance(table, dict) or not isinstance(table.get("bound"), _core.Body):
            return table
        name = _name_of_body(len(names) + 1)
        names[name] = table["bound"]
        return {**table, "bound": name}

    body = [plain(table) for table in found] if several else plain(found)
    return ({**scene, "body": body} if names else scene), names


def utf8(text):
    """The text, if the library can have it: the name of a file may hold bytes that are not UTF-8."""
    try:
        text.encode()
    except UnicodeEncodeError:
        raise Error(f"{text[:100]!a} is not UTF-8; files of a scene, their folders and texts are") from None
    return text


def _of_file(path):
    if not path.is_file():
        raise Error(f"{path}: {'is a folder' if path.is_dir() else 'there is no such file'}; name a scene file or a bound body")
    try:
        text = _core.scene_text(utf8(str(path))).decode("utf-8")
    except UnicodeDecodeError as error:
        raise Error(f"{path}: byte {error.start} is not UTF-8; scene files are") from None
    return text, str(path), str(path.parent)


def _of_words(words):
    if "\n" in words:
        return words, "scene", ""
    if "\0" in words:
        raise ValueError("a scene's name has no null characters")
    path = Path(words)
    try:
        if words and path.is_file():
            return _of_file(path)
    except OSError:  # too long for a path
        pass
    if words in _shipped():
        return _of_file(SHIPPED / f"{words}.toml")
    if words in models():
        return toml_of({"body": {"model": words}}), words, ""
    if "=" in words:
        return words, "scene", ""
    if os.sep in words or words.endswith((".toml", ".kerf")):
        return _of_file(path)
    known = sorted({*_shipped(), *models()})
    closest = _core.closest_word(utf8(words), known)
    raise Error(f'there is no scene or model "{words}"; ' + (f'did you mean "{closest}"?' if closest else f"there are {', '.join(known)}"))


# --- dict to TOML ---


def toml_of(scene):
    """A dict as TOML: tables on lines of their own, so that messages name a line that can be found."""
    plain, tables = [], []
    for key, value in scene.items():
        if value is None:
            continue
        if isinstance(value, dict):
            tables.append((f"[{_key(key)}]", value))
        elif isinstance(value, (list, tuple)) and value and all(isinstance(item, dict) for item in value):
            tables.extend((f"[[{_key(key)}]]", item) for item in value)
        else:
            plain.append(f"{_key(key)} = {_value(value, key)}")
    for head, table in tables:
        plain.append(head)
        plain.extend(f"{_key(key)} = {_value(value, key)}" for key, value in table.items() if value is not None)
    return "\n".join(plain) + "\n"


def command_of(command):
    """(text, name for messages) of a command: a dict or a text in TOML with the keys of a [[command]] of a scene, without `at`."""
    if isinstance(command, dict):
        return "".join(f"{_key(key)} = {_value(value, key)}\n" for key, value in command.items() if value is not None), "command"
    if isinstance(command, str):
        return command, "command"
    raise TypeError(f"a command is a dict or a text in TOML, not {type(command).__name__}")


def _key(key):
    if not isinstance(key, str):
        raise TypeError(f"keys of a scene are words, not {type(key).__name__}")
    return _text(key)


_ESCAPES = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\r": "\\r", "\t": "\\t"}


def _text(text):
    utf8(text)
    return '"' + "".join(_ESCAPES.get(c) or (f"\\u{ord(c):04x}" if ord(c) < 0x20 or ord(c) == 0x7F else c) for c in text) + '"'


def _number(value):
    if math.isnan(value):
        return "nan"
    if math.isinf(value):
        return "inf" if value > 0 else "-inf"
    return repr(float(value))


def _value(value, name, depth=0):
    """A value of the key `name`, for messages."""
    if depth > 32:
        raise ValueError(f"{name} is too deep for a scene; is something in itself?")
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, os.PathLike):
        return _text(os.fsdecode(value))
    if isinstance(value, int):
        return str(int(value))
    if isinstance(value, float):
        return _number(value)
    if isinstance(value, dict):
        items = (f"{_key(k)} = {_value(v, k, depth + 1)}" for k, v in value.items() if v is not None)
        return "{ " + ", ".join(items) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_value(item, name, depth + 1) for item in value) + "]"
    if hasattr(value, "tolist") and hasattr(value, "dtype"):  # NumPy's arrays and numbers
        _arguments.unmasked(value, name)
        # Numbers longer than Python's stay NumPy's in a list.
        plain = value.tolist() if value.ndim or value.dtype.kind != "f" else float(value)
        if plain is not value:
            return _value(plain, name, depth + 1)
    if isinstance(value, _core.Body):
        raise TypeError('a kerf.Body stands in a scene as {"body": {"bound": body}}, nowhere else')
    raise TypeError(f"{name} must be made of numbers, words, lists and dicts, as everything in a scene, not of {type(value).__name__}")
