"""The program's commands on the pages run as they stand there, in order, in a folder with files under the names that stand for the
reader's own. What a run computes is coarser, and its `surface` is a focus; boards are stand-ins.

Tutorials run in tutorials_test.py, code in docs_test.py. Scripts, installations and ParaView have tests of their own.
"""

import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import unittest

import h5py
import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "hardware"))

from autd3_units import Emulator  # noqa: E402
from docs_test import PAGES, blocks, spans  # noqa: E402
from live_test import SCENE  # noqa: E402
from sonicsurface_board import Board  # noqa: E402
from support import FINGER, SOURCE, CommandTest  # noqa: E402


def sets(*changes):
    return [part for change in changes for part in ("--set", change)]


SHORT = sets("solve.methods=[{focus: {as: surface}}, focus]", "evaluation=same", "write=[h5]")
# For less pressure a board's transducers would be turned down, which it cannot.
COARSE = [*SHORT, *sets("body.edge_mm=12", "body.keep_within_mm=null", "solve.allow_coarse_mesh=true", "target.pressure_pa=1e6", "field=[]")]
SMALL = sets("body.edge_mm={near_target: 3, far: 12, within_mm: 8}", "array.grid.count=[8, 8]")
SWEPT = tuple(f"scenes/sweeps/{name}.yaml" for name in ("tolerances", "tolerances_grasp", "widths"))  # minutes: docs_test.py checks them
SDK = SOURCE / "build/autd3_sdk/0.12"


def commands(page):
    """Those of the program, as words."""
    lines = "".join(blocks(page, "", "sh")).replace("\\\n", " ").splitlines()
    found = [shlex.split(line, comments=True) for line in lines]
    return [words[1:] for words in found if words[:1] == ["touchfield"]]


class Commands(CommandTest):
    def setUp(self):
        super().setUp()
        shutil.copytree(SOURCE / "scenes", self.folder / "scenes")
        self.board = Board()
        self.addCleanup(self.board.close)
        self.units = Emulator(SDK, 6) if SDK.exists() else None
        if self.units:
            self.addCleanup(self.units.__exit__)

    def adapted(self, words):
        """The command as it is run here; None where it needs units that are not there."""
        words = [word.replace("/dev/ttyUSB0", self.board.port) for word in words]
        if "autd3-udp" in words and self.units:
            words = [f"autd3-udp:[::1]:{self.units.port}" if word == "autd3-udp" else word for word in words]
        if "autd3-udp" in words:
            print("not run:", shlex.join(words))
            return None
        if words[0] == "run":
            return [*words, *COARSE]
        if words[0] == "mesh":
            return ["4" if word == "1.4" else word for word in words]
        if words[0] == "live" and "--seconds" not in words:
            return [*words, "--seconds", "1"]
        if words[0] == "view" and "-o" not in words:
            return [*words, "-o", "page.html"]
        if words[0] == "sweep" and words[1] in SWEPT:
            return None
        if words[0] in ("sweep", "pattern"):
            return [*words, *SMALL]
        return words

    def follow(self, name, count):
        found = commands(SOURCE / "docs" / name)
        self.assertEqual(len(found), count)
        for words in found:
            with self.subTest(command=shlex.join(words)):
                if (run := self.adapted(words)) is not None:
                    self.run_ok(*run)

    def test_every_page_is_here(self):
        own = pathlib.Path(__file__).read_text()
        for page in PAGES:
            if commands(page):
                self.assertRegex(own, rf'follow\("{os.path.relpath(page, SOURCE / "docs")}", [0-9]+\)')

    def test_bodies(self):
        self.run_ok("hand", "-o", "scan.obj", "--edge-mm", "5", "--unit", "m", "--quiet")
        self.run_ok("hand", "-o", "posed_hand.ply", "--edge-mm", "5", "--pose", "grasp", "--quiet")
        self.follow("bodies.md", 3)

    def test_cameras(self):
        self.run_ok("see", "scenes/cameras.yaml", "-o", "recorded", "--quiet",
                    *sets("motion.seconds=0.1", *(f"motion.sensor.cameras[{k}].resolution=[424, 240]" for k in range(3))))
        self.follow("cameras.md", 1)

    def test_hardware(self):
        self.run_ok("run", self.write("finger.yaml", FINGER), "-o", "RUN", "--quiet", *SHORT)
        self.follow("hardware.md", 6)
        self.assertTrue(self.board.heard)

    def test_motion(self):
        self.write("scene.yaml", SCENE.replace("pressure_pa: 500", "pressure_pa: 20000"))  # for which it takes its full level
        self.follow("motion.md", 3)
        self.assertTrue(self.board.heard)

    def test_patterns(self):
        self.follow("patterns.md", 2)

    def test_what_the_skin_does(self):
        self.follow("felt.md", 4)

    def test_radiation(self):
        self.follow("radiation.md", 1)

    def test_sweeps(self):
        self.write("sweep.yaml", "base: scenes/capsule.yaml\nset: {solve.methods: [focus], write: [h5]}\ngrid: {array.level: [0.5, 1]}\n")
        self.run_ok("sweep", "sweep.yaml", "-o", "OUT", "--quiet")
        self.follow("sweeps.md", 1)

    def test_scenes(self):
        self.follow("../scenes/README.md", 4)

    def test_view(self):
        self.follow("view.md", 3)

    def scan(self, path):
        """A plane in the free field of the first method, of transducers that radiate to all sides, by a receiver of 3 mm."""
        with h5py.File(path) as run:
            sources, strength = run["array/position"][:], run["array/amplitude"][:]
            drives = numpy.exp(1j * next(iter(run["methods"].values()))["phase"][:])
        at = numpy.stack(numpy.meshgrid(*2 * [numpy.linspace(-80, 80, 33)], [15.0]), axis=-1).reshape(-1, 3)
        ring = numpy.array([[0, 0, 0], *([3 * numpy.cos(a) * r, 3 * numpy.sin(a) * r, 0] for a in numpy.arange(8) for r in (0.5, 0.866))])
        distance = numpy.linalg.norm(1e-3 * (at[:, None] + ring)[:, :, None] - sources, axis=3)
        p = ((numpy.exp(732.3j * distance) / distance) @ (strength * drives)).mean(axis=1)
        rows = ["{:g},{:g},{:g},{:.6g},{:.6g}\n".format(*x, value.real, value.imag) for x, value in zip(at, p)]
        return "x_mm,y_mm,z_mm,p_re,p_im\n" + "".join(rows)

    def test_transducers(self):
        self.run_ok("run", self.write("finger.yaml", FINGER), "-o", "out", "--quiet", *SHORT,
                    *sets("array.directivity=omni", "body.place.at_mm=[0, 0, 400]"))
        shutil.copy(self.folder / "out/run.h5", self.folder / "RUN.h5")
        self.write("MEASURED.csv", self.scan(self.folder / "RUN.h5"))
        self.follow("transducers.md", 4)
        program, = [body for body in blocks(SOURCE / "docs/transducers.md", "text") if body.startswith("NR == 1")]
        self.assertIn("awk -F, -f draws.awk sweep.csv", spans(SOURCE / "docs/transducers.md"))
        said = subprocess.run(["awk", "-F,", "-f", self.write("draws.awk", program), self.folder / "results/runs/tolerances_capsule/sweep.csv"],
                              capture_output=True, text=True, check=True).stdout
        self.assertRegex(said, r"(?m)^surface: [1-9]\d* draws, mean \d+\.\d\d %, worst \d+\.\d\d %$")

    def test_validation(self):
        self.follow("validation.md", 2)


if __name__ == "__main__":
    unittest.main()
