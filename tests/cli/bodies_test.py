"""Bodies of a scene: several of them, edges by place, parts of them, seen otherwise than they are, in the array's way."""

import json
import unittest

import numpy

from meshes import icosphere, write_ply
from support import FINGER, CommandTest, faces, open_run, relative_l2

TWO = """\
name: two
array:
  grid: {count: [8, 8], pitch_mm: 10.16}
bodies:
  - name: finger
    capsule: {radius_mm: 6, length_mm: 6}
    place: {landmark: bottom, at_mm: [0, 0, 60]}
    edge_mm: 2.6
  - name: bead
    sphere: {radius_mm: 4}
    place: {at_mm: [18, 0, 64]}
    edge_mm: 2
target:
  box: {at: finger.bottom, size_mm: [8, 8, 6]}
  pressure_pa: 500
solve:
  methods: [focus]
  resonance_check: never
write: [h5]
"""


class Bodies(CommandTest):
    def refused(self, *arguments):
        done = self.is_refused(*arguments)
        return done.stderr

    def test_two_bodies(self):
        scene = self.write("scene.yaml", TWO)
        self.run_ok("run", scene, "-o", "two")
        with open_run(self.folder / "two") as run:
            owner = run["mesh/body"][:]
            self.assertEqual([str(name) for name in run["mesh"].attrs["bodies"]], ["finger", "bead"])
            centroids, area = faces(run)
            # Each body where it was put; the icosphere of 4 mm has its own area to the sagitta of its faces.
            self.assertAlmostEqual(centroids[owner == 0][:, 2].min(), 0.060, delta=2e-4)
            bead = centroids[owner == 1]
            numpy.testing.assert_allclose(bead.mean(axis=0), [0.018, 0, 0.064], atol=1e-6)
            self.assertAlmostEqual(area[owner == 1].sum(), 4 * numpy.pi * 0.004**2, delta=0.02 * 2e-4)
            self.assertTrue((owner[run["target/face"][:]] == 0).all())
            alone = run["methods/focus/pressure"][:][owner == 0]
        # The other body is heard.
        without = TWO.replace("bodies:\n  - name: finger\n", "body:\n").split("  - name: bead")[0].replace(
            "    ", "  ") + "target:" + TWO.split("target:")[1].replace("finger.bottom", "bottom")
        self.run_ok("run", self.write("one.yaml", without), "-o", "one")
        with open_run(self.folder / "one") as run:
            _, area = faces(run)
            self.assertNotIn("body", run["mesh"])
            difference = relative_l2(area, alone, run["methods/focus/pressure"][:])
            self.assertGreater(difference, 0.02)
            self.assertLess(difference, 1.0)

    def test_a_part_of_a_body(self):
        scene = self.write("scene.yaml", FINGER.replace("length_mm: 10", "length_mm: 60"))
        evaluation = "evaluation={scheme: burton_miller_polished, edge_mm: 2.2}"
        self.run_ok("run", scene, "-o", "part", "--set", "solve.methods=[focus]", "--set", "write=[h5]", "--set",
                    "body.keep_within_mm=24", "--set", evaluation)
        with open_run(self.folder / "part") as run:
            centroids, _ = faces(run)
            # The cap in the side of a cube, which may be 6 % larger or smaller.
            self.assertAlmostEqual(numpy.abs(centroids - [0, 0, 0.060]).max(), 0.024, delta=0.06 * 0.024)
            corners = run["evaluation/mesh/vertices"][:]
            self.assertGreater(numpy.ptp(corners[:, 1]), 0.075)  # 60 mm and the two ends of 8 mm
            difference = run["methods/focus"].attrs["evaluation_difference"]
            # The ends that are missing scatter less than the sound that goes round them: 5 to 20 % here, not 100.
            self.assertGreater(difference, 0.01)
            self.assertLess(difference, 0.4)
        said = self.refused("check", scene, "--set", "body.keep_within_mm=5")  # the box reaches 6 mm
        self.assertRegex(said, r"body\.keep_within_mm: \d+ of the target's \d+ faces are beyond")

    def test_seen_otherwise_than_it_is(self):
        scene = self.write("scene.yaml", FINGER)
        narrow = ["--set", "solve.methods=[paper]", "--set", "write=[h5]"]
        self.run_ok("run", scene, "-o", "still", *narrow, "--set", "sensing={noise_mm_rms: 0}")
        self.run_ok("run", scene, "-o", "moved", *narrow, "--set", "sensing={offset_mm: [0.4, -0.3, 0.5]}")
        self.run_ok("run", scene, "-o", "noisy", *narrow, "--set", "sensing={noise_mm_rms: 0.5, seed: 3}")
        with open_run(self.folder / "still") as run:
            truth = run["mesh/vertices"][:]
            self.assertEqual(run["evaluation"].attrs["evaluation"], "truth")
            # The evaluation solves the same equations again, for one column instead of several.
            self.assertLess(run["methods/paper"].attrs["evaluation_difference"], 2e-4)
        with open_run(self.folder / "moved") as run:
            numpy.testing.assert_allclose(run["mesh/vertices"][:] - truth,
                                          numpy.tile([4e-4, -3e-4, 5e-4], (len(truth), 1)), atol=1e-12)
            numpy.testing.assert_array_equal(run["evaluation/mesh/vertices"][:], truth)
            self.assertGreater(run["methods/paper"].attrs["evaluation_difference"], 0.05)
        with open_run(self.folder / "noisy") as run:
            moved = numpy.linalg.norm(run["mesh/vertices"][:] - truth, axis=1)
            # One draw of some twenty correlation lengths: 0.5 mm within a factor of 1.6.
            self.assertGreater(numpy.sqrt((moved**2).mean()), 0.3e-3)
            self.assertLess(numpy.sqrt((moved**2).mean()), 0.8e-3)
            numpy.testing.assert_array_equal(run["evaluation/mesh/vertices"][:], truth)
            self.assertEqual(run["provenance"].attrs["seeds"], "sensing=3")

    def test_the_point_nearest_the_array(self):
        write_ply(self.folder / "ball.ply", *icosphere(3, 30.0))  # mm
        text = FINGER.replace("capsule: {radius_mm: 8, length_mm: 10}", "mesh: {file: ball.ply, unit: mm}").replace(
            "place: {landmark: bottom, at_mm: [0, 0, 60]}", "place: {at_mm: [0, 5, 90]}").replace(
            "at: bottom", "at: nearest_array").replace("edge_mm: 2.6", "edge_mm: 6")
        scene = self.write("scene.yaml", text.replace("size_mm: [8, 12, 6]", "size_mm: [22, 22, 20]"))
        self.run_ok("run", scene, "-o", "out", "--set", "solve.methods=[focus]", "--set", "write=[h5]", "--set",
                    "solve.allow_coarse_mesh=true")
        with open_run(self.folder / "out") as run:
            centroids, area = faces(run)
            target = run["target/face"][:]
            middle = (area[target, None] * centroids[target]).sum(axis=0) / area[target].sum()
            # Over the array's own points the lowest one is the nearest: (0, 5, 60) mm, less the sagitta of a box that
            # reaches 11 mm to each side.
            numpy.testing.assert_allclose(middle, [0, 0.005, 0.061], atol=4e-3)

    def test_a_run_takes_the_first_mesh_of_a_series(self):
        write_ply(self.folder / "ball.ply", *icosphere(2, 20.0))
        write_ply(self.folder / "later.ply", *icosphere(2, 30.0))
        self.write("times.csv", "file,time_s\nball.ply,0\nlater.ply,0.1\n")
        text = FINGER.replace("place: {landmark: bottom, at_mm: [0, 0, 60]}", "place: {at_mm: [0, 0, 80]}").replace(
            "at: bottom", "at: low").replace("  edge_mm: 2.6\n", "")
        shapes = ["mesh: {file: ball.ply, unit: mm, ", "meshes: {folder: ., times: times.csv, unit: mm, "]
        for name, shape in zip(["mesh", "meshes"], shapes):
            scene = text.replace("capsule: {radius_mm: 8, length_mm: 10}", shape + "landmarks: {low: [0, 0, -20]}}")
            self.run_ok("run", self.write(f"{name}.yaml", scene), "-o", name, "--set", "write=[h5]", "--threads", "1", "--set",
                        "solve.allow_coarse_mesh=true")
        with open_run(self.folder / "mesh") as one, open_run(self.folder / "meshes") as first:
            numpy.testing.assert_array_equal(one["methods/paper/pressure"][:], first["methods/paper/pressure"][:])
        (self.folder / "later.ply").unlink()
        self.assertIn("times.csv:3: file = later.ply must be that of a mesh in",
                      self.refused("run", "meshes.yaml", "-o", "missing"))
        self.assertFalse((self.folder / "missing").exists())

    def test_landmarks_off_the_skin(self):
        write_ply(self.folder / "ball.ply", *icosphere(3, 20.0))
        text = FINGER.replace("place: {landmark: bottom, at_mm: [0, 0, 60]}", "place: {landmark: low, at_mm: [0, 0, 60]}").replace(
            "at: bottom", "at: low").replace("  edge_mm: 2.6\n", "")

        def scene(z):
            shape = f"mesh: {{file: ball.ply, unit: mm, landmarks: {{low: [0, 0, {z}]}}}}"
            return self.write("scene.yaml", text.replace("capsule: {radius_mm: 8, length_mm: 10}", shape))
        for z, noted in [(-22.5, False), (-34.5, True), (-6, True)]:
            said = json.loads(self.run_ok("check", scene(z), "--json").stdout)
            self.assertAlmostEqual(said["landmarks_off_mm"]["low"], abs(z + 20), delta=0.1)
            notes = [line for line in said["notes"] if line.startswith("landmark_off: ")]
            self.assertEqual(len(notes), 1 if noted else 0, z)
        self.assertRegex(notes[0], r"body\.mesh\.landmarks\.low: \(0, 0, -6\) mm is 14 mm off the skin of .*; its nearest point is \(")
        said = self.refused("run", scene(200), "-o", "refused")
        self.assertRegex(said, r"body\.mesh\.landmarks\.low: \(0, 0, 200\) mm is [\d.]+ mm off the skin of .*; it must be within 15 mm")
        self.assertIn(". If it is in metres, write (0, 0, -20) mm", self.refused("check", scene(-0.02)))


if __name__ == "__main__":
    unittest.main()
