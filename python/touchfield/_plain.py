"""What the extension asks of Python, and helpers without a subject of their own."""

import contextlib
import math
import os
import re
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
    raise TypeError(f"set values must be numbers, strings, lists or dicts, not a {type(value).__name__}")


def warn(text, category):
    """Warns at the line that called the package."""
    level, frame = 2, sys._getframe(1)
    while frame is not None and frame.f_globals.get("__name__", "").startswith("touchfield."):
        level, frame = level + 1, frame.f_back
    warnings.warn(text, category, stacklevel=level)


def number(value, argument):
    """A number for an argument of this name."""
    try:
        return float(value)
    except (TypeError, ValueError):
        raise TypeError(f"{argument} must be a number, not {type(value).__name__}") from None


def millimetres(values, argument="lengths"):
    """Lengths in m as scenes have them, without an error of rounding: 10.16e-3 is 10.16."""
    if hasattr(values, "__len__") and not isinstance(values, str) and getattr(values, "shape", None) != ():
        return [millimetres(value, argument) for value in values]
    length = number(values, argument)
    return float(Decimal(repr(length)) * 1000) if math.isfinite(length) else length


_NUMBER = re.compile(r"-?\b\d+(?:\.\d+)?(?:e-?\d+)?\b")
_UNITS = {"_mm": (1e-3, "m"), "_kpa": (1e3, "Pa")}
_FELT = re.compile(r"\bfelt\.(\w+?)(?:_mm)?\b")
_ARGUMENTS = {"source_pa_m": "source_strength", "count[0]": "nx", "count[1]": "ny", "layout[0]": "nx", "layout[1]": "ny", "file": "path"}


@contextlib.contextmanager
def own_arguments(function):
    """Errors of a scene that a function wrote from its arguments speak of those, and of lengths in m."""
    try:
        yield
    except _core.InputError as error:
        raise _core.InputError("\n".join(f"{function}: {_of_argument(line)}" for line in str(error).splitlines())) from None


def _of_argument(line):
    line = re.sub(r"^felt: |^set felt\..*: (?=felt\.)", "", line.replace("_mm in mm", " in m"))
    path, rest = re.fullmatch(r"((?:\w+(?:\[\d+\])*\.)*\w+(?:\[\d+\])*)?(.*)", line, re.DOTALL).groups()
    if not path or "." not in path or not rest.startswith((" = ", ": ")):
        return _FELT.sub(r"\1", line)
    keys = [key for key in path.split(".") if key not in ("felt", "array", "body", "hand", "place", "grid", "autd3", "positions", "medium")]
    name = ".".join(_ARGUMENTS.get(key, re.sub(r"_mm\b|_kpa\b|(?<=^rotate)_deg", "", key)) for key in keys)
    unit = re.search("_mm|_kpa", path)
    short = rest.split("; if ")[0]
    if unit and " mm" not in short and rest.startswith(" = "):
        factor, si = _UNITS[unit[0]]
        rest = _NUMBER.sub(lambda found: f"{factor * float(found[0]):.6g}", short) + f", in {si}"
    return (name or path) + _FELT.sub(r"\1", rest)


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
