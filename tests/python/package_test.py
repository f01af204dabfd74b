"""Runs the tests of the Python package in the environment of scripts/setup_python, which builds it again if the library has changed."""

import os
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "cli"))

from binaries import is_binary, missing_guards, strangers

ROOT = pathlib.Path(os.environ["TOUCHFIELD_SOURCE_DIR"])
PYTHON = ROOT / "build/python/bin/python"
SKIPPED = 77


def installed():
    """The package's folder, or None."""
    found = sorted((ROOT / "build/python").glob("lib/python*/site-packages/touchfield/_core*.so"))
    return found[0].parent if found else None


def is_current(package):
    made = next(package.glob("_core*.so")).stat().st_mtime
    sources = [ROOT / "build/release/libtouchfield.so", ROOT / "python/CMakeLists.txt", ROOT / "python/pyproject.toml"]
    sources += [path for folder in ("src", "touchfield") for path in (ROOT / "python" / folder).iterdir() if path.is_file()]
    return all(path.stat().st_mtime <= made for path in sources)


def main():
    package = installed()
    if package is None:
        print("no build/python: scripts/setup_python makes it")
        return SKIPPED
    if not is_current(package):
        subprocess.run([PYTHON, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-build-isolation", "--no-deps",
                        "--force-reinstall", ROOT / "python"], check=True)
    for path in filter(is_binary, installed().iterdir()):
        assert not (wrong := strangers(path) + missing_guards(path)), f"{path}: {wrong}"
    return subprocess.run([PYTHON, "-m", "pytest", "-q", "-p", "no:cacheprovider", ROOT / "python/tests", *sys.argv[1:]],
                          cwd=ROOT / "python/tests").returncode


if __name__ == "__main__":
    sys.exit(main())
