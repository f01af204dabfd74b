"""Solved patterns on their way to AUTD3 units, through the vendor's own library: to its emulator of the firmware, which
reads back what it holds, and to a server of its remote link, which keeps every byte."""

import contextlib
import json
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "cli"))

import numpy  # noqa: E402
from support import FINGER, PROGRAM, SOURCE, CommandTest, open_run, unittest  # noqa: E402

LIBRARY = pathlib.Path(os.environ.get("TOUCHFIELD_AUTD3_LIBRARY", SOURCE / "build/autd3/libautd3capi.so"))
if not LIBRARY.exists():
    print(f"skipped: there is no AUTD3 library at {LIBRARY}: scripts/setup_autd3 fetches the vendor's")
    sys.exit(77)

# Two patterns from each, on a mesh as coarse as it may be: it is the way of the phases that counts, not their worth.
EDGE_MM = 6
SCENES = ["width_5mm", "width_8mm", "width_11mm", "grasp", "penetration"]
SMALLER = {"grasp": ["body.keep_within_mm=60"]}  # the skin around the pads, not the whole hand
METHODS = {"unscattered": "unscattered", "surface": "{surface: {start: {random: 1}}}"}
UNITS = 6
PER_UNIT = 249
QUIET = numpy.zeros((UNITS * PER_UNIT, 2), dtype=numpy.uint8)


def expected_drives(run, method, level):
    """Bytes [N, 2] of phase and intensity, from what the run holds."""
    phases = run[f"methods/{method}/phase"][:]
    amplitudes = run[f"methods/{method}/amplitude"][:]
    steps = numpy.floor(phases * 256 / (2 * numpy.pi) + 0.5).astype(int) % 256
    return numpy.stack([steps, numpy.floor(level * amplitudes * 255).astype(int)], axis=1).astype(numpy.uint8)


class Server:
    """What the vendor's remote link talks to. A message is one byte of kind and a body, an answer begins with 0.

    It keeps each message, 626 bytes a unit, until the one of number `stop_at`: there it falls silent, or is gone. A mute
    one takes the connection and nothing else."""

    def __init__(self, stop_at=None, gone=False, mute=False):
        self.messages = []  # of 626 bytes for each unit
        self.times = []  # of their arrival
        self.connections = 0
        self.closed = False
        self.stop_at = stop_at
        self.gone = gone
        self.mute = mute
        self.stopped_at = None
        self.end = threading.Event()
        self.socket = socket.create_server(("127.0.0.1", 0))
        self.port = self.socket.getsockname()[1]
        self.thread = threading.Thread(target=self.accept, daemon=True)
        self.thread.start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.end.set()
        self.socket.shutdown(socket.SHUT_RDWR)
        self.socket.close()
        self.thread.join(10)

    def accept(self):
        while not self.end.is_set():
            try:
                client, _ = self.socket.accept()
            except OSError:
                return
            self.connections += 1
            with client, contextlib.suppress(ConnectionError):
                if self.mute:
                    self.end.wait(30)
                else:
                    self.serve(client)

    def serve(self, client):
        stream = client.makefile("rb")
        units = 0
        taken = 0
        while kind := stream.read(1):
            answer = b"\0"
            if kind == b"\x10":  # hello: version and name
                stream.read(13)
            elif kind == b"\x01":  # where the units are
                units = int.from_bytes(stream.read(4), "little")
                stream.read(28 * units)
            elif kind == b"\x03":
                message = [stream.read(626) for _ in range(units)]
                if len(self.messages) == self.stop_at:
                    self.stopped_at = time.monotonic()
                    if not self.gone:
                        self.end.wait(30)
                    return
                self.times.append(time.monotonic())
                self.messages.append(message)
                taken = message[0][0]
            elif kind == b"\x04":  # of each unit: data, and the number of the message that it took
                answer += bytes([0, taken]) * units
            elif kind == b"\x05":
                self.closed = True
            else:
                raise AssertionError(f"unknown kind {kind}")
            client.sendall(answer)

    def holds(self, drives, first=0):
        """The number of the message, from `first` on, in which each unit gets its own drives; None if there is none."""
        wanted = [drives[PER_UNIT * unit : PER_UNIT * (unit + 1)].tobytes() for unit in range(UNITS)]
        for number in range(first, len(self.messages)):
            if all(own in unit for own, unit in zip(wanted, self.messages[number], strict=True)):
                return number
        return None


