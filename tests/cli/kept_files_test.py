"""Files that earlier versions wrote (tests/data/kept): read, compared, sent, repeated, resumed; newer ones are refused."""

import csv
import json
import re
import shutil
import unittest
import zlib

import h5py

from support import SOURCE, CommandTest

KEPT = SOURCE / "tests/data/kept"


def table(folder):
    with open(folder / "sweep.csv", newline="") as file:
        return list(csv.DictReader(file))


def listed():
    """docs/formats.md: file -> its format, the version that is written, those that are read."""
    rows = re.findall(r"^\| `([\w.]+)` \| `(touchfield-[\w-]+)` \| (\d+) \| (.+) \|$",
                      (SOURCE / "docs/formats.md").read_text(), re.MULTILINE)
    return {name: (kind, int(writes), [int(version) for version in re.findall(r"\d+", reads)])
            for name, kind, writes, reads in rows}


def says_of_itself(path):
    if path.suffix == ".json":
        known = json.loads(path.read_text())
    else:
        with h5py.File(path) as file:
            known = dict(file.attrs)
    return known["format"], int(known["format_version"])


def renumber(path, version):
    """The same file as of another version, whole."""
    if path.suffix == ".json":
        path.write_text(json.dumps({**json.loads(path.read_text()), "format_version": version}))
        return
    with h5py.File(path, "r+") as file:
        file.attrs["format_version"] = version
    data = path.read_bytes()
    at = data.rfind(b"touchfield-crc32 ")  # what h5py appends comes behind the old line
    data = data[:at] if at == len(data) - 26 else data
    path.write_bytes(data + b"touchfield-crc32 %08x\n" % zlib.crc32(data))


class Versions(CommandTest):
    def setUp(self):
        super().setUp()
        shutil.copytree(KEPT, self.folder / "kept")

    def reading(self, path):
        """A command that reads the file."""
        return ["sweep", "--collect", path.parent] if path.suffix == ".json" else ["info", path]

    def test_every_version_that_is_listed_is_written_or_kept_and_read(self):
        self.run_ok("run", "kept/tiny.yaml", "-o", "new/run", "--quiet")
        self.run_ok("play", "kept/moving.yaml", "-o", "new/motion", "--quiet")
        self.run_ok("sweep", "kept/sweep.yaml", "-o", "new/sweep", "--quiet")
        table = listed()
        self.assertEqual(list(table), ["run.h5", "motion.h5", "sweep.json"])
        for name, (kind, writes, reads) in table.items():
            folder = name.removesuffix(".h5").removesuffix(".json")
            new = self.folder / "new" / folder / name
            self.assertEqual(says_of_itself(new), (kind, writes))
            self.assertEqual(max(reads), writes)
            paths = [new, *(path for path in sorted((self.folder / "kept").rglob(name)) if "cases" not in path.parts)]
            self.assertEqual(sorted({says_of_itself(path) for path in paths}), [(kind, version) for version in reads], name)
            for path in paths:
                with self.subTest(path=path):
                    self.run_ok(*self.reading(path))

    def test_a_newer_version_is_refused_in_one_line(self):
        version = self.run_ok("--version").stdout.split()[1]
        self.run_ok("run", "kept/tiny.yaml", "-o", "new/run", "--quiet")
        self.run_ok("play", "kept/moving.yaml", "-o", "new/motion", "--quiet")
        for path in ["new/run/run.h5", "new/motion/motion.h5", "kept/sweep/sweep.json"]:
            path = self.folder / path
            newest = listed()[path.name][1]
            renumber(path, newest)
            self.run_ok(*self.reading(path))
            renumber(path, newest + 1)
            commands = [self.reading(path)]
            if path.name == "run.h5":
                commands += [["compare", path, path], ["run", "--from", path, "-o", "again"],
                             ["send", path, "--to", "dry-run:frames.bin"]]
            for command in commands:
                with self.subTest(command=command):
                    done = self.is_refused(*command)
                    self.assertEqual(done.stderr, f"touchfield: error: {path}: format version {newest + 1} is newer than {newest}, "
                                     f"the newest that touchfield {version} reads: a newer touchfield reads it\n")
            renumber(path, 0)
            self.is_refused(*self.reading(path), says="format_version = 0 must be >= 1")
            if path.name == "run.h5":
                said = done.stderr.replace(str(path), "run.h5")
                self.assertIn(f"```text\n{said}```", (SOURCE / "docs/formats.md").read_text())


