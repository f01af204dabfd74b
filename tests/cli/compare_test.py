"""touchfield compare: what it says of runs that are the same, changed, incomplete or damaged, and its exit codes."""

import json
import os
import unittest
import zlib

import h5py
import numpy

from support import FINGER, SOURCE, CommandTest, open_run

SHORT = FINGER.replace("[paper, unscattered, focus, {fixed: {phases_rad: 0}}]", "[paper, focus]").replace(
    "write: [h5, vtp, vti]", "write: [h5]")


def seal(path):
    """Puts the checksum line back at the end of a run.h5 that was changed."""
    data = path.read_bytes()
    path.write_bytes(data + b"touchfield-crc32 %08x\n" % zlib.crc32(data))


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

    def changed_copy(self, name, change):
        """A copy of the run `a` in which change(h5py file) was made."""
        copy = self.folder / name
        copy.write_bytes((self.folder / "a/run.h5").read_bytes())
        with h5py.File(copy, "r+") as run:
            change(run)
        seal(copy)
        return name

    def test_the_quick_scene_twice(self):
        for out in "ab":
            self.run_ok("run", SOURCE / "scenes/quick.yaml", "-o", out, "--quiet", "--set", "write=[h5]", "--set", "target.pressure_pa=300")
        said = self.compared("a", "b", "--tolerance", "1e-6")
        self.assertRegex(said, r"verdict   (identical: |the same to rounding: )")
        self.assertIn("every result is within it", said)
        found = self.as_json("a/run.h5", "b")
        self.assertIn(found["verdict"], ["identical", "same_to_rounding"])
        self.assertEqual(found["scene"], {})
        self.assertNotEqual(*(found["provenance"][run]["command_line"] for run in "ab"))
        self.assertEqual(*(found["provenance"][run]["scene_hash"] for run in "ab"))
        self.assertEqual([method["name"] for method in found["methods"]], ["surface", "paper", "unscattered", "focus"])
        self.assertEqual([field["name"] for field in found["fields"]], ["side"])
        self.assertIsNone(found["within_tolerance"])

    def test_a_run_is_identical_to_itself(self):
        self.run_scene("a")
        self.assertIn("verdict   identical", self.compared("a", "a/run.h5", "--tolerance", "0"))
        found = self.as_json("a", "a", "--tolerance", "0")
        self.assertEqual(found["verdict"], "identical")
        self.assertEqual(found["largest"], {"relative": 0.0, "what": ""})
        self.assertTrue(found["within_tolerance"])

    def test_a_changed_scene_is_named_by_its_key(self):
        self.run_scene("a")
        self.run_scene("b", "--set", "body.place.at_mm=[0,0,65]", "--set", "solve.iterations=9", "--threads", "1")
        said = self.compared("a", "b")
        self.assertRegex(said, r"body\.place\.at_mm\[2\] +60 +65\n")
        self.assertRegex(said, r"solve\.methods\[0\]\.paper\.iterations +8 +9\n")
        self.assertRegex(said, r"mesh +differs by 0\.0\d+ relative\n")
        self.assertRegex(said, "array +the same\n")
        self.assertRegex(said, r"threads +A: \d+\n +B: 1\n")
        self.assertIn("verdict   different", said)
        found = self.as_json("a", "b")
        self.assertEqual(found["scene"]["body.place.at_mm[2]"], {"a": "60", "b": "65"})
        paper = found["methods"][0]
        # The numbers are those of the files, compared here anew.
        with open_run(self.folder / "a") as a, open_run(self.folder / "b") as b:
            area = a["mesh/area"][:]
            p, q = (run["methods/paper/pressure"][:] for run in (a, b))
            overlap = numpy.sum(area * p.conj() * q)
            size = max(numpy.sum(area * abs(p) ** 2), numpy.sum(area * abs(q) ** 2))
            apart = numpy.sqrt(numpy.sum(area * abs(q * overlap.conjugate() / abs(overlap) - p) ** 2) / size)
            self.assertAlmostEqual(paper["pressure"]["relative"], apart, places=10)
            self.assertAlmostEqual(paper["pressure"]["turn_rad"], numpy.angle(overlap), places=10)
            x, y = (run["methods/paper"].attrs["leakage"] for run in (a, b))
            self.assertAlmostEqual(paper["metrics"]["leakage"]["relative"], abs(x - y) / max(x, y), places=12)
            self.assertAlmostEqual(paper["metrics"]["leakage"]["difference"], y - x, places=12)

    def test_tolerance_decides_the_exit_code(self):
        self.run_scene("a")

        def shift(run):
            run["methods/paper/pressure"][...] *= 1.001

        changed = self.changed_copy("changed.h5", shift)
        # 1 - 1/1.001 after the best phase
        self.compared("a", changed)
        self.assertIn("EXCEEDED: pressure of paper differs by 0.001", self.compared("a", changed, "--tolerance", "9e-4", code=1))
        self.assertIn("within it", self.compared("a", changed, "--tolerance", "1.1e-3"))
        self.assertFalse(self.as_json("a", changed, "--tolerance", "9e-4", code=1)["within_tolerance"])
        found = self.as_json(changed, "a", "--tolerance", "1.1e-3")
        self.assertAlmostEqual(found["largest_result"]["relative"], 1 - 1 / 1.001, places=9)
        self.assertEqual(found["largest_result"]["what"], "pressure of paper")
        self.assertEqual(found["verdict"], "different")

    def test_values_that_are_no_numbers(self):
        self.run_scene("a")

        def spoil(run):
            run["methods/paper/pressure"][3] = complex(numpy.nan, 0)

        spoilt = self.changed_copy("spoilt.h5", spoil)
        self.assertIn("verdict   identical", self.compared(spoilt, spoilt))
        found = self.as_json("a", spoilt, "--tolerance", "1e9", code=1)
        self.assertIsNone(found["largest_result"]["relative"])
        self.assertIn("1 of", found["methods"][0]["pressure"]["fault"])

    def test_other_sizes_and_methods(self):
        self.run_scene("a")
        self.run_scene("b", "--set", "body.edge_mm=2.2", "--set", "array.grid.count=[6, 8]",
                       "--set", "solve.methods=[focus, unscattered]")
        said = self.compared("a", "b", "--tolerance", "1", code=1)
        for phrase in [" faces\n", "64 and 48 channels", "in A alone: paper", "in B alone: unscattered", "64 and 48 values"]:
            self.assertIn(phrase, said)
        found = self.as_json("a", "b")
        self.assertEqual(found["methods_in_one_alone"], {"a": ["paper"], "b": ["unscattered"]})

    def test_a_judge_of_its_own_and_a_field(self):
        text = SHORT + ("judge: {scheme: burton_miller, edge_mm: 2.3}\n"
                        "field: [{name: side, plane: xz, through_mm: [0, 0, 60], size_mm: [30, 40], spacing_mm: 2}]\n")
        self.run_scene("a", text=text)
        self.run_scene("b", "--set", "judge.scheme=chief", "--set", "field.0.spacing_mm=3", text=text)
        found = self.as_json("a", "b")
        self.assertEqual(found["judge"]["fault"], "edge by burton_miller and edge by chief")
        self.assertGreater(found["methods"][0]["judge_pressure"]["relative"], 1e-6)
        self.assertEqual(found["fields"][0]["fault"], "other points")

    def test_what_is_no_run_is_bad_input(self):
        self.run_scene("a")
        whole = (self.folder / "a/run.h5").read_bytes()
        flipped = bytearray(whole)
        flipped[len(whole) // 2] ^= 0xFF
        (self.folder / "flipped.h5").write_bytes(flipped)
        (self.folder / "cut.h5").write_bytes(whole[:len(whole) // 2])
        (self.folder / "text.h5").write_text("no run")
        os.mkdir(self.folder / "empty")
        for bad, says in [("flipped.h5", "is damaged"), ("cut.h5", "is cut off"), ("text.h5", "is not an HDF5 file"),
                          ("empty", "empty/run.h5"), ("missing.h5", "missing.h5")]:
            for pair in [("a", bad), (bad, "a")]:
                done = self.touchfield("compare", *pair, "--tolerance", "1")
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertIn(says, done.stderr)
                self.assertIn(bad, done.stderr)
                self.assertEqual(done.stdout, "")

    def test_command_line(self):
        self.run_scene("a")
        for arguments in [("a",), (), ("a", "a", "a"), ("a", "a", "--tolerance", "-1"), ("a", "a", "--tolerance", "x")]:
            self.assertEqual(self.touchfield("compare", *arguments).returncode, 2, arguments)


class Points(CommandTest):
    """A run against measured points."""

    SCAN = SHORT + "field: [{name: below, plane: xz, through_mm: [0, 0, 40], size_mm: [40, 60], spacing_mm: 5}]\n"

    def scan(self, name, factor, complex_values):
        """Writes the run's own field on its grid as somebody else would have measured it, scaled and turned."""
        with h5py.File(self.folder / "a/run.h5") as run:
            grid = run["field/below"]
            values = factor * grid["pressure/focus"][:]
            inside = grid["inside"][:]
            rows = ["x_mm,y_mm,z_mm," + ("p_re,p_im" if complex_values else "p_pa")]
            for z, y, x in numpy.ndindex(values.shape):
                at = 1e3 * (grid["origin"][:] + grid["spacing"][:] * [x, y, z])
                p = values[z, y, x]
                rows.append(",".join(f"{v:.12g}" for v in [*at, *([p.real, p.imag] if complex_values else [abs(p)])]))
        self.write(name, "\n".join(rows) + "\n")
        return int((inside == 0).sum()), len(rows) - 1

    def test_a_scan_of_the_run_itself_fits(self):
        self.run_ok("run", self.write("scene.yaml", self.SCAN), "-o", "a", "--quiet")
        for complex_values in (True, False):
            outside, points = self.scan("scan.csv", 0.02 * numpy.exp(0.5j), complex_values)
            done = self.run_ok("compare", "a", "--points", "scan.csv", "--method", "focus", "--out", "rows.csv",
                               "--picture", "plot.png", "--force", "--tolerance", "1e-6", "--json")
            found = json.loads(done.stdout, parse_constant=self.fail)
            self.assertAlmostEqual(found["scale"], 0.02, 9)
            self.assertLess(found["relative"], 1e-8)
            self.assertTrue(found["within_tolerance"])
            self.assertEqual(len(found["points"]), points)
            self.assertLessEqual(found["used"], outside)  # those too near the skin do not count
            self.assertGreater(found["used"], 0.8 * outside)
            if complex_values:
                self.assertAlmostEqual(found["turn_rad"], 0.5, 6)
            else:
                self.assertIsNone(found["turn_rad"])
            rows = (self.folder / "rows.csv").read_text().splitlines()
            self.assertEqual(len(rows), points + 1)
            self.assertEqual(sum(row.endswith(",") for row in rows), found["used"])
            self.assertTrue((self.folder / "plot.png").read_bytes().startswith(b"\x89PNG"))
        refused = self.touchfield("compare", "a", "--points", "scan.csv", "--out", "rows.csv")
        self.assertEqual(refused.returncode, 2)
        self.assertIn("rows.csv: the file exists", refused.stderr)
        other = self.touchfield("compare", "a", "--points", "scan.csv", "--method", "paper", "--tolerance", "0.001")
        self.assertEqual(other.returncode, 1)
        self.assertRegex(other.stdout, r"within tolerance +no\n")
        self.assertIn("correlation", other.stdout)

    def test_what_is_no_scan_is_bad_input(self):
        self.run_ok("run", self.write("scene.yaml", SHORT), "-o", "a", "--quiet")
        self.write("bad.csv", "x_mm,y_mm,z_mm,p_pa\n0,0,1,1\n0,0,two,1\n")
        self.write("good.csv", "x_mm,y_mm,z_mm,p_pa\n0,0,10,1\n0,0,20,1\n")
        for arguments, says in [(("--points", "bad.csv"), "bad.csv:3: z_mm = two must be a number"),
                                (("--points", "none.csv"), "none.csv"),
                                (("--points", "good.csv", "--method", "gs"), "method gs"),
                                (("--points", "good.csv", "--picture", "plot.jpg"), "plot.jpg"),
                                (("--points", "good.csv", "--out", "x.png", "--picture", "x.png"), "--out and --picture are both x.png"),
                                (("a", "--points", "good.csv"), "--points"),
                                (("--out", "rows.csv"), "--points")]:
            done = self.touchfield("compare", "a", *arguments)
            self.assertEqual(done.returncode, 2, done.stdout)
            self.assertIn(says, done.stderr)
        self.assertFalse((self.folder / "rows.csv").exists())


class Repeat(CommandTest):
    def test_a_run_is_repeated_from_its_file_alone(self):
        scene = self.write("scene.yaml", FINGER)
        self.run_ok("run", scene, "-o", "first", "--quiet", "--set", "array.level=0.5", "--threads", 1)
        scene.unlink()
        for source in ("first", "first/run.h5"):
            self.run_ok("run", "--from", source, "-o", "again", "--force", "--quiet", "--threads", 1)
            said = self.run_ok("compare", "first", "again", "--tolerance", "0").stdout  # the same program and threads
            self.assertIn("identical", said)
        changed = self.touchfield("run", "--from", "first", "-o", "other", "--quiet", "--set", "array.level=0.6")
        self.assertEqual(changed.returncode, 0, changed.stderr)
        self.assertRegex(self.run_ok("compare", "first", "other").stdout, r"\n +array.level +0.5 +0.6\n")
        both = self.touchfield("run", "scene.yaml", "--from", "first")
        self.assertEqual(both.returncode, 2)
        self.assertIn("--from", both.stderr)


if __name__ == "__main__":
    unittest.main()
