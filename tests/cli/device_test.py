"""The device that computes, through the command line: on machines without a graphics card what is said of one that is
asked for, on those with one the same results as the processor's."""

import json
import unittest

import numpy

from support import FINGER, CommandTest, open_run

SCENE = FINGER.replace("[paper, unscattered, focus, {fixed: {phases_rad: 0}}]", "[surface, paper]").replace(
    "write: [h5, vtp, vti]", "write: [h5]")


class Device(CommandTest):
    found = {}  # by `doctor`, once

    def setUp(self):
        super().setUp()
        self.write("scene.yaml", SCENE)
        if not self.found:
            self.found.update(json.loads(self.run_ok("doctor", "--json").stdout))
        self.card = self.found["card"]["state"]
        self.has_card = self.card.startswith("cuda:0")

    def solve(self, device):
        """Errors of the methods, the devices of all solves, and the card."""
        done = self.run_ok("run", "scene.yaml", "-o", device, "--quiet", "--json", "--device", device)
        errors = [method["relative_error"] for method in json.loads(done.stdout)["methods"]]
        with open_run(self.folder / device) as run:
            return numpy.array(errors), set(run["solves/device"].asstr()[:]), run["provenance"].attrs["card"]

    def test_processor(self):
        _, devices, card = self.solve("cpu")
        self.assertEqual((devices, card), ({"cpu"}, ""))

    def test_a_card_that_is_not_there_ends_it_at_once(self):
        device = "cuda:7" if self.has_card else "cuda"
        for command in ("run", "study"):
            done = self.is_refused(command, "scene.yaml", "-o", "out", "--device", device, code=3, says=f"device {device}: ")
            self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
            self.assertFalse((self.folder / "out").exists())

    def test_card(self):
        if not self.has_card:
            self.skipTest(self.card)
        errors, devices, card = self.solve("cuda")
        self.assertEqual(devices, {"cuda:0"})
        self.assertLess(numpy.abs(errors - self.solve("cpu")[0]).max(), 0.003)
        self.assertIn("CUDA", card)

    def test_little_memory_leaves_the_card(self):
        if not self.has_card:
            self.skipTest(self.card)
        errors, _, _ = self.solve("cuda")
        done = self.run_ok("run", "scene.yaml", "-o", "capped", "--quiet", "--json", "--device", "cuda",
                           env={"TOUCHFIELD_GPU_MEMORY_MB": "2"})
        self.assertIn("the processor continues", done.stderr)
        capped = [method["relative_error"] for method in json.loads(done.stdout)["methods"]]
        self.assertLess(numpy.abs(errors - capped).max(), 0.003)

    def test_an_error_of_the_card_fails_the_case_and_not_the_sweep(self):
        if not self.has_card:
            self.skipTest(self.card)
        self.write("sweep.yaml", "base: scene.yaml\nset: {solve.device: cuda}\ngrid: {solve.iterations: [2, 3, 4]}\n")
        done = self.is_refused("sweep", "sweep.yaml", "-o", "out", "--jobs", "1", env={"TOUCHFIELD_GPU_FAIL_AFTER": "40"}, code=1)
        self.assertIn("3 of 3 cases done, 1 failed", done.stdout + done.stderr)
        self.assertIn("graphics card: a failure that was asked for", done.stdout + done.stderr)
        self.run_ok("sweep", "sweep.yaml", "-o", "out", "--jobs", "1", "--case", "1-3")


if __name__ == "__main__":
    unittest.main()
