"""scripts/release in a small clone with a stand-in for scripts/wheel: its archive, its checksums, what it refuses."""

import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import tarfile
import tempfile
import unittest

SOURCE = pathlib.Path(os.environ["TOUCHFIELD_SOURCE_DIR"])
FILES = ["CMakeLists.txt", "CITATION.cff", "CHANGELOG.md", ".gitattributes", "cmake/revision.txt", "cmake/write_version.cmake",
         "scripts/release"]
# In place of the build: a program that says what cmake/write_version.cmake has found, and a run of nothing.
RUN = r"""#!/usr/bin/env bash
set -e
root=$(dirname "$0")/..
mkdir -p "$root/build/release/apps" "$3"
cmake -DSOURCE="$root" -DOUT="$root/data.h" -P "$root/cmake/write_version.cmake"
revision=$(sed -nE 's/#define TOUCHFIELD_REVISION "(.*)"/\1/p' "$root/data.h")
version=$(sed -nE 's/^project\(touchfield VERSION ([0-9.]+).*/\1/p' "$root/CMakeLists.txt")
printf '#!/bin/sh\necho "touchfield %s (%s)"\n' "$version" "$revision" >"$root/build/release/apps/touchfield"
chmod +x "$root/build/release/apps/touchfield"
echo results >"$3/run.h5"
"""
WHEEL = '#!/usr/bin/env bash\nmkdir -p "$1"\necho packed | tee "$1/touchfield-linux.tar.xz" >"$1/touchfield-none.whl"\n'


class Release(unittest.TestCase):
    def setUp(self):
        if not shutil.which("git"):
            self.skipTest("git is not installed")
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="touchfield-release-"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.clone = self.folder / "clone"
        for name in FILES:
            (self.clone / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(SOURCE / name, self.clone / name)
        (self.clone / "scripts/wheel").write_text(WHEEL)
        (self.clone / "scripts/wheel").chmod(0o755)
        (self.clone / "scripts/run").write_text(RUN)
        (self.clone / "scripts/run").chmod(0o755)
        self.git("init", "-q")
        self.commit()
        self.version = re.search(r"project\(touchfield VERSION ([\d.]+)", (self.clone / "CMakeLists.txt").read_text())[1]

    def git(self, *words):
        command = ["git", "-c", "user.name=t", "-c", "user.email=t@example.org", "-C", self.clone, *words]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()

    def commit(self):
        self.git("add", "-A")
        self.git("commit", "-q", "-m", "sources")

    def release(self, *words):
        return subprocess.run([self.clone / "scripts/release", *words], cwd=self.folder, capture_output=True, text=True,
                              timeout=60, check=False)

    def test_two_calls_give_the_same_archive(self):
        archives = []
        for name in ["first", "second"]:
            done = self.release("--no-check", name)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            sums = (self.folder / name / "SHA256SUMS").read_text().splitlines()
            self.assertEqual([line.split()[1] for line in sums], [f"touchfield-{self.version}.tar.gz", "touchfield-linux.tar.xz", "touchfield-none.whl"])
            archives.append((self.folder / name / f"touchfield-{self.version}.tar.gz").read_bytes())
            self.assertEqual(sums[0].split()[0], hashlib.sha256(archives[-1]).hexdigest())
        self.assertEqual(*archives)

    def test_the_archive_is_built_and_run(self):
        commit = self.git("rev-parse", "HEAD")
        done = self.release("out")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertIn("release: the archive builds and runs\n", done.stdout)
        with tarfile.open(self.folder / "out" / f"touchfield-{self.version}.tar.gz") as archive:
            self.assertFalse([name for name in archive.getnames() if "/.git/" in name])
            self.assertIn(commit[:12], archive.extractfile(f"touchfield-{self.version}/cmake/revision.txt").read().decode())
        # Sources whose program would not know its revision.
        (self.clone / ".gitattributes").unlink()
        self.commit()
        done = self.release("out")
        self.assertEqual(done.returncode, 1)
        self.assertIn(f"says 'touchfield {self.version} (unknown)' and not", done.stderr)

    def test_a_dirty_tree_is_refused_unless_told(self):
        (self.clone / "CMakeLists.txt").write_text((self.clone / "CMakeLists.txt").read_text() + "# more\n")
        (self.clone / "new.txt").write_text("new")
        done = self.release("--no-check", "out")
        self.assertEqual(done.returncode, 2)
        self.assertIn("CMakeLists.txt", done.stderr)
        self.assertIn("?? new.txt", done.stderr)
        self.assertIn("--dirty", done.stderr)
        self.assertFalse((self.folder / "out").exists())
        self.assertEqual(self.release("--dirty", "--no-check", "out").returncode, 0)
        with tarfile.open(self.folder / "out" / f"touchfield-{self.version}.tar.gz") as archive:
            self.assertNotIn(f"touchfield-{self.version}/new.txt", archive.getnames())

    def test_versions_that_differ_are_refused(self):
        path = self.clone / "CITATION.cff"
        path.write_text(path.read_text().replace(f"version: {self.version}", "version: 7.0.0"))
        self.commit()
        done = self.release("--no-check", "out")
        self.assertEqual(done.returncode, 2)
        self.assertIn("7.0.0 in CITATION.cff", done.stderr)


if __name__ == "__main__":
    unittest.main()
