"""Depth images to meshes over time: `see`, `fit`, and a scene with the fitted body."""

import csv
import json
import pathlib
import shutil
import tempfile
import unittest

from support import LONG, SOURCE, CommandTest

SEEN = """\
name: seen
array: {grid: {count: [12, 10], pitch_mm: 10.16}}
body:
  hand: {pose: index_up, forearm_mm: 0, length_mm: 184, breadth_mm: 82}
  place: {landmark: index_pad, at_mm: [0, 0, 200]}
  edge_mm: 6
target: {box: {at: index_pad, size_mm: [8, 8, 6]}, pressure_pa: 1000}
solve: {methods: [focus], scheme: paper_corrected, allow_coarse_mesh: true}
motion:
  seconds: 0.2
  change: [{path: "body.place.at_mm[0]", rate: 50}]
  sensor:
    hz: 30
    cameras:
      - {at_mm: [280, -50, 0], look_at_mm: [0, -50, 215], resolution: [424, 240]}
      - {at_mm: [-280, -50, 0], look_at_mm: [0, -50, 215], resolution: [424, 240]}
"""


class Fit(CommandTest):
    @classmethod
    def setUpClass(cls):
        cls.made = {}
        cls.kept = pathlib.Path(tempfile.mkdtemp(prefix="touchfield-seen-"))
        cls.addClassCleanup(shutil.rmtree, cls.kept, ignore_errors=True)

    def seen(self, *changes):
        """The images of the scene in `seen`; those of the scene as it stands are made once."""
        scene = self.write("scene.yaml", SEEN)
        if changes:
            self.run_ok("see", scene, "-o", "seen", "--quiet", *changes)
        else:
            self.once("seen", "see", scene, "-o", "seen", "--quiet")

    def once(self, folder, *command):
        """The folder that a command writes, run by the first test that needs it; and what it said."""
        kept = self.kept / folder
        if kept.exists():
            shutil.copytree(kept, self.folder / folder)
        else:
            self.made[folder] = self.run_ok(*command), str(self.folder)
            shutil.copytree(self.folder / folder, kept)
        said, made_in = self.made[folder]
        for scene in (self.folder / folder).glob("*.yaml"):
            scene.write_text(scene.read_text().replace(made_in, str(self.folder)))
        return said

    def fitted(self):
        """What `fit` says of these images, in `out` what it makes of them."""
        self.seen()
        return self.once("out", "fit", "seen", "-o", "out", "--edge-mm", "6", "--json")

    def keep(self, images):
        """A frame without a hand takes seconds: some are enough."""
        table = self.folder / "seen/times.csv"
        table.write_text("".join(table.read_text().splitlines(keepends=True)[:1 + images]))

    def test_a_hand_of_another_size(self):
        done = self.fitted()
        self.assertEqual(done.stderr, "")
        said = json.loads(done.stdout)
        self.assertEqual((said["frames"], said["lost"], said["shape_learnt"]), (6, 0, True))
        self.assertAlmostEqual(said["length_ratio"], 184 / 193.3, delta=0.03)
        self.assertAlmostEqual(said["breadth_ratio"], 82 / 88.3, delta=0.03)
        self.assertLess(said["residual_mm_median"], 0.6)
        out = self.folder / "out"
        self.assertEqual([row["file"] for row in self.rows("out/times.csv")], [f"skin_{k:04d}.ply" for k in range(1, 7)])
        self.assertEqual(len(self.rows("out/fit.csv")), 6)
        header = (out / "skin_0006.ply").read_bytes().split(b"end_header")[0]
        self.assertIn(b"property float cameras\nproperty float distance_m\n", header)
        # The landmarks that `see` knew, and where the fit has them.
        for mine, theirs in zip(self.rows("out/landmarks.csv"), self.rows("seen/landmarks.csv")):
            for axis in "xyz":  # along the finger too, where the distance to the skin says nothing
                name = f"index_pad_{axis}_mm"
                self.assertAlmostEqual(float(mine[name]), float(theirs[name]), delta=1.0)
        # A scene of these meshes, its target on a landmark that came along.
        body = (out / "body.yaml").read_text()
        scene = SEEN.split("body:")[0] + body + "target:" + SEEN.split("target:")[1].split("motion:")[0]
        scene = self.write("fitted.yaml", scene + "motion: {seconds: 0.25, solve_ms: 20}\n")
        self.run_ok("check", scene)
        # 50 mm/s along x.
        first, last = (self.vertices(out / f"skin_{k:04d}.ply") for k in (1, 6))
        moved = (last - first).mean(axis=0)
        self.assertAlmostEqual(1e3 * moved[0], 50 * 5 / 30, delta=0.7)

    def test_landmarks_that_somebody_knows(self):
        self.seen()
        self.keep(3)
        table = self.folder / "seen/landmarks.csv"
        rows = self.rows("seen/landmarks.csv")
        along = [f"{row['time_s']},{row['index_pad_x_mm']},{float(row['index_pad_y_mm']) + 12},{row['index_pad_z_mm']}" for row in rows]
        table.write_text("\n".join(["time_s,index_pad_x_mm,index_pad_y_mm,index_pad_z_mm", *along[1:]]) + "\n")
        fit = ("fit", "seen", "--side", "right", "--pose", "index_up", "-o", "out", "--edge-mm", "6", "--force")
        self.run_ok(*fit)
        off = [row["landmark_off_mm"] for row in self.rows("out/fit.csv")]
        self.assertEqual(off[0], "")  # before the first row of the table
        for value in off[1:]:
            self.assertAlmostEqual(float(value), 12, delta=1)
        table.write_text("time_s,index_pad_x_mm,index_pad_y_mm\n0,1,2\n")
        self.is_refused(*fit, says="landmark index_pad must have all of index_pad_x_mm, index_pad_y_mm, index_pad_z_mm")

    def test_times_and_folders_of_any_kind(self):
        """A recorder's clock far from 0 with an empty second first; a folder whose name YAML would misread."""
        self.seen()
        self.keep(3)
        table = self.folder / "seen/times.csv"
        rows = list(csv.reader(table.read_text().splitlines()))
        late = [[f"{123456788 + k / 10:.1f}", "", ""] for k in range(11)]
        late += [[f"{123456789.1 + float(t):.6f}", *files] for t, *files in rows[1:]]
        table.write_text("".join(",".join(row) + "\n" for row in [rows[0], *late]))
        said = json.loads(self.run_ok("fit", "seen", "--side", "right", "--pose", "index_up", "-o", "out #1: a", "--edge-mm", "6", "--json").stdout)
        self.assertEqual((said["frames"], said["lost"], said["shape_learnt"]), (14, 11, True))
        out = self.folder / "out #1: a"
        for k, row in enumerate(self.rows("out #1: a/times.csv")):  # from the first image on, as `play` counts them
            self.assertAlmostEqual(float(row["time_s"]), 1.1 + k / 30, delta=2e-6)
        scene = SEEN.split("body:")[0] + (out / "body.yaml").read_text()
        scene += "target:" + SEEN.split("target:")[1].split("motion:")[0] + "motion: {seconds: 1.3, solve_ms: 20}\n"
        self.run_ok("check", self.write("fitted.yaml", scene))

    def refused(self, *command):
        before = self.entries()
        for force in ((), ("--force",)):
            self.is_refused(*command, *force, says="must be another directory, apart from")
        self.assertEqual(self.entries(), before)

    def test_results_never_take_the_place_of_images(self):
        self.seen()
        recorded = SEEN.split("  change:")[0] + "  sensor: {recorded: {folder: seen}}\n"
        scene = self.write("recorded.yaml", recorded.replace("length_mm: 184, breadth_mm: 82", ""))
        for command, output in ((("fit", "seen"), "seen"), (("play", scene), "seen/"), (("run", scene), "seen/camera_1"),
                                (("live", scene), "seen/new")):
            self.refused(*command, "-o", output)
        (self.folder / "link").symlink_to("seen")
        self.refused("fit", "seen", "--pose", "index_up", "-o", "link")
        # The images are of the run that the folder above them holds.
        self.write("files.json", '{"format": "touchfield-files", "files": ["seen/times.csv"]}')
        self.refused("fit", "seen", "--pose", "index_up", "-o", ".")

    def test_results_never_take_the_place_of_meshes(self):
        self.fitted()
        rest = SEEN.split("body:")[0], "target:" + SEEN.split("target:")[1].split("motion:")[0]
        body = (self.folder / "out/body.yaml").read_text()
        own = self.folder / "out/body.yaml"  # made a scene: a file of fit's all the same
        own.write_text(rest[0] + body + rest[1] + "motion: {seconds: 0.1, solve_ms: 20}\n")
        other = self.write("scene.yaml", own.read_text())
        still = self.write("still.yaml", rest[0] + "body: {mesh: {file: out/skin_0001.ply, unit: m}}\n"
                           + rest[1].replace("at: index_pad", "centre_mm: [0, 0, 200]"))
        for command in (("play", own), ("play", other), ("run", still), ("study", still), ("live", other)):
            self.refused(*command, "-o", "out")
        # A folder of the scene's own with nothing of the scene in it.
        self.run_ok("play", other, "-o", "out/play", "--quiet", "--set", "motion.frames_hz=10", "--set", "motion.score_hz=10",
                    "--set", "evaluation=none")

    def vertices(self, path):
        self.run_ok("mesh", path, "--unit", "m", "--output-unit", "mm", "-o", path.with_suffix(".off"))
        lines = path.with_suffix(".off").read_text().split("\n")
        import numpy
        count = int(lines[1].split()[0])
        return 1e-3 * numpy.array([[float(x) for x in line.split()] for line in lines[2:2 + count]])

    def test_no_hand(self):
        self.seen("--set", "body.hand=null", "--set", "body.sphere={radius_mm: 30}", "--set", "body.place.landmark=bottom",
                  "--set", "target.box.at=bottom")
        self.keep(1)
        done = self.is_refused("fit", "seen", "--side", "right", "--pose", "index_up", "-o", "out",
                               says="the hand was not found in any of 1 frames; the closest was that at ")
        self.assertRegex(done.stderr, r"camera_1: it sees points [23]\d\d to [23]\d\d mm away .*, in the workspace in 1 of 1")
        self.assertIn("--side, --pose and --length-mm", done.stderr)
        self.assertTrue((self.folder / "out.partial/failed.json").exists())
        row, = self.rows("out.partial/fit.csv")
        self.assertEqual((row["lost"], row["file"]), ("1", ""))

    def rows(self, name):
        return list(csv.DictReader((self.folder / name).read_text().splitlines()))

    def test_cameras_that_see_the_hand_in_two_places(self):
        self.seen()
        self.keep(3)
        cameras = self.folder / "seen/cameras.yaml"
        cameras.write_text(cameras.read_text().replace("translation_mm: [280, -50, 0]", "translation_mm: [280, 350, 0]"))
        done = self.run_ok("fit", "seen", "--side", "right", "--pose", "index_up", "-o", "out", "--edge-mm", "6", "--json")
        self.assertRegex(done.stderr, r"cameras: in \d+ of \d+ frames camera_[12] sees something, but no skin")
        self.assertEqual(len(json.loads(done.stdout)["warnings"]), done.stderr.count("touchfield: warning: "))

    def test_an_image_that_is_damaged_leaves_what_was_fitted(self):
        self.seen()
        image = self.folder / "seen/camera_1/000002.png"
        data = bytearray(image.read_bytes())
        data[len(data) // 2] ^= 1
        image.write_bytes(data)
        self.is_refused("fit", "seen", "--side", "right", "--pose", "index_up", "-o", "out", "--edge-mm", "6", "--learn-s", "0",
                        says="000002.png: damaged")
        self.assertEqual(len(self.rows("out.partial/fit.csv")), 2)
        found = [row["file"] for row in self.rows("out.partial/fit.csv") if row["lost"] == "0"]
        self.assertEqual([row["file"] for row in self.rows("out.partial/times.csv")], found)

    def test_the_other_hand(self):
        """The side is found, or a wrong one is named."""
        self.seen()
        self.keep(1)
        self.is_refused("fit", "seen", "--pose", "index_up", "-o", "out", "--side", "left",
                        says="the hand was not found in any of 1 frames; the images show a right hand: give --side right")
        self.run_ok("see", "scene.yaml", "-o", "left", "--quiet", "--set", "body.hand.side=left",
                    "--set", "motion.seconds=0.1")
        said = json.loads(self.run_ok("fit", "left", "-o", "other", "--edge-mm", "6", "--json").stdout)
        self.assertEqual((said["frames"], said["lost"], said["shape_learnt"]), (3, 0, True))
        self.assertEqual((said["pose"], said["side"], said["warnings"]), ("index_up", "left", []))


REAL = SOURCE.parent / "shared/data/depth_sr305"


@unittest.skipUnless(REAL.exists(), f"no measured depth images at {REAL}")
class RealImages(CommandTest):
    """A real hand with its arm and body, by one camera: each image is 0.67 s from the next. What is true of it is not known."""

    def found(self, part, most=None):
        """How many of a part's images, of the first `most`, the hand is found in, each by itself; and their number."""
        images = sorted((REAL / part).glob("*.png"), key=lambda path: int(path.stem))[:most]
        found = []
        for image in images:
            recorded = self.folder / f"{part}_{image.stem}"
            (recorded / "camera").mkdir(parents=True)
            shutil.copy(image, recorded / "camera")
            (recorded / "times.csv").write_text(f"time_s,camera\n0,camera/{image.name}\n")
            (recorded / "cameras.yaml").write_text(
                "format: touchfield-cameras\nversion: 1\ncameras:\n"
                "  - {name: camera, width: 640, height: 480, fx: 476.007, fy: 476.007, cx: 313.683, cy: 242.755, depth_unit_mm: 0.125,\n"
                "     distortion: {model: none}, pose: {quaternion_wxyz: [0, 1, 0, 0], translation_mm: [0, 0, 700]}}\n")
            fit = self.touchfield("fit", recorded, "-o", f"{part}_{image.stem}_fit", "--quiet", "--edge-mm", "6",
                                  "--workspace-mm", "-400", "-400", "-200", "400", "400", "400")
            table = self.folder / f"{part}_{image.stem}_fit/fit.csv"
            if fit.returncode == 0:
                row, = csv.DictReader(table.read_text().splitlines())
                found.append(float(row["residual_mm"]))
        self.assertLess(max(found), 1.5)
        return len(found), len(images)

    def test_an_image(self):
        self.assertEqual(self.found("a", 1), (1, 1))

    @LONG
    def test_stretched_fingers_turned_in_the_image(self):
        found, images = self.found("a")
        self.assertEqual(images, 8)
        self.assertGreaterEqual(found, 7)

    @LONG
    def test_bent_fingers(self):
        found, images = self.found("b")
        self.assertEqual(images, 11)
        self.assertGreaterEqual(found, 9)


if __name__ == "__main__":
    unittest.main()
