"""check --accuracy: what it says of a mesh, beside the error against the exact series."""

import json
import shutil
import unittest

from sphere_series import plane_wave_errors
from support import FINGER, CommandTest, open_run

SPHERE = """\
name: sphere
array: {plane_wave: {direction: [0, 0, 1]}}
body: {sphere: {radius_mm: 7}, edge_mm: 1.4}
solve: {methods: [{fixed: {phases_rad: 0}}], resonance_check: never}
evaluation: none
write: [h5]
"""


class Accuracy(CommandTest):
    def indicators(self, scene, *sets):
        arguments = [argument for setting in sets for argument in ("--set", setting)]
        printed = json.loads(self.run_ok("check", scene, "--accuracy", "--json", *arguments).stdout)
        return {key.removeprefix("accuracy_"): value for key, value in printed.items() if key.startswith("accuracy_")}

    def test_brackets_the_error_of_a_sphere(self):
        scene = self.write("sphere.yaml", SPHERE)
        before = self.entries()
        for scheme in ["paper", "burton_miller", "burton_miller_polished"]:
            said = self.indicators(scene, f"solve.scheme={scheme}")
            self.assertEqual(self.entries(), before)
            self.run_ok("run", scene, "-o", "out", "--set", f"solve.scheme={scheme}")
            with open_run(self.folder / "out") as run:
                error = plane_wave_errors(run, 7e-3, ["fixed"])["fixed"]
            # Sources inside are nearer to the skin than anything outside: the indicator is the larger. The split mesh
            # shares a part of the error, so that the difference to it is the smaller.
            self.assertTrue(said["split"] < error < 1.5 * said["l2"])
            self.assertTrue(said["l2"] <= said["max"] < 3 * said["l2"])
            self.assertIsNone(said["target_l2"])
            self.assertIsNone(said["split_target"])
            shutil.rmtree(self.folder / "out")

    def test_near_the_target(self):
        scene = self.write("scene.yaml", FINGER)
        said = self.indicators(scene)
        for key in ["l2", "max", "target_l2", "target_max", "split", "split_target"]:
            self.assertTrue(0 < said[key] < 0.15, key)
        told = self.run_ok("check", scene, "--accuracy").stdout
        for phrase in ["16 sources inside", rf"accuracy l2 +{100 * said['l2']:.3g} %", "accuracy split target +[0-9]", r"for 5 percent +\d[\d.]* mm"]:
            self.assertRegex(told, phrase)


if __name__ == "__main__":
    unittest.main()