class Autd3Test(CommandTest):
    @classmethod
    def setUpClass(cls):
        cls.solved = pathlib.Path(tempfile.mkdtemp(prefix="touchfield-autd3-"))
        cls.addClassCleanup(shutil.rmtree, cls.solved, ignore_errors=True)
        for scene in SCENES:
            changes = [f"body.edge_mm={EDGE_MM}", "solve.allow_coarse_mesh=true", "judge=null", "field=[]", "write=[h5]", "solve.iterations=3",
                       f"solve.methods=[{', '.join(METHODS.values())}]", *SMALLER.get(scene, [])]
            command = [PROGRAM, "run", SOURCE / f"scenes/autd3/{scene}.yaml", "-o", cls.solved / scene, "--quiet"]
            for change in changes:
                command += ["--set", change]
            done = subprocess.run(command, capture_output=True, text=True, timeout=500, check=False)
            if done.returncode != 0:
                raise AssertionError(f"{scene}: {done.stderr}")

    def drives(self, scene, level):
        with open_run(self.solved / scene) as run:
            return expected_drives(run, "surface", level)

    @staticmethod
    def child_of(process):
        return int(pathlib.Path(f"/proc/{process}/task/{process}/children").read_text())

    def wait_for(self, look, seconds=10):
        """What `look` finds once it is not None."""
        end = time.monotonic() + seconds
        while (found := look()) is None:
            self.assertLess(time.monotonic(), end, "nothing came")
            time.sleep(0.002)
        return found

    def send(self, runs, to, *arguments):
        runs = [self.solved / run if isinstance(run, str) else run for run in runs]
        return self.touchfield("send", *runs, "--to", to, "--library", LIBRARY, *arguments)

    def send_ok(self, runs, to, *arguments):
        done = self.send(runs, to, "--json", *arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def fails(self, code, runs, to, *arguments):
        done = self.send(runs, to, *arguments)
        self.assertEqual(done.returncode, code, done.stderr + done.stdout)
        return done.stderr

    def test_ten_patterns_are_read_back_from_the_emulator(self):
        drives = []
        for scene in SCENES:
            for method in METHODS:
                with self.subTest(scene=scene, method=method):
                    report = self.send_ok([scene], "autd3-legacy:audit", "--method", method, "--emit", "--seconds", "0.2")
                    self.assertEqual(report["transducers"], UNITS * PER_UNIT)
                    self.assertEqual(report["sent"], 1)
                    self.assertIs(report["read_back"], True)
                    # What it must equal: a dry run's file holds the same bytes as computed here from run.h5.
                    file = self.folder / f"{scene}-{method}.txt"
                    self.send_ok([scene], f"dry-run:{file}", "--method", method)
                    written = [line.split("#")[1].split() for line in file.read_text().splitlines()[1:]]
                    with open_run(self.solved / scene) as run:
                        expected = expected_drives(run, method, report["level"])
                    numpy.testing.assert_array_equal(numpy.array(written, dtype=int), expected)
                    drives.append(expected.tobytes())
        self.assertEqual(len(set(drives)), 10, "ten different patterns")

    def test_a_sequence_is_read_back_frame_by_frame(self):
        report = self.send_ok(SCENES, "autd3-legacy:audit", "--method", "surface", "--emit", "--rate", "10",
                              "--modulation", "200")
        self.assertEqual((report["frames"], report["sent"]), (5, 5))
        self.assertIs(report["read_back"], True)

    def test_every_byte_reaches_a_server(self):
        for scene in SCENES:
            with self.subTest(scene=scene), Server() as server:
                self.send_ok([scene], f"autd3-legacy:remote:127.0.0.1:{server.port}", "--method", "surface", "--emit",
                             "--seconds", "0.2", "--level", "0.4")
                number = server.holds(self.drives(scene, 0.4))
                self.assertIsNotNone(number)
                # And then every transducer off.
                self.assertIsNotNone(server.holds(QUIET, number + 1))
                self.assertTrue(server.closed)

    def test_whatever_ends_it_leaves_a_quiet_array(self):
        drives = self.drives("width_8mm", 0.5)
        for signal_sent, to, code in ((signal.SIGINT, "program", 130), (signal.SIGTERM, "program", 143),
                                      (signal.SIGTSTP, "program", 148), (signal.SIGQUIT, "program", 131),
                                      (signal.SIGKILL, "program", -9), (signal.SIGSTOP, "program", 4),
                                      (signal.SIGUSR1, "guard", 4), (signal.SIGSTOP, "guard", 4),
                                      (signal.SIGSTOP, "watchdog", 4), (signal.SIGKILL, "watchdog", 4)):
            with self.subTest(signal=signal_sent.name, to=to), Server() as server:
                command = [PROGRAM, "send", self.solved / "width_8mm", "--method", "surface", "--library", LIBRARY,
                           "--to", f"autd3-legacy:remote:127.0.0.1:{server.port}", "--emit", "--seconds", "9"]
                with subprocess.Popen(command, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL) as sending:
                    number = self.wait_for(lambda server=server: server.holds(drives))
                    watchdog = self.child_of(sending.pid)
                    target = {"program": sending.pid, "watchdog": watchdog, "guard": self.child_of(watchdog)}[to]
                    self.assertIsNone(server.holds(QUIET, number + 1))
                    start = time.monotonic()
                    os.kill(target, signal_sent)
                    quiet = self.wait_for(lambda: server.holds(QUIET, number + 1))
                    self.assertLess(server.times[quiet] - start, 0.2)
                    sending.send_signal(signal.SIGCONT)
                    self.assertEqual(sending.wait(10), code)
                self.wait_for(lambda server=server: server.closed or None)

    def test_the_watchdog_takes_over_from_a_guard_that_was_killed(self):
        drives = self.drives("width_8mm", 0.5)
        with Server() as server:
            command = [PROGRAM, "send", self.solved / "width_8mm", "--method", "surface", "--library", LIBRARY, "--to",
                       f"autd3-legacy:remote:127.0.0.1:{server.port}", "--emit", "--seconds", "9"]
            with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, stdout=subprocess.DEVNULL) as sending:
                number = self.wait_for(lambda: server.holds(drives))
                os.kill(self.child_of(self.child_of(sending.pid)), signal.SIGKILL)
                self.wait_for(lambda: server.holds(QUIET, number + 1))
                self.assertEqual(sending.wait(10), 4)
                self.assertIn("its guard was ended by SIGKILL; the array is quiet", sending.stderr.read())
            self.assertEqual(server.connections, 2)

    def test_the_emulator_says_that_it_is_quiet(self):
        for signal_sent, to in ((signal.SIGTSTP, "program"), (signal.SIGSTOP, "program"), (signal.SIGQUIT, "guard"),
                                (signal.SIGSTOP, "guard"), (signal.SIGSTOP, "watchdog")):
            with self.subTest(signal=signal_sent.name, to=to):
                command = [PROGRAM, "array", "walk", "--library", LIBRARY, "--to", "autd3-legacy:audit", "--emit", "--count",
                           "2", "--dwell", "4"]
                with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as walking:
                    self.assertIn("transducer 0", walking.stdout.readline())
                    watchdog = self.child_of(walking.pid)
                    target = {"program": walking.pid, "watchdog": watchdog, "guard": self.child_of(watchdog)}[to]
                    start = time.monotonic()
                    os.kill(target, signal_sent)
                    if (signal_sent, to) == (signal.SIGSTOP, "program"):
                        time.sleep(0.15)  # what its guard says meanwhile is read once the program runs again
                        walking.send_signal(signal.SIGCONT)
                    said = next(line for line in walking.stdout if "quiet" in line)
                    seconds = time.monotonic() - start
                    if (signal_sent, to) != (signal.SIGTSTP, "program"):  # which ends as usual: its last line follows `close`
                        self.assertIn("the array is quiet, as it reports itself", said)
                        self.assertLess(seconds, 0.2)
                    self.assertIn(walking.wait(5), (4, 128 + signal_sent))

    def test_the_modulation_reaches_a_server(self):
        # A sine of 200 Hz in samples at 4000 a second repeats after 20.
        sine = numpy.sin(2 * numpy.pi * numpy.arange(20) / 20)
        samples = numpy.round(255 * (1 + sine) / 2).astype(numpy.uint8).tobytes()
        with Server() as server:
            to = f"autd3-legacy:remote:127.0.0.1:{server.port}"
            self.send_ok(["width_8mm"], to, "--method", "surface", "--emit", "--seconds", "0.1")
            self.assertFalse(any(samples in unit for message in server.messages for unit in message))
            self.send_ok(["width_8mm"], to, "--method", "surface", "--emit", "--seconds", "0.1", "--modulation", "200")
            self.assertTrue(any(all(samples in unit for unit in message) for message in server.messages))

    def test_nothing_is_sent_without_leave(self):
        with Server() as server:
            to = f"autd3-legacy:remote:127.0.0.1:{server.port}"
            self.assertFalse(self.send_ok(["width_8mm"], to, "--method", "surface")["emitted"])
            self.fails(2, ["width_8mm"], to, "--method", "surface", "--emit", "--level", "0.6")
            self.fails(2, ["width_8mm"], to, "--method", "surface", "--emit", "--seconds", "11")
            self.fails(2, ["width_8mm"], to, "--method", "surface", "--emit", "--modulation", "3000")
            self.fails(2, ["width_8mm"], to, "--method", "surface", "--emit", "--rate", "1000")
            self.assertEqual(server.connections, 0)

    def test_a_run_of_another_array_is_refused(self):
        scene = self.write("finger.yaml", FINGER)
        self.run_ok("run", scene, "-o", self.folder / "finger", "--quiet", "--set", "write=[h5]")
        old = self.folder / "old"
        self.run_ok("run", scene, "-o", old, "--quiet", "--set", "write=[h5]", "--set", "array.grid=null",
                    "--set", "array.autd3={layout: [1, 1], pitch_mm: 10.18}")
        with Server() as server:
            to = f"autd3-legacy:remote:127.0.0.1:{server.port}"
            said = self.fails(2, [self.folder / "finger"], to, "--method", "focus", "--emit")
            self.assertIn("64", said)
            said = self.fails(2, [old], to, "--method", "focus", "--emit")
            self.assertIn("AUTD3", said)
            self.assertEqual(server.connections, 0)

    def test_a_link_that_breaks_is_a_device_error(self):
        said = self.fails(4, SCENES, "autd3-legacy:audit?break_after=3", "--method", "surface", "--emit")
        self.assertIn("frame 3", said)
        self.assertIn("broken", said)

    def test_a_server_that_is_missing(self):
        with socket.socket() as bound:  # and not listening
            bound.bind(("127.0.0.1", 0))
            said = self.fails(4, ["width_8mm"], f"autd3-legacy:remote:127.0.0.1:{bound.getsockname()[1]}", "--method",
                              "surface", "--emit")
        self.assertIn("refused", said)

    def test_a_server_that_never_answers(self):
        with Server(mute=True) as server:
            start = time.monotonic()
            said = self.fails(4, ["width_8mm"], f"autd3-legacy:remote:127.0.0.1:{server.port}", "--method", "surface",
                              "--emit")
            # It waits 90 ms for an answer; the rest is the program's start on a busy machine.
            self.assertLess(time.monotonic() - start, 5)
        self.assertIn("remote", said)

    def test_a_server_that_ends_mid_stream(self):
        with Server() as whole:
            self.send_ok(["width_8mm"], f"autd3-legacy:remote:127.0.0.1:{whole.port}", "--method", "surface", "--emit",
                         "--seconds", "0.1")
            first = whole.holds(self.drives("width_8mm", 0.5))
        for gone in (True, False):
            with self.subTest(gone=gone), Server(stop_at=first + 2, gone=gone) as server:
                said = self.fails(4, SCENES, f"autd3-legacy:remote:127.0.0.1:{server.port}", "--method", "surface",
                                  "--emit", "--rate", "5")
                self.assertIsNotNone(server.stopped_at)
                # Frames are 0.2 s apart, 3 were still to come: it does not wait for them.
                self.assertLess(time.monotonic() - server.stopped_at, 0.6)
                self.assertIn("frame 2", said)
                self.assertIn("lost", said)

    def test_what_this_machine_does_not_have(self):
        said = self.fails(4, ["width_8mm"], "autd3-legacy:twincat", "--method", "surface", "--emit")
        self.assertIn("Windows", said)
        self.is_refused("send", self.solved / "width_8mm", "--method", "surface", "--to", "autd3-legacy:audit", says="--library")
        self.is_refused("send", self.solved / "width_8mm", "--method", "surface", "--to", "autd3-legacy:audit",
                        "--library", SOURCE / "LICENSE", says="LICENSE")

    def test_a_hand_that_moves_is_read_back_frame_by_frame(self):
        scene = self.write("moving.yaml", """\
name: moving
array: {autd3: {layout: [2, 1]}}
body:
  sphere: {radius_mm: 8}
  place: {landmark: bottom, at_mm: [0, 0, 80]}
  edge_mm: 4
target: {box: {at: bottom, size_mm: [6, 6, 4]}, pressure_pa: 500}
solve: {methods: [{unscattered: {faces: area}}], scheme: paper_corrected}
judge: none
motion:
  seconds: 2
  frames_hz: 10
  stale_ms: 5000
  change: [{path: 'body.place.at_mm[0]', sine: {amplitude: 5, hz: 1}}]
""")
        said = json.loads(self.run_ok("live", scene, "--to", "autd3-legacy:audit", "--library", LIBRARY, "--modulation", "200", "--emit",
                                      "--json").stdout)
        self.assertTrue(said["emitted"] and said["quiet"])
        self.assertGreater(said["sent"], 10)
        self.assertEqual(said["sent"], said["live"]["frames"])


if __name__ == "__main__":
    unittest.main()
