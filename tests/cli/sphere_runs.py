"""Spheres of given ka through the command line, as mesh files the tests write, against the exact series."""

import numpy

from meshes import icosphere, write_ply
from sphere_series import K, plane_wave_errors
from support import CommandTest, open_run

SCENE = """\
name: sphere
array: {{plane_wave: {{direction: [0, 0, 1]}}}}
body: {{mesh: {{file: {mesh}, unit: mm}}}}
solve: {{methods: [{methods}], resonance_check: never{options}}}
evaluation: none
write: [h5]
"""


class SphereRuns(CommandTest):
    def errors(self, splits, ka, *schemes, options="", write=write_ply, ending="ply"):
        """Of each scheme on 20 x 4^splits faces, relative L2 of the complex pressure; and the most steps of GMRES."""
        mesh = self.folder / f"sphere.{ending}"
        write(mesh, *icosphere(splits, ka / K * 1e3))
        methods = ", ".join(f"{{fixed: {{as: {scheme}, scheme: {scheme}, phases_rad: 0}}}}" for scheme in schemes)
        scene = self.write("sphere.yaml", SCENE.format(mesh=mesh.name, methods=methods,
                                                       options=options and f", {options}"))
        self.run_ok("run", scene, "-o", "sphere", "--force", "--quiet")
        with open_run(self.folder / "sphere") as run:
            count = len(run["mesh/area"])
            self.assertEqual(count, 20 * 4**splits)
            found = plane_wave_errors(run, ka / K, schemes)
            self.assertTrue(numpy.all(run["solves/converged"][:] == 1))
            steps = int(run["solves/steps"][:].max())
        print(f"{count} faces, ka {ka:.4f}: "
              + ", ".join(f"{name} {100 * error:.2f} %" for name, error in found.items()) + f"; {steps} steps",
              flush=True)
        return found, steps
