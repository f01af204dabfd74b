"""The program without cameras: all but see, fit and sensors that look."""

import os
import subprocess
import unittest

from support import SOURCE, CommandTest


class WithoutCameras(CommandTest):
    def test_scenes_without_a_sensor_are_checked(self):
        self.run_ok("check", SOURCE / "scenes/capsule.yaml")

    def test_a_sensor_that_looks_is_not_built(self):
        self.is_refused("play", SOURCE / "scenes/cameras.yaml", "-o", "played", code=3,
                        says=["motion.sensor", "built without depth cameras", "-DTOUCHFIELD_CAMERAS=ON"])
        self.assertEqual(self.entries(), [])

    def test_see_and_fit_say_that_they_are_not_built(self):
        for command in (["see", SOURCE / "scenes/cameras.yaml", "-o", "images"], ["fit", "images", "-o", "hand"]):
            self.is_refused(*command, code=3, says=[command[0], "built without cameras", "-DTOUCHFIELD_CAMERAS=ON"])
        self.assertEqual(self.entries(), [])

    def test_it_configures(self):
        done = subprocess.run([os.environ["TOUCHFIELD_CMAKE"], "-S", SOURCE, "-B", self.folder / "build", "-G", "Ninja",
                               "-DTOUCHFIELD_CAMERAS=OFF", "-DTOUCHFIELD_TESTS=OFF"],
                              capture_output=True, text=True, timeout=500, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)


if __name__ == "__main__":
    unittest.main()
