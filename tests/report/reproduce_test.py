"""The reduced reproduction from end to end: interrupted, resumed, and its report compared with its runs."""

import csv
import hashlib
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

try:
    import h5py
    import matplotlib  # noqa: F401
    import scipy  # noqa: F401
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)

PROGRAM = os.environ["TOUCHFIELD_PROGRAM"]
SOURCE = pathlib.Path(os.environ["TOUCHFIELD_SOURCE_DIR"])
SCENES = ["width_5mm", "width_8mm", "width_11mm", "grasp", "penetration"]


class Reproduce(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="touchfield-reproduce-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.command = [sys.executable, str(SOURCE / "scripts/reproduce"), "--quick", "--program", PROGRAM, "--work",
                       str(cls.folder / "work"), "-o", str(cls.folder / "report")]
        cls.first = cls.interrupted()
        cls.second = subprocess.run(cls.command, capture_output=True, text=True, timeout=1500, check=False)

    @classmethod
    def interrupted(cls):
        """Ctrl-C while the second step is under way."""
        running = subprocess.Popen(cls.command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                   start_new_session=True)
        said = running.stdout.readline()
        time.sleep(0.2)
        os.killpg(running.pid, signal.SIGINT)
        rest, errors = running.communicate(timeout=300)
        return running.returncode, said + rest, errors

    def rows(self, name):
        """Of a table, below the line that says where it comes from."""
        return list(csv.DictReader((self.folder / "report/tables" / name).read_text().splitlines()[1:]))

    def test_an_interrupted_call_is_gone_on_with(self):
        code, said, errors = self.first
        self.assertNotEqual(code, 0)
        self.assertRegex(said, r"^panels/width_5mm: \d+ s\n")
        self.assertNotIn("report in", said)
        self.assertIn("the same command goes on", errors)
        self.assertNotIn("Traceback", errors)
        self.assertEqual(self.second.returncode, 0, self.second.stderr)
        lines = self.second.stdout.splitlines()
        self.assertEqual(lines[0], "panels/width_5mm: done before")
        self.assertRegex(lines[1], r"^panels/width_8mm: \d+ s$")

    def test_tables_are_those_of_the_runs(self):
        rows = self.rows("metrics.csv")
        self.assertEqual({row["scene"] for row in rows}, set(SCENES))
        for row in rows:
            with h5py.File(self.folder / "work/panels" / row["scene"] / "run.h5") as run:
                kept = run["methods"][row["method"]].attrs
                for metric in ("relative_error", "leakage", "force_target_n"):
                    self.assertAlmostEqual(float(row[metric]) / kept[metric], 1, delta=1e-8, msg=f"{row} {metric}")
        self.assertEqual(len(self.rows("convergence.csv")), 2 * 3 * 4)
        for table in (SOURCE / "results/study/tables").iterdir():
            if table.stem != "metrics_autd3":  # not in a rehearsal
                kept, = csv.reader(table.read_text().splitlines()[1:2])
                self.assertEqual(list(self.rows(table.name)[0]), kept, table.name)

    def test_tables_say_which_program_and_which_scenes_made_them(self):
        text = (self.folder / "report/report.md").read_text()
        said = subprocess.run([PROGRAM, "--version"], capture_output=True, text=True, check=True).stdout
        revision = re.search(r"\(([^)]+)\)", said)[1]
        for table in sorted((self.folder / "report/tables").iterdir()):
            head = table.read_text().splitlines()[0]
            self.assertRegex(head, rf"^# made by: scripts/reproduce --quick; revision: {re.escape(revision)}; scenes: \S", table.name)
            self.assertIn(f"(tables/{table.name})", text)
        scene = hashlib.sha256((SOURCE / "scenes/width_8mm.yaml").read_bytes()).hexdigest()[:12]
        self.assertIn(f"width_8mm.yaml {scene}", (self.folder / "report/tables/metrics.csv").read_text().splitlines()[0])
        self.assertNotIn(str(SOURCE), text)

    def test_the_page_is_the_kept_one_with_the_numbers_of_these_tables(self):
        text = (self.folder / "report/report.md").read_text()
        kept = (SOURCE / "results/study/report.md").read_text()
        marks = r"<!-- (?:table|value): .*?<!-- /(?:table|value) -->"
        self.assertEqual(re.sub(marks, "", text, flags=re.DOTALL), re.sub(marks, "", kept, flags=re.DOTALL).replace(
            "\n\n", f"\n\n{re.search(r'.*Its numbers mean nothing.*', text)[0]}\n\n", 1))
        error = {(row["scene"], row["method"]): float(row["relative_error"]) for row in self.rows("metrics.csv")}
        helped = sum(error[scene, "paper"] < error[scene, "unscattered"] for scene in SCENES)
        self.assertIn(f"| scattering in the solver lowers the error of the pattern | lower on {helped} of 5 scenes", text)
        self.assertIn(f"| width_8mm | {100 * error['width_8mm', 'unscattered']:.1f} % | {100 * error['width_8mm', 'paper']:.1f} %", text)
        for linked in re.findall(r"\]\(((?:tables|figures)/[^)]+)\)", text):
            if linked != "tables/metrics_autd3.csv":
                self.assertGreater((self.folder / "report" / linked).stat().st_size, 100, linked)

    def test_nothing_is_done_twice_and_the_same_seeds_give_the_same(self):
        kept = self.rows("metrics.csv"), (self.folder / "report/tables/widths.csv").read_text()
        shutil.rmtree(self.folder / "work/panels/width_8mm")
        shutil.rmtree(self.folder / "work/hands/hand_02/cases/00003")
        step = self.folder / "work/steps/hands-hand_02.json"
        step.write_text(step.read_text().replace('"done": true', '"done": false'))
        again = subprocess.run(self.command, capture_output=True, text=True, timeout=600, check=False)
        self.assertEqual(again.returncode, 0, again.stderr)
        done = [line for line in again.stdout.splitlines() if not line.endswith(": done before")]
        self.assertEqual([line.split(":")[0] for line in done[:-1]], ["panels/width_8mm", "hands/hand_02"])
        self.assertEqual((self.folder / "report/tables/widths.csv").read_text(), kept[1])
        # Seconds differ, and the number of threads at work may change the last digits.
        for old, new in zip(kept[0], self.rows("metrics.csv")):
            self.assertAlmostEqual(float(old["relative_error"]), float(new["relative_error"]), delta=1e-5)


if __name__ == "__main__":
    unittest.main()
