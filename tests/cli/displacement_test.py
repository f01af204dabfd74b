"""Phases held while the finger of width_8mm moves on: the rise of the error above rest against reference figures.

The figures are an independent prototype's, with another scheme, of the same finger, array and target: 0.453 at rest.
"""

import csv
import re
import unittest

from support import SOURCE, CommandTest, open_run

DISPLACEMENT = [0.5, 1, 1.5, 2, 3, 4, 6, 8, 10]  # [mm]
AT_REST = 0.453
ERROR = {  # along +x, across the box; +y, along the finger; +z, away from the array
    0: [0.471, 0.520, 0.588, 0.663, 0.783, 0.862, 0.943, 0.964, 0.938],
    1: [0.466, 0.502, 0.555, 0.617, 0.746, 0.843, 0.953, 0.989, 0.992],
    2: [0.454, 0.459, 0.466, 0.475, 0.498, 0.527, 0.592, 0.658, 0.719]}


class Displacement(CommandTest):
    def test_rise_above_rest(self):
        # The body is the finger alone, as one would see it under a microphone: a file of the part that is kept.
        whole = (SOURCE / "scenes/width_8mm.yaml").read_text().split("solve:")[0]
        self.run_ok("run", self.write("whole.yaml", whole + "solve: {methods: [focus]}\nevaluation: none\nwrite: [h5]\n"), "-o", "part",
                    "--set", "body.edge_mm.far=3", "--set", "body.keep_within_mm=50")
        with open_run(self.folder / "part") as run:
            text = "".join(f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in 1e3 * run["mesh/vertices"][:])
            self.write("finger.obj", text + "".join(f"f {a} {b} {c}\n" for a, b, c in run["mesh/triangles"][:] + 1))
        body = "body: {mesh: {file: finger.obj, unit: mm, landmarks: {index_pad: [0, 0, 200]}}}\n"
        still, count = re.subn(r"body:\n(  .*\n)+", body, whole)
        self.assertEqual(count, 1)
        for axis, expected in ERROR.items():
            scene = self.write("scene.yaml", still + f"""\
solve: {{methods: [surface]}}
evaluation: same
motion:
  seconds: 1.05
  change: [{{path: "body.place.at_mm[{axis}]", rate: 10}}]
  frames_hz: 0.9
  iterations: 30
  solve_ms: 0
  array_ms: 0
  score_hz: 20
write: [h5]
""")
            self.run_ok("play", scene, "-o", "out", "--force", "--quiet")
            with open(self.folder / "out/motion.csv", newline="", encoding="ascii") as table:
                error = {round(10 * float(row["time_s"]), 2): float(row["relative_error"]) for row in csv.DictReader(table)}
            for moved, reference in zip(DISPLACEMENT, expected):
                self.assertAlmostEqual(error[moved] - error[0], reference - AT_REST, delta=0.02, msg=f"{moved} mm along {axis}")


if __name__ == "__main__":
    unittest.main()
