"""What a scene's changes may hold besides what JSON knows."""

import os


def plain(value):
    """NumPy's arrays and numbers as Python's, paths as texts."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    raise TypeError(f"set values must be numbers, strings, lists or dicts, not a {type(value).__name__}")
