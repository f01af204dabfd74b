"""Runs of the program that resume, and values of their results, for scripts/tables."""

import concurrent.futures
import dataclasses
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "scripts/report"), str(ROOT / "tests/cli")]  # series and meshes of the tests

from runs import results  # noqa: E402

EVALUATED = "evaluation={scheme: burton_miller_polished, edge_mm: {near_target: 1.6, far: 5, within_mm: 12}}"


def sets(changes):
    return [word for change in changes for word in ("--set", change)]


def listed(*items):
    return f"solve.methods=[{', '.join(items)}]"


def flat(value, name=""):
    """{name_of_the_path: value} of nested JSON."""
    if not isinstance(value, dict):
        return {name: value}
    return {path: leaf for key, part in value.items() for path, leaf in flat(part, f"{name}_{key}" if name else key).items()}


@dataclasses.dataclass
class Work:
    """Where an entry finds programs and keeps its runs."""

    program: str
    build: pathlib.Path  # has tests, and bench unless build/bench does
    runs: pathlib.Path
    jobs: int
    images: pathlib.Path
    taken: tuple = ()  # seconds and GiB of the last call

    def call(self, *words, prefix=(), env=None, stdin=None):
        """Standard output of the program, or of another one if the first word is a path of it."""
        own = [] if isinstance(words[0], pathlib.Path) else [self.program]
        with tempfile.TemporaryFile("w+") as said, tempfile.TemporaryFile("w+") as errors:
            begun = time.monotonic()
            process = subprocess.Popen([*prefix, *own, *map(str, words)], cwd=ROOT, env=os.environ | (env or {}), stdin=stdin or subprocess.DEVNULL,
                                       stdout=said, stderr=errors)
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            self.taken = time.monotonic() - begun, usage.ru_maxrss / 2**20
            said.seek(0)
            errors.seek(0)
            if process.returncode:
                raise RuntimeError(f"{' '.join(map(str, words))}: exit code {process.returncode}: {errors.read().strip()}")
            return said.read()

    @property
    def benches(self):
        """The folder of the benchmarks, or None."""
        return next((folder for folder in (self.build / "bench", ROOT / "build/bench/bench") if folder.is_dir()), None)

    def bench(self, name, *words, **how):
        return self.call(self.benches / name, *words, **how)

    def solved(self, cases, command="run", changes=(), **how):
        """{key: folder} of {key: (scene, changes, more options ..)}. Finished ones are kept while program, scene and command are the same."""
        version = self.call("--version")
        keys = {key: re.sub(r"\W+", "_", str(key)).strip("_") for key in cases}
        assert len(set(keys.values())) == len(keys)

        def solve(key):
            scene, own, *options = cases[key]
            path = ROOT / f"scenes/{scene}.yaml" if isinstance(scene, str) else scene
            fixed = ["field=[]", "write=[h5]"] if command == "run" else ["write=[h5]"]
            words = [command, str(path), *sets([*fixed, *changes, *own]), *options]
            folder, stamp = self.runs / keys[key], self.runs / f"{keys[key]}.json"
            identity = {"version": version, "command": words, "scene": hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""}
            if not (stamp.is_file() and json.loads(stamp.read_text())["of"] == identity and folder.is_dir()):
                begun = time.monotonic()
                stamp.unlink(missing_ok=True)
                said = self.call(*words, "-o", folder, "--force", "--quiet", **how)
                stamp.write_text(json.dumps({"of": identity, "said": said}))
                print(f"{keys[key]}: {time.monotonic() - begun:.0f} s", flush=True)
            return folder

        with concurrent.futures.ThreadPoolExecutor(1 if how else self.jobs) as pool:  # timed ones run alone
            return dict(zip(cases, pool.map(solve, cases)))

    def said(self, folder):
        """What the program printed for a folder of `solved`."""
        return json.loads(pathlib.Path(f"{folder}.json").read_text())["said"]


def cell(form, values):
    """The value of that name, or the text of an f-string."""
    return eval("f" + repr(form), {"__builtins__": {}}, values) if "{" in form else values[form]


def runs(labels, cases, columns, changes=(), command="run"):
    """A maker: one row per case and method. The key of a case has its labels, a case its scene and changes.

    Columns are names of values or f-strings of them: of run.h5, or of the JSON that another command prints.
    """
    def make(work):
        rows = []
        for key, folder in work.solved(cases, command, changes).items():
            found = results(folder).values() if command == "run" else [flat(json.loads(work.said(folder)))]
            own = dict(zip(labels, key if isinstance(key, tuple) else (key,)))
            rows += [own | {name: cell(form, values) for name, form in columns.items()} for values in found]
        return rows
    return make
