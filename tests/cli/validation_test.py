"""Scenes of scenes/validation: widths of foci against closed form and publication."""

import math
import unittest

import numpy

from support import SOURCE, CommandTest, open_run

WAVELENGTH = 343.21 / 40  # mm


class Validation(CommandTest):
    def focus(self, scene, *arguments):
        """Width at half maximum [mm], force on the target [mN], and distance between the first minima along x [mm]."""
        self.run_ok("run", SOURCE / f"scenes/validation/{scene}.yaml", "-o", "out", "--force", "--quiet", "--set", "field=[]",
                    "--set", "write=[h5]", *arguments)
        with open_run(self.folder / "out") as run:
            method = run["methods/focus"]
            centroid = 1e3 * run["mesh/vertices"][:][run["mesh/triangles"][:]].mean(axis=1)
            bottom = (numpy.ptp(1e3 * run["mesh/vertices"][:][run["mesh/triangles"][:]][:, :, 2], axis=1) < 1e-6) & (
                centroid[:, 2] < centroid[:, 2].mean())
            strip = bottom & (abs(centroid[:, 1]) < 2)
            x, p = abs(centroid[strip, 0]), abs(method["pressure"][:][strip])
            steps = numpy.arange(0.5, 20, 1.0)
            mean = numpy.array([numpy.sqrt(numpy.mean(p[abs(x - at) < 1.0] ** 2)) for at in steps])
            first = next(i for i in range(1, len(mean) - 1) if mean[i] < mean[i - 1] and mean[i] < mean[i + 1])
            return float(method.attrs["width_mm"]), 1e3 * float(method.attrs["force_target_n"]), 2 * steps[first]

    def closed_form(self, aperture, height):
        """Half-power width of an unshaded line of this length: 0.443 lambda / sin(half its angle)."""
        return 0.443 * WAVELENGTH / math.sin(math.atan(0.5 * aperture / height))

    def test_the_published_focus_of_18_by_18_transducers(self):
        width, force, minima = self.focus("hoshi_2010")
        line = self.closed_form(180, 200)
        print(f"18 x 18: width {width:.2f} mm (a line {line:.2f}), minima {minima:.1f} mm apart (2 lambda R / D "
              f"{2 * WAVELENGTH * 200 / 180:.1f}, published 20), {force:.1f} mN (published 16)")
        self.assertAlmostEqual(width / line, 1, delta=0.12)
        self.assertAlmostEqual(minima, 20, delta=2)  # bins of 1 mm a side
        self.assertGreater(force, 16)  # every transducer at full level, no losses

    def test_the_focus_of_an_autd3_unit(self):
        for turn, aperture in [(0, 18 * 10.16), (90, 14 * 10.16)]:
            width, _, _ = self.focus("autd3_focus", "--set", f"target.box.rotate_deg=[0, 0, {turn}]")
            line = self.closed_form(aperture, 150)
            print(f"AUTD3, turned by {turn}: width {width:.2f} mm, a line {line:.2f}")
            self.assertAlmostEqual(width / line, 1, delta=0.12)


if __name__ == "__main__":
    unittest.main()
