"""Bad input: a clear message on one screen, exit code 2, nothing left behind."""

import os
import unittest

from support import FINGER, SOURCE, CommandTest

TETRAHEDRON = """\
v 0 0 0
v 20 0 0
v 0 20 0
v 0 0 20
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4
"""

MESH_SCENE = """\
name: mesh
array: {grid: {count: [4, 4], pitch_mm: 10}, at_mm: [0, 0, -60]}
body: {mesh: {file: skin.obj, unit: mm}}
solve: {methods: [{fixed: {phases_rad: 0}}]}
"""


class BadInput(CommandTest):
    def refused(self, *arguments, says, leaves=None):
        before = self.entries() if leaves is None else leaves
        done = self.touchfield(*arguments)
        self.assertEqual(done.returncode, 2, f"{done.stdout}\n{done.stderr}")
        for phrase in [says] if isinstance(says, str) else says:
            self.assertIn(phrase, done.stderr)
        self.assertLessEqual(len(done.stderr.splitlines()), 24, "more than a screen")
        self.assertEqual(done.stdout, "")
        self.assertEqual(self.entries(), before)

    def scene(self, text, name="scene.yaml"):
        return self.write(name, text)

    def test_missing_file(self):
        self.refused("run", "nowhere.yaml", "-o", "out", says="nowhere.yaml")

    def test_misspelt_key_names_its_place_and_the_right_one(self):
        scene = self.scene(FINGER.replace("radius_mm", "radiu_mm"))
        self.refused("run", scene, "-o", "out", says=["scene.yaml:5:13", "radiu_mm", "did you mean radius_mm"])

    def test_wrong_unit_suffix(self):
        scene = self.scene(FINGER.replace("edge_mm", "edge_cm"))
        self.refused("run", scene, "-o", "out", says=["scene.yaml:7:3", "edge_cm", "edge_mm"])

    def test_negative_size(self):
        scene = self.scene(FINGER.replace("[8, 12, 6]", "[-8, 12, 6]"))
        self.refused("run", scene, "-o", "out", says="scene.yaml:9:31: target.box.size_mm[0] = -8 must be > 0")

    def test_all_problems_at_once(self):
        text = FINGER.replace("edge_mm: 2.6", "edge_mm: three").replace("iterations: 8", "iterations: -1")
        self.refused("run", self.scene(text), "-o", "out", says=["body.edge_mm", "solve.iterations"])

    def test_mesh_with_a_hole(self):
        self.write("skin.obj", TETRAHEDRON.replace("f 2 3 4\n", ""))
        self.refused("run", self.scene(MESH_SCENE), "-o", "out", says=["skin.obj", "3 boundary edges"])

    def test_mesh_with_a_nan(self):
        self.write("skin.obj", TETRAHEDRON.replace("v 20 0 0", "v nan 0 0"))
        self.refused("run", self.scene(MESH_SCENE), "-o", "out", says="skin.obj")

    def test_mesh_inside_out(self):
        self.write("skin.obj", TETRAHEDRON.replace("f 1 3 2", "f 1 2 3").replace("f 1 2 4", "f 1 4 2")
                   .replace("f 1 4 3", "f 1 3 4").replace("f 2 3 4", "f 2 4 3"))
        self.refused("run", self.scene(MESH_SCENE), "-o", "out", says=["skin.obj", "inside out"])

    def test_missing_mesh(self):
        self.refused("run", self.scene(MESH_SCENE), "-o", "out", says="skin.obj")

    def test_box_that_contains_no_face(self):
        scene = self.scene(FINGER.replace("{at: bottom,", "{at: bottom, offset_mm: [0, 0, -30],"))
        self.refused("run", scene, "-o", "out", says=["holds the centroid of no face", "the nearest is"])

    def test_box_that_contains_every_face(self):
        scene = self.scene(FINGER.replace("[8, 12, 6]", "[80, 120, 60]"))
        self.refused("run", scene, "-o", "out", says="the boxes hold all")

    def test_array_inside_the_body(self):
        scene = self.scene(FINGER.replace("at_mm: [0, 0, 60]", "at_mm: [5.08, 5.08, -8]"))
        self.refused("run", scene, "-o", "out", says=["transducer", "inside the body"])

    def test_transducer_touching_a_face(self):
        # The lowest point of the skin 0.3 mm above a transducer.
        scene = self.scene(FINGER.replace("at_mm: [0, 0, 60]", "at_mm: [5.08, 5.08, 0.3]"))
        self.refused("run", scene, "-o", "out", says=["transducer", "mm from face", "must be >= 1 mm"])

    def test_unwritable_output(self):
        self.write("file", "in the way")
        scene = self.scene(FINGER)
        self.refused("run", scene, "-o", "file", says="in the way")
        self.refused("run", scene, "-o", "file/out", says="cannot be made")
        self.refused("run", scene, "-o", "/proc/out", says="cannot be made")

    def test_existing_result_without_force(self):
        scene = self.scene(FINGER)
        self.run_ok("run", scene, "-o", "out")
        before = (self.folder / "out/run.h5").read_bytes()
        self.refused("run", scene, "-o", "out", says=["already holds a run", "--force"])
        self.assertEqual((self.folder / "out/run.h5").read_bytes(), before)
        self.write("out/mine.txt", "not of a run")
        self.run_ok("run", scene, "-o", "out", "--force")
        self.assertTrue((self.folder / "out/mine.txt").exists())
        # An interrupted run is one too.
        os.remove(self.folder / "out/run.h5")
        self.refused("run", scene, "-o", "out", says="already holds a run")

    def test_body_too_large_for_the_memory(self):
        scene = self.scene(FINGER.replace("edge_mm: 2.6", "edge_mm: 0.06"))
        self.refused("run", scene, "-o", "out", says=["GiB", "body.edge_mm"])

    def test_fixed_phases_that_do_not_fit(self):
        scene = self.scene(FINGER.replace("phases_rad: 0", "phases_rad: [0, 1, 2]"))
        self.refused("run", scene, "-o", "out", says=["fixed has 3 phases", "64 channels"])

    def test_unknown_landmark(self):
        scene = self.scene(FINGER.replace("landmark: bottom", "landmark: botom"))
        self.refused("run", scene, "-o", "out", says=["botom", "bottom"])

    def test_command_line(self):
        self.refused("run", says="SCENE")
        self.refused("frobnicate", says="frobnicate")
        self.refused("run", self.scene(FINGER), "--threads", "0", says="--threads")
        self.refused("run", self.scene(FINGER), "--set", "solve.iterations", says="solve.iterations", leaves=["scene.yaml"])
        self.refused("info", "nothing.h5", says="nothing.h5", leaves=["scene.yaml"])

    def test_every_shipped_scene_passes_its_check(self):
        scenes = sorted((SOURCE / "scenes").glob("*.yaml"))
        self.assertGreaterEqual(len(scenes), 3)
        for scene in scenes:
            self.run_ok("check", scene)


if __name__ == "__main__":
    unittest.main()
