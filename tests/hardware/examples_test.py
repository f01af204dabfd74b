"""The commands of docs/hardware.md as they stand there, but for the places of devices and for coarser meshes."""

import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "cli"))

from support import SOURCE, CommandTest, unittest  # noqa: E402
from autd3_units import Emulator  # noqa: E402
from sonicsurface_board import Board  # noqa: E402

SDK = SOURCE / "build/autd3_sdk/0.12"
PAGE = (SOURCE / "docs/hardware.md").read_text()
COARSE = ["body.edge_mm=12", "solve.allow_coarse_mesh=true", "evaluation=none", "field=[]", "write=[h5]", "solve.iterations=1", "target.pressure_pa=1e6",
          "solve.methods=[{surface: {start: {random: 1}}}]"]


def commands():
    """Of code blocks, and those between backticks that name what they are done to."""
    blocks = [line.strip().split("  #")[0] for line in PAGE.splitlines() if re.match(r"(    )?touchfield ", line)]
    inline = [text for text in re.findall(r"`(touchfield [^`]+)`", PAGE) if re.search("RUN|LINK|array list", text)]
    return [[word.strip("'") for word in re.findall(r"'[^']*'|\S+", line)[1:]] for line in blocks + inline]


class Examples(CommandTest):
    def setUp(self):
        super().setUp()
        (self.folder / "scenes").symlink_to(SOURCE / "scenes")
        self.board = Board()
        self.addCleanup(self.board.close)
        self.units = Emulator(SDK, 6) if SDK.exists() else None
        if self.units:
            self.addCleanup(self.units.__exit__)

    def there(self, words):
        """A command with devices that this machine has."""
        link = "autd3-udp" if words[0] == "send" else "sonicsurface:/dev/ttyUSB0"  # RUN is for six units
        places = {"RUN": "results/runs/units", "NAME": "surface", "LINK": link}
        words = [places.get(word, word).replace("/dev/ttyUSB0", self.board.port) for word in words]
        if self.units:
            words = [f"autd3-udp:[::1]:{self.units.port}" if word == "autd3-udp" else word for word in words]
        if words[0] == "array" and "--emit" in words:
            words += ["--max-level", "1"]
        if words[0] == "run":
            for change in COARSE:
                words += ["--set", change]
        return words

    def test_every_command(self):
        done = {"run": 0, "send": 0, "array": 0}
        emitted = set()
        for words in commands():
            command = self.there(words)
            if "autd3-udp" in command:
                continue
            with self.subTest(command=" ".join(words)):
                said = self.run_ok(*command)
                if "--emit" in command:
                    self.assertIn("the array is silent", said.stdout)
                    emitted.add(command[command.index("--to") + 1].split(":")[0])
                done[command[0]] += 1
        self.assertGreaterEqual(min(done.values()), 1, done)
        there = {"autd3-udp": self.units is not None, "sonicsurface": True}
        self.assertEqual(emitted, {link for link, is_there in there.items() if is_there})
        self.assertGreater(len(self.board.patterns()), 1)
        self.assertTrue(self.board.firmware.silent())


if __name__ == "__main__":
    unittest.main()