class KeptFiles(CommandTest):
    def setUp(self):
        super().setUp()
        shutil.copytree(KEPT, self.folder / "kept")

    def test_the_run_is_described(self):
        known = json.loads(self.run_ok("info", "kept/run", "--json").stdout)
        self.assertEqual(known["name"], "tiny")
        self.assertTrue(known["complete"])
        self.assertEqual([method["name"] for method in known["methods"]], ["focus", "paper"])
        self.assertEqual(known["faces"], 180)
        for method in known["methods"]:  # which the file lacks: 100 Pa are wanted on every face
            self.assertAlmostEqual(method["reached_share"], method["mean_inside_pa"] / 100, delta=1e-12)

    def test_a_run_of_version_1_is_described_repeated_and_sent(self):
        known = json.loads(self.run_ok("info", "kept/run_v1", "--json").stdout)
        self.assertEqual((known["name"], known["complete"]), ("tiny", True))
        self.assertEqual([method["name"] for method in known["methods"]], ["focus", "paper"])
        self.run_ok("send", "kept/run_v1", "--method", "paper", "--to", "dry-run:frame.txt")
        self.run_ok("run", "--from", "kept/run_v1", "-o", "again", "--quiet")
        done = self.touchfield("compare", "kept/run_v1", "again").stdout
        self.assertRegex(done, r"\nscene +the same\n")

    def test_the_run_is_repeated_with_the_defaults_it_was_made_with(self):
        self.run_ok("run", "--from", "kept/run", "-o", "again", "--quiet")
        done = self.touchfield("compare", "kept/run", "again", "--tolerance", "1e-6").stdout
        # Keys that have come since are at their defaults; forces are estimated otherwise since.
        self.assertRegex(done, r"\nscene +the same\n")
        self.assertIn("A lacks 4 keys that B has at their defaults: target.box.level, "
                      "solve.methods[1].paper.faces, solve.allow_coarse_mesh, solve.device\n", done)
        self.assertNotIn("scene_hash", done)
        self.assertNotIn("the scene:", done)
        differing = re.findall(r"^  (?:focus|paper) +([a-z_]+) +\S+ +\S+ +\S+$", done, re.MULTILINE)
        self.assertLessEqual(set(differing), {"force_target_n", "force_elsewhere_n"})
        phases = re.findall(r"^  (?:focus|paper) +([-.e\d]+) +[-.e\d]+ +0 ", done, re.MULTILINE)
        self.assertEqual(len(phases), 2)
        self.assertLess(max(map(float, phases)), 1e-6)  # another version, another order of sums

    def test_the_run_is_the_start_of_another(self):
        scene = (KEPT / "tiny.yaml").read_text().replace("iterations: 4", "iterations: 4\n  start: {previous: kept/run/run.h5}")
        self.run_ok("run", self.write("next.yaml", scene), "-o", "next", "--quiet")

    def test_the_run_is_sent(self):
        done = self.run_ok("send", "kept/run", "--method", "paper", "--to", "dry-run:frame.txt")
        self.assertIn("1 file written", done.stdout)

    def test_the_sweep_is_collected_and_not_gone_on_with(self):
        old = table(self.folder / "kept/sweep")
        self.assertIn("3 of 3 cases done, 0 failed", self.run_ok("sweep", "--collect", "kept/sweep").stdout)
        new = table(self.folder / "kept/sweep")
        self.assertEqual([{key: row[key] for key in old[0]} for row in new], old)
        self.assertEqual({row["reached_share"] for row in new}, {"nan"})  # which its records lack
        shutil.rmtree(self.folder / "kept/sweep/cases/00002")
        for more in ([], ["--retry-failed"], ["--case", "2"]):
            self.is_refused("sweep", "kept/sweep.yaml", "-o", "kept/sweep", *more,
                            says="kept/sweep holds a sweep of an earlier version")
        self.assertFalse((self.folder / "kept/sweep/cases/00002").exists())


