"""Bad input: a clear message on one screen, exit code 2, nothing left behind."""

import csv
import os
import subprocess
import unittest

from meshes import icosphere, write_ply
from support import FINGER, PROGRAM, SOURCE, CommandTest

MESH_SCENE = """\
name: mesh
array: {grid: {count: [4, 4], pitch_mm: 10}, at_mm: [0, 0, -60]}
body: {mesh: {file: skin.obj, unit: mm}}
solve: {methods: [{fixed: {phases_rad: 0}}]}
"""


class BadInput(CommandTest):
    def scene(self, text, name="scene.yaml"):
        return self.write(name, text)

    def test_a_scene_with_a_fault(self):
        box, at = "box: {at: bottom, size_mm: [8, 12, 6]}", "at_mm: [0, 0, 60]"
        beside = ["--set", "array.at_mm=[5.08, 0, 0]"]
        for old, new, says, *more in [
                ("edge_mm: 2.6", "edge_cm: three\n  place_mm: 1", ["scene.yaml:7:3", "edge_cm", "edge_mm", "scene.yaml:8:3", "place_mm"]),
                ("phases_rad: 0", "phases_rad: [0, 1, 2]", ["fixed has 3 phases", "64 channels"]),
                ("edge_mm: 2.6", "edge_mm: 0.15", ["GiB", "body.edge_mm"], "--set", "solve.solver=lu"),
                ("{at: bottom,", "{at: bottom, offset_mm: [0, 0, -30],", [
                    "target.box: the box about (0.0, 0.0, 30.0) mm (scene coordinates) holds no skin", "is 27"]),
                (box, "points: [{at: bottom, offset_mm: [0, 0, -30], diameter_mm: 3}]", [
                    "target.points[0]: (0.0, 0.0, 30.0) mm (scene coordinates) is 30.0 mm off the skin", "the nearest skin is at (0"]),
                (at, "at_mm: [5.08, 5.08, -8]", ["body.place.at_mm puts transducer ", "inside the body"]),
                # The lowest point of the skin 0.3 mm above a transducer.
                (at, "at_mm: [5.08, 5.08, 0.3]", ["body.place.at_mm puts the body 0.3 mm from the array", "must be >= 1 mm away"]),
                (at, "at_mm: [0.01, 0, 0.1]", "If [0.01, 0, 0.1] is in metres write [10, 0, 100]", *beside)]:
            with self.subTest(new):
                self.assertIn(old, FINGER)
                self.refused("run", self.scene(FINGER.replace(old, new)), "-o", "out", *more, says=says)

    def test_an_old_name_is_answered_with_the_new(self):
        with open(SOURCE / "tests/data/renamed.csv", newline="") as file:
            rows = [(row["old"], row["new"], row["where"]) for row in csv.DictReader(file)]
        says = {old: f"{old}: this key is called {new.split('.')[-1]}" for old, new, where in rows if where == "scene"}
        text = FINGER
        for old in says:
            *sections, key = old.split(".")
            section = f"{sections[0]}:\n" if sections else ""
            text = text.replace(section, f"{section}{'  ' if section else ''}{key}: same\n", 1)
        lines = text.split("\n")
        places = {old: next(i for i, line in enumerate(lines, 1) if line.strip() == f"{old.split('.')[-1]}: same") for old in says}
        self.refused("check", self.scene(text),
                     says=[f"scene.yaml:{places[old]}:{3 if '.' in old else 1}: {said}" for old, said in says.items()])
        base = self.scene(FINGER, "base.yaml")
        self.refused("check", base, *[f"--set={old}=same" for old in says], says=[f"--set {old}=same: {said}" for old, said in says.items()])
        plan = self.write("plan.yaml", "base: base.yaml\ngrid: {array.level: [1]}\n")
        old, said = next(iter(says.items()))
        self.refused("sweep", plan, "--list", "--set", f"{old}=same", says=f"{old}=same: {said}")
        for old, new, where in rows:
            if where == "plot":
                self.refused("sweep", plan, "-o", "out", "--plot", old, says=f"metric {old}: this metric is called {new}")

    def test_text_is_utf8(self):
        (self.folder / "wide.yaml").write_text(FINGER, encoding="utf-16")
        self.refused("check", "wide.yaml", says="wide.yaml:1:1: byte 0xff is not UTF-8 text; save the file as UTF-8")
        done = subprocess.run([PROGRAM, b"check", b"o\xff.yaml"], cwd=self.folder, capture_output=True, check=False)
        self.assertEqual(done.returncode, 2)
        self.assertIn(b"argument 2 is not UTF-8 text: o\xff.yaml; rename the file", done.stderr)

    def test_mask_of_a_target(self):
        write_ply(self.folder / "ball.ply", *icosphere(2, 8.0))
        body = "body: {mesh: {file: ball.ply, unit: mm}}\n"
        scene = MESH_SCENE.replace("body: {mesh: {file: skin.obj, unit: mm}}\n", body + "target: {mask_file: mask.txt}\n")
        text = self.scene(scene)
        for levels, says in [
                ("1 0 0 # three\n", ["has 3 levels, it must have one for each of the 320 faces of", "ball.ply"]),
                ("0 " * 320, "mask.txt: all levels are 0, one must be > 0"), ("0\n1.5\n", "mask.txt:2: level = 1.5 must be 0 to 1"),
                ("1 " * 320, "target.mask_file covers the whole body")]:
            self.write("mask.txt", levels)
            self.refused("run", text, "-o", "out", says=says)
        self.write("mask.txt", "1 " * 20 + "0 " * 300)
        self.refused("run", self.scene(scene.replace(body, "body: {sphere: {radius_mm: 8}, edge_mm: 2}\n")), "-o", "out",
                     says=["target.mask_file: body has no mesh file", "body.mesh.file"])

    def test_a_run_to_start_from_that_is_none_or_does_not_fit(self):
        self.write("text.h5", "no run")
        small = FINGER.replace("[8, 8]", "[4, 4]").replace("[paper, unscattered, focus, {fixed: {phases_rad: 0}}]",
                                                           "[paper]")
        self.run_ok("run", self.write("small.yaml", small), "-o", "small", "--quiet")
        whole = (self.folder / "small/run.h5").read_bytes()
        (self.folder / "cut.h5").write_bytes(whole[:5000])
        (self.folder / "flipped.h5").write_bytes(whole[:5000] + bytes([whole[5000] ^ 1]) + whole[5001:])
        for file, says in [("no.h5", "no.h5"), ("text.h5", "is not an HDF5 file"), ("cut.h5", "is damaged"),
                           ("flipped.h5", "checksum"), ("small/run.h5", "has 16 channels, the array here has 64"),
                           ("small/run.h5, method: focus", "has no method focus")]:
            scene = self.scene(FINGER.replace("iterations: 8", f"iterations: 8\n  start: {{previous: {file}}}")
                               .replace("[8, 8]", "[4, 4]" if "method" in file else "[8, 8]"))
            self.refused("run", scene, says=[says, "" if file == "no.h5" else "start of paper: "])

    def refused_at_once(self, *arguments, says):
        """Refused before memory is taken for it: the program itself needs 40 MiB, a scene of 2 MiB half a gigabyte."""
        with open(self.folder / "said", "w+") as said:
            process = subprocess.Popen([PROGRAM, *map(str, arguments)], cwd=self.folder, stdout=subprocess.DEVNULL,
                                       stderr=said)
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            said.seek(0)
            text = said.read()
        self.assertEqual(process.returncode, 2, text)
        self.assertIn(says, text)
        self.assertLess(usage.ru_maxrss / 1024, 700, "MiB")
        self.assertLess(usage.ru_utime + usage.ru_stime, 20, "seconds of the processor")

    def test_a_capsule_thinner_than_anything(self):
        hair = self.scene(FINGER.replace("radius_mm: 8, length_mm: 10", "radius_mm: 1e-4, length_mm: 1000"))
        self.refused_at_once("check", hair, says="scene.yaml:5:24: body.capsule.radius_mm = 1e-4 must be 0.01 to 10000")

    def test_a_scene_of_two_million_brackets(self):
        deep = self.scene("name: " + "[" * 2_000_000)
        self.refused_at_once("check", deep, says="scene.yaml:1:")

    def test_a_mesh_larger_than_the_world(self):
        vertices, triangles = icosphere(2, 1.0)
        self.write("skin.obj", "".join("v {} {} {}\n".format(*(1e30 * x)) for x in vertices) +
                   "".join("f {} {} {}\n".format(*(t + 1)) for t in triangles))
        says = "skin.obj: the body is 2.02e+30 mm across, it must be 0.01 to 10000 mm"
        self.refused_at_once("mesh", "skin.obj", "--unit", "mm", "--resurface", "3", "-o", "out.stl", says=says)


if __name__ == "__main__":
    unittest.main()
