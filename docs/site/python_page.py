#!/usr/bin/python3
"""The page of the Python API, from the type stub that the package is installed with: python_page.py STUB > PAGE."""

import ast
import inspect
import pathlib
import re
import sys

# Annotated[NDArray[numpy.float64], dict(shape=(None, 3), ...)] is read as float64[:, 3].
ARRAY = re.compile(r"Annotated\[(?:numpy\.typing\.)?NDArray\[(?:numpy\.)?(\w+)\], dict\((?:shape=\(([^)]*)\))?[^)]*\)\]")


def annotation(node):
    text = ARRAY.sub(lambda found: f"{found[1]}[{(found[2] or '...').rstrip(',').replace('None', ':')}]", ast.unparse(node))
    text = re.sub(r"(?:numpy\.typing\.)?NDArray\[(?:numpy\.)?(\w+)\]", r"\1[...]", text).replace("Any[...]", "ndarray")
    return re.sub(r"\b(?:numpy\.typing|numpy|os|typing|_core)\.(?=\w)", "", text)


def signature(function):
    for argument in [*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs]:
        if argument.annotation:
            argument.annotation = ast.Name(annotation(argument.annotation))
    arguments = ast.unparse(function.args)
    given = re.sub(r"^self(, )?", "", arguments)
    returned = annotation(function.returns) if function.returns else "None"
    name = function.name if function.name != "__init__" else None
    return name, given, returned


def entry(function, owner=""):
    """A line of a list: what is called or read, and what it is."""
    name, given, returned = signature(function)
    what = f"{owner}({given})" if name is None else f"{name}({given}) -> {returned}"
    kinds = [ast.unparse(one) for one in function.decorator_list]
    if "property" in kinds:
        what = f"{name}: {returned}"
    elif "staticmethod" in kinds:
        what = f"{owner}.{what}"
    text = inspect.cleandoc(ast.get_docstring(function) or "").replace("\n", "\n  ")
    return f"- `{what}`" + (f"  \n  {text}" if text else "") + "\n"


def main():
    stub = ast.parse(pathlib.Path(sys.argv[1]).read_text(encoding="utf-8"))
    parts = {"Functions": [], "Errors": []}
    classes = []
    for node in stub.body:
        if isinstance(node, ast.FunctionDef):
            parts["Functions"].append(entry(node))
        elif isinstance(node, ast.ClassDef) and node.bases:
            parts["Errors"].append(f"- `{node.name}` ({', '.join(map(ast.unparse, node.bases))}): {ast.get_docstring(node)}\n")
        elif isinstance(node, ast.ClassDef):
            members = [one for one in node.body if isinstance(one, ast.FunctionDef)
                       and (not one.name.startswith("_") or one.name == "__init__")]
            classes.append(f"\n## {node.name}\n\n{ast.get_docstring(node) or ''}\n\n"
                           + "".join(entry(member, node.name) for member in members))
    print("# Python API\n\nWhat the package `touchfield` has; [its guide](../docs/python.md) shows how to use it.\n"
          "`float64[:, 3]` is a NumPy array of that type and shape.")
    print("\n## Functions\n\n" + "".join(parts["Functions"]) + "".join(classes) + "\n## Errors\n\n" + "".join(parts["Errors"]), end="")


if __name__ == "__main__":
    main()
