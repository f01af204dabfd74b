"""Scripts: `scripts/run` where packages for building are missing, calls from a foreign folder, kept tables."""

import os
import pathlib
import shutil
import subprocess
import tempfile
import time
import unittest

SOURCE = pathlib.Path(os.environ["TOUCHFIELD_SOURCE_DIR"])


class ScriptsRun(unittest.TestCase):
    """A tree of the scripts alone, with stand-ins for the program and Debian's tools."""

    def setUp(self):
        self.root = pathlib.Path(tempfile.mkdtemp(prefix="touchfield-scripts-"))
        self.addCleanup(shutil.rmtree, self.root, ignore_errors=True)
        for folder in ["scripts", "cmake", "sim", "solvers", "hardware", "apps", "tools", "build/release/apps"]:
            (self.root / folder).mkdir(parents=True)
        for name in ["run", "setup", "setup_autd3", "setup_python", "packages-kernel.txt", "packages.txt", "packages-test.txt"]:
            shutil.copy(SOURCE / "scripts" / name, self.root / "scripts" / name)
        for name in ["CMakeLists.txt", "CMakePresets.json", "sim/source.cpp", "scene.yaml"]:
            (self.root / name).write_text("")
        self.script("tools/dpkg-query", 'shift 2\nfor name; do [[ $name == libvtk9-dev ]] || echo "installed $name"; done\nexit 1')
        self.script("tools/apt-get", f"echo called >>{self.root}/apt; exit 1")
        self.script("tools/sudo", '[[ $1 != -n ]] || shift\nexec "$@"')
        self.script("tools/cmake", "exit 1")
        time.sleep(0.02)  # the program is newer than its sources
        self.program("echo the program: $*")

    def script(self, name, text):
        path = self.root / name
        path.write_text(f"#!/usr/bin/env bash\n{text}\n")
        path.chmod(0o755)

    def program(self, text):
        self.script("build/release/apps/touchfield", text)

    def run_script(self, name, *arguments, cwd=None, **environment):
        environment = {**os.environ, "PATH": f"{self.root}/tools:{os.environ['PATH']}", **environment}
        return subprocess.run([self.root / "scripts" / name, *arguments], cwd=cwd or self.root, env=environment,
                              capture_output=True, text=True, timeout=60, check=False)

    def run_scene(self):
        return self.run_script("run", "scene.yaml")

    def test_the_program_that_is_built_runs_without_them(self):
        done = self.run_scene()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stdout, "the program: run scene.yaml\n")
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        self.assertIn("libvtk9-dev", done.stderr)
        self.assertFalse((self.root / "apt").exists(), "apt-get was asked to install")

    def test_they_are_installed_if_it_does_not_start(self):
        self.program("exit 127")
        self.assertNotEqual(self.run_scene().returncode, 0)
        self.assertTrue((self.root / "apt").exists())

    def test_they_are_installed_if_a_source_is_newer(self):
        time.sleep(0.02)
        (self.root / "sim/source.cpp").write_text("// changed")
        self.assertNotEqual(self.run_scene().returncode, 0)
        self.assertTrue((self.root / "apt").exists())


    def test_an_optional_step_that_fails_installs_nothing(self):
        self.script("build/release/build.ninja", "")
        broken = self.root / "pip.conf"
        broken.write_text("[global\n")  # pip does not start
        for name, says in (("setup_autd3", "there is no pip that starts"), ("setup_python", "")):
            done = self.run_script(name, PIP_CONFIG_FILE=str(broken))
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn(says, done.stderr)
            self.assertIn("will be skipped", done.stderr)
        self.assertFalse((self.root / "apt").exists(), "apt-get was asked to install")

    def test_nothing_is_run_from_the_folder_of_the_call(self):
        foreign = self.root / "foreign"
        foreign.mkdir()
        for module in ["argparse", "csv", "json", "numpy", "pathlib", "pip", "re", "subprocess", "venv", "zipfile"]:
            (foreign / f"{module}.py").write_text(f"open({str(self.root / 'foreign-ran')!r}, 'a').write('{module} ')\n")
        for program in ["cmake", "dpkg-query", "flock", "git", "mktemp", "ninja", "nproc", "python3"]:
            self.script(f"foreign/{program}", f"echo {program} >>{self.root}/foreign-ran; exit 1")
        environment = {"PATH": f".:{self.root}/tools:{os.environ['PATH']}", "PYTHONPATH": ":", "PIP_NO_INDEX": "1"}
        for name, *arguments in (["setup", "touchfield"], ["setup_autd3"], ["setup_python"], ["run", self.root / "scene.yaml"]):
            with self.subTest(name):
                self.run_script(name, *arguments, cwd=foreign, **environment)
        for script in sorted((SOURCE / "scripts").iterdir()):
            if script.is_file() and "python" in script.read_text().split("\n", 1)[0]:
                with self.subTest(script.name):
                    subprocess.run([script, "--help"], cwd=foreign, env={**os.environ, **environment}, capture_output=True, timeout=60, check=False)
        self.assertFalse((self.root / "foreign-ran").exists(), (self.root / "foreign-ran").read_text() if (self.root / "foreign-ran").exists() else "")


class Tables(unittest.TestCase):
    def test_the_means_over_kept_draws_are_the_kept_ones(self):
        with tempfile.TemporaryDirectory(prefix="touchfield-tables-") as folder:
            done = subprocess.run([SOURCE / "scripts/tables", "tolerances", "-o", folder, "--work", f"{folder}/runs"], capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            for name in ("tolerances_errors", "tolerances_weak"):
                made, kept = ((root / f"{name}.csv").read_text().split("\n", 1)[1] for root in (pathlib.Path(folder), SOURCE / "results/tables"))
                self.assertEqual(made, kept)


if __name__ == "__main__":
    unittest.main()
