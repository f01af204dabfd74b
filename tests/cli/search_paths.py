"""Where a binary has the loader look for libraries before the system's folders."""

import re
import subprocess


def is_binary(path):
    if path.is_symlink() or not path.is_file():
        return False
    with path.open("rb") as file:
        head = file.read(18)
    return head[:4] == b"\x7fELF" and head[16] in (2, 3)  # a program or a shared library


def search_paths(path):
    """Entries of DT_RPATH and DT_RUNPATH, by binutils."""
    said = subprocess.run(["readelf", "-d", path], capture_output=True, text=True, check=True).stdout
    return [entry for paths in re.findall(r"\((?:RPATH|RUNPATH)\).*\[(.*)\]", said) for entry in paths.split(":")]


def strangers(path):
    """Those that depend on the current folder: empty and relative ones."""
    return [entry for entry in search_paths(path) if not entry.startswith(("/", "$ORIGIN"))]
