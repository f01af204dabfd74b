"""A hand that follows tracked joints: a table as the docs write it, and the play of it."""

import csv
import re
import socket
import threading
import unittest

import h5py
import numpy

from support import SOURCE, CommandTest

SCENE = """\
name: joints
array: {grid: {count: [12, 10], pitch_mm: 10.16}}
body:
  hand: {pose: index_up, length_mm: 180, breadth_mm: 84}
  place: {at_mm: [21, -145, 200]}
  edge_mm: {near_target: 3.2, far: 9, within_mm: 8}
  keep_within_mm: 35
target: {box: {at: index_pad, size_mm: [7, 7, 6]}, pressure_pa: 1500}
solve: {methods: [surface], scheme: paper_corrected}
evaluation: none
motion: {seconds: 0.3, frames_hz: 20, solve_ms: 20, score_hz: 10, sensor: {hz: 50}}
"""
MOVED = "motion.change=[{path: 'body.place.at_mm[0]', rate: 30}]"
SENSOR = "motion.sensor.joints={file: hand.csv}"


class Joints(CommandTest):
    def table(self, change=lambda joint: joint):
        """hand.csv of the scene's hand as it moves, by the example of the docs; `change` is made to each joint [m]."""
        text = (SOURCE / "tests/data/index_up_joints.csv").read_text().split("\n", 1)[1]
        rows = list(csv.DictReader(text.splitlines()))
        own = {row["joint"]: numpy.array([float(row[f"{axis}_mm"]) for axis in "xyz"]) for row in rows}
        for joint in ("palm", *(f"{finger}_metacarpal" for finger in ("index", "middle", "ring", "little"))):
            own[joint] = numpy.full(3, 1e6)  # not used
        frames = []
        for k in range(16):
            at = numpy.array([21 + 30 * 0.02 * k, -145, 200])
            joints = {name: change(1e-3 * (place + at)) for name, place in own.items()}
            frames.append((0.02 * k, joints if k != 10 else None))
        docs = (SOURCE / "docs/joints.md").read_text()
        example, = [code for code in re.findall(r"```python\n(.*?)```", docs, re.S) if "hand.csv" in code]
        example, changed = re.subn("^frames = .*$", "", example, flags=re.M)
        self.assertEqual(changed, 1)
        exec(example.replace('"hand.csv"', repr(str(self.folder / "hand.csv"))), {"frames": frames})

    def frames(self, folder):
        return list(csv.DictReader((self.folder / folder / "frames.csv").read_text().splitlines()))

    def test_play_is_that_of_an_exact_sensor(self):
        self.table()
        scene = self.write("scene.yaml", SCENE)
        self.run_ok("play", scene, "-o", "exact", "--set", MOVED, "--quiet")
        done = self.run_ok("play", scene, "-o", "tracked", "--set", SENSOR)
        with open(self.folder / "hand.csv", newline="") as file:
            given = list(csv.DictReader(file))
        with h5py.File(self.folder / "tracked/motion.h5") as motion:
            notes = "\n".join(note.decode() for note in motion["notes"][:])
            frames = motion["methods/surface/frames"]
            self.assertEqual(len(frames["joints"]), 20)
            for frame, sampled in enumerate(frames["sampled"]):
                row = given[round(sampled / 0.02)]
                tip = [float(row[f"index_tip_{axis}"] or "nan") for axis in "xyz"]
                numpy.testing.assert_allclose(frames["joints/index_tip"][frame], tip, atol=1e-9)
        self.assertRegex(notes, r"joints: the skeleton is 0\.0\d mm rms off the tracked joints")
        self.assertIn("lost: of 16 frames 1 have no hand", notes)
        self.assertIn("joints: before the clock starts", done.stderr)
        tracked, exact = self.frames("tracked"), self.frames("exact")
        self.assertEqual([row["lost"] for row in tracked], ["0", "0", "0", "0", "1", "0"])
        for ours, theirs in zip(tracked, exact):
            if ours["lost"] == "0":
                # What the solver is left with, on skins that differ by up to 0.2 mm.
                self.assertAlmostEqual(float(ours["cost"]) / float(theirs["cost"]), 1, delta=0.03)
                self.assertEqual(ours["sampled_s"], theirs["sampled_s"])

    def test_live_takes_joints_from_a_port(self):
        """Rows of a table without header, sent by the example of the docs while it plays."""
        self.table()
        with open(self.folder / "hand.csv", newline="") as file:
            first = list(csv.reader(file))[1]
        docs = (SOURCE / "docs/joints.md").read_text()
        example, = [code for code in re.findall(r"```python\n(.*?)```", docs, re.S) if "sendto" in code]
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        example, changed = re.subn("9000", str(port), example)
        self.assertEqual(changed, 1)
        names = {"row": first}
        exec(example, names)
        self.addCleanup(names["sender"].close)
        done = threading.Event()

        def track():
            while not done.wait(0.02):
                names["send"](first)

        tracker = threading.Thread(target=track)
        tracker.start()
        try:
            scene = self.write("scene.yaml", SCENE)
            sensor = f"motion.sensor.joints={{listen: {port}}}"
            ended = self.run_ok("live", scene, "--set", sensor, "--to", "dry-run", "-o", "live")
        finally:
            done.set()
            tracker.join()
        self.assertIn("the lengths of the hand's bones were learnt from", ended.stderr)
        rows = list(csv.DictReader((self.folder / "live/live.csv").read_text().splitlines()))
        self.assertEqual({row["lost"] for row in rows}, {"0"})
        self.is_refused("play", scene, "--set", sensor, says="joints come by a port only while `touchfield live` plays")

    def test_refused(self):
        scene = self.write("scene.yaml", SCENE)
        self.table(lambda joint: joint * (-1, 1, 1))
        self.is_refused("check", scene, "--set", SENSOR, says="the joints are the mirror image of a right hand")
        self.table()
        table = (self.folder / "hand.csv").read_text()
        # Results never take the place of what they are made of.
        self.write("frames.csv", table)
        self.is_refused("play", scene, "--set", SENSOR.replace("hand.csv", "frames.csv"), "-o", ".")
        self.assertEqual((self.folder / "frames.csv").read_text(), table)


if __name__ == "__main__":
    unittest.main()
