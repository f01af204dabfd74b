"""The site is built without a warning; every page is in its navigation, every link and anchor leads somewhere, and nothing is
fetched from elsewhere."""

import functools
import html
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
import urllib.parse

SOURCE = pathlib.Path(os.environ["TOUCHFIELD_SOURCE_DIR"])
PAGES = sorted([*SOURCE.glob("docs/*.md"), *SOURCE.glob("docs/tutorials/*.md")])
MISSING = [name for name in ("mkdocs", "doxygen") if not shutil.which(name)]
MISSING += [str(path) for path in map(pathlib.Path, ["/usr/share/javascript/katex", "/usr/share/mkdocs/themes/material"])
            if not path.is_dir()]
if MISSING:
    print(f"skipped: {', '.join(MISSING)} not there; scripts/docs installs what the site needs")
    sys.exit(77)


@functools.lru_cache(maxsize=None)
def anchors(page):
    return set(re.findall(r'\s(?:id|name)="([^"]+)"', page.read_text()))


class Site(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        out = pathlib.Path(tempfile.mkdtemp(prefix="touchfield-site-"))
        cls.addClassCleanup(shutil.rmtree, out, ignore_errors=True)
        built = subprocess.run([SOURCE / "scripts/docs", "--as-is", "--out", out], capture_output=True, text=True, check=False)
        assert (built.returncode, built.stderr) == (0, ""), built.stdout + built.stderr
        cls.site = out / "site"

    def test_every_page_is_in_the_navigation(self):
        nav = (SOURCE / "docs/site/mkdocs.yml").read_text().partition("\nnav:\n")[2]
        for page in PAGES:
            self.assertIn(str(page.relative_to(SOURCE)), nav)

    def test_links_and_anchors(self):
        seen = 0
        for page in self.site.rglob("*.html"):
            if page.name == "404.html":  # whose links begin at the server's root
                continue
            text = re.sub(r"<(pre|code|script)\b.*?</\1>", "", page.read_text(), flags=re.DOTALL)
            for tag, attribute, link in re.findall(r'<(\w+)\s(?:[^>]*\s)?(href|src)="([^"]*)"', text):
                parts = urllib.parse.urlsplit(html.unescape(link))
                if parts.scheme in ("javascript", "data"):
                    continue
                if parts.scheme or parts.netloc:
                    self.assertEqual((tag, attribute), ("a", "href"), f"{page}: {link} is fetched from elsewhere")
                    continue
                target = (page.parent / urllib.parse.unquote(parts.path)).resolve() if parts.path else page
                target = target / "index.html" if target.is_dir() else target
                self.assertTrue(target.is_file(), f"{page}: {link}")
                if parts.fragment and "cpp" not in page.parts:  # where some of Doxygen's own lead nowhere
                    self.assertIn(urllib.parse.unquote(parts.fragment), anchors(target), f"{page}: {link}")
                seen += 1
        self.assertGreater(seen, 10000)

    def test_pages_link_to_what_the_repository_has(self):
        for page in [*PAGES, SOURCE / "README.md"]:
            for link in re.findall(r"\]\(([^)#\s]+)", re.sub(r"```.*?```|`[^`]*`", "", page.read_text(), flags=re.DOTALL)):
                if "://" not in link:
                    self.assertTrue((page.parent / link).exists(), f"{page.name}: {link}")

    def test_references_are_the_programs(self):
        commands = (self.site / "reference/commands.html").read_text()
        self.assertIn("touchfield array walk", commands)
        page = (self.site / "docs/theory.html").read_text()  # formulas are marked for rendering
        self.assertNotIn("$", re.sub(r"<(script|style)\b.*?</\1>", "", page, flags=re.DOTALL))
        model = (self.site / "reference/cpp/structtouchfield_1_1Model.html").read_text()
        self.assertIn("#include &lt;touchfield/sim/model/model.h&gt;", model)
        built = list(SOURCE.glob("build/python/lib/python*/site-packages/touchfield"))
        for page, word in {"python.html": "InputError", "python/methods.html": 'id="problemcost"',
                           "python/parts.html": '<a href="methods.html#solution"><code>Solution</code></a>'}.items():
            self.assertIn(word if built else "setup_python", (self.site / "reference" / page).read_text())
        self.assertIn("import touchfield", re.sub("<.*?>", "", (self.site / "docs/tutorials/notebook.html").read_text()))


if __name__ == "__main__":
    unittest.main()
