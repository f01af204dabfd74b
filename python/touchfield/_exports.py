"""What the extension has, as users see it: with signatures, plain errors, and the methods that Python adds."""

import ast
import inspect
import numbers
import re

from . import _core

_KINDS = {"float": numbers.Real, "int": numbers.Integral, "str": str, "bool": bool, "None": type(None)}


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


def _fits(value, part):
    kind = _KINDS.get(part) or getattr(_core, part, None)
    return kind is None or isinstance(value, kind)


def _exported(function, name):
    """A function of the extension as one of Python's, whose errors name the argument that does not fit."""
    signature, kinds = _signature(function)

    def call(*given, **named):
        try:
            return function(*given, **named)
        except TypeError as error:
            if "incompatible function arguments" not in str(error):
                raise
            for argument in named:
                if now := _core._new_name("argument", argument):
                    raise TypeError(f"{name}: the argument {argument} is called {now}") from None
            try:
                arguments = signature.bind(*given, **named).arguments
            except TypeError as misfit:
                raise TypeError(f"{name}(): {misfit}") from None
            for argument, value in arguments.items():
                parts = kinds.get(argument, "").split(" | ")
                if not any(_fits(value, part) for part in parts):
                    words = " or ".join(f"touchfield.{part}" if hasattr(_core, part) else part for part in dict.fromkeys(parts))
                    raise TypeError(f"{argument} must be a {words}, not {type(value).__name__}") from None
            raise

    call.__signature__, call.__doc__, call.__module__ = signature, function.__nb_signature__[0][1], "touchfield"
    call.__qualname__, call.__name__ = name, name.split(".")[-1]
    return call


def _old_name(self, name):
    """Where an attribute is missing."""
    kind = type(self).__name__
    now = _core._new_name("python", f"{kind}.{name}")
    raise AttributeError(f"{kind}.{name} is called {now}" if now else f"'{kind}' object has no attribute '{name}'")


def public(value):
    """A function or class as the package shows it."""
    if type(value).__name__ == "nb_func":
        return _exported(value, value.__name__)
    if value.__module__.endswith("_core") and not issubclass(value, BaseException):
        for name, member in list(vars(value).items()):
            kind = type(member).__name__
            if kind in ("nb_func", "nb_method") and name == "__init__":
                signature = _signature(member)[0]
                value.__signature__ = inspect.Signature(list(signature.parameters.values())[1:])
            elif kind in ("nb_func", "nb_method") and not name.startswith("_"):
                function = _exported(member, f"{value.__name__}.{name}")
                setattr(value, name, staticmethod(function) if kind == "nb_func" else function)
        value.__getattr__ = _old_name
        value.__copy__ = value.__deepcopy__ = lambda self, *memo: self  # parts of the library never change
    value.__module__ = "touchfield"
    return value
