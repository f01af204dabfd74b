"""Code is loaded from the program's own folders and the system's, never from the current one."""

import os
import pathlib
import re
import shutil
import subprocess
import unittest

from binaries import is_binary, search_paths, strangers
from support import PROGRAM, CommandTest

BUILD = pathlib.Path(PROGRAM).resolve().parent.parent


def ldd():
    """Path of each library that the program is linked to, by name."""
    said = subprocess.run(["ldd", PROGRAM], capture_output=True, text=True, check=True).stdout
    return dict(re.findall(r"(\S+) => (/\S+)", said))


@unittest.skipUnless(shutil.which("readelf"), "binutils is not installed")
class Loading(CommandTest):
    def test_no_binary_looks_in_the_current_folder(self):
        files = [pathlib.Path(folder) / name for folder, _, names in os.walk(BUILD) for name in names]
        binaries = [path for path in files if is_binary(path)]
        self.assertIn(pathlib.Path(PROGRAM).resolve(), binaries)
        self.assertIn("$ORIGIN/../lib", search_paths(PROGRAM))  # else nothing would be read here
        for path in [*binaries, *ldd().values()]:
            self.assertEqual(strangers(path), [], path)

    def test_libraries_of_the_current_folder_are_left_alone(self):
        names = ldd()
        self.assertGreater(len(names), 20)
        for name in [*names, "libtouchfield_gpu.so", "libcuda.so.1"]:
            self.write(name, "no library")
        (self.folder / "lib").mkdir()
        self.run_ok("--version")
        # By a name that a caller has made up, too.
        done = subprocess.run(["./touchfield", "doctor", "--json"], executable=PROGRAM, cwd=self.folder, capture_output=True,
                              text=True, timeout=100, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertNotIn("invalid ELF header", done.stdout)
        self.assertNotIn("file too short", done.stdout)


if __name__ == "__main__":
    unittest.main()
