"""`live`: a scene that moves on the wall clock, without a device and through the guard of `send`."""

import csv
import http.client
import json
import os
import pathlib
import signal
import subprocess
import sys
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "hardware"))

from support import PROGRAM, CommandTest  # noqa: E402
from sonicsurface_board import OFF, Board  # noqa: E402

SCENE = """\
name: swing
array: {sonicsurface: {}}
body:
  sphere: {radius_mm: 8}
  place: {landmark: bottom, at_mm: [0, 0, 80]}
  edge_mm: 4
target: {box: {at: bottom, size_mm: [6, 6, 4]}, pressure_pa: 500}
solve: {methods: [surface, {unscattered: {faces: area}}], scheme: paper_corrected}
evaluation: none
motion:
  seconds: 2
  frames_hz: 10
  stale_ms: 5000
  change: [{path: 'body.place.at_mm[0]', sine: {amplitude: 5, hz: 1}}]
"""

FULL = ["--max-level", "1"]  # the board has no other level
DEVICE_FAILED = 4


class LiveTest(CommandTest):
    def setUp(self):
        super().setUp()
        self.scene = self.write("scene.yaml", SCENE)

    def live(self, *arguments):
        return json.loads(self.run_ok("live", self.scene, "--method", "unscattered", *arguments, "--json").stdout)


class Dry(LiveTest):
    def test_a_whole_motion(self):
        said = self.live("-o", "out")
        self.assertFalse(said["emitted"])
        self.assertEqual((said["transducers"], said["rate_hz"], said["seconds"]), (256, 10, 2))
        live = said["live"]
        self.assertGreater(live["frames"], 0)
        self.assertEqual(live["frames"] + live["dropped"] + live["waiting"], 20)
        self.assertEqual((live["stale"], live["silences"], live["silent_frames"]), (0, 0, 0))
        self.assertLess(live["solve"]["median_s"], live["latency"]["worst_s"])
        self.assertIn("phases", live["stages"])
        rows = list(csv.DictReader((self.folder / "out/live.csv").read_text().splitlines()))
        self.assertEqual([int(row["frame"]) for row in rows], list(range(live["frames"])))
        sampled = [float(row["sampled_s"]) for row in rows]
        self.assertEqual(sampled, sorted(sampled))
        for row in rows[:-1]:
            self.assertLessEqual(float(row["sampled_s"]), float(row["started_s"]) + 1e-5)
            self.assertLess(float(row["started_s"]), float(row["solved_s"]))
            self.assertLess(float(row["solved_s"]), float(row["shown_s"]))
        self.is_refused("live", self.scene, "--method", "unscattered", "-o", "out")

    def test_without_emit_a_device_hears_nothing(self):
        board = Board()
        self.addCleanup(board.close)
        said = self.live("--seconds", "0.5", "--to", f"sonicsurface:{board.port}", *FULL)
        self.assertGreater(said["live"]["sent"], 0)
        self.assertEqual(bytes(board.heard), b"")

    def test_bad_input(self):
        for change, says in [(["--view", "http"], "--view http must be a whole number, 0 to 65535"),
                             (["--seconds", "3"], "--seconds = 3 must be <= motion.seconds = 2"),
                             (["--level", "0.6"], "--max-level"),
                             (["--set", "motion.frames_hz=90", "--to", "sonicsurface:x", *FULL], "<= 89")]:
            with self.subTest(says=says):
                self.is_refused("live", self.scene, "--method", "unscattered", *change, "-o", "bad", says=says)
                self.assertFalse((self.folder / "bad").exists())
        done = self.touchfield("live", self.scene)
        self.assertIn("the scene has the methods surface, unscattered; --method picks one", done.stderr)


class Viewed(LiveTest):
    def start(self, *arguments):
        process = subprocess.Popen(
            [PROGRAM, "live", str(self.scene), "--method", "surface", "--view", "0", *arguments],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=self.folder)
        for stop in (process.stdout.close, process.stderr.close, lambda: process.wait(20), process.kill):
            self.addCleanup(stop)
        for line in process.stderr:
            if "seen at" in line:
                return process, int(line.rsplit(":", 1)[1])
        self.fail("it never served a page")

    def ask(self, port, path):
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
        self.addCleanup(connection.close)
        connection.request("GET", path)
        answer = connection.getresponse()
        self.assertEqual(answer.status, 200)
        return answer

    @staticmethod
    def event(answer):
        """Its kind and its data."""
        lines = list(iter(lambda: answer.readline().decode().rstrip("\n"), ""))
        fields = dict(line.split(": ", 1) for line in lines)
        return fields.get("event", "message"), fields["data"]

    def test_a_viewer(self):
        process, port = self.start("--set", "motion.predict=linear")
        self.assertIn("<h1>swing: live, a rehearsal without a device</h1>", self.ask(port, "/").read().decode())
        events = self.ask(port, "/events")
        times = []
        for _ in range(3):  # the first may be of a frame that nobody saw
            kind, data = self.event(events)
            self.assertEqual(kind, "message")
            frame = json.loads(data)
            times.append(frame["time"])
            self.assertIn("playing" if frame["sounds"] else "nothing was played yet", frame["state"])
        self.assertEqual(times, sorted(set(times)))
        self.assertLess(frame["strips"]["error of |p| on the skin as sensed [%]"], 100)
        self.assertGreater(frame["skin"]["methods"][0]["p"]["high"], 50)
        self.assertGreaterEqual(frame["tops"]["pressure"], 500)
        while kind == "message":
            kind, data = self.event(events)
        self.assertEqual((kind, data), ("end", "the loop has ended"))
        self.assertEqual(process.wait(20), 0)


