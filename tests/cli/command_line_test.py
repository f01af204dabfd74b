"""The command line itself: what is misspelt, left out or no number is refused in one line that names it and what was meant."""

import re
import unittest

from support import FINGER, CommandTest

NO_NUMBERS = ["nan", "-nan", "inf", "1e400", "0x10", "1,5", "five", ""]


class CommandLine(CommandTest):
    def said(self, *arguments):
        """The one line that refuses."""
        done = self.is_refused(*arguments)
        self.assertEqual(done.stdout, "")
        line, = done.stderr.splitlines()
        self.assertTrue(line.startswith("touchfield: error: "), line)
        return line.removeprefix("touchfield: error: ")

    def help_of(self, *command):
        said = self.run_ok(*command, "--help").stdout
        for line in said.splitlines():
            self.assertLessEqual(len(line), 80 if not line.startswith("  touchfield") else 100, line)
        below = re.findall(r"^  ([a-z]+) ", said.rpartition("\nOptions:\n")[2].partition("\nExamples:\n")[0], re.MULTILINE)
        return below, re.findall(r"^  (-\S+)(?: (\S[^\n]*?))?(?:  |\n)", said, re.MULTILINE)

    def commands(self):
        rest = [()]
        while rest:
            command = rest.pop()
            below, options = self.help_of(*command)
            rest += [(*command, name) for name in below]
            if not below:
                yield command, options

    def test_commands(self):
        self.assertEqual(self.said("runn", "x"), "unknown command 'runn'; did you mean run?")
        self.assertEqual(self.said("scene.yaml"), "unknown command 'scene.yaml'; to run a scene: touchfield run scene.yaml")
        self.assertIn("touchfield info out/run.h5", self.said("out/run.h5"))

    def test_a_scene_to_start_from(self):
        self.assertEqual(self.run_ok("init", "mine").stdout, "mine.yaml: next, touchfield run mine.yaml\n")
        self.assertIn("name: mine\n", self.run_ok("check", "mine.yaml", "--resolved").stdout)
        self.assertIn("mine.yaml", self.said("init", "mine"))
        self.run_ok("init", "mine.yaml", "--force")
        self.assertEqual(self.said("init", "my scene"), 'init: the name my scene must be letters, digits, _ and -')

    def test_options(self):
        for command, option, meant in [("run", "--out", "--output"), ("check", "--st", "--set"), ("hand", "--length-cm", "--length-mm")]:
            said = self.said(command, "x", f"{option}=3")
            self.assertEqual(said, f"unknown option {option}; did you mean {meant}?")
        self.assertEqual(self.said("--quiet", "run", "s.yaml"), "--quiet must follow the command: touchfield run --quiet")

    def test_values(self):
        self.assertEqual(self.said("check"), "SCENE is required; `touchfield check --help` explains it")
        self.assertRegex(self.said("run", "x", "--output"), r"^--output: 1 required .* missing; `touchfield run --help`")
        self.assertIn("--threads", self.said("run", "x", "--threads", "1", "--threads", "2"))
        self.assertIn("did you mean grasp?", self.said("hand", "-o", "x.obj", "--pose", "graps"))

    def test_bounds_are_in_the_unit_as_typed(self):
        self.assertEqual(self.said("hand", "-o", "x.obj", "--edge-mm", "0.01"), "--edge-mm 0.01 must be 0.3 to 12")
        self.assertEqual(self.said("run", "x", "--threads", "1.5"), "--threads 1.5 must be a whole number, 1 to 4096")

    def test_every_number_of_every_command_is_checked(self):
        seen = 0
        for command, options in self.commands():
            for names, kind in options:
                if not re.match("[NX]( x|$)", kind):
                    self.assertNotRegex(kind, "NUMBER|POSITIVE|INT|FLOAT", f"{command} {names}: an option of another mechanism")
                    continue
                seen += 1
                count = int(found.group(1)) if (found := re.search(r" x (\d+)$", kind)) else 1
                name = names.split(",")[-1]
                before = ["x.yaml"] if name == "--view" else []  # whose number may be left out: else it is taken for the scene
                for value in NO_NUMBERS if command == ("hand",) and name == "--edge-mm" else ["nan"]:
                    said = self.said(*command, *before, name, *[value] * count)
                    self.assertRegex(said, rf"^{name}( .* must be |: .*{count} required)", f"{command} {name} {value}")
        self.assertGreater(seen, 60)

    def test_what_a_command_cannot_do(self):
        scene = self.write("still.yaml", FINGER)
        self.assertIn("the scene has no motion: section", self.said("live", scene))
        self.assertIn("array off needs a device: add --to sonicsurface:PORT or --to autd3-udp, or", self.said("array", "off"))
        self.assertIn("; write [10,10,6]", self.said("check", scene, "--set", "target.box.size_mm=10,10,6"))


class Arrays(CommandTest):
    def scene(self, layout, name="scene.yaml"):
        before, rest = FINGER.split("array:", 1)
        return self.write(name, f"{before}array: {layout}\nbody:{rest.split('body:', 1)[1]}")

    def positions(self, header, scale=(1, 1)):
        rows = [f"{(x - 3.5) * 10.16 * scale[0]:.8g},{(y - 3.5) * 10.16 * scale[1]:.8g},0" for y in range(8) for x in range(8)]
        self.write("array.csv", "\n".join([*header, *rows]) + "\n")
        return self.scene("{positions: {file: array.csv}}")

    def test_slips_of_units(self):
        for scene, says in [(self.positions(["x_mm,y_mm,z_mm"], (1e-3, 1e-3)), "The header of a file says what they are in"),
                            (self.scene("{grid: {count: [8, 8], pitch_mm: 0.01016}}", "grid.yaml"), "is pitch_mm in mm?")]:
            done = self.is_refused("check", scene)
            self.assertRegex(done.stderr, r"transducers 0 and \d+ are 0.01016 mm apart")
            self.assertIn(says, done.stderr)
        self.is_refused("check", self.positions(["x_m,y_m,z_m"]), says="at most 20 m")
        done = self.run_ok("check", self.scene("{grid: {count: [8, 8], pitch_mm: 1.02}}"))
        self.assertRegex(done.stdout, r"(?m)^warnings +array_pitch: transducers 0 and \d+ are 1.02 mm apart")


if __name__ == "__main__":
    unittest.main()
