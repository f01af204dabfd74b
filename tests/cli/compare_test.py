"""touchfield compare: what it says of runs that are the same, changed, incomplete or damaged, and its exit codes."""

import json
import shutil
import unittest
import zlib

import h5py
import numpy

from support import FINGER, CommandTest, open_run

SHORT = FINGER.replace("[paper, unscattered, focus, {fixed: {phases_rad: 0}}]", "[paper, focus]").replace(
    "write: [h5, vtp, vti]", "write: [h5]")


class Compare(CommandTest):
    def run_scene(self, out, *arguments, text=SHORT):
        self.run_ok("run", self.write("scene.yaml", text), "-o", out, "--quiet", *arguments)

    def compared(self, *arguments, code=0):
        done = self.touchfield("compare", *arguments)
        self.assertEqual(done.returncode, code, f"{done.stdout}\n{done.stderr}")
        self.assertEqual(done.stderr, "")
        return done.stdout

    def as_json(self, *arguments, code=0):
        return json.loads(self.compared(*arguments, "--json", code=code), parse_constant=self.fail)

    def test_a_scene_twice(self):
        for out in "ab":
            self.run_scene(out, text=Points.SCAN)
        self.assertIn("every result is within it", self.compared("a", "b", "--tolerance", "1e-6"))
        found = self.as_json("a/run.h5", "b")
        self.assertIn(found["verdict"], ["identical", "same_to_rounding"])
        self.assertEqual(found["scene"], {})
        self.assertEqual(*(found["provenance"][run]["scene_hash"] for run in "ab"))

    def test_a_changed_scene_is_named_by_its_key(self):
        self.run_scene("a")
        self.run_scene("b", "--set", "body.place.at_mm=[0,0,65]", "--set", "solve.iterations=9", "--threads", "1")
        said = self.compared("a", "b")
        self.assertRegex(said, r"body\.place\.at_mm\[2\] +60 +65\n")
        self.assertRegex(said, r"solve\.methods\[0\]\.paper\.iterations +8 +9\n")
        self.assertIn("verdict   different", said)
        paper = self.as_json("a", "b")["methods"][0]
        # The numbers are those of the files, compared here anew.
        with open_run(self.folder / "a") as a, open_run(self.folder / "b") as b:
            area = a["mesh/area"][:]
            p, q = (run["methods/paper/pressure"][:] for run in (a, b))
            overlap = numpy.sum(area * p.conj() * q)
            size = max(numpy.sum(area * abs(p) ** 2), numpy.sum(area * abs(q) ** 2))
            apart = numpy.sqrt(numpy.sum(area * abs(q * overlap.conjugate() / abs(overlap) - p) ** 2) / size)
            self.assertAlmostEqual(paper["pressure"]["relative"], apart, places=10)
            self.assertAlmostEqual(paper["pressure"]["turn_rad"], numpy.angle(overlap), places=10)

    def test_tolerance_decides_the_exit_code(self):
        self.run_scene("a")
        self.assertIn("verdict   identical", self.compared("a", "a/run.h5", "--tolerance", "0"))
        shutil.copy(self.folder / "a/run.h5", self.folder / "changed.h5")
        with h5py.File(self.folder / "changed.h5", "r+") as run:
            run["methods/paper/pressure"][...] *= 1.001
        data = (self.folder / "changed.h5").read_bytes()
        (self.folder / "changed.h5").write_bytes(data + b"touchfield-crc32 %08x\n" % zlib.crc32(data))
        # 1 - 1/1.001 after the best phase
        said = self.compared("a", "changed.h5", "--tolerance", "9e-4", code=1)
        self.assertIn("EXCEEDED: pressure of paper differs by 0.001", said)
        found = self.as_json("changed.h5", "a", "--tolerance", "1.1e-3")
        self.assertAlmostEqual(found["largest_result"]["relative"], 1 - 1 / 1.001, places=9)
        self.assertEqual((found["verdict"], found["within_tolerance"]), ("different", True))


class Points(CommandTest):
    """A run against measured points."""

    SCAN = SHORT + "field: [{name: below, plane: xz, through_mm: [0, 0, 40], size_mm: [40, 60], spacing_mm: 5}]\n"

    def test_a_scan_of_the_run_itself_fits(self):
        """The run's own field on its grid as somebody else would have measured it, scaled and turned."""
        self.run_ok("run", self.write("scene.yaml", self.SCAN), "-o", "a", "--quiet")
        with h5py.File(self.folder / "a/run.h5") as run:
            grid = run["field/below"]
            values, outside = 0.02 * numpy.exp(0.5j) * grid["pressure/focus"][:], int((grid["inside"][:] == 0).sum())
            rows = ["x_mm,y_mm,z_mm,p_re,p_im"]
            for (z, y, x), p in numpy.ndenumerate(values):
                at = 1e3 * (grid["origin"][:] + grid["spacing"][:] * [x, y, z])
                rows.append(",".join(f"{v:.12g}" for v in [*at, p.real, p.imag]))
        self.write("scan.csv", "\n".join(rows) + "\n")
        done = self.run_ok("compare", "a", "--points", "scan.csv", "--method", "focus", "--out", "rows.csv",
                           "--picture", "plot.png", "--force", "--tolerance", "1e-6", "--json")
        found = json.loads(done.stdout, parse_constant=self.fail)
        self.assertAlmostEqual(found["scale"], 0.02, 9)
        self.assertAlmostEqual(found["turn_rad"], 0.5, 6)
        self.assertLess(found["relative"], 1e-8)
        self.assertTrue(0.8 * outside < found["used"] <= outside)  # those too near the skin do not count
        written = (self.folder / "rows.csv").read_text().splitlines()
        self.assertEqual((len(written), sum(row.endswith(",") for row in written)), (len(rows), found["used"]))
        self.assertTrue((self.folder / "plot.png").read_bytes().startswith(b"\x89PNG"))
        other = self.is_refused("compare", "a", "--points", "scan.csv", "--method", "paper", "--tolerance", "0.001", code=1)
        self.assertRegex(other.stdout, r"within tolerance +no\n")


class Repeat(CommandTest):
    def test_a_run_is_repeated_from_its_file_alone(self):
        scene = self.write("scene.yaml", FINGER)
        self.run_ok("run", scene, "-o", "first", "--quiet", "--set", "array.level=0.5", "--threads", 1)
        scene.unlink()
        self.run_ok("run", "--from", "first/run.h5", "-o", "again", "--force", "--quiet", "--threads", 1)
        said = self.run_ok("compare", "first", "again", "--tolerance", "0").stdout  # the same program and threads
        self.assertIn("identical", said)
        self.run_ok("run", "--from", "first", "-o", "other", "--quiet", "--set", "array.level=0.6")
        self.assertRegex(self.run_ok("compare", "first", "other").stdout, r"\n +array.level +0.5 +0.6\n")
        self.is_refused("run", "scene.yaml", "--from", "first", says="--from")


if __name__ == "__main__":
    unittest.main()
