"""scripts/paraview.py: its arguments and the reading of series without ParaView; with pvpython its pictures."""

import os
import shutil
import subprocess
import sys
import unittest

from support import FINGER, SOURCE, CommandTest

sys.path.insert(0, str(SOURCE / "scripts"))
import paraview as script  # noqa: E402

SCRIPT = SOURCE / "scripts/paraview.py"
PVD = ('<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n <Collection>\n{}'
       " </Collection>\n</VTKFile>\n")
STEP = '  <DataSet timestep="{}" group="" part="0" file="{}"/>\n'
MOTION = FINGER.replace(
    "write: [h5, vtp, vti]", "write: [vtp]") + """\
motion:
  seconds: 0.2
  change: [{path: "body.place.at_mm[0]", sine: {amplitude: 5, hz: 1}}]
  solve_ms: 20
"""


class Arguments(CommandTest):
    def refused(self, code, *words, says):
        done = subprocess.run([sys.executable, "-S", SCRIPT, *map(str, words)], cwd=self.folder, capture_output=True,
                              text=True, timeout=60, check=False)  # -S: without Debian's ParaView
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertNotIn("Traceback", done.stderr)
        self.assertIn(says, done.stderr.splitlines()[-1])

    def test_what_does_not_fit_is_refused(self):
        run = self.folder
        self.refused(2, "missing", says="missing is not a directory")
        self.refused(2, run, "--motion", "a.mp4", says="a.mp4 must end in .png, .avi, .ogv")
        self.refused(2, run, says="use one of -o and --motion")
        self.refused(1, run, "-o", "a.png", says="surface.vtp is missing: add vtp to write")
        for name in ["surface.vtp", "array.vtp"]:
            self.write(name, "")
        self.refused(1, self.folder, "-o", "a.png", says="use pvpython")


class Series(CommandTest):
    def test_a_series(self):
        for name in "ab":
            self.write(f"{name}.vtp", "")
        text = PVD.format(STEP.format(0, "a.vtp") + STEP.format(0.065574, "b.vtp"))
        series = script.series_of(str(self.write("evaluation.pvd", text)))
        self.assertEqual(series, [(0, str(self.folder / "a.vtp")), (0.065574, str(self.folder / "b.vtp"))])
        self.assertEqual(script.frames_a_second(series), 15)
        with self.assertRaisesRegex(script.RunError, "c.vtp, which .* lists, is missing"):
            script.series_of(str(self.write("evaluation.pvd", text.replace("b.vtp", "c.vtp"))))


class Pictures(CommandTest):
    """On a display of its own, as a server without one would have it."""

    @classmethod
    def setUpClass(cls):
        if not shutil.which("pvpython") or not shutil.which("Xvfb"):
            raise unittest.SkipTest("pvpython or Xvfb is not installed")
        asked = subprocess.run(["pvpython", "-c", "import paraview.simple"], capture_output=True, timeout=120, check=False)
        if asked.returncode != 0:
            raise unittest.SkipTest("pvpython has no paraview.simple")
        read, write = os.pipe()
        display = subprocess.Popen(["Xvfb", "-displayfd", str(write), "-screen", "0", "1280x1024x24"], pass_fds=[write],
                                   stderr=subprocess.DEVNULL)
        cls.addClassCleanup(display.wait)
        cls.addClassCleanup(display.terminate)
        os.close(write)
        with os.fdopen(read) as number:
            cls.environment = {**os.environ, "DISPLAY": f":{number.readline().strip()}"}

    def pvpython(self, *words, **environment):
        return subprocess.run(["pvpython", SCRIPT, *map(str, words)], cwd=self.folder, capture_output=True, text=True,
                              timeout=300, check=False, env={**self.environment, **environment})

    def picture(self, name, size):
        """Of that size, and neither blank nor of one colour."""
        from PIL import Image
        with Image.open(self.folder / name) as image:
            self.assertEqual(image.size, size)
            image = image.convert("RGB")
            counts = sorted(((count, colour) for count, colour in image.getcolors(1 << 24)), reverse=True)
            self.assertEqual(counts[0][1], (255, 255, 255))
            self.assertGreater(len(counts), 100)
            pixels = image.width * image.height
            self.assertLess(counts[0][0], 0.9 * pixels)
            red = sum(count for count, (r, g, b) in counts if r > 200 and g < 80 and b < 100)
            self.assertGreater(red, 100, "the target's outline")
            return image

    def test_a_run(self):
        self.run_ok("run", self.write("finger.yaml", FINGER), "-o", "run", "--quiet")
        done = self.pvpython("run", "-o", "all.png")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        whole = self.picture("all.png", (4 * 420 + 180, 640))
        # The four views hold the same skin at the same place: what is white in one is white in all.
        first = whole.crop((0, 40, 420, 640))
        for view in range(1, 4):
            other = whole.crop((420 * view, 40, 420 * (view + 1), 640))
            differ = sum((a == (255, 255, 255)) != (b == (255, 255, 255)) for a, b in zip(first.getdata(), other.getdata()))
            self.assertLess(differ, 200)
        done = self.pvpython("run", "-o", "near.png", "--method", "paper", "--around-mm", 3)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.picture("near.png", (420 + 180, 640))
        done = self.pvpython("run", "-o", "none.png", "--method", "nobody")
        self.assertEqual(done.returncode, 1)
        self.assertIn("run has no method nobody, only paper, unscattered, focus", done.stderr)
        done = self.pvpython("run", "-o", "none.png", DISPLAY="")
        self.assertEqual(done.returncode, 1)
        self.assertIn("there is no display", done.stderr)

    def test_a_motion(self):
        self.run_ok("play", self.write("moving.yaml", MOTION), "-o", "motion", "--quiet")
        count = len(list((self.folder / "motion").glob("evaluation_*.vtp")))
        self.assertGreater(count, 1)
        done = self.pvpython("motion", "--motion", "frame.png", "--method", "focus")
        self.assertEqual(done.returncode, 0, done.stderr)
        frames = sorted(path.name for path in self.folder.glob("frame.*.png"))
        self.assertEqual(len(frames), count)
        self.picture(frames[-1], (600, 640))
        self.assertNotEqual(*((self.folder / frames[i]).read_bytes() for i in (0, -1)))
        for film, magic in [("film.ogv", b"OggS"), ("film.avi", b"RIFF")]:
            done = self.pvpython("motion", "--motion", film)
            self.assertEqual(done.returncode, 0, done.stderr)
            data = (self.folder / film).read_bytes()
            self.assertTrue(data.startswith(magic))
            self.assertGreater(len(data), 5000)


if __name__ == "__main__":
    unittest.main()
