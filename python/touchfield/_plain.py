"""What the extension asks of Python, and helpers without a subject of their own."""

import contextlib
import math
import os
import sys
import tempfile
import warnings
from decimal import Decimal

from . import _core


def plain(value):
    """NumPy's arrays and numbers as Python's, paths as texts."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    raise TypeError(f"values of a scene must be numbers, strings, lists or dicts, not {type(value).__name__}")


def warn(text, category):
    """Warns at the line that called the package."""
    level, frame = 2, sys._getframe(1)
    while frame is not None and frame.f_globals.get("__name__", "").startswith("touchfield."):
        level, frame = level + 1, frame.f_back
    warnings.warn(text, category, stacklevel=level)


def number(value, argument):
    """A number for an argument of this name."""
    try:
        if not isinstance(value, (str, bytes)):
            return value if isinstance(value, int) else float(value)
    except (TypeError, ValueError, OverflowError):
        pass
    raise TypeError(f"{argument} must be a number, not {type(value).__name__}")


def millimetres(values, argument):
    """A length or three in m as scenes have them, without an error of rounding: 10.16e-3 is 10.16."""
    if hasattr(values, "__len__") and not isinstance(values, str) and getattr(values, "shape", None) != ():
        return [millimetres(value, argument) for value in values]
    length = float(number(values, argument))
    return float(Decimal(repr(length)) * 1000) if math.isfinite(length) else length


def listed(values, argument):
    """A list for an argument of this name."""
    if isinstance(values, (str, dict)) or not hasattr(values, "__iter__"):
        raise TypeError(f"{argument} must be a list, not {type(values).__name__}")
    return list(values)


def place(values, argument):
    """A point in m as scenes have it."""
    return millimetres(_core._three(values, argument).tolist(), argument)


def angles(values, argument):
    """Three angles in degrees."""
    return _core._three(values, argument).tolist()


# Parts of a scene that no argument names, and keys that arguments call otherwise.
_PARTS = {"felt", "array", "body", "hand", "place", "grid", "autd3", "positions", "medium"}
_ARGUMENTS = {"source_pa_m": "source_strength", "count[0]": "nx", "count[1]": "ny", "layout[0]": "nx", "layout[1]": "ny", "file": "path",
              "rotate_deg": "rotate"}


@contextlib.contextmanager
def own_arguments(function):
    """Errors of a scene that a function wrote from its arguments speak of those, and of lengths in m."""
    try:
        yield
    except _core.InputError as error:
        raise _core.InputError("\n".join(f"{function}: {_of_argument(line)}" for line in str(error).splitlines())) from None


def _of_argument(line):
    """A line `path = value must be rule` or `path: rule` with the argument for the path, and numbers in its unit."""
    if line.startswith("set felt."):
        line = line.partition(": ")[2]
    line = line.replace("_mm in mm", " in m")
    mark = " = " if " = " in line.partition(": ")[0] else ": "
    path, _, rest = line.partition(mark)
    if not rest or " " in path:
        return _words(line)
    keys = [key for key in path.split(".") if key not in _PARTS]
    factor, unit = (1e3, "Pa") if "_kpa" in path else (1e-3, "m") if "_mm" in path and keys[-1] != "growth" else (1, "")
    if unit and mark == " = " and " mm" not in rest:
        rest = _words(rest.partition("; if ")[0], factor) + f", in {unit}"
    name = ".".join(_ARGUMENTS.get(key, key.replace("_kpa", "")) for key in keys)
    return _words(name + mark if name else "") + _words(rest)


def _words(text, factor=1):
    """Without scene keys, and numbers times the factor."""
    return " ".join(_word(word, factor) for word in text.split(" "))


def _word(word, factor):
    try:
        return f"{factor * float(word):.6g}" if factor != 1 else word.removeprefix("felt.").replace("_mm", "")
    except ValueError:
        return word


def file_content(part, name):
    """The bytes of the file NAME that a part of the library writes of itself."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, name)
        part.save(path)
        with open(path, "rb") as file:
            return file.read()


def read_content(content, name, read):
    """What `read` makes of a file NAME with these bytes."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, name)
        with open(path, "wb") as file:
            file.write(content)
        return read(path)


class Names(dict):
    """A dict of results: a key of release 0.3 that has changed is an error with the new one."""

    def new_name(self, key):
        """The key that an old one is called now; None if there is none."""
        now = ".".join(_core._new_name("key", part) or part for part in str(key).split("."))
        return now if now != key and now in self else None

    def __missing__(self, key):
        now = self.new_name(key)
        raise KeyError(f"{key} is called {now}" if now else key)


def named(value):
    """Dicts, and those in lists and dicts, as `Names`."""
    if isinstance(value, dict):
        return Names((key, named(item)) for key, item in value.items())
    return [named(item) for item in value] if isinstance(value, list) else value


def require(part, kind, argument):
    """Raises a TypeError unless the argument is of this kind."""
    if not isinstance(part, kind):
        raise TypeError(f"{argument} must be a touchfield.{kind.__name__}, not {type(part).__name__}")
