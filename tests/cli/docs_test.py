"""Checks every example of the documentation: YAML is read, Python runs, commands and their options exist.

The word of a fenced block is its kind. `yaml` is a whole scene or sweep, as in scenes/. `python` runs in the folder of a run. `usage`
is the synopsis of commands. `text` is an output or a layout and is not checked. No word means `sh`: one command per line, with
placeholders for the reader's files. Another word, an indented command and an unknown kind of command fail. Scripts are only asked for
their help. `cpp` must stand in a test or an example of C++, word for word. Commands and file names in backticks in the running text are checked too.
"""

import functools
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import unittest

from support import FINGER, SOURCE, CommandTest

PAGES = sorted([*SOURCE.glob("docs/*.md"), SOURCE / "README.md", *(SOURCE / folder / "README.md"
                                                                 for folder in ["scenes", "bench", "results"])])
TUTORIALS = sorted(SOURCE.glob("docs/tutorials/*.md"))  # whose blocks tutorials_test.py runs, but for those that say why not
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
COMMAND = r"(?:touchfield [a-z]|\.?/?scripts/)"


def blocks(page, *kinds):
    return [body for kind, body in BLOCK.findall(page.read_text()) if kind in kinds]


def each(*kinds):
    return [(page.name, body) for page in PAGES for body in blocks(page, *kinds)]


@functools.lru_cache(maxsize=None)
def help_of(script):
    """What a script says that it takes; the text of one that has no help."""
    text = script.read_text()
    if "--help" not in text and "argparse" not in text or "import torch" in text:
        return text
    started = [script] if os.access(script, os.X_OK) else [sys.executable, script]  # pvpython's
    return subprocess.run([*started, "--help"], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True, check=True,
                          timeout=60).stdout


def spans(page):
    return re.findall(r"`([^`\n]+)`", BLOCK.sub("", page.read_text()))


