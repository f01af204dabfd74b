"""The Python reference of the package in this Python, a page per subject: PYTHON python_page.py FOLDER."""

import inspect
import pathlib
import re
import sys
import textwrap

import touchfield

# Every public name, on its page. A page does not have two names that differ in case alone, as its anchors are lower case.
SUBJECTS = {
    "running": ("Running", "Scenes, sweeps, motions and patterns. The [keys](../../scenes/README.md) of scenes are those of files.",
                "run scenes scene check study evaluate sweep list_sweep play pattern circle line see fit"),
    "parts": ("Parts", "Bodies, arrays, targets, and the sound between them.",
              "Mesh hand sphere read_mesh Array Wave Target Model transfer scatter Scattering field force surface_slopes skin_waves"),
    "methods": ("Phase methods", "[Phase methods](../../docs/phases.md) compares them. [Gradients](../../docs/python.md#gradients) are for PyTorch and JAX too.",
                "surface radiation lbfgs gs wgs gs_pat eigen focus paper unscattered optimality_bound Problem RadiationProblem Solution"),
    "results": ("Results", "[Metrics](../../docs/metrics.md) defines the numbers.",
                "Run Motion Pattern Felt Sweep Picture read_run read_motion read_sweep compare"),
    "hardware": ("Hardware", "Rules are in [Hardware](../../docs/hardware.md), scans in [Transducers](../../docs/transducers.md).",
                 "send read_scan compare_scan fit_scan fit_calibration Scan Calibration"),
}
INDEX = """# Python API

The public names of the package `touchfield`, in the examples `tf`. [Python](../docs/python.md) is the guide. Lengths are in m, pressures
in Pa, phases in rad, rotations of bodies and arrays in degrees. The time factor is exp(-i omega t).
"""
ERRORS = [name for name in touchfield.__all__ if isinstance(kind := getattr(touchfield, name), type) and issubclass(kind, Exception)]
PLACES = {name: f"{page}.md#{name.lower()}" for page, (*_, names) in SUBJECTS.items() for name in names.split()}
if others := sorted(set(touchfield.__all__) ^ {*PLACES, *ERRORS}):
    sys.exit(f"{__file__}: SUBJECTS and the package of this Python differ in {', '.join(others)}")


def members(kind):
    return {name: getattr(kind, name) for name in vars(kind) if not name.startswith("_") and inspect.getdoc(getattr(kind, name))}


def links():
    """Where names are described: classes, functions, methods by Class.name, errors."""
    places = dict(PLACES) | {name: "../python.md#errors" for name in ERRORS}
    for name, place in PLACES.items():
        if inspect.isclass(kind := getattr(touchfield, name)):
            places |= {f"{name}.{own}": place + own.lower() for own, member in members(kind).items() if inspect.isroutine(member)}
    return places


LINKS = links()


def linked(text, owner="", arguments=()):
    """Names in backticks as links, on one line."""
    def link(found):
        name = found[1].removesuffix("()")
        place = None if name in arguments else LINKS.get(f"{owner}.{name}") or LINKS.get(name)
        return f"[`{found[1]}`]({place})" if place else found[0]

    return re.sub(r"(?<!`)`([\w.]+(?:\(\))?)`(?!`)", link, " ".join(text.split())).replace("|", "\\|")


def linked_type(text):
    text = re.sub(r"\{[^}]*\}", r"`\g<0>`", text)
    return linked(re.sub(r"\b[A-Z]\w+\b", lambda found: f"`{found[0]}`" if found[0] in LINKS else found[0], text))


def called(name, value):
    """A call with the defaults, in lines of 88 characters, and the annotation of its result."""
    signature = inspect.signature(value)
    parameters = [parameter for parameter in signature.parameters.values() if parameter.name != "self"]
    call = f"{name}{signature.replace(parameters=parameters, return_annotation=signature.empty)}"
    result = "" if signature.return_annotation is signature.empty else str(signature.return_annotation)
    return textwrap.fill(call, 88, subsequent_indent=" " * (len(name) + 1), break_on_hyphens=False), result


