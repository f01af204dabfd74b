"""One binary under every BLAS core and every instruction level that this machine carries out: the same results."""

import json
import os
import shutil
import subprocess
import unittest

from support import FINGER, PROGRAM, SOURCE, CommandTest, open_run, relative_l2

HELD = FINGER.replace("[paper, unscattered, focus, {fixed: {phases_rad: 0}}]", "[{fixed: {phases_rad: 0}}]").replace(
    "write: [h5, vtp, vti]", "evaluation: none\nwrite: [h5]")
SOLVED = FINGER.replace("[paper, unscattered, focus, {fixed: {phases_rad: 0}}]", "[surface, paper]").replace(
    "write: [h5, vtp, vti]", "evaluation: none\nwrite: [h5]")
LINES = subprocess.run([SOURCE / "scripts/processors"], capture_output=True, text=True, check=True).stdout.split()
KINDS = [dict([line.split("=")]) for line in LINES]
LEVELS = [kind["TOUCHFIELD_LEVEL"] for kind in KINDS if "TOUCHFIELD_LEVEL" in kind]


class Processors(CommandTest):
    def under(self, kind, *arguments):
        return subprocess.run([PROGRAM, *map(str, arguments)], cwd=self.folder, env={**self.clean(), **kind},
                              capture_output=True, text=True, timeout=500, check=False)

    @staticmethod
    def clean():
        names = ("OPENBLAS_CORETYPE", "TOUCHFIELD_LEVEL", "TOUCHFIELD_BLAS_CORE", "OMP_WAIT_POLICY", "GOMP_SPINCOUNT")
        return {name: value for name, value in os.environ.items() if name not in names}

    def runs(self, text, *sets):
        """The scene's run under each kind of processor: (kind, run.h5)."""
        scene = self.write("scene.yaml", text)
        for kind in KINDS:
            done = self.under(kind, "run", scene, "-o", "out", "--force", *sets)
            self.assertEqual(done.returncode, 0, f"{kind}: {done.stderr}")
            with open_run(self.folder / "out") as run:
                self.check_says(kind, run)
                yield kind, run

    def check_says(self, kind, run):
        """A run says what it ran on."""
        provenance = run["provenance"].attrs
        first = (self.folder / "out/run.log").read_text().splitlines()[0]
        self.assertIn(f"BLAS core {provenance['blas_core']}, loops {provenance['instruction_level']}", first)
        self.assertEqual(provenance["blas_core"], kind.get("OPENBLAS_CORETYPE", provenance["blas_core"]))
        self.assertEqual(provenance["instruction_level"], kind.get("TOUCHFIELD_LEVEL", LEVELS[-1]))

    def test_held_phases_press_alike(self):
        lu = ("solve.solver=lu", "solve.precision=double")
        single = ("solve.solver=matrix_free", "solve.precision=single", "solve.tolerance=1e-5")
        # Polishing multiplies in single precision whatever the solver: our own levels, not the BLAS cores, differ by that.
        for scheme, sets, of_cores, of_levels in [("burton_miller", lu, 1e-9, 1e-9), ("burton_miller_polished", lu, 1e-9, 1e-6),
                                                  ("burton_miller_polished", single, 1e-4, 1e-4)]:
            expected = {}
            for kind, run in self.runs(HELD, *[word for change in (*sets, f"solve.scheme={scheme}", "solve.resonance_check=never")
                                                  for word in ("--set", change)]):
                p, area = run["methods/fixed/pressure"][:], run["mesh/area"][:]
                name = next(iter(kind))
                most = of_cores if name == "OPENBLAS_CORETYPE" else of_levels
                self.assertLess(relative_l2(area, p, expected.setdefault(name, p)), most, f"{kind}, {scheme}, {sets}")

    def test_solved_phases_cost_alike(self):
        costs = {}
        for kind, run in self.runs(SOLVED):
            for method in ("surface", "paper"):
                cost = run[f"methods/{method}/cost"][-1]
                first = costs.setdefault(method, cost)
                self.assertLess(abs(cost - first), 1e-3 * first, f"{kind}, {method}")

    def test_a_level_that_is_none_is_refused(self):
        done = self.under({"TOUCHFIELD_LEVEL": "v9"}, "run", self.write("scene.yaml", HELD), "-o", "out")
        self.assertEqual(done.returncode, 2)
        self.assertIn("TOUCHFIELD_LEVEL = 'v9' must be a level", done.stderr)
        self.assertFalse((self.folder / "out").exists())

    def doctor(self, kind):
        done = self.under(kind, "doctor", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def shim(self, name, condition):
        """A library that has OpenBLAS say "Prescott" where `condition` holds, as it does of processors it does not know."""
        source = self.write(f"{name}.c", '#define _GNU_SOURCE\n#include <dlfcn.h>\n#include <stdlib.h>\n'
                                         'char* openblas_get_corename(void) {\n'
                                         f'  if ({condition}) return "Prescott";\n'
                                         '  return ((char* (*)(void))dlsym(RTLD_NEXT, "openblas_get_corename"))();\n}\n')
        library = self.folder / f"{name}.so"
        subprocess.run(["cc", "-shared", "-fPIC", "-o", library, source, "-ldl"], check=True)
        return {"LD_PRELOAD": str(library)}

    @unittest.skipUnless("v3" in LEVELS and shutil.which("cc"), "needs AVX2 and a C compiler")
    def test_a_processor_that_openblas_does_not_know(self):
        fitting = self.doctor({})["BLAS"]
        unknown = self.shim("unknown", 'getenv("OPENBLAS_CORETYPE") == NULL')
        blas = self.doctor(unknown)["BLAS"]
        self.assertIn("chosen by touchfield", blas["state"])
        self.assertNotIn("Prescott", blas["state"])
        self.assertEqual(blas["advice"], fitting["advice"])
        # The user's choice stands.
        kept = self.doctor({**unknown, "OPENBLAS_CORETYPE": "Prescott"})["BLAS"]
        self.assertIn("core Prescott (chosen by OPENBLAS_CORETYPE)", kept["state"])
        self.assertIn("unset it", kept["advice"])
        # Where even the choice is of no use: started again once and not for ever, and said.
        stuck = self.shim("stuck", "1")
        self.assertIn("OpenBLAS runs slow kernels", self.doctor(stuck)["BLAS"]["advice"])
        done = self.under(stuck, "run", self.write("scene.yaml", HELD), "-o", "stuck")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("OpenBLAS runs slow kernels", done.stderr)

    def test_doctor_has_a_line_for_each(self):
        found = self.doctor({})
        self.assertEqual(list(found), ["program", "processor", "BLAS", "threads", "speed", "memory", "disk", "card",
                                       "libraries", "pictures"])
        self.assertEqual(found["pictures"]["advice"], "")
        slow = self.doctor({"TOUCHFIELD_LEVEL": "generic", "OMP_NUM_THREADS": "4000"})
        self.assertIn("TOUCHFIELD_LEVEL", slow["processor"]["advice"])
        self.assertIn("more threads than cores", slow["threads"]["advice"])
        # A machine without any font: Cairo's own strokes.
        bare = self.write("fonts.conf", "<fontconfig><cachedir>/nowhere</cachedir></fontconfig>")
        cores = {"OMP_NUM_THREADS": str(len(os.sched_getaffinity(0)))}
        active = self.doctor({**cores, "OMP_WAIT_POLICY": "active", "FONTCONFIG_FILE": str(bare)})
        self.assertIn("GOMP_SPINCOUNT=4000", active["threads"]["advice"])
        self.assertIn("fonts-dejavu-core", active["pictures"]["advice"])


if __name__ == "__main__":
    unittest.main()
