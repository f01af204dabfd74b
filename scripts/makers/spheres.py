"""Scattering of plane waves by spheres against exact series, and the accuracy indicator on spheres and other bodies.

Errors are relative L2 errors of the complex pressure on the skin.
"""

import json
import math
import warnings

import h5py
import numpy
from work import sets

SCHEMES = ["paper", "paper_corrected", "chief", "burton_miller", "burton_miller_polished"]
SCENE = """\
name: body
array: {{plane_wave: {{direction: {direction}}}}}
{body}
solve: {{methods: [{methods}], resonance_check: never}}
evaluation: {evaluation}
write: [h5]
"""


def solved(work, body, schemes, direction="[0, 0, 1]", evaluation="none", options=(), **how):
    """The scene, and the open run, of each scheme's pressures in a plane wave."""
    methods = ", ".join(f"{{fixed: {{as: {scheme}, scheme: {scheme}, phases_rad: 0}}}}" for scheme in schemes)
    scene, out = work.runs / "scene.yaml", work.runs / "out"
    scene.write_text(SCENE.format(direction=direction, body=body, methods=methods, evaluation=evaluation))
    work.call("run", scene, "-o", out, "--force", "--quiet", *options, **how)
    return scene, h5py.File(out / "run.h5")


def errors(work, body, radius, schemes):
    """Number of faces of a sphere of this radius [m], and the error of each scheme."""
    from sphere_series import plane_wave_errors
    with solved(work, f"body: {body}", schemes)[1] as run:
        return len(run["mesh/area"]), plane_wave_errors(run, radius, schemes)


def from_file(work, ka, splits, schemes):
    """On 20 x 4^splits faces, by way of a mesh file."""
    from meshes import icosphere, write_ply
    from sphere_series import K
    write_ply(work.runs / "sphere.ply", *icosphere(splits, ka / K * 1e3))
    return errors(work, "{mesh: {file: sphere.ply, unit: mm}}", ka / K, schemes)


def accuracy(work):
    """Built-in spheres; finer ones from mesh files; time and memory of the whole process for those."""
    from sphere_series import K
    built_in, files, sizes = [], [], []
    for ka in (5.10, 5.858277, math.pi, 4.493409, 9.424778):
        for edges in (3, 4, 6, 10) if ka < 7 else (3, 4, 6):
            body = f"{{sphere: {{radius_mm: {ka / K * 1e3!r}}}, edge_mm: {2 * math.pi / K * 1e3 / edges!r}}}"
            count, found = errors(work, body, ka / K, SCHEMES)
            built_in.append({"ka": f"{ka:.4f}", "edges a wavelength": edges, "faces": count, **{scheme: f"{error:.6g}" for scheme, error in found.items()}})
    for ka, splits, schemes in ((13, 4, SCHEMES[1:]), (25, 5, SCHEMES[3:])):
        count, found = from_file(work, ka, splits, schemes)
        edge = math.sqrt(4 / math.sqrt(3) * 4 * math.pi * ka**2 / count)  # times k, of an equilateral face
        files += [{"ka": ka, "faces": count, "edges a wavelength": f"{2 * math.pi / edge:.1f}", "scheme": scheme, "error": f"{error:.6g}"}
                  for scheme, error in found.items()]
    for ka, splits in ((13, 4), (25, 5), (50, 6)):
        count, found = from_file(work, ka, splits, SCHEMES[4:])
        seconds, gib = work.taken
        sizes.append({"faces": f"{count:,}", "ka": ka, "seconds": f"{seconds:.2g}", "GiB": f"{gib:.2g}", "error": f"{100 * found[SCHEMES[4]]:.2f} %"})
    return {"spheres": built_in, "spheres_from_files": files, "sphere_sizes": sizes}


def indicator(work):
    """The error elsewhere than on spheres is against the polished scheme on the mesh with every face split in four (twice on the capsule)."""
    from sphere_series import K, plane_wave_errors
    bodies = [(f"sphere ka {ka:g}", f"sphere: {{radius_mm: {1e3 * ka / K!r}}}", edge, 0, ka / K)
              for ka, edge in ((6, 2.2), (6, 1.3), (13, 2.2), (13, 1.34), (3.14159265, 1.3))]
    bodies += [("capsule", "capsule: {radius_mm: 8, length_mm: 20}", edge, 2, None) for edge in (2.5, 1.7)]
    bodies += [("hand", "hand: {breadth_mm: 55, length_mm: 125}", edge, 1, None) for edge in (2.8, 1.72)]
    for name, body, edge, splits, radius in bodies:
        for scheme in ("paper_corrected", "burton_miller", "burton_miller_polished"):
            scene, run = solved(work, f"body: {{{body}, edge_mm: {edge}}}", [scheme],
                                evaluation=f"{{scheme: burton_miller_polished, split: {splits}}}" if splits else "none")
            with run:
                error = plane_wave_errors(run, radius, [scheme])[scheme] if radius else float(run[f"methods/{scheme}"].attrs["evaluation_difference"])
            report = json.loads(work.call("check", scene, "--accuracy", "--json", *sets([f"solve.scheme={scheme}"])))
            split = report["accuracy_split"]
            yield {"body": name, "edges a wavelength": f"{report['epw_mean']:.1f}", "faces": report["faces"], "scheme": scheme,
                   "indicator, rms": f"{report['accuracy_l2']:.6g}", "worst": f"{report['accuracy_max']:.6g}",
                   "split mesh": "" if split is None else f"{split:.6g}", "error": f"{error:.6g}"}


