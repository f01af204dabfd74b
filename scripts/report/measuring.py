"""Series and meshes of the tests, for scripts that measure the program with them."""

import os
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]


def begin(words):
    """Says what the script does if asked; else makes the tests' modules importable, for the program that it is given first."""
    if {"-h", "--help"} & set(sys.argv[1:]):
        print(words, end="")
        sys.exit()
    os.environ["TOUCHFIELD_PROGRAM"] = sys.argv[1] if len(sys.argv) > 1 else str(ROOT / "build/release/apps/touchfield")
    os.environ["TOUCHFIELD_SOURCE_DIR"] = str(ROOT)
    sys.path.insert(0, str(ROOT / "tests/cli"))
