"""What the extension has, as users see it: with signatures, plain errors, and the methods that Python adds."""

import ast
import collections.abc
import inspect
import numbers
import os
import re

from . import _core

# Of an annotation: what it is called, one and several, and its types.
_KINDS = {"int": ("an int", "ints", numbers.Integral), "float": ("a number", "numbers", numbers.Real), "str": ("a str", "texts", str),
          "bool": ("a bool", "flags", bool), "None": ("None", "", type(None)), "dict": ("a dict", "dicts", dict),
          "os.PathLike": ("an os.PathLike", "paths", (os.PathLike, bytes)), "tuple": ("a tuple", "tuples", tuple),
          "numpy.typing.ArrayLike": ("an array", "arrays", object), "collections.abc.Mapping": ("a dict", "dicts", dict),
          "collections.abc.Sequence": ("a list", "lists", collections.abc.Iterable)}
_TOO_LARGE = {"int": 2**31, "float": 2**1023}


def extends(part):
    """A decorator: moves the methods of a class to its base, a class of the extension, so that all instances have them."""
    for name, value in vars(part).items():
        if name == "__reduce__" or not name.startswith("__"):
            setattr(part.__base__, name, value)
    return part.__base__


class _Bare(str):
    """An annotation without quotation marks."""

    def __repr__(self):
        return str(self)


def _bare(annotation):
    return _Bare(re.sub(r"\b(touchfield\.)?_core\.|\btouchfield\.", "", annotation))


def _signature(function):
    """Of a function of the extension: with defaults and what it returns; and what its arguments must be."""
    text, _, defaults = function.__nb_signature__[0]
    text, _, result = text.partition(" -> ")
    node = ast.parse(re.sub(r"\\=?(\d+)", r"given[\1]", text) + ": ...").body[0]
    kinds = {}
    for argument in ast.walk(node.args):
        if isinstance(argument, ast.arg) and argument.annotation:
            kinds[argument.arg] = _bare(ast.unparse(argument.annotation))
            argument.annotation = None
    made = {"given": defaults}
    exec(compile(ast.Module([node], []), function.__name__, "exec"), made)
    return inspect.signature(made[node.name]).replace(return_annotation=_bare(result)), kinds


def _kind(part):
    """Of a part of an annotation: its words, its types and the annotation of its items."""
    outer, _, items = part.removesuffix("]").partition("[")
    if outer not in _KINDS:
        kind = getattr(_core, outer, None)
        return ("an object", None, "") if kind is None else (f"a touchfield.{outer}", kind, "")
    one, _, types = _KINDS[outer]
    items = items.split(", ")[-1]
    return one + (f" of {_KINDS[items][1]}" if items in _KINDS else ""), types, items


def _fits(value, part):
    _, types, items = _kind(part)
    if types is None or value is None:
        return types is None or part == "None"
    if not isinstance(value, types) or items and isinstance(value, str):
        return False
    if items in _KINDS and isinstance(value, dict) and not all(isinstance(key, str) for key in value):
        return False
    if part in _TOO_LARGE:
        return not isinstance(value, int) or abs(value) < _TOO_LARGE[part]
    return not items or all(_fits(item, items) for item in _items(value))


def _items(value):
    return value.values() if isinstance(value, dict) else value


def _shown(value, parts):
    """What was given in place of these."""
    if isinstance(value, int) and _TOO_LARGE.keys() & set(parts):
        return "one so large"
    inner = {type(item).__name__ for item in _items(value)} if isinstance(value, (list, tuple, dict)) else ()
    return type(value).__name__ + (f" of {', '.join(sorted(inner))}" if inner else "")


def _misfit(name, signature, kinds, given, named):
    """The error of a call whose arguments do not fit; None if all do."""
    for argument in named:
        if now := _core._new_name("argument", argument):
            return f"{name}: the argument {argument} is called {now}"
        if argument not in signature.parameters:
            return f"{name}() got an unexpected keyword argument '{argument}'"
    try:
        arguments = signature.bind(*given, **named).arguments
    except TypeError as misfit:
        return f"{name}(): {misfit}"
    for argument, value in arguments.items():
        parts = list(dict.fromkeys(re.split(r" \| (?![^\[]*\])", kinds.get(argument, "object"))))
        if not any(_fits(value, part) for part in parts):
            *first, last = [_kind(part)[0] for part in parts]
            words = f"{', '.join(first)} or {last}" if first else last
            return f"{name}: {argument} must be {words}, not {_shown(value, parts)}"
    return None


def _exported(function, name):
    """A function of the extension as one of Python's, whose errors name the argument that does not fit."""
    signature, kinds = _signature(function)

    def call(*given, **named):
        try:
            return function(*given, **named)
        except TypeError:
            text = _misfit(name, signature, kinds, given, named)
            if text is None:
                raise
            raise TypeError(text) from None

    call.__signature__, call.__doc__, call.__module__ = signature, function.__nb_signature__[0][1], "touchfield"
    call.__qualname__, call.__name__ = name, name.split(".")[-1]
    return call


def _old_name(self, name):
    """Where an attribute is missing."""
    kind = type(self).__name__
    now = _core._new_name("python", f"{kind}.{name}")
    raise AttributeError(f"{kind}.{name} is called {now}" if now else f"'{kind}' object has no attribute '{name}'")


def _export(value):
    """A function or class of the extension, as the package shows it."""
    if not isinstance(value, type):
        return _exported(value, value.__name__.lstrip("_"))
    for name, member in list(vars(value).items()):
        if type(member).__name__ not in ("nb_func", "nb_method") or name.startswith("__") and name != "__init__":
            continue
        function = _exported(member, value.__name__ if name == "__init__" else f"{value.__name__}.{name.lstrip('_')}")
        setattr(value, name, staticmethod(function) if type(member).__name__ == "nb_func" and name != "__init__" else function)
        if name == "__init__":
            value.__signature__ = inspect.Signature(list(function.__signature__.parameters.values())[1:])
    value.__getattr__ = _old_name
    value.__copy__ = value.__deepcopy__ = lambda self, *memo: self  # parts of the library never change
    value.__module__ = "touchfield"
    return value


for _name, _value in list(vars(_core).items()):
    if type(_value).__name__ == "nb_func" or isinstance(_value, type) and not issubclass(_value, BaseException):
        setattr(_core, _name, _export(_value))