def items(body):
    """The entries of a section: what stands before its indented text, and that."""
    return [part.partition("\n")[::2] for part in re.split(r"\n(?=\S)", body.strip())]


def example(body):
    lines = [re.sub(r" +# doctest:.*", "", line) for line in body.strip().splitlines()]
    return "\n".join(line[4:] if line.startswith((">>>", "...")) else f"# {line}" if line else line for line in lines)


def entry(name, value):
    """Of a function or class: call, description, and the sections of its docstring."""
    intro, *parts = re.split(r"^(\w+)\n-+\n", inspect.getdoc(value), flags=re.MULTILINE)
    sections = dict(zip(parts[::2], parts[1::2]))
    owner, text, result, arguments = name.partition(".")[0], "", "", ()
    if not inspect.isclass(value) or hasattr(value, "__signature__"):
        call, result = called(name if "." in name else f"tf.{name}", value)
        arguments = inspect.signature(value).parameters
        text = f"```python\n{call}\n```\n\n"
    for paragraph in intro.strip().split("\n\n"):
        text += (paragraph if paragraph.startswith("    ") else linked(paragraph, owner, arguments)) + "\n\n"
    for title in ("Parameters", "Attributes"):
        if title in sections:
            text += f"| {title[:-1]} | Type | |\n| --- | --- | --- |\n"
            for head, said in items(sections[title]):
                names, _, kind = head.partition(" : ")
                names = ", ".join(f"`{one}`" for one in names.split(", "))
                text += f"| {names} | {linked_type(kind)} | {linked(said, owner, arguments)} |\n"
            text += "\n"
    if result not in ("", "None") and "Returns" not in sections and not inspect.isclass(value):
        sections["Returns"] = f"`{result}`" if "[" in result else result
    for title in ("Returns", "Raises"):
        for head, said in items(sections.get(title, "")):
            said = linked(said, owner, arguments)
            text += f"{title} {linked_type(head.replace(' : ', ': '))}{': ' if said else ''}{said}\n\n" if head else ""
    return text + (f"```python\n{example(sections['Examples'])}\n```\n\n" if "Examples" in sections else "")


def class_entry(name, kind):
    bases = [linked(f"A `{base.__name__}`.") + "\n\n" for base in kind.__bases__ if base.__name__ in PLACES]
    text = f"## {name}\n\n{''.join(bases)}{entry(name, kind)}"
    own = members(kind)
    values = [f"| `{member}` | {linked(inspect.getdoc(value), name)} |\n" for member, value in own.items() if isinstance(value, property)]
    text += "| Property | |\n| --- | --- |\n" + "".join(values) + "\n" if values else ""
    return text + "".join(f"### {name}.{member}\n\n{entry(f'{name}.{member}', value)}" for member, value in own.items()
                          if inspect.isroutine(value))


def main(folder):
    index = INDEX
    (folder / "python").mkdir()
    for page, (title, intro, names) in SUBJECTS.items():
        index += f"\n## [{title}](python/{page}.md)\n\n| | |\n| --- | --- |\n"
        text = f"# {title}\n\n{intro}\n\n"
        for name in names.split():
            value = getattr(touchfield, name)
            text += class_entry(name, value) if inspect.isclass(value) else f"## {name}\n\n{entry(name, value)}"
            summary = linked(inspect.getdoc(value).partition("\n\n")[0])
            index += f"| {linked(f'`{name}`')} | {summary} |\n".replace("](", "](python/").replace("python/../", "")
        (folder / f"python/{page}.md").write_text(text)
    index += "\n## Errors\n\n| | |\n| --- | --- |\n"
    index += "".join(f"| `{name}` | {inspect.getdoc(getattr(touchfield, name))} |\n" for name in ERRORS)
    (folder / "python.md").write_text(index)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
