"""The named warnings: each for a body that deserves it, none for a good one."""

import json
import math
import re
import unittest

import numpy

from meshes import icosphere, together, write_ply
from sphere_series import K
from support import FINGER, SOURCE, CommandTest, open_run, warning_names

MESH = """\
name: mesh
array: {plane_wave: {direction: [0, 0, 1]}}
body: {mesh: {file: skin.ply, unit: mm}}
solve: {methods: [{fixed: {phases_rad: 0}}], resonance_check: never}
evaluation: none
write: [h5]
"""
SOFT = FINGER.replace("array:\n", "array:\n  source_pa_m: 0.4\n")  # far from nonlinear


def cut(vertices, triangles, weights):
    """Every face in three about a point of its own, the weights those of its corners."""
    middle = len(vertices) + numpy.arange(len(triangles))
    points = numpy.einsum("fcx,c->fx", vertices[triangles], weights)
    a, b, c = triangles.T
    children = [numpy.stack(child, axis=1) for child in [[a, b, middle], [b, c, middle], [c, a, middle]]]
    return numpy.concatenate([vertices, points]), numpy.concatenate(children)


class Warnings(CommandTest):
    def warned(self, text, *sets, mesh=None):
        """The names that a run says, keeps and prints, which are the same."""
        if mesh is not None:
            write_ply(self.folder / "skin.ply", *mesh)
        scene = self.write("scene.yaml", text)
        arguments = [argument for setting in sets for argument in ("--set", setting)]
        done = self.run_ok("run", scene, "-o", "out", "--force", "--json", *arguments)
        names = warning_names(done.stderr)
        with open_run(self.folder / "out") as run:
            kept, self.notes = (list(run[kind].asstr()[:]) if kind in run else [] for kind in ("warnings", "notes"))
        self.assertEqual([text.split(":")[0] for text in kept], names)
        self.assertEqual(json.loads(done.stdout)["warnings"], kept)
        self.assertEqual(json.loads(done.stdout)["notes"], self.notes)
        log = (self.folder / "out/run.log").read_text()
        for text in self.notes:
            self.assertIn(f" note: {text}\n", log)
            self.assertRegex(text, r"^[a-z_]+: .*\d")
        for text in kept:
            self.assertIn(f"touchfield: warning: {text}\n", done.stderr)
            self.assertRegex(text, r"^[a-z_]+: .*\d")
        return names

    def checked(self, *sets, text=FINGER, mesh=None):
        """What `check` says of a scene with changes."""
        if mesh is not None:
            write_ply(self.folder / "skin.ply", *mesh)
        scene = self.write("scene.yaml", text)
        return json.loads(self.run_ok("check", scene, "--json", *[f"--set={change}" for change in sets]).stdout)

    def test_check_says_those_of_the_model_and_a_run_keeps_them(self):
        self.assertEqual(self.checked()["warnings"], [])
        said = self.checked("body.edge_mm=4")["warnings"]
        self.assertTrue(len(said) == 1 and said[0].startswith("coarse_mesh: "), said)
        self.assertIn(said[0], self.run_ok("check", "scene.yaml", "--set", "body.edge_mm=4").stdout)
        self.assertEqual(self.warned(FINGER, "body.edge_mm=4", "solve.methods=[focus]"), ["coarse_mesh"])

    def test_shapes(self):
        """Those that are not in tests/model/warnings_test.cpp."""
        ball = icosphere(2, 6)
        for name, mesh in [("slivers", cut(*ball, [0.49, 0.49, 0.02])), ("size_jump", cut(*ball, [0.05, 0.05, 0.9])),
                           ("narrow_gap", together(ball, (ball[0] + [12.5, 0, 0], ball[1]))),
                           (None, together(ball, (ball[0] + [18, 0, 0], ball[1])))]:
            names = [said.split(":")[0] for said in self.checked(text=MESH, mesh=mesh)["warnings"]]
            self.assertEqual(name in names, name is not None, names)

    def test_facing_away(self):
        for degrees, names in [(-60, []), (84, ["facing_away"]), (180, ["facing_away"])]:
            said = self.checked(f"body.place.rotate_deg=[{degrees}, 0, 0]")["warnings"]
            self.assertEqual([line.split(":")[0] for line in said], names, degrees)
        # The lower side of a finger that is turned right over looks straight up.
        self.assertRegex(said[0], r"^facing_away: .* target\.box is turned 1(79|80) degrees .* body\.place\.rotate_deg, ")

    def test_below_wanted(self):
        self.warned(SOFT, "target.pressure_pa=4000000", "solve.methods=[focus, {fixed: {phases_rad: 0}}]")
        with open_run(self.folder / "out") as run:
            said = run["warnings"].asstr()[0]
            method = run["methods/focus"].attrs
            faces = run["target/face"][:]
            area = run["mesh/area"][:][faces] * run["target/share"][:]
            p = numpy.abs(run["methods/focus/pressure"][:])
            inside = (area * p[faces]).sum() / area.sum()
            self.assertAlmostEqual(method["reached_share"], inside / 4e6, delta=1e-12)
        self.assertRegex(said, r"^below_wanted: focus reaches [\d.]+ Pa \(0\.0\d+ %\) of the wanted 4,000 kPa on the target; ")
        # A focus has all channels in phase on the central face: nothing there is louder.
        number, kilo = re.search(r"at most ([\d.]+) (k?)Pa on its central face$", said).groups()
        most = float(number) * (1000 if kilo else 1)
        self.assertAlmostEqual(most / p[faces].max(), 1, delta=0.02)
        self.assertNotIn("fixed", said)
        self.assertIn("reached", (self.folder / "out/metrics.csv").read_text().splitlines()[0])
        self.assertNotIn("below_wanted", self.warned(SOFT, "target.pressure_pa=best", "solve.methods=[focus]"))
        said = "\n".join(self.checked("target.pressure_pa=4000000", text=SOFT)["warnings"])
        self.assertIn("below_wanted: the array makes at most about ", said)

    def test_a_mesh_too_coarse_to_mean_anything(self):
        ball = "body={sphere: {radius_mm: 20}, edge_mm: 7, place: {landmark: bottom, at_mm: [0, 0, 60]}}"
        coarse = ["--set", ball, "--set", "target.box={at: bottom, size_mm: [20, 20, 8]}"]
        scene = self.write("scene.yaml", FINGER)
        done = self.is_refused("run", scene, "-o", "out", *coarse)
        self.assertRegex(done.stderr, r"body\.edge_mm: 1\.[0-4]\d edges per wavelength within 15 mm of the target are too few.*"
                                      r"edges of 2\.9 mm or less.* solve\.allow_coarse_mesh: true")
        self.assertFalse((self.folder / "out").exists())
        done = self.run_ok("check", scene, *coarse, "--set", "solve.allow_coarse_mesh=true", "--json")
        said = json.loads(done.stdout)["warnings"][0]
        self.assertRegex(said, "^coarse_mesh: .*Pressures there are meaningless")
        said = self.checked(ball.replace("edge_mm: 7", "edge_mm: 5"), coarse[3])["warnings"][0]
        self.assertRegex(said, "^coarse_mesh: .*errors of 10 % and more")
        self.is_refused("check", scene, "--set", "evaluation={edge_mm: 8}", says="evaluation.edge_mm: 1.07 edges per wavelength")

    def test_what_comes_of_a_motion(self):
        text = FINGER + "motion: {seconds: 0.2, change: [{path: 'body.place.rotate_deg[0]', rate: 900}], solve_ms: 20, score_hz: 10}\n"
        still = "solve.methods=[focus]"
        said = self.checked(still, text=text)["warnings"]
        self.assertEqual(len(said), 1, said)
        self.assertRegex(said[0], r"^facing_away: at 0\.20 s: .* turned 1(79|80) degrees")
        scene = self.write("scene.yaml", text)
        done = self.run_ok("play", scene, "-o", "out", "--json", "--set", still, "--set", "write=[h5]")
        self.assertIn(said[0], json.loads(done.stdout)["warnings"])
        done = self.run_ok("live", scene, "--json", "--set", still)
        self.assertEqual(json.loads(done.stdout)["live"]["warnings"], said)

    def test_names_of_results(self):
        fixed = "solve.methods=[{fixed: {phases_rad: 0}}]"
        self.assertEqual(self.warned(FINGER, fixed, "target.box.at=top"), ["facing_away", "deep_shadow"])
        self.assertEqual(self.warned(FINGER, fixed), [])
        small = ["mesh_unit"]  # less than 10 mm across: no fingertip
        for ka, names in [(math.pi, ["fictitious_frequency"]), (3.6, [])]:
            ball = icosphere(2, ka / K * 1e3)
            self.assertEqual(self.warned(MESH, "solve.scheme=paper", "solve.resonance_check=always", mesh=ball), small + names)
        self.assertEqual(self.warned(MESH, "solve.resonance_check=always"), small)

    def test_notes_are_kept_apart_from_warnings(self):
        self.warned(SOFT)
        self.assertTrue(len(self.notes) == 1 and self.notes[0].startswith("evaluated_by_itself: "), self.notes)
        self.assertRegex(self.run_ok("info", "out").stdout, rf"(?m)^notes +{re.escape(self.notes[0])}$")

    def test_shipped_scenes_pass_their_check_and_explain_what_they_warn_of(self):
        scenes = sorted((SOURCE / "scenes").glob("*.yaml"))
        self.assertGreaterEqual(len(scenes), 8)
        for scene in scenes:
            text = scene.read_text()
            comment = " ".join(line for line in text.splitlines() if line.startswith("#"))
            # For what frames and scores cost `check` takes one, and no warning of a motion is of its methods or its evaluation.
            short = ["--set", "solve.methods=[focus]", "--set", "evaluation={edge_mm: {near_target: 3, far: 8, within_mm: 10}}",
                     "--set", "motion.sensor=null"]
            for warning in json.loads(self.run_ok("check", scene, "--json", *(short if "\nmotion:" in text else [])).stdout)["warnings"]:
                self.assertIn(f"`{warning.split(':')[0]}`", comment, f"{scene.name}: {warning}")


if __name__ == "__main__":
    unittest.main()
