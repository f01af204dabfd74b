"""What binutils say of a binary: where the loader looks for libraries before the system's folders, and what guards it."""

import re
import subprocess


def is_binary(path):
    if path.is_symlink() or not path.is_file():
        return False
    with path.open("rb") as file:
        head = file.read(18)
    return head[:4] == b"\x7fELF" and head[16] in (2, 3)  # a program or a shared library


def readelf(option, path):
    return subprocess.run(["readelf", "-W", option, path], capture_output=True, text=True, check=True).stdout


def search_paths(path):
    """Entries of DT_RPATH and DT_RUNPATH."""
    return [entry for paths in re.findall(r"\((?:RPATH|RUNPATH)\).*\[(.*)\]", readelf("-d", path)) for entry in paths.split(":")]


def strangers(path):
    """Search paths that depend on the current folder: empty and relative ones."""
    return [entry for entry in search_paths(path) if not entry.startswith(("/", "$ORIGIN"))]


def missing_guards(path):
    guards = {"PIE": ("-h", r"Type: +DYN"), "RELRO": ("-l", "GNU_RELRO"), "BIND_NOW": ("-d", r"FLAGS_1.*\bNOW\b"),
              "a stack that is not executed": ("-l", r"GNU_STACK .* RW "), "a stack protector": ("--dyn-syms", "__stack_chk_fail")}
    return [name for name, (option, pattern) in guards.items() if not re.search(pattern, readelf(option, path))]
