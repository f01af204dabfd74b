"""touchfield study: the ladder, what it picks, what it refuses."""

import csv
import json
import math
import unittest

from support import FINGER, CommandTest

SCENE = FINGER.replace("[paper, unscattered, focus, {fixed: {phases_rad: 0}}]", "[paper]")
COLUMNS = ["scheme", "edge_mm", "faces", "precision", "solver", "seconds", "peak_mib", "error_reference",
           "error_interior", "pattern_error", "pareto", "status"]
NUMBERS = ["seconds", "peak_mib", "error_reference", "error_interior", "pattern_error"]
ONE_RUNG = ["--edges-mm", "3.6", "--schemes", "burton_miller", "--solvers", "lu", "--precisions", "double"]


class Study(CommandTest):
    def setUp(self):
        super().setUp()
        self.scene = self.write("scene.yaml", SCENE)

    def rungs(self, out):
        with open(self.folder / out / "study.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        for row in rows:
            self.assertEqual(list(row), COLUMNS)
        return rows

    def test_ladder_of_two_edges_and_two_schemes(self):
        done = self.run_ok("study", self.scene, "-o", "out", "--edges-mm", "2.8,4", "--schemes",
                           "paper,burton_miller_polished")
        rungs = self.rungs("out")
        self.assertEqual({(row["scheme"], row["faces"], row["solver"], row["precision"]) for row in rungs},
                         {(scheme, faces, solver, precision) for scheme in ["paper", "burton_miller_polished"]
                          for faces in {row["faces"] for row in rungs}
                          for solver in ["LU", "GMRES, stored", "GMRES, matrix-free", "GMRES, FFT"]
                          for precision in ["double", "single refined"]})
        self.assertEqual(len(rungs), 32)
        edges = sorted({float(row["edge_mm"]) for row in rungs})
        self.assertEqual(len(edges), 2)
        for edge, asked in zip(edges, [2.8, 4]):
            self.assertAlmostEqual(edge, asked, delta=0.1 * asked)
        errors = {}
        for row in rungs:
            self.assertEqual(row["status"], "ok")
            for column in NUMBERS:
                self.assertGreater(float(row[column]), 0, column)
            errors.setdefault((row["scheme"], float(row["edge_mm"])), []).append(float(row["error_reference"]))
        for same in errors.values():  # how the equations are solved leaves the scheme's error
            self.assertLess(max(same) - min(same), 5e-4)
        for scheme in ["paper", "burton_miller_polished"]:
            self.assertLess(errors[scheme, edges[0]][0], errors[scheme, edges[1]][0])
        self.assertLess(errors["burton_miller_polished", edges[0]][0], errors["paper", edges[0]][0])
        numbers = [(float(row["seconds"]), float(row["error_reference"])) for row in rungs]
        for row, mine in zip(rungs, numbers):
            beaten = any(other != mine and other[0] <= mine[0] and other[1] <= mine[1] for other in numbers)
            self.assertEqual(row["pareto"], "0" if beaten else "1")
        self.assertTrue(done.stdout.startswith("reference: burton_miller_polished, "))
        self.assertGreater((self.folder / "out/study.png").stat().st_size, 1000)

    def test_what_would_take_too_long_is_skipped(self):
        self.run_ok("study", self.scene, "-o", "out", *ONE_RUNG, "--rung-seconds", "1e-7")
        row, = self.rungs("out")
        self.assertTrue(row["status"].startswith("skipped: expected to take"), row["status"])
        self.assertTrue(math.isnan(float(row["error_reference"])))

    def test_an_existing_study_is_kept_without_force(self):
        self.run_ok("study", self.scene, "-o", "out", *ONE_RUNG)
        before = (self.folder / "out/study.csv").read_bytes()
        for command in [["study", self.scene, *ONE_RUNG], ["run", self.scene]]:
            self.is_refused(*command, "-o", "out", says="--force")
        self.assertEqual((self.folder / "out/study.csv").read_bytes(), before)
        printed = json.loads(self.run_ok("study", self.scene, "-o", "out", "--force", *ONE_RUNG, "--json").stdout)
        self.assertEqual([list(rung) for rung in printed["rungs"]], [COLUMNS])

    def test_bad_input_leaves_nothing(self):
        before = self.entries()
        self.is_refused("study", self.scene, "--solvers", "lu,best", says="best must be one of fft, gmres, lu, matrix_free")
        self.is_refused("study", self.scene, "-o", "out", "--schemes", "chief", "--solvers", "gmres", says="study: chief needs lu")
        self.assertEqual(self.entries(), before)


if __name__ == "__main__":
    unittest.main()
