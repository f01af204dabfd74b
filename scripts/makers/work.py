"""Runs of the program that resume, and values of their results, for scripts/tables and scripts/reproduce."""

import concurrent.futures
import dataclasses
import functools
import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "scripts/report"), str(ROOT / "tests/cli")]  # series and meshes of the tests

ON_TWO_CORES = {"prefix": ("taskset", "-c", "0,1"), "env": {"OMP_NUM_THREADS": "2"}}  # of Work.call
NO_CARD = {"CUDA_VISIBLE_DEVICES": ""}  # where times are those of the processor
EVALUATED = "evaluation={scheme: burton_miller_polished, edge_mm: {near_target: 1.6, far: 5, within_mm: 12}}"


def hash_of(path):
    """SHA-256 of a scene or sweep; one that was made here names its base from the root, which is no part of it."""
    return hashlib.sha256(path.read_bytes().replace(f"{ROOT}/".encode(), b"")).hexdigest()


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
    jobs: int = 1
    images: pathlib.Path = None
    quick: bool = False
    environment: dict = None  # of the program, if not that of this process
    taken: tuple = ()  # seconds and GiB of the last call

    def call(self, *words, prefix=(), env=None, stdin=None):
        """Standard output of the program, or of another one if the first word is a path of it."""
        own = [] if isinstance(words[0], pathlib.Path) else [self.program]
        with tempfile.TemporaryFile("w+") as said, tempfile.TemporaryFile("w+") as errors:
            begun = time.monotonic()
            process = subprocess.Popen([*prefix, *own, *map(str, words)], cwd=ROOT, stdin=stdin or subprocess.DEVNULL, stdout=said,
                                       stderr=errors, env=(self.environment or os.environ) | (env or {}))
            try:
                _, status, usage = os.wait4(process.pid, 0)
            except KeyboardInterrupt:
                process.terminate()
                process.wait()
                raise
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

    @functools.cached_property
    def version(self):
        return self.call("--version")

    def step(self, name, command, inputs, resumes=False, **how):
        """The folder of `touchfield COMMAND .. -o RUNS/NAME`, kept while program, command and `inputs`, its files, are the same."""
        out, stamp = self.runs / name, self.runs / "steps" / (name.replace("/", "-") + ".json")
        stamp.parent.mkdir(parents=True, exist_ok=True)
        identity = {"version": self.version, "quick": self.quick, "command": [str(part) for part in command],
                    "inputs": {str(path): hash_of(path) for path in inputs}}
        kept = json.loads(stamp.read_text()) if stamp.exists() else {}
        same = all(kept.get(key) == value for key, value in identity.items())
        if same and kept.get("done") and out.exists():
            print(f"{name}: done before", flush=True)
            return out
        if not (resumes and same):
            shutil.rmtree(out, ignore_errors=True)
        # Kept before it is done as well: the next call then knows whose the folder of a step is that was cut off.
        state = identity | {"done": False, "seconds": kept.get("seconds", 0.0) if same else 0.0}
        stamp.write_text(json.dumps(state))
        begun = time.monotonic()
        said = self.call(*command, "-o", out, "--quiet", *([] if resumes else ["--force"]), **how)
        state |= {"done": True, "seconds": state["seconds"] + time.monotonic() - begun, "said": said}
        stamp.write_text(json.dumps(state))
        print(f"{name}: {state['seconds']:.0f} s", flush=True)
        return out

    def solved(self, cases, command="run", changes=(), **how):
        """{key: folder} of {key: (scene, changes, more options ..)}."""
        keys = {key: re.sub(r"\W+", "_", str(key)).strip("_") for key in cases}
        assert len(set(keys.values())) == len(keys)

        def solve(key):
            scene, own, *options = cases[key]
            path = ROOT / f"scenes/{scene}.yaml" if isinstance(scene, str) else scene
            fixed = ["field=[]", "write=[h5]"] if command == "run" else ["write=[h5]"]
            return self.step(keys[key], [command, path, *sets([*fixed, *changes, *own]), *options], [path], **how)

        self.version  # asked once, before the threads
        with concurrent.futures.ThreadPoolExecutor(1 if how else self.jobs) as pool:  # timed ones run alone
            return dict(zip(cases, pool.map(solve, cases)))

    def said(self, folder):
        """What the program printed for a folder of `solved`."""
        return json.loads((self.runs / f"steps/{folder.name}.json").read_text())["said"]


def cell(form, values):
    """The value of that name, or the text of an f-string."""
    return eval("f" + repr(form), {"__builtins__": {}}, values) if "{" in form else values[form]


def runs(labels, cases, columns, changes=(), command="run"):
    """A maker: one row per case and method. The key of a case has its labels, a case its scene and changes.

    Columns are names of values or f-strings of them: of run.h5, or of the JSON that another command prints.
    """
    def make(work):
        from runs import results
        rows = []
        for key, folder in work.solved(cases, command, changes).items():
            found = results(folder).values() if command == "run" else [flat(json.loads(work.said(folder)))]
            own = dict(zip(labels, key if isinstance(key, tuple) else (key,)))
            rows += [own | {name: cell(form, values) for name, form in columns.items()} for values in found]
        return rows
    return make
