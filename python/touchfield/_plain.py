"""What the extension asks of Python, and helpers without a subject of their own."""

import functools
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
    raise TypeError(f"set values must be numbers, strings, lists or dicts, not a {type(value).__name__}")


def warn(text, category):
    """Warns at the line that called the package."""
    level, frame = 2, sys._getframe(1)
    while frame is not None and frame.f_globals.get("__name__", "").startswith("touchfield."):
        level, frame = level + 1, frame.f_back
    warnings.warn(text, category, stacklevel=level)


def millimetres(values):
    """Lengths in m as scenes have them, without an error of rounding: 10.16e-3 is 10.16."""
    if hasattr(values, "__len__"):
        return [millimetres(value) for value in values]
    return float(Decimal(repr(float(values))) * 1000)


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


def new_arguments(function):
    """An argument of release 0.3 that has changed is an error with the new name."""

    @functools.wraps(function)
    def call(*values, **arguments):
        for name in arguments:
            if now := _core._new_name("argument", name):
                raise TypeError(f"{function.__name__}: the argument {name} is called {now}")
        return function(*values, **arguments)

    return call


def require(part, kind, argument):
    """Raises a TypeError unless the argument is of this kind."""
    if not isinstance(part, kind):
        raise TypeError(f"{argument} must be a touchfield.{kind.__name__}, not {type(part).__name__}")