class Docs(CommandTest):
    def test_blocks_are_of_a_kind_that_is_tested(self):
        for page in PAGES:
            text = page.read_text()
            fences = re.findall(r"^ *```.*$", text, re.MULTILINE)
            self.assertEqual(len(fences), 2 * len(BLOCK.findall(text)), f"{page.name}: a fence that is not at a line's begin")
            for kind, body in BLOCK.findall(text):
                self.assertIn(kind, ["", "sh", "yaml", "python", "cpp", "usage", "text"], f"{page.name}: {body}")
            indented = re.search(rf"^ {{4,}}{COMMAND}.*", BLOCK.sub("", text), re.MULTILINE)
            self.assertIsNone(indented, f"{page.name}: a command outside a fenced block: {indented}")

    def test_scenes_and_sweeps(self):
        shutil.copytree(SOURCE / "scenes", self.folder / "scenes")
        for page, body in each("yaml"):
            with self.subTest(page=page, body=body):
                # An evaluation whose time is soon taken, of a score of a motion.
                evaluation = ["--set", "evaluation={edge_mm: {near_target: 3, far: 8, within_mm: 10}}"] if "\nmotion:" in body else []
                self.run_ok("check", self.write("scenes/example.yaml", body), *evaluation)
        shipped = sorted((SOURCE / "scenes").glob("*/*.yaml"))  # those beside them are warnings_test's
        self.assertGreaterEqual(len(shipped), 6)
        for scene in shipped:
            with self.subTest(scene=scene):
                self.run_ok("check", scene, *([] if scene.parent.name == "sweeps" else ["--resolved"]))

    def test_python(self):
        self.run_ok("run", self.write("finger.yaml", FINGER), "-o", "results/runs/width_5mm-0001", "--quiet", "--set",
                    "write=[transfer]")
        run = (self.folder / "results/runs/width_5mm-0001/run.h5").read_bytes()
        self.assertTrue(run[-26:].startswith(b"touchfield-crc32 "))
        self.write_samples()
        for page, body in each("python"):
            if page in ("python.md", "from-acoustools.md") or "import touchfield" in body:  # python/tests run them
                continue
            with self.subTest(page=page, body=body):
                (self.folder / "run.h5").write_bytes(run[:-26])  # as a program leaves it that changes it
                done = subprocess.run([sys.executable, "-c", body], cwd=self.folder, capture_output=True, text=True,
                                      check=False)
                self.assertEqual(done.returncode, 0, done.stderr)
                if "crc32" in body:
                    self.run_ok("info", "run.h5")

    def test_cpp(self):
        tests = [" ".join(path.read_text().split()) for path in [*SOURCE.glob("tests/**/*_test.cpp"), *SOURCE.glob("examples/*.cpp")]]
        for page, body in each("cpp"):
            with self.subTest(page=page, body=body):
                self.assertTrue(any(" ".join(body.split()) in test for test in tests))

    # Commands

    def options_of(self, *command):
        """Every option of a command and of its own commands."""
        said = self.run_ok(*command, "--help").stdout
        options = set(re.findall(r"(?<![\w-])--?[a-z][a-z-]*", said))
        commands = said.partition("\nSubcommands:\n")[2].partition("\nExamples:\n")[0]
        for name in re.findall(r"^  ([a-z]+) ", commands, re.MULTILINE):
            options |= self.options_of(*command, name)
        return options

    def check_touchfield(self, words):
        self.assertIn(words[0], self.commands, "no such command")
        named = {option.partition("=")[0] for word in words[1:]
                 for option in re.findall(r"(?<![\w-])--?[a-z][a-z-]*", word if word[0] in "-[|" else "")}
        self.assertLessEqual(named, self.commands[words[0]], f"touchfield {words[0]} --help does not know them")

    def check_script(self, words):
        script = SOURCE / words[0]
        self.assertTrue(script.exists(), f"no file {words[0]}")
        known = help_of(script) if script.is_file() else ""
        for word in words[1:]:
            if word.startswith("--") and script.suffix != ".slurm" and script.name != "run":
                self.assertIn(word, known)
            if word.startswith("scenes/"):
                self.assertTrue((SOURCE / word).is_file(), f"no file {word}")

    def check_command(self, words):
        while re.match(r"[A-Z_]+=", words[0]):
            words = words[1:]
        program, rest = words[0], words[1:]
        if program in ("export", "mkdir", "cd", "cp"):
            return
        if program in ("touchfield", "venv/bin/touchfield"):
            self.check_touchfield(rest)
        elif re.match(r"(\./)?scripts/", program):
            self.check_script(words)
        elif program in ("pvpython", "build/python/bin/python"):
            self.check_script(rest)
        elif program == "source":
            self.check_command(re.fullmatch(r"<\((.*)\)", " ".join(rest))[1].split())
        elif program == "sbatch":
            self.check_script(rest[next(i for i, word in enumerate(rest) if not word.startswith("-")):])
        elif program == "cmake" and "--preset" not in rest:  # as library_test.py calls it
            for option, folder in zip(rest, rest[1:]):
                if option == "-S":
                    self.assertTrue((SOURCE / folder / "CMakeLists.txt").is_file(), f"no project in {folder}")
        elif program == "python3":
            self.assertEqual(rest[:2], ["-m", "venv"])
        elif program == "venv/bin/pip":
            if rest[-1].endswith(".whl"):  # as tests/python/wheel_test.py installs it
                return
            self.assertTrue((SOURCE / rest[-1] / "pyproject.toml").is_file(), f"no package in {rest[-1]}")
        elif program in ("podman", "apptainer"):  # as tests/python/wheel_test.py does the steps of their recipes
            self.assertTrue(rest[-1] in (".", "doctor") or (SOURCE / "scripts" / rest[-1]).is_file())
        elif program == "g++":
            self.assertTrue((SOURCE / next(word for word in rest if word.endswith(".cpp"))).is_file())
        elif program == "cmake":
            presets = json.loads((SOURCE / "CMakePresets.json").read_text())
            kind = "buildPresets" if "--build" in rest else "configurePresets"
            self.assertIn(rest[rest.index("--preset") + 1], [preset["name"] for preset in presets[kind]])
        elif program.startswith(("build/bench/bench/", "build/examples/")):
            folder, _, name = program.removeprefix("build/bench/").removeprefix("build/").partition("/")
            self.assertIn(name, (SOURCE / folder / "CMakeLists.txt").read_text())
        else:
            self.fail("a command that this test does not know; output is a block of `text`")

    def test_commands(self):
        listed = self.run_ok("--help").stdout.partition("\nScenes:\n")[2].partition("\nExamples:\n")[0]
        self.commands = {name: self.options_of(name) for name in re.findall(r"^  ([a-z]+) ", listed, re.MULTILINE)}
        self.assertIn("--case-seconds", self.commands["sweep"])
        self.assertIn("--dwell", self.commands["array"])
        left_out = [(page.name, body) for page in TUTORIALS
                    for body in re.findall(r"^<!-- not run: .* -->\n```sh\n(.*?)^```$", page.read_text(), re.MULTILINE | re.DOTALL)]
        for page, body in each("", "sh") + left_out:
            for command in re.split(r"\n|&&", body.replace("\\\n", " ")):
                with self.subTest(page=page, command=command):
                    words = shlex.split(command, comments=True)
                    if words:
                        self.check_command(words)
        for page, body in each("usage"):
            for line in re.sub(r"\n +", " ", body).splitlines():
                with self.subTest(page=page, line=line):
                    words = line.split()
                    self.assertEqual(words[0], "touchfield")
                    self.check_touchfield(words[1:])
        usage, = blocks(SOURCE / "docs/user-guide.md", "usage")
        self.assertEqual(set(re.findall(r"^touchfield ([a-z]+)", usage, re.MULTILINE)), set(self.commands))
        for page in PAGES + TUTORIALS:
            for span in spans(page):
                with self.subTest(page=page.name, span=span):
                    if re.match(COMMAND, span):
                        self.check_command(span.split())
                    elif re.fullmatch(r"(apps|cmake|docs|hardware|python|scenes|scripts|sim|solvers|tests)/[\w/*]+(\.\w+)?", span):
                        self.assertTrue("NAME" in span or list(SOURCE.glob(span)), "no such file")


if __name__ == "__main__":
    unittest.main()
