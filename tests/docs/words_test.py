"""README, docs and the texts of the program are in plain English, and each word of the list is found."""

import os
import pathlib
import runpy
import shutil
import subprocess
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(os.environ.get("TOUCHFIELD_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))


class Words(unittest.TestCase):
    def setUp(self):
        self.root = pathlib.Path(tempfile.mkdtemp(prefix="touchfield-words-"))
        self.addCleanup(shutil.rmtree, self.root, ignore_errors=True)
        (self.root / "docs").mkdir()
        (self.root / "sim").mkdir()

    def words(self, *options, root=None):
        return subprocess.run([sys.executable, str(SOURCE / "scripts/words"), "--root", str(root or self.root), *options],
                              capture_output=True, text=True, check=False)

    def test_the_documentation_and_the_texts_of_the_program_are_in_plain_english(self):
        checked = self.words("--sources", root=SOURCE)
        self.assertEqual((checked.returncode, checked.stdout, checked.stderr), (0, "", ""))

    def test_every_word_of_the_list_is_found(self):
        rules = runpy.run_path(str(SOURCE / "scripts/words"))["RULES"]
        (self.root / "docs/page.md").write_text("".join(f"# Page\n\nHere is {example}.\n\n" for _, _, example, _ in rules))
        (self.root / "sim/text.cpp").write_text("".join(f'say("Here is {example}");\n\n' for _, _, example, _ in rules))
        said = self.words("--sources")
        self.assertEqual(said.returncode, 1)
        for number, (_, instead, _, in_sources) in enumerate(rules):
            self.assertRegex(said.stdout, rf"(?m)^docs/page.md:{4 * number + 3}: `.*`: write `{instead}`$")
            self.assertEqual(f"sim/text.cpp:{2 * number + 1}:" in said.stdout, in_sources)

    def test_what_is_a_word_and_what_is_not(self):
        long = "This sentence has " + "many " * 27 + "words."
        for name, text, says in [("docs/page.md", "There are 6 edges a\nwavelength.\n", "docs/page.md:1: `edges a wavelength`"),
                                 ("docs/page.md", "`judge: auto` and [a link](page.md#judge).\n\n```yaml\njudge: 2\n```\n\n$$ judge $$\n", ""),
                                 ("sim/text.cpp", 'say("must be a file");\nsay("a device");\n', ""),
                                 ("sim/text.h", "int a;  // 3 transducers a unit\n", "sim/text.h:1: `transducers a unit`: write `per`"),
                                 ("CHANGELOG.md", "# Changes\n\n## [2]\n\nNew.\n\n## [1]\n\nLook anew.\n", ""),
                                 ("README.md", f"Short one. {long} Short again.\n", "README.md:1: 31 words: This sentence"),
                                 ("README.md", f"Short one. {long.replace('many ', '', 1)}\n", "")]:
            with self.subTest(name=name, text=text):
                (self.root / name).write_text(text)
                said = self.words("--sources").stdout
                self.assertEqual(said[:len(says)] if says else said, says)
                (self.root / name).unlink()


if __name__ == "__main__":
    unittest.main()
