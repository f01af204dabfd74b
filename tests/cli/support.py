"""What the command-line tests share: running the program, scenes, reading run.h5 as a user would."""

import csv
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

try:
    import h5py
    import numpy
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)

PROGRAM = os.environ["TOUCHFIELD_PROGRAM"]
SOURCE = pathlib.Path(os.environ["TOUCHFIELD_SOURCE_DIR"])

# Of tests that run under the label `long`, which names them.
LONG = unittest.skipUnless("TOUCHFIELD_LONG" in os.environ, "TOUCHFIELD_LONG is not set")

# A finger-like capsule small enough for a run of a second, with more than 3 edges a wavelength: nothing to warn of.
FINGER = (SOURCE / "tests/data/finger.yaml").read_text() + """\
solve:
  methods: [paper, unscattered, focus, {fixed: {phases_rad: 0}}]
  iterations: 8
write: [h5, vtp, vti]
"""


class CommandTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="touchfield-cli-"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def touchfield(self, *arguments, cwd=None, env=None):
        return subprocess.run([PROGRAM, *map(str, arguments)], cwd=cwd or self.folder, env=os.environ | (env or {}),
                              capture_output=True, text=True, timeout=500, check=False)

    def run_ok(self, *arguments, env=None):
        done = self.touchfield(*arguments, env=env)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done

    def is_refused(self, *arguments, says=(), code=2, env=None):
        """The command ends with this code and says these phrases."""
        done = self.touchfield(*arguments, env=env)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        for phrase in [says] if isinstance(says, str) else says:
            self.assertIn(phrase, done.stderr)
        return done

    def refused(self, *arguments, says, leaves=None):
        """Bad input: one screen that says these phrases, and nothing left behind."""
        before = self.entries() if leaves is None else leaves
        done = self.is_refused(*arguments, says=says)
        self.assertLessEqual(len(done.stderr.splitlines()), 24, "more than a screen")
        self.assertEqual((done.stdout, self.entries()), ("", before))

    def write(self, name, text):
        path = self.folder / name
        path.write_text(text)
        return path

    def write_samples(self):
        """The files of tests/run/write_sample_run.cpp: run.h5, self_evaluated.h5 and motion.h5."""
        names = [self.folder / name for name in ("run.h5", "self_evaluated.h5", "motion.h5")]
        subprocess.run([os.environ["TOUCHFIELD_SAMPLES"], *map(str, names)], check=True)

    def entries(self):
        return sorted(str(path.relative_to(self.folder)) for path in self.folder.rglob("*"))


def rows_of(path):
    return list(csv.DictReader(line for line in path.read_text().splitlines() if not line.startswith("#")))


def faces(run):
    """Centroids [M, 3] and areas [M] from a run's mesh."""
    corners = run["mesh/vertices"][:][run["mesh/triangles"][:]]
    return corners.mean(axis=1), run["mesh/area"][:]


def relative_l2(area, value, exact):
    return float(numpy.sqrt(numpy.sum(area * numpy.abs(value - exact) ** 2) / numpy.sum(area * numpy.abs(exact) ** 2)))


def warning_names(said):
    """Names of the warnings on stderr, in order; a warning without one counts as its whole line."""
    lines = [line.split("touchfield: warning: ", 1)[1] for line in said.splitlines() if "touchfield: warning: " in line]
    return [re.sub(r"^([a-z_]+): .*", r"\1", line) for line in lines]


def open_run(folder, name="run.h5"):
    return h5py.File(pathlib.Path(folder) / name, "r")
