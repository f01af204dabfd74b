"""Tables and numbers of README and docs are those of the kept results, and a changed one is found."""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(os.environ.get("TOUCHFIELD_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))

TABLE = "# made by: scripts/some; revision: 0123abcd\nscheme,faces,error\npaper,5120,0.0343\nchief,20480,0.0051\nsplit,720,\n"
PAGE = """Before.
<!-- table: errors | scheme | faces:,d | error [%]=100*error:.1f -->
| scheme | faces | error [%] |
|---|---|---|
| paper | 5,120 | 3.4 |
| chief | 20,480 | 0.5 |
| split | 720 | - |
<!-- /table -->
The worst is <!-- value: max errors error:.1% -->3.4 %<!-- /value -->, `chief` <!-- value: errors error:.2% scheme=chief
-->0.51 %<!-- /value -->, its formula <!-- value: max errors (faces/error)**0.5:.1f -->2003.9<!-- /value -->.
"""


class Figures(unittest.TestCase):
    def setUp(self):
        self.root = pathlib.Path(tempfile.mkdtemp(prefix="touchfield-figures-"))
        self.addCleanup(shutil.rmtree, self.root, ignore_errors=True)
        for folder in ("docs", "results/tables"):
            (self.root / folder).mkdir(parents=True)
        self.page, self.table = self.root / "docs/page.md", self.root / "results/tables/errors.csv"
        self.page.write_text(PAGE)
        self.table.write_text(TABLE)

    def figures(self, *options, root=None):
        return subprocess.run([sys.executable, str(SOURCE / "scripts/figures"), "--root", str(root or self.root), *options],
                              capture_output=True, text=True, check=False)

    def assert_found(self, said):
        checked = self.figures("--check")
        self.assertEqual(checked.returncode, 1, checked.stdout)
        self.assertIn(said, checked.stdout)
        self.assertEqual(checked.stderr, "")

    def test_the_documentation_is_what_the_results_say(self):
        checked = self.figures("--check", root=SOURCE)
        self.assertEqual(checked.returncode, 0, checked.stdout + checked.stderr)

    def test_a_number_changed_by_hand_is_found_and_mended(self):
        for old, new in (("| 0.5 |", "| 0.4 |"), ("3.4 %<", "3.3 %<"), ("| split | 720 | - |\n", "")):
            with self.subTest(old=old):
                self.page.write_text(PAGE.replace(old, new, 1))
                self.assert_found("docs/page.md:")
                written = self.figures()
                self.assertEqual(written.returncode, 0, written.stdout)
                self.assertEqual(self.page.read_text(), PAGE)

    def test_a_number_changed_in_the_results_is_found(self):
        self.table.write_text(TABLE.replace("0.0343", "0.0353"))
        self.assert_found("the page has `3.4 %`, the results `3.5 %`")
        self.assertEqual(self.figures().returncode, 0)
        self.assertEqual(self.page.read_text(), PAGE.replace("3.4", "3.5"))

    def test_marks_that_cannot_be_filled_are_named(self):
        for old, new, said in (("table: errors", "table: mistakes", "no table results/tables/mistakes.csv"),
                               ("scheme=chief", "scheme=cheif", "0 rows"), ("<!-- /table -->", "", "not closed")):
            with self.subTest(new=new):
                self.page.write_text(PAGE.replace(old, new, 1))
                self.assert_found(said)


if __name__ == "__main__":
    unittest.main()
