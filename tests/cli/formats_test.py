"""Formats of files: what docs/formats.md lists is written and read, every other version is refused with the release that reads it."""

import json
import re
import shutil
import unittest
import zlib

import h5py

from support import SOURCE, CommandTest

SCENES = SOURCE / "tests/data/formats"
PAGE = (SOURCE / "docs/formats.md").read_text()
# docs/formats.md: file -> its format and version.
LISTED = {name: (kind, int(version)) for name, kind, version in
          re.findall(r"^\| `([\w.]+)` \| `(touchfield-[\w-]+)` \| (\d+) \|$", PAGE, re.MULTILINE)}


def says_of_itself(path):
    if path.suffix == ".json":
        known = json.loads(path.read_text())
    else:
        with h5py.File(path) as file:
            known = dict(file.attrs)
    return known["format"], int(known["format_version"])


def renumber(path, version):
    """The same file as of another version, whole."""
    if path.suffix == ".json":
        path.write_text(json.dumps({**json.loads(path.read_text()), "format_version": version}))
        return
    with h5py.File(path, "r+") as file:
        file.attrs["format_version"] = version
    data = path.read_bytes()
    at = data.rfind(b"touchfield-crc32 ")  # what h5py appends comes behind the old line
    data = data[:at] if at == len(data) - 26 else data
    path.write_bytes(data + b"touchfield-crc32 %08x\n" % zlib.crc32(data))


class Formats(CommandTest):
    def setUp(self):
        super().setUp()
        shutil.copytree(SCENES, self.folder / "kept")

    def test_another_version_is_refused_in_one_line(self):
        self.run_ok("run", "kept/tiny.yaml", "-o", "new/run", "--quiet")
        self.run_ok("play", "kept/moving.yaml", "-o", "new/motion", "--quiet")
        self.run_ok("sweep", "kept/sweep.yaml", "-o", "new/sweep", "--quiet")
        self.assertEqual(list(LISTED), ["run.h5", "motion.h5", "sweep.json"])
        for name, (kind, own) in LISTED.items():
            path = self.folder / "new" / name.split(".")[0] / name
            commands = {"run.h5": [["info", path], ["compare", path, path], ["run", "--from", path, "-o", "again"],
                                   ["send", path, "--to", "dry-run:frames.bin"]],
                        "motion.h5": [["info", path]],
                        "sweep.json": [["sweep", "kept/sweep.yaml", "-o", path.parent]]}[name]
            self.assertEqual(says_of_itself(path), (kind, own))
            self.run_ok(*commands[0])
            for version, reader in [(own - 1, "touchfield 0.3.0"), (own + 1, "a newer touchfield")]:
                renumber(path, version)
                for command in commands:
                    with self.subTest(command=command, version=version):
                        said = self.is_refused(*command).stderr
                        self.assertEqual(said, f"touchfield: error: {path}: format version {version} is not {own}, the one that this "
                                         f"program reads: {reader} reads it\n")
                        if name == "run.h5":
                            self.assertIn(said.replace(str(path), name), PAGE)


if __name__ == "__main__":
    unittest.main()
