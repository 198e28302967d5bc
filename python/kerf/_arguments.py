"""What is given as points and paths: arrays of the right shape, or an error that says what is wrong."""

import numbers
import operator

FARTHEST = 1e6  # m: coordinates of whatever is placed or moved, as kFarthestPlace of scenes


def unmasked(given, name):
    """Masked arrays are refused: what a mask hides would be taken."""
    import numpy as np

    if isinstance(given, np.ma.MaskedArray):
        raise TypeError(f"{name} must not be a masked array; its filled() or compressed() is a plain one")


def as_array(given, name, what):
    import numpy as np

    unmasked(given, name)
    try:
        array = np.asarray(given)
    except ValueError:
        array = None
    # NumPy 1.23 makes an array of lists of rows that differ in length.
    if array is None or array.dtype == object and array.size and isinstance(array.flat[0], (list, tuple)):
        raise ValueError(f"{name} must be {what}; its rows differ in length") from None
    return array


def _is_number(item):
    return isinstance(item, numbers.Real) and not isinstance(item, bool)


def kind_of(array, given):
    """What an array is that can't be used, for messages: its type, or the first thing in it that is no number."""
    if array.dtype != object:
        return f"of type {array.dtype}"
    if not array.ndim:
        return f"of type {type(given).__name__}"
    strange = next((type(item).__name__ for item in array.flat if not _is_number(item)), None)
    return f"with {strange} in it" if strange else "of objects; its astype(float) is of numbers"


def _numbers(given, name, what):
    import numpy as np

    array = as_array(given, name, what)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name} must be {what}, not {kind_of(array, given)}")
    array = np.array(array, dtype=np.float64, order="C")  # a copy: the caller's may change while other threads run
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite")
    return array


def _places(given, name, what):
    import numpy as np

    array = _numbers(given, name, what)
    if array.size and np.abs(array).max() > FARTHEST:
        raise ValueError(f"{name} must be metres, {FARTHEST:g} at most; it has {array.flat[np.abs(array).argmax()]:g}")
    return array


def rows(given, name, shape, read=_numbers):
    """An array of this shape, in which None is any length k."""
    words = ", ".join("k" if want is None else str(want) for want in shape)
    what = f"an array of shape ({words})"
    array = read(given, name, what)
    if array.ndim != len(shape) or any(want not in (None, have) for want, have in zip(shape, array.shape, strict=True)):
        raise ValueError(f"{name} must be {what}, not of shape {array.shape}")
    return array


def place_rows(given, name, shape):
    """The same, of places in metres."""
    return rows(given, name, shape, _places)


def led_rows(given, name, shape):
    """The same; a row of NaN throughout leads nothing."""
    import numpy as np

    array = as_array(given, name, "numbers")
    if array.dtype.kind != "f" or array.shape != shape:
        return place_rows(given, name, shape)
    alone = np.isnan(array).all(axis=1)
    array = place_rows(np.where(alone[:, None], 0, array), name, shape)
    array[alone] = np.nan
    return array


def named_rows(given, name, shape, read):
    """Rows for each id, as pairs."""
    if given is None:
        return []
    if not hasattr(given, "items"):
        raise TypeError(f"{name} must be a dict of ids and arrays, not {type(given).__name__}")
    for id in given:
        if not isinstance(id, str):
            raise TypeError(f"an id in {name} must be text, not {type(id).__name__}")
    return [(id, read(array, f"{name}[{id!r}]", shape)) for id, array in given.items()]


def flags(given, name, n):
    """n truth values."""
    import numpy as np

    array = np.array(as_array(given, name, f"{n} truth values"), order="C")
    if array.shape != (n,) or array.dtype != np.bool_:
        raise ValueError(f"{name} must be {n} truth values")
    return array


def index(given, name, what="a whole number"):
    """A whole number: of Python, of NumPy, or what says that it is one, but no truth value."""
    try:
        if isinstance(given, bool):
            raise TypeError
        return operator.index(given)
    except TypeError:
        raise TypeError(f"{name} must be {what}, not {type(given).__name__}") from None


def whole(given, name, least=0, most=None):
    """A whole number from `least` to `most`."""
    number = index(given, name)
    if number < least:
        raise ValueError(f"{name} must be {least} or more")
    if most is not None and number > most:
        raise ValueError(f"{name} must be {most} at most")
    return number