class OnABoard(LiveTest):
    def setUp(self):
        super().setUp()
        self.take_board()

    def take_board(self):
        self.board = Board()
        self.addCleanup(self.board.close)
        self.to = ["--to", f"sonicsurface:{self.board.port}", *FULL, "--emit"]

    def start(self, *arguments):
        process = subprocess.Popen(
            [PROGRAM, "live", str(self.scene), "--method", "unscattered", "--set", "motion.seconds=20",
             "--max-seconds", "20", *self.to, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            cwd=self.folder)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.stderr.close)
        self.addCleanup(process.wait, 20)
        self.addCleanup(process.kill)
        self.assertTrue(self.board.wait(lambda b: len([1 for _, p in b.events if set(p) != {OFF}]) > 2, 30),
                        "it never emitted")
        return process

    def silent_after(self, stop):
        start = time.monotonic()
        stop()
        self.assertTrue(self.board.wait(lambda b: b.silent_at is not None), "it is still on")
        self.assertLessEqual(self.board.silent_at - start, 0.5)
        time.sleep(0.3)
        self.assertTrue(self.board.firmware.silent(), "something resumed")
        self.assertEqual(self.board.firmware.faults, [])

    def test_a_whole_motion(self):
        said = self.live(*self.to, "--set", "motion.frames_hz=20")
        self.assertTrue(said["emitted"] and said["silent"])
        self.assertTrue(self.board.wait(lambda b: b.silent_at is not None))
        patterns = self.board.patterns()
        self.assertEqual(len(patterns), said["sent"])
        self.assertGreater(len({tuple(pattern) for pattern in patterns}), 1)
        self.assertEqual(self.board.firmware.faults, [])

    def test_ctrl_c(self):
        process = self.start("-o", "out")
        self.silent_after(lambda: process.send_signal(signal.SIGINT))
        self.assertEqual(process.wait(20), 128 + signal.SIGINT)
        self.assertIn("stopped by SIGINT", process.stderr.read())
        self.assertIn("the array is silent", process.stdout.read())
        self.assertGreater(len((self.folder / "out/live.csv").read_text().splitlines()), 3)

    def test_stopped_for_a_while(self):
        """Program and guard, as in a container that is paused: the loop does not go on by itself."""
        for k in range(5):
            out = self.folder / f"out{k}"
            process = self.start("-o", out, "--json")
            everyone = [process.pid]
            everyone.insert(0, int(pathlib.Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text()))
            for one in everyone:
                os.kill(one, signal.SIGSTOP)
            time.sleep(1)
            if self.board.loud():
                break
            self.take_board()  # one of them saw that another is stopped before it was so itself
        self.silent_after(lambda: [os.kill(one, signal.SIGCONT) for one in everyone])
        printed, said = process.communicate(timeout=20)
        self.assertEqual(process.returncode, DEVICE_FAILED)
        self.assertIn("did not supervise the array for", said)
        report = json.loads(printed)
        self.assertGreaterEqual(report["gaps"], 1)
        self.assertGreater(report["longest_gap_s"], 0.9)
        self.assertFalse(report["silent"])
        self.assertGreater(report["sent"], 0)
        out = out.with_name(f"{out.name}.partial")
        self.assertGreater(len((out / "live.csv").read_text().splitlines()), 3)
        self.assertIn("did not supervise", json.loads((out / "failed.json").read_text())["reason"])

    def test_killed(self):
        process = self.start()
        self.silent_after(process.kill)
        self.assertEqual(process.wait(5), -signal.SIGKILL)
        self.assertIn("the program that drove the array is gone; the array is silent", process.stderr.read())

    def test_unplugged(self):
        process = self.start()
        self.board.unplug()
        self.assertEqual(process.wait(20), DEVICE_FAILED)

    def test_interrupted_while_it_prepares(self):
        process = subprocess.Popen(
            [PROGRAM, "live", str(self.scene), "--method", "surface", "--set", "body.edge_mm=1.2", *self.to, "-o", "out"],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=self.folder)
        self.addCleanup(process.kill)
        for line in process.stderr:
            if "preparing" in line:
                break
        process.send_signal(signal.SIGTERM)
        said = process.communicate(timeout=20)[1]
        self.assertEqual(process.returncode, 128 + signal.SIGTERM, said)
        self.assertIn("interrupted before anything was sent", said)
        self.assertEqual(bytes(self.board.heard), b"")
        self.assertTrue((self.folder / "out.partial/failed.json").exists())


if __name__ == "__main__":
    unittest.main()