class KeptHands(CommandTest):
    """What release 0.2 called `side: right`, its default, was a left hand; its results keep the hand that they had."""

    def setUp(self):
        super().setUp()
        shutil.copytree(KEPT, self.folder / "kept")
        self.old = self.folder / "kept/hand_sweep/cases/00001"

    def skin(self, run):
        known = json.loads(self.run_ok("info", run, "--json").stdout)
        return known["solved_skin"], known["judged_skin"]

    def test_an_older_file_says_what_skin_its_figures_are_of(self):
        self.assertEqual(self.skin(self.old), ("part", "part"))  # without a judge, so without a note
        self.assertEqual(self.skin("kept/run"), ("whole", "whole"))
        self.assertIn("part only: figures are of the skin within keep_within_mm", self.run_ok("info", self.old).stdout)
        self.assertNotIn("part only", self.run_ok("info", "kept/run").stdout)
        self.run_ok("run", "kept/hand.yaml", "-o", "whole", "--set", "judge={edge_mm: {near_target: 3, far: 8, within_mm: 10}}", "--set",
                    "body.hand.side=left", "--quiet")
        self.assertEqual(self.skin("whole"), ("part", "whole"))
        done = self.touchfield("compare", self.old, "whole")
        self.assertIn(" A evaluates the part within keep_within_mm, B the whole skin: their metrics are not comparable\n",
                      done.stdout)
        self.assertIn("verdict   different: the skin that is evaluated\n", done.stdout)
        known = json.loads(self.touchfield("compare", self.old, "whole", "--json").stdout)
        self.assertEqual(known["judged_skin"], {"a": "part", "b": "whole"})
        self.assertNotIn("not comparable", self.touchfield("compare", "whole", "whole").stdout)

    def as_of_version_3(self, run):
        """A run of `beyond: nothing` as it was before there was that key, and its note."""
        with h5py.File(run, "r+") as file:
            for name in ("solved_skin", "judged_skin"):
                del file.attrs[name]
            scene = file["scene"].asstr()[()]
            self.assertIn("  beyond: nothing\n", scene)
            notes = [note.replace("part_only: ", "truncated: ") for note in file["notes"].asstr()]
            unit = file["scene"].attrs["unit"]
            for name, content in [("scene", scene.replace("  beyond: nothing\n", "")), ("notes", notes)]:
                del file[name]
                file.create_dataset(name, data=content, dtype=h5py.string_dtype()).attrs["unit"] = unit
        renumber(run, 3)

    def test_a_run_of_version_3_is_repeated_with_its_judge(self):
        # judge.whole decided what of the body a judge with edge lengths of its own had. A ball is such a body as well as a hand.
        ball = (KEPT / "hand.yaml").read_text().replace("hand: {pose: index_up}", "sphere: {radius_mm: 20}").replace("index_pad", "bottom")
        scene = self.write("ball.yaml", ball)
        judges = [("same", "part"), ("none", "part"), ("{split: 1}", "part"), ("{edge_mm: 5, whole: true}", "whole"),
                  ("{edge_mm: 5, whole: false}", "part"), ("{edge_mm: 5, whole: auto}", "whole"),
                  ("{edge_mm: 0.9, whole: auto}", "part")]  # 14,000 faces of a whole ball
        for judge, skin in judges:
            with self.subTest(judge=judge):
                self.run_ok("run", scene, "-o", "old", "--force", "--quiet", "--set", "body.beyond=nothing", "--set",
                            "solve.methods=[focus]", "--set", f"judge={judge}")
                self.assertEqual(self.skin("old"), ("part", skin))
                self.as_of_version_3(self.folder / "old/run.h5")
                self.assertEqual(self.skin("old"), ("part", skin))
                self.run_ok("run", "--from", "old", "-o", "again", "--force", "--quiet")
                self.assertEqual(self.skin("again"), ("part", skin))
                self.assertLess(self.difference(self.folder / "old", self.folder / "again"), 1e-6)
                self.assertRegex(self.touchfield("compare", "old", "again").stdout, r"\nscene +the same\n")

    def test_changes_of_a_repeated_run_are_in_todays_words(self):
        for kept in ("kept/run", "kept/run_v3"):
            self.run_ok("run", "--from", kept, "-o", "part", "--force", "--quiet", "--set", "body.keep_within_mm=9", "--set",
                        "judge=auto")
            self.assertEqual(self.skin("part"), ("part", "whole"))

    def metrics(self, folder):
        with open(folder / "metrics.csv", newline="") as file:
            return [{name: float(value) for name, value in row.items() if re.fullmatch(r"[-+.e\d]+", value)
                     and not name.startswith("seconds")} for row in csv.DictReader(file)]

    def difference(self, one, other):
        """The largest relative difference of a metric."""
        pairs = [(a[name], b[name]) for a, b in zip(self.metrics(one), self.metrics(other), strict=True) for name in a]
        self.assertGreater(len(pairs), 10)
        return max(abs(a - b) / max(abs(a), abs(b), 1e-30) for a, b in pairs)

    def side(self, folder):
        with h5py.File(folder / "run.h5") as run:
            return re.search(r"side: (\w+)", run["scene"].asstr()[()])[1]

    def test_a_run_is_repeated_with_its_hand(self):
        self.assertEqual(self.side(self.old), "right")
        self.run_ok("run", "--from", self.old, "-o", "again", "--quiet")
        self.assertEqual(self.side(self.folder / "again"), "left")
        self.assertLess(self.difference(self.old, self.folder / "again"), 1e-6)
        with h5py.File(self.folder / "again/run.h5") as run:  # what lay beyond keep_within_mm was not there
            self.assertIn("beyond: nothing\n", run["scene"].asstr()[()])
        done = self.touchfield("compare", self.old, "again", "--tolerance", "1e-6")
        self.assertRegex(done.stdout, r"\nscene +the same\n")
        # Changes are in today's words.
        self.run_ok("run", "--from", self.old, "-o", "other", "--set", "body.hand.side=right", "--quiet")
        self.assertGreater(self.difference(self.old, self.folder / "other"), 1e-3)
        self.assertIn("body.hand.side: left -> right", self.touchfield("compare", self.old, "other").stdout)

    def test_a_scene_file_has_the_hand_of_that_name(self):
        self.run_ok("run", "kept/hand.yaml", "-o", "right", "--quiet")
        self.assertGreater(self.difference(self.old, self.folder / "right"), 1e-3)
        self.run_ok("run", "kept/hand.yaml", "-o", "left", "--set", "body.hand.side=left", "--set", "body.beyond=nothing",
                    "--quiet")
        self.assertLess(self.difference(self.old, self.folder / "left"), 1e-6)

    def test_a_mirrored_scene_with_the_other_hand_is_the_same(self):
        whole = ("--set", "body.keep_within_mm=null", "--set", "body.edge_mm=8", "--set", "solve.allow_coarse_mesh=true", "--quiet")
        self.run_ok("run", "kept/hand.yaml", "-o", "left", "--set", "body.hand.side=left", *whole)
        self.run_ok("run", "kept/hand.yaml", "-o", "right", *whole, "--set", "target.box.offset_mm=[-1, 0, 0]",
                    "--set", "body.place={landmark: index_pad, at_mm: [-4, 0, 50], rotate_deg: [0, 0, -10]}")
        self.assertLess(self.difference(self.folder / "left", self.folder / "right"), 1e-6)



if __name__ == "__main__":
    unittest.main()
