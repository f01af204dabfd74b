"""README, docs and the texts of the program are in plain English, and each word of the list is found."""

import importlib.machinery
import importlib.util
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(os.environ.get("TOUCHFIELD_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))


def loaded(path):
    loader = importlib.machinery.SourceFileLoader("words", str(path))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("words", loader))
    loader.exec_module(module)
    return module


WORDS = loaded(SOURCE / "scripts/words")


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
        for pattern, instead, example, in_sources in WORDS.RULES:
            with self.subTest(pattern=pattern):
                (self.root / "docs/page.md").write_text(f"# Page\n\nA line before.\nHere is {example}.\n")
                checked = self.words()
                self.assertEqual(checked.returncode, 1)
                self.assertRegex(checked.stdout, rf"(?m)^docs/page.md:4: `.*`: write `{instead}`$")
                (self.root / "docs/page.md").unlink()
                (self.root / "sim/text.cpp").write_text(f'// {example}\nsay("Here is {example}");\n')
                retired = any(re.search(rf"\b{word}\b", example) for word, _ in WORDS.RETIRED)
                self.assertEqual(self.words().returncode, int(retired))
                self.assertEqual(self.words("--sources").stdout.count("sim/text.cpp:2:") > 0, in_sources)
                (self.root / "sim/text.cpp").unlink()

    def test_retired_words_are_found_in_names(self):
        for name, instead in [("judge_mesh", "evaluation"), ("compareJudges", "evaluation"), ("JUDGED", "evaluation"), ("kCertificate", "optimality_bound"),
                              ("AlarmChoice", "resonance_check"), ("an_excitation", "drive"), ("quietSkin", "outside .*"), ("isQuieted", "outside .*"),
                              ("array.spread", "tolerances"), ("  spread: {seed: 1}", "tolerances")]:
            with self.subTest(name):
                (self.root / "sim/text.cpp").write_text(f"\n{name}\n")
                self.assertRegex(self.words().stdout, rf"^sim/text.cpp:2: `\w+`: write `{instead}`\n$")
        for name in ("quiet_NaN()", "flags.quiet", "run --quiet", "spread over the skin", "forejudgeability", "OUTPUT_QUIET"):
            with self.subTest(name):
                (self.root / "sim/text.cpp").write_text(f"{name}\n")
                self.assertEqual(self.words().stdout, "")

    def test_code_links_formulas_and_tables_are_skipped(self):
        (self.root / "docs/page.md").write_text(
            "# Page\n\n`judge: auto` and [a link](page.md#judge).\n\n```yaml\njudge: {edge_mm: 2}\n```\n\n$$ judge $$\n\n"
            "<!-- table: judge | judge -->\n| judge |\n|---|\n| 1 |\n<!-- /table -->\n")
        self.assertEqual(self.words().stdout, "")

    def test_a_word_across_two_lines_is_found(self):
        (self.root / "docs/page.md").write_text("There are 6 edges a\nwavelength.\n")
        self.assertIn("docs/page.md:1: `edges a wavelength`", self.words().stdout)

    def test_two_literals_are_no_word_together(self):
        (self.root / "sim/text.cpp").write_text('say("must be a file");\nsay("a device");\n')
        self.assertEqual(self.words("--sources").stdout, "")
        (self.root / "sim/text.cpp").write_text('say("must be a file"\n    " a device");\n')
        self.assertIn("sim/text.cpp:1: `a file a device`", self.words("--sources").stdout)

    def test_comments_of_headers_say_per(self):
        (self.root / "sim/text.h").write_text("/// Gains, one a\n/// channel.\nint a;  // 3 transducers a unit\n/// It points at a face.\n")
        self.assertEqual(self.words("--sources").stdout, "sim/text.h:1: `one a channel`: write `per`\n"
                         "sim/text.h:3: `transducers a unit`: write `per`\n")
        (self.root / "sim/text.h").write_text("int a;  // one\nint b;  // a channel\n")
        self.assertEqual(self.words("--sources").stdout, "")

    def test_docstrings_of_scripts_are_checked_and_their_code_is_not(self):
        (self.root / "scripts").mkdir()
        (self.root / "scripts/tool").write_text('#!/usr/bin/python3\n"""Makes tables.\n\nLook anew.\n"""\nprint("anew")\n')
        (self.root / "scripts/other").write_text("#!/usr/bin/env bash\n# Look anew.\n")
        self.assertEqual(self.words("--sources").stdout, "scripts/tool:4: `anew`: write `again`\n")

    def test_a_long_sentence_of_a_header_is_found(self):
        long = "This sentence has " + "many " * 22 + "words."
        (self.root / "sim/text.h").write_text(f"/// Short one. {long[:47]}\n/// {long[48:]} And a short one.\nint a;\n")
        self.assertIn("sim/text.h:1: 26 words: This sentence", self.words("--sources").stdout)
        for kept in (f"/// {long.replace('many ', '', 1)}\n", f"///   {long}\n", f"// One.\nint a;  // {long[:47]}\n// {long[48:]}\n",
                     f"/// {long[:47]}\n///\n/// {long[48:]}\n", f"/// x   {long[:47]}\n/// y   {long[48:]}\n"):
            (self.root / "sim/text.h").write_text(kept)
            self.assertEqual(self.words("--sources").stdout, "", kept)

    def test_older_changes_stay_as_they_are(self):
        (self.root / "CHANGELOG.md").write_text("# Changes\n\n## [2]\n\nAll new.\n\n## [1]\n\nLook anew.\n")
        self.assertEqual(self.words().stdout, "")
        (self.root / "CHANGELOG.md").write_text("# Changes\n\n## [2]\n\nLook anew.\n\n## [1]\n\nOld.\n")
        self.assertIn("CHANGELOG.md:5: `anew`", self.words().stdout)

    def test_a_long_sentence_of_the_readme_is_found(self):
        long = "This sentence has " + "many " * 27 + "words."
        (self.root / "README.md").write_text(f"Short one. {long} Short again.\n")
        self.assertIn("README.md:1: 31 words: This sentence", self.words().stdout)
        (self.root / "README.md").write_text(f"Short one. {long.replace('many ', '', 1)} Short again.\n")
        self.assertEqual(self.words().stdout, "")


if __name__ == "__main__":
    unittest.main()
