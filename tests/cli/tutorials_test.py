"""Does every tutorial as its reader would, block by block, in a folder of its own that looks like a clone.

`sh` and `python` blocks run. A `yaml` block becomes the file that its first line names. A `text` block must stand in the output of the
block before: words unchanged, numbers within 5 %, `..` for anything. A stand-in replaces the board; four of its transducers are walked.
Two runs without shown figures have no evaluation mesh. Blocks after a line `<!-- not run: REASON -->` are left out and listed;
docs_test.py checks the names of their commands. After `<!-- picture: FILE -->` the image on the next line is that file of these runs. With
TOUCHFIELD_PICTURES set it is drawn again. Those in LONG_ONES repeat other tests with figures.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "hardware"))

from sonicsurface_board import Board  # noqa: E402
from support import LONG, PROGRAM, SOURCE, CommandTest  # noqa: E402

PARTS = re.compile(r"^<!-- picture: (?P<picture>[^\n]*) -->\n!\[[^\n]*\]\((?P<image>[^\n]*)\)$"
                   r"|(?:^<!-- not run: (?P<reason>[^\n]*) -->\n)?^```(?P<kind>\w*)\n(?P<body>.*?)^```$", re.MULTILINE | re.DOTALL)

BOARD = "/dev/ttyUSB0"
UNEVALUATED = re.compile(r"-o (?:longer|board)\b")  # runs whose figures no page shows: an evaluation takes most of their time


def pattern_of(line):
    """What a line of a `text` block is of the output, and its numbers."""
    words = [word for word in re.split(r"(\.\.)|\s+|([-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?)", line) if word]
    numbers = [float(word) for word in words if re.fullmatch(r"[-+]?\d.*", word)]
    parts = [".*?" if word == ".." else r"([-+]?\d[\d.]*(?:e[-+]?\d+)?)" if re.fullmatch(r"[-+]?\d.*", word) else re.escape(word)
             for word in words]
    return re.compile(r"\s*".join(parts)), numbers


def stands_in(line, output):
    pattern, numbers = pattern_of(line)
    return any(all(abs(float(found) - number) <= 0.05 * abs(number) for found, number in zip(match.groups(), numbers))
               for match in pattern.finditer(output))


class Following(CommandTest):
    def do(self, *command, **options):
        done = subprocess.run(command, cwd=self.folder, env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                              text=True, timeout=200, check=False, **options)
        self.assertEqual(done.returncode, 0, f"{command[-1]}\n{done.stdout}")
        return done.stdout

    def on_a_board(self, commands):
        board = Board()
        self.addCleanup(board.close)
        said = self.do("bash", "-ec", commands.replace(BOARD, board.port).replace("array walk", "array walk --count 4"))
        self.assertTrue(board.wait(lambda one: one.silent_at is not None))
        self.assertEqual(len(board.patterns()), 4 + 1)
        return said

    def follow(self, page):
        shutil.copytree(SOURCE / "scenes", self.folder / "scenes")
        (self.folder / "build").mkdir()
        (self.folder / "build/release").symlink_to(pathlib.Path(PROGRAM).resolve().parents[1])
        self.environment = {**os.environ, "PATH": f"{pathlib.Path(PROGRAM).parent}:{os.environ['PATH']}", "HOME": str(self.folder),
                            "CLONE": str(self.folder)}
        text = page.read_text()
        self.assertEqual(text.count("```"), 2 * sum(bool(part["body"]) for part in PARTS.finditer(text)))
        said = ""
        for part in PARTS.finditer(text):
            kind, body = part["kind"], part["body"]
            if part["picture"]:
                self.assert_pictured(self.folder / part["picture"], (page.parent / part["image"]).resolve())
            elif part["reason"]:
                print(f"not run: {page.name}: {part['reason']}: {'; '.join(body.splitlines())}")
            elif kind == "sh" and BOARD in body:
                said = self.on_a_board(body)
            elif kind == "sh":
                said = self.do("bash", "-ec", UNEVALUATED.sub(r"\g<0> --set evaluation=none", body))
            elif kind == "python":
                said = self.do(sys.executable, "-c", body)
            elif kind == "yaml":
                (self.folder / re.match(r"# (\w+\.yaml)\n", body)[1]).write_text(body)
            elif kind == "text":
                for line in body.splitlines():
                    self.assertTrue(stands_in(line, said), f"`{line}` is not in\n{said}")
            else:
                self.fail(f"a block of {kind}")

    def assert_pictured(self, drawn, image):
        from PIL import Image  # of Debian's python3-pil, as in the tests of depth images

        if "TOUCHFIELD_PICTURES" in os.environ:
            shutil.copyfile(drawn, image)
        with Image.open(drawn) as new, Image.open(image) as kept:
            self.assertEqual(kept.size, new.size, f"{image.name} is not of {drawn.name}")


class Tutorials(Following):
    pass


@LONG
class LongTutorials(Following):
    pass


PAGES = {page.stem: page for page in sorted((SOURCE / "docs/tutorials").glob("*.md"))}
LONG_ONES = ("moving-hand", "own-hand", "pattern")
for one, path in PAGES.items():
    setattr(LongTutorials if one in LONG_ONES else Tutorials, f"test_{one.replace('-', '_')}",
            lambda self, page=path: self.follow(page))


if __name__ == "__main__":
    unittest.main()
