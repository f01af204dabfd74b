"""Files that a command may replace, and messages about a damaged run.h5."""

import os
import stat
import unittest
import zlib

import h5py

from support import CommandTest

# A run of a moment: four faces, phases that are given.
TETRAHEDRON = "v 0 0 0\nv 20 0 0\nv 0 20 0\nv 0 0 20\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
SCENE = """\
name: small
array: {grid: {count: [4, 4], pitch_mm: 10}, at_mm: [0, 0, -60]}
body: {mesh: {file: skin.obj, unit: mm}}
solve: {methods: [{fixed: {phases_rad: 0}}]}
field: [{name: side, plane: xz, through_mm: [0, 0, 60], size_mm: [30, 40], spacing_mm: 10}]
write: [h5, vti]
"""


class Files(CommandTest):
    def setUp(self):
        super().setUp()
        self.write("skin.obj", TETRAHEDRON)
        self.scene = self.write("small.yaml", SCENE)

    def run_scene(self):
        self.run_ok("run", self.scene, "-o", "out", "--quiet", "--threads", 1)

    def refused(self, done, *phrases):
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        for phrase in phrases:
            self.assertIn(phrase, done.stderr)

    def test_mesh_files_are_replaced_with_force_only(self):
        for command in [["hand", "-o", "x.stl", "--edge-mm", 12], ["mesh", "skin.obj", "--unit", "mm", "-o", "x.stl"]]:
            self.write("x.stl", "mine")
            before = self.entries()
            self.refused(self.touchfield(*command), "x.stl", "--force")
            self.assertEqual((self.folder / "x.stl").read_text(), "mine")
            self.run_ok(*command, "--force")
            self.assertEqual(self.entries(), before)
            self.assertNotEqual((self.folder / "x.stl").read_bytes(), b"mine")

    def test_force_replaces_files_alone(self):
        self.run_scene()
        self.write("p.csv", "x_mm,y_mm,z_mm,p_pa\n0,0,60,1\n5,0,60,2\n0,5,60,3\n")
        commands = {"a.stl": [["hand", "-o", "a.stl", "--edge-mm", 8], ["mesh", "skin.obj", "--unit", "mm", "-o", "a.stl"]],
                    "a.csv": [["compare", "out", "--points", "p.csv", "--out", "a.csv"]],
                    "a.png": [["compare", "out", "--points", "p.csv", "--picture", "a.png"]],
                    "a.yaml": [["init", "a"]],
                    "a.txt": [["send", "out", "--to", "dry-run:a.txt"], ["array", "test", "--run", "out", "--to", "dry-run:a.txt"]],
                    "out/metrics.csv": [["run", self.scene, "-o", "out"]], "out/run.log": [["run", self.scene, "-o", "out"]]}
        self.write("precious", "mine")
        kinds = {"link": lambda path: path.symlink_to(self.folder / "precious"), "pipe": os.mkfifo, "folder": lambda path: path.mkdir(),
                 "device": lambda path: os.mknod(path, stat.S_IFCHR | 0o666, os.makedev(1, 3))}
        for kind, make in kinds.items():
            for name, lines in commands.items():
                path = self.folder / name
                path.unlink(missing_ok=True)
                try:
                    make(path)
                except PermissionError:
                    continue  # devices are made by root alone
                before = path.lstat()
                for line in lines:
                    with self.subTest(kind=kind, line=line):
                        self.refused(self.touchfield(*line, "--force"), name.removeprefix("out/"))
                        self.assertEqual((path.lstat().st_ino, path.lstat().st_mode), (before.st_ino, before.st_mode))
                path.rmdir() if kind == "folder" else path.unlink()
        self.assertEqual((self.folder / "precious").read_text(), "mine")

    def test_no_command_writes_to_what_it_reads(self):
        self.run_scene()
        points = self.write("p.csv", "x_mm,y_mm,z_mm,p_pa\n0,0,60,1\n5,0,60,2\n0,5,60,3\n")
        self.write("samples.txt", "0 255\n")
        os.symlink("p.csv", self.folder / "soft.csv")
        os.link(points, self.folder / "hard.csv")
        os.symlink("skin.obj", self.folder / "soft.obj")
        os.symlink("out", self.folder / "again")
        compare = ["compare", "out", "--points", "p.csv", "--force"]
        send = ["send", "out", "--force", "--to"]
        commands = [[*compare, "--out", "p.csv"], [*compare, "--out", "./p.csv"], [*compare, "--out", "soft.csv"],
                    [*compare, "--out", "hard.csv"], [*compare, "--out", points], [*compare, "--out", "again/run.h5"],
                    ["mesh", "skin.obj", "--unit", "mm", "-o", "skin.obj", "--force"],
                    ["mesh", "soft.obj", "--unit", "mm", "-o", "skin.obj", "--force"],
                    ["mesh", "skin.obj", "--unit", "mm", "-o", "soft.obj", "--force"],
                    [*send, "dry-run:out/run.h5"], [*send, "dry-run:again/run.h5?levels=16"],
                    [*send, "dry-run:samples.txt", "--modulation-samples", "samples.txt"],
                    ["array", "test", "--run", "out", "--force", "--to", "dry-run:out/run.h5"]]
        before = {path: path.read_bytes() for path in self.folder.rglob("*") if path.is_file()}
        for command in commands:
            with self.subTest(command=command):
                self.refused(self.touchfield(*command), "is the same file as")
        self.assertEqual({path: path.read_bytes() for path in self.folder.rglob("*") if path.is_file()}, before)
        self.run_ok(*compare, "--out", "rows.csv")
        self.run_ok(*compare, "--out", "rows.csv")

    def test_every_command_says_the_same_of_a_damaged_run(self):
        self.run_scene()
        whole = (self.folder / "out/run.h5").read_bytes()
        flipped = bytearray(whole)
        flipped[len(whole) // 2] ^= 0xFF
        (self.folder / "flipped.h5").write_bytes(flipped)
        (self.folder / "cut.h5").write_bytes(whole[:len(whole) // 2])
        # Its checksum fits: what is wrong is found by what it holds.
        forged = whole[:-26].replace(b"touchfield-run", b"touchfield-fun")
        (self.folder / "forged.h5").write_bytes(forged + b"touchfield-crc32 %08x\n" % zlib.crc32(forged))
        self.write("text.h5", "no run")
        for bad in ["flipped.h5", "cut.h5", "forged.h5", "text.h5", "missing.h5"]:
            said = set()
            for command in [["info", bad], ["compare", "out", bad], ["run", "--from", bad, "-o", "again"],
                            ["send", bad, "--to", "dry-run:frames.bin"]]:
                done = self.touchfield(*command)
                self.refused(done, bad)
                self.assertEqual(done.stdout, "")
                said.add(done.stderr)
            self.assertEqual(len(said), 1, said)
        self.assertFalse((self.folder / "again").exists())

    def test_a_run_that_another_program_has_changed(self):
        self.run_scene()
        with h5py.File(self.folder / "out/run.h5", "r+") as run:
            run.attrs["note"] = "mine"
        for command in [["info", "out"], ["compare", "out", "out"], ["run", "--from", "out", "-o", "again", "--quiet"]]:
            done = self.touchfield(*command)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("warning: out/run.h5: the checksum line at its end is missing", done.stderr)
        self.refused(self.touchfield("send", "out", "--to", "dry-run:frames.bin"), "out/run.h5: the checksum line",
                     "run --from read it nevertheless. Keep notes in a copy")
        self.assertFalse((self.folder / "frames.bin").exists())
        with h5py.File(self.folder / "out/run.h5", "r+") as run:
            run["scene"][()] = run["scene"][()].replace(b"-60", b"-61")
        done = self.touchfield("run", "--from", "out", "-o", "third", "--quiet")
        self.assertEqual(done.returncode, 2)
        self.assertIn("out/run.h5: its scene was changed or damaged after the run", done.stderr)
        self.assertFalse((self.folder / "third").exists())


if __name__ == "__main__":
    unittest.main()
