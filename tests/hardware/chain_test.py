"""The whole chain: images of depth cameras, the hand that is fitted to them, phases for it, six AUTD3 units that confirm
each frame. The hand is simulated, so where it was when each image was taken is known."""

import csv
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import zlib

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "cli"))

import numpy  # noqa: E402
from autd3_units import Emulator, Observer, Wire, sdk_of  # noqa: E402
from support import PROGRAM, SOURCE, CommandTest, open_run, unittest  # noqa: E402

SDK = sdk_of(SOURCE)
UNITS = 6
PER_UNIT = 249
PATTERN = bytes([0x16, 0, 0, 0, 0, 0, 0xFF, 0, 0, 0, 0, 0, 0, 0, 0])  # at once, bank 0
SECONDS = 3
HZ = 15  # of the images: a third of what two idle cores manage
IMAGES = 45
ARRAY = ["--set", "array={autd3: {layout: [2, 3]}, level: 0.32}"]
# Slow, so that the fit follows it although a busy machine leaves out images; else it searches the whole of the next one.
SWAY = "motion.change=[{path: 'body.place.at_mm[0]', sine: {amplitude: 6, hz: 0.5}}]"
# A mesh as coarse as it may be: it is the chain that counts.
COARSE = ["--set", "body.edge_mm={near_target: 3, far: 7.5, within_mm: 12}", "--set", "solve.allow_coarse_mesh=true", "--set", "solve.iterations=1"]
NEAR_MM = 1.0  # the middle of the sound from the true pad, which sways by 6 mm, up to 1.3 mm from image to image
PATIENT = ["--set", "motion.stale_ms=2000"]  # on a busy machine too
HEIGHT = 0.2  # of the pad above the array [m]
WAVE_NUMBER = 2 * numpy.pi * 40e3 / 343  # [1/m]


def sound_middle(positions, frame):
    """Where the free sound of a frame is, at the height of the pad [mm]: the middle of what has half of its largest
    intensity, found without the program."""
    phase, intensity = numpy.frombuffer(frame, numpy.uint8).reshape(2, -1).astype(float)
    x, y = (1e-3 * axis.ravel() for axis in numpy.meshgrid(numpy.arange(-25, 26), numpy.arange(-25, 26)))
    away = numpy.sqrt((x[:, None] - positions[:, 0]) ** 2 + (y[:, None] - positions[:, 1]) ** 2 + (HEIGHT - positions[:, 2]) ** 2)
    power = abs((numpy.exp(1j * WAVE_NUMBER * away) / away) @ (intensity * numpy.exp(2j * numpy.pi * phase / 256))) ** 2
    power[power < power.max() / 2] = 0
    return 1e3 * numpy.array([x @ power, y @ power]) / power.sum()


