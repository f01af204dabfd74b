"""The library as others get it: installed, moved, used by CMake and by pkg-config. The examples say what they should."""

import filecmp
import os
import pathlib
import re
import shutil
import subprocess
import unittest

from binaries import is_binary, missing_guards, readelf, strangers

SOURCE = pathlib.Path(os.environ["TOUCHFIELD_SOURCE_DIR"])
BUILD = pathlib.Path(os.environ["TOUCHFIELD_BUILD_DIR"])
CMAKE = os.environ["TOUCHFIELD_CMAKE"]
COMPILER = os.environ["TOUCHFIELD_COMPILER"]
WORK = BUILD / "tests/library"
PREFIX = WORK / "moved"
SCENE = SOURCE / "scenes/capsule.yaml"


def run(*command, **options):
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=600, check=False, **options)
    if done.returncode != 0:
        raise AssertionError(f"{command}: {done.returncode}\n{done.stdout[-4000:]}\n{done.stderr[-4000:]}")
    return done.stdout


def numbers(pattern, text):
    return [float(number) for number in re.findall(pattern, text)]


class Library(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        shutil.rmtree(WORK, ignore_errors=True)
        run(CMAKE, "--install", BUILD, "--prefix", WORK / "first")
        (WORK / "first").rename(PREFIX)
        cls.library, = {path.parent for path in PREFIX.rglob("libtouchfield.so")}
        cls.environment = {**os.environ, "PKG_CONFIG_PATH": str(cls.library / "pkgconfig")}

    def flags(self, *options):
        return run("pkg-config", *options, "touchfield", env=self.environment).split()

    def test_the_package_names_no_folder_and_no_option_of_ours(self):
        files = [*self.library.rglob("*.cmake"), *self.library.rglob("*.pc")]
        self.assertEqual(len(files), 5, files)  # package, version, targets in two files, pkg-config
        for file in files:
            for word in [str(SOURCE), str(BUILD), str(WORK), " -W", " -f", "PARALLELIZE", "VTK", "hdf5", "fmt"]:
                self.assertNotIn(word, file.read_text(), file)
        linked = run("readelf", "-d", self.library / "libtouchfield.so")
        self.assertNotIn(str(BUILD), linked)
        self.assertRegex(linked, r"SONAME.*\[libtouchfield\.so\.\d+\.\d+\]")

    def test_no_binary_looks_in_the_current_folder_or_lacks_a_guard(self):
        binaries = [path for path in PREFIX.rglob("*") if is_binary(path)]
        self.assertGreaterEqual(len(binaries), 2)
        for path in binaries:
            self.assertEqual([strangers(path), missing_guards(path)], [[], []], path)
        self.assertIn("__memcpy_chk", readelf("--dyn-syms", PREFIX / "bin/touchfield"))  # _FORTIFY_SOURCE

    def test_headers_need_eigen_alone(self):
        headers = sorted(path.relative_to(PREFIX / "include") for path in PREFIX.glob("include/**/*.h"))
        self.assertGreater(len(headers), 150)
        every = WORK / "every.cpp"
        every.write_text("".join(f"#include <{header}>\n" for header in headers))
        run(COMPILER, "-std=c++20", "-fsyntax-only", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror",
            *self.flags("--cflags"), every)

    def test_examples(self):
        build = WORK / "examples"
        run(CMAKE, "-S", SOURCE / "examples", "-B", build, "-G", "Ninja", f"-DCMAKE_PREFIX_PATH={PREFIX}",
            f"-DCMAKE_CXX_COMPILER={COMPILER}", "-DCMAKE_CXX_FLAGS_RELEASE=-O1")
        run(CMAKE, "--build", build)

        self.assertRegex(run(build / "first_run"), r"^surface: relative error \d+\.\d %\n")

        said = run(build / "sphere")
        errors = numbers(r"error ([\d.]+) %", said)
        self.assertEqual(len(errors), 3, said)
        self.assertLess(errors[2], errors[1])
        self.assertLess(errors[1], errors[0])
        self.assertLess(errors[2], 0.5)

        own = run(build / "own_method", SCENE)
        self.check_own_method(own)

        run_file, phases, sent = WORK / "run.h5", WORK / "phases.txt", WORK / "sent.txt"
        small = WORK / "finger.yaml"
        small.write_text((SOURCE / "tests/data/finger.yaml").read_text() + "solve: {methods: [focus]}\n")
        said = run(build / "send_dry_run", small, run_file, phases)
        self.assertIn("64 transducers, method focus, 1 s at level 0.5", said)
        self.assertIn("nothing emitted", said)
        run(PREFIX / "bin/touchfield", "send", run_file, "--method", "focus", "--to", f"dry-run:{sent}")
        self.assertTrue(filecmp.cmp(phases, sent, shallow=False))

        # Eigen aligns by the processor that it is compiled for: matrices that cross must be freed as they were made.
        native = WORK / "own_method_native"
        run(COMPILER, "-std=c++20", "-O1", "-march=native", SOURCE / "examples/own_method.cpp", "-o", native,
            *self.flags("--cflags", "--libs"), f"-Wl,-rpath,{self.library}")
        said = run(native, SCENE)
        self.check_own_method(said)
        for here, there in zip(numbers(r"relative_error ([\d.]+)", said), numbers(r"relative_error ([\d.]+)", own)):
            self.assertAlmostEqual(here, there, delta=0.01)

    def check_own_method(self, said):
        by_h, by_run = numbers(r"relative_error ([\d.]+)", said)
        self.assertAlmostEqual(by_h, by_run, delta=2e-3, msg=said)
        self.assertLess(by_run, 0.45, said)  # free field alone: 0.54
        for name in ["paper", "unscattered", "focus", "own"]:
            self.assertRegex(said, rf"(?m)^\s*{name} ")


if __name__ == "__main__":
    unittest.main()
