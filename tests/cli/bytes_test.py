"""Bytes that are not text, control characters of a terminal, and inputs that are not files."""

import concurrent.futures
import json
import os
import pty
import shlex
import socket
import subprocess
import unittest
import zlib

import h5py

from claims_test import MOVING
from files_test import SCENE, TETRAHEDRON
from support import PROGRAM, CommandTest
from sweep_test import TINY


class Bytes(CommandTest):
    """Every folder and file has a name with a byte that no UTF-8 text has."""

    def setUp(self):
        super().setUp()
        self.write("small.yaml", SCENE)
        self.write("skin.obj", TETRAHEDRON)
        self.write("tiny.yaml", TINY)
        self.name = b"o\xff\xc3"

    def json(self, *arguments, code=0):
        done = subprocess.run([PROGRAM, *arguments, "--json"], cwd=self.folder, capture_output=True, timeout=500, check=False)
        self.assertEqual(done.returncode, code, done.stderr)
        return json.loads(done.stdout.decode()) if code == 0 else done

    def test_every_report_names_them_byte_for_byte(self):
        name = self.name
        said = self.json("run", "tiny.yaml", "-o", name)
        self.assertEqual(os.fsencode(said["directory"]), name)
        with h5py.File(os.fsencode(self.folder) + b"/" + name + b"/run.h5") as run:
            line = run["provenance"].attrs["command_line"]
        line.encode()  # is text, and a shell reads it back
        back = subprocess.run(["bash", "-c", f"printf '%s\\0' {line}"], capture_output=True, check=True).stdout.split(b"\0")
        self.assertEqual(back[1:5], [b"run", b"tiny.yaml", b"-o", name])
        self.assertIn(rb"-o $'o\xff\xc3'", subprocess.run([PROGRAM, "info", name], cwd=self.folder, capture_output=True).stdout)
        self.assertEqual(self.json("info", name)["command_line"], line)
        said = self.json("compare", name, name)
        self.assertEqual(os.fsencode(said["a"]["file"]), name + b"/run.h5")
        said = self.json("send", name, "--method", "focus", "--to", b"dry-run:" + name + b".txt")
        self.assertEqual(os.fsencode(said["link"]), b"dry-run:" + name + b".txt")
        os.rename(self.folder / "skin.obj", os.fsencode(self.folder) + b"/" + name + b".obj")
        self.assertEqual(os.fsencode(self.json("mesh", name + b".obj", "--unit", "mm")["file"]), name + b".obj")
        self.assertEqual(os.fsencode(self.json("hand", "-o", name + b".stl", "--edge-mm", "8")["file"]), name + b".stl")
        moving = self.write("moving.yaml", MOVING)
        self.assertEqual(os.fsencode(self.json("play", moving, "-o", name + b"2")["directory"]), name + b"2")

    def test_a_sweep_goes_on_in_such_a_folder(self):
        self.write("sweep.yaml", "base: tiny.yaml\nname: levels\ngrid: {array.level: [1, 0.9]}\n")
        for options in [[], [b"--resume"]]:
            done = subprocess.run([PROGRAM, b"sweep", b"sweep.yaml", b"-o", self.name, b"--json", *options], cwd=self.folder,
                                  capture_output=True, timeout=500, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            said = json.loads(done.stdout.splitlines()[-1])
            self.assertEqual((os.fsencode(said["directory"]), said["done"]), (self.name, 2))
        self.assertEqual(said["computed"], 0)

    def test_a_scene_that_lies_in_such_a_folder_is_repeated_from_anywhere(self):
        folder = os.fsencode(self.folder) + b"/" + self.name
        os.mkdir(folder)
        for name in ["small.yaml", "skin.obj"]:
            os.rename(self.folder / name, folder + b"/" + name.encode())
        with open(folder + b"/s.yaml", "w") as file:
            file.write("base: small.yaml\ngrid: {array.level: [1]}\n")
        done = subprocess.run([PROGRAM, b"sweep", self.name + b"/s.yaml", b"-o", b"out"], cwd=self.folder, capture_output=True,
                              timeout=500, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.run_ok("run", "--from", "out/cases/00001", "-o", "again", "--quiet")  # its mesh lies there

    def test_pictures_and_tables_have_them_too(self):
        for kind in ["pdf", "svg", "png"]:
            done = subprocess.run([PROGRAM, "run", "tiny.yaml", "-o", self.name + kind.encode(), "--pictures", kind, "--quiet"],
                                  cwd=self.folder, capture_output=True, timeout=500, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(done.stdout.splitlines()[-1], self.name + kind.encode())  # a script takes it as it is


class Terminal(CommandTest):
    def tampered(self, **attributes):
        self.write("tiny.yaml", TINY)
        self.run_ok("run", "tiny.yaml", "-o", "out", "--quiet")
        path = self.folder / "out/run.h5"
        with h5py.File(path, "r+") as run:
            for name, value in attributes.items():
                run.attrs[name] = value
        data = path.read_bytes().rsplit(b"touchfield-crc32 ", 1)[0]
        path.write_bytes(data + b"touchfield-crc32 %08x\n" % zlib.crc32(data))

    def test_no_text_of_a_file_is_obeyed(self):
        self.tampered(name="x\n\x1b[31mred\x9b1m\u202e\x07\r\x7f")
        for command in [["info", "out"], ["compare", "out", "out"]]:
            done = self.run_ok(*command)
            self.assertIn(r"x\u000a\u001b[31mred\u009b1m\u202e\u0007\u000d\u007f", done.stdout)
            self.assertNotRegex(done.stdout, "[\x00-\x08\x0b-\x1f\x7f\x80-\x9f\u202e]")
        self.assertEqual(json.loads(self.run_ok("info", "out", "--json").stdout)["name"], "x\n\x1b[31mred\x9b1m\u202e\x07\r\x7f")

    def test_nor_of_an_argument(self):
        for command in [["run", "no\x1b[2J.yaml"], ["info", "a\x07b"], ["mesh", "\x1b]0;x\x07"], ["bad\x1bcommand"],
                        ["run", "--ba\x1bd"], ["run", "x.yaml", "--pictures", "\x1b[1m"], ["sweep", "\x9b.yaml"]]:
            done = self.is_refused(*command)
            self.assertNotRegex(done.stdout + done.stderr, "[\x00-\x08\x0b-\x1f\x7f\x80-\x9f]")

    def test_the_bar_of_a_terminal_is_still_drawn(self):
        self.write("tiny.yaml", TINY)
        ours, theirs = pty.openpty()
        done = subprocess.run([PROGRAM, "run", "tiny.yaml", "-o", "out"], cwd=self.folder, stdout=subprocess.DEVNULL, stderr=theirs,
                              timeout=500, check=False)
        os.close(theirs)
        shown = b""
        try:
            while block := os.read(ours, 65536):
                shown += block
        except OSError:  # its end
            pass
        os.close(ours)
        self.assertEqual(done.returncode, 0)
        self.assertIn(b"\r\x1b[K", shown)
        self.assertNotIn(rb"\u001b", shown)


class NoFiles(CommandTest):
    def setUp(self):
        super().setUp()
        self.write("tiny.yaml", TINY)
        self.run_ok("run", "tiny.yaml", "-o", "out", "--quiet")

    def refused(self, *command):
        done = subprocess.run([PROGRAM, *map(str, command)], cwd=self.folder, capture_output=True, text=True, timeout=60,
                              stdin=subprocess.DEVNULL, check=False)
        self.assertEqual(done.returncode, 2, (command, done.stderr))
        return done.stderr

    def readers(self, path):
        positions = self.write("positions.yaml", TINY.replace("grid: {count: [4, 4], pitch_mm: 10.16}", f"positions: {{file: {path}}}"))
        mesh = self.write("mesh.yaml", TINY.replace("sphere: {radius_mm: 6}", f"mesh: {{file: {path}, unit: mm}}"))
        sweep = self.write("s.yaml", f"base: {path}\ngrid: {{array.level: [1]}}\n")
        return [["run", path, "-o", "new"], ["check", path], ["check", positions], ["check", mesh], ["sweep", path, "-o", "new"],
                ["sweep", sweep, "-o", "new"], ["info", path], ["compare", "out", path], ["mesh", path],
                ["compare", "out", "--points", path], ["run", "--from", path, "-o", "new"],
                ["array", "test", "--run", "out", "--modulation-samples", path, "--to", "dry-run"]]

    def test_devices_sockets_and_folders_are_refused(self):
        (self.folder / "folder.yaml").mkdir()
        listening = socket.socket(socket.AF_UNIX)
        self.addCleanup(listening.close)
        listening.bind(str(self.folder / "socket.yaml"))
        for path in ["/dev/zero", "/dev/null", "/dev/tty", "folder.yaml", "socket.yaml"]:
            for command in self.readers(path):
                if path == "folder.yaml" and command[0] in ("info", "compare") or "--from" in command:
                    continue  # a folder that may hold a run
                with self.subTest(command=command, path=path):
                    said = self.refused(*command)
                    self.assertIn(path, said)
        self.assertFalse((self.folder / "new").exists())

    def test_a_pipe_that_nobody_writes_to_is_refused(self):
        os.mkfifo(self.folder / "pipe.csv")
        (self.folder / "again").mkdir()
        os.mkfifo(self.folder / "again/files.json")
        commands = [*self.readers("pipe.csv"), ["run", "tiny.yaml", "-o", "again", "--force"]]
        with concurrent.futures.ThreadPoolExecutor(len(commands)) as together:  # each waits for 2 s
            said = list(together.map(lambda command: self.refused(*command), commands))
        for command, text in zip(commands, said):
            self.assertIn("its files.json does not belong to a run" if "again" in command else "pipe.csv", text, command)

    def test_what_a_command_writes_is_read(self):
        program = shlex.quote(PROGRAM)
        for line in [f"{program} run <(cat tiny.yaml) -o a --quiet", f"cat tiny.yaml | {program} run /dev/stdin -o b --quiet",
                     f"{program} run /dev/stdin -o c --quiet < tiny.yaml", f"{program} run <(sleep 3; cat tiny.yaml) -o d --quiet",
                     f"{program} compare out --points <(printf 'x_mm,y_mm,z_mm,p_pa\\n0,0,40,1\\n1,0,41,2\\n')"]:
            done = subprocess.run(["bash", "-c", line], cwd=self.folder, capture_output=True, text=True, timeout=120, check=False)
            self.assertEqual(done.returncode, 0, (line, done.stderr))


if __name__ == "__main__":
    unittest.main()
