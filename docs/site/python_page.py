"""The page of the Python API, as `help` has it, of the package in this Python: PYTHON python_page.py > PAGE."""

import inspect

import touchfield


def entry(name, value):
    """The first paragraph of a docstring as text, the rest as it is laid out."""
    signature = "" if isinstance(value, property) else str(inspect.signature(value)).replace("(self, ", "(").replace("(self)", "()")
    summary, _, rest = inspect.getdoc(value).partition("\n\n")
    return f"`{name}{signature}`\n\n{summary}\n" + (f"\n```text\n{rest}\n```\n" if rest else "")


def class_entry(name, kind):
    members = {own: getattr(kind, own) for own in vars(kind) if not own.startswith("_") and inspect.getdoc(getattr(kind, own))}
    called = entry(name, kind) if hasattr(kind, "__signature__") else inspect.getdoc(kind) + "\n"
    return f"## {name}\n\n{called}\n" + "\n".join(f"### {own}\n\n{entry(f'{name}.{own}', member)}" for own, member in members.items()
                                                if isinstance(member, property) or inspect.isroutine(member))


def main():
    parts = {name: getattr(touchfield, name) for name in sorted(touchfield.__all__)}
    errors = [name for name, value in parts.items() if inspect.isclass(value) and issubclass(value, Exception)]
    print("# Python API\n\nThe contents of the package `touchfield`. [Its guide](../docs/python.md) describes how to use it.\n")
    for name, value in parts.items():
        if inspect.isclass(value) and name not in errors:
            print(class_entry(name, value))
    for name, value in parts.items():
        if not inspect.isclass(value):
            print(f"## {name}\n\n{entry(name, value)}")
    print(f"## Errors\n\n{', '.join(f'`{name}`' for name in errors)}: see [Python](../docs/python.md#good-to-know).")


if __name__ == "__main__":
    main()
