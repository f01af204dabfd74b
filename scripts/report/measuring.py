"""Lets measuring scripts use the series and meshes of the tests."""

import os
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]


def begin(words):
    """Prints `words` for --help. Otherwise makes the modules of the tests importable; the first argument is the program."""
    if {"-h", "--help"} & set(sys.argv[1:]):
        print(words, end="")
        sys.exit()
    os.environ["TOUCHFIELD_PROGRAM"] = sys.argv[1] if len(sys.argv) > 1 else str(ROOT / "build/release/apps/touchfield")
    os.environ["TOUCHFIELD_SOURCE_DIR"] = str(ROOT)
    sys.path.insert(0, str(ROOT / "tests/cli"))
