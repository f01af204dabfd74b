#!/usr/bin/python3
"""The page of the Python API, from the sources of the package: python_page.py FOLDER > PAGE."""

import ast
import inspect
import pathlib
import sys

ERRORS = "DeviceError Error InputError IoError NotBuiltError NumericalError TouchfieldNote TouchfieldWarning"


def described(node):
    """The first paragraph as text, the rest as it is laid out."""
    summary, _, rest = inspect.cleandoc(ast.get_docstring(node) or "").partition("\n\n")
    return f"{summary}\n" + (f"\n```text\n{rest}\n```\n" if rest else "")


def function_entry(node, owner=""):
    arguments = ast.unparse(node.args)
    for own in ("self, ", "cls, ", "self", "cls"):
        if owner and arguments.startswith(own):
            arguments = arguments[len(own):]
            break
    kinds = {ast.unparse(one) for one in node.decorator_list}
    called = node.name if "property" in kinds else f"{node.name}({arguments})"
    return f"`{owner + '.' if owner else ''}{called}`\n\n{described(node)}"


def class_entry(node):
    members = [one for one in node.body if isinstance(one, ast.FunctionDef) and not one.name.startswith("_")]
    return f"## {node.name}\n\n{described(node)}\n" + "\n".join(f"### {one.name}\n\n{function_entry(one, node.name)}" for one in members)


def main():
    folder = pathlib.Path(sys.argv[1])
    functions, classes = [], []
    for node in ast.parse((folder / "__init__.py").read_text()).body:
        if not isinstance(node, ast.ImportFrom) or not node.level or node.module in (None, "_core"):
            continue
        known = {item.name: item for item in ast.parse((folder / f"{node.module}.py").read_text()).body if hasattr(item, "name")}
        for item in (known[alias.name] for alias in node.names):
            (functions if isinstance(item, ast.FunctionDef) else classes).append(item)
    print("# Python API\n\nThe contents of the package `touchfield`. [Its guide](../docs/python.md) describes how to use it.\n")
    for item in sorted(classes, key=lambda item: item.name):
        print(class_entry(item))
    for item in sorted(functions, key=lambda item: item.name):
        print(f"## {item.name}\n\n{function_entry(item)}")
    print(f"## Errors\n\n{', '.join(f'`{name}`' for name in ERRORS.split())}: see [Python](../docs/python.md#good-to-know).")


if __name__ == "__main__":
    main()