class ChainTest(CommandTest):
    @classmethod
    def setUpClass(cls):
        cls.shared = pathlib.Path(tempfile.mkdtemp(prefix="touchfield-chain-"))
        cls.addClassCleanup(shutil.rmtree, cls.shared, ignore_errors=True)
        scene = SOURCE / "scenes/cameras.yaml"
        for command in (["see", scene, "-o", cls.shared / "seen", "--set", f"motion.seconds={SECONDS}", "--set", f"motion.sensor.hz={HZ}", "--set", SWAY],
                        ["run", scene, "-o", cls.shared / "still", *ARRAY, *COARSE, "--set", "motion=null", "--set", "evaluation=null", "--set", "solve.methods=[focus]", "--set", "write=[h5]"]):
            subprocess.run([PROGRAM, *command, "--quiet"], check=True, timeout=500, capture_output=True)
        with open_run(cls.shared / "still") as run:
            cls.positions = run["array/position"][:]
        # The clock of a camera neither begins with the loop nor ticks evenly.
        seen = cls.shared / "seen"
        with open(seen / "landmarks.csv", newline="", encoding="utf-8") as file:
            cls.pads = numpy.array([[float(row[f"index_pad_{axis}_mm"]) for axis in "xyz"] for row in csv.DictReader(file)])
        (seen / "landmarks.csv").unlink()  # nobody knows it but this test
        head, *rows = (seen / "times.csv").read_text().splitlines()
        cls.times = [k / HZ + (k % 3 - 1) * 6e-3 for k in range(len(rows))]
        lines = [f"{1000 + at:.6f},{row.split(',', 1)[1]}" for at, row in zip(cls.times, rows)]
        (seen / "times.csv").write_text("\n".join([head, *lines]) + "\n")

    def play(self, wire, *arguments):
        """What the program says, its table of frames, and what each of them was on the wire."""
        done = self.run_ok("live", SOURCE / "scenes/cameras.yaml", *ARRAY, *COARSE, "--method", "surface", "--set", "motion.change=[]",
                           "--set", f"motion.seconds={SECONDS}", "--set", f"motion.sensor={{hz: {HZ}, recorded: {{folder: {self.shared / 'seen'}}}}}",
                           "--to", f"autd3-udp:[::1]:{wire.port}", "--emit", "-o", self.folder / "out", "--json", "--set", "motion.frames_hz=5", *arguments)
        said = json.loads(done.stdout)
        rows = list(csv.DictReader((self.folder / "out/live.csv").read_text().splitlines()))
        self.assertTrue(said["emitted"] and said["silent"])
        return said["live"], rows, self.received(wire)

    def received(self, wire):
        """Of each frame that all units got, silent ones too: phases and intensities of all transducers, when its first
        byte was on the wire and when the last unit had confirmed it."""
        confirmed = {}  # by unit and number of the message
        for at, down, unit, data in list(wire.datagrams):
            if not down and data[1] == 0:
                confirmed.setdefault((unit, data[2:4]), at)
        units = []
        for unit in range(UNITS):
            found = {}
            for at, down, number, data in list(wire.datagrams):
                if down and number == unit and data[1] == 0 and data[5:].startswith(PATTERN):
                    found.setdefault(data[2:4], (at, data[5 + len(PATTERN):], confirmed.get((unit, data[2:4]))))
            units.append(list(found.values()))
        self.assertEqual({len(found) for found in units}, {len(units[0])}, "some units got another number of frames")
        frames = []
        for parts in zip(*units):
            self.assertNotIn(None, [end for _, _, end in parts], "a frame was not confirmed")
            phases = b"".join(body[:PER_UNIT] for _, body, _ in parts)
            frames.append((phases + b"".join(body[PER_UNIT:] for _, body, _ in parts), min(at for at, _, _ in parts), max(end for _, _, end in parts)))
        return frames

    def check_frames(self, live, rows, frames):
        """That the units got what the program says, in this order, when it says, and for a hand where it was."""
        sent = [row for row in rows if row["shown_s"] != "nan"]
        self.assertEqual(len(rows), live["frames"])
        self.assertEqual(len(sent), live["sent"])
        self.assertEqual(live["sent"] + live["stale"] + live["unsent"], live["frames"])
        loud = [frame for frame in frames if any(frame[0][UNITS * PER_UNIT:])]
        self.assertEqual([f"{zlib.crc32(data):08x}" for data, _, _ in loud], [row["sent_crc32"] for row in sent])
        self.assertEqual(len(frames) - len(loud), live["silences"] + 1, "the other frames are its silences and its end")
        self.assertGreater(len(sent), 0, "no frame came in time: other programs keep the processors busy")
        shown = numpy.array([float(row["shown_s"]) for row in sent])
        sampled = numpy.array([float(row["sampled_s"]) for row in sent])
        began, confirmed = (numpy.array(times) for times in zip(*(frame[1:] for frame in loud)))
        # No frame counts as taken before all units had confirmed it: then the loop would have begun later for it.
        begin = numpy.median(confirmed - shown)
        self.assertLess(numpy.abs(confirmed - shown - begin).max(), 0.03)
        self.assertLess((began - begin - sampled).max(), live["stale_after_s"] + 0.005)
        for data, at in zip((frame[0] for frame in loud), sampled):
            image = int(numpy.argmin(numpy.abs(numpy.array(self.times) - self.times[0] - at)))
            self.assertAlmostEqual(self.times[image] - self.times[0], at, delta=2e-6, msg="no image was taken then")
            off = sound_middle(self.positions, data) - self.pads[image, :2]
            self.assertLess(numpy.abs(off).max(), NEAR_MM, f"the sound is {off} mm off the hand of image {image}")

    def test_images_become_confirmed_frames(self):
        with Emulator(SDK, UNITS) as emulator, Wire(emulator) as wire:
            live, rows, frames = self.play(wire, *PATIENT)
            with Observer(emulator) as observer:
                self.assertEqual([observer.counters(unit)["refused"] for unit in range(UNITS)], [0] * UNITS)
        self.check_frames(live, rows, frames)
        self.assertEqual(live["samples"] + live["overtaken"], IMAGES)
        self.assertEqual(live["lost_frames"], 0)
        self.assertGreater(live["sent"], 3)
        self.assertEqual(set(live["sense_stages"]), {"images", "fit"})


if __name__ == "__main__":
    unittest.main()
