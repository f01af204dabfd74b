"""What the tests share: the program beside the package, a small scene, a run of it."""

import os
import pathlib
import subprocess
import sys
import textwrap

import pytest

# Before OpenMP is loaded, for what has no argument `threads`.
os.environ.setdefault("OMP_NUM_THREADS", "2")
os.environ.setdefault("MPLBACKEND", "agg")

import touchfield as tf

SOURCE = pathlib.Path(os.environ.get("TOUCHFIELD_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))
PROGRAM = os.environ.get("TOUCHFIELD_PROGRAM", str(SOURCE / "build/release/apps/touchfield"))

# A finger-like capsule: a run of a second, every part of a result in it.
FINGER = (SOURCE / "tests/data/finger.yaml").read_text() + """\
solve:
  methods: [surface, {paper: {faces: area}}, focus]
  iterations: 8
  optimality_bound: true
evaluation: {split: 1}
field:
  - {name: side, plane: xz, through_mm: [0, 0, 60], size_mm: [20, 30], spacing_mm: 2}
write: [h5, vtp, vti, png, transfer]
"""


@pytest.fixture(scope="session")
def finger(tmp_path_factory):
    path = tmp_path_factory.mktemp("scene") / "finger.yaml"
    path.write_text(FINGER)
    return path


@pytest.fixture(scope="session")
def run(finger):
    return tf.run(finger, threads=2)


@pytest.fixture(scope="session")
def model(finger):
    return tf.Model(finger)


@pytest.fixture(scope="session")
def touchfield():
    """Calls the program."""

    def call(*arguments, cwd=None):
        return subprocess.run([PROGRAM, *map(str, arguments)], check=True, capture_output=True, text=True, cwd=cwd)

    return call


@pytest.fixture
def python():
    """Runs code in a Python of its own, whose folder for what it writes is `cwd`."""

    def call(code, *arguments, cwd=None, timeout=120):
        done = subprocess.run([sys.executable, "-c", textwrap.dedent(code), *map(str, arguments)], capture_output=True, text=True,
                              cwd=cwd, timeout=timeout)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return call