RADIUS = 5.0  # of spheres in a row [mm]
DIRECTION = numpy.array([0.6, 0.0, 0.8])  # at 53 degrees from the row
CLUSTER_SCHEMES = SCHEMES[1:]
NEAR = 2.0  # to another sphere [mm]


def centres(count, gap):
    return [numpy.array([(2 * RADIUS + gap) * (i - (count - 1) / 2), 0.0, 0.0]) for i in range(count)]


class Cluster:
    """Pressures of a plane wave on rigid spheres in a row, by waves up to `order` about each (acoutreams). Spheres are 1e12 times as dense as air."""

    def __init__(self, count, gap, order):
        import acoutreams
        from sphere_series import K

        self.k, self.code, self.centres = 1e-3 * K, acoutreams, centres(count, gap)  # [1/mm]
        air, rigid = acoutreams.AcousticMaterial(1.3, 343), acoutreams.AcousticMaterial(1e12, 1e5)
        sphere = acoutreams.AcousticTMatrix.sphere(order, self.k, RADIUS, [rigid, air])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            cluster = acoutreams.AcousticTMatrix.cluster([sphere] * count, self.centres).interaction.solve()
            wave = acoutreams.plane_wave_scalar(list(self.k * DIRECTION), k0=self.k, material=air)
            scattered = cluster @ wave.expand(cluster.basis)
        self.basis, self.coefficients = scattered.basis, numpy.asarray(scattered).ravel()

    def __call__(self, points):
        total = numpy.exp(1j * self.k * (points @ DIRECTION))
        for i, centre in enumerate(self.centres):
            mine = self.basis.pidx == i
            r, theta, phi = self.code.car2sph(points - centre).T[:, :, None]
            total = total + self.code.ssw_Psi(self.basis.l[mine], self.basis.m[mine], self.k * r, theta, phi) @ self.coefficients[mine]
        return total

    def slope(self):
        """The largest normal derivative on the skin, relative to k: 0 of a perfect solution."""
        normals = numpy.random.default_rng(1).normal(size=(300, 3))
        normals /= numpy.linalg.norm(normals, axis=1)[:, None]
        step = 1e-3
        return max(abs(self(centre + (RADIUS + step) * normals) - self(centre + (RADIUS - step) * normals)).max() / (2 * step * self.k)
                   for centre in self.centres)


def cluster_errors(work, count, gap, edge, reference):
    """A row of the table: errors over all faces, and over those near another sphere."""
    bodies = "bodies:\n" + "\n".join(f"  - {{name: s{i}, sphere: {{radius_mm: {RADIUS}}}, place: {{at_mm: {at.tolist()}}}, edge_mm: {edge}}}"
                                     for i, at in enumerate(centres(count, gap)))
    with solved(work, bodies, CLUSTER_SCHEMES, DIRECTION.tolist())[1] as run:
        at, area = 1e3 * run["mesh/vertices"][:][run["mesh/triangles"][:]].mean(axis=1), run["mesh/area"][:]
        found = {scheme: run[f"methods/{scheme}/pressure"][:] for scheme in CLUSTER_SCHEMES}
    away = numpy.array([numpy.linalg.norm(at - centre, axis=1) for centre in centres(count, gap)])
    own = numpy.array(centres(count, gap))[away.argmin(axis=0)]
    exact = reference(own + RADIUS * (at - own) / away.min(axis=0)[:, None])  # a centroid lies a little below the skin
    near = numpy.sort(away, axis=0)[1] - RADIUS < NEAR
    row = {"spheres": count, "gap_mm": f"{gap:g}", "edge_mm": edge, "faces": len(area)}
    for scheme, p in found.items():
        for name, some in ((scheme, near | True), (f"{scheme}_near", near)):
            error = math.sqrt(numpy.sum((area * abs(p - exact)**2)[some]) / numpy.sum((area * abs(exact)**2)[some])) if some.any() else math.nan
            row[name] = f"{error:.4f}"
    return row


def clusters(work):
    for count in (2, 3):
        for gap in (10, 5, 2, 1, 0.5):
            reference = Cluster(count, gap, 16 if gap < 2 else 12)
            for edge in (1.5, 0.75):
                yield cluster_errors(work, count, gap, edge, reference) | {"reference_slope": f"{reference.slope():.1e}"}