def steps(given, name):
    """A number of time steps, as the library counts them."""
    return whole(given, name, most=MOST_STEPS)


def refuse_frame(given):
    """A frame that there is none of."""
    kind = ValueError if isinstance(given, str) else TypeError
    raise kind(f'frame must be "rest" or "world", not {repr(given)[:100]}')


def refuse_snapshot(given):
    """What is no snapshot."""
    raise TypeError(f"snapshot must be what a session's snapshot() gave, not {type(given).__name__}")


def flag(given, name):
    """True or False."""
    import numpy as np

    if not isinstance(given, (bool, np.bool_)):
        raise TypeError(f"{name} must be True or False, not {type(given).__name__}")
    return bool(given)


def place(given, name):
    """Three numbers of a place, metres."""
    _places(given, name, "three numbers")


def point(given, name):
    """Three finite numbers, as a tuple."""
    array = _numbers(given, name, "three numbers")
    if array.shape != (3,):
        raise ValueError(f"{name} must be three numbers, not an array of shape {array.shape}")
    return tuple(array.tolist())


def points(given, name):
    """Places: an array of shape (k, 3)."""
    what = "an array of shape (k, 3): a place in each row"
    array = _places(given, name, what)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"{name} must be {what}, not of shape {array.shape}")
    return array


def number(given, name):
    """One number, as a float; what is out of its range is told where it is used."""
    flag = isinstance(given, bool) or getattr(getattr(given, "dtype", None), "kind", "") == "b"
    if flag or isinstance(given, (str, bytes, bytearray)) or not hasattr(given, "__float__"):
        raise TypeError(f"{name} must be a number, not {type(given).__name__}")
    try:
        return float(given)
    except OverflowError:
        raise ValueError(f"{name} must be finite") from None
    except TypeError:  # an array of several
        raise TypeError(f"{name} must be one number, not {type(given).__name__}") from None


MOST_STEPS = 2**63 - 1  # of one call, as the library counts them
MOST_PIXELS = 8192  # a side, as pictures of scenes


def pixels(given, name):
    """Pixels along a side of a picture."""
    count = index(given, name, "a whole number of pixels")
    if not 1 <= count <= MOST_PIXELS:
        raise ValueError(f"{name} must be 1 to {MOST_PIXELS} pixels")
    return count


def path(given, name="poses"):
    """Edges of a blade, base and tip: an array of shape (n, 2, 3), two edges or more."""
    what = "an array of shape (n, 2, 3): base and tip of the edge at each pose"
    array = _places(given, name, what)
    if array.ndim != 3 or array.shape[1:] != (2, 3):
        raise ValueError(f"{name} must be {what}, not of shape {array.shape}")
    if len(array) < 2:
        raise ValueError(f"{name} must hold two poses or more to sweep between, not {len(array)}")
    return array


def timed(poses, times):
    """The same edges, each with its time: tables as a scene's commands have them."""
    edges = path(poses)
    moments = _numbers(times, "times", "one number for each pose, seconds")
    if moments.shape != (len(edges),):
        raise ValueError(f"times must be one number for each of {len(edges)} poses, not an array of shape {moments.shape}")
    return [{"time": time, "base": base, "tip": tip} for time, (base, tip) in zip(moments.tolist(), edges.tolist(), strict=True)]


def table(given, name, what):
    """Rows of three finite numbers: an array of shape (n, 3)."""
    array = _numbers(given, name, what)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"{name} must be {what}, not of shape {array.shape}")
    return array


def corners(given, name, count):
    """Numbers of three of `count` vertices in each row: an array of shape (m, 3), int32."""
    import numpy as np

    what = "an array of shape (m, 3): numbers of three vertices each, from 0"
    array = as_array(given, name, what)
    if array.size == 0:
        raise ValueError(f"{name} is empty: there is no surface")
    if array.dtype.kind not in "iu":
        raise TypeError(f"{name} must be whole numbers, not {kind_of(array, given)}")
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"{name} must be {what}, not of shape {array.shape}")
    wrong = np.argwhere((array < 0) | (array >= min(count, 2**31 - 1)))
    if len(wrong):
        row, column = wrong[0]
        raise ValueError(f"{name}[{row}] has the vertex {array[row, column]}, but there are {count} vertices, numbered from 0")
    return np.array(array, dtype=np.int32, order="C")
