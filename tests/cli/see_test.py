"""Depth images of simulated cameras from the command line: the folder, that a seed repeats it, what is refused."""

import json
import pathlib
import unittest

from support import FINGER, CommandTest

SEEN = FINGER + """\
motion:
  seconds: 0.1
  change: [{path: "body.place.at_mm[0]", rate: 40}]
  sensor:
    hz: 30
    cameras:
      - {at_mm: [200, 0, -150], look_at_mm: [0, 0, 65], resolution: [160, 90], place_error_mm: 2}
      - {model: d405, at_mm: [-100, 50, -40], look_at_mm: [0, 0, 65], resolution: [160, 120], depth_unit_mm: 0.1}
"""


class See(CommandTest):
    def test_folder(self):
        scene = self.write("scene.yaml", SEEN)
        said = json.loads(self.run_ok("see", scene, "-o", "out", "--json").stdout)
        self.assertEqual(said["frames"], 3)
        out = self.folder / "out"
        times = [line for line in (out / "times.csv").read_text().splitlines() if not line.startswith("#")]
        self.assertEqual([row.split(",")[0] for row in times[1:]], ["0", "0.033333", "0.066667"])
        for row in times[1:]:
            for name in row.split(",")[1:]:
                self.assertTrue((out / name).is_file(), name)
        self.assertTrue((out / "cameras.yaml").is_file())
        self.assertGreater((out / "sight.png").stat().st_size, 5000)
        # The capsule's middle is 68 mm above the array's, 296 mm from the camera.
        seen = said["cameras"][0]
        self.assertGreater(seen["pixels"], 50)
        self.assertTrue(282 < seen["nearest_mm"] < seen["farthest_mm"] < 298, seen)
        self.run_ok("see", scene, "-o", "again")
        self.run_ok("see", scene, "-o", "other", "--set", "motion.sensor.seed=2")
        for name in ("cameras.yaml", "times.csv", "camera_1/000002.png", "camera_2/000001.png"):
            self.assertEqual((self.folder / "again" / name).read_bytes(), (out / name).read_bytes(), name)
        for name in ("cameras.yaml", "camera_1/000002.png", "camera_2/000001.png"):
            self.assertNotEqual((self.folder / "other" / name).read_bytes(), (out / name).read_bytes(), name)

    def test_force_replaces_all_of_it(self):
        scene = self.write("scene.yaml", SEEN)
        self.run_ok("see", scene, "-o", "out")
        self.assertEqual(self.touchfield("see", scene, "-o", "out").returncode, 2)
        self.run_ok("see", scene, "-o", "out", "--force", "--set", "motion.seconds=0.04")
        images = sorted(path.name for path in pathlib.Path(self.folder / "out/camera_1").iterdir())
        self.assertEqual(images, ["000000.png", "000001.png"])

    def test_refused(self):
        scene = self.write("scene.yaml", SEEN)
        for change, named in (("motion.sensor={hz: 30}", "motion.sensor.cameras"),
                              ("motion.sensor.cameras[0].model=d999", "cameras[0].model")):
            self.is_refused("see", scene, "-o", "out", f"--set={change}", says=named)
        self.assertFalse((self.folder / "out").exists())


if __name__ == "__main__":
    unittest.main()
